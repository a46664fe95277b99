"""Control of load or area: find the mean separation at which the contact has a given load or area."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from icha.boundary_elements.front_solver import TOLERANCES
from icha.boundary_elements.patches import CellState
from icha.contact.model import AREA_FRACTION, PRESSURE, Control, Events, FullContact, NotConverged
from icha.contact.models import AREA_TOLERANCE_CELLS, AREA_TOLERANCE_PART

if TYPE_CHECKING:
    from icha.boundary_elements.contact import BoundaryElements

# A load or area is met if its relative error is at most this part of the error that paths allow.
_MET = 0.5
# Smallest difference of two separations, divided by h_rms.
_SAME_SEPARATION = 1e-13
# Least load to which errors at zero load are relative, in units of stiffness times h_rms: about the size of attraction
# and repulsion, which cancel at zero load.
_ZERO_LOAD = 1e-2
_MAX_TRIALS, _MAX_ATTEMPTS = 30, 4
# Largest decrease of the mean gap in a trial towards full contact, in units of the mean gap, and (_LONGEST) of h_rms.
_CLOSING, _LONGEST = 0.5, 0.1


@dataclass(frozen=True, eq=False)
class ControlProblem:
    """A contact model and the load or area that its state must have.

    Parameters
    ----------
    contact : the contact model.
    control : the controlled quantity (nominal pressure or area fraction) and its target.
    solve : `BoundaryElements._solve`, a function of a state, the separation (m) and the largest residual of the front;
        it returns the equilibrium.
    events : function that finds the events between two states.
    """

    contact: BoundaryElements
    control: Control
    solve: Callable[..., CellState]
    events: Callable[[CellState, CellState], Events]

    def error(self, state: CellState) -> float:
        """Return the controlled quantity of a state minus the target."""
        return self.value(state) - self.control.target

    def value(self, state: CellState) -> float:
        """Return the controlled quantity of a state: its nominal pressure (Pa) or its area fraction."""
        of = self.contact.pressure if self.control.quantity == PRESSURE else self.contact.area_fraction
        return of(state)

    def scale(self, state: CellState) -> float:
        """Return the unit of relative errors: |target|; for zero load |p| of a state, bounded below by `_ZERO_LOAD`."""
        if self.control.target:
            return abs(self.control.target)
        unit = abs(self.contact.stiffness(state)) * self.contact.rms_height
        return max(abs(self.contact.pressure(state)), _ZERO_LOAD * unit if np.isfinite(unit) else 0.0)

    def closer(self, separation: float) -> float:
        """Return a smaller separation for the next trial towards a larger load, m."""
        longest = _LONGEST * self.contact.rms_height
        return separation - (min(_CLOSING * separation, longest) if self.contact.space.mean_is_fixed else longest)

    def tolerance(self, scale: float) -> float:
        """Return the largest error of a met target: a part of `scale`; for areas without adhesion, some cell areas."""
        met = _MET * self.contact.path_accuracy.target * scale
        if self.control.quantity == AREA_FRACTION and not self.contact.adhesive:
            cells = AREA_TOLERANCE_CELLS * self.contact.spacing**2 / self.contact.area
            return max(met, min(cells, AREA_TOLERANCE_PART * scale))
        return met

    def is_past_maximum(self, state: CellState, separation: float, bracket: Bracket) -> bool:
        """Return whether a load below the target falls as the surfaces approach, by a predicted separation (m)."""
        rising = self.control.quantity == PRESSURE and bracket.sign > 0 and bracket.beyond is None
        return rising and self.error(state) < 0 and not separation < state.separation

    def loose_tolerance(self, state: CellState, scale: float) -> float:
        """Return the error of a nearby state that tight fronts may cause: a part of pressures, which may cancel."""
        if self.control.quantity == PRESSURE:
            scale = max(scale, float(np.sum(np.abs(state.pressure))) / self.contact.count)
        return TOLERANCES.fine * scale

    def newton_separation(self, state: CellState, before: CellState | None = None) -> float:
        """Predict the target's separation (m) from the slope at a state or the secant through `before`; NaN if flat."""
        slope = self.contact.slope(self.control.quantity, state)
        if before is not None and before.separation != state.separation:
            # The slope of the area neglects cells that start to open or to close.
            slope = (self.value(state) - self.value(before)) / (state.separation - before.separation)
        return state.separation - self.error(state) / slope if slope else np.nan


@dataclass(frozen=True, eq=False)
class Bracket:
    """State before the target load or area and, once it is known, a state beyond the target.

    Parameters
    ----------
    sign : sign of the target minus the controlled quantity in `before`.
    smallest_difference : smallest difference between two separations, m.
    before : state that has not yet reached the target.
    beyond : state that has passed the target; None before such a state is found.
    """

    sign: float
    smallest_difference: float
    before: CellState
    beyond: CellState | None = None

    def with_state(self, state: CellState, error: float) -> Bracket:
        """Return the bracket with a new state as `before` or `beyond`; the sign of `error` (value - target) decides."""
        return replace(self, before=state) if self.sign * error < 0 else replace(self, beyond=state)

    def limit(self, separation: float) -> float:
        """Return a predicted separation (m) or, if it lies outside a bracket with `beyond`, the middle of the bracket.

        Raises
        ------
        NotConverged
            If the separations of both states are equal, or if the prediction is not finite while `beyond` is unknown.
        """
        if self.beyond is None:
            if np.isfinite(separation):
                return separation
            raise NotConverged("the slope predicts no finite separation for the target")
        low, high = sorted((self.before.separation, self.beyond.separation))
        if high - low < self.smallest_difference:
            raise NotConverged("the contact jumps past the target between two equal separations")
        return separation if low < separation < high else 0.5 * (low + high)


