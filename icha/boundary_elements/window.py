"""Part of a free square that contains all contact and attraction.

Outside contact and attraction the pressure is zero. So the equilibrium on a part of the square is that on the whole
square if no other cell touches or attracts. Its Fourier transforms need only twice the side of this part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft

from icha.boundary_elements.laws import STENCIL_RADIUS

# Least distance of contact from the edges of a new window, and unit of the side of a window, in cells.
_DISTANCE, _UNIT = 6, 8


@dataclass(frozen=True, eq=False)
class Window:
    """Rows and columns of the grid of a surface.

    Parameters
    ----------
    rows, columns : (m,) int, rows and columns of the cells. The last ones on a free square are a margin without
        heights, so that averages do not reach around: -1, the last row or column of the grid.
    side : number of rows and of columns without the margin.
    grid : number of cells along a side of the Fourier transforms.
    """

    rows: np.ndarray
    columns: np.ndarray
    side: int
    grid: int

    @classmethod
    def whole(cls, grid: int) -> Window:
        """Return the window of all cells of a grid."""
        return cls(np.arange(grid), np.arange(grid), grid, grid)

    @classmethod
    def around(cls, cells: np.ndarray) -> Window:
        """Return a window around some cells of a free square, (n, n) bool."""
        found = [np.flatnonzero(cells.any(axis=axis)) for axis in (1, 0)]
        ends = [(each[0], each[-1] + 1) if len(each) else (0, 0) for each in found]
        side = max(last - first for first, last in ends) + 2 * _DISTANCE
        side = min(-(-side // _UNIT) * _UNIT, len(cells))
        lines = np.full((2, scipy.fft.next_fast_len(side + STENCIL_RADIUS, real=True)), -1)
        for line, (first, last) in zip(lines, ends, strict=True):
            line[:side] = np.arange(side) + min(max((first + last - side) // 2, 0), len(cells) - side)
        return cls(lines[0], lines[1], side, scipy.fft.next_fast_len(2 * side, real=True))

    @property
    def inside(self) -> tuple[np.ndarray, ...]:
        """Indices of the cells without the margin."""
        return np.ix_(self.rows[: self.side], self.columns[: self.side])

    def of(self, field: np.ndarray) -> np.ndarray:
        """Return the values on the window, (m, m), from a field of the grid, (n, n)."""
        return field[np.ix_(self.rows, self.columns)]

    def cells(self, cells: np.ndarray, grid: int) -> np.ndarray:
        """Return the flat indices, (k,), on a grid, of cells with some flat indices on the window, (k,)."""
        row, column = np.divmod(cells, len(self.rows))
        return self.rows[row] * grid + self.columns[column]
