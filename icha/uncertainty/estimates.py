"""Estimate the results of every study that has boundary elements for several seeds, with intervals.

The asperity model for many seeds, boundary elements on half the grid for some seeds, and boundary elements on the grid
for a few seeds are combined (`icha.uncertainty.control_variates`). The coarse runs of a study are in the study that
`coarse_study` names. If parameters are sampled, the scatter of the results over the sampled cases widens the interval.
"""

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.datasets.attributes import DERIVED, combine_attributes
from icha.datasets.build import build_dataset, stack_rows
from icha.datasets.campaign import loading_stops
from icha.datasets.labels import LABELS, coarse_study, inputs_study, is_derived_study, slopes_at
from icha.datasets.variables.answers import ANSWERS, WITHOUT_ESTIMATE
from icha.datasets.variables.run import OF_LOSS
from icha.path.targets import ESTIMATED_AT_TARGETS, ESTIMATED_OF_LOOPS, OF_ADHESION, OF_SQUARES, SIGNED
from icha.support.formatting import format_count
from icha.uncertainty.control_variates import LEVELS, PROBABILITY, estimate_quantity
from icha.uncertainty.grid_error import cells_of_length, error_beyond, nodes_of
from icha.uncertainty.left_out import (
    ENDED_EARLY,
    NO_FIT,
    NOT_POSITIVE,
    WITHOUT_RUN,
    causes_of_runs,
    find_left_out,
    varied_parameters,
)

LOOP = "loop"


def estimate_campaign(tree: xr.DataTree, *, asperities: bool = True, attrs: Mapping[str, str] = {}) -> xr.DataTree:
    """Return a tree with the answers of each study that has boundary elements for several seeds.

    Parameters
    ----------
    tree : the campaign dataset.
    asperities : whether to use the runs of the asperity model.
    attrs : further global attributes.

    Returns
    -------
    DataTree with one group for each study with answers. The variables are those of
    `icha.datasets.variables.answers`, along the dimension `answer`.
    """
    groups = {}
    for name, node in tree.children.items():
        if is_derived_study(name, tree.children):
            continue
        coarse, inputs = (tree.children.get(of(name)) for of in (coarse_study, inputs_study))
        coarse, inputs = (each and each.to_dataset() for each in (coarse, inputs))
        rows = list(_answers(node.to_dataset(), coarse, inputs, asperities))
        if rows:
            described = combine_attributes(f"Answers of study {name}", _SUMMARY, DERIVED, [node.attrs])
            values = stack_rows(ANSWERS, rows, "answer")
            groups[f"/{name}"] = build_dataset(ANSWERS, values, described | {"study": name})
    root = combine_attributes("Answers of every study", _SUMMARY, DERIVED, [each.attrs for each in groups.values()])
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=root | dict(attrs))} | groups)


_SUMMARY = "Means over random surfaces with intervals of 90 %, from up to three levels of accuracy."


