"""The front of contact within its cells: what holds a cell that is partly in contact, and when its front rests.

A cell has a fraction of contact f. It is held by a bond of compliance c(f) = C (1/f - 1): closed for f = 1, none for
f = 0. At a given energy of adhesion the front rests where the energy of bonds, half-space and adhesion is stationary
in f, which is where the tension of the cell is f times the strength, s = sqrt(2 dgamma/C): a traction that falls
linearly with the gap and does the work dgamma (A. A. Griffith, Phil. Trans. A 221 (1921) 163). C is that of the rows at
a straight front, times a factor: then a front moves through its cells without being trapped by them, and what is
between open and closed is about two cells wide.

The edge of contact lies inside that of the sum of fractions, by a constant part of a cell. An area that counts cells
by their neighbours,

    A = sum f - b sum f (1 - w*f),   w a Gaussian stencil,

takes a perimeter off the sum, in the area and, through its derivative, in the work of adhesion at curved fronts.

In units of the grid: lengths in cells, pressures in E*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array

from icha.boundary_elements.kernel import HalfSpace
from icha.boundary_elements.nearby import TILE, Tiles

# Compliance of the last row of a straight contact, with the kernel 2/q, over h/E*. The front's own is larger by a
# factor at which circular spots, wherever in their cells, follow JKR (docs/short_range.md).
_ROW = 1.7316
_SOFTER = 3.5
COMPLIANCE = _SOFTER * _ROW
# The stencil of neighbours, its width in cells, and the weight of the perimeter (as above, from JKR spots).
_WIDTH = 1.5
_REACH = 5
PERIMETER = 0.7
# Weights of the perimeter and of the front's width in the area that is told, from spots between Hertz's and JKR's.
_EDGE, _WIDE = 0.236, 1.115
# Of its fraction, what a cell that hardly touches counts for at least.
_LEAST = 0.02
_profile = np.exp(-0.5 * (np.arange(-_REACH, _REACH + 1) / _WIDTH) ** 2)
STENCIL = _profile / _profile.sum()


@cache
def _neighbour_modes(grid: int, kind: np.dtype) -> np.ndarray:
    """Factors, (n, n//2 + 1), of Fourier modes that make `neighbours`."""
    way = np.arange(-_REACH, _REACH + 1)
    along = np.cos(2 * np.pi * np.outer(np.fft.fftfreq(grid), way)) @ STENCIL
    return np.outer(along, along[: grid // 2 + 1]).astype(kind)


def neighbours(space: HalfSpace, cells: np.ndarray, fraction: np.ndarray, at: np.ndarray | None = None) -> np.ndarray:
    """w*f: mean fraction of contact around cells (m,), rising, or around all; of fractions on cells (k,), rising."""
    near = space.nearly(at) if at is not None and space.is_large else None
    if at is not None and isinstance(near, Tiles):
        everywhere = np.zeros(len(at), fraction.dtype)
        everywhere[np.searchsorted(at, cells)] = fraction
        return near.sums(everywhere, _neighbour_modes(TILE, fraction.dtype))
    return space.filtered(cells, fraction, _neighbour_modes(space.grid, fraction.dtype), at)


def neighbour_weights(cells: np.ndarray, shape: tuple[int, ...]) -> csr_array:
    """The part of w between given cells, (k,), counted through on grids of a shape: (k, k), in single precision."""
    grid, count = shape[-1], len(cells)
    number = np.full(math.prod(shape), -1, np.int32)
    number[cells] = np.arange(count, dtype=np.int32)
    within = cells % grid**2
    first, (row, column) = cells - within, np.divmod(within, grid)
    columns = [(column + way) % grid for way in range(-_REACH, _REACH + 1)]
    found, weights = [np.stack([np.arange(count)] * 2)], [np.full(count, STENCIL[_REACH] ** 2)]
    for down in range(_REACH + 1):
        start = first + (row + down) % grid * grid
        for way, at in zip(range(-_REACH, _REACH + 1), columns, strict=True):
            if (down, way) <= (0, 0):
                continue
            other = number[start + at]
            one = np.flatnonzero(other >= 0)
            found.append(np.stack([one, other[one]]))
            weights.append(np.full(len(one), STENCIL[_REACH + down] * STENCIL[_REACH + way]))
    entries = np.concatenate(weights).astype(np.float32), np.concatenate(found, axis=1)
    half = coo_array(entries, (count, count)).tocsr()
    return half + half.T - diags_array(half.diagonal(), dtype=np.float32, format="csr")


def adhesive_areas(fraction: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Contact area of every cell as the energy of adhesion has it, in cells; around: `neighbours` of the fractions."""
    return fraction - PERIMETER * fraction * (1 - around)


def adhesive_area_gradient(around: np.ndarray) -> np.ndarray:
    """Change of the whole area with the fraction of every cell."""
    return 1 - PERIMETER + 2 * PERIMETER * around


def reported_areas(fraction: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Contact area of every cell as it is reported, in cells.

    Beside `adhesive_areas`: how far the sum of fractions lies outside the edge of contact depends on how wide the front
    is, which cells partly in contact say. With both terms the radius of spots of 4 to 16 cells is right to some
    hundredths of a cell whether adhesion is strong or next to nothing (docs/short_range.md).
    """
    return fraction * np.maximum(1 - _EDGE * (1 - around) - _WIDE * (1 - fraction), _LEAST)


def reported_area_gradient(fraction: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Change of the whole area, as it is reported, with the fraction of every cell."""
    whole = 1 - _EDGE - _WIDE + 2 * _EDGE * around + 2 * _WIDE * fraction
    return np.where(1 - _EDGE * (1 - around) - _WIDE * (1 - fraction) > _LEAST, whole, _LEAST)


@dataclass(frozen=True)
class Front:
    """The front of a contact with a given adhesion length dgamma/E*, in cells; zero: no adhesion."""

    adhesion_length: float

    @property
    def strength(self) -> float:
        """Tension of a cell whose front is straight, when it begins to open, in E*."""
        return float(np.sqrt(2 * self.adhesion_length / COMPLIANCE))

    def strengths(self, around: np.ndarray) -> np.ndarray:
        """Tension at which cells begin to open, from their neighbours: less where the front is convex."""
        return self.strength * np.sqrt(adhesive_area_gradient(around))

    def strength_change(self, strengths: np.ndarray, around_change: np.ndarray) -> np.ndarray:
        """Change of the strengths with that of the neighbours."""
        return self.strength**2 * PERIMETER / strengths * around_change
