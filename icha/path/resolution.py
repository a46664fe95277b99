"""Steps of a cycle that are short enough: the work in each is known, whatever the longest step."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from icha.contact.model import ContactModel, NotConverged, State
from icha.path.bracketing import CLOSE_TO_A_JUMP
from icha.path.course import halved
from icha.path.energy_balance import Step
from icha.path.limits import UNBALANCED_WORK, UNRESOLVED_LOSS, UNRESOLVED_REST

# Where nothing jumps, the part of the work so far that may be unknown after a step.
UNRESOLVED_WORK = 2e-4
# Unions and their undoing are found within this part of the longest step.
UNITING_STEP = 1 / 16
# Of the work so far, the part by which the pressure's curvature may matter in a step without events, unless work and
# energy agree to UNBALANCED_WORK.
_CURVED_WORK = 1e-4
# A loss that is less than this part of the work is known no better than one that is as large: fronts of boundary
# elements lose such parts in hops from cell to cell, which no short step resolves.
_LEAST_LOSS = 1e-2
# The first contact is made and the last one broken within this change of separation, in h_rms.
SHARP = 1e-12
# Of the largest tension so far, the part by which it may be missed between two equilibria: at an event, and else.
_MISSED_TENSION = 1e-3
_MISSED_SMOOTH_TENSION = 1e-8


@dataclass(frozen=True)
class Stride:
    """How far the next step may go, m, and where, counted along the leg, events were seen that are not resolved yet."""

    length: float
    event_at: float = np.inf


@dataclass(frozen=True)
class Account:
    """All steps so far.

    effort: work and losses without their signs, J/m^2. jumped: energy that jumps have set free, as if every spot were
    alone, J/m^2. lowest: pressure, Pa.
    """

    effort: float = 0.0
    jumped: float = 0.0
    lowest: float = 0.0

    def after(self, contact: ContactModel, step: Step, state: State) -> Account:
        """The account after one more step, to a state."""
        return Account(
            effort=self.effort + (abs(step.work) + abs(step.lost)),
            jumped=self.jumped + step.set_free(contact),
            lowest=min(self.lowest, contact.pressure(state)),
        )


def resolved(
    contact: ContactModel, start: State, direction: int, width: float, stride: Stride, account: Account, longest: float
) -> tuple[State, Step, Stride]:
    """The next equilibrium, near enough that the work up to it is known, the step to it, and the stride after it.

    On the way back the spots may lose their equilibrium together before any of them has come to its own jump-off:
    then the one that is nearest to it, at the rate at which all of them run towards it, lets go.

    Parameters
    ----------
    direction : of the separation: -1 on loading, 1 on unloading.
    width, longest : of the step that is tried first, and of all steps, m.

    Raises
    ------
    NotConverged
        If an equilibrium is not found even with the shortest step.
    """
    unit = contact.rms_height
    while True:
        collective = direction > 0 and contact.adhesive and width < CLOSE_TO_A_JUMP * unit
        try:
            beyond = _equilibrium(contact, start, start.separation + direction * width, collective)
        except NotConverged as failure:
            width = halved(width, longest, failure)
            stride = replace(stride, length=min(stride.length, width))
            continue
        step = Step.between(contact, start, beyond)
        settled = replace(stride, event_at=np.inf) if step.sudden else stride
        # Within the accuracy of an equilibrium an event may happen after a long step and not after a short one.
        passed = step.sudden and direction * start.separation + SHARP * unit >= stride.event_at
        if width <= SHARP * unit or passed:
            return beyond, step, settled
        work_known = _is_work_known(contact, beyond, step, account, longest)
        if work_known and _is_tension_known(contact, start, beyond, step, account):
            weakest = _largest_tension(contact, start, beyond, step, account)
            if weakest is None:
                return beyond, step, settled
            stride, width = settled, weakest - start.separation
        else:
            if step.sudden:
                stride = replace(stride, event_at=min(stride.event_at, direction * beyond.separation))
            width *= 0.5
        stride = replace(stride, length=min(stride.length, width))


def _equilibrium(contact, start, separation, collective):
    """The equilibrium at a separation; if there is none and it may be lost `collectively`, with spots let go."""
    try:
        beyond = contact.equilibrium(start, separation)
        if separation > start.separation and contact.is_unstable(beyond):
            raise NotConverged("spots would come closer as the surfaces part: an unstable equilibrium")
        return beyond
    except NotConverged as failure:
        first, count = failure, 1
    while collective and count <= contact.spot_count(start):
        with suppress(NotConverged):
            return contact.equilibrium(start, separation, let_go=count)
        count *= 2
    raise first


def _is_work_known(contact, beyond, step, account, longest):
    """Whether the work in a step is known."""
    effort = account.effort + abs(step.work) + abs(step.lost)
    jumped = UNRESOLVED_LOSS * (account.jumped + step.set_free(contact))
    if step.unresolved > (max(jumped, UNRESOLVED_REST * effort) if jumped else UNRESOLVED_WORK * effort):
        return False
    # What a union makes of two spots depends on how far they overlap when it is found.
    if step.unites and abs(step.width) > UNITING_STEP * longest:
        return False
    scale = effort
    if step.width > 0 and contact.pressure(beyond) < 0:
        # There is no way in here that has the same error.
        scale = min(effort, max(10 * account.jumped, _LEAST_LOSS * effort))
    unbalanced = step.integration_error > _CURVED_WORK * scale and abs(step.lost) > UNBALANCED_WORK * scale
    return step.sudden or not unbalanced or abs(step.width) <= longest / 256


def _is_tension_known(contact, start, beyond, step, account):
    """Whether the largest tension in a step is known, as far as its events decide it."""
    if step.width < 0 or not step.pressure_jump:
        return True
    if contact.adhesive and contact.spot_count(start) and not contact.spot_count(beyond):
        return False  # the last contact breaks: seen as sharply as can be
    # The pressure has fallen on along its tangent until the event.
    p, slope = contact.pressure(start), -contact.stiffness(start)
    lowest, deepest = min(p, p + step.width * slope), min(p, contact.pressure(beyond))
    return lowest >= account.lowest or deepest - lowest <= _MISSED_TENSION * abs(lowest)


def _largest_tension(contact, start, beyond, step, account):
    """Where between two states without an event the tension is largest, if it is a new largest one; else None."""
    slope, end_slope = (-contact.stiffness(state) for state in (start, beyond))
    if step.width < 0 or step.pressure_jump or not slope < 0 < end_slope:
        return None
    p, q = (contact.pressure(state) for state in (start, beyond))
    # The tangents meet below the curve.
    meet = (q - end_slope * step.width - p) / (slope - end_slope)
    lowest = p + slope * meet
    if lowest >= account.lowest or min(p, q) - lowest <= _MISSED_SMOOTH_TENSION * abs(lowest):
        return None
    from scipy.interpolate import CubicHermiteSpline  # here, for it takes long to import and no way in needs it

    curve = CubicHermiteSpline([0.0, step.width], [p, q], [slope, end_slope])
    turns = [u for u in curve.derivative().roots(extrapolate=False) if 0 < u < step.width]
    return start.separation + (min(turns, key=curve) if turns else meet)
