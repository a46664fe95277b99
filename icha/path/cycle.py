"""Loading and unloading: every equilibrium of a path that goes on after the first loading.

The way back follows the stable branch of every spot until it jumps off, up to complete separation or to a turning
point. It stops at the separations of the way in, so that both can be compared; where an event changes the pressure the
steps become short enough that the work lost in it is known, whatever the longest step.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Generator
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from icha.contact.model import ContactModel, NotConverged, State
from icha.path.energy_balance import Step, Waypoint, between_stops
from icha.path.loading import Course, halved
from icha.path.stops import CLOSE_TO_A_JUMP, SAME_EXCESS, SAME_SEPARATION, InsideJump, Queue, Stop, first_passed
from icha.path.targets import LOADS, MEAN_SEPARATION, UNRESOLVED_LOSS, Path

# Where nothing jumps, the part of the work so far that may be unknown after a step.
UNRESOLVED_WORK = 2e-4
# Unions and their undoing are found within this part of the longest step.
UNITING_STEP = 1 / 16
# Of the work so far, the part by which the pressure's curvature may matter in a step without events, unless work and
# energy agree.
_CURVED_WORK = 1e-4
# A loss that is less than this part of the work is known no better than one that is as large.
_LEAST_LOSS = 1e-2
# Of the largest tension so far, the part by which it may be missed at an event.
_MISSED_TENSION = 1e-3


@dataclass(frozen=True)
class Stride:
    """Length of the next step, and what limits it.

    Attributes
    ----------
    length : largest length of the next step, m.
    event_at : where, along the leg, events were found that are not resolved yet, m.
    event_width : length of a step that resolves these events, m.
    smooth : length of steps without events, m.
    """

    length: float
    event_at: float = np.inf
    event_width: float = 0.0
    smooth: float = 0.0


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
    unit, sharp = contact.rms_height, contact.path_accuracy.event * contact.rms_height
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
        passed = step.sudden and direction * start.separation + sharp >= stride.event_at
        if width <= sharp or passed:
            return beyond, step, settled
        work_known = _is_work_known(contact, beyond, step, account, longest)
        if work_known and _is_tension_known(contact, start, beyond, step, account):
            weakest = _largest_tension(contact, start, beyond, step, account)
            if weakest is None:
                return beyond, step, settled
            stride, width = settled, weakest - start.separation
        else:
            if step.sudden:
                resolved_width = 0.5 * width * min(1.0, _unknown_work(contact, step, account) / step.unresolved)
                event_at = min(stride.event_at, direction * beyond.separation)
                stride = replace(stride, event_at=event_at, event_width=resolved_width)
            else:
                stride = replace(stride, smooth=min(stride.smooth, 0.5 * width))
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
    if step.unresolved > _unknown_work(contact, step, account):
        return False
    # What a union makes of two spots depends on how far they overlap when it is found.
    if step.unites and abs(step.width) > UNITING_STEP * longest:
        return False
    accuracy = contact.path_accuracy
    scale = effort = account.effort + abs(step.work) + abs(step.lost)
    if step.width > 0 and contact.pressure(beyond) < 0:
        # There is no way in here that has the same error.
        scale = min(effort, max(10 * account.jumped, _LEAST_LOSS * effort))
    unbalanced = step.integration_error > _CURVED_WORK * scale and abs(step.lost) > accuracy.balance * scale
    return step.sudden or not unbalanced or abs(step.width) <= longest / 256


def _unknown_work(contact, step, account):
    """Work that the events of a step may leave unknown, J/m^2."""
    effort = account.effort + abs(step.work) + abs(step.lost)
    jumped = UNRESOLVED_LOSS * (account.jumped + step.set_free(contact))
    return max(jumped, contact.path_accuracy.loss * effort) if jumped else UNRESOLVED_WORK * effort


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
    if lowest >= account.lowest or min(p, q) - lowest <= contact.path_accuracy.tension * abs(lowest):
        return None
    from scipy.interpolate import CubicHermiteSpline  # here, for it takes long to import and no way in needs it

    curve = CubicHermiteSpline([0.0, step.width], [p, q], [slope, end_slope])
    turns = [u for u in curve.derivative().roots(extrapolate=False) if 0 < u < step.width]
    return start.separation + (min(turns, key=curve) if turns else meet)


# Without adhesion a way back has a station so far above first contact, in h_rms, in case the error of an equilibrium
# leaves a spot in contact there.
_ABOVE_CONTACT = 1e-8


@dataclass(frozen=True, eq=False)
class Position:
    """Where a cycle is: its state, the step that it takes, what its steps have done, and how far it has come.

    stations: separations met on the way in, in increasing order, m.
    """

    state: State
    stride: Stride
    course: Course
    account: Account = field(default_factory=Account)
    stations: tuple[float, ...] = ()


def cycle(contact: ContactModel, path: Path, longest: float, course: Course) -> Generator[Waypoint, Stop | None, None]:
    """All equilibria of a path that goes on after the first loading, without their balances.

    A stop that is sent in answer to one of them is met, too, if it comes before the others, as one that is no target.

    Parameters
    ----------
    longest : step of the separation, m.

    Raises
    ------
    NotConverged
        As `icha.path.follow.follow`.
    """
    start, stops = contact.untouched(), [Stop(target, contact) for target in path.targets]
    for stop in _above(start, stops):  # nothing touches up there
        state = contact.equilibrium(start, stop.target.value)
        stops.remove(stop)
        course = course.met(stop.target, state)
        yield Waypoint(stop.target, state, 0)
    top = () if contact.adhesive else (start.separation + _ABOVE_CONTACT * contact.rms_height,)
    stride = Stride(contact.path_accuracy.event * contact.rms_height if contact.adhesive else longest)
    here = Position(start, stride, course, stations=top)
    yield between_stops(start, 0)
    here = yield from _Leg(contact, 0, longest).follow(here, stops)
    if here.course.missed:
        raise here.course.ended(here.state, True)
    for leg, turn in enumerate(path.turning_points, start=1):
        stop = Stop(turn, contact)
        if (stop.excess(here.state) > 0) != (leg % 2 == 1):
            behind = NotConverged(f"the turning point {turn.named()} lies behind where leg {leg} begins")
            raise here.course.ended(here.state, leg % 2 == 0, behind)
        here = yield from _Leg(contact, leg, longest).follow(here, [stop])
        here.course.tell(f"turning point {turn.named()}", here.state)
    if path.unload:
        leg = len(path.turning_points) + (len(path.turning_points) % 2 == 0)
        stops = [Stop(replace(target, snapshot=False), contact) for target in path.targets]
        passed = [stop for stop in stops if stop.excess(here.state) > SAME_EXCESS]
        here = yield from _Leg(contact, leg, longest).follow(here, passed, apart=True)
        here.course.tell("apart", here.state)


def _above(start, stops):
    """Those of the stops that are mean separations above first contact, from the highest down."""
    above = [s for s in stops if s.target.kind == MEAN_SEPARATION and s.target.value > start.separation]
    return sorted(above, key=lambda stop: -stop.target.value)


@dataclass(frozen=True, eq=False)
class _Leg:
    """One leg of a cycle: its number, from 0, and the longest step on it, m."""

    contact: ContactModel
    number: int
    longest: float

    @property
    def loading(self):
        return self.number % 2 == 0

    @property
    def direction(self):
        """That of the separation."""
        return -1 if self.loading else 1

    def follow(
        self, here: Position, stops: list[Stop], apart: bool = False
    ) -> Generator[Waypoint, Stop | None, Position]:
        """The equilibria until all stops are met or, `apart`, nothing touches any more; returns where that is."""
        waiting, sent, visited = Queue(stops, self.direction), None, [here.state.separation]
        here, most = replace(here, stride=Stride(here.stride.length)), np.inf
        while waiting or apart:
            if not self.loading and self._is_apart(here.state):
                if apart:
                    return here
                raise self._ended(here, NotConverged(_never_so_far(waiting.foremost[0], here.account)))
            beyond, step, here = self._one_step(here, most)
            try:
                ahead = [*waiting.foremost, sent] if sent else waiting.foremost
                stop, met = first_passed(ahead, here.state, beyond, self.direction)
            except InsideJump as jump:
                if jump.stop is sent:
                    sent = None
                    continue
                waiting.remove(jump.stop)
                if not apart:
                    here = replace(here, course=here.course.without(jump))
                    if self.number:
                        raise self._ended(here) from None
                continue
            except NotConverged as failure:
                here, most = self._with_shorter_step(here, abs(step.width), failure)
                continue
            if met is not beyond:
                step = Step.between(self.contact, here.state, met)
            here.course.require_covered(here.state, met, None if stop is sent else stop, waiting, self.loading)
            here, most = self._arrived(here, met, step, first=self.number == 0 and len(visited) == 1), np.inf
            if self._is_worth_a_station(met.separation, visited[-1]):
                visited.append(met.separation)
            if stop is None:
                sent = yield between_stops(met, self.number, step)
                continue
            if stop is not sent:
                waiting.remove(stop)
                if self.number == 0:
                    here = replace(here, course=here.course.met(stop.target, met))
            sent = yield Waypoint(stop.target, met, self.number, step)
        return _with_stations(here, visited) if self.loading else here

    def _one_step(self, here, most):
        """The next equilibrium, the step to it, at `most` so wide (m), and where the path is, with its next stride."""
        width = min(self._to_next_station(here), most)
        try:
            beyond, step, stride = resolved(
                self.contact, here.state, self.direction, width, here.stride, here.account, self.longest
            )
        except NotConverged as failure:
            raise self._ended(here, failure) from failure
        return beyond, step, replace(here, stride=stride)

    def _with_shorter_step(self, here, width, failure):
        """Where the path is after a step in which a stop was not met, and how wide the next one may be, m."""
        try:
            width = halved(width, self.longest, failure)
        except NotConverged:
            raise self._ended(here, failure) from failure
        return replace(here, stride=replace(here.stride, length=min(here.stride.length, width))), width

    def _arrived(self, here, state, step, first):
        """Where the path is after a step, and how far it may go next; after the very `first`, as far as ever."""
        account, course = here.account.after(self.contact, step, state), here.course.after(state, self.loading)
        stride = self._next_stride(here.stride, step, account, self.direction * state.separation)
        if first:
            stride = replace(stride, length=self.longest)
        return replace(here, state=state, stride=stride, account=account, course=course)

    def _next_stride(self, stride, step, account, at):
        """Stride after a step that ended `at` (m, along the leg): twice as long, or as far as errors allow."""
        longer = min(self.longest, 2 * stride.length)
        if not self.contact.path_accuracy.predicts_steps:
            return replace(stride, length=longer)
        if step.sudden:
            return replace(stride, length=max(longer, stride.smooth))
        distance = stride.event_at - at
        if 0 < distance < np.inf:
            return replace(stride, length=distance if distance <= stride.event_width else 0.5 * distance)
        # The error of a step grows with its cube.
        allowed = longer if 8 * step.integration_error <= _CURVED_WORK * account.effort else stride.length
        return replace(stride, length=allowed, smooth=max(stride.smooth, abs(step.width)))

    def _is_apart(self, state):
        """Whether nothing touches, as high up as where contact was about to be made first."""
        if self.contact.spot_count(state):
            return False
        highest = self.contact.untouched().separation - SAME_SEPARATION * self.contact.rms_height
        return state.separation >= highest

    def _is_worth_a_station(self, separation, last):
        """Whether it is far enough from the last: not every separation around an event is one to come back to."""
        contact = self.contact
        between = self.longest / 64 if contact.adhesive else SAME_SEPARATION * contact.rms_height
        return abs(separation - last) > between

    def _to_next_station(self, here):
        """How far it is to the next separation of the way in; without one a step."""
        at, apart = here.state.separation, SAME_SEPARATION * self.contact.rms_height
        if self.loading:
            ahead = bisect_left(here.stations, at - apart) - 1
        else:
            ahead = bisect_right(here.stations, at + apart)
        return abs(here.stations[ahead] - at) if 0 <= ahead < len(here.stations) else here.stride.length

    def _ended(self, here, *failures):
        return here.course.ended(here.state, self.loading, *failures)


def _with_stations(here, visited):
    """After a way in: a way back meets its separations; what an inner loop adds to them it takes away again."""
    lowest = min(here.stations, default=np.inf)
    new = (separation for separation in [*visited, here.state.separation] if separation < lowest)
    return replace(here, stations=tuple(sorted({*here.stations, *new})))


def _never_so_far(stop, account):
    """That the surfaces come apart before a turning point; of a load, what tension they bear."""
    reason = f"the surfaces are apart before the turning point {stop.target.named()}"
    if stop.target.kind in LOADS:
        reason += f"; the largest tension is {max(0.0, -account.lowest / stop.target.quantity.scale(stop.contact)):.4g}"
    return reason
