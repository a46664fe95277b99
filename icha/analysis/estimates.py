"""Estimate the results of every study that has boundary elements for several seeds, with intervals.

The asperity model for many seeds, boundary elements on half the grid for some seeds, and boundary elements on the grid
for a few seeds are combined (`icha.analysis.control_variates`). The coarse runs of a study are in the study that
`coarse_study` names. If parameters are sampled, the scatter of the results over the sampled cases widens the interval.
"""

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from icha.analysis.control_variates import PROBABILITY, estimate_quantity
from icha.analysis.grid_error import cells_of_length, error_beyond, nodes_of
from icha.analysis.left_out import (
    ENDED_EARLY,
    NO_FIT,
    NOT_POSITIVE,
    WITHOUT_RUN,
    causes_of_runs,
    find_left_out,
    varied_parameters,
)
from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.datasets.attributes import DERIVED, combine_attributes
from icha.datasets.build import build_dataset, stack_rows
from icha.datasets.campaign import loading_stops
from icha.datasets.labels import LABELS, coarse_study, inputs_study, is_derived_study, slopes_at
from icha.datasets.variables.answers import ANSWERS
from icha.datasets.variables.run import OF_LOSS
from icha.path.targets import ESTIMATED_AT_TARGETS, ESTIMATED_OF_LOOPS, OF_ADHESION, OF_SQUARES, SIGNED

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
    of_runs = cells_of_length(runs), nodes_of(runs)
    of_runs += (runs["surface_energy"],)
    lengths, nodes, energies = (
        each.broadcast_like(runs["status"]).min("seed").transpose(*CONTACT).values for each in of_runs
    )
    every = (*ESTIMATED_AT_TARGETS, *ESTIMATED_OF_LOOPS)
    for (kind, target), quantity in itertools.product([*stops_of(study), (LOOP, 0.0)], every):
        prescribed = kind in ESTIMATED_AT_TARGETS.get(quantity, ())
        if (kind == LOOP) != (quantity in ESTIMATED_OF_LOOPS) or prescribed or quantity not in study:
            continue
        values = {level: values_of(data, model, quantity, kind, target) for level, (data, model) in levels.items()}
        known = study[quantity].notnull().any([dim for dim in study[quantity].dims if dim != "surface"]).values
        areas = values_of(study, REFERENCE_MODEL, "contact_area_fraction", kind, target) if kind != LOOP else None
        patches = values_of(study, REFERENCE_MODEL, "spot_count", kind, target) if kind != LOOP else None
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
            area, count = (_mean_at(each, place) for each in (areas, patches))
            known_error = mean.relative.grid if mean else math.nan
            yield {
                "quantity": quantity,
                "units": study[quantity].attrs["units"],
                "surface": str(study["surface"].values[surface]),
                "rms_slope": float(slopes_at(study, {"surface": surface})[slope]),
                "material": str(study["material"].values[material]),
                "stop_kind": kind,
                "stop_target": target,
                "grid_error": error_beyond(known_error, quantity, lengths[place], count, area * nodes[place]),
                "share_inputs": share_inputs,
                **_estimate(quantity, mean, share_inputs, all(each.has_interval for each in left_out)),
                "asperity_seeds": len(by_seed["asperities"]),
                "coarse_seeds": len(by_seed["coarse"]),
                "fine_seeds": len(by_seed["fine"]),
                "full_contact_seeds": sum(area == 1 for area in _levels_at({"fine": areas}, place)[0]["fine"].values()),
                "left_out": ". ".join(filter(None, (note, *(each.sentence for each in left_out)))),
                "biased": int(any(each.biased for each in left_out)),
            }


def _estimate(quantity, mean, share_inputs, has_interval):
    """Return the values of an estimate and its interval; NaN without an estimate or an interval."""
    if mean is None:
        nothing = ("estimate", "estimate_low", "estimate_high", "share_seeds", "share_model", "share_refinement")
        nothing += ("share_grid", "asperity_coefficient", "degrees_of_freedom")
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


_SEEDS_OF = {
    "asperities": "seeds of the asperity model",
    "coarse": "seeds of boundary elements on half the grid",
    "fine": "seeds of boundary elements",
}


def _levels_at(values, place):
    """Return the values of a contact by level and seed, the seeds that each level leaves out, and a note.

    A level uses only seeds that the cheaper levels also have; a level without any value is not part of the estimate.
    The asperity model is not used if it has no value for a seed of boundary elements that has one.
    """
    at = (slice(None), *place)
    found = {
        level: {seed: (value, cause) for seed, value, cause in zip(of.seeds, of.values[at], of.causes[at], strict=True)}
        for level, of in values.items()
        if of is not None
    }
    by_seed, left_out, lacking, note = {level: {} for level in values}, [], {}, ""
    of_cells = ("coarse", "fine")
    complete = {seed for level in of_cells for seed, (_, cause) in found.get(level, {}).items() if not cause}
    of_asperities = {seed: cause for seed, (_, cause) in found.get("asperities", {}).items()}
    lost = [of_asperities[seed] for seed in complete if of_asperities.get(seed, "") not in ("", *WITHOUT_RUN)]
    if lost:
        seeds = f"{len(lost)} seed{'s' * (len(lost) > 1)} of boundary elements"
        note = f"the asperity model is not used, because it has no value for {seeds} ({lost[0]})"
        del found["asperities"]
    for level, of_level in found.items():
        causes = {seed: cause or lacking.get(seed, "") for seed, (_, cause) in of_level.items()}
        by_seed[level] = {seed: float(value) for seed, (value, _) in of_level.items() if not causes[seed]}
        if by_seed[level] or level == "fine":
            lacking = causes
            left_out.append(find_left_out(_SEEDS_OF[level], list(causes.values())))
    return by_seed, left_out, note


def _mean_at(of_level, place):
    """Return the mean over the seeds of a level for a contact; NaN without values."""
    values = _levels_at({"fine": of_level}, place)[0]["fine"].values()
    return sum(values) / len(values) if values else math.nan


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
    causes : why a run has no value (`icha.analysis.left_out`), along the same dimensions; empty where it has one.
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
