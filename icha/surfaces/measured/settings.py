"""Settings of a measured topography, the content of its file, and functions that several readers use."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from icha.support.rules import GRID
from icha.support.units import find_factor

# Values of `boundary` that make a scan periodic; `periodic` and `free` are defined in `icha.surfaces.surface`.
WINDOW, MIRROR = "window", "mirror"
# Message for a file of one profile.
LINE_SCAN = "is a line scan, one profile of {} points; expected a topography, with heights over x and y"
# Coordinates count as equal if their difference, divided by the range of the coordinates, is at most this value.
_ROUNDING = 1e-6
# Names of factors: of heights, or of nothing in particular. Zoom and feedback gains are settings of the instrument.
_FACTOR = re.compile(
    r"(?<![a-z])(?:z(?!oom)|heights?|höhe|values?|data|vertical).*"
    r"(?:s[ck]al|fa[ck]tor|gain|resolution|multiplier|sensitivity|calib)"
    r"|lsb|\A1\s|\A(?:(?:conversion|s[ck]al(?:e|ing|ierung)|fa[ck]tor|multiplier|gain)[\s_]*)+\Z",
    re.IGNORECASE,
)
# Words for numbers that increase downwards, except those on images and optics, such as bit depth and depth of focus.
DEPTHS = r"(?<![^\W_])(?<!bit[ _-])(?:depth|tiefe|profondeur|profundidad|profondità)(?! of)"
# Values of entries on the direction of the heights that mean downwards.
DOWNWARDS = re.compile(rf"down|invert|unten|{DEPTHS}", re.IGNORECASE)
# Largest distance of a coordinate from its grid line, divided by the distance of the grid lines.
OFF_GRID = 0.05


class UnfitTopography(ValueError):
    """Error: a file is not a topography, or the setting `key` does not fit the file."""

    def __init__(self, message: str, key: str = "path"):
        """Store the message, with the reason and the expected value, and the key."""
        super().__init__(message)
        self.key = key


@dataclass(frozen=True)
class Preparation:
    """Settings for reading a topography from a file and preparing a surface from it, in SI units.

    They are the keys of `icha.configuration.surfaces.MeasuredSurface`, which explains them.
    """

    format: str
    boundary: str
    data: str | None = None
    first_axis: str = "y"
    height_unit: float | None = None
    lateral_unit: float | None = None
    size: tuple[float, ...] | None = None
    touches_first: str = "high"
    missing: str = "refuse"
    crop: Mapping[str, float] | None = None
    detrend: str = "none"
    cutoff: float | None = None
    taper: float | None = None
    grid: int | None = None
    columns: tuple[int, int, int] | None = None
    outliers: str = "keep"
    levelling: str = "none"
    scattered: str = "refuse"


@dataclass(frozen=True, eq=False)
class FileContent:
    """Heights and units that a reader found in a file of a topography.

    Attributes
    ----------
    heights : two-dimensional array, in the unit of the file, nan where missing.
    unit : unit of the heights, m; None if the file does not contain it.
    size : sides along the second and the first axis, m; None if the file does not contain them.
    coordinates : the same sides in an unknown unit, if the file does not contain the unit.
    first_axis : "x" or "y", the first axis of the array; empty if the file does not state it.
    format : name of the instrument's format.
    remark : description of the parts of the file that were left out.
    data : name of the array or channel that was read; empty if the file has only one.
    """

    heights: np.ndarray
    unit: float | None = None
    size: tuple[float, float] | None = None
    coordinates: tuple[float, float] | None = None
    first_axis: str = ""
    format: str = ""
    remark: str = ""
    data: str = ""


def grid_indices(values: np.ndarray, axis: str) -> tuple[np.ndarray, int, float]:
    """Return the index of each coordinate on a regular grid, and the number and distance of the grid lines.

    Raises UnfitTopography if the coordinates are not on a regular grid; the message names the `axis`.
    """
    low, high = values.min(), values.max()
    steps = np.diff(np.unique(values))
    steps = steps[steps > _ROUNDING * (high - low)]
    if len(steps):
        usual = np.median(steps)
        # If no grid line is missing, the count of lines is more accurate than the rounded value of one step.
        count = len(steps) + 1 if np.max(steps) < 1.5 * usual else int(np.rint((high - low) / usual)) + 1
        step = (high - low) / (count - 1)
        index = np.rint((values - low) / step)
        if count <= GRID.most and np.max(np.abs(values - low - index * step)) <= OFF_GRID * step:
            return index.astype(int), count, step
    raise UnfitTopography(
        f"does not allow coordinates {axis} that are not on a regular grid of at most {GRID.most} points; expected "
        "interpolate, or a file with rows and columns of points",
        "scattered",
    )


def unused_factors(entries: Iterable[tuple[str, ...]], settings: Preparation) -> str:
    """Return the entries (name, value, …) of a file that may be factors of its heights, which ICHA does not apply.

    Raises UnfitTopography if there are such entries and `height_unit` is not given.
    """
    found = [
        f"{name}: {value}"
        for name, value, *_ in entries
        if _FACTOR.search(name) and re.search(r"\d", value) and not re.fullmatch(r"1([.,]0*)?", value)
    ]
    if found and settings.height_unit is None:
        raise UnfitTopography(
            f"is missing, and the file states {', '.join(found)!r}, which may be a factor of the heights; expected the "
            "unit of the numbers in the file, such as '0.5 nm' with a factor, or 'nm' if the factor is already applied",
            "height_unit",
        )
    return f"not applied: {', '.join(found)}" if found else ""


def refuse_downwards(statements: Iterable[str], settings: Preparation) -> None:
    """Raise UnfitTopography for statements of a file that its numbers increase downwards, unless low points touch."""
    for statement in statements:
        if settings.touches_first == "high":
            raise UnfitTopography(
                f"is 'high', but the file states {statement.strip()[:60]!r}, so that points with high numbers are "
                "valleys; expected 'low'. If the numbers increase upwards, remove this statement from the file",
                "touches_first",
            )


def metres_of(unit: str) -> float | None:
    """Convert the name of a unit of length to metres; None for any other text."""
    return find_factor(str(unit), "m")
