"""Settings of a measured topography, the content of its file as a reader returns it, and helpers of several readers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from icha.support.rules import GRID
from icha.support.values import conversion_factor

# Treatments of the edges that make a periodic surface; the other two are in `icha.surfaces.surface`.
WINDOW, MIRROR = "window", "mirror"
# Message for a file of one profile.
LINE_SCAN = "is a line scan, one profile of {} points; expected a topography, with heights over x and y"
# Differences of coordinates below this fraction of their range are rounding of text.
_ROUNDING = 1e-6
# Largest distance of a coordinate from its tick, in steps.
_OFF_TICK = 0.05


class UnfitTopography(ValueError):
    """A file is not a topography, or the setting `key` does not fit it."""

    def __init__(self, key: str, message: str):
        """Store the key and the message, which states the reason and what is expected."""
        super().__init__(message)
        self.key = key


class WrongFormat(ValueError):
    """The reason why the content of a file does not fit the format as which it is read."""


@dataclass(frozen=True)
class Preparation:
    """The meaning of the numbers of a file and the steps that make a surface of them.

    Parameters
    ----------
    format : a name of `READERS`, or "auto".
    boundary : "periodic", "window", "mirror" or "free".
    data : name of the variable, dataset or channel to read; None for the only one, or the default one of the file.
    first_axis : "y" or "x", the first axis of arrays whose dimensions have no names.
    height_unit : m; None for that of the file.
    lateral_unit : unit of coordinates, m; None for that of the file, else that of the heights.
    size : (x, y) of the whole scan, m; None for that of the file.
    touches_first : the numbers that touch the elastic body first, "high" or "low".
    missing : treatment of points without a height, "refuse" or "fill".
    crop : x, y, side (m) of the square; None for the largest, in the middle.
    detrend : "none", "tilt" or "curvature".
    cutoff : nesting index of the S-filter, m; None for no filter.
    taper : fraction of the side on which the window reduces the heights at each edge.
    grid : nodes along a side of the result; None for those of the scan.
    columns : numbers, from 1, of the columns x, y and z of a text; None if it has only these.
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
class FileContent:
    """The content of a file.

    Attributes
    ----------
    heights : (ny, nx), in the unit of the file, nan where missing.
    unit : unit of the heights, m; None if the file does not give it.
    size : (x, y), m; None if the file does not give it.
    coordinates : (x, y) in a unit that the file does not give.
    format : name of the instrument's format.
    remark : description of what was left out of the file.
    data : name of the array or channel that was read; empty if the file has only one.
    """

    heights: np.ndarray
    unit: float | None = None
    size: tuple[float, float] | None = None
    coordinates: tuple[float, float] | None = None
    format: str = ""
    remark: str = ""
    data: str = ""


def put_y_first(heights: np.ndarray, settings: Preparation) -> np.ndarray:
    """Return the array with y as its first axis; the settings give the first axis of the file."""
    return heights.T if settings.first_axis == "x" else heights


def regular_ticks(values: np.ndarray, axis: str) -> tuple[np.ndarray, int, float]:
    """Return the index (n,) of every coordinate on a regular scale, and the number and distance of its ticks.

    Raises WrongFormat if the coordinates are not on a regular scale; `axis` is their name in the message.
    """
    if not np.all(np.isfinite(values)):
        raise WrongFormat(f"{axis} is not finite everywhere")
    low, high = values.min(), values.max()
    steps = np.diff(np.unique(values))
    steps = steps[steps > _ROUNDING * (high - low)]
    if not len(steps):
        raise WrongFormat(f"{axis} is the same everywhere")
    usual = np.median(steps)
    # If no tick is missing, counting them is safer than trusting the digits of one step.
    count = len(steps) + 1 if np.max(steps) < 1.5 * usual else int(np.rint((high - low) / usual)) + 1
    if count > GRID.most:
        raise WrongFormat(f"{axis} is not on a regular grid of at most {GRID.most} points")
    step = (high - low) / (count - 1)
    index = np.rint((values - low) / step).astype(int)
    if np.max(np.abs(values - low - index * step)) > _OFF_TICK * step:
        raise WrongFormat(f"{axis} is not on a regular grid")
    return index, count, step


def choose_name(asked: str | None, names: Sequence[str], usual: Sequence[str], what: str) -> str:
    """Return the name that is asked for; else a usual one, or the only one.

    Raises UnfitTopography if no variable, dataset or channel (`what`) has it, or if several could be meant.
    """
    expected = f"expected one of: {', '.join(names)}"
    if asked is not None:
        if asked not in names:
            raise UnfitTopography("data", f"is not a {what} of the file; {expected if names else 'it has none'}")
        return asked
    for name in (*usual, *(names if len(names) == 1 else ())):
        if name in names:
            return name
    if not names:
        raise UnfitTopography(
            "data", f"is missing, and the file has no {what} of two dimensions; expected another file"
        )
    raise UnfitTopography("data", f"is missing, and the file has {len(names)}; {expected}")


def metres_of(unit: str) -> float | None:
    """Return the metres of a unit; None for units of other quantities."""
    try:
        return float(conversion_factor(str(unit), "m"))
    except ValueError:
        return None
