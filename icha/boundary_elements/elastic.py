"""Elastic half-space or layer under a grid of cells: pressures under displacements, and displacements under pressures.

    Unit of length: cell size.      u > 0: the surface is displaced into the body.
    Unit of pressure: E*.           p > 0: the pressure compresses.

There are three kinds. Each multiplies the Fourier modes of a field by factors:

- Periodic half-space: a unit pressure wave with wave number q displaces the surface by 2/q (K. L. Johnson, Contact
  Mechanics, 1985, sec. 13.2).
- Periodic layer on a rigid base: `layer_compliance` instead of 2/q.
- Free half-space or layer under a square: the displacement by a uniform pressure on a cell (`cell_displacement`, with
  `layer_correction`), on a grid of twice the side. Cells outside the square carry no pressure. So the periodic images
  of the larger grid have no effect in the square.

A rigid displacement of the whole grid causes no pressure, unless the rigid approach of a free square is given. The
approach follows from the mean displacement and the mean pressure (`HalfSpace.mean_compliance`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import scipy.fft

from icha.half_space.layer import Layer, layer_compliance, layer_correction

# On Linux, new memory costs a fault for every 4 KiB, and the C library returns freed blocks to the system if they are
# larger than a limit. Freeing a block of up to 32 MiB raises this limit to its size (mallopt(3), M_MMAP_THRESHOLD), so
# arrays are made of memory that was used before. That saves a seventh of the time of the solver.
np.empty(31 * 2**20, np.uint8)


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
    """Elastic half-space or layer under an n x n grid.

    Parameters
    ----------
    grid : number of cells along a side of the grid; on a free square, at least twice the side of the square.
    layer : elastic layer; None for a half-space.
    free : whether the body is free outside the square; otherwise it is periodic.
    """

    grid: int
    layer: Layer | None = None
    free: bool = False

    @classmethod
    def under(cls, side: int, layer: Layer | None = None, *, free: bool = False) -> HalfSpace:
        """Return the body under a surface with `side` cells along a side."""
        return cls(scipy.fft.next_fast_len(2 * side, real=True) if free else side, layer, free)

    def part(self, grid: int) -> HalfSpace:
        """Return the body under a part of the surface, with a grid of another number of cells along a side."""
        return HalfSpace(grid, self.layer, self.free)

    @property
    def mean_compliance(self) -> float:
        """Mean displacement divided by the mean pressure of the grid on a free square; 0 on a periodic surface.

        Separations of periodic surfaces are measured between the mean planes, so this displacement is left out.
        """
        return float(self._compliance[0, 0]) if self.free else 0.0

    def pressure(self, displacement: np.ndarray, rigid: float | None = None) -> np.ndarray:
        """Return the pressure, (n, n), that causes a displacement, (n, n).

        Its mean is zero or, with a given rigid approach of a free square, follows from the mean displacement.
        """
        pressure = multiply_modes(displacement, self._stiffness)
        if rigid is not None:
            pressure += (displacement.mean() - rigid) / self.mean_compliance
        return pressure

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """Return the displacement, (n, n), under a pressure, (m, m), m <= n; the other cells carry no pressure.

        On a periodic surface, the mean displacement is zero.
        """
        return multiply_modes(pressure, self._compliance)

    @cached_property
    def _compliance(self):
        """Displacement by unit pressure for each mode, (n, n//2 + 1)."""
        return _compliance(self.grid, self.layer, self.free)

    @cached_property
    def _stiffness(self):
        """Pressure by unit displacement for each mode, (n, n//2 + 1); zero for the mean."""
        stiffness = np.zeros_like(self._compliance)
        stiffness.flat[1:] = 1 / self._compliance.flat[1:]
        return stiffness


def multiply_modes(field: np.ndarray, factors: np.ndarray) -> np.ndarray:
    """Return a field, (n, n), after its Fourier modes, (n, n//2 + 1), are multiplied by factors.

    A smaller field, (m, m), is zero in the other cells.
    """
    rows, grid = len(field), len(factors)
    modes = np.zeros(factors.shape, complex) if rows < grid else np.empty(factors.shape, complex)
    np.fft.rfft(field, grid, axis=1, out=modes[:rows])
    np.fft.fft(modes, axis=0, out=modes)
    modes *= factors
    np.fft.ifft(modes, axis=0, out=modes)
    return np.fft.irfft(modes, grid, axis=1)


def wave_numbers(grid: int) -> np.ndarray:
    """Return the wave number q of each Fourier mode of an n x n grid, (n, n//2 + 1), per cell size."""
    return 2 * np.pi * np.hypot(scipy.fft.fftfreq(grid)[:, None], scipy.fft.rfftfreq(grid))


@lru_cache(maxsize=2)
def _compliance(grid, layer, free):
    """Return the displacement by unit pressure for each mode; on a periodic surface zero for the mean."""
    if free:
        along = np.abs(scipy.fft.fftfreq(grid)) * grid
        displaced = cell_displacement(along[:, None], along)
        if layer:
            displaced += layer_correction(np.hypot(along[:, None], along), layer)
        return scipy.fft.rfft2(displaced).real
    q = wave_numbers(grid)
    waves = q > 0
    q[waves] = 2 / q[waves] if layer is None else layer_compliance(q[waves], layer)
    return q
