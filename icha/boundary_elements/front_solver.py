"""Equilibrium of the front at a given separation: Newton steps of pressures and fractions, with falling energy.

The energy U(f) - dgamma A(f) falls with every step, so that the result is a local minimum that the start leads down
to; where the front is unstable it runs until it rests. A step solves the linearised equations of contact (gap 0 in
closed cells), of the front (tension = f strength) and of its strength. Where it leads up in energy, it is repeated with
softer bonds, which shortens it (Levenberg and Marquardt).
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
    """All tolerances of the solver; `docs/short_range.md` has the measurements behind their values.

    The residual of a cell is |K/K_c - 1| with K/K_c = sqrt(G/dgamma). Errors of displacements are in units of the
    critical opening.

    Parameters
    ----------
    front : residual of a converged front; the grid's own error of areas and loads is some 1e-3.
    stagnation : largest residual at which a front that cannot move on is accepted; above, it has not converged.
    coarse : residual above which cells are relaxed locally and damped, and below which contact forms that is within
        reach by more than the same part of the critical opening; first trials for a load end here.
    fine : residual below which all contact within reach forms, and above which few cells are relaxed locally on their
        own; later trials for a load end here, and are close to it if the relative error is no larger.
    few : part of the front that counts as few cells.
    displacement : error of a displacement, divided by the residual that it decides.
    moving_displacement : the same, at most, after a step.
    certain_displacement : error at which energies of states that differ little can be compared.
    linear : error of the linearised equations: the front's residual, but between these two.
    damping : first damping of bonds where a step leads up in energy; twice if most of the front is far from
        equilibrium at the start.
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
# Smallest error of displacements, in units of the critical opening.
_SMALLEST_ERROR = 1e-3 * TOLERANCES.front
# Limits of the iteration.
_MAX_STEPS, _MAX_KRYLOV, _MAX_LOCAL_RELAXATIONS, _LARGEST_DAMPING = 400, 60, 5, 1e8
# Relative rounding error of an energy, and of the work of a step.
_ENERGY_ROUNDING, _WORK_ROUNDING = 1e-12, 1e-11


@dataclass(frozen=True, eq=False)
class ActiveCells(Contact):
    """Cells that take part in a step: those in contact, and cells of the rim that close, with fraction 0.

    Parameters
    ----------
    gap : (k,), in cells.
    mean_fraction : (k,), as of `AdhesiveContact`.
    intensity : (k,), stress intensity at the front divided by the critical one, K/K_c = sqrt(G/dgamma).
    free : (k,) bool, whether the front may move there.
    """

    gap: np.ndarray
    mean_fraction: np.ndarray
    intensity: np.ndarray
    free: np.ndarray

    @property
    def at_front(self) -> np.ndarray:
        """Whether a cell is free or partly in contact, (k,)."""
        return self.free | ((self.fraction > 0) & (self.fraction < 1))

    @property
    def residuals(self) -> np.ndarray:
        """Residual of every cell, (k,)."""
        return np.where(self.free, np.abs(self.intensity - 1), 0.0)

    @property
    def residual(self) -> float:
        """Largest residual of the front."""
        return float(np.max(self.residuals, initial=0.0))

    def cells_to_relax(self) -> tuple[np.ndarray, bool]:
        """Cells far from equilibrium, (k,) bool, and whether they are only few of the front's."""
        few = TOLERANCES.few * np.count_nonzero(self.at_front)
        uneasy = self.residuals > TOLERANCES.fine
        if np.count_nonzero(uneasy) <= few:
            return uneasy, True
        far = self.residuals > TOLERANCES.coarse
        return far, bool(np.count_nonzero(far) <= few)


