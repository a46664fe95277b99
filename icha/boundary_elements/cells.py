"""Sets of grid cells, as ascending flat indices on a periodic grid."""

from __future__ import annotations

import numpy as np


def field_of(cells: np.ndarray | slice, values: np.ndarray | float, shape: tuple[int, ...]) -> np.ndarray:
    """Return a field of a given shape with values on some cells, (k,) or a number, and zero elsewhere."""
    field = np.zeros(shape, np.result_type(values))
    field.ravel()[cells] = values
    return field


def adjacent(cells: np.ndarray, grid: int) -> np.ndarray:
    """Return the neighbours of each cell (above, below, left, right; periodic), (4, k)."""
    row, column = np.divmod(cells, grid)
    above, below, left, right = (row - 1) % grid, (row + 1) % grid, (column - 1) % grid, (column + 1) % grid
    return np.stack([above * grid + column, below * grid + column, row * grid + left, row * grid + right])


def find_among(sought: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find which of `sought`, (m,), are in ascending `cells`: (m,) bool, and the indices in `cells` of those found."""
    index = np.searchsorted(cells, sought)
    # No cell has the number -1.
    present = np.append(cells, -1)[index] == sought
    return present, index[present]
