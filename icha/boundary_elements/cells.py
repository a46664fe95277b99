"""Sets of cells: ascending lists of flat indices on a periodic grid, or on several independent ones."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter

# Cells along a side of the blocks by which neighbourhoods are found.
BLOCK = 4


def mask_of(cells: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Field of bool that is true on the cells."""
    mask = np.zeros(shape, dtype=bool)
    mask.ravel()[cells] = True
    return mask


def rim_of(cells: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Cells that share an edge with given ones and are not among them, (m,), ascending."""
    inside = mask_of(cells, shape)
    rim = inside.copy()
    for target, source in ((slice(1, None), slice(-1)), (slice(1), slice(-1, None))):
        rim[..., target, :] |= inside[..., source, :]
        rim[..., source, :] |= inside[..., target, :]
        rim[..., target] |= inside[..., source]
        rim[..., source] |= inside[..., target]
    return np.flatnonzero(rim & ~inside)


def adjacent(cells: np.ndarray, grid: int) -> np.ndarray:
    """Four cells that share an edge with each, (4, k)."""
    within = cells % grid**2
    first, (row, column) = cells - within, np.divmod(within, grid)
    above, below, left, right = (row - 1) % grid, (row + 1) % grid, (column - 1) % grid, (column + 1) % grid
    return first + np.stack([above * grid + column, below * grid + column, row * grid + left, row * grid + right])


def merge_cells(
    cells: np.ndarray, others: np.ndarray, *values: tuple[np.ndarray, np.ndarray | float]
) -> tuple[np.ndarray, ...]:
    """Merge two disjoint lists of cells.

    Parameters
    ----------
    cells, others : (k,) and (m,) int.
    values : pairs of values on `cells`, (k,), and on `others`, (m,) or one for all.

    Returns
    -------
    The merged list, ascending, and each pair in its order.
    """
    merged = np.concatenate([cells, others])
    order = np.argsort(merged, kind="stable")
    return merged[order], *(
        np.concatenate([first, np.broadcast_to(second, len(others))])[order] for first, second in values
    )


def find_among(places: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find places (m,) among ascending cells (k,): which of them are present, (m,), and the index of each of these."""
    index = np.searchsorted(cells, places)
    # No cell has the number -1.
    present = np.append(cells, -1)[index] == places
    return present, index[present]


def blocks_around(grid: int, reach: int, cells: np.ndarray) -> np.ndarray:
    """Blocks of a grid with cells that are within `reach` of given ones, or slightly more: field of 0 and 1."""
    occupied = np.zeros(2 * [-(-grid // BLOCK)], np.uint8)
    row, column = np.divmod(cells, grid)
    occupied[row // BLOCK, column // BLOCK] = 1
    return maximum_filter(occupied, 2 * -(-reach // BLOCK) + 1, mode="wrap")
