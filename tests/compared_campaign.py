"""A small campaign with snapshots at common loads, and solutions beside it that differ by known amounts."""

import itertools
from functools import cache

import numpy as np
import small_campaign as small
import xarray as xr

import icha
from icha.analysis.model_error import SHARED, contact_of_spots, model_error, state_of
from icha.datasets.campaign import campaign_tree, find_snapshot
from icha.datasets.labels import RunLabels, SolutionLabels

PRESSURES = (3e-3, 1e-2)
GRID = 96


@cache
def runs():
    path = icha.Path(reduced_pressures=PRESSURES, snapshots=[("reduced_pressure", p) for p in PRESSURES], max_step=0.2)
    return {
        RunLabels("one", "asperities", "rough", seed, 1.0, material): icha.simulate(
            small.surface(seed), small.MATERIALS[material], path, seed=seed
        )
        for seed, material in itertools.product((1, 2, 3), ("soft", "hertz"))
    }


@cache
def tree():
    return campaign_tree(runs().items(), attrs={"title": "Compared campaign", "summary": "For tests."})


def own_solution(run, pressure, *, area=1.0, separation=1.0):
    """A solution made of the run's own state, with area and separation multiplied by known factors."""
    at = find_snapshot(run, "reduced_pressure", pressure)
    state = state_of(run, at)
    contact = contact_of_spots(run, at, GRID)
    kept = "gap_density gap_bin_edges pressure_density pressure_bin_mean pressure_bin_edges"
    return state[[*kept.split(), "seed", "rms_slope", *SHARED]].assign(
        contact=(("y", "x"), contact.astype(np.int8)),
        contact_area_fraction=state["contact_area_fraction"] * area,
        contact_area_fraction_raw=contact.mean(),
        energetic_area_fraction=state["contact_area_fraction"] * area * 1.2,
        reduced_separation=state["reduced_separation"] * separation,
        target_reduced_pressure=pressure,
        load_error=1e-5,
        residual=1e-9,
        grid=GRID,
    )


def solutions(entry="truth", keep=lambda labels: True, *, area=lambda labels: 1.0, separation=1.0):
    """Solutions of all runs that `keep` names, at all loads; `area` is a function of the run's labels."""
    return [
        (
            SolutionLabels(entry, labels.study, *labels[2:], p),
            own_solution(run, p, area=area(labels), separation=separation),
        )
        for labels, run in runs().items()
        if keep(labels)
        for p in PRESSURES
    ]


def own_patches(run, *, area=1.0, separation=1.0):
    """Return a run of boundary elements made from one of asperities: area and separation multiplied, spots as maps."""
    maps = [contact_of_spots(run, k, GRID) for k in range(run.sizes["snapshot"])]
    step = xr.zeros_like(run["reduced_pressure"])
    return run.assign(
        resolved_tension=0.1 * run["contact_modulus"],
        contact_area_fraction=run["contact_area_fraction"] * area,
        reduced_separation=run["reduced_separation"] * separation,
        front_residual=step + 1e-4,
        gap_residual=step,
        contact_map=(("snapshot", "row", "column"), np.array(maps, np.float32)),
        contact_pressure=(("snapshot", "row", "column"), np.zeros((len(maps), GRID, GRID), np.float32)),
    ).assign_attrs(contact_model="boundary_elements")


def patches(keep=lambda labels: True, **factors):
    """Return runs of boundary elements for those runs of asperities that `keep` selects."""
    return [
        (labels._replace(model="boundary_elements"), own_patches(run, **factors))
        for labels, run in runs().items()
        if keep(labels)
    ]


def tree_of_both(**factors):
    """The campaign with the runs of `patches` as its second model."""
    return campaign_tree([*runs().items(), *patches(**factors)])


AREA_FACTORS = {1: 1.1, 2: 1.2, 3: 1.6}


def solutions_of_errors():
    """Boundary elements with more area, by a factor of the seed with adhesion and by a quarter without."""
    adhesive = solutions(
        "adhesive", lambda labels: labels.material == "soft", area=lambda labels: AREA_FACTORS[labels.seed]
    )
    bare = solutions("bare", lambda labels: labels.material == "hertz", area=lambda labels: 1.25, separation=0.8)
    return [*adhesive, *bare]


@cache
def errors():
    """The error against `solutions_of_errors`, at finite ranges."""
    return model_error(tree(), solutions_of_errors())


@cache
def short_range_errors():
    """The error against `solutions_of_errors` and, in the limit of a short range, runs with half as much area again."""
    return model_error(tree(), solutions_of_errors(), runs=patches(area=1.5, separation=0.9))


def errors_at_own_slopes():
    """The errors of two surfaces, each at a slope of its own, as measured ones are."""
    parts = {}
    for name, node in errors().children.items():
        one = node.to_dataset()
        other = one.assign_coords(surface=["other"], rms_slope=[0.5])
        parts[f"/{name}"] = xr.merge([one, other], join="outer", compat="no_conflicts")
        parts[f"/{name}"].attrs = node.attrs
    return xr.DataTree.from_dict(parts)
