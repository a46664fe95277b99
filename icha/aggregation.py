"""Runs of a study side by side: areas and separations at common loads, and what spreads them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from icha.campaign import LABELS, loading_stops
from icha.records import COMPLETE

# Loads at which curves are compared, per decade.
_POINTS_PER_DECADE = 8
# The round reduced pressures at which tables quote the results.
ROUND_PRESSURES = (1e-4, 3.16e-4, 1e-3, 3.16e-3, 1e-2, 3.16e-2, 1e-1)

_AXES = {
    "reduced_pressure": "nominal pressure over contact modulus and rms slope, p/(E* h'rms)",
    "relative_load": "nominal pressure over contact modulus, F/(E* A0)",
}


def interpolated(load, values, at, *, logarithmic: bool) -> np.ndarray:
    """Values of a monotone curve at loads `at` within its range, by monotone cubics in the logarithm of the load.

    Parameters
    ----------
    load, values : the curve, in any order; loads positive. Of equal loads the first is kept.
    at : loads within the curve's.
    logarithmic : whether to interpolate the logarithm of the values, which are then positive.

    Raises
    ------
    ValueError
        If a load lies outside the curve's.
    """
    load, first = np.unique(np.asarray(load, float), return_index=True)
    # Targets of two kinds may be one state: what differs by rounding only cannot carry a slope.
    apart = np.concatenate([[True], np.diff(load) > 1e-9 * load[1:]])
    load, values = load[apart], np.asarray(values, float)[first][apart]
    at = np.asarray(at, float)
    if at.size and (at.min() < load[0] * (1 - 1e-9) or at.max() > load[-1] * (1 + 1e-9)):
        raise ValueError(f"loads {at.min():g} to {at.max():g} lie outside the curve's, {load[0]:g} to {load[-1]:g}")
    x = np.log(np.clip(at, load[0], load[-1]))
    if len(load) == 1:
        return np.full(at.shape, values[0])
    curve = PchipInterpolator(np.log(load), np.log(values) if logarithmic else values)
    return np.exp(curve(x)) if logarithmic else curve(x)


def compare_runs(study: xr.Dataset, *, attrs: Mapping[str, str] = {}) -> xr.Dataset:
    """Contact area and mean separation of all runs of a study at common loads, and their spread.

    Parameters
    ----------
    study : one group of the campaign dataset (`icha.campaign.campaign_tree`).
    attrs : further global attributes.

    Returns
    -------
    Dataset on two grids of loads, `reduced_pressure` and `relative_load`, each over the range that all complete runs
    cover (of length zero where there is no such range) between stops of their first loading. On each, with the suffix
    `_at_load` on the second: `contact_area_fraction` and `reduced_separation` along surface, seed, rms_slope and
    material, mean and standard deviation of the area over seeds, `material_spread` and `slope_spread`, the largest over
    the smallest area of all materials (slopes), less one. Runs that are not complete lack values, as `status` says, and
    do not count.
    """
    complete = study["status"].transpose(*LABELS).values == COMPLETE
    pressure = study["reduced_pressure"].transpose(*LABELS, "step").values
    slope = study["rms_slope"].values[None, None, :, None, None]
    # Loads of the first, tensile contacts have no logarithm.
    shown = loading_stops(study).transpose(*LABELS, "step").values & (pressure > 0)
    loads = {"reduced_pressure": pressure, "relative_load": pressure * slope}
    curves = {
        name: study[name].transpose(*LABELS, "step").values for name in ("contact_area_fraction", "reduced_separation")
    }

    variables, coords = {"status": study["status"]}, {label: study[label] for label in LABELS}
    for axis, load in loads.items():
        suffix = "" if axis == "reduced_pressure" else "_at_load"
        at = _common_grid([load[index][shown[index]] for index in map(tuple, np.argwhere(complete))])
        coords[axis] = xr.Variable(axis, at, {"units": "1", "long_name": _AXES[axis]})
        shape = load.shape[:-1]
        on_grid = {}
        for name, values in curves.items():
            result = np.full((*shape, len(at)), np.nan)
            for index in map(tuple, np.argwhere(complete) if len(at) else ()):
                result[index] = interpolated(
                    load[index][shown[index]],
                    values[index][shown[index]],
                    at,
                    logarithmic=name == "contact_area_fraction",
                )
            on_grid[name] = result
            described = {"units": "1", "long_name": f"{study[name].attrs['long_name']}, at {_AXES[axis]}"}
            variables[name + suffix] = xr.Variable((*LABELS, axis), result, described)
        area = on_grid["contact_area_fraction"]

        def derived(reduce, label, long_name, axis=axis, area=area):
            # A reduction over no complete run at all has no value.
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                values = reduce(area, LABELS.index(label))
            dims = (*(each for each in LABELS if each != label), axis)
            return xr.Variable(dims, values, {"units": "1", "long_name": f"{long_name}, at {_AXES[axis]}"})

        variables["area_mean" + suffix] = derived(np.nanmean, "seed", "mean of A/A0 over the seeds")
        variables["area_deviation" + suffix] = derived(np.nanstd, "seed", "standard deviation of A/A0 over the seeds")
        for label, many in (("material", "materials"), ("rms_slope", "rms slopes")):
            variables[f"{label.removeprefix('rms_')}_spread{suffix}"] = derived(
                _spread, label, f"largest over smallest A/A0 of all {many}, less 1"
            )
    title = {
        "title": f"Comparison of the runs of study {study.attrs.get('study', '')}".rstrip(),
        "summary": "Contact area and mean separation at loads common to all runs, by monotone interpolation.",
        "Conventions": "CF-1.11",
    }
    kept = {name: study.attrs[name] for name in ("study", "source", "license") if study.attrs.get(name)}
    return xr.Dataset(variables, coords, title | kept | dict(attrs))


def _spread(area, axis):
    return np.nanmax(area, axis) / np.nanmin(area, axis) - 1


def _common_grid(loads):
    """Loads, evenly spaced by their logarithm, that every run covers; `loads` are those of each, all positive."""
    if not loads or not all(map(len, loads)):
        return np.empty(0)
    lowest = max(float(own.min()) for own in loads)
    highest = min(float(own.max()) for own in loads)
    if highest <= lowest:
        return np.empty(0)
    count = max(2, round(np.log10(highest / lowest) * _POINTS_PER_DECADE) + 1)
    return np.geomspace(lowest, highest, count)


def compare_campaign(tree: xr.DataTree, *, attrs: Mapping[str, str] = {}) -> xr.DataTree:
    """`compare_runs` for every study of a campaign, as a tree of the same shape."""
    groups = {f"/{name}": compare_runs(node.to_dataset()) for name, node in tree.children.items()}
    root = {"title": "Comparison of the runs of every study", "Conventions": "CF-1.11"} | dict(attrs)
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=root)} | groups)


def at_round_pressures(run: xr.Dataset) -> list[tuple[float, float, float]]:
    """(p*, A/A0, mean separation over h_rms) of a run at the round reduced pressures that its first loading covers."""
    run = run.isel(step=loading_stops(run).values)
    load = run["reduced_pressure"].values
    positive = load > 0
    if not positive.any():
        return []
    load = load[positive]
    covered = [p for p in ROUND_PRESSURES if load.min() * (1 - 1e-9) <= p <= load.max() * (1 + 1e-9)]
    area = interpolated(load, run["contact_area_fraction"].values[positive], covered, logarithmic=True)
    gap = interpolated(load, run["reduced_separation"].values[positive], covered, logarithmic=False)
    return list(zip(covered, area.tolist(), gap.tolist(), strict=True))
