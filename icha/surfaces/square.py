"""Distances on a square surface, periodic or single, and a check of its heights."""

import numpy as np


def cell_of(period, free):
    """Return the period of sums over a square of side `period`: its side, or twice its side if `free` is True."""
    return 2 * period if free else period


def periodic_difference(first, second, period):
    """Return the coordinate differences first - second (m) for the image of `second` that is nearest to `first`."""
    difference = first - second
    return difference - period * np.rint(difference / period)


def problem_with_heights(heights: np.ndarray, *, smooth: bool = False) -> str | None:
    """Return a message if an array has the wrong shape, values that are not finite, or no roughness; else None.

    smooth : whether the heights may be all the same.
    """
    if heights.ndim != 2 or heights.shape[0] != heights.shape[1] or heights.shape[0] < 8:
        return f"an array of shape {heights.shape}; expected a square of at least 8 x 8 heights"
    bad = int(np.count_nonzero(~np.isfinite(heights)))
    if bad:
        return f"{bad} of {heights.size} heights that are not finite; expected numbers"
    if heights.max() == heights.min() and not smooth:
        return "heights that are all the same; expected a rough surface"
    return None
