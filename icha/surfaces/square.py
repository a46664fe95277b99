"""Distances on a square surface, periodic or single."""

import numpy as np


def cell_of(period, free):
    """Return the period of sums over a square of side `period`: its side, or twice its side if `free` is True."""
    return 2 * period if free else period


def periodic_difference(first, second, period):
    """Return the coordinate differences first - second (m) for the image of `second` that is nearest to `first`."""
    difference = first - second
    return difference - period * np.rint(difference / period)
