"""Law of a cell at the edge of contact: tension against gap, area, and the energy release rate.

A cell has a fraction of contact f. Its bond to the half-space has the compliance c(f) = C (1/f - 1): closed for f = 1,
none for f = 0. At a given work of adhesion dgamma the energy of bonds, half-space and adhesion is stationary in f where
the tension of the cell is f s, with the strength s = sqrt(2 dgamma/C) (A. A. Griffith, Phil. Trans. A 221 (1921) 163).
With f eliminated this is a cohesive law: the tension falls linearly with the gap g, t = s (1 - g/g_c), to zero at
g_c = C s, and does the work dgamma. Its range follows the grid. C is that of the rows of cells at a straight front,
times a factor: then a front moves through its cells without being trapped, and is about two cells wide.

The sum of fractions overestimates the contact radius by a constant part of a cell. An area that counts cells by their
neighbours,

    A = sum f - b sum f (1 - w*f),   w a Gaussian stencil,

takes a perimeter off the sum: off the area and, through its derivative, off the work of adhesion at curved fronts.

Units of the grid: lengths in cells, pressures in E*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

# SciPy is imported where it is used, because `icha describe` needs `Front` alone.
if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Compliance of the last row of a straight contact, with the kernel 2/q, in h/E*; and factor by which that of a bond is
# larger. With it circular patches follow JKR, wherever they lie on the grid (docs/short_range.md).
_ROW_COMPLIANCE, _BOND_FACTOR = 1.7316, 3.5
COMPLIANCE = _BOND_FACTOR * _ROW_COMPLIANCE
# Compliance at the front in preconditioners: that of a bond less that of the half-space.
NET_COMPLIANCE = 0.6 * COMPLIANCE
# Width and reach of the stencil in cells, and the weight of the perimeter in the work of adhesion, from JKR patches.
_WIDTH, _REACH = 1.5, 5
PERIMETER = 0.7
# Weights of the perimeter and of the front's width in the reported area, from patches between Hertz's and JKR's; and
# the smallest area of a cell, divided by its fraction.
_EDGE, _FRONT_WIDTH, _SMALLEST_SHARE = 0.236, 1.115, 0.02
_profile = np.exp(-0.5 * (np.arange(-_REACH, _REACH + 1) / _WIDTH) ** 2)
STENCIL = _profile / _profile.sum()
# Rows of the matrix of neighbours that are built together.
_BATCH = 4096


def average_fractions(fractions: np.ndarray) -> np.ndarray:
    """Return the Gaussian mean w*f of the fractions of every cell, itself included; fields (..., n, n)."""
    from scipy.ndimage import correlate1d

    along_columns = correlate1d(fractions, STENCIL, axis=-2, mode="wrap")
    return correlate1d(along_columns, STENCIL, axis=-1, mode="wrap")


def neighbour_weights(cells: np.ndarray, shape: tuple[int, ...]) -> csr_array:
    """Weights w between given cells, (k, k), in single precision.

    Parameters
    ----------
    cells : (k,) int, ascending, of grids of the shape (n, n) or (t, n, n).
    """
    from scipy.sparse import csr_array

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


def adhesive_areas(fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
    """Area of each cell that counts in the adhesion energy, in cells: f less its perimeter term."""
    return fraction - PERIMETER * fraction * (1 - mean_fraction)


def adhesive_area_gradient(mean_fraction: np.ndarray) -> np.ndarray:
    """Return derivative of the total of `adhesive_areas` with respect to the fraction of each cell."""
    return 1 - PERIMETER + 2 * PERIMETER * mean_fraction


def reported_areas(fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
    """Contact area of each cell in results, in cells.

    The sum of fractions extends beyond the edge of contact by a length that depends on the width of the front, which
    partial cells indicate. With both terms the radius of patches of 4 to 16 cells is right to some hundredths of a
    cell, whether adhesion is strong or negligible (docs/short_range.md).
    """
    return fraction * np.maximum(1 - _EDGE * (1 - mean_fraction) - _FRONT_WIDTH * (1 - fraction), _SMALLEST_SHARE)


def reported_area_gradient(fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
    """Return derivative of the total of `reported_areas` with respect to the fraction of each cell.

    Approximate next to cells at the floor `_SMALLEST_SHARE`.
    """
    gradient = 1 - _EDGE - _FRONT_WIDTH + 2 * _EDGE * mean_fraction + 2 * _FRONT_WIDTH * fraction
    share = 1 - _EDGE * (1 - mean_fraction) - _FRONT_WIDTH * (1 - fraction)
    return np.where(share > _SMALLEST_SHARE, gradient, _SMALLEST_SHARE)


def bond_compliance(fraction: np.ndarray) -> np.ndarray:
    """Compliance of the bond of cells with given fractions, h/E*."""
    return COMPLIANCE * (1 / fraction - 1)


@dataclass(frozen=True)
class Front:
    """Linear cohesive law of a front, which is written out only in this module.

    Fraction f, strength s, tension t and opening g of a cell obey t = f s and g = C s (1 - f).

    Parameters
    ----------
    adhesion_length : dgamma/E*, in cells; zero without adhesion.
    interface_strength : tension, in E*, at which contact opens without a front.
    """

    adhesion_length: float
    interface_strength: float = math.inf

    @property
    def strength(self) -> float:
        """Tension at which a closed cell at a straight edge starts to open, in E*."""
        return float(np.sqrt(2 * self.adhesion_length / COMPLIANCE))

    @property
    def critical_opening(self) -> float:
        """Gap at which a cell at a straight front is open, in cells."""
        return COMPLIANCE * self.strength

    def strengths(self, mean_fraction: np.ndarray) -> np.ndarray:
        """Tension at which closed cells at the edge start to open, in E*: less where the front is convex."""
        return self.strength * np.sqrt(adhesive_area_gradient(mean_fraction))

    def strength_change(self, strengths: np.ndarray, mean_fraction_change: np.ndarray) -> np.ndarray:
        """Change of the strengths with that of the mean fractions."""
        return self.strength**2 * PERIMETER / strengths * mean_fraction_change

    def tension(self, strengths: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        """Tension of cells at the front, in E*."""
        return strengths * fraction

    def tension_change(
        self, strengths: np.ndarray, fraction: np.ndarray, strengths_change: np.ndarray, fraction_change: np.ndarray
    ) -> np.ndarray:
        """Change of the tension with those of strength and fraction."""
        return strengths * fraction_change + fraction * strengths_change

    def opening(self, strengths: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        """Gap of cells at the front, in cells."""
        return COMPLIANCE * strengths * (1 - fraction)

    def opening_change(self, strengths_change: np.ndarray, tension_change: np.ndarray) -> np.ndarray:
        """Change of the gap with those of strength and tension, in single precision."""
        return np.float32(COMPLIANCE) * (strengths_change - tension_change)

    def intensity(self, fraction: np.ndarray, pressure: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Stress intensity of cells in contact divided by the critical one: tension divided by that of the law."""
        return -pressure / self.tension(self.strengths(mean_fraction), fraction)

    def relative_gap(self, gap: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Gap of open cells divided by the one at which they are open, g/g_c; below 1 they close."""
        return gap / (COMPLIANCE * self.strengths(mean_fraction))

    def adhesion_energy(self, fraction: np.ndarray, mean_fraction: np.ndarray) -> float:
        """Work of adhesion of all cells, in E* cells^3."""
        return self.adhesion_length * float(np.sum(adhesive_areas(fraction, mean_fraction)))
