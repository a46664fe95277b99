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

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, minres

from icha.boundary_elements.elastic import HalfSpace
from icha.boundary_elements.laws import TOUCHING, AtDistance, Bonds, ShortRange, with_neighbours
from icha.boundary_elements.window import Window
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


@dataclass(frozen=True)
class Control:
    """What is given: the mean of the positions, or the rigid approach (free squares), else a load per cell in E*."""

    load: float = 0.0
    mean: float | None = None
    rigid: float | None = None


@dataclass(frozen=True, eq=False)
class Problem:
    """A rough surface and an elastic body.

    Parameters
    ----------
    space, law : elastic body, with a grid of n x n cells, and law of attraction of m x m cells.
    heights : (m, m), heights of the rough surface. The other cells of the body have no heights and carry no pressure;
        there are none of them on a periodic surface.
    """

    space: HalfSpace
    law: AtDistance | ShortRange
    heights: np.ndarray

    def part(self, window: Window) -> Problem:
        """Return the problem on the cells of a window."""
        law: Any = self.law
        fields = {name: window.of(value) for name, value in vars(law).items() if isinstance(value, np.ndarray)}
        return Problem(self.space.part(window.grid), replace(law, **fields), window.of(self.heights))

    def crop(self, field: np.ndarray) -> np.ndarray:
        """Return the view, (m, m), of a field of the body, (n, n)."""
        return field[: len(self.heights), : len(self.heights)]


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Equilibrium of the body under the rough surface.

    Parameters
    ----------
    position : (n, n), position v of the surface of the body at each cell.
    fraction : (m, m), fraction of contact of each cell.
    pressure : (m, m), pressure on each cell, in E*.
    load : mean pressure P of the grid, in E*.
    held : (m, m) bool, cells whose gap is zero and stays zero.
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
    problem: Problem, position: np.ndarray, fraction: np.ndarray, control: Control, tolerance: float
) -> Equilibrium:
    """Find the equilibrium from a start, by steps that lower the energy.

    Parameters
    ----------
    problem : elastic body, law of attraction and heights.
    position, fraction : (n, n) and (m, m), positions of the surface of the body, and fractions of contact, to start
        from.
    control : what is given.
    tolerance : largest displacement by the residual pressures, in cell sizes.

    Raises
    ------
    NotConverged
        After too many iterations, or if no step lowers the energy.
    """
    space, law = problem.space, problem.law
    # A gap of rounding in a closed cell would count as open, and each step would close it again.
    position = position.copy()
    problem.crop(position)[problem.crop(position) - problem.heights < tolerance] = -np.inf
    now, last, refused = _start(problem, position, fraction, control), None, 0
    closed, opened, pending = np.zeros(fraction.shape, bool), np.zeros(fraction.shape, bool), 0
    # Cells inside a short-ranged contact of a calm state; cells that close for a moment must be free to open.
    locked = ~with_neighbours(fraction < 1) if law.holds_inside else opened
    # The loop of the solver.
    for iteration in range(_MOST):
        # Residual pressures; a cell is held closed under pressure, and where it is locked.
        is_open = now.gap > 0
        load = _load(control, now, is_open)
        r, pressure, inside = now.force - load, problem.crop(now.pressure), locked
        if law.holds_inside:
            inside = locked & ~(with_neighbours(is_open) | opened)
        held = ~is_open & (problem.crop(r) <= 0) | inside
        problem.crop(r)[held] = 0.0
        error = _largest(r) / (law.straight_strength or max(_largest(pressure, load), tolerance / _CALM))
        if error <= _CALM:
            if law.holds_inside:
                locked = ~with_neighbours(is_open)
            # Each cell closes, and opens, at most once, so that the number of changes is limited.
            closing = law.within_reach(now.gap, now.field)
            opening, pending = inside & (pressure < -law.strength - load), len(closing)
            closing = closing[~closed.ravel()[closing]]
            if len(closing) or opening.any():
                closed.ravel()[closing], opened, pending = True, opened | opening, pending - len(closing)
                now, last = _with_contact(problem, control, now, closing), None
                continue
        # Direction of steepest descent in the norm of the elastic energy, then conjugate to the last direction.
        z = space.displacement(r)
        gap_error = _largest(z)
        if gap_error <= tolerance and error <= _CALM and _meets_load(control, pressure + load, r):
            pressure, load = pressure + load, load + float(now.pressure.mean())
            return Equilibrium(now.position, now.field, pressure, load, held, error, gap_error, pending, iteration)
        z = _restrict(z, held, control)
        d = _conjugate(z, r, last, held, control)
        # Step along the direction; a step that would raise the energy is shortened.
        found = _Line(problem, control, now, r, d).search()
        if found is None:
            refused, last = refused + 1, None
            if refused > _REFUSALS:
                raise NotConverged(f"no step lowers the energy; residual {error:.1e}")
            now = _Point.of(problem, now.position, now.gap, now.pressure, now.bonds)
            continue
        now, refused, last = found, 0, (d, r, float(np.vdot(r, z)))
    # The end of the loop.
    raise NotConverged(f"residual {error:.1e} after {_MOST} iterations")


