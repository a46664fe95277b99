"""Loading and unloading: every equilibrium of a path that goes on after the first loading.

The way back follows the stable branch of every spot until it jumps off, up to complete separation or to a turning
point. It stops at the separations of the way in, so that both can be compared; where an event changes the pressure the
steps become short enough that the work lost in it is known, whatever the longest step.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace

import numpy as np

from icha.contact.model import ContactModel, NotConverged, State
from icha.path.bracketing import SAME_SEPARATION, InsideJump, first_passed
from icha.path.course import Course, halved
from icha.path.energy_balance import Step
from icha.path.resolution import SHARP, Account, Stride, resolved
from icha.path.stops import SAME_EXCESS, Queue, Stop
from icha.path.targets import LOADS, MEAN_SEPARATION, Path, Target
from icha.path.waypoints import Waypoint, between_stops

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


def cycle(
    contact: ContactModel, path: Path, stop_at: Callable[[Target], Stop], longest: float, course: Course
) -> Generator[Waypoint, Stop | None, None]:
    """All equilibria of a path that goes on after the first loading, without their balances.

    A stop that is sent in answer to one of them is met, too, if it comes before the others, as one that is no target.

    Parameters
    ----------
    stop_at : makes a stop of a target.
    longest : step of the separation, m.

    Raises
    ------
    NotConverged
        As `icha.path.follow.follow`.
    """
    start, stops = contact.untouched(), [stop_at(target) for target in path.targets]
    for stop in _above(start, stops):  # nothing touches up there
        state = contact.equilibrium(start, stop.target.value)
        stops.remove(stop)
        course = course.met(stop.target, state)
        yield Waypoint(stop.target, state, 0)
    top = () if contact.adhesive else (start.separation + _ABOVE_CONTACT * contact.rms_height,)
    stride = Stride(SHARP * contact.rms_height if contact.adhesive else longest)
    here = Position(start, stride, course, stations=top)
    yield between_stops(start, 0)
    here = yield from _Leg(contact, 0, longest).follow(here, stops)
    if here.course.missed:
        raise here.course.ended(here.state, True)
    for leg, turn in enumerate(path.turning_points, start=1):
        stop = stop_at(turn)
        if (stop.excess(here.state) > 0) != (leg % 2 == 1):
            behind = NotConverged(f"the turning point {turn.named()} lies behind where leg {leg} begins")
            raise here.course.ended(here.state, leg % 2 == 0, behind)
        here = yield from _Leg(contact, leg, longest).follow(here, [stop])
        here.course.tell(f"turning point {turn.named()}", here.state)
    if path.unload:
        leg = len(path.turning_points) + (len(path.turning_points) % 2 == 0)
        stops = [stop_at(replace(target, snapshot=False)) for target in path.targets]
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
                sent = yield between_stops(met, self.number)
                continue
            if stop is not sent:
                waiting.remove(stop)
                if self.number == 0:
                    here = replace(here, course=here.course.met(stop.target, met))
            sent = yield Waypoint(stop.target, met, self.number)
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
        length = self.longest if first else min(self.longest, 2 * here.stride.length)
        account, course = here.account.after(self.contact, step, state), here.course.after(state, self.loading)
        return replace(here, state=state, stride=replace(here.stride, length=length), account=account, course=course)

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
        reason += f"; the largest tension is {max(0.0, -account.lowest / stop.pressure_scale):.4g}"
    return reason