def find_active_cells(front: Front, state: AdhesiveContact) -> ActiveCells:
    """Find the cells of a state that take part in a step.

    A closed cell can start to open only if one of its four neighbours is not closed, or if its tension exceeds the
    strength of the interface.
    """
    grid, gap = state.gap.shape[-1], state.gap.ravel()
    intensity = front.intensity(state.fraction, state.pressure, state.mean_fraction)
    relative_gap = front.relative_gap(gap[state.rim], state.mean_fraction_rim)
    closed = mask_of(state.cells[state.fraction >= 1], state.gap.shape).ravel()
    opening = intensity > 1
    at_edge = ~np.all(closed[adjacent(state.cells[opening], grid)], axis=0) | (state.fraction[opening] < 1)
    opening[opening] = at_edge | (-state.pressure[opening] > front.interface_strength)
    closing = relative_gap < 1
    cells, fraction, pressure, mean_fraction, intensity, free = merge_cells(
        state.cells,
        state.rim[closing],
        (state.fraction, 0.0),
        (state.pressure, 0.0),
        (state.mean_fraction, state.mean_fraction_rim[closing]),
        (intensity, relative_gap[closing]),
        (opening | ((intensity < 1) & (state.fraction < 1)), True),
    )
    return ActiveCells(cells, fraction, pressure, gap[cells], mean_fraction, intensity, free)


@dataclass(frozen=True, eq=False)
class FrontProblem:
    """A surface with a front at one separation.

    Parameters
    ----------
    space, front, topography : half-space, law of the front, heights.
    separation : mean separation, in cells.
    background : in windows, part of the mean fraction that is due to contact outside; else None.
    """

    space: HalfSpace
    front: Front
    topography: Topography
    separation: float
    background: np.ndarray | None = None

    def solve_elastic(self, contact: Contact, accuracy: float) -> AdhesiveContact:
        """Solve the pressures as `solve_bonded_contact`, to an accuracy in units of the critical opening."""
        tolerance = accuracy * self.front.critical_opening
        return solve_bonded_contact(self.space, self.topography, self.separation, contact, tolerance, self.background)

    def is_accurate(self, state: AdhesiveContact, accuracy: float) -> bool:
        """Whether the displacement of a state has an accuracy, in units of the critical opening."""
        return state.tolerance <= (1 + _WORK_ROUNDING) * accuracy * self.front.critical_opening

    def energy(self, state: AdhesiveContact) -> float:
        """Elastic energy less the work of adhesion, in E* cells^3."""
        # Pairs of a window cell and an outside cell count twice in w, so the background is added once more.
        mean_fraction = state.mean_fraction
        if self.background is not None:
            mean_fraction = mean_fraction + self.background.ravel()[state.cells]
        return state.energy - self.front.adhesion_energy(state.fraction, mean_fraction)

    def is_lower(self, new: AdhesiveContact, old: AdhesiveContact) -> bool:
        """Whether a state is not above another in energy, within the errors of both."""
        energy = self.energy(old)
        rounding = _ENERGY_ROUNDING * abs(energy) + NO_CONTACT * self.front.adhesion_length
        return self.energy(new) <= energy + new.energy_error + old.energy_error + rounding


def relax_front(
    problem: FrontProblem,
    contact: Contact,
    tolerance: float,
    *,
    close: bool = False,
    max_steps: int | None = None,
    relax_locally: Callable[[AdhesiveContact, np.ndarray], Contact | None] = lambda state, cells: None,
) -> AdhesiveContact:
    """Relax the front of a contact to the equilibrium to which its energy falls.

    Parameters
    ----------
    contact : if it is an `AdhesiveContact`, of this problem.
    tolerance : largest residual of the front.
    close : whether the contact is close to equilibrium.
    max_steps : number of steps after which the front is returned as it is.
    relax_locally : relaxes the front around given cells, (m,), of a state; None where that does not pay.

    Raises
    ------
    NotConverged
        If the front stagnates at a residual above TOLERANCES.stagnation, or still has one after _MAX_STEPS steps if
        max_steps is not given.
    FullContact
        If the contact covers the surface.
    """
    relaxation = FrontRelaxation(problem, contact, close)
    for _ in range(max_steps or _MAX_STEPS):
        active = find_active_cells(problem.front, relaxation.state)
        try:
            if active.residual <= tolerance:
                if not relaxation.refine(TOLERANCES.displacement * tolerance):
                    return relaxation.state
            elif not relaxation.relax_locally(active, relax_locally):
                relaxation.step(active)
        except Stagnation as failure:
            if active.residual > TOLERANCES.stagnation:
                raise NotConverged(f"{failure} (residual of sqrt(G/dgamma): {active.residual:.1e})") from None
            if not relaxation.refine(_SMALLEST_ERROR):
                return relaxation.state
    if max_steps or active.residual <= TOLERANCES.stagnation:
        return relaxation.state
    raise NotConverged(f"the front did not converge (residual of sqrt(G/dgamma): {active.residual:.1e})")