@dataclass(frozen=True, eq=False)
class _Point:
    """Position of the surface of the body, and what follows from it.

    position, pressure : (n, n), positions, and pressures without a load that is given, or that keeps a mean position.
    gap : (m, m), gaps.
    bonds : attraction of the cells.
    force : (n, n), minus pressure and tension: without load, it opens a gap if it is positive.
    """

    position: np.ndarray
    gap: np.ndarray
    pressure: np.ndarray
    bonds: Bonds
    force: np.ndarray

    @classmethod
    def of(cls, problem, position, gap, pressure, bonds):
        """Return the point with these positions; the works of adhesion of given bonds follow their fractions."""
        for _ in range(problem.law.rounds):
            bonds = problem.law.bonds(bonds.field(bonds.fraction(bonds.at(gap)), gap.shape))
        force = -pressure
        problem.crop(force).flat[bonds.cells] -= bonds.tension(bonds.at(gap))
        return cls(position, gap, pressure, bonds, force)

    @property
    def field(self):
        """Fractions of all cells, (m, m)."""
        return self.bonds.field(self.bonds.fraction(self.bonds.at(self.gap)), self.gap.shape)


def _start(problem, position, fraction, control):
    """Return the point from which the iteration starts."""
    position = position.copy()
    gap, _ = _project(problem, position, control)
    return _Point.of(
        problem, position, gap, problem.space.pressure(position, control.rigid), problem.law.bonds(fraction)
    )


def _with_contact(problem, control, point, cells):
    """Return a point with contact also in further cells, (k,) int, and with the same mean position if it is given."""
    if not len(cells):
        return _Point.of(problem, point.position, point.gap, point.pressure, problem.law.bonds(point.field))
    # Heights minus infinity are outside a shape.
    closing = problem.law.closing(cells) & np.isfinite(problem.heights)
    position = point.position.copy()
    problem.crop(position)[closing] = problem.heights[closing]
    return _start(problem, position, np.where(closing, 1.0, point.field), control)


@dataclass(frozen=True, eq=False)
class _Line:
    """Search for the length of a step from a point `now` with residuals r along a direction d, (n, n) each."""

    problem: Problem
    control: Control
    now: _Point
    r: np.ndarray
    d: np.ndarray

    def search(self):
        """Return a point with less energy, or None.

        The first length is that of Newton with constant works of adhesion; the second one follows from the residuals at
        the first. If both raise the energy, the length becomes shorter.
        """
        rigid = None if self.control.rigid is None else 0.0
        stiff_d, slope = self.problem.space.pressure(self.d, rigid), float(np.vdot(self.r, self.d))
        # Without contact there may be no stiffness: at most the largest gap closes.
        longest = np.inf
        if self.now.gap.min() > 0:
            largest_gap = np.max(self.now.gap, where=self.now.gap < np.inf, initial=0.0)
            longest = float(largest_gap) / max(-float(self.problem.crop(self.d).min()), TOUCHING)
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
        change = bonds.at(self.problem.crop(d))
        curvature = stiffness - np.sum(bonds.softening(bonds.at(self.now.gap)) * change**2)
        return float(curvature if curvature > _LEAST_CURVATURE * stiffness else stiffness)

    def _try(self, length, stiff_d):
        """Return the point at a length, whether cells were cut off at zero gap, the slope, and the fall of the energy.

        The energy falls by the mean residual times the change of position, and by what the mean tension leaves.
        """
        now, problem, change = self.now, self.problem, length * self.d
        position = now.position + change
        gap, cut = _project(problem, position, self.control)
        if cut:
            pressure, change = problem.space.pressure(position, self.control.rigid), position - now.position
        else:
            pressure = now.pressure + length * stiff_d
        point = _Point.of(problem, position, gap, pressure, now.bonds)
        r = point.force - _load(self.control, point, None)
        fall = 0.5 * (np.vdot(self.r, change) + np.vdot(r, change))
        fall -= now.bonds.energy_beyond_mean_tension(*map(now.bonds.at, (now.gap, gap, problem.crop(change))))
        return point, cut, float(np.vdot(r, self.d)), float(fall)


