"""A small campaign with snapshots at common loads, and boundary elements that differ by known amounts."""

import itertools
from functools import cache

import numpy as np
import small_campaign as small
import xarray as xr

import icha
from icha.analysis.model_error import contact_of_spots, model_error
from icha.contact.attraction import FINITE_RANGE, NO_ATTRACTION, SHORT_RANGE
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import RunLabels

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


def own_patches(run, *, area=1.0, separation=1.0, attraction=SHORT_RANGE):
    """Return a run of boundary elements made from one of asperities: area and separation multiplied, spots as maps."""
    maps = [contact_of_spots(run, k, GRID) for k in range(run.sizes["snapshot"])]
    step = xr.zeros_like(run["reduced_pressure"])
    attraction = attraction if run["surface_energy"] > 0 else NO_ATTRACTION
    energetic = {"energetic_area_fraction": run["contact_area_fraction"] * area * 1.2}
    return run.assign(
        resolved_tension=0.1 * run["contact_modulus"],
        contact_area_fraction=run["contact_area_fraction"] * area,
        reduced_separation=run["reduced_separation"] * separation,
        front_residual=step + 1e-4,
        gap_residual=step,
        contact_map=(("snapshot", "row", "column"), np.array(maps, np.float32)),
        contact_pressure=(("snapshot", "row", "column"), np.zeros((len(maps), GRID, GRID), np.float32)),
        **(energetic if attraction == FINITE_RANGE else {}),
    ).assign_attrs(contact_model="boundary_elements", attraction=attraction)


def patches(keep=lambda labels: True, **factors):
    """Return runs of boundary elements for the runs of asperities that `keep` selects; factors may depend on seeds."""
    return [
        (labels._replace(model="boundary_elements"), own_patches(run, **_of_seed(factors, labels.seed)))
        for labels, run in runs().items()
        if keep(labels)
    ]


def _of_seed(factors, seed):
    return {name: factor[seed] if isinstance(factor, dict) else factor for name, factor in factors.items()}


@cache
def tree_of_both(**factors):
    """The campaign with the runs of `patches` as its second model."""
    return campaign_tree([*runs().items(), *patches(**factors)])


AREA_FACTORS = {1: 1.1, 2: 1.2, 3: 1.6}


@cache
def patches_at_finite_range():
    """Boundary elements with more area, by a factor of the seed with adhesion and by a quarter without."""
    return [
        *patches(lambda labels: labels.material == "soft", area=AREA_FACTORS, attraction=FINITE_RANGE),
        *patches(lambda labels: labels.material == "hertz", area=1.25, separation=0.8),
    ]


@cache
def tree_at_finite_range():
    """The campaign with the runs of `patches_at_finite_range` as its second model."""
    return campaign_tree([*runs().items(), *patches_at_finite_range()])


@cache
def errors():
    """The error against `patches_at_finite_range`."""
    return model_error(tree_at_finite_range(), patches_at_finite_range())
