"""The elastic half-space on a periodic grid: displacement under pressures, and its approximate inverse.

In units of the grid: lengths in cells, pressures in E*. A pressure of wave vector q displaces by 2/q (K. L. Johnson,
Contact Mechanics, 1985, sec. 13.2); its mean displaces nothing, for separations are those of the mean planes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.fft
from numpy.typing import DTypeLike

from icha.boundary_elements import transforms
from icha.boundary_elements.nearby import Tiles
from icha.support import parallel

# The inverse of the kernel for the mean, in parts of that of the longest wave.
_MEAN = 0.3


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

    @property
    def is_large(self) -> bool:
        """Whether it is one grid whose transforms take longer than finding out what is where."""
        return len(self.shape) == 2 and self.grid >= parallel.LARGE_GRID

    def displacement(
        self,
        cells: np.ndarray,
        pressure: np.ndarray,
        at: np.ndarray | None = None,
        out: np.ndarray | None = None,
    ) -> np.ndarray:
        """Displacement away from the load, in cells, of zero mean, under pressures in E* on cells (k,), rising.

        At cells (m,), rising, or everywhere, in the place of a field `out` of the same kind if that pays.
        """
        return self.filtered(cells, pressure, self.compliance[pressure.dtype], at, out)

    def nearly(self, cells: np.ndarray) -> Nearly:
        """What pressures on cells (k,), rising, displace these, and back: for equations solved step by step."""
        beyond_cache = len(self.shape) == 2 and self.size * np.float32().itemsize >= transforms.CACHE
        return (Tiles.of(cells, self.grid) if beyond_cache else None) or Whole(self, cells)

    def filtered(
        self,
        cells: np.ndarray,
        values: np.ndarray,
        factor: np.ndarray,
        at: np.ndarray | None = None,
        out: np.ndarray | None = None,
    ) -> np.ndarray:
        """Periodic fields whose Fourier modes are multiplied by factors, (n, n//2 + 1), in the precision of the values.

        The field has values (k,) on cells, rising, and is zero elsewhere. The result is given at cells (m,), rising,
        or everywhere, in the place of a field `out` of the same kind if that pays.
        """
        if len(self.shape) > 2 or self.size * values.itemsize < transforms.CACHE:
            modes = scipy.fft.rfft2(self.on_grid(cells, values, values.dtype), workers=1)
            modes *= factor
            field = scipy.fft.irfft2(modes, s=self.shape[-2:], overwrite_x=True, workers=1)
            return field if at is None else field.ravel()[at]
        return transforms.filtered(self.grid, cells, values, factor, at, out)

    def on_grid(self, cells: np.ndarray, values: np.ndarray | float, kind: DTypeLike = float) -> np.ndarray:
        """A field of given values on cells (k,), counted through, and zero elsewhere."""
        field: np.ndarray = np.zeros(self.shape, kind)
        field.ravel()[cells] = values
        return field


class Nearly(Protocol):
    """The half-space for some of its cells, (k,), in single precision."""

    @property
    def error(self) -> float:
        """Of displacements, at most, over the largest displacement."""

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """What pressures in E* displace the cells, (k,), in cells."""

    def inverse(self, displacement: np.ndarray) -> np.ndarray:
        """Pressures in E* that displace the cells about so, (k,), and nothing else: a preconditioner."""


@dataclass(frozen=True, eq=False)
class Whole:
    """The half-space for some of its cells, (k,), rising, by transforms of all of it: exact."""

    space: HalfSpace
    cells: np.ndarray
    error: float = 0.0

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """As of `Nearly`."""
        return self.space.displacement(self.cells, pressure, self.cells)

    def inverse(self, displacement: np.ndarray) -> np.ndarray:
        """As of `Nearly`."""
        return self.space.filtered(self.cells, displacement, self.space.stiffness, self.cells)


def in_both_precisions(field: np.ndarray) -> dict[np.dtype, np.ndarray]:
    """A field in double and in single precision, by the type."""
    return {np.dtype(kind): field.astype(kind, copy=False) for kind in (np.float64, np.float32)}