def _largest(field, shift=0.0):
    """Return the largest absolute value of a field with a shift."""
    return max(float(field.max()) + shift, -float(field.min()) - shift)


def _meets_load(control, pressure, r):
    """Return whether the residuals r change a given load by little."""
    if control.mean is not None or control.rigid is not None:
        return True
    load = max(abs(control.load) * r.size, _LEAST_LOAD * float(np.abs(pressure).sum()))
    return abs(float(r.sum())) <= _LOAD_ERROR * load


def _conjugate(z, r, last, held, control):
    """Return the next direction, (n, n), from the steepest descent z, by the formula of Polak and Ribiere.

    last : direction, residual and <r, z> of the last step; None to start anew.
    """
    if last is None:
        return z
    direction, before, product = last
    share = max(0.0, float(np.vdot(r, z) - np.vdot(before, z)) / product)
    d = share * direction
    d += z
    d = _restrict(d, held, control)
    return d if np.vdot(r, d) > 0 else z


def _restrict(change, held, control):
    """Set a change of the positions, (n, n), to zero where cells are held, (m, m), and keep a given mean; return it."""
    inside = change[: len(held), : len(held)]
    np.copyto(inside, 0.0, where=held)
    if control.mean is not None:
        inside -= inside.sum() / max(held.size - np.count_nonzero(held), 1)
        np.copyto(inside, 0.0, where=held)
    return change


def rates(problem: Problem, found: Equilibrium, accuracy: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the changes of pressure and fraction, (m, m) each, when the separation grows by one cell size.

    The separation is the mean of the positions or, on a free square, the rigid approach.
    """
    space, bonds, gap = problem.space, problem.law.bonds(found.fraction), problem.crop(found.position) - problem.heights
    tangent = problem.law.tangent(bonds, bonds.at(found.fraction), bonds.at(gap), len(gap))
    control = Control(rigid=0.0) if space.free else Control(mean=0.0)

    def stiffness(change, control=control):
        pressure = space.pressure(change, control.rigid)
        problem.crop(pressure)[...] += tangent.changes(problem.crop(change))[1]
        return pressure

    def of_free_cells(operator):
        def restricted(change):
            change = _restrict(change.reshape(found.position.shape).copy(), found.held, control)
            return _restrict(operator(change), found.held, control).ravel()

        return LinearOperator((found.position.size,) * 2, matvec=restricted, dtype=float)

    # Free cells follow first, so that only the remaining change is solved.
    start = _restrict(np.ones(found.position.shape), found.held, Control())
    if not space.free:
        start /= start.mean()
    moved = Control(rigid=1.0) if space.free else control
    force = _restrict(-stiffness(start, moved), found.held, control)
    change, _ = minres(of_free_cells(stiffness), force.ravel(), M=of_free_cells(space.displacement), rtol=accuracy)
    change = start + change.reshape(start.shape)
    pressure = space.pressure(change, moved.rigid)
    if not space.free:
        pressure -= stiffness(change)[~found.held].mean()
    return problem.crop(pressure), tangent.changes(problem.crop(change))[0]


def _project(problem, position, control):
    """Move positions, (n, n), that are below the heights; return the gaps, (m, m), and whether a position has moved.

    A given mean position is restored: all gaps change by one factor.
    """
    heights, position = problem.heights, problem.crop(position)
    cut = bool((position < heights).any())
    if cut:
        np.maximum(position, heights, out=position)
    gap = position - heights
    if control.mean is not None:
        factor = (control.mean - heights.mean()) / gap.mean()
        if cut or abs(factor - 1) > _SAME_MEAN:
            gap *= factor
            position[...], cut = heights + gap, True
    return gap, cut


def _load(control, point, is_open):
    """Return the load per cell, in E*: given, or the mean force of open cells if the mean position is given.

    With a given mean position, the load has no effect on the energy, and is 0 if `is_open` is None. A rigid approach
    needs no load.
    """
    if control.mean is None:
        return control.load
    return float(point.force[is_open].mean()) if is_open is not None and is_open.any() else 0.0
