"""Heights as a reader finds them in a file, and what readers of several formats need."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from icha.support.rules import GRID
from icha.support.units import conversion_factor
from icha.surfaces.measured.settings import Preparation, UnfitTopography


@dataclass(frozen=True, eq=False)
class Found:
    """What a reader finds: heights (ny, nx) in its own unit, nan where missing; unit and size in m, if it knows them.

    coordinates: size (x, y) in units of length that the file does not tell. format: name of the instrument's format.
    remark: what was left out of the file, in words.
    data: name of the array or channel that was taken, empty if the file has only one.
    """

    heights: np.ndarray
    unit: float | None = None
    size: tuple[float, float] | None = None
    coordinates: tuple[float, float] | None = None
    format: str = ""
    remark: str = ""
    data: str = ""


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
