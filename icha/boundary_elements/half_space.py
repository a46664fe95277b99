"""Elastic half-space on a periodic grid: displacement under pressures, and an approximate inverse.

Units of the grid: lengths in cells, pressures in E*. A pressure of wave vector q displaces the surface by 2/q (K. L.
Johnson, Contact Mechanics, 1985, sec. 13.2). The mean pressure displaces nothing, since separations are those of the
mean planes.
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

# Approximate inverse for the mean pressure, divided by that for the longest wave.
_MEAN_STIFFNESS = 0.3


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """Half-space under one n x n grid, or under t independent ones.

    Parameters
    ----------
    shape : of fields, (n, n) or (t, n, n).
    compliance : Fourier kernel, (n, n//2 + 1), by precision.
    stiffness : its approximate inverse, (n, n//2 + 1), in single precision.
    """

    shape: tuple[int, ...]
    compliance: dict[np.dtype, np.ndarray]
    stiffness: np.ndarray

    @classmethod
    def of(cls, grid: int) -> HalfSpace:
        """Half-space under a grid of so many cells along a side."""
        q = 2 * np.pi * np.hypot(scipy.fft.fftfreq(grid)[:, None], scipy.fft.rfftfreq(grid))
        stiffness = (q / 2).astype(np.float32)
        stiffness[0, 0] = _MEAN_STIFFNESS * np.pi / grid
        with np.errstate(divide="ignore"):
            compliance = 2 / q
        compliance[0, 0] = 0.0
        return cls((grid, grid), by_precision(compliance), stiffness)

    @property
    def grid(self) -> int:
        """Cells along a side."""
        return self.shape[-1]

    @property
    def size(self) -> int:
        """Number of cells."""
        return math.prod(self.shape)

    def displacement(
        self, cells: np.ndarray, pressure: np.ndarray, at: np.ndarray | None = None, out: np.ndarray | None = None
    ) -> np.ndarray:
        """Displacement, positive into the half-space, of zero mean.

        Parameters
        ----------
        cells : (k,) int, loaded cells, ascending.
        pressure : (k,), in E*; single or double precision.
        at : (m,) int, cells where the displacement is computed, ascending; None: everywhere.
        out : a field of the same type that may be overwritten.
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
        """Multiply the Fourier modes of values on cells by factors; arguments as in `displacement`."""
        if len(self.shape) > 2 or self.size * values.itemsize < transforms.CACHE:
            modes = scipy.fft.rfft2(self.field(cells, values, values.dtype), workers=1)
            modes *= factor
            field = scipy.fft.irfft2(modes, s=self.shape[-2:], overwrite_x=True, workers=1)
            return field if at is None else field.ravel()[at]
        return transforms.filter_by_blocks(self.grid, cells, values, factor, at, out)

    def field(self, cells: np.ndarray, values: np.ndarray | float, dtype: DTypeLike = float) -> np.ndarray:
        """Field with given values on cells (k,), and zero elsewhere."""
        field: np.ndarray = np.zeros(self.shape, dtype)
        field.ravel()[cells] = values
        return field

    def restrict_to(self, cells: np.ndarray) -> Operator:
        """Operator between pressures and displacements of cells (k,), ascending, for iterative solvers."""
        large = len(self.shape) == 2 and self.size * np.float32().itemsize >= transforms.CACHE
        return (TiledGrid.of(cells, self.grid) if large else None) or FullGrid(self, cells)


class Operator(Protocol):
    """Half-space between pressures (E*) and displacements (cells) of k of its cells, in single precision."""

    @property
    def error(self) -> float:
        """Largest error of a displacement, divided by the largest displacement."""

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """Displacements (k,) under pressures (k,)."""

    def approximate_inverse(self, displacement: np.ndarray) -> np.ndarray:
        """Pressures (k,) for displacements (k,), approximately: a preconditioner."""


@dataclass(frozen=True, eq=False)
class FullGrid:
    """`Operator` that transforms the full grid: exact."""

    space: HalfSpace
    cells: np.ndarray
    error: float = 0.0

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """Displacements (k,) under pressures (k,)."""
        return self.space.displacement(self.cells, pressure, self.cells)

    def approximate_inverse(self, displacement: np.ndarray) -> np.ndarray:
        """Pressures (k,) for displacements (k,), approximately."""
        pressure = self.space.filter(self.cells, displacement, self.space.stiffness, self.cells)
        if len(self.space.shape) == 2:
            # The smaller the gaps, the stiffer the contact is against its mean pressure.
            share = len(self.cells) / self.space.size
            stiffer = self.space.stiffness[0, 0] * share / max(1 - share, 1 / self.space.size)
            pressure += np.float32(stiffer / self.space.size) * np.sum(displacement)
        return pressure


def by_precision(field: np.ndarray) -> dict[np.dtype, np.ndarray]:
    """Return a field in double and in single precision, by type."""
    return {np.dtype(dtype): field.astype(dtype, copy=False) for dtype in (np.float64, np.float32)}
