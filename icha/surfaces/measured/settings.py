"""Settings of a measured topography, what readers find in its file, and what several readers need."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from icha.support.rules import GRID
from icha.support.values import conversion_factor

# How edges are treated, beside `periodic` and `free` (`icha.surfaces.surface`); both end in a periodic surface.
WINDOW, MIRROR = "window", "mirror"


# What is wrong with a file of one profile.
LINE_SCAN = "is a line scan, one profile of {} points; allowed: a topography, with heights over x and y"


class UnfitTopography(ValueError):
    """A file that is no topography or cannot be prepared as asked; `key`: the setting that is at fault."""

    def __init__(self, key: str, message: str):
        """Keep the key and the message, which says why and what is allowed."""
        super().__init__(message)
        self.key = key


@dataclass(frozen=True)
class Preparation:
    """What the numbers of a file mean and how they become a surface.

    Parameters
    ----------
    format : a name of `READERS`, or "auto".
    boundary : "periodic", "window", "mirror" or "free".
    data : name of variable, dataset or channel; None: the only one, or the file's own default.
    first_axis : "y" or "x", the first axis of arrays whose dimensions have no names.
    height_unit, lateral_unit : metres; None: as the file says, and the lateral one else that of height.
    size : (x, y) of the whole scan, m; None: as the file says.
    touches_first : "high" or "low" numbers.
    missing : "refuse" or "fill".
    crop : x, y, side (m) of the square; None: the largest, in the middle.
    detrend : "none", "tilt" or "curvature".
    cutoff : nesting index of the S-filter, m; None: no filter.
    taper : with a window, the part of the side over which heights fall at each edge.
    grid : nodes along a side of the result; None: as the scan.
    columns : numbers, from 1, of the columns x, y and z of a text; None: it has just these.
    """

    format: str
    boundary: str
    data: str | None = None
    first_axis: str = "y"
    height_unit: float | None = None
    lateral_unit: float | None = None
    size: tuple[float, float] | None = None
    touches_first: str = "high"
    missing: str = "refuse"
    crop: Mapping[str, float] | None = None
    detrend: str = "none"
    cutoff: float | None = None
    taper: float | None = None
    grid: int | None = None
    columns: tuple[int, int, int] | None = None


@dataclass(frozen=True, eq=False)
class Found:
    """What a reader finds: heights (ny, nx) in its own unit, nan where missing; unit and size in m, if it knows them.

    coordinates: size (x, y) in units of length that the file does not tell. format: name of the instrument's format.
    remark: what was left out of the file, in words.
    data: name of the array or channel that was taken, empty if the file has only one. data_known: whether it was looked
    for by the name that is asked for.
    """

    heights: np.ndarray
    unit: float | None = None
    size: tuple[float, float] | None = None
    coordinates: tuple[float, float] | None = None
    format: str = ""
    remark: str = ""
    data: str = ""
    data_known: bool = True


def with_y_first(heights: np.ndarray, how: Preparation) -> np.ndarray:
    """The array with y as its first axis, which in the file is the one that the settings say."""
    return heights.T if how.first_axis == "x" else heights


def regular_ticks(values: np.ndarray, axis: str) -> tuple[np.ndarray, int, float]:
    """Index (n,) of every coordinate on a regular scale, and the number and distance of its ticks.

    Raises
    ------
    ValueError
        If they are on no such scale; it calls them `axis`.
    """
    if not np.all(np.isfinite(values)):
        raise ValueError(f"{axis} is not finite everywhere")
    there = np.unique(values)
    low, high = there[0], there[-1]
    # Rounding of what was written as text is no step.
    steps = np.diff(there)
    steps = steps[steps > 1e-6 * (high - low)]
    if not len(steps):
        raise ValueError(f"{axis} is the same everywhere")
    usual = np.median(steps)
    # Where every tick is there, counting them is safer than trusting the digits of one step.
    count = len(steps) + 1 if np.max(steps) < 1.5 * usual else int(np.rint((high - low) / usual)) + 1
    if count > GRID.most:
        raise ValueError(f"{axis} is not on a regular grid of at most {GRID.most} points")
    step = (high - low) / (count - 1)
    index = np.rint((values - low) / step).astype(int)
    if np.max(np.abs(values - low - index * step)) > 0.05 * step:
        raise ValueError(f"{axis} is not on a regular grid")
    return index, count, step


def chosen_name(asked: str | None, there: Sequence[str], usual: Sequence[str], what: str) -> str:
    """The variable, dataset or channel (`what`) of those `there` that is asked for; else a usual one, or the only one.

    Raises
    ------
    UnfitTopography
        If there is none, or if it could be several.
    """
    if asked is not None:
        if asked not in there:
            raise UnfitTopography("data", f"is no {what} of the file; allowed: {', '.join(there) or 'none is there'}")
        return asked
    found = [name for name in usual if name in there] or there
    if not found or (len(found) > 1 and found is there):
        many = (
            f"is missing, and the file has {len(there)}"
            if there
            else f"is missing, and the file has no {what} of two dimensions"
        )
        raise UnfitTopography("data", f"{many}; allowed: {', '.join(there) or 'another file'}")
    return found[0]


def metres_of(unit: str) -> float | None:
    """Metres of a unit; None if it is none of length."""
    try:
        return float(conversion_factor(str(unit), "m"))
    except ValueError:
        return None
