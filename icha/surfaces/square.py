"""The square on which a surface is given: a periodic cell, or a single one on a free half-space."""

import numpy as np


def cell_of(period, free):
    """Side of the cell in which the points of a square repeat, m: twice the square's where it is single."""
    return 2 * period if free else period


def periodic_difference(first, second, period):
    """Shortest way first - second between coordinates in the periodic cell, of any shape, m."""
    difference = first - second
    return difference - period * np.rint(difference / period)