class Stagnation(NotConverged):
    """No step lowers the energy."""


class FrontRelaxation:
    """State of the iteration that relaxes a front.

    Attributes
    ----------
    state : the contact of the last step.
    damping : of the bonds in the next step.
    coarsest : largest error of the displacement, in units of the critical opening.
    local_relaxations : number since the last step of the whole front.
    """

    def __init__(self, problem: FrontProblem, contact: Contact, close: bool):
        """Begin with a contact that is close to equilibrium or not."""
        self.problem, self.damping, self.local_relaxations, self.steps = problem, 0.0, 0, 0
        self.start = TOLERANCES.certain_displacement if close else TOLERANCES.moving_displacement
        self.coarsest = self.start
        if not isinstance(contact, AdhesiveContact):
            contact = problem.solve_elastic(contact, self.start)
        self.state = contact

    def refine(self, accuracy: float) -> bool:
        """Solve for the pressures again, unless they have an accuracy, in units of the critical opening, already."""
        accuracy = max(accuracy, _SMALLEST_ERROR)
        if self.problem.is_accurate(self.state, accuracy):
            return False
        self.state = self.problem.solve_elastic(self.state, accuracy)
        return True

    def relax_locally(self, active: ActiveCells, relax: Callable) -> bool:
        """Relax the front around cells far from equilibrium; return whether this lowered the energy."""
        far, few = active.cells_to_relax()
        if not far.any() or self.local_relaxations >= (_MAX_LOCAL_RELAXATIONS if few else 1):
            return False
        self.local_relaxations += 1
        contact = relax(self.state, active.cells[far])
        if contact is not None:
            accuracy = min(self.start, 0.1 * TOLERANCES.moving_displacement, self._moving_accuracy(active))
            try:
                new = self.problem.solve_elastic(contact, max(_SMALLEST_ERROR, accuracy))
            except FullContact:
                # With fixed pressures around it, a last gap may close that would otherwise stay open.
                contact = None
        if contact is None or not self.problem.is_lower(new, self.state):
            self.local_relaxations = _MAX_LOCAL_RELAXATIONS
            return False
        self.state, self.damping = new, 0.0
        return True

    def _moving_accuracy(self, active: ActiveCells) -> float:
        """Accuracy that the displacement should have after a step."""
        residual = active.residual
        return residual * min(TOLERANCES.moving_displacement, max(residual, TOLERANCES.linear[0]))

    def step(self, active: ActiveCells) -> None:
        """Make one Newton step, or raise the damping where it leads up in energy."""
        problem = self.problem
        if self.steps == 0 and 2 * np.count_nonzero(active.cells_to_relax()[0]) > np.count_nonzero(active.at_front):
            self.damping = 2 * TOLERANCES.damping
        self.steps += 1
        change, pressure_change = newton_step(problem, active, self.damping)
        if np.sum((active.intensity**2 - 1) * change) > _WORK_ROUNDING * np.abs(change).sum():
            self._damp(2, active.residual)
            return
        accuracy = max(_SMALLEST_ERROR, min(self.coarsest, self._moving_accuracy(active)))
        try:
            new = problem.solve_elastic(active.apply_step(change, pressure_change), accuracy)
        except FullContact:
            new = None  # the gap has a given volume: it does not close
        if new is None or not problem.is_lower(new, self.state):
            self._damp(8, active.residual)
            return
        self.damping = self.damping / 4 if self.damping > 0.01 else 0.0
        self.state, self.coarsest, self.local_relaxations = new, self.start, 0

    def _damp(self, factor: float, residual: float) -> None:
        """Solve the pressures more accurately and raise the damping, both at once."""
        self.coarsest = min(self.coarsest, TOLERANCES.certain_displacement)
        self.refine(min(self.coarsest, TOLERANCES.displacement * residual))
        self.damping = max(factor * self.damping, TOLERANCES.damping)
        if self.damping > _LARGEST_DAMPING:
            raise Stagnation("no step of the front lowers the energy")


