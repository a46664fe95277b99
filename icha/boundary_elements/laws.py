"""Laws of attraction between a cell of the surface and the elastic body: tension and energy as functions of the gap.

All laws soften linearly: the tension falls from its peak s at zero gap to zero at the range r, and does the work W.

    t(g) = s (1 - g/r),   W = s r / 2,   energy -W f^2,   f = 1 - g/r: the *fraction* of a cell in contact

`Cohesive` is the law of an interface whose range the grid resolves. `ShortRange` replaces it where the grid does not
resolve the range. There the peak follows from the cell size, so that the law is the same for all shorter ranges:
s = sqrt(2 W/C). C is the compliance of a row of cells at a straight front, times a factor that lets the front move
across cells without being trapped. Attraction acts only beside contact. New contact forms where a summit is within its
reach. The sum of the fractions overestimates the contact radius by a constant part of a cell. So the area of adhesion

    A = sum f - b sum f (1 - w*f),   b = PERIMETER, w a Gaussian stencil,

subtracts a term in proportion to the perimeter. This term lowers the work W of a cell at convex fronts:
W = dgamma (1 - b + 2 b w*f). So works and fractions depend on each other, and follow each other in a few rounds.

Lengths are in units of the cell size, pressures in E*.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from icha.boundary_elements.elastic import multiply_modes
from icha.contact.attraction import BOND_COMPLIANCE, FINITE_RANGE, NO_ATTRACTION, SHORT_RANGE, straight_strength

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Width and radius of the stencil in cells, and weight of the perimeter in the work of adhesion, fitted to JKR patches.
_WIDTH, _RADIUS = 1.5, 5
PERIMETER = 0.7
# Weights of the perimeter and of the width of the front in the reported area, fitted to patches between Hertz and JKR.
# Smallest reported area of a cell, divided by its fraction.
_EDGE, _FRONT_WIDTH, _SMALLEST_SHARE = 0.236, 1.115, 0.02
# Largest part of the grid that discs of new contact close at once.
_MOST_CLOSED = 0.5
# Rounds in which fractions of neighbours follow each other: for rates, and for each step. Each leaves about a tenth of
# the error.
_ROUNDS, _ROUNDS_OF_STEP = 5, 2
_profile = np.exp(-0.5 * (np.arange(-_RADIUS, _RADIUS + 1) / _WIDTH) ** 2)
STENCIL = _profile / _profile.sum()


def average(fractions: np.ndarray) -> np.ndarray:
    """Return the Gaussian average w*f of the fractions around every cell of a periodic field, (n, n)."""
    return multiply_modes(fractions, _modes_of_stencil(len(fractions)))


@lru_cache(maxsize=2)
def _modes_of_stencil(grid):
    """Return the Fourier modes of the stencil w, (n, n//2 + 1)."""
    along = np.zeros(grid)
    np.add.at(along, np.arange(-_RADIUS, _RADIUS + 1) % grid, STENCIL)
    modes = np.fft.fft(along).real
    return modes[:, None] * modes[: grid // 2 + 1]


def at_cells(values: np.ndarray | float, cells: np.ndarray) -> np.ndarray | float:
    """Return the values of some cells, (k,), from a field, (n, n), or a number that holds for all cells."""
    return values if np.ndim(values) == 0 else np.ravel(values)[cells]


def with_neighbours(cells: np.ndarray) -> np.ndarray:
    """Return a periodic mask, (n, n), together with all cells that share an edge with one of its cells."""
    result = cells.copy()
    for target, source in ((slice(1, None), slice(-1)), (slice(1), slice(-1, None))):
        result[target] |= cells[source]
        result[source] |= cells[target]
        result[:, target] |= cells[:, source]
        result[:, source] |= cells[:, target]
    return result


@dataclass(frozen=True, eq=False)
class Bonds:
    """Cells that attract the body, with linear softening at constant works and ranges.

    Parameters
    ----------
    cells : (k,) int, flat indices of the cells, ascending; or the slice of all cells.
    work : (k,) or a number, work of adhesion W of each cell, in E* times cell size.
    reach : (k,) or a number, range r of each cell, in cell sizes.
    """

    cells: np.ndarray | slice
    work: np.ndarray | float
    reach: np.ndarray | float

    @property
    def peak(self):
        """Tension s at zero gap, in E*."""
        return 2 * self.work / self.reach

    def fraction(self, gap: np.ndarray) -> np.ndarray:
        """Return the fraction f of each cell, (k,), at given gaps, (n, n)."""
        return np.clip(1 - gap.ravel()[self.cells] / self.reach, 0.0, 1.0)

    def field(self, fraction: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        """Return the field of fractions, (n, n), from those of the cells, (k,)."""
        field = np.zeros(shape)
        field.ravel()[self.cells] = fraction
        return field

    def tension(self, fraction: np.ndarray) -> np.ndarray:
        """Return the tension of each cell, (k,), from its fraction, in E*."""
        return self.peak * fraction

    def crossing_energy(self, before: np.ndarray, after: np.ndarray, gap_change: np.ndarray) -> float:
        """Return the part of a change of energy that the mean tension does not explain, in E* times cell size^3.

        Where the gap stays within the range, the energy changes by the mean tension times the change of the gap. A cell
        that enters or leaves the range has no tension on a part of the way.

        before, after : (k,), fractions of the cells; gap_change : (n, n).
        """
        crossing = (before == 0) != (after == 0)
        beyond = gap_change.ravel()[self.cells] + self.reach * (after - before)
        return -0.5 * float(np.sum(self.tension(before + after) * beyond * crossing))

    def slope(self, fraction: np.ndarray) -> np.ndarray:
        """Return the fall of the tension with the gap, -dt/dg, of each cell, (k,), in E* per cell size."""
        return np.where((fraction > 0) & (fraction < 1), self.peak / self.reach, 0.0)


@dataclass(frozen=True, eq=False)
class Tangent:
    """First-order change of fractions and tensions with the gaps, at the k partial cells of some bonds.

    With constant works the tension falls by peak/reach per gap. At a short range, the fraction of a cell also changes
    the work of its neighbours and so their peaks, by `coupling` times the average of the changes of the fractions.

    Parameters
    ----------
    cells : (k,) int, flat indices of the cells with 0 < f < 1.
    fraction, peak, reach : (k,), values of the cells.
    coupling : (k,), change of the peak by the average change of the fractions around a cell; None without an effect.
    weights : (k, k) sparse, weights of the average.
    """

    cells: np.ndarray
    fraction: np.ndarray
    peak: np.ndarray
    reach: np.ndarray
    coupling: np.ndarray | None = None
    weights: csr_array | None = None

    def changes(self, gap_change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the changes of fractions and tensions, (k,) each, for a change of the gaps, (n, n)."""
        direct = -gap_change.ravel()[self.cells] / self.reach
        if self.coupling is None:
            return direct, self.peak * direct
        change = direct
        for _ in range(_ROUNDS):
            change = direct + (1 - self.fraction) / self.peak * self.coupling * (self.weights @ change)
        return change, self.coupling * (self.weights @ change) + self.peak * direct


def neighbour_weights(cells: np.ndarray, grid: int) -> csr_array:
    """Return the sparse matrix of the weights w between cells of a periodic grid, (k, k)."""
    from scipy.sparse import csr_array

    number = np.full(grid**2, -1)
    number[cells] = np.arange(len(cells))
    offset = np.arange(-_RADIUS, _RADIUS + 1)
    (row, column), weight = np.divmod(cells[:, None], grid), np.outer(STENCIL, STENCIL).ravel()
    rows, columns = (row + offset) % grid, (column + offset) % grid
    neighbour = number[(rows[:, :, None] * grid + columns[:, None, :]).reshape(len(cells), offset.size**2)]
    present = neighbour >= 0
    starts = np.concatenate([[0], np.cumsum(np.count_nonzero(present, axis=1))])
    return csr_array((np.broadcast_to(weight, present.shape)[present], neighbour[present], starts), (len(cells),) * 2)


@dataclass(frozen=True, eq=False)
class Cohesive:
    """Attraction of a range that the grid resolves.

    Parameters
    ----------
    adhesion_length : dgamma/E* of each cell, (n, n) or a number, in cell sizes.
    strength : peak tension of the interface, in E*.
    """

    adhesion_length: np.ndarray | float
    strength: float
    name = FINITE_RANGE
    rounds = 0
    holds_inside = False

    @property
    def straight_strength(self) -> float:
        """Peak tension of the interface, in E*."""
        return self.strength

    @property
    def reach(self) -> float:
        """Gap at which the tension falls to zero, in cell sizes; with a map, the largest one."""
        return float(np.max(2 * self.adhesion_length / self.strength))

    @staticmethod
    def adhesive_areas(fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Return the adhesive area of each cell, divided by the cell area: its fraction.

        A partial cell has the energy -dgamma f^2 per area, and the pressure on it acts through the gap. The sum is
        that of the pressure on the height alone, and of -dgamma f (see `BoundaryElements.stored_energy`).
        """
        return fraction

    def bonds(self, fraction: np.ndarray) -> Bonds:
        """Return the law of every cell; it does not depend on the fractions."""
        return Bonds(slice(None), np.ravel(self.adhesion_length), np.ravel(2 * self.adhesion_length / self.strength))

    def within_reach(self, gap: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        """Return no cells, (k,) int: contact forms by the attraction at a distance."""
        return np.zeros(0, int)

    def tangent(self, bonds: Bonds, fraction: np.ndarray, grid: int) -> Tangent:
        """Return the tangent of the law at given fractions, (k,)."""
        partial = np.flatnonzero((fraction > 0) & (fraction < 1))
        every = np.zeros(len(partial))
        return Tangent(partial, fraction[partial], every + bonds.peak, every + bonds.reach)


@dataclass(frozen=True, eq=False)
class ShortRange:
    """Attraction of a range that the grid does not resolve: only beside contact, and of summits within reach.

    Parameters
    ----------
    adhesion_length : dgamma/E* of each cell, (n, n) or a number, in cell sizes.
    strength : tension, in E*, at which a closed cell opens although its four neighbours are closed.
    summits, above, jump_in, radius : (k,), cell of each summit, its height above the node of the cell, the largest gap
        at which it jumps into contact, and the contact radius of a lone summit after its jump, in cell sizes. At most a
        quarter of the side closes at once. A disc much smaller than this radius could open again.
    """

    adhesion_length: np.ndarray | float
    strength: float
    summits: np.ndarray
    above: np.ndarray
    jump_in: np.ndarray
    radius: np.ndarray
    name = SHORT_RANGE
    rounds = _ROUNDS_OF_STEP
    holds_inside = True

    def bonds(self, fraction: np.ndarray) -> Bonds:
        """Return the law of every cell, with the work at the present fractions; only neighbours of contact attract."""
        cells = np.flatnonzero(with_neighbours(fraction > 0))
        mean = average(fraction).ravel()[cells]
        work = at_cells(self.adhesion_length, cells) * (1 - PERIMETER + 2 * PERIMETER * mean)
        return Bonds(cells, work, np.sqrt(2 * BOND_COMPLIANCE * work))

    @property
    def straight_strength(self) -> float:
        """Tension at which a closed cell at a straight edge starts to open, in E*; with a map, the largest one."""
        return straight_strength(float(np.max(self.adhesion_length)))

    @property
    def reach(self) -> float:
        """Gap at which the tension of a cell at a straight front falls to zero, in cell sizes."""
        return BOND_COMPLIANCE * self.straight_strength

    @staticmethod
    def adhesive_areas(fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Return the adhesive area of each cell, divided by the cell area: its fraction minus its perimeter term."""
        return fraction - PERIMETER * fraction * (1 - mean_fraction)

    @staticmethod
    def reported_areas(fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Return the contact area of each cell as reported in results, divided by the cell area.

        The sum of the fractions is larger than the contact area, the more so the wider the front is. One term subtracts
        the effect of the perimeter, and one the effect of partial cells. The radius of patches of 4 to 16 cells is then
        exact within some hundredths of a cell, with strong and with negligible adhesion (docs/short_range.md).
        """
        share = 1 - _EDGE * (1 - mean_fraction) - _FRONT_WIDTH * (1 - fraction)
        return fraction * np.maximum(share, _SMALLEST_SHARE)

    @staticmethod
    def reported_area_gradient(fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Return the derivative of the sum of `reported_areas` with respect to the fraction of each cell, (k,).

        It includes the effect of a cell on the areas of its neighbours: the stencil is symmetric. The derivative is
        approximate next to cells with the smallest area, `_SMALLEST_SHARE` of their fraction.
        """
        gradient = 1 - _EDGE - _FRONT_WIDTH + 2 * _EDGE * mean_fraction + 2 * _FRONT_WIDTH * fraction
        share = 1 - _EDGE * (1 - mean_fraction) - _FRONT_WIDTH * (1 - fraction)
        return np.where(share > _SMALLEST_SHARE, gradient, _SMALLEST_SHARE)

    def within_reach(self, gap: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        """Return the open cells that touch, or whose summit is within its reach, (k,) int, ascending."""
        open_cells = fraction.ravel() == 0
        near = gap.ravel()[self.summits] - self.above < self.jump_in
        touching = np.flatnonzero((gap.ravel() <= 0) & open_cells)
        return np.union1d(self.summits[near & open_cells[self.summits]], touching)

    def closing(self, cells: np.ndarray, grid: int) -> np.ndarray:
        """Return the cells that close, (m,) int, if some cells, (k,) int, come into contact: discs around summits.

        Smaller discs close if they cover more than half of the grid: a given mean separation needs room for the gap.
        """
        chosen, largest = np.isin(self.summits, cells), 0.25 * grid
        closed = self._discs(self.summits[chosen], np.minimum(self.radius[chosen], largest), grid)
        while largest > 1 and closed.mean() > _MOST_CLOSED:
            largest /= 2
            closed = self._discs(self.summits[chosen], np.minimum(self.radius[chosen], largest), grid)
        closed.ravel()[cells] = True
        return np.flatnonzero(closed)

    @staticmethod
    def _discs(cells, radii, grid):
        """Return a mask, (n, n), of discs around some cells, (k,) int; the grid is periodic."""
        closed = np.zeros((grid, grid), bool)
        for cell, radius in zip(cells, radii, strict=True):
            offset = np.arange(-int(radius), int(radius) + 1)
            rows, columns = np.nonzero(np.hypot(offset[:, None], offset) <= radius)
            row, column = divmod(int(cell), grid)
            closed[(row + offset[rows]) % grid, (column + offset[columns]) % grid] = True
        return closed

    def tangent(self, bonds: Bonds, fraction: np.ndarray, grid: int) -> Tangent:
        """Return the tangent of the law at given fractions, (k,)."""
        partial = (fraction > 0) & (fraction < 1)
        cells, peak, reach = (np.asarray(each)[partial] for each in (bonds.cells, bonds.peak, bonds.reach))
        coupling = 2 * PERIMETER * at_cells(self.adhesion_length, cells) / (BOND_COMPLIANCE * peak)
        return Tangent(cells, fraction[partial], peak, reach, coupling, neighbour_weights(cells, grid))


@dataclass(frozen=True)
class NoAttraction:
    """Contact without adhesion: no bonds; contact forms where the surfaces touch."""

    adhesion_length: float = 0.0
    strength: float = 0.0
    straight_strength: float = 0.0
    reach: float = 0.0
    name = NO_ATTRACTION
    rounds = 0
    holds_inside = False

    def bonds(self, fraction: np.ndarray) -> Bonds:
        """Return bonds without work."""
        return Bonds(np.zeros(0, int), 0.0, 1.0)

    def within_reach(self, gap: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        """Return no cells, (k,) int."""
        return np.zeros(0, int)

    def tangent(self, bonds: Bonds, fraction: np.ndarray, grid: int) -> Tangent:
        """Return the tangent of no bonds."""
        nothing = np.zeros(0)
        return Tangent(nothing.astype(int), nothing, nothing, nothing)
