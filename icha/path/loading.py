"""The first loading alone: from stop to stop, straight to the next one where that is near."""

from collections.abc import Iterator

from icha.contact.model import ContactModel, NotConverged, State
from icha.path.bracketing import SAME_SEPARATION, InsideJump, first_passed
from icha.path.course import Course, halved
from icha.path.stops import SAME_EXCESS, Queue, Stop
from icha.path.waypoints import Waypoint

# How often a stop is gone to straight; and how much of a way that was too long is gone first, so that less is left, if
# that is no short one, in longest steps.
_TRIALS, _FIRST_PART, _LONG = 2, 0.6, 0.1
# How many equilibria after one that was not found steps become longer again: what was too long once mostly is again.
_PATIENCE = 8


def first_loading(contact: ContactModel, stops: list[Stop], longest: float, course: Course) -> Iterator[Waypoint]:
    """The stops of a path that ends with the first loading; longest: step of the separation, m.

    Raises
    ------
    NotConverged
        As `icha.path.follow.follow`.
    """
    state = first_contact = contact.untouched()
    waiting, step, missed, found = Queue(stops, -1), longest, 0, 0
    stop: Stop | None
    while waiting:
        if contact.spot_count(state) == 0 and state.separation > first_contact.separation:
            state = first_contact  # nothing happens on the way there
        nearest, expected = _nearest(waiting.foremost, state)
        way = state.separation - expected
        try:
            if way <= step and missed < _TRIALS:
                stop, beyond = nearest, _straight(nearest, expected, waiting.foremost, state, step)
                if beyond is None:
                    # A shorter way helps; if it does not, the stop is looked for between two states.
                    missed = missed + 1 if way > _LONG * longest else _TRIALS
                    if missed < _TRIALS:
                        step, found = _FIRST_PART * way, 0
                    continue
            else:
                beyond = contact.equilibrium(state, state.separation - step)
                stop, beyond = first_passed(waiting.foremost, state, beyond, -1)
        except InsideJump as jump:
            waiting.remove(jump.stop)
            course, state, missed = course.without(jump), jump.before, 0
            continue
        except NotConverged as failure:
            try:
                step, found = halved(step, longest, failure), 0
            except NotConverged:
                raise course.ended(state, True, failure) from failure
            continue
        found += 1
        step = min(longest, 2 * step) if found >= _PATIENCE else step
        course.require_covered(state, beyond, stop, waiting, True)
        state, course = beyond, course.after(beyond, True)
        if stop is None:
            continue
        waiting.remove(stop)
        missed = 0
        course = course.met(stop.target, state)
        yield Waypoint(stop.target, state)
    if course.missed:
        raise course.ended(state, True)


def _nearest(waiting: list[Stop], state: State) -> tuple[Stop, float]:
    """The stop that seems to come next, and the separation at which it is expected, m."""
    expected = {stop: stop.expected_separation(state) for stop in waiting}
    stop = max(expected, key=expected.__getitem__)
    return stop, expected[stop]


def _straight(stop: Stop, expected: float, waiting: list[Stop], state: State, step: float) -> State | None:
    """The state at a stop that seems no farther than a step; None if it is not met there after all, or not first."""
    try:
        met = stop.meet(state, expected)
    except NotConverged:
        return None
    same = SAME_SEPARATION * stop.contact.rms_height
    if stop.control and not state.separation - step <= met.separation <= state.separation + same:
        return None
    if any(other.excess(met) > SAME_EXCESS for other in waiting if other is not stop):
        return None
    return met
