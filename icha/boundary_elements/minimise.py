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
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, minres

from icha.boundary_elements.elastic import HalfSpace
from icha.boundary_elements.laws import AtDistance, Bonds, ShortRange, with_neighbours
from icha.boundary_elements.window import Window
from icha.contact.model import NotConverged

# Largest residual pressure at which new contact forms and closed cells open, relative to the peak tension of the bonds
# or, without attraction, to the largest pressure.
_CALM = 1e-3
# Largest number of iterations. Factor by which a step is shortened that would raise the energy, and most such factors.
_MOST, _SHORTER, _SHORTENINGS = 3000, 0.3, 30
# Largest number of refused steps in a row.
_REFUSALS = 5
# Largest factor between two lengths. A part of a line is final if the slope is at most this share of that at the start.
_FURTHER, _FINAL_SLOPE = 10.0, 0.05
# Works of adhesion change by this factor times what the fractions of a step demand. The fractions follow the works in
# turn, so one round finds a change that is a seventh too small.
_FOLLOWED = 1.15
# A step uses the curvature of the energy if this is at least a certain part of the elastic curvature. Close to a jump,
# the softening of the bonds leaves little curvature.
_LEAST_CURVATURE = 0.01
# Largest error of a given load, relative to the load or to this part of the sum of pressures and tensions.
_LOAD_ERROR, _LEAST_LOAD = 1e-7, 1e-4
# Relative error of a given mean position that counts as rounding.
_SAME_MEAN = 1e-12


@dataclass(frozen=True, eq=False)
class Shift:
    """Expected change of the positions with the separation: how far the cells move under a missing load.

    Parameters
    ----------
    position : (n, n), change of the positions when the separation grows by one cell size.
    stiffness : fall of the force at this change, positive, in E* times cell size^2.
    """

    position: np.ndarray
    stiffness: float


@dataclass(frozen=True, eq=False)
class Control:
    """What is given: the mean of the positions, or the rigid approach (free squares), or a load per cell in E*.

    With a load, a shift is needed. It has no effect on the result, only on the number of iterations.
    """

    mean: float | None = None
    rigid: float | None = None
    load: float = 0.0
    shift: Shift | None = None


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
    law = problem.law
    # A gap of rounding in a closed cell would count as open, and each step would close it again.
    position = position.copy()
    problem.crop(position)[problem.crop(position) - problem.heights < tolerance] = -np.inf
    now, last, length, refused = _start(problem, position, fraction, control), None, 1.0, 0
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
            closing = law.within_reach(now.gap, now.fraction(now.gap))
            opening, pending = inside & (pressure < -law.strength - load), len(closing)
            closing = closing[~closed.ravel()[closing]]
            if len(closing) or opening.any():
                closed.ravel()[closing], opened, pending = True, opened | opening, pending - len(closing)
                now, last = _with_contact(problem, control, now, closing), None
                continue
        # Direction of steepest descent in the norm of the elastic energy, then conjugate to the last direction.
        z = _descent(problem, control, r, held)
        gap_error = _largest(z)
        if gap_error <= tolerance and error <= _CALM and _meets_load(control, pressure + load, r):
            pressure, load = pressure + load, load + float(now.pressure.mean())
            state = now.position, now.fraction(now.gap), pressure, load, held
            return Equilibrium(*state, error, gap_error, pending, iteration)
        d = _conjugate(z, r, last, held, control)
        # Step along the direction; a step that would raise the energy is shortened.
        found, length = _step(problem, control, now, r, d, length)
        if found is None:
            refused, last, length = refused + 1, None, 1.0
            if refused > _REFUSALS:
                raise NotConverged(f"no step lowers the energy; residual {error:.1e}")
            now = _start(problem, now.position, now.fraction(now.gap), control)
            continue
        now, refused, last = found, 0, (d, r, float(np.vdot(r, z)))
    # The end of the loop.
    raise NotConverged(f"residual {error:.1e} after {_MOST} iterations")


@dataclass(frozen=True, eq=False)
class _Point:
    """Position of the surface of the body, and what follows from it.

    position, pressure : (n, n), positions, and pressures without a load that is given, or that keeps a mean position.
    gap : (m, m), gaps.
    works : (m, m), works of adhesion of the cells; None if they do not depend on the fractions.
    bonds : attraction of the cells.
    force : (n, n), minus pressure and tension: without load, it opens a gap if it is positive.
    """

    position: np.ndarray
    gap: np.ndarray
    pressure: np.ndarray
    works: np.ndarray | None
    bonds: Bonds
    force: np.ndarray

    @classmethod
    def of(cls, problem, position, gap, pressure, fraction, works):
        """Return the point with these positions; cells beside contact attract."""
        bonds, force = problem.law.bonds(fraction, works), -pressure
        problem.crop(force).flat[bonds.cells] -= bonds.tension(bonds.at(gap))
        return cls(position, gap, pressure, works, bonds, force)

    def fraction(self, gap):
        """Return the fractions of all cells at some gaps, (m, m)."""
        return self.bonds.field(self.bonds.fraction(self.bonds.at(gap)), gap.shape)


def _start(problem, position, fraction, control):
    """Return the point from which the iteration starts."""
    position = position.copy()
    gap, _ = _project(problem, position, control)
    pressure = problem.space.pressure(position, control.rigid)
    return _Point.of(problem, position, gap, pressure, fraction, problem.law.works(fraction))