def newton_step(problem: FrontProblem, active: ActiveCells, damping: float) -> tuple[np.ndarray, np.ndarray]:
    """Solve the linearised equations: changes of fraction and pressure, (k,)."""
    front, at_front = problem.front, active.at_front
    # A running front needs shorter steps.
    local = np.where(np.abs(active.intensity - 1) > TOLERANCES.coarse, max(damping, 2 * TOLERANCES.damping), damping)
    linear = LinearisedFront(problem.space, front, active, active.mean_fraction, at_front, local)
    # Go to the tension that the law wants at the present fraction, and from there along the law.
    strengths = front.strengths(active.mean_fraction)
    missing = np.where(at_front, front.tension(strengths, active.fraction) + active.pressure, 0.0)
    moved = linear.operator.displacement(missing.astype(np.float32))
    opening = np.where(at_front, front.opening(strengths, active.fraction), 0.0)
    accuracy = float(np.clip(active.residual, *TOLERANCES.linear))
    change, pressure_change = linear.solve(moved + opening - active.gap, accuracy)
    return change, pressure_change - missing


def rates_with_separation(
    space: HalfSpace, front: Front, contact: Contact, mean_fraction: np.ndarray, accuracy: float
) -> tuple[np.ndarray, np.ndarray]:
    """Rates of fraction and pressure (E*), (k,), per unit of separation (one cell length)."""
    linear = LinearisedFront(space, front, contact, mean_fraction, contact.fraction < 1, np.zeros(len(mean_fraction)))
    return linear.solve(np.full(len(mean_fraction), -1.0), accuracy)


class LinearisedFront:
    """Equations of contact and front, linearised at a state; in single precision.

    Unknowns are the pressures of closed cells and, times the strength, the fractions of cells at the front.
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
        """Linearise at a contact, with mean fractions, which cells are at the front, and damping, (k,) each."""
        self.space, self.front, self.cells = space, front, contact.cells
        self.closed, self.at_front = ~at_front, np.flatnonzero(at_front)
        self.strengths = front.strengths(mean_fraction[self.at_front]).astype(np.float32)
        self.fraction = contact.fraction[self.at_front].astype(np.float32)
        self.damping_factor = (1 + damping[self.at_front]).astype(np.float32)
        self.operator = space.restrict_to(contact.cells)
        self.weights = neighbour_weights(contact.cells[self.at_front], space.shape)
        self.unit = np.float32(front.strength or 1.0)

    def solve(self, right: np.ndarray, accuracy: float) -> tuple[np.ndarray, np.ndarray]:
        """Solve for changes of fraction and pressure, (k,), to a relative accuracy.

        Raises
        ------
        NotConverged
            If the solution is not finite.
        """
        # Scaled to order one: on flat surfaces, squares of residuals would vanish in single precision.
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
        fraction[self.at_front] = scale * (solution[self.at_front] / self.unit)
        return fraction, scale * pressure.astype(float)

    def _pressures(self, unknowns):
        """Return changes of pressure, (k,), and of the strengths and tensions at the front."""
        fraction = unknowns[self.at_front] / self.unit
        if not len(fraction):
            return unknowns, fraction, fraction
        stronger = self.front.strength_change(self.strengths, self.weights @ fraction)
        tension = self.front.tension_change(self.strengths, self.fraction, stronger, fraction)
        pressure = unknowns.copy()
        pressure[self.at_front] = -tension
        return pressure, stronger, tension

    def _left_side(self, unknowns, operator=None):
        """Displacement less the change of opening by the law."""
        pressure, stronger, tension = self._pressures(unknowns)
        result = (operator or self.operator).displacement(pressure)
        result[self.at_front] -= self.front.opening_change(stronger, self.damping_factor * tension)
        return result

    def _approximate_inverse(self, right):
        """Preconditioner: half-space at closed cells, a constant at the edge."""
        result = self.operator.approximate_inverse(np.where(self.closed, right, np.float32(0)))
        result[self.at_front] = right[self.at_front] / np.float32(NET_COMPLIANCE)
        return result


def gmres(matrix: Callable, preconditioner: Callable, right: np.ndarray, accuracy: float) -> np.ndarray:
    """Solve linear equations by right-preconditioned GMRES without restart, to a relative accuracy or _MAX_KRYLOV."""
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
