"""Law of a cell at the edge of contact: its tension, gap and contact area, and the energy release rate.

Each cell has a fraction of contact f and a bond to the half-space with the compliance c(f) = C (1/f - 1). The bond is
rigid at f = 1 and broken at f = 0. The sum of elastic energy and adhesion energy is stationary in f if the tension of
the cell is f s. The strength s = sqrt(2 dgamma/C) contains the work of adhesion dgamma (A. A. Griffith, Phil. Trans.
A 221 (1921) 163). With f eliminated, bonds obey a cohesive law: the tension falls linearly with the gap g to zero at
g_c, t = s (1 - g/g_c) with g_c = C s, and does the work dgamma. The range g_c depends on the cell size. C is the
compliance of a row of cells at a straight front, times a factor. The factor lets the front move across cells without
being trapped, and makes the front about two cells wide.

Any cohesive law t(f), g(f) must fulfil three conditions. (1) The compliance of a bond is c = g/t, with t = s and g = 0
at f = 1. (2) dc/df = -C (s/t)^2. (3) s^2 = 2 W/C is proportional to the local work of adhesion W, because C and t/s do
not depend on W. Then (K/K_c)^2 = G/W. Here K/K_c is the tension of a cell divided by t(f), and G is the energy release
rate. Other modules use the law only through `bond_compliance` and `Front`.

The sum of the fractions overestimates the contact radius by a constant part of a cell. So the area

    A = sum f - b sum f (1 - w*f),   b = `PERIMETER`, w a Gaussian stencil,

subtracts a term in proportion to the perimeter. This term lowers the work of adhesion per area at convex fronts.

Lengths are in units of the cell size, pressures in E*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

# SciPy is imported where it is used, because `icha describe` needs `Front` alone.
if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Compliance of the last row of cells of a straight contact (kernel 2/q, cell size h), in h/E*. The compliance of a bond
# is larger by a factor. Above 1 no cell snaps; with 3.5, patches follow JKR at any position (docs/short_range.md).
_ROW_COMPLIANCE, _BOND_FACTOR = 1.7316, 3.5
COMPLIANCE = _BOND_FACTOR * _ROW_COMPLIANCE
# Compliance of a cell at the front in preconditioners: about that of its bond minus that of the half-space.
NET_COMPLIANCE = 0.6 * COMPLIANCE
# Width and radius of the stencil in cells, and weight of the perimeter in the work of adhesion, fitted to JKR patches.
_WIDTH, _RADIUS = 1.5, 5
PERIMETER = 0.7
# Weights of the perimeter and of the width of the front in the reported area, fitted to patches between Hertz and JKR.
# Smallest reported area of a cell, divided by its fraction.
_EDGE, _FRONT_WIDTH, _SMALLEST_SHARE = 0.236, 1.115, 0.02
_profile = np.exp(-0.5 * (np.arange(-_RADIUS, _RADIUS + 1) / _WIDTH) ** 2)
STENCIL = _profile / _profile.sum()
# Rows of the matrix of `neighbour_weights` that are built together.
_BATCH = 4096


def bond_compliance(fraction: np.ndarray) -> np.ndarray:
    """Return the compliance of bonds, gap divided by tension, in cell sizes per E*."""
    return COMPLIANCE * (1 / fraction - 1)


def average_fractions(fractions: np.ndarray) -> np.ndarray:
    """Return the Gaussian average w*f of the fractions around every cell of periodic fields (..., n, n)."""
    from scipy.ndimage import correlate1d

    along_columns = correlate1d(fractions, STENCIL, axis=-2, mode="wrap")
    return correlate1d(along_columns, STENCIL, axis=-1, mode="wrap")


def neighbour_weights(cells: np.ndarray, shape: tuple[int, ...]) -> csr_array:
    """Return the sparse matrix (k, k) of weights w between cells, in single precision; zero outside 11 x 11 cells.

    Parameters
    ----------
    cells : (k,) int, ascending.
    shape : shape of the grid, (n, n), or of t independent grids, (t, n, n).
    """
    from scipy.sparse import csr_array

    grid, count = shape[-1], len(cells)
    number = np.full(math.prod(shape), -1, np.int32)
    number[cells] = np.arange(count, dtype=np.int32)
    offset = np.arange(-_RADIUS, _RADIUS + 1)
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
    """Return the adhesive area of each cell, divided by the cell area: its fraction minus its perimeter term."""
    return fraction - PERIMETER * fraction * (1 - mean_fraction)


def reported_areas(fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
    """Return the contact area of each cell as reported in results, divided by the cell area.

    The sum of the fractions is larger than the contact area, the more so the wider the front is. One term subtracts the
    effect of the perimeter, and one the effect of partial cells. The radius of patches of 4 to 16 cells is then exact
    within some hundredths of a cell, with strong and with negligible adhesion (docs/short_range.md).
    """
    return fraction * np.maximum(1 - _EDGE * (1 - mean_fraction) - _FRONT_WIDTH * (1 - fraction), _SMALLEST_SHARE)


def reported_area_gradient(fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
    """Return the derivative of the sum of `reported_areas` with respect to the fraction of each cell, (k,).

    It includes the effect of a cell on the areas of its neighbours. The stencil is symmetric, so the values of the cell
    are enough. The derivative is approximate next to cells with the smallest area, `_SMALLEST_SHARE` of their fraction.
    """
    gradient = 1 - _EDGE - _FRONT_WIDTH + 2 * _EDGE * mean_fraction + 2 * _FRONT_WIDTH * fraction
    share = 1 - _EDGE * (1 - mean_fraction) - _FRONT_WIDTH * (1 - fraction)
    return np.where(share > _SMALLEST_SHARE, gradient, _SMALLEST_SHARE)


@dataclass(frozen=True)
class Front:
    """Linear cohesive law of cells at the front: tension t = f s and gap g = C s (1 - f), with the module's symbols.

    Parameters
    ----------
    adhesion_length : dgamma/E*, in cell sizes; zero without adhesion.
    interface_strength : tension, in E*, at which a closed cell opens although its four neighbours are closed. (Cells at
        the front have the strength s, which depends on the cell size: the grid smooths a singular tension.)
    """

    adhesion_length: float
    interface_strength: float = math.inf

    @property
    def straight_strength(self) -> float:
        """Tension s = sqrt(2 dgamma/C) at which a closed cell at a straight edge starts to open, in E*."""
        return float(np.sqrt(2 * self.adhesion_length / COMPLIANCE))

    @property
    def critical_opening(self) -> float:
        """Gap g_c at which the tension of a cell at a straight front falls to zero, in cell sizes."""
        return COMPLIANCE * self.straight_strength

    def local_strengths(self, mean_fraction: np.ndarray) -> np.ndarray:
        """Return the tension at which closed cells at the front start to open, in E*; it is lower at convex fronts."""
        # Derivative of the sum of `adhesive_areas` with respect to the fraction of each cell.
        area_gradient = 1 - PERIMETER + 2 * PERIMETER * mean_fraction
        return self.straight_strength * np.sqrt(area_gradient)

    def strength_change(self, strengths: np.ndarray, mean_fraction_change: np.ndarray) -> np.ndarray:
        """Return the first-order change of the strengths for given changes of the mean fractions."""
        return self.straight_strength**2 * PERIMETER / strengths * mean_fraction_change

    def tension(self, strengths: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        """Return the tension of cells at the front from their strengths and fractions, in E*."""
        return strengths * fraction

    def tension_change(
        self, strengths: np.ndarray, fraction: np.ndarray, strengths_change: np.ndarray, fraction_change: np.ndarray
    ) -> np.ndarray:
        """Return the first-order change of the tension for given changes of strength and fraction."""
        return strengths * fraction_change + fraction * strengths_change

    def law_gap(self, strengths: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        """Return the gap g = C s (1 - f) of cells at the front from their strengths and fractions, in cell sizes."""
        return COMPLIANCE * strengths * (1 - fraction)

    def law_gap_change(
        self,
        strengths: np.ndarray,
        fraction: np.ndarray,
        strengths_change: np.ndarray,
        fraction_change: np.ndarray,
        damping: np.ndarray,
    ) -> np.ndarray:
        """Return the first-order change of the gap g = C (s - t), in single precision; damping lengthens dt."""
        tension_change = self.tension_change(strengths, fraction, strengths_change, fraction_change)
        return np.float32(COMPLIANCE) * (strengths_change - (1 + damping) * tension_change)

    def intensity(self, fraction: np.ndarray, pressure: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Return K/K_c of cells in contact: their tension divided by the tension of the law at the same fraction."""
        return -pressure / self.tension(self.local_strengths(mean_fraction), fraction)

    def relative_gap(self, gap: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Return the gap of open cells, divided by the gap C s of zero tension; below 1 the cells close."""
        return gap / (COMPLIANCE * self.local_strengths(mean_fraction))

    def adhesion_energy(self, fraction: np.ndarray, mean_fraction: np.ndarray) -> float:
        """Return the work of adhesion dgamma times the adhesive area of all cells, in E* times cell size^3."""
        return self.adhesion_length * float(np.sum(adhesive_areas(fraction, mean_fraction)))
