"""Accuracy of the steps of a cyclic path: checks whether work and largest tension of a step are known accurately."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from icha.contact.model import ContactModel, State
from icha.path.energy_balance import Step
from icha.path.targets import EVENT_ERROR_OVER_LOSS

# Largest error of the work by the events of a step, relative to `energy_scale`, while all reference losses are zero.
EVENT_ERROR_OVER_WORK = 2e-4
# Longest step in which spots may coalesce or split, relative to the longest step of the path.
UNION_STEP = 1 / 16
# Largest integration error of a step without events, relative to the energy scale. A larger error is allowed if the
# work agrees with the change of the stored energy.
_INTEGRATION_ERROR = 1e-4
# On unloading in tension, integration errors are relative to _LOSS_SCALE times the reference losses so far, but at
# least to _LEAST_LOSS times the energy scale.
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
    contact : contact model.
    longest : longest step of the separation, m.
    energy_scale : sum of the absolute values of work and loss of all steps so far, J/m^2; errors are relative to it.
    reference_loss : sum of `Step.reference_loss` of all steps so far, J/m^2.
    lowest_pressure : lowest nominal pressure so far, Pa; zero if the pressure was never negative.
    """

    contact: ContactModel
    longest: float
    energy_scale: float = 0.0
    reference_loss: float = 0.0
    lowest_pressure: float = 0.0

    def add(self, step: Step, state: State) -> None:
        """Add a step, and the state at its end, to the sums."""
        self.energy_scale = self.energy_scale_after(step)
        self.reference_loss += step.reference_loss(self.contact)
        self.lowest_pressure = min(self.lowest_pressure, self.contact.pressure(state))

    def energy_scale_after(self, step: Step) -> float:
        """Return the value of `energy_scale` after one more step, J/m^2."""
        return self.energy_scale + (abs(step.work) + abs(step.loss))

    def is_work_known(self, state, step):
        """Return whether the work of a step that ends in a state is known accurately enough.

        With error-controlled steps, `Step.work_error` must be small enough. Other steps are inaccurate in three cases.
        First, `Step.event_error` is too large. Second, spots unite or split in a long step. Third, in a step without
        events that may change the pressure, the integral of the pressure is inaccurate and differs from the change of
        the stored energy. The limits of the third case are smaller on unloading in tension. The third case is not
        checked for steps up to 1/256 of the longest step.
        """
        if self.contact.path_accuracy.error_controlled_steps:
            return step.work_error <= self.allowed_work_error(step)
        length = abs(step.separation_change)
        if step.event_error > self.allowed_work_error(step):
            return False
        # The union of two spots depends on how far they overlap when it is found.
        if step.unites_or_splits and length > UNION_STEP * self.longest:
            return False
        accuracy = self.contact.path_accuracy
        scale = energy_scale = self.energy_scale_after(step)
        if step.separation_change > 0 and self.contact.pressure(state) < 0:
            # In compression, loading and unloading visit the same separations, so their errors cancel. In tension
            # these errors do not cancel, so that they must be small relative to the losses.
            scale = min(energy_scale, max(_LOSS_SCALE * self.reference_loss, _LEAST_LOSS * energy_scale))
        unbalanced = step.integration_error > _INTEGRATION_ERROR * scale and abs(step.loss) > accuracy.balance * scale
        return step.may_change_pressure or not unbalanced or length <= _UNEXAMINED_STEP * self.longest

    def allowed_work_error(self, step):
        """Return the largest allowed value of `work_error` or `event_error` of a step, J/m^2.

        With error-controlled steps, it is `path_accuracy.loss` times the larger of the energy scale after the step and
        `path_accuracy.least_work`. Otherwise, if the path including this step has reference losses, it is the larger of
        EVENT_ERROR_OVER_LOSS times these losses and `path_accuracy.loss` times the energy scale after the step. Without
        reference losses, it is EVENT_ERROR_OVER_WORK times this energy scale.
        """
        energy_scale, accuracy = self.energy_scale_after(step), self.contact.path_accuracy
        if accuracy.error_controlled_steps:
            return accuracy.loss * max(energy_scale, accuracy.least_work)
        by_losses = EVENT_ERROR_OVER_LOSS * (self.reference_loss + step.reference_loss(self.contact))
        return max(by_losses, accuracy.loss * energy_scale) if by_losses else EVENT_ERROR_OVER_WORK * energy_scale

    def is_tension_known(self, start, state, step):
        """Return False if the tension inside a step may be larger than in any state of the path so far.

        A larger tension is only possible on unloading with events that may change the pressure: the tension just before
        the event may be as large as the tangent at the start. It may exceed the larger tension of both states by a
        fraction of _MISSED_TENSION. With adhesion also return False if the last contact breaks in the step.
        """
        contact = self.contact
        if step.separation_change < 0 or not step.may_change_pressure:
            return True
        if contact.adhesive and contact.spot_count(start) and not contact.spot_count(state):
            return False  # This event must be located as exactly as possible.
        p, slope = contact.pressure(start), -contact.stiffness(start)
        lowest, known = min(p, p + step.separation_change * slope), min(p, contact.pressure(state))
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
