"""The elastic half-space on a periodic grid: displacement under pressures, and its approximate inverse.

In units of the grid: lengths in cells, pressures in E*. A pressure of wave vector q displaces by 2/q (K. L. Johnson,
Contact Mechanics, 1985, sec. 13.2); its mean displaces nothing, for separations are those of the mean planes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.fft

from icha.support.parallel import blocks, cores, on_cores

# The inverse of the kernel for the mean, in parts of that of the longest wave.
_MEAN = 0.3
# Bytes of modes from which it pays to transform, multiply and transform back some columns at a time, while they are in
# the cache; nodes a side from which several threads do.
_CACHE, _COLUMNS, _LARGE = 2_000_000, 32, 2048


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """Fourier kernel of a periodic half-space on an n x n grid, or of many that know nothing of each other.

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

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """Displacement away from the load, in cells, of zero mean, under pressures in E*; fields."""
        return filtered(pressure, self.compliance[pressure.dtype])

    def pressure(self, displacement: np.ndarray) -> np.ndarray:
        """The pressure in E* that makes a displacement; its mean is made up, for conditioning alone."""
        return filtered(displacement, self.stiffness)

    def on_grid(self, cells: np.ndarray, values: np.ndarray | float, kind: type = float) -> np.ndarray:
        """A field of given values on cells (k,), counted through, and zero elsewhere."""
        field = np.zeros(self.shape, kind)
        field.ravel()[cells] = values
        return field


def in_both_precisions(field: np.ndarray) -> dict[np.dtype, np.ndarray]:
    """A field in double and in single precision, by the type."""
    return {np.dtype(kind): field.astype(kind, copy=False) for kind in (np.float64, np.float32)}


def filtered(field: np.ndarray, factor: np.ndarray) -> np.ndarray:
    """Periodic fields, (..., n, n), with their Fourier modes times factors (n, n//2 + 1), in the precision of both."""
    grid = field.shape[-1]
    if field.ndim > 2 or field.nbytes < _CACHE:
        modes = scipy.fft.rfft2(field, workers=1)
        modes *= factor
        return scipy.fft.irfft2(modes, s=(grid, grid), overwrite_x=True, workers=1)
    workers = cores() if grid >= _LARGE else 1
    modes = scipy.fft.rfft(field, axis=1, workers=workers)

    def along_columns(columns):
        some = scipy.fft.fft(modes[:, columns], axis=0, workers=1)
        some *= factor[:, columns]
        modes[:, columns] = scipy.fft.ifft(some, axis=0, overwrite_x=True, workers=1)

    all_columns = blocks(modes.shape[1], _COLUMNS)
    if workers > 1:
        on_cores(along_columns, all_columns)
    else:
        for columns in all_columns:
            along_columns(columns)
    return scipy.fft.irfft(modes, n=grid, axis=1, overwrite_x=True, workers=workers)
