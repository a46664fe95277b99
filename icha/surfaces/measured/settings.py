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
# Largest difference of two equal coordinates, as a fraction of their range; it comes from rounding of text.
_ROUNDING = 1e-6
# Largest distance of a coordinate from its grid line, in steps.
_OFF_GRID = 0.05


class UnfitTopography(ValueError):
    """A file is not a topography, or the setting `key` does not fit it."""

    def __init__(self, key: str, message: str):
        """Store the key and the message, which states the reason and what is expected."""
        super().__init__(message)
        self.key = key


@dataclass(frozen=True)
class Preparation:
    """The meaning of the numbers in a file, and the steps from these numbers to a surface.

    Parameters
    ----------
    format : a name of `READERS`, or "auto".
    boundary : "periodic", "window", "mirror" or "free".
    data : name of the variable, dataset or channel to read; None for the only one, or the default of the file.
    first_axis : "y" or "x", the first axis of arrays whose dimensions have no names.
    height_unit : m; None for that of the file.
    lateral_unit : unit of the coordinates, m; None for that of the file or, without one, that of the heights.
    size : (x, y) of the whole scan, m; None for that of the file.
    touches_first : "high" or "low", the numbers whose points touch the elastic body first.
    missing : treatment of points without a height, "refuse" or "fill".
    crop : x, y, side (m) of the square; None for the largest, in the middle.
    detrend : "none", "tilt" or "curvature".
    cutoff : nesting index of the S-filter, m; None for no filter.
    taper : width of the strip at each edge in which the window reduces the heights, as a fraction of the side.
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
    """The content of a file, as a reader returns it.

    Attributes
    ----------
    heights : (ny, nx), in the unit of the file, nan where missing.
    unit : unit of the heights, m; None if the file does not contain it.
    size : size (x, y) of the scan, m; None if the file does not contain it.
    coordinates : size (x, y) of the scan in a unit that the file does not contain.
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


def grid_indices(values: np.ndarray, axis: str) -> tuple[np.ndarray, int, float]:
    """Return the index (n,) of each coordinate on a regular grid, and the number and distance of the grid lines.

    Raises UnfitTopography if the coordinates are not on a regular grid; `axis` is their name in the message.
    """
    low, high = values.min(), values.max()
    steps = np.diff(np.unique(values))
    steps = steps[steps > _ROUNDING * (high - low)]
    if len(steps):
        usual = np.median(steps)
        # If no grid line is missing, counting the lines is safer than trusting the digits of one step.
        count = len(steps) + 1 if np.max(steps) < 1.5 * usual else int(np.rint((high - low) / usual)) + 1
        step = (high - low) / (count - 1)
        index = np.rint((values - low) / step)
        if count <= GRID.most and np.max(np.abs(values - low - index * step)) <= _OFF_GRID * step:
            return index.astype(int), count, step
    raise UnfitTopography(
        "path",
        f"holds coordinates {axis} that are not on a regular grid of at most {GRID.most} points; expected rows and "
        "columns of points. Interpolate the heights in the program of the instrument, or in Gwyddion",
    )


def choose_name(asked: str | None, names: Sequence[str], usual: Sequence[str], what: str) -> str:
    """Choose a variable, dataset or channel (`what`) of a file: the `asked` one, else a usual one, else the only one.

    Raises UnfitTopography if the file has no such name, or if the choice is not clear.
    """
    for name in [asked] if asked is not None else [*usual, *(names if len(names) == 1 else ())]:
        if name in names:
            return name
    given = f"is not a {what} of the file" if asked else f"is missing, and the file has {len(names) or 'no'} {what}s"
    expected = f"one of: {', '.join(names)}" if names else f"a file with a {what} of two dimensions"
    raise UnfitTopography("data", f"{given}; expected {expected}")


def metres_of(unit: str) -> float | None:
    """Return a unit of length in metres; None for any other unit."""
    try:
        return float(conversion_factor(str(unit), "m"))
    except ValueError:
        return None
