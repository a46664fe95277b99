"""Sets of grid cells, as ascending flat indices on one periodic grid or on several independent grids."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter

# Cells along a side of the blocks in which `blocks_around` divides a grid.
BLOCK = 4


def mask_of(cells: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return a bool field of a given shape that is True at the given cells and False elsewhere."""
    mask = np.zeros(shape, dtype=bool)
    mask.ravel()[cells] = True
    return mask


def rim_of(cells: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Find the rim of a set of cells: cells outside the set, (m,), ascending, that share an edge with one inside."""
    inside = mask_of(cells, shape)
    rim = inside.copy()
    for target, source in ((slice(1, None), slice(-1)), (slice(1), slice(-1, None))):
        rim[..., target, :] |= inside[..., source, :]
        rim[..., source, :] |= inside[..., target, :]
        rim[..., target] |= inside[..., source]
        rim[..., source] |= inside[..., target]
    return np.flatnonzero(rim & ~inside)


def adjacent(cells: np.ndarray, grid: int) -> np.ndarray:
    """Return the neighbours of each cell (above, below, left, right; periodic on each of t grids), (4, k)."""
    within = cells % grid**2
    first, (row, column) = cells - within, np.divmod(within, grid)
    above, below, left, right = (row - 1) % grid, (row + 1) % grid, (column - 1) % grid, (column + 1) % grid
    return first + np.stack([above * grid + column, below * grid + column, row * grid + left, row * grid + right])


def merge_cells(
    cells: np.ndarray, others: np.ndarray, *values: tuple[np.ndarray, np.ndarray | float]
) -> tuple[np.ndarray, ...]:
    """Merge two disjoint lists of cells, and values that are given for both lists.

    Parameters
    ----------
    cells, others : (k,) and (m,) int, flat indices.
    values : pairs of values: those of `cells`, (k,), and those of `others`, (m,) or one number for all of them.

    Returns
    -------
    The merged cells, ascending, and the merged values of each pair in the same order.
    """
    merged = np.concatenate([cells, others])
    order = np.argsort(merged, kind="stable")
    return merged[order], *(
        np.concatenate([first, np.broadcast_to(second, len(others))])[order] for first, second in values
    )


def find_among(sought: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find which of `sought`, (m,), are in ascending `cells`: (m,) bool, and the indices in `cells` of those found."""
    index = np.searchsorted(cells, sought)
    # No cell has the number -1.
    present = np.append(cells, -1)[index] == sought
    return present, index[present]


def blocks_around(grid: int, distance: int, cells: np.ndarray) -> np.ndarray:
    """Return a field of blocks (BLOCK x BLOCK cells): 1 for those that may hold cells within `distance` of `cells`."""
    occupied = np.zeros(2 * [-(-grid // BLOCK)], np.uint8)
    row, column = np.divmod(cells, grid)
    occupied[row // BLOCK, column // BLOCK] = 1
    return maximum_filter(occupied, 2 * -(-distance // BLOCK) + 1, mode="wrap")