def _answers(
    study: xr.Dataset, coarse: xr.Dataset | None, inputs: xr.Dataset | None, asperities: bool
) -> Iterator[dict]:
    """Yield the answers of a study; `coarse` has its contacts on half the grid, `inputs` its sampled parameters."""
    if REFERENCE_MODEL not in study["model"].values or study.sizes["seed"] < 2:
        return
    levels = {"asperities": (study if asperities else None, DEFAULT_MODEL), "coarse": (coarse, REFERENCE_MODEL)}
    levels |= {"fine": (study, REFERENCE_MODEL)}
    runs = study.sel(model=REFERENCE_MODEL)
    lengths, nodes, energies = (
        each.broadcast_like(runs["status"]).min("seed").transpose(*CONTACT).values
        for each in (cells_of_length(runs), nodes_of(runs), runs["surface_energy"])
    )
    of_loop = np.full([study.sizes[dim] for dim in DIMS], np.nan)
    every = (*ESTIMATED_AT_TARGETS, *ESTIMATED_OF_LOOPS)
    for (kind, target), quantity in itertools.product([*stops_of(study), (LOOP, 0.0)], every):
        prescribed = kind in ESTIMATED_AT_TARGETS.get(quantity, ())
        if (kind == LOOP) != (quantity in ESTIMATED_OF_LOOPS) or prescribed or quantity not in study:
            continue
        values = {level: values_of(data, model, quantity, kind, target) for level, (data, model) in levels.items()}
        areas, patches = (
            of_loop if kind == LOOP else values_of(study, REFERENCE_MODEL, name, kind, target).values
            for name in ("contact_area_fraction", "spot_count")
        )
        known = study[quantity].notnull().any([dim for dim in study[quantity].dims if dim != "surface"]).values
        for place in itertools.product(*(range(study.sizes[dim]) for dim in CONTACT)):
            if quantity in OF_SQUARES and not known[place[0]]:
                continue  # a periodic surface
            if quantity in OF_ADHESION and not energies[place] > 0:
                continue
            by_seed, left_out, note = _levels_at(values, place)
            if any(math.isinf(value) for level in by_seed.values() for value in level.values()):
                continue  # the stiffness of full contact
            mean = estimate_quantity(by_seed["asperities"], by_seed["coarse"], by_seed["fine"])
            if mean is None and (left_out[-1].wanted < 2 or not any(each.words for each in left_out)):
                continue  # the design has no interval
            share_inputs, *of_cases = _scatter_of_inputs(inputs, quantity, kind, target)
            left_out += of_cases
            surface, slope, material = place
            at = (slice(None), *place)
            known_error = mean.relative.grid if mean else math.nan
            size = lengths[place], _mean(patches[at]), _mean(areas[at]) * nodes[place]
            yield {
                "quantity": quantity,
                "units": study[quantity].attrs["units"],
                "surface": str(study["surface"].values[surface]),
                "rms_slope": float(slopes_at(study, {"surface": surface})[slope]),
                "material": str(study["material"].values[material]),
                "stop_kind": kind,
                "stop_target": target,
                "grid_error": error_beyond(known_error, quantity, *size),
                "share_inputs": share_inputs,
                **_estimate(quantity, mean, share_inputs, all(each.has_interval for each in left_out)),
                "asperity_seeds": len(by_seed["asperities"]),
                "coarse_seeds": len(by_seed["coarse"]),
                "fine_seeds": len(by_seed["fine"]),
                "full_contact_seeds": int((areas[at] == 1).sum()),
                "left_out": ". ".join(filter(None, (note, *(each.sentence for each in left_out)))),
                "biased": int(any(each.biased for each in left_out)),
            }


def _mean(values):
    """Return the mean of the values that are not NaN; NaN without such values."""
    return float(np.nanmean(values)) if np.isfinite(values).any() else math.nan


def _estimate(quantity, mean, share_inputs, has_interval):
    """Return the values of an estimate and its interval; NaN without an estimate or an interval."""
    if mean is None:
        nothing = (*WITHOUT_ESTIMATE, "estimate_low", "estimate_high", "share_grid")
        return dict.fromkeys(nothing, math.nan) | {"geometric": 0}
    found = mean.relative
    half_width = math.hypot(found.half_width, 0.0 if math.isnan(share_inputs) else share_inputs)
    low, high = mean.interval(half_width, signed=quantity in SIGNED)
    if quantity == "contact_area_fraction":
        high = min(high, 1.0)
    if quantity == "spot_count":  # all runs have a patch if their mean is at least 1
        low = max(low, min(mean.value, 1.0))
    return {
        "estimate": mean.value,
        "estimate_low": low if has_interval else math.nan,
        "estimate_high": high if has_interval else math.nan,
        "share_seeds": found.scatter,
        "share_model": found.model,
        "share_refinement": found.refinement,
        "share_grid": found.grid,
        "asperity_coefficient": found.coefficient,
        "degrees_of_freedom": found.freedom,
        "geometric": int(mean.logarithmic),
    }


