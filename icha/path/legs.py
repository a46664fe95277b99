"""Legs of a path: the equilibria of loading and unloading, from target to target or to complete separation.

On unloading every spot follows its stable branch until it jumps off. Unloading ends at complete separation or at a
turning point. If a target is expected within the next step, the solver first looks directly for the state at this
target. On a path with unloading, or with tensions as targets, all equilibria are recorded instead: a step is halved
until its work is known (see `step_accuracy`). Stations are separations of a loading that all later legs visit again.
The curves of the legs can then be compared, and without adhesion the errors of the integration cancel.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Generator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from operator import itemgetter

import numpy as np

from icha.contact.model import BeyondModel, ContactModel, NotConverged, State
from icha.path.energy_balance import Step, Waypoint, waypoint_between_targets
from icha.path.progress import PathProgress
from icha.path.step_accuracy import StepAccuracy
from icha.path.stops import (
    CLOSE_TO_A_JUMP,
    SAME_SEPARATION,
    InsideJump,
    TargetFunction,
    find_first_target,
    next_of_each_kind,
    sort_targets,
)
from icha.path.targets import LOADS, UNITS, Path
from icha.support.formatting import format_quantity

# Distance of the last station above first contact, in h_rms, without adhesion. Exactly at first contact, a spot may
# remain in contact because of the error of the equilibrium.
_ABOVE_CONTACT = 1e-8
# Shortest step after halvings of a failed step, relative to the longest step.
_SMALLEST_STEP = 2.0**-14


def follow_legs(
    contact: ContactModel, path: Path, longest: float, progress: PathProgress, energies: bool
) -> Generator[Waypoint, TargetFunction | None, None]:
    """Follow all legs of a path, and yield a waypoint for each equilibrium.

    After each waypoint the caller may send one additional target for the next step (`generator.send`). If the step
    meets this target first, the generator yields the waypoint at this target. Sent targets inside jumps are
    ignored. So are targets sent up to first contact, after the last waypoint of a leg, or at a state from which the
    branch leads back to a target. The waypoints have no energy balances. Raise the errors of `icha.path.follow.follow`.

    longest : longest step of the separation, m.
    progress : record of the path's progress; it counts and reports the targets.
    energies : whether work and largest tension of every step must be known accurately.
    """
    start, targets = contact.untouched(), [TargetFunction.on_loading(target, contact) for target in path.targets]
    # Targets at separations above first contact, where nothing touches.
    above = [t for t in targets if t.control is None and t.separation > start.separation]
    for each in sort_targets(above, -1):
        state = contact.equilibrium(start, each.separation)
        targets.remove(each)
        progress.record_target(each.target, state)
        yield Waypoint(each.target, state, 0)
    yield waypoint_between_targets(start, 0)
    legs = _Legs(contact, longest, progress, start, StepAccuracy(contact, longest), energies)
    if not contact.adhesive:
        legs.stations = [start.separation + _ABOVE_CONTACT * contact.rms_height]
    yield from legs.follow_leg(0, targets)
    if progress.skipped:
        raise legs.make_path_error()
    for leg, turn in enumerate(path.turning_points, start=1):
        target = TargetFunction(turn, contact) if leg % 2 else TargetFunction.on_loading(turn, contact)
        if (target.excess(legs.state) > 0) != (leg % 2 == 1):
            legs.leg, name = leg, "unloading" if leg % 2 else "loading"
            reason = f"leg {leg} ({name}) already starts beyond its turning point {turn.describe()}"
            raise legs.make_path_error(NotConverged(reason))
        yield from legs.follow_leg(leg, [target])
        progress.report_position(f"turning point {turn.describe()}", legs.state)
    if path.unload:
        leg = len(path.turning_points) + (len(path.turning_points) % 2 == 0)
        saved = {(target.kind, target.value): target for target in path.unloading_snapshots}
        again = {(target.kind, target.value): replace(target, snapshot=False) for target in path.targets}
        targets = [TargetFunction(target, contact) for target in (again | saved).values()]
        pending = [target for target in targets if target.excess(legs.state) > target.tolerance]
        yield from legs.follow_leg(leg, pending, until_apart=True)
        progress.report_position("apart", legs.state)


@dataclass(eq=False)
class _Legs:
    """Position on a path, and the ends of the next steps.

    Attributes
    ----------
    contact : contact model.
    longest : longest step of the separation, m.
    progress : record of the path's progress.
    state : last equilibrium.
    accuracy : sums over all steps so far, and the accuracy that further steps need.
    energies : whether work and largest tension of every step must be known accurately.
    leg : number of the leg, even on loading and odd on unloading.
    ahead : ends of steps that were too long and were divided, the nearest last: the separation, m, and the equilibrium
        found there, or None.
    event_at : `direction` times separation, m, where the shortest trial step with the next event ended; or inf.
    stations : separations of a loading that all later legs, in both directions, visit again, ascending, m.
    """

    contact: ContactModel
    longest: float
    progress: PathProgress
    state: State
    accuracy: StepAccuracy
    energies: bool
    leg: int = 0
    ahead: list[tuple[float, State | None]] = field(default_factory=list)
    event_at: float = np.inf
    stations: list[float] = field(default_factory=list)

    @property
    def loading(self) -> bool:
        """True if the surfaces approach each other."""
        return self.leg % 2 == 0

    @property
    def event_length(self) -> float:
        """Longest step in which an event counts as located, m: `path_accuracy.event` times h_rms."""
        return self.contact.path_accuracy.event * self.contact.rms_height

    @property
    def direction(self) -> int:
        """Sign of the change of the separation: -1 on loading, 1 on unloading."""
        return -1 if self.loading else 1

    def make_path_error(self, *failures: NotConverged) -> NotConverged:
        """Return the exception for a path that cannot continue after the present state."""
        return self.progress.make_path_error(self.state, self.loading, *failures)

    def follow_leg(
        self, leg: int, targets: list[TargetFunction], until_apart: bool = False
    ) -> Generator[Waypoint, TargetFunction | None, None]:
        """Follow one leg to all its targets or, with `until_apart`, to complete separation; yield all waypoints.

        A target inside a jump is kept in `progress.skipped` in leg 0, raises an error in later legs, and is left out
        with `until_apart`. So is a tension that loading has not reached when the load becomes positive. Raise
        `BeyondModel` if the surfaces separate before the last target. At the end of loading,
        separations that are far apart (`_is_new_station`) become stations; on reloading, only those below all others.
        """
        self.leg, self.event_at = leg, np.inf
        # At first contact, adhesion pulls the first summit into contact at once.
        first_jump = self.energies and self.contact.adhesive and leg == 0
        self.ahead = [(self.state.separation - self.event_length, None)] if first_jump else []
        pending, sent = sort_targets(targets, self.direction), None
        visited = [self.state.separation]
        while pending or until_apart:
            if not self.loading and self._is_apart():
                if until_apart:
                    return
                raise self.make_path_error(self._make_apart_error(pending[0]))
            candidates = next_of_each_kind(pending) + ([sent] if sent else [])
            state, step = self.find_next_equilibrium(candidates)
            try:
                target, met = find_first_target(candidates, self.state, state, self.direction)
            except InsideJump as jump:
                self.ahead.append((state.separation, state))
                if jump.target is sent:
                    sent = None
                    continue
                pending.remove(jump.target)
                if not until_apart:
                    self.progress.skipped.append(jump)
                    if leg:
                        raise self.make_path_error() from None
                continue
            except NotConverged as failure:
                self.ahead.append((state.separation, state))
                self._halve_failed_step(abs(step.separation_change), failure)
                continue
            if met is not state:
                if self.direction * (met.separation - self.state.separation) < 0:
                    # The branch after a jump leads back to the target. A target that is sent here is ignored.
                    yield self._advance(step, state)
                else:
                    self.ahead.append((state.separation, state))
                step = Step.between(self.contact, self.state, met)
            listed = None if target is sent else target
            self.progress.require_valid_state(self.state, met, listed, pending, self.loading)
            between = self._advance(step, met)
            if self._is_new_station(met.separation, visited[-1]):
                visited.append(met.separation)
            if listed is not None:
                pending.remove(listed)
                if leg == 0:
                    self.progress.record_target(listed.target, met)
            if self.contact.pressure(met) >= 0:
                for missed in [each for each in pending if each.rises and each.excess(met) > 0]:
                    pending.remove(missed)
                    self.progress.skipped.append(self._make_missed_error(missed))
                    if leg:
                        raise self.make_path_error()
            sent = yield between if target is None else Waypoint(target.target, met, leg, step)
        if self.loading:
            lowest = min(self.stations, default=np.inf)
            self.stations = sorted({*self.stations, *(at for at in [*visited, self.state.separation] if at < lowest)})

    def _advance(self, step, state):
        """Move to the end of a step, update `accuracy`, `progress` and `ahead`, and return the waypoint."""
        self.accuracy.add(step, state)
        self.progress.record_equilibrium(state, self.loading)
        self.state = state
        if step.may_change_pressure:
            self.event_at = np.inf
        self.ahead = [end for end in self.ahead if self.direction * (end[0] - state.separation) > 0]
        return waypoint_between_targets(state, self.leg, step)

    def find_next_equilibrium(self, targets: list[TargetFunction]) -> tuple[State, Step]:
        """Find the next equilibrium by a step that is short enough; return the equilibrium and the step.

        The first step goes to the next station, or is as long as possible. It is halved until the solver finds an
        equilibrium. With `energies`, it is also halved until work and largest tension of the step are known accurately
        enough, or the step is at most `event_length` long. If the tension has a new maximum within an accurate step,
        the step ends at the maximum. The ends of divided steps are kept in `ahead`, and are the ends of the following
        steps. Without `energies`, the step ends at one of the next `targets` if the solver finds this state directly.
        """
        start, accuracy = self.state, self.accuracy
        while True:
            end, known = self.ahead.pop() if self.ahead else (self._farthest_end(), None)
            length = abs(end - start.separation)
            if not self.energies and (state := self._find_target_directly(targets, length)):
                return state, Step.between(self.contact, start, state)
            try:
                found = None if known is None else self.contact.continue_from(known, start)
                state = found or self._find_equilibrium(end, length)
            except NotConverged as failure:
                self._halve_failed_step(length, failure)
                continue
            step, middle = Step.between(self.contact, start, state), 0.5 * (start.separation + end)
            if not self.energies:
                return state, step
            located = length <= self.event_length or (step.may_change_pressure and self._has_passed_event())
            if located or (accuracy.is_work_known(step) and accuracy.is_tension_known(start, state, step)):
                if found is not None and accuracy.loses_energy(step):
                    # The present state may lead to another equilibrium, so solve again.
                    self.ahead.append((end, None))
                    continue
                tension_peak = None if located else accuracy.locate_largest_tension(start, state, step)
                if tension_peak is None:
                    return state, step
                middle = tension_peak
            elif step.may_change_pressure:
                self.event_at = min(self.event_at, self.direction * end)
            self.ahead += [(end, state), (middle, None)]

    def _find_target_directly(self, targets, length):
        """Find the state at the target that is expected first within a step of a given length, m; None if it fails.

        If each load has only one equilibrium, the target may be at any distance.
        """
        contact, start = self.contact, self.state
        expected, target = max(((each.predict_separation(start), each) for each in targets), key=itemgetter(0))
        reach = np.inf if contact.is_unique else length
        if start.separation - expected > reach:
            return None
        try:
            found = target.solve(start, expected)
        except NotConverged:
            return None
        same = SAME_SEPARATION * contact.rms_height
        outside = target.control and not start.separation - reach <= found.separation <= start.separation + same
        passed = any(other.excess(found) > other.tolerance for other in targets if other is not target)
        return None if outside or passed else found

    def _has_passed_event(self):
        """Return whether the next event was found in a longer step that ended at or before the present separation.

        Equilibria have errors, so the event may not happen in a shorter step. It cannot be located more accurately.
        """
        return self.direction * self.state.separation + self.event_length >= self.event_at

    def _halve_failed_step(self, length, failure):
        """Let the next step be half as long as a failed step of a given length, m; raise if that is too short."""
        if length / 2 < _SMALLEST_STEP * self.longest:
            raise self.make_path_error(failure) from failure
        self.ahead.append((self.state.separation + self.direction * length / 2, None))

    def _find_equilibrium(self, separation, length):
        """Find the equilibrium at a separation, m, at the end of a step of a given length, m.

        On unloading with adhesion, the spots together may lose their equilibrium before any single spot has reached its
        own jump-off. If this happens in a step shorter than `CLOSE_TO_A_JUMP` * h_rms, the spot closest to jump-off is
        made to break contact. If there is still no equilibrium, more spots are made to break contact: first two, then
        four, and so on, up to all spots.
        On unloading, an unstable equilibrium counts as no equilibrium, unless spots were made to break contact. Raise
        the first `NotConverged` if there is no equilibrium.
        """
        contact, start = self.contact, self.state
        try:
            state = contact.equilibrium(start, separation)
            if separation > start.separation and contact.is_unstable(state):
                raise NotConverged("spots would approach as the surfaces move apart: the equilibrium is unstable")
            return state
        except NotConverged as failure:
            first = failure
        if not self.loading and contact.adhesive and length < CLOSE_TO_A_JUMP * contact.rms_height:
            spots = contact.spot_count(start)
            for k in range(spots.bit_length() + 1 if spots else 0):
                with suppress(NotConverged):
                    return contact.equilibrium(start, separation, let_go=min(2**k, spots))
        raise first

    def _is_apart(self):
        """Return whether there are no spots and the separation is at least the separation of first contact."""
        if self.contact.spot_count(self.state):
            return False
        highest = self.contact.untouched().separation - SAME_SEPARATION * self.contact.rms_height
        return self.state.separation >= highest

    def _is_new_station(self, separation, last_kept):
        """Return whether a separation, m, is far enough from `last_kept`, the last one kept, to become a station.

        With adhesion, the least distance is 1/64 of the longest step, because there are many short steps around events.
        """
        contact = self.contact
        between = self.longest / 64 if contact.adhesive else SAME_SEPARATION * contact.rms_height
        return abs(separation - last_kept) > between

    def _farthest_end(self):
        """Return the end of the longest possible step, m: the next station of the leg, if there is one."""
        at, same, stations = self.state.separation, SAME_SEPARATION * self.contact.rms_height, self.stations
        k = bisect_left(stations, at - same) - 1 if self.loading else bisect_right(stations, at + same)
        return stations[k] if 0 <= k < len(stations) else at + self.direction * self.longest

    def _make_apart_error(self, target):
        """Return the exception for a path on which the surfaces separate before a turning point."""
        reason = f"the surfaces are apart before the turning point {target.target.describe()}"
        return BeyondModel(f"{reason}{self._describe_tension(target)}")

    def _make_missed_error(self, target):
        """Return the exception for a tension that loading does not reach."""
        reason = f"loading does not reach the tension {target.target.describe()}{self._describe_tension(target)}"
        return BeyondModel(f"{reason}. Larger tensions need unloading: `unload: true`, or `turning_points`")

    def _describe_tension(self, target):
        """Return the largest tension so far, in the unit of a target, as text; empty if the target is not a load."""
        if target.target.kind not in LOADS:
            return ""
        tension = max(0.0, -self.accuracy.lowest_pressure / target.target.quantity.scale(self.contact))
        unit = UNITS.get(target.target.kind)
        return f"; the largest tension is {format_quantity(tension, unit) if unit else f'{tension:.4g}'}"
