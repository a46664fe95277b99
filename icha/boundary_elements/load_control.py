"""Loads and areas: the mean separation at which a contact has a given one."""

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

# Relative error of a load or area that is met: below that at which a path recognises a stop, 1e-9.
_MET = 5e-10
# Separations that differ by less, in h_rms, are the same.
_SAME_SEPARATION = 1e-13
# Unit of the error of a load of zero, divided by stiffness times h_rms: attraction and repulsion of about this size
# cancel.
_ZERO_LOAD = 1e-2
_MAX_TRIALS, _MAX_ATTEMPTS = 30, 4
# Largest change of the mean gap between trials where the target may lie in full contact: as a part of the mean gap,
# and in h_rms.
_CLOSING, _LONGEST = 0.5, 0.1


@dataclass(frozen=True, eq=False)
class ControlProblem:
    """A load or area that a contact has to meet.

    Parameters
    ----------
    contact, control : the model, and the quantity with its target.
    solve : solves the equilibrium at a separation (m) from a state, to a residual of the front; close: whether the
        state is close to it, same_slopes: whether it has its slopes.
    events : finds the events between two states.
    """

    contact: BoundaryElements
    control: Control
    solve: Callable[..., CellState]
    events: Callable[[CellState, CellState], Events]

    def error(self, state: CellState) -> float:
        """Value of a state less the target."""
        return self.value(state) - self.control.target

    def value(self, state: CellState) -> float:
        """Nominal pressure or area fraction of a state."""
        of = self.contact.pressure if self.control.quantity == PRESSURE else self.contact.area_fraction
        return of(state)

    def scale(self, state: CellState) -> float:
        """Return unit of relative errors, from the state at the start."""
        if self.control.target:
            return abs(self.control.target)
        unit = abs(self.contact.stiffness(state)) * self.contact.rms_height
        return max(abs(self.contact.pressure(state)), _ZERO_LOAD * unit if np.isfinite(unit) else 0.0)

    def tolerance(self, scale: float) -> float:
        """Largest error of a value that meets the target."""
        if self.control.quantity == AREA_FRACTION and not self.contact.adhesive:
            cells = AREA_TOLERANCE_CELLS * self.contact.spacing**2 / self.contact.area
            return max(_MET * scale, min(cells, AREA_TOLERANCE_PART * scale))
        return _MET * scale

    def newton_separation(self, state: CellState, before: CellState | None = None) -> float:
        """Separation at which the target is expected, m: by the slope, or by the secant through an earlier state."""
        slope = self.contact.slope(self.control.quantity, state)
        if before is not None and before.separation != state.separation:
            # The slope of an area does not know of cells that begin to open or to close.
            slope = (self.value(state) - self.value(before)) / (state.separation - before.separation)
        return state.separation - self.error(state) / slope if slope else np.nan


@dataclass(frozen=True, eq=False)
class Bracket:
    """Two states on either side of a target.

    Parameters
    ----------
    sign : of what is missing to the target in `before`.
    before, beyond : states short of the target, and beyond it once one is known.
    same : separations that differ by less are the same, m.
    """

    sign: float
    same: float
    before: CellState
    beyond: CellState | None = None

    def with_state(self, state: CellState, error: float) -> Bracket:
        """Replace one side by a state with an error."""
        return replace(self, before=state) if self.sign * error < 0 else replace(self, beyond=state)

    def limit(self, separation: float) -> float:
        """Return a separation (m) if it lies within, else the middle.

        Raises
        ------
        NotConverged
            If the bracket is closed, or open and the separation not finite.
        """
        if self.beyond is None:
            if np.isfinite(separation):
                return separation
            raise NotConverged("the target is not met from here")
        low, high = sorted((self.before.separation, self.beyond.separation))
        if high - low < self.same:
            raise NotConverged("the target is not met from here")
        return separation if low < separation < high else 0.5 * (low + high)


