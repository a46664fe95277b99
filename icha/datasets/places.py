"""Places of runs along the labels of a dataset.

The labels are dimensions, and their values coordinates. Where surfaces have the same rms slopes, so is `rms_slope`.
Where each has slopes of its own, as measured surfaces have, a square of surfaces and slopes would be nearly empty:
`rms_slope(surface, rms_slope)` then holds the slopes of every surface, and missing values beyond the last.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from icha.datasets.labels import LABELS, RunLabels

if TYPE_CHECKING:
    import xarray as xr

# Slopes that differ by less than this part are the same.
_SAME_SLOPE = 1e-9


def arrange_slopes(pairs: Iterable[tuple[str, float]]) -> np.ndarray:
    """Rms slopes in ascending order: common to all surfaces, or a row for every surface where that takes fewer cells.

    Parameters
    ----------
    pairs : surface and rms slope of every run; surfaces keep the order in which they first come.

    Returns
    -------
    (slope,) float, or (surface, slope) float with NaN beyond the last slope of a surface.
    """
    found: dict[str, set[float]] = {}
    for surface, slope in pairs:
        found.setdefault(surface, set()).add(slope)
    common = sorted(set().union(*found.values()))
    most = max(map(len, found.values()))
    if most == len(common):
        return np.array(common, float)
    return np.array([sorted(own) + [np.nan] * (most - len(own)) for own in found.values()], float)


def count_cells(runs: Sequence[RunLabels]) -> int:
    """Number of combinations of the labels of a study's runs that have a place in its dataset."""
    others = (len({getattr(run, label) for run in runs}) for label in LABELS if label != "rms_slope")
    return math.prod(others) * arrange_slopes((run.surface, run.rms_slope) for run in runs).shape[-1]


def slope_dims(slopes: np.ndarray) -> tuple[str, ...]:
    """Dimensions of the coordinate `rms_slope` with the values that `arrange_slopes` returns."""
    return ("surface", "rms_slope") if slopes.ndim == 2 else ("rms_slope",)


def slopes_of(data: xr.Dataset) -> list[float]:
    """All rms slopes of a dataset, each once, in ascending order."""
    values = np.unique(data["rms_slope"].values)
    return values[np.isfinite(values)].tolist()


def surfaces_and_slopes(data: xr.Dataset) -> list[tuple[str, float]]:
    """Every surface and rms slope that a dataset has a place for."""
    return [
        (surface, slope)
        for k, surface in enumerate(data["surface"].values.tolist())
        for slope in slopes_at(data, {"surface": k}).tolist()
        if np.isfinite(slope)
    ]


def labels_at(data: xr.Dataset, place: Sequence[int], labels: Sequence[str]) -> list[Any]:
    """Values of the labels at a place along them."""
    at = dict(zip(labels, place, strict=True))
    coordinates = (data.variables[label] for label in labels)
    return [np.asarray(each.values[tuple(at[dim] for dim in each.dims)]).item() for each in coordinates]


def place_of(data: xr.Dataset, wanted: Mapping[str, Any]) -> dict[str, int]:
    """Position along every label at which the labels have the values wanted, with `surface` among them.

    Raises
    ------
    KeyError
        Naming the label: if it has no such value.
    """
    at: dict[str, int] = {}
    # The slope comes last, since it may depend on the surface.
    for label in sorted(wanted, key="rms_slope".__eq__):
        values = slopes_at(data, at) if label == "rms_slope" else data.variables[label].values
        same = np.isclose(values, wanted[label], rtol=_SAME_SLOPE) if label == "rms_slope" else values == wanted[label]
        if not same.any():
            raise KeyError(label)
        at[label] = int(np.argmax(same))
    return {label: at[label] for label in wanted}


def slopes_at(data: xr.Dataset, at: Mapping[str, int]) -> np.ndarray:
    """Rms slopes along the dimension `rms_slope` of the surface at a place, (slope,)."""
    slopes = data.variables["rms_slope"]
    return slopes.values[at["surface"]] if slopes.ndim == 2 else slopes.values
