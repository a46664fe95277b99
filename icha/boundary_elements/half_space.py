"""Elastic half-space on a periodic grid: displacements under pressures, and an approximate inverse.

Lengths are in units of the cell size, pressures in E*. A unit pressure wave with wave number q displaces the surface by
2/q (K. L. Johnson, Contact Mechanics, 1985, sec. 13.2). The mean pressure causes no displacement, because separations
are measured between the mean planes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.fft
from numpy.typing import DTypeLike

from icha.boundary_elements import transforms
from icha.boundary_elements.tiles import TiledGrid

# Stiffness of the approximate inverse for the mean displacement, divided by its stiffness for the longest wave.
_MEAN_STIFFNESS = 0.3


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """Elastic half-space under one periodic n x n grid, or under t independent grids.

    Parameters
    ----------
    shape : shape of all fields, (n, n) or (t, n, n).
    compliance : displacement by unit pressure for each Fourier mode, (n, n//2 + 1), in double and single precision.
    stiffness : inverse of the compliance for each mode, (n, n//2 + 1), in single precision; for the mean displacement
        _MEAN_STIFFNESS times the value of the longest wave.
    """

    shape: tuple[int, ...]
    compliance: dict[np.dtype, np.ndarray]
    stiffness: np.ndarray

    @classmethod
    def of(cls, grid: int) -> HalfSpace:
        """Return the half-space under one grid with the given number of cells along a side."""
        q = 2 * np.pi * np.hypot(scipy.fft.fftfreq(grid)[:, None], scipy.fft.rfftfreq(grid))
        stiffness = (q / 2).astype(np.float32)
        stiffness[0, 0] = _MEAN_STIFFNESS * np.pi / grid
        with np.errstate(divide="ignore"):
            compliance = 2 / q
        compliance[0, 0] = 0.0
        return cls((grid, grid), by_precision(compliance), stiffness)

    @property
    def grid(self) -> int:
        """Number of cells along a side."""
        return self.shape[-1]

    @property
    def size(self) -> int:
        """Number of cells of all grids."""
        return math.prod(self.shape)

    def displacement(
        self, cells: np.ndarray, pressure: np.ndarray, at: np.ndarray | None = None, out: np.ndarray | None = None
    ) -> np.ndarray:
        """Compute the displacement under given pressures, positive into the half-space, with zero mean over the grid.

        Parameters
        ----------
        cells : (k,) int, loaded cells, ascending.
        pressure : (k,), pressure on these cells, in E*; in single or double precision.
        at : (m,) int, ascending, the cells where the displacement is computed; None for the whole grid.
        out : array for the result; only large grids write to it, so use the returned array. None for a new array.
        """
        return self.filter(cells, pressure, self.compliance[pressure.dtype], at, out)

    def filter(
        self,
        cells: np.ndarray,
        values: np.ndarray,
        factor: np.ndarray,
        at: np.ndarray | None = None,
        out: np.ndarray | None = None,
    ) -> np.ndarray:
        """Multiply the Fourier modes of values on cells by factors and transform back; see `displacement`."""
        if len(self.shape) > 2 or self.size * values.itemsize < transforms.CACHE:
            modes = scipy.fft.rfft2(self.field(cells, values, values.dtype), workers=1)
            modes *= factor
            field = scipy.fft.irfft2(modes, s=self.shape[-2:], overwrite_x=True, workers=1)
            return field if at is None else field.ravel()[at]
        return transforms.filter_by_blocks(self.grid, cells, values, factor, at, out)

    def field(self, cells: np.ndarray, values: np.ndarray | float, dtype: DTypeLike = float) -> np.ndarray:
        """Return a field with given values on cells (k,), and zero elsewhere."""
        field: np.ndarray = np.zeros(self.shape, dtype)
        field.ravel()[cells] = values
        return field

    def restrict_to(self, cells: np.ndarray) -> Operator:
        """Return the map from pressures to displacements of given cells, (k,), ascending; with tiles if faster."""
        large = len(self.shape) == 2 and self.size * np.float32().itemsize >= transforms.CACHE
        return (TiledGrid.of(cells, self.grid) if large else None) or FullGrid(self, cells)


class Operator(Protocol):
    """Half-space restricted to k cells: linear map from pressures to displacements, in single precision."""

    @property
    def error(self) -> float:
        """Largest error of a displacement, divided by the largest displacement."""

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """Return the displacements of the k cells, in cell sizes, under pressures on these cells, in E*."""

    def approximate_inverse(self, displacement: np.ndarray) -> np.ndarray:
        """Return approximate pressures of the k cells for given displacements; solvers use it as preconditioner."""


@dataclass(frozen=True, eq=False)
class FullGrid:
    """Exact `Operator` of given cells, by Fourier transforms of the full grid."""

    space: HalfSpace
    cells: np.ndarray
    error: float = 0.0

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """Return the displacements of the k cells under pressures on these cells."""
        return self.space.displacement(self.cells, pressure, self.cells)

    def approximate_inverse(self, displacement: np.ndarray) -> np.ndarray:
        """Apply `stiffness` to displacements; on a single grid, add a uniform pressure in proportion to their sum."""
        pressure = self.space.filter(self.cells, displacement, self.space.stiffness, self.cells)
        if len(self.space.shape) == 2:
            # The contact is stiffer against a mean displacement if a larger share of the grid is in contact.
            share = len(self.cells) / self.space.size
            stiffer = self.space.stiffness[0, 0] * share / max(1 - share, 1 / self.space.size)
            pressure += np.float32(stiffer / self.space.size) * np.sum(displacement)
        return pressure


def by_precision(field: np.ndarray) -> dict[np.dtype, np.ndarray]:
    """Return a dictionary with a field in double and in single precision."""
    return {np.dtype(dtype): field.astype(dtype, copy=False) for dtype in (np.float64, np.float32)}
