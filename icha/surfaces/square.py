"""The square on which a surface is given: periodic cell or single square; and which arrays are heights on it."""

import numpy as np


def cell_of(period, free):
    """Side of the cell in which the points of a square repeat, m: twice the square's where it is single."""
    return 2 * period if free else period


def periodic_difference(first, second, period):
    """Shortest way first - second between coordinates in the periodic cell, of any shape, m."""
    difference = first - second
    return difference - period * np.rint(difference / period)


def problem_with_heights(heights: np.ndarray) -> str | None:
    """What keeps an array of real numbers from being a height map: its shape, values that are not finite, flatness."""
    if heights.ndim != 2 or heights.shape[0] != heights.shape[1] or heights.shape[0] < 8:
        return f"an array of shape {heights.shape}, not a square of at least 8 x 8"
    bad = int(np.count_nonzero(~np.isfinite(heights)))
    if bad:
        return f"{bad} of {heights.size} heights that are not finite"
    if heights.max() == heights.min():
        return "heights that are all the same"
    return None
