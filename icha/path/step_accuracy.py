"""Accuracy of the steps of a cyclic path: checks whether work and largest tension of a step are known accurately."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from icha.contact.model import ContactModel, State
from icha.path.energy_balance import Step
from icha.path.targets import UNRESOLVED_LOSS

# Largest uncertainty of the work of a step if jumps have released no energy, relative to the work so far.
UNRESOLVED_WORK = 2e-4
# Longest step in which spots may coalesce or split, relative to the longest step of the path.
UNION_STEP = 1 / 16
# Largest integration error of a step without events, relative to the work so far. A larger error is allowed if the work
# agrees with the change of the stored energy.
_CURVED_WORK = 1e-4
# On unloading in tension, errors of the work are relative to _LOSS_SCALE times the energy that jumps have released, but
# at least to _LEAST_LOSS times the work so far.
_LOSS_SCALE, _LEAST_LOSS = 10.0, 1e-2
# Steps up to this fraction of the longest step of the path are accepted without a check of the integration error.
_UNEXAMINED_STEP = 1 / 256
# Largest relative error of the largest tension at an event.
_MISSED_TENSION = 1e-3


@dataclass(eq=False)
class StepAccuracy:
    """Sums over all steps of a path so far, and checks whether the next step is accurate compared with these sums.

    Attributes
    ----------
    contact : contact that the path follows.
    longest : longest step of the separation, m.
    total_work : sum of the absolute values of work and loss of all steps so far, J/m^2.
    jump_energy : energy released by all jumps so far, computed as if every spot were alone, J/m^2.
    lowest_pressure : lowest nominal pressure so far, Pa; zero if the pressure was never negative.
    """

    contact: ContactModel
    longest: float
    total_work: float = 0.0
    jump_energy: float = 0.0
    lowest_pressure: float = 0.0

    def add(self, step: Step, state: State) -> None:
        """Add a step, and the state at its end, to the sums."""
        self.total_work = self.total_work_after(step)
        self.jump_energy += step.jump_energy(self.contact)
        self.lowest_pressure = min(self.lowest_pressure, self.contact.pressure(state))

    def total_work_after(self, step: Step) -> float:
        """Return the value of `total_work` after one more step, J/m^2."""
        return self.total_work + (abs(step.work) + abs(step.loss))

    def allows_twice_the_length(self, step: Step) -> bool:
        """Return whether the work of a step of twice the length, with eight times the error, would be accurate."""
        return 8 * step.unknown_work <= self.allowed_unknown_work(step)

    def is_work_known(self, state, step):
        """Return whether the work of a step that ends in a state is known accurately enough.

        If the model predicts steps, `Step.unknown_work` must be small enough. With other models the work is not known
        in three cases. First, events make the work too uncertain, because they may happen anywhere in the step. Second,
        spots unite or split in a long step. Third, in a step without events the integral of the pressure is inaccurate
        and differs from the change of the stored energy. The third case is not checked for steps up to 1/256 of the
        longest step.
        """
        if self.contact.path_accuracy.predicts_steps:
            return step.unknown_work <= self.allowed_unknown_work(step)
        length = abs(step.separation_change)
        if step.unresolved > self.allowed_unknown_work(step):
            return False
        # The union of two spots depends on how far they overlap when it is found.
        if step.has_union and length > UNION_STEP * self.longest:
            return False
        accuracy = self.contact.path_accuracy
        scale = total_work = self.total_work_after(step)
        if step.separation_change > 0 and self.contact.pressure(state) < 0:
            # In compression, loading and unloading visit the same stations, so that their errors cancel. In tension
            # these errors do not cancel, so that they must be small relative to the losses.
            scale = min(total_work, max(_LOSS_SCALE * self.jump_energy, _LEAST_LOSS * total_work))
        unbalanced = step.integration_error > _CURVED_WORK * scale and abs(step.loss) > accuracy.balance * scale
        return step.has_jump or not unbalanced or length <= _UNEXAMINED_STEP * self.longest

    def allowed_unknown_work(self, step):
        """Return the largest allowed uncertainty of the work of a step, J/m^2."""
        total_work, accuracy = self.total_work_after(step), self.contact.path_accuracy
        if accuracy.predicts_steps:
            return accuracy.loss * max(total_work, accuracy.least_work)
        released = UNRESOLVED_LOSS * (self.jump_energy + step.jump_energy(self.contact))
        return max(released, accuracy.loss * total_work) if released else UNRESOLVED_WORK * total_work

    def is_tension_known(self, start, state, step):
        """Return whether the largest tension of a step between two states is known accurately enough.

        The largest tension is not known if the tension just before an event may have been larger than in both states.
        """
        contact = self.contact
        if step.separation_change < 0 or not step.has_jump:
            return True
        if contact.adhesive and contact.spot_count(start) and not contact.spot_count(state):
            return False  # the last contact breaks, and this event must be found as exactly as possible
        # The pressure may have decreased along its tangent up to the event.
        p, slope = contact.pressure(start), -contact.stiffness(start)
        lowest, found = min(p, p + step.separation_change * slope), min(p, contact.pressure(state))
        return lowest >= self.lowest_pressure or found - lowest <= _MISSED_TENSION * abs(lowest)

    def locate_largest_tension(self, start, state, step):
        """Return the separation at which the tension is largest between two states without an event, m.

        Return None if the tension has no maximum between the states, if the tension was larger earlier on the path, or
        if the tension in one of the two states equals the maximum within the required accuracy.
        """
        contact = self.contact
        slope, end_slope = (-contact.stiffness(each) for each in (start, state))
        # Full contact is infinitely stiff. Its tension is largest when the first gap opens, in a state of the path.
        if step.separation_change < 0 or step.has_jump or not -np.inf < slope < 0 < end_slope:
            return None
        p, q = (contact.pressure(each) for each in (start, state))
        # The tangents meet below the curve.
        meet = (q - end_slope * step.separation_change - p) / (slope - end_slope)
        lowest = p + slope * meet
        if lowest >= self.lowest_pressure or min(p, q) - lowest <= contact.path_accuracy.tension * abs(lowest):
            return None
        lowest_at = _minimum_of_cubic(step.separation_change, (p, q), (slope, end_slope))
        return start.separation + (meet if lowest_at is None else lowest_at)


def _minimum_of_cubic(length, values, slopes):
    """Return the lowest stationary point of the cubic with given values and slopes at 0 and `length`, or None."""
    # The import takes long, and loading does not need it.
    from scipy.interpolate import CubicHermiteSpline

    curve = CubicHermiteSpline([0.0, length], values, slopes)
    stationary = [u for u in curve.derivative().roots(extrapolate=False) if 0 < u < length]
    return min(stationary, key=curve, default=None)