def _with_contact(problem, control, point, cells):
    """Return a point with contact also in further cells, (k,) int, and with the same mean position if it is given."""
    # Heights minus infinity are outside a shape.
    closing = problem.law.closing(cells) & np.isfinite(problem.heights)
    position = point.position.copy()
    problem.crop(position)[closing] = problem.heights[closing]
    return _start(problem, position, np.where(closing, 1.0, point.fraction(point.gap)), control)


def _step(problem, control, now, r, d, length):
    """Return a point with less energy than `now`, or None, and the length of the step along a direction.

    r, d : (n, n), residuals of `now`, and direction.
    length : guess of the length.
    """
    for _ in range(_SHORTENINGS):
        # Cells that would close stop at zero gap. The elastic energy on the line to this end is a parabola.
        change = length * d
        position = now.position + change
        gap, cut = _project(problem, position, control)
        if cut:
            change = position - now.position
        slope = float(np.vdot(r, change))
        if slope <= 0:
            length *= _SHORTER
            continue
        stiff_change = problem.space.pressure(change, None if control.rigid is None else 0.0)
        line = _Line(problem, now, change, slope, float(np.vdot(change, stiff_change)), cut)
        part = line.newton()
        length *= part
        if not cut and part > line.longest:
            continue
        # The end has less energy than the start if the least energy is in the second half of the line.
        found = line.search(1.0 if cut and part > 0.5 else part)
        if found is None:
            return None, length
        part, fraction, works = found
        if part != 1:
            position = now.position + part * change
            gap = problem.crop(position) - problem.heights
        return _Point.of(problem, position, gap, now.pressure + part * stiff_change, fraction, works), length
    return None, length


@dataclass(frozen=True, eq=False)
class _Line:
    """Line from a point to an end, and the energy on it.

    change : (n, n), positions of the end minus those of the point.
    slope, elastic : fall of the energy at the point, and curvature of the elastic energy, for the whole line.
    cut : whether cells close at the end.
    """

    problem: Problem
    now: _Point
    change: np.ndarray
    slope: float
    elastic: float
    cut: bool

    @cached_property
    def longest(self):
        """Part of the line, 1 or more, at which the first open cell closes."""
        if self.cut:
            return 1.0
        change = self.problem.crop(self.change)
        return float(np.min(np.divide(self.now.gap, -change, out=np.full(change.shape, np.inf), where=change < 0)))

    def newton(self):
        """Return the part of the line with the least energy at constant works; a small curvature is not used."""
        bonds = self.now.bonds
        softening = bonds.softening(bonds.at(self.now.gap)) * bonds.at(self.problem.crop(self.change)) ** 2
        curvature = self.elastic - float(np.sum(softening))
        if curvature <= _LEAST_CURVATURE * self.elastic:
            curvature = self.elastic
        return self.slope / max(curvature, self.slope / _FURTHER)

    def search(self, part):
        """Return a part of the line with less energy, and fractions and works there; or None.

        The works follow the fractions of the first part, and change along the line in proportion. The second part
        follows from the slope at the first. If both raise the energy, the part becomes shorter.
        """
        law, now = self.problem.law, self.now
        before, change = now.bonds.at(now.gap), now.bonds.at(self.problem.crop(self.change))
        pull = np.sum(now.bonds.tension(before) * change)
        best, most, first, works = None, 0.0, part, None
        for trial in range(_SHORTENINGS):
            gap = before + part * change
            fraction = now.bonds.field(now.bonds.fraction(gap), now.gap.shape)
            if not trial:
                works = law.works(fraction)
            here = works if works is None else now.works + _FOLLOWED * part / first * (works - now.works)
            bonds = law.bonds(fraction, here)
            end_change = bonds.at(self.problem.crop(self.change))
            end_pull = np.sum(bonds.tension(bonds.at(now.gap) + part * end_change) * end_change)
            end_slope = float(self.slope - part * self.elastic + pull - end_pull)
            fall = 0.5 * part * (self.slope + end_slope)
            fall -= now.bonds.energy_beyond_mean_tension(before, gap, part * change)
            if fall >= most:
                best, most = (part, fraction, here), fall
            elif best is not None:
                return best
            share = end_slope / self.slope
            if trial or self.cut or abs(share) < _FINAL_SLOPE:
                if best is not None:
                    return best
                part *= _SHORTER
            else:
                part = min(part / max(1 - share, 1 / _FURTHER), self.longest)
        return None


def _largest(field, shift=0.0):
    """Return the largest absolute value of a field with a shift."""
    return max(float(field.max()) + shift, -float(field.min()) - shift)


def _meets_load(control, pressure, r):
    """Return whether the residuals r change a given load by little."""
    if control.mean is not None or control.rigid is not None:
        return True
    load = max(abs(control.load) * r.size, _LEAST_LOAD * float(np.abs(pressure).sum()))
    return abs(float(r.sum())) <= _LOAD_ERROR * load


def _descent(problem, control, r, held):
    """Return the direction of steepest descent in the norm of the elastic energy, (n, n), for residuals r, (n, n).

    Under a load, the cells that are not held also follow the shift, by the missing load.
    """
    if control.shift is None:
        return _restrict(problem.space.displacement(r), held, control)
    others = Control(mean=0.0)
    z = _restrict(problem.space.displacement(_restrict(r.copy(), held, others)), held, others)
    z += control.shift.position * (np.vdot(control.shift.position, r) / control.shift.stiffness)
    return _restrict(z, held, control)


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
        change -= change.sum() / max(change.size - np.count_nonzero(held), 1)
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
    pressure, (fraction, tension) = space.pressure(change, moved.rigid), tangent.changes(problem.crop(change))
    if not space.free:
        pressure -= (pressure + tension)[~found.held].mean()
    return problem.crop(pressure), fraction


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