def _levels_at(values, place):
    """Return the values of a contact by level and seed, the seeds that each level leaves out, and a note.

    A level uses only seeds that the cheaper levels also have; a level without any value is not part of the estimate.
    The asperity model is not used if it has no value for a seed of boundary elements that has one, or if it has only
    the seeds of the next level: then it tells nothing about other seeds.
    """
    at = (slice(None), *place)
    present = {level: of for level, of in values.items() if of is not None}
    causes = {level: dict(zip(of.seeds, of.causes[at], strict=True)) for level, of in present.items()}
    by_seed, left_out, lacking, note = {level: {} for level in values}, [], {}, ""
    complete = {seed for level in ("coarse", "fine") for seed, why in causes.get(level, {}).items() if not why}
    of_asperities = causes.get("asperities", {})
    lost = [of_asperities[seed] for seed in complete if of_asperities.get(seed, "") not in ("", *WITHOUT_RUN)]
    if lost:
        seeds = f"{format_count(len(lost), 'seed')} of boundary elements"
        note = f"the asperity model is not used, because it has no value for {seeds} ({lost[0]})"
        del causes["asperities"]
    for level, of_level in causes.items():
        why = {seed: cause or lacking.get(seed, "") for seed, cause in of_level.items()}
        of_seeds = zip(of_level, present[level].values[at], strict=True)
        by_seed[level] = {seed: float(value) for seed, value in of_seeds if not why[seed]}
        if by_seed[level] or level == "fine":
            lacking = why
            left_out.append(find_left_out(f"seeds of {LEVELS[level]}", list(why.values())))
    if by_seed["asperities"].keys() == (by_seed["coarse"] or by_seed["fine"]).keys():
        by_seed["asperities"] = {}
    return by_seed, left_out, note


def _scatter_of_inputs(inputs, quantity, kind, target):
    """Return half the width of the interval that 90 % of the sampled cases are in, in the logarithm of a quantity.

    A second value describes the cases that are left out; there is no such value without sampled parameters.
    """
    if inputs is None:
        return (math.nan,)
    found = values_of(inputs, inputs["model"].values[0], quantity, kind, target)
    values = found.values.astype(float)
    causes = np.where((found.causes == "") & ~(values > 0), NOT_POSITIVE, found.causes)
    left_out = find_left_out("sampled cases", causes.ravel(), varied_parameters(inputs.isel(model=0), DIMS))
    logarithms = np.log(values[np.isfinite(values) & (values > 0)])
    # With fewer cases, the quantiles would depend on one case alone.
    if len(logarithms) < 1 / (1 - PROBABILITY):
        return math.nan, left_out
    width = float(np.diff(np.quantile(logarithms, [0.5 - PROBABILITY / 2, 0.5 + PROBABILITY / 2]))[0])
    return width / 2, left_out


CONTACT = ("surface", "rms_slope", "material")
DIMS = ("seed", *CONTACT)


def stops_of(study):
    """Return kind and value of the targets of the first loading of a study, in the order of the path."""
    shown = loading_stops(study).transpose(*LABELS, "step").values
    kinds, targets = (study[name].transpose(*LABELS, "step").values[shown] for name in ("step_kind", "step_target"))
    return sorted({(str(kind), float(target)) for kind, target in zip(kinds, targets, strict=True)})


class Values(NamedTuple):
    """Values of a quantity of all runs with one model.

    Attributes
    ----------
    values : values along seed, surface, slope and material; NaN where a run has none.
    causes : why a run has no value (`icha.uncertainty.left_out`), along the same dimensions; empty where it has one.
    seeds : the seeds.
    """

    values: np.ndarray
    causes: np.ndarray
    seeds: list[int]


def values_of(data, model, quantity, kind, target) -> Values | None:
    """Return the values of a quantity at a target, or of the loop; None without runs."""
    if data is None or model not in data["model"].values or quantity not in data:
        return None
    runs = data.isel(model=data["model"].values.tolist().index(model))
    values = runs[quantity]
    if kind != LOOP:
        same = np.isclose(runs["step_target"], target, rtol=1e-9, atol=0)
        values = values.where(loading_stops(runs) & (runs["step_kind"] == kind) & same).max("step")
    causes = causes_of_runs(runs, values, of_loss=quantity in OF_LOSS)
    if quantity.startswith("work_of_adhesion"):
        causes = causes.where((causes != ENDED_EARLY) | runs["pull_off_force"].isnull(), NO_FIT)
    shown = (each.transpose(*DIMS).values for each in (values.where(causes == ""), causes))
    return Values(*shown, data["seed"].values.tolist())
