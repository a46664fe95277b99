"""Contact of a rough surface with an elastic body: the deformed surface that makes the energy smallest.

The unknown is the position v of the surface of the body at each cell. It cannot be below the heights of the rough
surface: the gap g = v - h is at least zero. The energy

    E(v) = <v, S v>/2 + sum of the energies of the bonds at the gaps + P sum v

contains the elastic energy, with the stiffness S of the body (`HalfSpace.pressure`), the attraction (`laws`), and the
work of the load P per cell. In equilibrium, S v + P is at least minus the tension of the bond, and equal to it where
the gap is positive. `minimise` uses conjugate gradients, preconditioned by the compliance of the body, with projection
to g >= 0. Every step lowers the energy. So the result is a local minimum, and an unstable front moves until it is in
equilibrium.

Lengths are in units of the cell size, pressures in E*.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import LinearOperator, minres

from icha.boundary_elements.elastic import HalfSpace
from icha.boundary_elements.laws import AtDistance, Bonds, ShortRange, with_neighbours
from icha.contact.model import NotConverged

# Largest residual pressure at which new contact forms and closed cells open, relative to the peak tension of the bonds
# or, without attraction, to the largest pressure.
_CALM = 1e-3
# Largest number of iterations. Factor by which a step is shortened that would raise the energy, and most such factors.
_MOST, _SHORTER, _SHORTENINGS = 3000, 0.3, 30
# Largest number of refused steps in a row. After each, the works of adhesion come nearer to the fractions.
_REFUSALS = 5
# A length is final if the residual along the direction has become smaller than this part. Largest factor of the second
# length.
_STRAIGHT, _FURTHER = 0.2, 10.0
# A step uses the curvature of the energy if this is at least a certain part of the elastic curvature. Close to a jump,
# the softening of the bonds leaves little curvature.
_LEAST_CURVATURE = 0.01
# Largest error of a given load, relative to the load or to this part of the sum of pressures and tensions.
_LOAD_ERROR, _LEAST_LOAD = 1e-7, 1e-4
# Relative error of a given mean position that counts as rounding.
_SAME_MEAN = 1e-12
_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Control:
    """What is given: a load per cell in E*, or the mean of the positions, or the rigid approach (free squares)."""

    load: float | None = None
    mean: float | None = None
    rigid: float | None = None


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Equilibrium of the body under the rough surface.

    Parameters
    ----------
    position : (n, n), position v of the surface of the body at each cell.
    fraction : (n, n), fraction of contact of each cell.
    pressure : (n, n), pressure on each cell, in E*.
    load : mean pressure P of the grid, in E*.
    held : (n, n) bool, cells whose gap is zero and stays zero.
    residual : largest residual pressure, relative to the peak tension of the bonds or, without attraction, to the
        largest pressure.
    gap_residual : largest displacement by the residual pressures.
    pending : number of cells within reach of the attraction that stay open.
    iterations : number of iterations.
    """

    position: np.ndarray
    fraction: np.ndarray
    pressure: np.ndarray
    load: float
    held: np.ndarray
    residual: float
    gap_residual: float
    pending: int
    iterations: int


