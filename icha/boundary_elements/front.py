"""Law of a cell at the edge of contact: tension against gap, area, and the energy release rate.

A cell has a fraction of contact f. Its bond to the half-space has the compliance c(f) = C (1/f - 1): closed for f = 1,
none for f = 0. At a given work of adhesion dgamma the energy of bonds, half-space and adhesion is stationary in f where
the tension of the cell is f s, with the strength s = sqrt(2 dgamma/C) (A. A. Griffith, Phil. Trans. A 221 (1921) 163).
With f eliminated this is a cohesive law: the tension falls linearly with the gap g, t = s (1 - g/g_c), to zero at
g_c = C s, and does the work dgamma. Its range follows the grid. C is that of the rows of cells at a straight front,
times a factor: then a front moves through its cells without being trapped, and is about two cells wide.

The edge of contact lies inside that of the sum of fractions, by a constant part of a cell. An area that counts cells
by their neighbours,

    A = sum f - b sum f (1 - w*f),   w a Gaussian stencil,

takes a perimeter off the sum: off the area and, through its derivative, off the work of adhesion at curved fronts.

Units of the grid: lengths in cells, pressures in E*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import correlate1d
from scipy.sparse import csr_array

# Compliance of the last row of a straight contact, with the kernel 2/q, over h/E*; and the factor of a bond's, at which
# circular patches, wherever in their cells, follow JKR (docs/short_range.md).
_ROW_COMPLIANCE, _SOFTENING = 1.7316, 3.5
COMPLIANCE = _SOFTENING * _ROW_COMPLIANCE
# Width and reach of the stencil in cells, and the weight of the perimeter in the work of adhesion, from JKR patches.
_WIDTH, _REACH = 1.5, 5
PERIMETER = 0.7
# Weights of the perimeter and of the front's width in the reported area, from patches between Hertz's and JKR's; and
# the smallest area of a cell over its fraction.
_EDGE, _FRONT_WIDTH, _SMALLEST_SHARE = 0.236, 1.115, 0.02
_profile = np.exp(-0.5 * (np.arange(-_REACH, _REACH + 1) / _WIDTH) ** 2)
STENCIL = _profile / _profile.sum()
# Rows of the matrix of neighbours that are built together.
_BATCH = 4096


def mean_around(fractions: np.ndarray) -> np.ndarray:
    """Mean fraction of contact around every cell, w*f, of fields (..., n, n)."""
    along_columns = correlate1d(fractions, STENCIL, axis=-2, mode="wrap")
    return correlate1d(along_columns, STENCIL, axis=-1, mode="wrap")


def neighbour_weights(cells: np.ndarray, shape: tuple[int, ...]) -> csr_array:
    """Weights w between given cells, (k, k), in single precision.

    Parameters
    ----------
    cells : (k,) int, ascending, of grids of the shape (n, n) or (t, n, n).
    """
    grid, count = shape[-1], len(cells)
    number = np.full(math.prod(shape), -1, np.int32)
    number[cells] = np.arange(count, dtype=np.int32)
    offset = np.arange(-_REACH, _REACH + 1)
    weight = np.outer(STENCIL, STENCIL).astype(np.float32).ravel()
    columns, values, sizes = [], [], []
    for first in range(0, count, _BATCH):
        batch = cells[first : first + _BATCH, None]
        row, column = np.divmod(batch % grid**2, grid)
        start = batch - batch % grid**2 + (row + offset) % grid * grid
        neighbour = number[start[:, :, None] + ((column + offset) % grid)[:, None, :]].reshape(len(batch), -1)
        present = neighbour >= 0
        columns.append(neighbour[present])
        values.append(np.broadcast_to(weight, present.shape)[present])
        sizes.append(np.count_nonzero(present, axis=1))
    starts = np.concatenate([[0], np.cumsum(np.concatenate([[], *sizes]))]).astype(np.int32)
    return csr_array(
        (np.concatenate([np.zeros(0, np.float32), *values]), np.concatenate([np.zeros(0, np.int32), *columns]), starts),
        shape=(count, count),
    )


def adhesive_areas(fraction: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Contact area of each cell in the work of adhesion, in cells; around: `mean_around` of the fractions."""
    return fraction - PERIMETER * fraction * (1 - around)


def adhesive_area_gradient(around: np.ndarray) -> np.ndarray:
    """Return derivative of the total of `adhesive_areas` with respect to the fraction of each cell."""
    return 1 - PERIMETER + 2 * PERIMETER * around


def reported_areas(fraction: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Contact area of each cell in results, in cells.

    The sum of fractions extends beyond the edge of contact by a length that depends on the width of the front, which
    partial cells indicate. With both terms the radius of patches of 4 to 16 cells is right to some hundredths of a
    cell, whether adhesion is strong or negligible (docs/short_range.md).
    """
    return fraction * np.maximum(1 - _EDGE * (1 - around) - _FRONT_WIDTH * (1 - fraction), _SMALLEST_SHARE)


def reported_area_gradient(fraction: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Return derivative of the total of `reported_areas` with respect to the fraction of each cell."""
    gradient = 1 - _EDGE - _FRONT_WIDTH + 2 * _EDGE * around + 2 * _FRONT_WIDTH * fraction
    share = 1 - _EDGE * (1 - around) - _FRONT_WIDTH * (1 - fraction)
    return np.where(share > _SMALLEST_SHARE, gradient, _SMALLEST_SHARE)


@dataclass(frozen=True)
class Front:
    """Front of a contact.

    Parameters
    ----------
    adhesion_length : dgamma/E*, in cells; zero without adhesion.
    interface_strength : tension, in E*, at which contact opens without a front.
    """

    adhesion_length: float
    interface_strength: float = math.inf

    @property
    def strength(self) -> float:
        """Largest tension of a cell at a straight front, in E*."""
        return float(np.sqrt(2 * self.adhesion_length / COMPLIANCE))

    @property
    def critical_opening(self) -> float:
        """Gap at which a cell at a straight front is open, in cells."""
        return COMPLIANCE * self.strength

    def strengths(self, around: np.ndarray) -> np.ndarray:
        """Largest tension of cells with given mean fractions around them: less where the front is convex."""
        return self.strength * np.sqrt(adhesive_area_gradient(around))

    def strength_change(self, strengths: np.ndarray, around_change: np.ndarray) -> np.ndarray:
        """Change of the strengths with that of the mean fractions around."""
        return self.strength**2 * PERIMETER / strengths * around_change