def solve_at_control(problem: ControlProblem, state: CellState, separation: float) -> CellState:
    """Find the equilibrium with the target load or area, starting from a nearby state.

    Return full contact if the target load is larger than the loads of all states down to the smallest mean gap.

    separation : first guess of the mean separation, m; if it is not positive, half the separation of the state is used.

    Raises
    ------
    NotConverged
        If no equilibrium with the target is found.
    """
    contact, control = problem.contact, problem.control
    scale = problem.scale(state)
    smallest_difference = _SAME_SEPARATION * contact.rms_height
    initial = bracket = Bracket(np.sign(-problem.error(state)) or 1.0, smallest_difference, state)
    if contact.space.mean_is_fixed and separation <= 0:
        separation = 0.5 * state.separation
    elif separation == -np.inf:
        separation = problem.closer(state.separation)
    reason = ""
    try:
        # Near an extremum of the load, a loose front may seem to meet a target that no equilibrium meets.
        for residual in (TOLERANCES.coarse, *(_MAX_ATTEMPTS - 1) * (TOLERANCES.fine,)):
            trial = find_nearby_state(problem, bracket, separation, scale, residual)
            if abs(problem.error(trial)) <= problem.tolerance(scale) and not contact.adhesive:
                return trial
            # States with loose fronts are not accurate bounds, so the secant steps begin with the initial bracket.
            found, met = iterate_secant(problem, initial, trial, scale)
            if met:
                return found
            bracket = initial.with_state(found, problem.error(found))
            separation = problem.newton_separation(found)
            if problem.is_past_maximum(found, separation, bracket):
                separation = problem.closer(found.separation)
            separation = bracket.limit(separation)
    except FullContact:
        if control.quantity == PRESSURE and initial.sign > 0:
            return contact.full_contact(control.target)
        reason = ": the contact closes over the whole surface"
    except NotConverged as failure:
        reason = f": {failure}"
    raise NotConverged(f"found no equilibrium at a {control.quantity.replace('_', ' ')} of {control.target:g}{reason}")


def find_nearby_state(
    problem: ControlProblem, bracket: Bracket, separation: float, scale: float, residual: float
) -> CellState:
    """Find a state with an error of at most `loose_tolerance`, or without adhesion of at most the final error.

    The first trial relaxes the fronts to `residual`, and later trials to TOLERANCES.fine. After a trial that
    passes the target with an event, the next trial starts again from the state before the target. Raise `FullContact`
    if the mean gap vanishes, and `NotConverged` after too many trials.
    """
    contact, start = problem.contact, bracket.before
    trials = _MAX_TRIALS // 2 if contact.adhesive else 2 * _MAX_TRIALS
    for _ in range(trials):
        trial, residual = problem.solve(start, separation, residual), TOLERANCES.fine
        error = problem.error(trial)
        if abs(error) <= (problem.loose_tolerance(trial, scale) if contact.adhesive else problem.tolerance(scale)):
            return trial
        bracket = bracket.with_state(trial, error)
        passed = trial is not bracket.before and len(problem.events(bracket.before, trial))
        start = bracket.before if passed else trial
        separation = problem.newton_separation(trial)
        if problem.is_past_maximum(trial, separation, bracket):
            # Search past the minimum of the load.
            separation = problem.closer(trial.separation)
        separation = bracket.limit(separation)
        if separation < contact.smallest_gap:
            separation = (1 - _CLOSING) * trial.separation
            if separation < contact.smallest_gap:
                raise FullContact("the mean gap vanishes")
    raise NotConverged(f"{trials} trials found no state near the target")


def iterate_secant(problem: ControlProblem, bracket: Bracket, trial: CellState, scale: float) -> tuple[CellState, bool]:
    """Approach the target by secant steps from a state near it; return the last state and whether the target is met.

    The steps end without meeting the target at a maximum of the load below it, and when an error exceeds
    `loose_tolerance`, as after a jump. Raise `FullContact` if the mean gap vanishes, and `NotConverged` after
    _MAX_TRIALS steps.
    """
    before, error = None, problem.error(trial)
    for _ in range(_MAX_TRIALS):
        separation = problem.newton_separation(trial, before)
        if problem.is_past_maximum(trial, separation, bracket):
            return trial, False
        separation = bracket.limit(separation)
        if separation < problem.contact.smallest_gap:
            raise FullContact("the mean gap vanishes")
        # The first trial may have a loose front, too inaccurate for a secant.
        start, before = trial, trial if before is not None or trial.front_residual <= TOLERANCES.front else None
        reuse_slopes = before is not None and abs(error) < TOLERANCES.linear[0] * scale
        trial = problem.solve(start, separation, TOLERANCES.front, nearby=True, reuse_slopes=reuse_slopes)
        error = problem.error(trial)
        if abs(error) <= problem.tolerance(scale):
            return trial, True
        if abs(error) > problem.loose_tolerance(trial, scale):
            return trial, False
        bracket = bracket.with_state(trial, error)
    raise NotConverged(f"{_MAX_TRIALS} secant steps did not meet the target")