def minimise(
    space: HalfSpace,
    law: AtDistance | ShortRange,
    heights: np.ndarray,
    position: np.ndarray,
    fraction: np.ndarray,
    control: Control,
    tolerance: float,
) -> Equilibrium:
    """Find the equilibrium from a start, by steps that lower the energy.

    Parameters
    ----------
    space, law : elastic body and law of attraction.
    heights : (n, n), heights of the rough surface; -inf in the margin of a free square.
    position, fraction : (n, n), positions of the surface of the body, and fractions of contact, to start from.
    control : what is given.
    tolerance : largest displacement by the residual pressures, in cell sizes.

    Raises
    ------
    NotConverged
        After too many iterations, or if no step lowers the energy.
    """
    now, last, refused = _start(space, law, heights, position, fraction, control), None, 0
    closed, opened, pending = np.zeros(heights.shape, bool), np.zeros(heights.shape, bool), 0
    # Cells inside a short-ranged contact of a calm state; cells that close for a moment must be free to open.
    locked = ~with_neighbours(fraction < 1) if law.holds_inside else opened
    # The loop of the solver.
    for iteration in range(_MOST):
        # Residual pressures; a cell is held closed under pressure, and where it is locked.
        is_open = now.gap > 0
        load = _load(space, control, now, is_open)
        r, inside = now.force - load, locked
        if law.holds_inside:
            inside = locked & ~(with_neighbours(is_open) | opened)
        held = ~is_open & (r <= 0) | inside
        r *= ~held
        largest = law.straight_strength or max(float(np.abs(now.pressure + load).max()), tolerance / _CALM)
        error = float(np.abs(r).max()) / largest
        if error <= _CALM:
            if law.holds_inside:
                locked = ~with_neighbours(is_open)
            # Each cell closes, and opens, at most once, so that the number of changes is limited.
            closing = law.within_reach(now.gap, now.field)
            opening, pending = inside & (now.pressure + load < -law.strength), len(closing)
            closing = closing[~closed.ravel()[closing]]
            if len(closing) or opening.any():
                closed.ravel()[closing], opened, pending = True, opened | opening, pending - len(closing)
                now, last = _with_contact(space, law, heights, control, now, closing), None
                continue
        # Direction of steepest descent in the norm of the elastic energy, then conjugate to the last direction.
        z = space.displacement(r)
        gap_error = float(np.abs(z).max())
        if gap_error <= tolerance and error <= _CALM and _meets_load(control, now.pressure + load, r):
            pressure = now.pressure + load
            return Equilibrium(now.position, now.field, pressure, load, held, error, gap_error, pending, iteration)
        z = _restrict(z, ~held, control)
        d = _conjugate(z, r, last, ~held, control)
        # Step along the direction; a step that would raise the energy is shortened.
        found = _Line(space, law, heights, control, now, r, d).search()
        if found is None:
            refused, last = refused + 1, None
            if refused > _REFUSALS:
                raise NotConverged(f"no step lowers the energy; residual {error:.1e}")
            now = _Point.of(law, now.position, now.gap, now.pressure, now.bonds)
            continue
        now, refused, last = found, 0, (d, r, float(np.vdot(r, z)))
    # The end of the loop.
    raise NotConverged(f"residual {error:.1e} after {_MOST} iterations")


@dataclass(frozen=True, eq=False)
class _Point:
    """Position of the surface of the body, and what follows from it.

    position, gap, pressure : (n, n), positions, gaps, and pressures without the load.
    bonds : attraction of the cells.
    force : (n, n), minus pressure and tension: without load, it opens a gap if it is positive.
    """

    position: np.ndarray
    gap: np.ndarray
    pressure: np.ndarray
    bonds: Bonds
    force: np.ndarray

    @classmethod
    def of(cls, law, position, gap, pressure, bonds):
        """Return the point with these positions; the works of adhesion of given bonds follow their fractions."""
        for _ in range(law.rounds):
            bonds = law.bonds(bonds.field(bonds.fraction(bonds.at(gap)), gap.shape))
        force = -pressure
        force.ravel()[bonds.cells] -= bonds.tension(bonds.at(gap))
        return cls(position, gap, pressure, bonds, force)

    @property
    def field(self):
        """Fractions of all cells, (n, n)."""
        return self.bonds.field(self.bonds.fraction(self.bonds.at(self.gap)), self.gap.shape)


def _start(space, law, heights, position, fraction, control):
    """Return the point from which the iteration starts."""
    position, gap, _ = _project(position, heights, control)
    return _Point.of(law, position, gap, space.pressure(position), law.bonds(fraction))


