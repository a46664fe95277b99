"""Accuracy of the steps of a cyclic path: whether work and largest tension of a step are known well enough."""

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
# Largest integration error of a step without events, relative to the work so far. It may be larger if the work agrees
# with the change of the stored energy.
_CURVED_WORK = 1e-4
# Scale of errors in tension, relative to the energy that jumps have released: the error of the work may be 1e-3 of that
# energy (10 times `_CURVED_WORK`). And its smallest value, relative to the work so far.
_LOSS_SCALE, _LEAST_LOSS = 10.0, 1e-2
# Longest step, relative to the longest step of the path, whose integration error is not examined.
_UNEXAMINED_STEP = 1 / 256
# Largest error of the largest tension at an event, relative to it.
_MISSED_TENSION = 1e-3


@dataclass(eq=False)
class StepAccuracy:
    """Sums over all steps of a path so far, by which the accuracy of a further step is judged.

    Attributes
    ----------
    contact : contact that the path follows.
    longest : longest step of the separation, m.
    total_work : sum of work and losses so far, without their signs, J/m^2.
    jump_energy : energy released by jumps so far, each as if its spot were alone, J/m^2.
    lowest_pressure : lowest nominal pressure so far, at most zero, Pa.
    """

    contact: ContactModel
    longest: float
    total_work: float = 0.0
    jump_energy: float = 0.0
    lowest_pressure: float = 0.0

    def add(self, step: Step, state: State) -> None:
        """Add a step that ends in a state to the sums."""
        self.total_work = self.total_work_after(step)
        self.jump_energy += step.jump_energy(self.contact)
        self.lowest_pressure = min(self.lowest_pressure, self.contact.pressure(state))

    def total_work_after(self, step: Step) -> float:
        """Return the value of `total_work` after one more step, J/m^2."""
        return self.total_work + (abs(step.work) + abs(step.loss))

    def allows_twice_the_length(self, step: Step) -> bool:
        """Return whether a step of twice the length would be accurate: its error would be eight times as large."""
        return 8 * step.unknown_work <= self.allowed_unknown_work(step)

    def is_work_known(self, state, step):
        """Return whether the work of a step that ends in a state is known well enough.

        It is not in three cases. The events of the step, which may happen anywhere in it, make the work too uncertain.
        Spots unite or split in a long step. Or, in a step without events, the integral of the pressure is inaccurate
        and differs from the change of the stored energy. Steps up to 1/256 of the longest step are not examined for
        this last case.
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
            # In compression loading and unloading visit the same stations, so that their errors cancel. In tension
            # they do not: the error is relative to the losses.
            scale = min(total_work, max(_LOSS_SCALE * self.jump_energy, _LEAST_LOSS * total_work))
        unbalanced = step.integration_error > _CURVED_WORK * scale and abs(step.loss) > accuracy.balance * scale
        return step.has_jump or not unbalanced or length <= _UNEXAMINED_STEP * self.longest

    def allowed_unknown_work(self, step):
        """Return the largest uncertainty that the events of a step may give its work, J/m^2."""
        total_work, accuracy = self.total_work_after(step), self.contact.path_accuracy
        if accuracy.predicts_steps:
            return accuracy.loss * max(total_work, accuracy.least_work)
        released = UNRESOLVED_LOSS * (self.jump_energy + step.jump_energy(self.contact))
        return max(released, accuracy.loss * total_work) if released else UNRESOLVED_WORK * total_work

    def is_tension_known(self, start, state, step):
        """Return whether the largest tension of a step between two states is known well enough.

        It is not if the tension may have been larger just before an event.
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

        Return None if the tension has no maximum there, if it was larger earlier on the path, or if it is as large at
        one of the states to the required accuracy.
        """
        contact = self.contact
        slope, end_slope = (-contact.stiffness(each) for each in (start, state))
        # Full contact is infinitely stiff, and its largest tension, at which it opens, is a state of the path.
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
    """Return the lowest stationary point of the cubic with these values and slopes at 0 and `length`; None if none."""
    # The import takes long, and loading does not need it.
    from scipy.interpolate import CubicHermiteSpline

    curve = CubicHermiteSpline([0.0, length], values, slopes)
    stationary = [u for u in curve.derivative().roots(extrapolate=False) if 0 < u < length]
    return min(stationary, key=curve, default=None)
