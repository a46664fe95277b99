"""Record of a path's progress: counts, reports, and the exceptions that end a path."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from icha.contact.model import BeyondModel, ContactModel, NotConverged, State
from icha.path.stops import (
    InsideJump,
    TargetFunction,
    describe_separation,
)
from icha.path.targets import Target

# Largest number of equilibria in which no target is met and the separation changes by less than the longest step.
_MOST_EQUILIBRIA = 2000

# A path reports an equilibrium between targets if the last report is at least this old, s.
REPORT_AFTER = 20.0


@dataclass(eq=False)
class PathProgress:
    """Progress of a path: count equilibria and targets, report targets, and build the exceptions that the path raises.

    Attributes
    ----------
    contact : contact model.
    total : number of targets of the first loading; messages call these targets stops.
    longest : longest step of the separation, m.
    report : function that is called with each line of a report; None for no reports.
    reached : number of targets of the first loading met so far.
    skipped : errors of the targets that the path cannot meet, such as targets inside jumps.
    progress_from : separation, m; progress means a change from it, up or down, of at least the longest step.
    idle : number of equilibria since the last progress: since the last target, or since `progress_from` was set.
    reported : time of the last report, s.
    """

    contact: ContactModel
    total: int
    longest: float
    report: Callable[[str], None] | None = None
    reached: int = 0
    skipped: list[NotConverged] = field(default_factory=list)
    progress_from: float = np.inf
    idle: int = 0
    reported: float = field(default_factory=time.monotonic)

    def record_equilibrium(self, state: State, loading: bool) -> None:
        """Count an equilibrium, or start from 0 again after progress; raise `NotConverged` if the count is too high.

        If the last report is `REPORT_AFTER` seconds old, report the equilibrium.
        """
        if self.report is not None and time.monotonic() - self.reported >= REPORT_AFTER:
            self.report_position(
                f"{'loading' if loading else 'unloading'}, {self.reached} of {self.total} stops", state
            )
        if abs(state.separation - self.progress_from) >= self.longest:
            self.progress_from, self.idle = state.separation, 0
            return
        if self.idle == _MOST_EQUILIBRIA:
            within = f"{self.longest / self.contact.rms_height:.3g} h_rms"
            reason = f"no progress: {self.idle} equilibria within {within} of separation"
            raise self.make_path_error(state, loading, NotConverged(reason))
        self.idle += 1

    def record_target(self, target: Target, state: State) -> None:
        """Count and report a target that the first loading has met."""
        self.reached, self.idle = self.reached + 1, 0
        self.report_position(f"stop {self.reached} of {self.total}: {target.describe()}", state)

    def report_position(self, name: str, state: State) -> None:
        """Report the separation, the area fraction A/A0, the pressure and the number of spots of a state."""
        if self.report is not None:
            contact, self.reported = self.contact, time.monotonic()
            self.report(
                f"{name}, at {describe_separation(contact, state)}, A/A0 {contact.area_fraction(state):.4e}, "
                f"p {contact.pressure(state):.4g} Pa, {contact.spot_count(state)} spots"
            )

    def require_valid_state(
        self, before: State, after: State, target: TargetFunction | None, pending: list[TargetFunction], loading: bool
    ) -> None:
        """Raise `BeyondModel` if the model is not valid in the state `after`, at the end of a step.

        The contact may give a reason (`ContactModel.reason_beyond`). The contact area must not be larger than
        `contact.largest_area_fraction`. Between targets the mean gap must be positive, unless the model is valid up to
        full contact. At a target the mean gap may be negative, because the range of targets is already limited.

        target : target that the state after the step meets; None if there is no such target.
        before, loading : start and direction of the step. pending : targets not met yet. They serve only the message.
        """
        contact = self.contact
        if reason := contact.reason_beyond(after):
            raise self.make_path_error(before, loading, BeyondModel(reason))
        ahead = target or (pending[0] if pending else None)
        name = ahead.target.describe() if ahead else "separation"
        area = contact.area_fraction(after)
        if area > contact.largest_area_fraction:
            reason = f"the contact area grows to {area:.2f} of the nominal area, outside the range of the model,"
            raise self.make_path_error(before, loading, BeyondModel(f"{reason} before {name}"))
        if target is None and contact.largest_area_fraction < 1 and contact.mean_gap(after) <= 0:
            reason = f"the mean planes meet before {name}, outside the range of the model"
            raise self.make_path_error(after, loading, BeyondModel(reason))

    def make_path_error(self, state: State, loading: bool, *failures: NotConverged) -> NotConverged:
        """Return the exception for a path that cannot continue after a state.

        The message gives position, errors of skipped targets, failures, and on loading whether the surface is sticky.
        The exception is a `BeyondModel` if physics ends the path: if the model is not valid further on, if all failures
        are targets inside jumps, or if adhesion pulls a surface towards full contact and the model ends before.
        """
        contact, failures = self.contact, (*self.skipped, *failures)
        sticky = ""
        # A surface is sticky if adhesion alone has spread the contact, or has prevented the first equilibrium.
        no_equilibrium = contact.spot_count(state) == 0 and not any(isinstance(each, InsideJump) for each in failures)
        if contact.adhesive and loading and (contact.pressure(state) < 0 or no_equilibrium):
            reason = "no equilibrium exists after first contact" if no_equilibrium else "the load is still tensile"
            sticky = f"; {reason}: the surface is sticky, adhesion pulls it towards full contact"
        ends = all(isinstance(each, (InsideJump, BeyondModel)) for each in failures)
        by_physics = ends or (sticky and contact.largest_area_fraction < 1)
        return (BeyondModel if by_physics else NotConverged)(
            f"at {describe_separation(contact, state)}, A/A0 = {contact.area_fraction(state):.3g}, "
            f"after {self.reached} of {self.total} stops: {'; '.join(map(str, failures))}{sticky}"
        )