def _with_contact(space, law, heights, control, point, cells):
    """Return a point with contact also in further cells, (k,) int, and with the same mean position if it is given."""
    if not len(cells):
        return _Point.of(law, point.position, point.gap, point.pressure, law.bonds(point.field))
    cells, field, position = law.closing(cells, len(heights)), point.field, point.position.copy()
    field.ravel()[cells] = 1.0
    # Heights minus infinity are outside a shape.
    cells = cells[np.isfinite(heights.ravel()[cells])]
    position.ravel()[cells] = heights.ravel()[cells]
    position, gap, _ = _project(position, heights, control)
    return _Point.of(law, position, gap, space.pressure(position), law.bonds(field))


@dataclass(frozen=True, eq=False)
class _Line:
    """Search for the length of a step from a point `now` with residuals r along a direction d, (n, n) each."""

    space: HalfSpace
    law: AtDistance | ShortRange
    heights: np.ndarray
    control: Control
    now: _Point
    r: np.ndarray
    d: np.ndarray

    def search(self):
        """Return a point with less energy, or None.

        The first length is that of Newton with constant works of adhesion; the second one follows from the residuals at
        the first. If both raise the energy, the length becomes shorter.
        """
        stiff_d, slope = self.space.pressure(self.d), float(np.vdot(self.r, self.d))
        # Without contact there may be no stiffness: at most the largest gap closes.
        longest = np.inf
        if self.now.gap.min() > 0:
            largest_gap = np.max(self.now.gap, where=self.now.gap < np.inf, initial=0.0)
            longest = float(largest_gap) / max(-float(self.d.min()), _TINY)
        curvature = self._curvature(stiff_d)
        length = slope / curvature if curvature * longest > slope else longest
        if not length < np.inf:
            raise NotConverged("the load pulls the surfaces apart")
        best, most = None, 0.0
        for trial in range(_SHORTENINGS):
            point, cut, end_slope, fall = self._try(length, stiff_d)
            if fall >= most:
                best, most = point, fall
            elif best is not None:
                return best
            share = end_slope / slope
            if trial or cut or abs(share) < _STRAIGHT:
                if best is not None:
                    return best
                length *= _SHORTER
            else:
                length = min(length / max(1 - share, 1 / _FURTHER), longest)
        return None

    def _curvature(self, stiff_d):
        """Return the curvature of the energy along d with constant works, or that of the elastic energy."""
        bonds, d, stiffness = self.now.bonds, self.d, np.vdot(self.d, stiff_d)
        if self.control.rigid is not None:
            stiffness += d.sum() ** 2 / d.size / self.space.mean_compliance
        curvature = stiffness - np.sum(bonds.softening(bonds.at(self.now.gap)) * bonds.at(d) ** 2)
        return float(curvature if curvature > _LEAST_CURVATURE * stiffness else stiffness)

    def _try(self, length, stiff_d):
        """Return the point at a length, whether cells were cut off at zero gap, the slope, and the fall of the energy.

        The energy falls by the mean residual times the change of position, and by what the mean tension leaves.
        """
        now, bonds = self.now, self.now.bonds
        position, gap, cut = _project(now.position + length * self.d, self.heights, self.control)
        pressure = self.space.pressure(position) if cut else now.pressure + length * stiff_d
        point, change = _Point.of(self.law, position, gap, pressure, bonds), position - now.position
        r = point.force - _load(self.space, self.control, point, None)
        fall = 0.5 * np.vdot(self.r + r, change)
        fall -= bonds.energy_beyond_mean_tension(*map(bonds.at, (now.gap, gap, change)))
        return point, cut, float(np.vdot(r, self.d)), float(fall)


def _meets_load(control, pressure, r):
    """Return whether the residuals r change a given load by little."""
    if control.load is None:
        return True
    load = max(abs(control.load) * r.size, _LEAST_LOAD * float(np.abs(pressure).sum()))
    return abs(float(r.sum())) <= _LOAD_ERROR * load


