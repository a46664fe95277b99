"""Labels of the runs of a campaign and of references, and their positions in a dataset.

Labels are the dimensions of a dataset, and their values are its coordinates. If all surfaces have the same rms slopes,
`rms_slope` is one of the labels. Measured surfaces have different slopes, and an array of all surfaces and all slopes
would be nearly empty. Then the coordinate `rms_slope(surface, rms_slope)` contains the slopes of every surface, with
missing values after the last slope.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from icha.contact.models import DEFAULT_MODEL, MODELS

if TYPE_CHECKING:
    import xarray as xr

# Paths of files below the folder of their kind, without ending, with fields in braces.
RUN = "{study}/{surface}/seed{seed}/slope{slope}/{model_folder}{material}"
CONTACT = "{entry}/{surface}/seed{seed}/slope{slope}/{material}"
SOLUTION = CONTACT + "/p{pressure}"
_NUMBERS = {"rms_slope": "slope", "reduced_pressure": "pressure"}
# Relative difference below which two rms slopes are the same, from the rounding of scaled surfaces.
_SAME_SLOPE = 1e-9


def model_folder(model: str) -> str:
    """Return the folder of a model in the path of a run, with a slash; empty text if the model has no folder."""
    return MODELS[model].folder


class RunLabels(NamedTuple):
    """Labels of a run.

    Attributes
    ----------
    study, model, surface, material : names.
    seed : of the surface.
    rms_slope : as configured.
    """

    study: str
    model: str
    surface: str
    seed: int
    rms_slope: float
    material: str

    @property
    def path(self) -> str:
        """Path of the run's dataset below the folder of runs, without ending."""
        return RUN.format(**path_fields(self))

    def __str__(self):
        """Return the path of the run."""
        return self.path


# Labels that are dimensions of a study.
LABELS = RunLabels._fields[1:]


class ContactLabels(NamedTuple):
    """Labels of a contact that an entry of `finite_range` or `boundary_element_loops` requests."""

    entry: str
    surface: str
    seed: int
    rms_slope: float
    material: str

    @property
    def path(self) -> str:
        """Path of its file below the folder of its kind, without ending."""
        return CONTACT.format(**path_fields(self))


class SolutionLabels(NamedTuple):
    """Labels of a boundary-element solution: the entry that requests it, the run to compare, and the load."""

    entry: str
    study: str
    surface: str
    seed: int
    rms_slope: float
    material: str
    reduced_pressure: float

    @property
    def run(self) -> RunLabels:
        """The asperity run that is compared with it."""
        return RunLabels(self.study, DEFAULT_MODEL, *self[2:6])

    @property
    def path(self) -> str:
        """Path of its file below the folder of solutions, without ending."""
        return SOLUTION.format(**path_fields(self))

    def __str__(self):
        """Return the path of the solution."""
        return self.path


def path_fields(labels: RunLabels | ContactLabels | SolutionLabels) -> dict[str, str]:
    """Return the values for the fields in braces of a path pattern."""
    found = {
        _NUMBERS.get(name, name): number_label(value) if name in _NUMBERS else str(value)
        for name, value in labels._asdict().items()
    }
    return found | ({"model_folder": model_folder(labels.model)} if isinstance(labels, RunLabels) else {})


def number_label(value: float) -> str:
    """Return the shortest text that reads back as `value`: 0.2 is `0.2`, 1.0 is `1`."""
    return repr(float(value)).removesuffix(".0")


def arrange_slopes(pairs: Iterable[tuple[str, float]]) -> np.ndarray:
    """Arrange rms slopes in ascending order: one row for all surfaces, or one row per surface if this is smaller.

    Parameters
    ----------
    pairs : surface and rms slope of every run; surfaces keep the order in which they first appear.

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
    return np.array([sorted(slopes) + [np.nan] * (most - len(slopes)) for slopes in found.values()], float)


def slope_dims(slopes: np.ndarray) -> tuple[str, ...]:
    """Return the dimensions of the coordinate `rms_slope` with values from `arrange_slopes`."""
    return ("surface", "rms_slope") if slopes.ndim == 2 else ("rms_slope",)


def slopes_of(data: xr.Dataset) -> list[float]:
    """List all rms slopes of a dataset, each once, in ascending order."""
    values = np.unique(data["rms_slope"].values)
    return values[np.isfinite(values)].tolist()


def surfaces_and_slopes(data: xr.Dataset) -> list[tuple[str, float]]:
    """List every surface and rms slope in a dataset."""
    return [
        (surface, slope)
        for k, surface in enumerate(data["surface"].values.tolist())
        for slope in slopes_at(data, {"surface": k}).tolist()
        if np.isfinite(slope)
    ]


def labels_at(data: xr.Dataset, place: Sequence[int], labels: Sequence[str]) -> list[Any]:
    """Return the values of the labels at the indices `place`."""
    at = dict(zip(labels, place, strict=True))
    coordinates = (data.variables[label] for label in labels)
    return [np.asarray(each.values[tuple(at[dim] for dim in each.dims)]).item() for each in coordinates]


def place_of(data: xr.Dataset, wanted: Mapping[str, Any]) -> dict[str, int]:
    """Return the position of the wanted value along every label; the labels must include `surface`.

    Raises
    ------
    KeyError
        With the name of a label that does not have the wanted value.
    """
    at: dict[str, int] = {}
    # The slope comes last because it may depend on the surface.
    for label in sorted(wanted, key="rms_slope".__eq__):
        values = slopes_at(data, at) if label == "rms_slope" else data.variables[label].values
        same = np.isclose(values, wanted[label], rtol=_SAME_SLOPE) if label == "rms_slope" else values == wanted[label]
        if not same.any():
            raise KeyError(label)
        at[label] = int(np.argmax(same))
    return {label: at[label] for label in wanted}


def slopes_at(data: xr.Dataset, at: Mapping[str, int]) -> np.ndarray:
    """Return the rms slopes, (slope,), of the surface at a position."""
    slopes = data.variables["rms_slope"]
    return slopes.values[at["surface"]] if slopes.ndim == 2 else slopes.values
