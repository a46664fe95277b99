"""Equilibrium of the front at a given separation, by Newton steps of pressures and fractions that lower the energy.

Every step lowers the energy U(f) - dgamma A(f), the elastic energy minus the work of adhesion. So the result is a local
minimum of the energy. An unstable front runs until it is in equilibrium. A step solves three linearised equations: the
gap of closed cells is zero, the tension at the front is fraction times strength, and the strength depends on the
fractions of neighbours. A step that raises the energy is repeated with more damping: softer bonds shorten the step
(Levenberg-Marquardt method).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from icha.boundary_elements.cells import adjacent, mask_of, merge_cells
from icha.boundary_elements.elastic_contact import (
    LARGEST_REMAINDER,
    NO_CONTACT,
    AdhesiveContact,
    Contact,
    Topography,
    solve_bonded_contact,
)
from icha.boundary_elements.front import NET_COMPLIANCE, Front, neighbour_weights
from icha.boundary_elements.half_space import FullGrid, HalfSpace
from icha.contact.model import FullContact, NotConverged
from icha.contact.models import MODELS, REFERENCE_MODEL


@dataclass(frozen=True)
class FrontTolerances:
    """Tolerances of the solver; `docs/short_range.md` justifies them by measurements.

    The residual of a cell is |intensity - 1|, see `ActiveCells`. In contact, the intensity is K/K_c = sqrt(G/W); W is
    the local work of adhesion. Errors of displacements are divided by the `displacement_unit` of the `FrontProblem`.

    Parameters
    ----------
    front : largest residual of a converged front. (The grid causes relative errors of areas and loads of about 1e-3.)
    stagnation : largest residual at which a front is accepted although no step lowers its energy.
    coarse : cells with a larger residual are relaxed locally and damped. Allowed residual of the front in the first
        stage of `solve_adhesive_contact` and in the first trial for a load. In both cases, contact forms where the gap
        is below the reach of the attraction by at least `coarse` critical openings.
    fine : allowed residual of the front in later trials for a load and in the second stage, in which contact forms if
        the gap is below the reach. Cells with a larger residual are relaxed locally if they are few. The trials for a
        load end, and the steps to the final tolerances begin, when the relative error of the load is at most `fine`.
    few : largest share that counts as few cells: of the front for local relaxation, of the grid for open cells.
    displacement : largest error of displacements, divided by the allowed residual of the front.
    moving_displacement : largest error of displacements in the first steps. After a step, the allowed error is
        residual * min(moving_displacement, max(residual, linear[0])). The next step leaves about this residual.
    certain_displacement : error of displacements at which the energies of two similar states can be compared.
    linear : smallest and largest relative error of the linearised equations; between them, it equals the residual.
    damping : damping of the bonds after a first step that would raise the energy. If most of the front is far from
        equilibrium, the damping starts at 2 * `damping`. Cells with a residual above `coarse` have no smaller damping.
    """

    front: float = 1e-6
    stagnation: float = 1e-3
    coarse: float = 3e-2
    fine: float = 1e-3
    few: float = 0.01
    displacement: float = 1e-2
    moving_displacement: float = 0.1
    certain_displacement: float = 1e-5
    linear: tuple[float, float] = (MODELS[REFERENCE_MODEL].stiffness_error, 0.1)
    damping: float = 0.1


TOLERANCES = FrontTolerances()
# Smallest error to which displacements are solved, in units of `FrontProblem.displacement_unit`.
_SMALLEST_ERROR = 1e-3 * TOLERANCES.front
# Largest numbers of iterations, of Krylov vectors, of local relaxations between steps; largest damping.
_MAX_ITERATIONS, _MAX_KRYLOV, _MAX_LOCAL_RELAXATIONS, _LARGEST_DAMPING = 400, 60, 5, 1e8
# Damping from which a step that would raise the energy keeps the changes that lower it.
_STRONG_DAMPING = 1e3
# Relative rounding error of the energy. Relative rounding error of the first-order change of the energy in a step.
_ENERGY_ROUNDING, _WORK_ROUNDING = 1e-12, 1e-11


@dataclass(frozen=True, eq=False)
class ActiveCells(Contact):
    """Cells that take part in a step: cells in contact, and open cells of the rim (fraction 0) that start to close.

    Parameters
    ----------
    gap : (k,), gap of each cell, in cell sizes.
    mean_fraction : (k,), Gaussian average of the fractions around each cell.
    intensity : (k,), the fraction of a free cell falls if its intensity is above 1, and grows if it is below 1. In
        contact the intensity is K/K_c = sqrt(G/W), the stress intensity divided by its critical value, with the local
        work of adhesion W. For open cells it is the gap divided by the gap at which the tension vanishes.
    free : (k,) bool, whether the fraction of a cell may change.
    """

    gap: np.ndarray
    mean_fraction: np.ndarray
    intensity: np.ndarray
    free: np.ndarray

    @property
    def at_front(self) -> np.ndarray:
        """Whether each cell belongs to the front, (k,) bool: it is free, or it is partly in contact."""
        return self.free | ((self.fraction > 0) & (self.fraction < 1))

    @property
    def residuals(self) -> np.ndarray:
        """Residual |intensity - 1| of each cell, (k,); zero for cells that are not free."""
        return np.where(self.free, np.abs(self.intensity - 1), 0.0)

    @property
    def residual(self) -> float:
        """Largest residual of all cells."""
        return float(np.max(self.residuals, initial=0.0))

    def cells_to_relax(self) -> tuple[np.ndarray, bool]:
        """Return cells with residuals above `fine` if few, otherwise above `coarse`, (k,) bool, and whether few."""
        few = TOLERANCES.few * np.count_nonzero(self.at_front)
        unconverged = self.residuals > TOLERANCES.fine
        if np.count_nonzero(unconverged) <= few:
            return unconverged, True
        far = self.residuals > TOLERANCES.coarse
        return far, bool(np.count_nonzero(far) <= few)


def find_active_cells(front: Front, state: AdhesiveContact) -> ActiveCells:
    """Find the cells of a state that take part in the next step, with their stress intensities.

    A closed cell can start to open only if one of its four neighbours is not closed, or if its tension exceeds the
    strength of the interface.
    """
    grid, gap = state.gap.shape[-1], state.gap.ravel()
    intensity = front.intensity(state.fraction, state.pressure, state.mean_fraction)
    relative_gap = front.relative_gap(gap[state.rim], state.mean_fraction_rim)
    closed = mask_of(state.cells[state.fraction >= 1], state.gap.shape).ravel()
    can_open = intensity > 1
    at_edge = ~np.all(closed[adjacent(state.cells[can_open], grid)], axis=0) | (state.fraction[can_open] < 1)
    can_open[can_open] = at_edge | (-state.pressure[can_open] > front.interface_strength)
    can_close = relative_gap < 1
    cells, fraction, pressure, mean_fraction, intensity, free = merge_cells(
        state.cells,
        state.rim[can_close],
        (state.fraction, 0.0),
        (state.pressure, 0.0),
        (state.mean_fraction, state.mean_fraction_rim[can_close]),
        (intensity, relative_gap[can_close]),
        (can_open | ((intensity < 1) & (state.fraction < 1)), True),
    )
    return ActiveCells(cells, fraction, pressure, gap[cells], mean_fraction, intensity, free)


@dataclass(frozen=True, eq=False)
class FrontProblem:
    """A rough surface against a half-space at one separation, with the law of its front.

    Parameters
    ----------
    space, front, topography : half-space, law of the front, heights of the surface.
    separation : mean separation, in cell sizes.
    background : in windows, part of the mean fraction due to contact outside the window; otherwise None.
    rms_height : rms height of the surface, in cell sizes; infinite in windows, whose results are solved again.
    """

    space: HalfSpace
    front: Front
    topography: Topography
    separation: float
    background: np.ndarray | None = None
    rms_height: float = math.inf

    def solve_elastic(self, contact: Contact, accuracy: float) -> AdhesiveContact:
        """Call `solve_bonded_contact`; displacement errors are at most `accuracy` times the `displacement_unit`."""
        tolerance = self._tolerance(accuracy, contact)
        return solve_bonded_contact(self.space, self.topography, self.separation, contact, tolerance, self.background)

    @property
    def displacement_unit(self) -> float:
        """Unit of displacement errors, in cell sizes: the critical opening, or half the rms height if that is smaller.

        The residual of a run is an error of the gap over the rms height. With strong adhesion on a shallow surface, the
        critical opening exceeds the rms height, and errors in units of the critical opening would be too large.
        """
        return min(self.front.critical_opening, 0.5 * self.rms_height)

    def _tolerance(self, accuracy, contact):
        """Return the largest allowed error of displacements, in cell sizes; it is smaller if only few cells are open.

        Near full contact, a small error of the displacements causes a large error of the mean pressure.
        """
        open_part = 1 - float(np.sum(contact.fraction)) / self.space.size
        return accuracy * self.displacement_unit * float(np.clip(open_part / TOLERANCES.few, 1e-3, 1.0))

    def is_accurate(self, state: AdhesiveContact, accuracy: float) -> bool:
        """Return whether a state was solved to displacement errors of `accuracy` times the `displacement_unit`."""
        return state.tolerance <= (1 + _WORK_ROUNDING) * self._tolerance(accuracy, state)

    def energy(self, state: AdhesiveContact) -> float:
        """Return the elastic energy minus the work of adhesion, also outside windows, in E* times cell size^3."""
        # A window cell and an outside cell are neighbours of each other, so the background counts twice.
        mean_fraction = state.mean_fraction
        if self.background is not None:
            mean_fraction = mean_fraction + self.background.ravel()[state.cells]
        return state.energy - self.front.adhesion_energy(state.fraction, mean_fraction)

    def is_lower(self, new: AdhesiveContact, old: AdhesiveContact) -> bool:
        """Return whether the energy of a new state is at most that of an old one plus the energy errors of both."""
        energy = self.energy(old)
        rounding = _ENERGY_ROUNDING * abs(energy) + NO_CONTACT * self.front.adhesion_length
        return self.energy(new) <= energy + new.energy_error + old.energy_error + rounding


def relax_front(
    problem: FrontProblem,
    contact: Contact,
    tolerance: float,
    *,
    nearby: bool = False,
    max_iterations: int | None = None,
    relax_around: Callable[[AdhesiveContact, np.ndarray], Contact | None] = lambda state, cells: None,
) -> AdhesiveContact:
    """Move the front of a contact to equilibrium, in steps that lower the energy.

    Parameters
    ----------
    contact : initial contact; an `AdhesiveContact` must be a solution for the same problem.
    tolerance : largest allowed residual of the front.
    nearby : whether the initial contact is near equilibrium.
    max_iterations : number of iterations after which the contact is returned, even if it has not converged. Each
        step, failed step, local relaxation and refinement is one iteration.
    relax_around : function that relaxes a front around given cells, (m,); it returns None if it did not relax it.

    Raises
    ------
    NotConverged
        If no step lowers the energy, or if the front has not converged after _MAX_ITERATIONS and `max_iterations` is
        None; in both cases only if the residual is above TOLERANCES.stagnation.
    FullContact
        If the contact covers the surface.
    """
    relaxation = FrontRelaxation(problem, contact, nearby)
    for _ in range(max_iterations or _MAX_ITERATIONS):
        active = find_active_cells(problem.front, relaxation.state)
        try:
            if active.residual <= tolerance:
                if not relaxation.refine(TOLERANCES.displacement * tolerance):
                    return relaxation.state
            elif not relaxation.relax_locally(active, relax_around):
                relaxation.step(active)
        except Stagnation as failure:
            if active.residual > TOLERANCES.stagnation:
                raise NotConverged(f"{failure} (residual of sqrt(G/dgamma): {active.residual:.1e})") from None
            if not relaxation.refine(_SMALLEST_ERROR):
                return relaxation.state
    if max_iterations:
        return relaxation.state
    if active.residual <= TOLERANCES.stagnation:
        relaxation.refine(TOLERANCES.displacement * tolerance)
        return relaxation.state
    raise NotConverged(f"the front did not converge (residual of sqrt(G/dgamma): {active.residual:.1e})")


class Stagnation(NotConverged):
    """Raised when no step of the front lowers the energy."""


class FrontRelaxation:
    """State of the iteration in which `relax_front` moves a front to equilibrium.

    Attributes
    ----------
    state : contact after the last step.
    damping : damping of the bonds in the next step.
    start, coarsest : largest allowed error of displacements in their unit: in the first solution, and in the
        next step. After a failed step `coarsest` is at most TOLERANCES.certain_displacement.
    local_relaxations : number of local relaxations since the last successful step; the allowed maximum after a failure.
    steps : number of steps of the whole front that were tried.
    """

    def __init__(self, problem: FrontProblem, contact: Contact, nearby: bool):
        """Solve the elastic contact of the initial contact; `nearby`: whether this contact is near equilibrium."""
        self.problem, self.damping, self.local_relaxations, self.steps = problem, 0.0, 0, 0
        self.start = TOLERANCES.certain_displacement if nearby else TOLERANCES.moving_displacement
        self.coarsest = self.start
        if not isinstance(contact, AdhesiveContact):
            contact = problem.solve_elastic(contact, self.start)
        self.state = contact

    def refine(self, accuracy: float) -> bool:
        """Solve the pressures again, and return True, if displacement errors exceed `accuracy` units."""
        accuracy = max(accuracy, _SMALLEST_ERROR)
        if self.problem.is_accurate(self.state, accuracy):
            return False
        self.state = self.problem.solve_elastic(self.state, accuracy)
        return True

    def relax_locally(self, active: ActiveCells, relax_around: Callable) -> bool:
        """Relax the front around cells far from equilibrium; keep the result and return True if the energy is lower.

        Do this at most five times between two successful steps, only once if cells are many, not again after a failure.
        """
        far, few = active.cells_to_relax()
        if not far.any() or self.local_relaxations >= (_MAX_LOCAL_RELAXATIONS if few else 1):
            return False
        self.local_relaxations += 1
        contact = relax_around(self.state, active.cells[far])
        if contact is not None:
            accuracy = min(self.start, 0.1 * TOLERANCES.moving_displacement, self._moving_accuracy(active))
            try:
                new = self.problem.solve_elastic(contact, max(_SMALLEST_ERROR, accuracy))
            except FullContact:
                # The fixed pressures outside a window can close the last gap, although it should stay open.
                contact = None
        if contact is None or not self.problem.is_lower(new, self.state):
            self.local_relaxations = _MAX_LOCAL_RELAXATIONS
            return False
        self.state, self.damping = new, 0.0
        return True

    def _moving_accuracy(self, active: ActiveCells) -> float:
        """Return the allowed displacement error after the next step, in its unit; see `FrontTolerances`."""
        residual = active.residual
        return residual * min(TOLERANCES.moving_displacement, max(residual, TOLERANCES.linear[0]))

    def step(self, active: ActiveCells) -> None:
        """Make one Newton step if it lowers the energy; otherwise raise the damping."""
        problem = self.problem
        if self.steps == 0 and 2 * np.count_nonzero(active.cells_to_relax()[0]) > np.count_nonzero(active.at_front):
            self.damping = 2 * TOLERANCES.damping
        self.steps += 1
        change, pressure_change = newton_step(problem, active, self.damping)
        # To first order the step changes the energy by the sum of (G/W - 1) W df, with the local work of adhesion W.
        adhesion = (problem.front.local_strengths(active.mean_fraction) / problem.front.straight_strength) ** 2
        rises = (active.intensity**2 - 1) * adhesion * change
        if np.sum(rises) > _WORK_ROUNDING * np.abs(change).sum():
            if self.damping >= _STRONG_DAMPING:
                # Keep only the changes that lower the energy. Shorter steps alone would stop where thousands of nearly
                # closed cells must close together, as after full contact opens.
                change[rises > 0] = 0
            if self.damping < _STRONG_DAMPING or not change.any():
                self._damp(2, active.residual)
                return
        accuracy = max(_SMALLEST_ERROR, min(self.coarsest, self._moving_accuracy(active)))
        try:
            new = problem.solve_elastic(active.apply_step(change, pressure_change), accuracy)
        except FullContact:
            new = None  # the separation fixes the volume of the gap, so the gap cannot close
        if new is None or not problem.is_lower(new, self.state):
            self._damp(8, active.residual)
            return
        self.damping = self.damping / 4 if self.damping > 0.01 else 0.0
        self.state, self.coarsest, self.local_relaxations = new, self.start, 0

    def _damp(self, factor: float, residual: float) -> None:
        """Raise the damping and solve the pressures more accurately after a failed step, or raise `Stagnation`."""
        self.coarsest = min(self.coarsest, TOLERANCES.certain_displacement)
        self.refine(min(self.coarsest, TOLERANCES.displacement * residual))
        self.damping = max(factor * self.damping, TOLERANCES.damping)
        if self.damping > _LARGEST_DAMPING:
            raise Stagnation("no step of the front lowers the energy")


def newton_step(problem: FrontProblem, active: ActiveCells, damping: float) -> tuple[np.ndarray, np.ndarray]:
    """Solve the linearised equations of the front; return the changes of fraction and pressure, (k,) each."""
    front, at_front = problem.front, active.at_front
    # A running front needs shorter steps.
    dampings = np.where(np.abs(active.intensity - 1) > TOLERANCES.coarse, max(damping, 2 * TOLERANCES.damping), damping)
    linear = LinearisedFront(problem.space, front, active, active.mean_fraction, at_front, dampings)
    # First subtract `missing` from the pressures, to get the tension of the law at the present fraction. This changes
    # the displacements by -`moved`. Then change tension and fraction by the law.
    local_strengths = front.local_strengths(active.mean_fraction)
    missing = np.where(at_front, front.tension(local_strengths, active.fraction) + active.pressure, 0.0)
    moved = linear.operator.displacement(missing.astype(np.float32))
    law_gap = np.where(at_front, front.law_gap(local_strengths, active.fraction), 0.0)
    accuracy = float(np.clip(active.residual, *TOLERANCES.linear))
    change, pressure_change = linear.solve(moved + law_gap - active.gap, accuracy)
    return change, pressure_change - missing


def rates_with_separation(
    space: HalfSpace, front: Front, contact: Contact, mean_fraction: np.ndarray, accuracy: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return changes of fraction and pressure in E*, (k,) each, per cell size of separation; no closed cell opens."""
    linear = LinearisedFront(space, front, contact, mean_fraction, contact.fraction < 1, np.zeros(len(mean_fraction)))
    return linear.solve(np.full(len(mean_fraction), -1.0), accuracy)