def _conjugate(z, r, last, free, control):
    """Return the next direction, (n, n), from the steepest descent z, by the formula of Polak and Ribiere.

    last : direction, residual and <r, z> of the last step; None to start anew.
    """
    if last is None:
        return z
    direction, before, product = last
    share = max(0.0, float(np.vdot(r, z) - np.vdot(before, z)) / product)
    d = _restrict(z + share * direction, free, control)
    return d if np.vdot(r, d) > 0 else z


def _restrict(change, free, control):
    """Return a change of the positions of free cells only, which keeps a given mean."""
    change = change * free
    if control.mean is not None:
        change -= change.sum() / max(np.count_nonzero(free), 1) * free
    return change


def rates(
    space: HalfSpace, law, heights, found: Equilibrium, accuracy: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the changes of position, pressure and fraction, (n, n) each, when the separation grows by one cell size.

    The separation is the mean of the positions or, on a free square, the rigid approach.
    """
    bonds, free = law.bonds(found.fraction), ~found.held
    gap = bonds.at(found.position - heights)
    tangent = law.tangent(bonds, bonds.at(found.fraction), gap, len(heights))
    if space.free:
        control, start = Control(rigid=0.0), np.zeros(heights.shape)
        force = np.where(free, 1 / space.mean_compliance, 0.0)
    else:
        control, start = Control(mean=0.0), free * (free.size / np.count_nonzero(free))
        force = -_tangent_pressure(space, tangent, start) * free
    change = start + _response(space, tangent, free, control, force, accuracy)
    pressure, fraction = space.pressure(change), np.zeros(heights.shape)
    if space.free:
        pressure += (change.mean() - 1) / space.mean_compliance
    else:
        pressure -= _tangent_pressure(space, tangent, change)[free].mean()
    fraction.ravel()[tangent.cells] = tangent.changes(change)[0]
    return change, pressure, fraction


def _tangent_pressure(space, tangent, change):
    """Return the change of pressure plus tension for a change of the positions, (n, n), at constant load."""
    pressure = space.pressure(change)
    pressure.ravel()[tangent.cells] += tangent.changes(change)[1]
    return pressure


def _response(space, tangent, free, control, force, accuracy):
    """Return the change of the positions of free cells, (n, n), under a small additional force, by the tangent."""
    shape, size = free.shape, free.size

    def stiffness(change):
        change = _restrict(change.reshape(shape), free, control)
        pressure = _tangent_pressure(space, tangent, change)
        if control.rigid is not None:
            pressure += change.mean() / space.mean_compliance
        return _restrict(pressure, free, control).ravel()

    def compliance(pressure):
        return _restrict(space.displacement(_restrict(pressure.reshape(shape), free, control)), free, control).ravel()

    operator, inverse = (LinearOperator((size, size), matvec=each, dtype=float) for each in (stiffness, compliance))
    change, _ = minres(operator, _restrict(force, free, control).ravel(), M=inverse, rtol=accuracy)
    return change.reshape(shape)


def _project(position, heights, control):
    """Return positions that are not below the heights, their gaps, and whether a position has changed.

    A given mean position is restored: all gaps change by one factor.
    """
    cut = bool((position < heights).any())
    if cut:
        position = np.maximum(position, heights)
    gap = position - heights
    if control.mean is not None:
        factor = (control.mean - heights.mean()) / gap.mean()
        if cut or abs(factor - 1) > _SAME_MEAN:
            gap *= factor
            position, cut = heights + gap, True
    return position, gap, cut


def _load(space, control, point, is_open):
    """Return the mean pressure of the grid, in E*: given, or by the rigid approach, or the mean force of open cells.

    With a given mean position, the load has no effect on the energy, and is 0 if `is_open` is None.
    """
    if control.load is not None:
        return control.load
    if control.rigid is not None:
        return float(point.position.mean() - control.rigid) / space.mean_compliance
    return float(point.force[is_open].mean()) if is_open is not None and is_open.any() else 0.0
