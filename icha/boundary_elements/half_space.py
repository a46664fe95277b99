"""Elastic half-space or layer under a grid of cells: displacements under pressures, and an approximate inverse.

Lengths are in units of the cell size, pressures in E*. There are three kinds:

- Periodic half-space: a unit pressure wave with wave number q displaces the surface by 2/q (K. L. Johnson, Contact
  Mechanics, 1985, sec. 13.2). The mean pressure causes no displacement, because separations are measured between the
  mean planes.
- Periodic layer on a rigid base: `layer_compliance` instead of 2/q. The displacement by the mean pressure is left out
  here too (`Layer.uniform_compliance`).
- Free half-space under a square: the displacement by a uniform pressure on a cell (`cell_displacement`) is summed
  over all loaded cells by a transform of twice the side. It vanishes far from the contact. For a free layer, the
  difference between layer and half-space (`layer_correction`) is added.

The cells of a free square are surrounded by a margin that is never in contact. So edges of contact at the edges of
the square are like all others, although the other modules take the grid as periodic.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
import scipy.fft
from numpy.typing import DTypeLike

from icha.boundary_elements import transforms
from icha.boundary_elements.tiles import TiledGrid
from icha.half_space.layer import Layer, layer_compliance, layer_correction

# Stiffness of the approximate inverse for the mean displacement, divided by its stiffness for the longest wave.
_MEAN_STIFFNESS = 0.3
# Width of the margin on two sides of a free square, in cells: more than the radius of every stencil.
MARGIN = 8
# Sides of smaller squares around the contact on a free square are multiples of this number of cells.
_SQUARE = 16


def cell_displacement(y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the displacement at distances (y, x) from the middle of a cell under unit pressure, on a half-space.

    Source: A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377-420; see Johnson, Contact Mechanics, eq. (3.25).
    """
    result = np.zeros(np.broadcast(y, x).shape)
    for sign_y in (-1, 1):
        for sign_x in (-1, 1):
            b, a = y + 0.5 * sign_y, x + 0.5 * sign_x
            result += sign_y * sign_x * (a * np.arcsinh(b / np.abs(a)) + b * np.arcsinh(a / np.abs(b)))
    return result / np.pi


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """Elastic half-space or layer under one n x n grid, or under t independent grids.

    Parameters
    ----------
    shape : shape of all fields, (n, n) or (t, n, n).
    compliance : displacement by unit pressure for each Fourier mode, (n, n//2 + 1), in double and single precision; on
        a free square, for the modes of `transformed` cells along a side.
    stiffness : inverse of the compliance for each mode, (n, n//2 + 1), in single precision; for the mean displacement
        _MEAN_STIFFNESS times the value of the longest wave.
    layer : elastic layer; None for a half-space.
    transformed : number of cells along a side of the transforms if the grid is a free square; 0 for a periodic grid.
    """

    shape: tuple[int, ...]
    compliance: dict[np.dtype, np.ndarray]
    stiffness: np.ndarray
    layer: Layer | None = None
    transformed: int = 0

    @classmethod
    def of(cls, grid: int, layer: Layer | None = None, *, free: bool = False) -> HalfSpace:
        """Return the half-space or layer under one grid with the given number of cells along a side."""
        sides = scipy.fft.next_fast_len(2 * grid, real=True) if free else grid
        return cls((grid, grid), _compliance(sides, layer, free), _stiffness(grid), layer, sides if free else 0)

    @property
    def grid(self) -> int:
        """Number of cells along a side."""
        return self.shape[-1]

    @property
    def size(self) -> int:
        """Number of cells of all grids."""
        return math.prod(self.shape)

    @property
    def mean_is_fixed(self) -> bool:
        """True if pressures do not change the mean displacement, so that the mean separation is the mean gap."""
        return not self.compliance[np.dtype(float)][0, 0]

    def displacement(
        self, cells: np.ndarray, pressure: np.ndarray, at: np.ndarray | None = None, out: np.ndarray | None = None
    ) -> np.ndarray:
        """Compute the displacement under given pressures, positive into the half-space.

        Parameters
        ----------
        cells : (k,) int, loaded cells, ascending.
        pressure : (k,), pressure on these cells, in E*; in single or double precision.
        at : (m,) int, ascending, the cells where the displacement is computed; None for the whole grid.
        out : array for the result; only large grids write to it, so use the returned array. None for a new array.
        """
        if self.transformed:
            field = self._convolve(self.field(cells, pressure, pressure.dtype))
            return field if at is None else field.ravel()[at]
        return self.filter(cells, pressure, self.compliance[pressure.dtype], at, out)

    def _convolve(self, pressure):
        """Return the displacement by a field of pressures on a free square; outside the square there is no pressure."""
        grid, many = self.grid, self.transformed
        modes = scipy.fft.rfft(pressure, many, axis=1, workers=1)
        modes = scipy.fft.fft(modes, many, axis=0, overwrite_x=True, workers=1)
        modes *= self.compliance[pressure.dtype]
        modes = scipy.fft.ifft(modes, axis=0, overwrite_x=True, workers=1)[:grid]
        return scipy.fft.irfft(modes, many, axis=1, overwrite_x=True, workers=1)[:, :grid]

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
        if self.transformed:
            return FullGrid(*self._smallest_square(cells))
        large = len(self.shape) == 2 and self.size * np.float32().itemsize >= transforms.CACHE
        return (TiledGrid.of(cells, self.grid) if large and not self.layer else None) or FullGrid(self, cells)

    def _smallest_square(self, cells):
        """Return the free half-space under a square around given cells, (k,), and their numbers in this square."""
        row, column = np.divmod(cells, self.grid)
        first = [int(each.min(initial=self.grid - 1)) for each in (row, column)]
        widths = [int(each.max(initial=0)) + 1 - start for each, start in zip((row, column), first, strict=True)]
        # Sides in steps, so that few of them are transformed.
        side = min(_SQUARE * -(-max(widths) // _SQUARE), self.grid)
        many = scipy.fft.next_fast_len(2 * side, real=True)
        compliance = _window_compliance(self.transformed, self.layer, True, many)
        square = HalfSpace((side, side), compliance, _stiffness(side), self.layer, many)
        return square, (row - first[0]) * side + column - first[1]

    def window_kernel(self, side: int) -> tuple[dict[np.dtype, np.ndarray], np.ndarray]:
        """Return compliance (two precisions) and stiffness of a window, exact for cells closer than half its side."""
        many, free = self.transformed or self.grid, bool(self.transformed)
        return _window_compliance(many, self.layer, free, side), _stiffness(side)


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
        if len(self.space.shape) == 2 and self.space.mean_is_fixed:
            # The contact is stiffer against a mean displacement if a larger share of the grid is in contact.
            share = len(self.cells) / self.space.size
            stiffer = self.space.stiffness[0, 0] * share / max(1 - share, 1 / self.space.size)
            pressure += np.float32(stiffer / self.space.size) * np.sum(displacement)
        return pressure


def wave_numbers(grid: int) -> np.ndarray:
    """Return the wave number q of each Fourier mode of an n x n grid, (n, n//2 + 1), per cell size."""
    return 2 * np.pi * np.hypot(scipy.fft.fftfreq(grid)[:, None], scipy.fft.rfftfreq(grid))


def _stiffness(grid):
    """Return q/2 for each Fourier mode of an n x n grid, and a stiffness for the mean displacement."""
    stiffness = (wave_numbers(grid) / 2).astype(np.float32)
    stiffness[0, 0] = _MEAN_STIFFNESS * np.pi / grid
    return stiffness


@lru_cache(maxsize=4)
def _compliance(grid, layer, free):
    """Return the displacement by unit pressure for each mode of the transforms, in double and single precision."""
    if free:
        along = np.abs(scipy.fft.fftfreq(grid)) * grid
        displaced = cell_displacement(along[:, None], along)
        if layer:
            displaced += layer_correction(np.hypot(along[:, None], along), layer)
        modes = scipy.fft.rfft2(displaced).real
    else:
        q = wave_numbers(grid)
        with np.errstate(divide="ignore"):
            modes = 2 / q if layer is None else layer_compliance(q, layer)
        modes[0, 0] = 0.0
    return by_precision(modes)


@lru_cache(maxsize=2)
def _displacement_table(grid, layer, free):
    """Return the displacement of each cell of the transforms by unit pressure on the first cell, (n, n)."""
    return scipy.fft.irfft2(_compliance(grid, layer, free)[np.dtype(float)], s=(grid, grid), workers=1)


@lru_cache(maxsize=16)
def _window_compliance(grid, layer, free, side):
    """Return the compliance of a window in double and single precision; see `HalfSpace.window_kernel`."""
    table = _displacement_table(grid, layer, free)
    offset = np.rint(scipy.fft.fftfreq(side) * side).astype(int)
    return by_precision(scipy.fft.rfft2(table[np.ix_(offset, offset)]).real)


def by_precision(field: np.ndarray) -> dict[np.dtype, np.ndarray]:
    """Return a dictionary with a field in double and in single precision."""
    return {np.dtype(dtype): field.astype(dtype, copy=False) for dtype in (np.float64, np.float32)}
