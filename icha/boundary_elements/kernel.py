"""The elastic half-space on a periodic grid: displacement under pressures, and its approximate inverse.

In units of the grid: lengths in cells, pressures in E*. A pressure of wave vector q displaces by 2/q (K. L. Johnson,
Contact Mechanics, 1985, sec. 13.2); its mean displaces nothing, for separations are those of the mean planes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.fft

from icha.boundary_elements.nearby import TILE, Tiles, modes_nearby
from icha.support.parallel import blocks, on_cores

# The inverse of the kernel for the mean, in parts of that of the longest wave.
_MEAN = 0.3
# Bytes of a field from which it pays to transform some rows or columns at a time, so many columns; nodes a side from
# which several threads do.
_CACHE, _COLUMNS, _LARGE = 2_000_000, 32, 2048


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """Fourier kernel of a periodic half-space on an n x n grid, or of many independent ones.

    shape: of fields, (n, n), or (t, n, n) for t grids. Arrays are (n, n//2 + 1). compliance: of the half-space, by
    precision. stiffness: its approximate inverse, which is asked for in single precision only.
    """

    shape: tuple[int, ...]
    compliance: dict[np.dtype, np.ndarray]
    stiffness: np.ndarray

    @classmethod
    def of(cls, grid: int) -> HalfSpace:
        """The half-space under a grid of so many cells a side."""
        qx = 2 * np.pi * scipy.fft.rfftfreq(grid)
        qy = 2 * np.pi * scipy.fft.fftfreq(grid)
        q = np.hypot(qy[:, None], qx)
        stiffness = (q / 2).astype(np.float32)
        stiffness[0, 0] = _MEAN * np.pi / grid
        with np.errstate(divide="ignore"):
            compliance = 2 / q
        compliance[0, 0] = 0.0
        return cls((grid, grid), in_both_precisions(compliance), stiffness)

    @property
    def grid(self) -> int:
        """Cells a side."""
        return self.shape[-1]

    @property
    def size(self) -> int:
        """Number of cells."""
        return math.prod(self.shape)

    def displacement(self, cells: np.ndarray, pressure: np.ndarray, at: np.ndarray | None = None) -> np.ndarray:
        """Displacement away from the load, in cells, of zero mean, under pressures in E* on cells (k,), rising.

        At cells (m,), rising, or everywhere.
        """
        return self.filtered(cells, pressure, self.compliance[pressure.dtype], at)

    def nearly_inverse(self, cells: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """What gives approximate pressures in E* on cells (k,), rising, that displace these so, and nothing else.

        For the conditioning only. On large grids with little contact it sums over cells nearby, for an inverse reaches
        less far than the half-space does.
        """
        large = len(self.shape) == 2 and self.size * np.float32().itemsize >= _CACHE
        tiles = Tiles.of(cells, self.grid) if large else None
        if tiles is None:
            return lambda displacement: self.filtered(cells, displacement, self.stiffness, cells)
        return lambda displacement: tiles.sums(displacement, _stiffness_nearby())

    def filtered(
        self, cells: np.ndarray, values: np.ndarray, factor: np.ndarray, at: np.ndarray | None = None
    ) -> np.ndarray:
        """Periodic fields whose Fourier modes are multiplied by factors, (n, n//2 + 1), in the precision of the values.

        The field has values (k,) on cells, rising, and is zero elsewhere. The result is given at cells (m,), rising,
        or everywhere.
        """
        if len(self.shape) > 2 or self.size * values.itemsize < _CACHE:
            modes = scipy.fft.rfft2(self.on_grid(cells, values, values.dtype), workers=1)
            modes *= factor
            field = scipy.fft.irfft2(modes, s=self.shape[-2:], overwrite_x=True, workers=1)
            return field if at is None else field.ravel()[at]
        return _filtered_by_blocks(self.grid, cells, values, factor, at)

    def on_grid(self, cells: np.ndarray, values: np.ndarray | float, kind: type = float) -> np.ndarray:
        """A field of given values on cells (k,), counted through, and zero elsewhere."""
        field = np.zeros(self.shape, kind)
        field.ravel()[cells] = values
        return field


@cache
def _stiffness_nearby():
    """Modes of the inverse of the kernel, q/2, as far as tiles let it reach."""
    qx, qy = 2 * np.pi * scipy.fft.rfftfreq(TILE), 2 * np.pi * scipy.fft.fftfreq(TILE)
    return modes_nearby(scipy.fft.irfft2(np.hypot(qy[:, None], qx) / 2, s=(TILE, TILE)))


def in_both_precisions(field: np.ndarray) -> dict[np.dtype, np.ndarray]:
    """A field in double and in single precision, by the type."""
    return {np.dtype(kind): field.astype(kind, copy=False) for kind in (np.float64, np.float32)}


def _filtered_by_blocks(grid, cells, values, factor, at):
    """As `HalfSpace.filtered`, some rows or columns at a time, while they are in the cache; empty rows not at all."""
    each = on_cores if grid >= _LARGE else _one_by_one
    modes = np.empty((grid, grid // 2 + 1), np.result_type(values.dtype, np.complex64))
    found = np.empty((grid, grid) if at is None else len(at), values.dtype)
    rows = blocks(grid, max(_CACHE // (2 * grid * values.itemsize), 1))
    starts = grid * np.array([some.start for some in rows] + [grid])
    given, asked = np.searchsorted(cells, starts), None if at is None else np.searchsorted(at, starts)

    def along_rows(block):
        mine = slice(given[block], given[block + 1])
        if mine.start == mine.stop:
            modes[rows[block]] = 0
            return
        some = np.zeros((rows[block].stop - rows[block].start, grid), values.dtype)
        some.ravel()[cells[mine] - starts[block]] = values[mine]
        modes[rows[block]] = scipy.fft.rfft(some, axis=1, overwrite_x=True, workers=1)

    def along_columns(columns):
        some = scipy.fft.fft(modes[:, columns], axis=0, workers=1)
        some *= factor[:, columns]
        modes[:, columns] = scipy.fft.ifft(some, axis=0, overwrite_x=True, workers=1)

    def back_along_rows(block):
        if asked is None:
            found[rows[block]] = scipy.fft.irfft(modes[rows[block]], n=grid, axis=1, workers=1)
        elif asked[block] < asked[block + 1]:
            mine = slice(asked[block], asked[block + 1])
            some = scipy.fft.irfft(modes[rows[block]], n=grid, axis=1, workers=1)
            found[mine] = some.ravel()[at[mine] - starts[block]]

    each(along_rows, range(len(rows)))
    each(along_columns, blocks(modes.shape[1], _COLUMNS))
    each(back_along_rows, range(len(rows)))
    return found


def _one_by_one(function, items):
    for item in items:
        function(item)