def solve_at_control(problem: ControlProblem, state: CellState, separation: float) -> CellState:
    """Solve the equilibrium under a load or of an area, from a state not far away.

    separation : a first guess, m.

    Raises
    ------
    NotConverged
        If the target is not met.
    """
    contact, control = problem.contact, problem.control
    scale = problem.scale(state)
    same = _SAME_SEPARATION * contact.rms_height
    whole = bracket = Bracket(np.sign(-problem.error(state)) or 1.0, same, state)
    if separation <= 0:
        separation = 0.5 * state.separation
    reason = ""
    try:
        for _ in range(_MAX_ATTEMPTS):
            trial, bracket = bracket_loosely(problem, bracket, separation, scale)
            if abs(problem.error(trial)) <= problem.tolerance(scale) and not contact.adhesive:
                return trial
            found, met = iterate_secant(problem, whole, trial, scale)
            if met:
                return found
            bracket = whole.with_state(found, problem.error(found))
            separation = bracket.limit(problem.newton_separation(found))
    except FullContact:
        # The load is larger than that of the smallest gap.
        if control.quantity == PRESSURE and whole.sign > 0:
            return contact.full_contact(control.target)
        reason = ": the contact closes over the whole surface"
    except NotConverged as failure:
        reason = f": {failure}"
    raise NotConverged(f"a {control.quantity.replace('_', ' ')} of {control.target:g} is not met from here{reason}")


def bracket_loosely(
    problem: ControlProblem, bracket: Bracket, separation: float, scale: float
) -> tuple[CellState, Bracket]:
    """Find a state close to the target by trials with coarse fronts.

    Where events may happen on the path, none is skipped: a trial that goes too far starts from before it.
    """
    contact, start, residual = problem.contact, bracket.before, TOLERANCES.coarse
    control_is_load = problem.control.quantity == PRESSURE
    close = TOLERANCES.fine * scale if contact.adhesive else problem.tolerance(scale)
    trials = _MAX_TRIALS // 2 if contact.adhesive else 2 * _MAX_TRIALS
    for _ in range(trials):
        trial, residual = problem.solve(start, separation, residual), TOLERANCES.fine
        error = problem.error(trial)
        if abs(error) <= close:
            return trial, bracket
        bracket = bracket.with_state(trial, error)
        passed = trial is not bracket.before and len(problem.events(bracket.before, trial))
        start = bracket.before if passed else trial
        separation = problem.newton_separation(trial)
        if control_is_load and bracket.sign > 0 and bracket.beyond is None and not separation < trial.separation:
            # The load falls as the surfaces approach: look for it beyond its minimum.
            separation = trial.separation - min(_CLOSING * trial.separation, _LONGEST * contact.rms_height)
        separation = bracket.limit(separation)
        if separation < contact.smallest_gap:
            separation = (1 - _CLOSING) * trial.separation
            if separation < contact.smallest_gap:
                raise FullContact("the mean gap vanishes")
    raise NotConverged(f"{trials} trials do not bracket it")


def iterate_secant(problem: ControlProblem, bracket: Bracket, trial: CellState, scale: float) -> tuple[CellState, bool]:
    """Meet the target by secants from a state close to it; returns the last state, and whether it meets the target."""
    before, error = None, problem.error(trial)
    for _ in range(_MAX_TRIALS):
        separation = bracket.limit(problem.newton_separation(trial, before))
        if separation < problem.contact.smallest_gap:
            raise FullContact("the mean gap vanishes")
        start, before = trial, trial if before is not None or trial.front_residual <= TOLERANCES.front else None
        same = before is not None and abs(error) < TOLERANCES.linear[0] * scale
        trial = problem.solve(start, separation, TOLERANCES.front, close=True, same_slopes=same)
        error = problem.error(trial)
        if abs(error) <= problem.tolerance(scale):
            return trial, True
        if abs(error) > TOLERANCES.fine * scale:
            return trial, False
        bracket = bracket.with_state(trial, error)
    raise NotConverged(f"{_MAX_TRIALS} secants do not meet it")