class LinearisedFront:
    """Linearised equations of contact and front, in single precision.

    The unknowns are the changes of the pressure of closed cells, and of the fraction of cells at the front. The change
    of fraction is multiplied by the constant `front.straight_strength`, so that it has the unit of a pressure.
    """

    def __init__(
        self,
        space: HalfSpace,
        front: Front,
        contact: Contact,
        mean_fraction: np.ndarray,
        at_front: np.ndarray,
        damping: np.ndarray,
    ):
        """Linearise at a contact; mean_fraction, at_front and damping are given for each of its cells, (k,)."""
        self.space, self.front, self.cells = space, front, contact.cells
        self.closed, self.at_front = ~at_front, np.flatnonzero(at_front)
        self.local_strengths = front.local_strengths(mean_fraction[self.at_front]).astype(np.float32)
        self.fraction = contact.fraction[self.at_front].astype(np.float32)
        self.damping = damping[self.at_front].astype(np.float32)
        self.operator = space.restrict_to(contact.cells)
        self.weights = neighbour_weights(contact.cells[self.at_front], space.shape)
        self.straight_strength = np.float32(front.straight_strength or 1.0)

    def solve(self, right: np.ndarray, accuracy: float) -> tuple[np.ndarray, np.ndarray]:
        """Solve for the changes of fraction and pressure, (k,) each, with a right-hand side, by GMRES.

        The residual is reduced to the relative `accuracy`. If tiles are too inaccurate for this, residuals of the full
        grid correct the solution, as long as each correction halves them. The result may be less accurate.

        Raises
        ------
        NotConverged
            If the solution is not finite.
        """
        # Scale to order one, because squares of small residuals would vanish in single precision on flat surfaces.
        scale = 2.0 ** np.frexp(np.abs(right).max(initial=0.0))[1]
        right = (right / scale).astype(np.float32)
        norm = error = np.linalg.norm(right)
        solution, residual = np.zeros_like(right), right
        while not error <= accuracy * norm:
            part = max(accuracy * float(norm / error), self.operator.error)
            solution = solution + gmres(self._left_side, self._approximate_inverse, residual, part)
            if accuracy >= 10 * self.operator.error:
                break
            residual = right - self._left_side(solution, FullGrid(self.space, self.cells))
            before, error = error, np.linalg.norm(residual)
            if not error <= LARGEST_REMAINDER * before:
                break
        if not np.isfinite(solution).all():
            raise NotConverged(f"the linear equations of {len(self.cells)} cells have no finite solution")
        pressure, _, _ = self._pressures(solution)
        fraction = np.zeros(len(solution))
        fraction[self.at_front] = scale * (solution[self.at_front] / self.straight_strength)
        return fraction, scale * pressure.astype(float)

    def _pressures(self, unknowns):
        """Convert unknowns to changes of the pressures, (k,), and of the strengths and fractions at the front."""
        fraction = unknowns[self.at_front] / self.straight_strength
        if not len(fraction):
            return unknowns, fraction, fraction
        stronger = self.front.strength_change(self.local_strengths, self.weights @ fraction)
        tension = self.front.tension_change(self.local_strengths, self.fraction, stronger, fraction)
        pressure = unknowns.copy()
        pressure[self.at_front] = -tension
        return pressure, stronger, fraction

    def _left_side(self, unknowns, operator=None):
        """Return the change of displacement minus the change of the gap by the law; use `operator` if it is given."""
        pressure, stronger, fraction = self._pressures(unknowns)
        result = (operator or self.operator).displacement(pressure)
        law = self.local_strengths, self.fraction, stronger, fraction
        result[self.at_front] -= self.front.law_gap_change(*law, self.damping)
        return result

    def _approximate_inverse(self, right):
        """Apply the preconditioner: inverse half-space at closed cells, division by a constant at the front."""
        result = self.operator.approximate_inverse(np.where(self.closed, right, np.float32(0)))
        result[self.at_front] = right[self.at_front] / np.float32(NET_COMPLIANCE)
        return result


