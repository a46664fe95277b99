"""The first loading alone: from stop to stop, straight to the next one where that is near."""

from collections.abc import Iterator

from icha.contact.failures import NotConverged
from icha.contact.model import ContactModel, State
from icha.path.bracketing import SAME_SEPARATION, InsideJump, first_passed
from icha.path.course import Course, halved
from icha.path.stops import SAME_EXCESS, Stop
from icha.path.waypoints import Waypoint


def first_loading(contact: ContactModel, stops: list[Stop], longest: float, course: Course) -> Iterator[Waypoint]:
    """The stops of a path that ends with the first loading; longest: step of the separation, m.

    Raises
    ------
    NotConverged
        As `icha.path.follow.follow`.
    """
    state = first_contact = contact.untouched()
    waiting, step = list(stops), longest
    while waiting:
        if contact.spot_count(state) == 0 and state.separation > first_contact.separation:
            state = first_contact  # nothing happens on the way there
        try:
            stop, beyond = _straight(waiting, state, step) or _one_step(contact, waiting, state, step)
        except InsideJump as jump:
            waiting.remove(jump.stop)
            course, state = course.without(jump), jump.before
            continue
        except NotConverged as failure:
            try:
                step = halved(step, longest, failure)
            except NotConverged:
                raise course.ended(state, True, failure) from failure
            continue
        step = min(longest, 2 * step)
        course.require_covered(state, beyond, stop, waiting, True)
        state = beyond
        if stop is None:
            continue
        waiting.remove(stop)
        course = course.met(stop.target, state)
        yield Waypoint(stop.target, state)
    if course.missed:
        raise course.ended(state, True)


def _straight(waiting: list[Stop], state: State, step: float) -> tuple[Stop, State] | None:
    """The next stop and its state, if it seems no farther than a step; None if it is not met there after all."""
    expected = {stop: stop.expected_separation(state) for stop in waiting}
    stop = max(expected, key=expected.get)
    if expected[stop] < state.separation - step:
        return None
    try:
        met = stop.meet(state, expected[stop])
    except NotConverged:
        return None
    same = SAME_SEPARATION * stop.contact.rms_height
    if stop.control and not state.separation - step <= met.separation <= state.separation + same:
        return None
    if any(other.excess(met) > SAME_EXCESS for other in waiting if other is not stop):
        return None
    return stop, met


def _one_step(contact, waiting, state, step):
    """A step of the separation: the stop that it passes first, and its state; or None and the state after it."""
    beyond = contact.equilibrium(state, state.separation - step)
    return first_passed(waiting, state, beyond, -1)
