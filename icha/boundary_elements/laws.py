"""Laws of attraction between a cell of the surface and the elastic body: tension and energy as functions of the gap.

A law gives the tension t of a cell at its gap g, and the energy, whose slope is t. The *fraction* of a cell in contact
is f = t/s, with the peak s at zero gap. The laws of ICHA soften linearly to the range r and do the work W:

    t = s (1 - g/r),   W = s r/2,   energy -W f^2,   f = 1 - g/r

`Cohesive` is the law of an interface whose range the grid resolves. `ShortRange` replaces it where the grid does not
resolve the range. There the peak follows from the cell size, so that the law is the same for all shorter ranges:
s = sqrt(2 W/C). C is the compliance of a row of cells at a straight front, times a factor that lets the front move
across cells without being trapped. Attraction acts only beside contact. New contact forms where a summit is within its
reach. The sum of the fractions overestimates the contact radius by a constant part of a cell. So the area of adhesion

    A = sum f - b sum f (1 - w*f),   b = PERIMETER, w a Gaussian stencil,

subtracts a term in proportion to the perimeter. This term lowers the work W of a cell at convex fronts:
W = dgamma (1 - b + 2 b w*f). So works and fractions depend on each other, and follow each other in each step of the
solver. Where dgamma is a field, W = (1 - b) dgamma + b (dgamma w*f + w*(dgamma f)).

A front may advance at one work of adhesion and recede at a larger one (`DirectedBonds`). Between both it stands.

Lengths are in units of the cell size, pressures in E*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from icha.boundary_elements.cells import field_of
from icha.boundary_elements.elastic import multiply_modes
from icha.contact.attraction import BOND_COMPLIANCE, FINITE_RANGE, NO_ATTRACTION, SHORT_RANGE, straight_strength

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Width and radius of the stencil in cells, and weight of the perimeter in the work of adhesion, fitted to JKR patches.
_WIDTH, STENCIL_RADIUS = 1.5, 5
PERIMETER = 0.7
# Weights of the perimeter and of the width of the front in the reported area, fitted to patches between Hertz and JKR.
# Smallest reported area of a cell, divided by its fraction.
_EDGE, _FRONT_WIDTH, _SMALLEST_SHARE = 0.236, 1.115, 0.02
# Largest part of the grid that discs of new contact close at once.
_MOST_CLOSED = 0.5
# Gap of a node below which it touches: smaller than any gap that is not zero.
TOUCHING = float(np.finfo(float).smallest_subnormal)
# Smallest change of a gap, over the range, of which the energy is computed exactly.
_SMALL_CHANGE = 1e-4
# Rounds in which fractions of neighbours follow each other, for rates. Each leaves about a seventh of the error.
_ROUNDS = 5
_profile = np.exp(-0.5 * (np.arange(-STENCIL_RADIUS, STENCIL_RADIUS + 1) / _WIDTH) ** 2)
STENCIL = _profile / _profile.sum()


def average(fractions: np.ndarray) -> np.ndarray:
    """Return the Gaussian average w*f of the fractions around every cell of a periodic field, (n, n)."""
    return multiply_modes(fractions, _modes_of_stencil(len(fractions)))


@lru_cache(maxsize=2)
def _modes_of_stencil(grid):
    """Return the Fourier modes of the stencil w, (n, n//2 + 1)."""
    along = np.zeros(grid)
    np.add.at(along, np.arange(-STENCIL_RADIUS, STENCIL_RADIUS + 1) % grid, STENCIL)
    modes = np.fft.fft(along).real
    return modes[:, None] * modes[: grid // 2 + 1]


def at_cells(values: np.ndarray | float, cells: np.ndarray | slice) -> np.ndarray | float:
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


class Bonds:
    """Cells that attract the body, at given works of adhesion: tension and energy of a cell as functions of its gap.

    A law defines `tension`, `energy`, `softening` and `gap`, each of the values of its k cells.

    Attributes
    ----------
    cells : (k,) int, flat indices of the cells, ascending; or the slice of all cells.
    peak : (k,) or a number, tension at zero gap, in E*.
    reach : (k,) or a number, gap at which the tension is zero or negligible, in cell sizes.
    """

    cells: np.ndarray | slice
    peak: np.ndarray | float
    reach: np.ndarray | float

    def tension(self, gap: np.ndarray) -> np.ndarray:
        """Return the tension of each cell, in E*."""
        raise NotImplementedError

    def energy(self, gap: np.ndarray) -> np.ndarray:
        """Return the energy of each cell, in E* times cell size^3: its slope with the gap is the tension."""
        raise NotImplementedError

    def softening(self, gap: np.ndarray) -> np.ndarray:
        """Return the fall of the tension with the gap, -dt/dg, of each open cell, in E* per cell size."""
        raise NotImplementedError

    def gap(self, fraction: np.ndarray) -> np.ndarray:
        """Return the gap of each cell from its fraction, in cell sizes."""
        raise NotImplementedError

    def fraction(self, gap: np.ndarray) -> np.ndarray:
        """Return the fraction f of each cell: its tension divided by the peak."""
        return self.tension(gap) / self.peak

    def direction(self, gap: np.ndarray) -> np.ndarray:
        """Return the work of each cell in its present direction over that on closing, (k,); 0 if the front stands."""
        return np.ones(len(gap))

    def at(self, field: np.ndarray) -> np.ndarray:
        """Return the values of the cells, (k,), from a field, (n, n)."""
        return field.ravel()[self.cells]

    def field(self, values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        """Return the field, (n, n), from the values of the cells, (k,); it is zero elsewhere."""
        return field_of(self.cells, values, shape)

    def energy_beyond_mean_tension(self, before: np.ndarray, after: np.ndarray, change: np.ndarray) -> float:
        """Return the change of the energy minus the mean tension times the change of the gap, in E* times cell size^3.

        For small changes it is zero: the rounding of a difference of energies would be larger.

        before, after, change : (k,), gaps of the cells, and their change, which is finite also outside a shape.
        """
        mean = 0.5 * (self.tension(before) + self.tension(after))
        surplus = self.energy(after) - self.energy(before) - mean * change
        return float(np.sum(surplus * (np.abs(change) > _SMALL_CHANGE * self.reach)))


@dataclass(frozen=True, eq=False)
class LinearBonds(Bonds):
    """Bonds with linear softening.

    Parameters
    ----------
    cells : as in `Bonds`.
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
        """Return the fraction f = 1 - g/r of each cell."""
        return np.clip(1 - gap / self.reach, 0.0, 1.0)

    def tension(self, gap: np.ndarray) -> np.ndarray:
        """Return the tension s f of each cell, in E*."""
        return self.peak * self.fraction(gap)

    def energy(self, gap: np.ndarray) -> np.ndarray:
        """Return the energy -W f^2 of each cell, in E* times cell size^3."""
        return -self.work * self.fraction(gap) ** 2

    def softening(self, gap: np.ndarray) -> np.ndarray:
        """Return s/r of each cell that is open and within the range, in E* per cell size."""
        return np.where((gap > 0) & (gap < self.reach), self.peak / self.reach, 0.0)

    def gap(self, fraction: np.ndarray) -> np.ndarray:
        """Return the gap of each cell from its fraction, in cell sizes."""
        return self.reach * (1 - fraction)

    def stronger(self, ratio: np.ndarray | float) -> LinearBonds:
        """Return the bonds with a larger work: peak and range grow with the square root of the ratio of the works."""
        return LinearBonds(self.cells, self.work * ratio, self.reach * np.sqrt(ratio))


@dataclass(frozen=True, eq=False)
class DirectedBonds(Bonds):
    """Bonds with a work of adhesion where gaps close, and a larger one where they open.

    From a fraction f0, a cell closes by the law with the advancing work, and opens by the law with the receding work:

        closing, g < r_a (1 - f0):  t = s_a (1 - g/r_a)
        opening, g > r_r (1 - f0):  t = s_r (1 - g/r_r)
        between:                    t = k g,   k = (s/r) f0/(1 - f0),   f = f0

    Peaks and ranges are in proportion to the square root of the work, so s/r is the same for both laws, and the tension
    is continuous. Between, the front stands, and the bond is a spring through the origin, as in cohesive zones that
    unload elastically. The state is then that of a front with a work between both. A cell that closes and opens again
    dissipates the difference of both works, in proportion to its fraction f0.

    Parameters
    ----------
    closing, opening : laws with the advancing and with the receding work.
    before : (k,), fraction f0 of each cell.
    """

    closing: LinearBonds
    opening: LinearBonds
    before: np.ndarray

    @property
    def cells(self):
        """Flat indices of the cells, (k,), or the slice of all cells."""
        return self.closing.cells

    @property
    def peak(self):
        """Tension of each cell at zero gap on closing, in E*."""
        return self.closing.peak

    @property
    def reach(self):
        """Range of each cell on opening, in cell sizes."""
        return self.opening.reach

    @property
    def _spring(self):
        """Stiffness k of each cell, in E* per cell size; 0 in full contact, where the front cannot stand."""
        open_part, softening = 1 - self.before, self.closing.peak / self.closing.reach
        return np.divide(softening * self.before, open_part, out=np.zeros_like(open_part), where=open_part > 0)

    def _standing_gap(self, gap):
        """Return the gap of each cell, but at most that at which the cell begins to open."""
        return np.minimum(gap, self.opening.gap(self.before))

    def _choose(self, gap, closing, standing, opening):
        """Return, for each cell, one of three values by the branch of the law at its gap."""
        advances, recedes = gap < self.closing.gap(self.before), gap >= self.opening.gap(self.before)
        return np.where(advances, closing, np.where(recedes, opening, standing))

    def direction(self, gap: np.ndarray) -> np.ndarray:
        """Return the work of each cell in its present direction over that on closing, (k,); 0 if the front stands."""
        return self._choose(gap, 1.0, 0.0, self.opening.work / self.closing.work)

    def fraction(self, gap: np.ndarray) -> np.ndarray:
        """Return the fraction f of each cell."""
        return np.clip(self.before, self.closing.fraction(gap), self.opening.fraction(gap))

    def tension(self, gap: np.ndarray) -> np.ndarray:
        """Return the tension of each cell, in E*."""
        standing = self._spring * self._standing_gap(gap)
        return self._choose(gap, self.closing.tension(gap), standing, self.opening.tension(gap))

    def energy(self, gap: np.ndarray) -> np.ndarray:
        """Return the energy of each cell with what it dissipates, in E* times cell size^3."""
        closing = self.closing.energy(gap) - (self.opening.work - self.closing.work) * self.before
        standing = 0.5 * self._spring * self._standing_gap(gap) ** 2 - self.opening.work * self.before
        return self._choose(gap, closing, standing, self.opening.energy(gap))

    def softening(self, gap: np.ndarray) -> np.ndarray:
        """Return the fall of the tension with the gap, -dt/dg, of each open cell; negative where the front stands."""
        return self._choose(gap, self.closing.softening(gap), -self._spring, self.opening.softening(gap))


@dataclass(frozen=True, eq=False)
class Tangent:
    """First-order change of fractions and tensions with the gaps, at the k partial cells of some bonds.

    At a short range, the fraction of a cell also changes the work of its neighbours and so their peaks.

    Parameters
    ----------
    cells : (k,) int, flat indices of the cells with 0 < f < 1.
    fraction, softening : (k,), values of the cells.
    peak : (k,), tension at zero gap in the direction of each front; infinite where it stands.
    coupling : (k, k) sparse, change of the peaks with the fractions; None without an effect.
    """

    cells: np.ndarray
    fraction: np.ndarray
    peak: np.ndarray
    softening: np.ndarray
    coupling: csr_array | None = None

    def changes(self, gap_change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the changes of fractions and tensions, (n, n) each, for a change of the gaps, (n, n)."""
        tension = -self.softening * gap_change.ravel()[self.cells]
        fraction = tension / self.peak
        if self.coupling is not None:
            for _ in range(_ROUNDS):
                fraction = (tension + (1 - self.fraction) * (self.coupling @ fraction)) / self.peak
            tension = tension + self.coupling @ fraction
        return field_of(self.cells, fraction, gap_change.shape), field_of(self.cells, tension, gap_change.shape)


def directed(bonds: LinearBonds, ratio: float, before: np.ndarray | None) -> Bonds:
    """Return bonds whose work on opening is larger by a ratio, from fractions before, (n, n), if these are given."""
    if before is None:
        return bonds
    return DirectedBonds(bonds, bonds.stronger(ratio), before.ravel()[bonds.cells])


def peak_by_direction(bonds: Bonds, gap: np.ndarray) -> np.ndarray:
    """Return the tension of each cell at zero gap in the direction of its front, (k,); infinite where it stands."""
    ratio = bonds.direction(gap)
    return np.where(ratio > 0, bonds.peak * np.sqrt(ratio), np.inf)


def weights_between(cells: np.ndarray, grid: int) -> csr_array:
    """Return the sparse matrix of the weights w between cells of a periodic grid, (k, k)."""
    from scipy.sparse import csr_array

    number = np.full(grid**2, -1)
    number[cells] = np.arange(len(cells))
    offset = np.arange(-STENCIL_RADIUS, STENCIL_RADIUS + 1)
    (row, column), weight = np.divmod(cells[:, None], grid), np.outer(STENCIL, STENCIL).ravel()
    rows, columns = (row + offset) % grid, (column + offset) % grid
    neighbour = number[(rows[:, :, None] * grid + columns[:, None, :]).reshape(len(cells), offset.size**2)]
    present = neighbour >= 0
    starts = np.concatenate([[0], np.cumsum(np.count_nonzero(present, axis=1))])
    return csr_array((np.broadcast_to(weight, present.shape)[present], neighbour[present], starts), (len(cells),) * 2)


class AtDistance(Bonds):
    """Law of attraction that acts across every gap: contact forms and breaks by itself.

    A law is a subclass with `strength` (peak tension), `reach`, and the functions of `Bonds`. If its values differ from
    cell to cell, it also defines `bonds_of`.
    """

    name = FINITE_RANGE
    cells = slice(None)
    # Whether cells inside a contact are held closed by the law.
    holds_inside = False
    strength: float
    reach: float

    @property
    def peak(self):
        """Tension at zero gap, in E*."""
        return self.strength

    @property
    def straight_strength(self) -> float:
        """Tension at which a closed cell starts to open, in E*."""
        return self.strength

    def bonds_of(self, cells: np.ndarray | slice) -> Bonds:
        """Return the law of some cells."""
        return self

    def works(self, fraction: np.ndarray) -> None:
        """Return None: the law does not depend on the fractions, (n, n)."""

    def bonds(self, fraction: np.ndarray, works: None = None) -> Bonds:
        """Return the law of every cell; it does not depend on the fractions, (n, n)."""
        return self.bonds_of(slice(None))

    def within_reach(self, gap: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        """Return no cells, (k,) int: contact forms by the attraction at a distance."""
        return np.zeros(0, int)

    def acts_on(self, gap: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        """Return the cells that touch or attract, (n, n) bool."""
        return gap <= self.reach

    def energetic_areas(self, cells: np.ndarray, fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Return the energy of adhesion of some cells, (k,), divided by that of a cell in full contact."""
        return self.bonds_of(cells).energy(self.bonds_of(cells).gap(fraction)) / self._full_energy

    def energies(self, cells: np.ndarray, fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Return the energies of some cells, (k,), in E* times cell size^3, with the work of their tension.

        The sum of this energy and of half the pressure times the height is the energy of a cell.
        """
        bonds = self.bonds_of(cells)
        gap = bonds.gap(fraction)
        return bonds.energy(gap) - 0.5 * bonds.tension(gap) * gap

    @property
    def _full_energy(self):
        return float(np.mean(self.bonds_of(slice(None)).energy(np.zeros(1))))

    def dissipated(self, before: np.ndarray, after: np.ndarray) -> float:
        """Return 0: a law that does not depend on the direction dissipates nothing at fronts."""
        return 0.0

    def tangent(self, bonds: Bonds, fraction: np.ndarray, gap: np.ndarray, grid: int) -> Tangent:
        """Return the tangent of the law at given fractions and gaps, (k,)."""
        partial = np.flatnonzero((fraction > 0) & (fraction < 1))
        peak, softening = peak_by_direction(bonds, gap)[partial], bonds.softening(gap)[partial]
        return Tangent(partial, fraction[partial], peak, softening)


@dataclass(frozen=True, eq=False)
class Cohesive(AtDistance):
    """Attraction of a range that the grid resolves, with linear softening.

    Parameters
    ----------
    adhesion_length : dgamma/E* of each cell, (n, n) or a number, in cell sizes; that of an advancing front.
    strength : peak tension of the interface, in E*, at which closed cells open.
    ratio : work of adhesion of a receding front over that of an advancing one.
    before : (n, n), fractions at the last equilibrium, if the ratio is not 1.
    """

    adhesion_length: np.ndarray | float
    strength: float
    ratio: float = 1.0
    before: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Set the gap at which the tension falls to zero, in cell sizes; with a map, the largest one."""
        reach = 2 * self.ratio * self.adhesion_length / self.strength
        object.__setattr__(self, "reach", float(np.max(reach)))

    def dissipated(self, before: np.ndarray, after: np.ndarray) -> float:
        """Return what receding fronts dissipate between two fields of fractions, (n, n), in E* times cell size^3."""
        return float(np.sum((self.ratio - 1) * self.adhesion_length * np.maximum(before - after, 0.0)))

    def bonds(self, fraction: np.ndarray, works: None = None) -> Bonds:
        """Return the law of every cell, in the direction of its front."""
        return directed(self.bonds_of(slice(None)), self.ratio, self.before)

    def bonds_of(self, cells: np.ndarray | slice) -> LinearBonds:
        """Return the law of some cells."""
        work = at_cells(self.adhesion_length, cells)
        return LinearBonds(cells, work, 2 * math.sqrt(self.ratio) * work / self.strength)


@dataclass(frozen=True, eq=False)
class NoAttraction(AtDistance):
    """Contact without adhesion: no bonds; contact forms where the surfaces touch."""

    adhesion_length: float = 0.0
    strength: float = 0.0
    reach: float = 0.0
    name = NO_ATTRACTION

    def bonds_of(self, cells: np.ndarray | slice) -> LinearBonds:
        """Return bonds without cells."""
        return LinearBonds(np.zeros(0, int), 0.0, 1.0)

    def energetic_areas(self, cells: np.ndarray, fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Return the areas of some cells, (k,), divided by the cell area."""
        return fraction


@dataclass(frozen=True, eq=False)
class ShortRange:
    """Attraction of a range that the grid does not resolve: only beside contact, and of summits within reach.

    Parameters
    ----------
    adhesion_length : dgamma/E* of each cell, (n, n) or a number, in cell sizes; that of an advancing front.
    strength : tension, in E*, at which a closed cell opens although its four neighbours are closed.
    jump_in, radius : (n, n), gap of a node below which the summit of its cell jumps into contact, and contact radius of
        this summit after its jump, in cell sizes; without a summit TOUCHING and 0. At most a quarter of the side closes
        at once. A disc much smaller than this radius could open again.
    ratio, before : as in `Cohesive`.
    """

    adhesion_length: np.ndarray | float
    strength: float
    jump_in: np.ndarray
    radius: np.ndarray
    ratio: float = 1.0
    before: np.ndarray | None = None
    name = SHORT_RANGE
    holds_inside = True

    def works(self, fraction: np.ndarray) -> np.ndarray:
        """Return the works of adhesion of all cells, (n, n), at given fractions, (n, n)."""
        # Work and perimeter term follow from one energy, so a cell also has half of the works of its neighbours.
        length = self.adhesion_length
        own = length * average(fraction)
        by_others = own if np.ndim(length) == 0 else average(length * fraction)
        return (1 - PERIMETER) * length + PERIMETER * (own + by_others)

    def bonds(self, fraction: np.ndarray, works: np.ndarray | None = None) -> Bonds:
        """Return the law of every cell that attracts: of contact and its neighbours.

        works : (n, n), works of adhesion of the cells; None for those at the fractions.
        """
        cells = np.flatnonzero(with_neighbours(fraction > 0))
        work = (self.works(fraction) if works is None else works).ravel()[cells]
        # Works that a step continues along its line may be too small; none is below that of a cell without neighbours.
        work = np.maximum(work, (1 - PERIMETER) * at_cells(self.adhesion_length, cells))
        return directed(LinearBonds(cells, work, np.sqrt(2 * BOND_COMPLIANCE * work)), self.ratio, self.before)

    @property
    def straight_strength(self) -> float:
        """Tension at which a closed cell at a straight edge starts to open, in E*; with a map, the largest one."""
        return straight_strength(self.ratio * float(np.max(self.adhesion_length)))

    @property
    def reach(self) -> float:
        """Gap at which the tension of a cell at a straight front falls to zero, in cell sizes."""
        return BOND_COMPLIANCE * self.straight_strength

    def energetic_areas(self, cells: np.ndarray, fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Return the energy of adhesion of some cells, (k,), divided by that of a cell in full contact.

        It is the fraction minus the perimeter term.
        """
        return -self.energies(cells, fraction, mean_fraction) / float(np.mean(self.adhesion_length))

    def energies(self, cells: np.ndarray, fraction: np.ndarray, mean_fraction: np.ndarray) -> np.ndarray:
        """Return the energies of some cells, (k,), in E* times cell size^3, with the work of their tension."""
        return -at_cells(self.adhesion_length, cells) * (fraction - PERIMETER * fraction * (1 - mean_fraction))

    def dissipated(self, before: np.ndarray, after: np.ndarray) -> float:
        """Return what receding fronts dissipate between two fields of fractions, (n, n), in E* times cell size^3.

        It is the difference of both works, integrated while all fractions change in proportion.
        """
        share = 1 - PERIMETER + PERIMETER * (average(before) + average(after))
        return float(np.sum((self.ratio - 1) * self.adhesion_length * share * np.maximum(before - after, 0.0)))

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
        return np.flatnonzero((gap < self.jump_in) & (fraction == 0))

    def acts_on(self, gap: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        """Return the cells that attract, and those that close if contact forms, (n, n) bool."""
        return with_neighbours(fraction > 0) | self.closing(self.within_reach(gap, fraction))

    def closing(self, cells: np.ndarray) -> np.ndarray:
        """Return the cells that close, (n, n) bool, if some cells, (k,) int, come into contact: discs around summits.

        Smaller discs close if they cover more than half of the grid: a given mean separation needs room for the gap.
        """
        radii, largest = self.radius.ravel()[cells], 0.25 * len(self.radius)
        closed = self._discs(cells, np.minimum(radii, largest))
        while largest > 1 and closed.mean() > _MOST_CLOSED:
            largest /= 2
            closed = self._discs(cells, np.minimum(radii, largest))
        return closed

    def _discs(self, cells, radii):
        """Return a mask, (n, n), of discs around some cells, (k,) int; the grid is periodic."""
        closed, grid = np.zeros(self.radius.shape, bool), len(self.radius)
        closed.ravel()[cells] = True
        for cell, radius in zip(cells[radii >= 1], radii[radii >= 1], strict=True):
            offset = np.arange(-int(radius), int(radius) + 1)
            rows, columns = np.nonzero(np.hypot(offset[:, None], offset) <= radius)
            row, column = divmod(int(cell), grid)
            closed[(row + offset[rows]) % grid, (column + offset[columns]) % grid] = True
        return closed

    def tangent(self, bonds: Bonds, fraction: np.ndarray, gap: np.ndarray, grid: int) -> Tangent:
        """Return the tangent of the law at given fractions and gaps, (k,)."""
        partial = (fraction > 0) & (fraction < 1)
        cells, ratio = np.asarray(bonds.cells)[partial], bonds.direction(gap)[partial]
        peak = peak_by_direction(bonds, gap)[partial]

        length = np.broadcast_to(at_cells(self.adhesion_length, cells), cells.shape)
        coupling = weights_between(cells, grid)
        row = np.repeat(np.arange(len(cells)), np.diff(coupling.indptr))
        change_of_work = PERIMETER * ratio[row] * (length[row] + length[coupling.indices])
        coupling.data *= change_of_work / (BOND_COMPLIANCE * peak[row])
        return Tangent(cells, fraction[partial], peak, bonds.softening(gap)[partial], coupling)