# Some processors raise the flag of an invalid value in products of finite matrices (numpy/numpy issue 24067).
@np.errstate(invalid="ignore")
def gmres(matrix: Callable, preconditioner: Callable, right: np.ndarray, accuracy: float) -> np.ndarray:
    """Solve by right-preconditioned GMRES to a relative accuracy, or with _MAX_KRYLOV steps; NaN if it breaks down."""
    norm = float(np.linalg.norm(right))
    if norm == 0:
        return np.zeros_like(right)
    basis, triangle = np.zeros((_MAX_KRYLOV + 1, len(right)), right.dtype), np.zeros((_MAX_KRYLOV, _MAX_KRYLOV))
    basis[0] = right / norm
    rotations: list[tuple[float, float]] = []
    goal = [norm]
    for count in range(1, _MAX_KRYLOV + 1):
        vector, known = matrix(preconditioner(basis[count - 1])), basis[:count]
        shares = known @ vector
        vector = vector - shares @ known
        correction = known @ vector  # orthogonal to rounding after the second time
        vector -= correction @ known
        column, size = (shares + correction).tolist(), float(np.linalg.norm(vector))
        # Givens rotations keep the Hessenberg matrix of the shares triangular.
        for row, (cosine, sine) in enumerate(rotations):
            one, other = column[row : row + 2]
            column[row : row + 2] = cosine * one + sine * other, cosine * other - sine * one
        length = math.hypot(column[-1], size)
        if not 0 < length < math.inf:
            return np.full_like(right, np.nan)
        rotations.append((column[-1] / length, size / length))
        column[-1] = length
        triangle[:count, count - 1] = column
        goal[-1:] = rotations[-1][0] * goal[-1], -rotations[-1][1] * goal[-1]
        if abs(goal[-1]) <= accuracy * norm or size <= 0:
            break
        basis[count] = vector / size
    weights = np.linalg.solve(triangle[:count, :count], goal[:count])
    return preconditioner(weights.astype(right.dtype) @ basis[:count])
