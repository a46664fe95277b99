"""Estimate the results of every study that has boundary elements for several seeds, with intervals.

The asperity model for many seeds, boundary elements on half the grid for some seeds, and boundary elements on the grid
for a few seeds are combined (`icha.analysis.control_variates`). The coarse runs of a study are in the study that
`coarse_study` names. If parameters are sampled, the scatter of the results over the sampled cases widens the interval.
"""

import itertools
import math
from collections.abc import Iterator, Mapping

import numpy as np
import xarray as xr

from icha.analysis.control_variates import PROBABILITY, estimate_quantity
from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.datasets.attributes import DERIVED, combine_attributes
from icha.datasets.build import build_dataset, stack_rows
from icha.datasets.campaign import loading_stops
from icha.datasets.labels import LABELS, coarse_study, inputs_study, is_derived_study, slopes_at
from icha.datasets.variables.answers import ANSWERS
from icha.datasets.variables.campaign import COMPLETE, LOADED_RUNS
from icha.path.targets import ESTIMATED_AT_TARGETS, ESTIMATED_OF_LOOPS, OF_SQUARES

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
    every = (*ESTIMATED_AT_TARGETS, *ESTIMATED_OF_LOOPS)
    for (kind, target), quantity in itertools.product([*stops_of(study), (LOOP, 0.0)], every):
        prescribed = kind in ESTIMATED_AT_TARGETS.get(quantity, ())
        if (kind == LOOP) != (quantity in ESTIMATED_OF_LOOPS) or prescribed or quantity not in study:
            continue
        values = {level: values_of(data, model, quantity, kind, target) for level, (data, model) in levels.items()}
        known = study[quantity].notnull().any([dim for dim in study[quantity].dims if dim != "surface"]).values
        areas = values_of(study, REFERENCE_MODEL, "contact_area_fraction", kind, target) if kind != LOOP else None
        for surface, slope, material in itertools.product(*(range(study.sizes[dim]) for dim in CONTACT)):
            if quantity in OF_SQUARES and not known[surface]:
                continue  # a periodic surface
            by_seed = {level: _by_seed(of_level, surface, slope, material) for level, of_level in values.items()}
            if any(math.isinf(value) for level in by_seed.values() for value in level.values()):
                continue  # the stiffness of full contact
            mean = estimate_quantity(by_seed["asperities"], by_seed["coarse"], by_seed["fine"])
            if mean is None:
                continue
            found = mean.relative
            share_inputs = _scatter_of_inputs(inputs, quantity, kind, target)
            low, high = mean.interval(math.hypot(found.half_width, 0.0 if math.isnan(share_inputs) else share_inputs))
            yield {
                "quantity": quantity,
                "units": study[quantity].attrs["units"],
                "surface": str(study["surface"].values[surface]),
                "rms_slope": float(slopes_at(study, {"surface": surface})[slope]),
                "material": str(study["material"].values[material]),
                "stop_kind": kind,
                "stop_target": target,
                "estimate": mean.value,
                "estimate_low": low,
                "estimate_high": min(high, 1.0) if quantity == "contact_area_fraction" else high,
                "share_seeds": found.scatter,
                "share_model": found.model,
                "share_refinement": found.refinement,
                "share_grid": found.grid,
                "share_inputs": share_inputs,
                "asperity_coefficient": found.coefficient,
                "degrees_of_freedom": found.freedom,
                "geometric": int(mean.logarithmic),
                "asperity_seeds": len(by_seed["asperities"]),
                "coarse_seeds": len(by_seed["coarse"]),
                "fine_seeds": len(by_seed["fine"]),
                "full_contact_seeds": sum(area == 1 for area in _by_seed(areas, surface, slope, material).values()),
            }


def _scatter_of_inputs(inputs, quantity, kind, target):
    """Return half the width of the interval that 90 % of the sampled cases are in, in the logarithm of a quantity."""
    if inputs is None:
        return math.nan
    values = values_of(inputs, inputs["model"].values[0], quantity, kind, target)[0].astype(float)
    logarithms = np.log(values[np.isfinite(values) & (values > 0)])
    # With fewer cases, the quantiles would depend on one case alone.
    if len(logarithms) < 1 / (1 - PROBABILITY):
        return math.nan
    return float(np.diff(np.quantile(logarithms, [0.5 - PROBABILITY / 2, 0.5 + PROBABILITY / 2]))[0]) / 2


CONTACT = ("surface", "rms_slope", "material")


def stops_of(study):
    """Return kind and value of the targets of the first loading of a study, in the order of the path."""
    shown = loading_stops(study).transpose(*LABELS, "step").values
    kinds, targets = (study[name].transpose(*LABELS, "step").values[shown] for name in ("step_kind", "step_target"))
    return sorted({(str(kind), float(target)) for kind, target in zip(kinds, targets, strict=True)})


def values_of(data, model, quantity, kind, target):
    """Return the values of a quantity along seed, surface, slope and material, and the seeds; None without runs."""
    if data is None or model not in data["model"].values or quantity not in data:
        return None
    runs = data.isel(model=data["model"].values.tolist().index(model))
    usable = runs["status"].isin((COMPLETE,) if kind == LOOP else LOADED_RUNS) & (runs["applicability"] == "")
    values = runs[quantity]
    if kind != LOOP:
        same = np.isclose(runs["step_target"], target, rtol=1e-9, atol=0)
        values = values.where(loading_stops(runs) & (runs["step_kind"] == kind) & same).max("step")
    return values.where(usable).transpose("seed", *CONTACT).values, data["seed"].values.tolist()


def _by_seed(of_level, surface, slope, material):
    """Return the values of a contact by seed, without seeds that have no result."""
    if of_level is None:
        return {}
    values, seeds = of_level
    column = values[:, surface, slope, material].astype(float)
    return {seed: float(value) for seed, value in zip(seeds, column, strict=True) if not math.isnan(value)}
