"""Labels of runs, and the indices of labels in a dataset.

Labels, such as surface and material, are the dimensions of a dataset. The values of the labels are the coordinates of
the dataset. If all surfaces have the same rms slopes, the coordinate `rms_slope` has one dimension. Measured surfaces
have different slopes. For such surfaces, the coordinate `rms_slope(surface, rms_slope)` contains the slopes of every
surface, with missing values after the last slope.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from icha.contact.models import MODELS

if TYPE_CHECKING:
    import xarray as xr

# Patterns of paths in the folder of a kind of file, without file extension. Fields stand in braces.
RUN = "{study}/{surface}/seed{seed}/slope{slope}/{model_folder}{material}"
# Two rms slopes count as equal up to this relative difference, because scaling of surfaces causes rounding errors.
_SAME_SLOPE = 1e-9


def coarse_study(study: str) -> str:
    """Return the name of the study with the runs of another study on half the grid."""
    return f"{study}-coarse"


def inputs_study(study: str) -> str:
    """Return the name of the study with the sampled parameters of another study, which has levels of accuracy."""
    return f"{study}-inputs"


def is_derived_study(study: str, studies: Iterable[str]) -> bool:
    """Return whether a study has runs that another of the `studies` needs: `coarse_study` or `inputs_study`."""
    return any(study in (coarse_study(other), inputs_study(other)) for other in studies)


class RunLabels(NamedTuple):
    """Labels of a run.

    Attributes
    ----------
    study, model, surface, material : names of study, model, surface and material.
    seed : seed of the random surface.
    rms_slope : rms slope of the surface, as in the configuration.
    """

    study: str
    model: str
    surface: str
    seed: int
    rms_slope: float
    material: str

    @property
    def path(self) -> str:
        """Path of the run's file in the folder of runs, without file extension."""
        return RUN.format(**path_fields(self))

    def __str__(self):
        """Return the path of the run."""
        return self.path


# Labels that are dimensions in the dataset of a study.
LABELS = RunLabels._fields[1:]


def path_fields(labels: RunLabels) -> dict[str, str]:
    """Return the text for each field in a path pattern, by name of the field."""
    slope = {"slope": number_label(labels.rms_slope), "model_folder": MODELS[labels.model].folder}
    return {name: str(value) for name, value in labels._asdict().items()} | slope


def number_label(value: float) -> str:
    """Return the shortest decimal text for a number: `0.2` for 0.2, `1` for 1.0."""
    return repr(float(value)).removesuffix(".0")


def arrange_slopes(pairs: Iterable[tuple[str, float]]) -> np.ndarray:
    """Arrange rms slopes in ascending order: in one row if one surface has all slopes, else in one row per surface.

    `pairs` are surface and rms slope of every run. Surfaces keep the order in which they first appear. Return an array
    of shape (slopes,) or (surfaces, slopes), with NaN after the last slope of a surface.
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
    """Return the dimensions of the coordinate `rms_slope` for values from `arrange_slopes`."""
    return ("surface", "rms_slope") if slopes.ndim == 2 else ("rms_slope",)


def slopes_of(data: xr.Dataset) -> list[float]:
    """List all different rms slopes of a dataset in ascending order."""
    values = np.unique(data["rms_slope"].values)
    return values[np.isfinite(values)].tolist()


def surfaces_and_slopes(data: xr.Dataset) -> list[tuple[str, float]]:
    """List every combination of surface and rms slope in a dataset."""
    return [
        (surface, slope)
        for k, surface in enumerate(data["surface"].values.tolist())
        for slope in slopes_at(data, {"surface": k}).tolist()
        if np.isfinite(slope)
    ]


def labels_at(data: xr.Dataset, place: Sequence[int], labels: Sequence[str]) -> list[Any]:
    """Return the values of the labels of a dataset at the indices `place`, one for each label."""
    at = dict(zip(labels, place, strict=True))
    coordinates = (data.variables[label] for label in labels)
    return [np.asarray(each.values[tuple(at[dim] for dim in each.dims)]).item() for each in coordinates]


def place_of(data: xr.Dataset, wanted: Mapping[str, Any]) -> dict[str, int]:
    """Return the index of the wanted value along every label; the labels must include `surface`.

    Raise KeyError with the name of the label if a label does not have the wanted value.
    """
    at: dict[str, int] = {}
    # The slope comes last because slopes may depend on the surface.
    for label in sorted(wanted, key="rms_slope".__eq__):
        values = slopes_at(data, at) if label == "rms_slope" else data.variables[label].values
        same = np.isclose(values, wanted[label], rtol=_SAME_SLOPE) if label == "rms_slope" else values == wanted[label]
        if not same.any():
            raise KeyError(label)
        at[label] = int(np.argmax(same))
    return {label: at[label] for label in wanted}


def has_contact(data: xr.Dataset, labels: RunLabels) -> bool:
    """Return whether a dataset has the surface, the rms slope and the material of a run."""
    try:
        place_of(data, {label: getattr(labels, label) for label in ("surface", "rms_slope", "material")})
    except KeyError:
        return False
    return True


def slopes_at(data: xr.Dataset, at: Mapping[str, int]) -> np.ndarray:
    """Return the rms slopes of the surface with index `at["surface"]`."""
    slopes = data.variables["rms_slope"]
    return slopes.values[at["surface"]] if slopes.ndim == 2 else slopes.values
