"""Accuracy of the steps of a cyclic path: checks whether work and largest tension of a step are known accurately."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from icha.contact.model import ContactModel, State
from icha.path.energy_balance import Step

# Largest error of the work of a step, relative to the energy that jumps have released so far.
ERROR_OVER_RELEASED = 2e-4
# Longest step in which spots may coalesce or split, relative to the longest step of the path. A union depends on how
# far its spots overlap when it is found.
UNION_STEP = 1 / 16
# Largest relative error of the largest tension at an event.
_MISSED_TENSION = 1e-3


@dataclass(eq=False)
class StepAccuracy:
    """Sums over all steps of a path so far, and checks whether the next step is accurate compared with these sums.

    Attributes
    ----------
    contact : contact model.
    longest : longest step of the separation, m.
    work : sum of the absolute values of work and loss of all steps so far, J/m^2.
    released : sum of `Step.released` of all steps so far, J/m^2.
    lowest_pressure : lowest nominal pressure so far, Pa; zero if the pressure was never negative.
    """

    contact: ContactModel
    longest: float
    work: float = 0.0
    released: float = 0.0
    lowest_pressure: float = 0.0

    def add(self, step: Step, state: State) -> None:
        """Add a step, and the state at its end, to the sums."""
        self.work += abs(step.work) + abs(step.loss)
        self.released += step.released
        self.lowest_pressure = min(self.lowest_pressure, self.contact.pressure(state))

    def allowed_error(self, step: Step) -> float:
        """Return the largest allowed error of the work of a step, J/m^2.

        It is the larger of ERROR_OVER_RELEASED times the energy that jumps of spots have released, and
        `path_accuracy.work` times the work and losses, both of the path including this step.
        """
        accuracy = self.contact.path_accuracy
        relative = accuracy.work if self.contact.adhesive else accuracy.reversible_work
        allowed = relative * (self.work + abs(step.work) + abs(step.loss))
        released = self.released + step.released
        return max(allowed, ERROR_OVER_RELEASED * released)

    def is_work_known(self, step: Step) -> bool:
        """Return whether the work of a step is known accurately enough."""
        if step.unites_or_splits and abs(step.separation_change) > UNION_STEP * self.longest:
            return False
        return step.work_error <= self.allowed_error(step)

    def loses_energy(self, step: Step) -> bool:
        """Return whether the loss of a step is larger than the allowed error of its work."""
        return abs(step.loss) > self.allowed_error(step)

    def is_tension_known(self, start, state, step):
        """Return False if the tension inside a step may be larger than in any state of the path so far.

        On unloading, the pressure may rise in a jump at the end of the step. With events that may change the pressure,
        its slope up to the jump is that at the start, otherwise the mean slope of both ends. The tension may then
        exceed the larger tension of both states by a fraction of _MISSED_TENSION. With adhesion also return False if
        the last contact breaks in the step.
        """
        contact, du = self.contact, step.separation_change
        if du < 0:
            return True
        if contact.adhesive and contact.spot_count(start) and not contact.spot_count(state):
            return False  # This event must be located as exactly as possible.
        slope, end_slope = (-contact.stiffness(each) for each in (start, state))
        # Full contact is infinitely stiff. Its tension is largest when the first gap opens, in a state of the path.
        if not np.isfinite(slope + end_slope):
            return True
        p, slope = contact.pressure(start), slope if step.may_change_pressure else 0.5 * (slope + end_slope)
        lowest, known = min(p, p + du * slope), min(p, contact.pressure(state))
        return lowest >= self.lowest_pressure or known - lowest <= _MISSED_TENSION * abs(lowest)

    def locate_largest_tension(self, start, state, step):
        """Return the separation at which the tension is largest between two states, m, or None.

        The separation is at the minimum of the cubic polynomial with the pressures and slopes of both states. The
        tension is estimated by this minimum, or by the point where the tangents at both states meet if that is lower;
        if the pressure jumps without an event, the tangents meet outside the step.
        Return None on loading, from or to full contact, with events that may change the pressure, or if the tension has
        no maximum between the states. Also return None if the tension was larger earlier on the path, or if the tension
        in one of the two states equals the estimate within the required accuracy.
        """
        contact, du = self.contact, step.separation_change
        slope, end_slope = (-contact.stiffness(each) for each in (start, state))
        # Full contact is infinitely stiff. Its tension is largest when the first gap opens, in a state of the path.
        if du < 0 or step.may_change_pressure or not -np.inf < slope < 0 < end_slope:
            return None
        p, q = (contact.pressure(each) for each in (start, state))
        # The cubic is p + s t + b t^2 + a t^3/3 with 0 < t < 1. Its slope has one zero with a change from - to +.
        s, e = slope * du, end_slope * du
        a, b = 3 * (s + e - 2 * (q - p)), 3 * (q - p) - 2 * s - e
        t = -s / (b + np.sqrt(b * b - a * s))
        # The tangents of both states meet at a larger tension, unless the pressure has jumped.
        meet = (q - e - p) / (slope - end_slope)
        lowest = p + min(slope * meet, t * (s + t * (b + t * a / 3)))
        if lowest >= self.lowest_pressure or min(p, q) - lowest <= contact.path_accuracy.tension * abs(lowest):
            return None
        return start.separation + t * du
