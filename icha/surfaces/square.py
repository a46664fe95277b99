"""The square of a surface, which is one periodic cell or a single square, and checks of its heights."""

import numpy as np


def cell_of(period, free):
    """Return the side of the cell in which the points of a square repeat, m: twice the side of a single square."""
    return 2 * period if free else period


def periodic_difference(first, second, period):
    """Return the shortest difference first - second of coordinates (m, arrays of any shape) in a periodic cell."""
    difference = first - second
    return difference - period * np.rint(difference / period)


def problem_with_heights(heights: np.ndarray) -> str | None:
    """Return why an array is not a height map (shape, values that are not finite, no roughness); None if it is one."""
    if heights.ndim != 2 or heights.shape[0] != heights.shape[1] or heights.shape[0] < 8:
        return f"an array of shape {heights.shape}; expected a square of at least 8 x 8 heights"
    bad = int(np.count_nonzero(~np.isfinite(heights)))
    if bad:
        return f"{bad} of {heights.size} heights that are not finite; expected numbers"
    if heights.max() == heights.min():
        return "heights that are all the same; expected a rough surface"
    return None
