"""Contact that summits make when they jump in."""

import numpy as np
import pytest

from icha.boundary_elements.adhesive import Summits


@pytest.mark.parametrize(("radius", "cells"), [(0.5, 1), (1.0, 5), (2.0, 13), (8.0, 197), (1e5, 197)])
def test_cells_in_a_disc_are_touched_over_the_edges_and_never_more_than_half_the_side(radius, cells):
    corner, middle = 0, 16 * 32 + 16
    summits = Summits(np.array([corner, middle]), np.zeros(2), np.zeros(2), np.array([radius, radius]))
    for number in range(2):
        touched = summits.contacts(np.arange(2) == number, 32)
        assert len(touched) == len(set(touched)) == cells
        row, column = np.divmod(touched, 32)
        nearest = [np.minimum(way, 32 - way) for way in np.abs((row - (0, 16)[number], column - (0, 16)[number]))]
        assert np.hypot(*nearest).max() <= radius
