"""Sets of cells of periodic grids: fields of bool, (n, n) or (t, n, n), or rising lists of cells counted through."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import maximum_filter

# Cells a side of the blocks of which what lies around others is made.
BLOCK = 4
# So many to a cell of contact, and a list of these is quicker than a field.
_MANY = 200


def region(cells: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """The cells, counted through, as a field of bool."""
    inside = np.zeros(shape, dtype=bool)
    inside.ravel()[cells] = True
    return inside


def widened(inside: np.ndarray) -> np.ndarray:
    """The cells of a region and those that share an edge with one of them."""
    wide = inside.copy()
    for one, other in ((slice(1, None), slice(-1)), (slice(1), slice(-1, None))):
        wide[..., one, :] |= inside[..., other, :]
        wide[..., other, :] |= inside[..., one, :]
        wide[..., one] |= inside[..., other]
        wide[..., other] |= inside[..., one]
    return wide


def beside(cells: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """The cells that share an edge with one of those given, and are none of them: rising, (m,)."""
    if _MANY * len(cells) < math.prod(shape):
        near = np.unique(adjacent(cells, shape[-1]))
        return near[~among(near, cells)[0]]
    wide = widened(region(cells, shape))
    wide.ravel()[cells] = False
    return np.flatnonzero(wide)


def blocks_around(grid: int, reach: int, *given: np.ndarray) -> np.ndarray:
    """Which blocks of a grid have cells that are no farther from one of those given, (m,), or some more: 0 or 1."""
    rough = np.zeros(2 * [-(-grid // BLOCK)], np.uint8)
    for cells in given:
        row, column = np.divmod(cells, grid)
        rough[row // BLOCK, column // BLOCK] = 1
    return maximum_filter(rough, 2 * -(-reach // BLOCK) + 1, mode="wrap")


def surroundings(grid: int, *given: np.ndarray) -> np.ndarray:
    """Cells of a grid, in some lists (k,), and those up to five cells away or some more: rising, (m,)."""
    row, column = np.nonzero(blocks_around(grid, 5, *given))
    way = np.arange(BLOCK)
    rows, columns = BLOCK * row[:, None, None] + way[:, None], BLOCK * column[:, None, None] + way
    return np.sort((rows * grid + columns)[(rows < grid) & (columns < grid)])


def adjacent(cells: np.ndarray, grid: int) -> np.ndarray:
    """The four cells that share an edge with each, (4, k)."""
    within = cells % grid**2
    first, (row, column) = cells - within, np.divmod(within, grid)
    above, below, left, right = (row - 1) % grid, (row + 1) % grid, (column - 1) % grid, (column + 1) % grid
    around = [above * grid + column, below * grid + column, row * grid + left, row * grid + right]
    return first + np.stack(around)


def merged(
    one: np.ndarray, other: np.ndarray, *values: tuple[np.ndarray, np.ndarray | float]
) -> tuple[np.ndarray, ...]:
    """Two lists of cells without a common one as one that rises, and values on them in its order.

    values: pairs, on the cells of one, (k,), and on those of the other, (m,) or the same on all.
    """
    cells = np.concatenate([one, other])
    order = np.argsort(cells, kind="stable")
    return cells[order], *(
        np.concatenate([first, np.broadcast_to(second, len(other))])[order] for first, second in values
    )


def among(places: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which places, cells of any kind (m,), are among rising cells (k,), and where in their list these stand."""
    at = np.searchsorted(cells, places)
    # Beyond the last there is no cell.
    there = np.append(cells, -1)[at] == places
    return there, at[there]
