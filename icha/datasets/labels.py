"""Names of the runs of a campaign and of what is computed beside them, and their places in a dataset.

The labels are dimensions, and their values coordinates. Where surfaces have the same rms slopes, so is `rms_slope`.
Where each has slopes of its own, as measured surfaces have, a square of surfaces and slopes would be nearly empty:
`rms_slope(surface, rms_slope)` then holds the slopes of every surface, and missing values beyond the last.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from icha.contact.models import DEFAULT_MODEL, MODELS

if TYPE_CHECKING:
    import xarray as xr

# Where their files stand among others of their kind, without the ending; in braces what differs from one to the next.
RUN = "{study}/{surface}/seed{seed}/slope{slope}/{model_folder}{material}"
CONTACT = "{entry}/{surface}/seed{seed}/slope{slope}/{material}"
SOLUTION = CONTACT + "/p{pressure}"
_NUMBERS = {"rms_slope": "slope", "reduced_pressure": "pressure"}
# Slopes that differ by less than this part are the same.
_SAME_SLOPE = 1e-9


def model_folder(model: str) -> str:
    """What stands before the name of a run's file: the folder of its model, with a slash, or nothing."""
    return MODELS[model].folder


class RunLabels(NamedTuple):
    """Which run of a campaign: names of study, model, surface and material, seed, and rms slope as configured."""

    study: str
    model: str
    surface: str
    seed: int
    rms_slope: float
    material: str

    @property
    def path(self) -> str:
        """Where the run's dataset stands among the runs, without the ending."""
        return RUN.format(**path_fields(self))

    def __str__(self):
        """The run's place among the runs."""
        return self.path


# Those of them that a study has as dimensions.
LABELS = RunLabels._fields[1:]


class ContactLabels(NamedTuple):
    """What an entry beside a study asks for: the entry, and what is pressed against what."""

    entry: str
    surface: str
    seed: int
    rms_slope: float
    material: str

    @property
    def path(self) -> str:
        """Where its file stands among the others, without the ending."""
        return CONTACT.format(**path_fields(self))


class SolutionLabels(NamedTuple):
    """Which boundary-element solution of a campaign: the entry that asks for it, the run beside it, and its load."""

    entry: str
    study: str
    surface: str
    seed: int
    rms_slope: float
    material: str
    reduced_pressure: float

    @property
    def run(self) -> RunLabels:
        """The run that is compared with it, one of asperities."""
        return RunLabels(self.study, DEFAULT_MODEL, *self[2:6])

    @property
    def path(self) -> str:
        """Where its file stands among the solutions, without the ending."""
        return SOLUTION.format(**path_fields(self))

    def __str__(self):
        """The solution's place among the solutions."""
        return self.path


def path_fields(labels: RunLabels | ContactLabels | SolutionLabels) -> dict[str, str]:
    """What stands in the braces of a path."""
    found = {
        _NUMBERS.get(name, name): number_label(value) if name in _NUMBERS else str(value)
        for name, value in labels._asdict().items()
    }
    return found | ({"model_folder": model_folder(labels.model)} if isinstance(labels, RunLabels) else {})


def number_label(value: float) -> str:
    """The shortest text that reads back as `value`: 0.2 is `0.2`, 1.0 is `1`."""
    return repr(float(value)).removesuffix(".0")


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
