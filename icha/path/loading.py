"""The first loading alone, from stop to stop, straight to the next one where that is near; and how far a path is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from icha.contact.model import ContactModel, NotConverged, State
from icha.path.energy_balance import Waypoint
from icha.path.stops import SAME_EXCESS, SAME_SEPARATION, InsideJump, Queue, Stop, first_passed
from icha.path.targets import Target

# A step that does not converge is halved down to this fraction of the longest one.
_SMALLEST_STEP = 2.0**-14
# So many equilibria within a longest step, without a stop, and a path makes no progress.
_MOST_EQUILIBRIA = 2000


@dataclass(frozen=True, eq=False)
class Course:
    """Stops met so far, of how many; those that were missed, as they lie inside jumps.

    longest: step of the separation, m. idle: equilibria since the last stop or since the separation `mark`, m, from
    which the path has not come a longest step yet.
    """

    contact: ContactModel
    total: int
    longest: float
    progress: Callable[[str], None] | None = None
    reached: int = 0
    missed: tuple[InsideJump, ...] = ()
    mark: float = np.inf
    idle: int = 0

    def after(self, state: State, loading: bool) -> Course:
        """After one more equilibrium; refuses to go on where the path makes no progress."""
        if abs(state.separation - self.mark) >= self.longest:
            return replace(self, mark=state.separation, idle=0)
        if self.idle == _MOST_EQUILIBRIA:
            within = f"{self.longest / self.contact.rms_height:.3g} h_rms"
            raise self.ended(state, loading, NotConverged(f"no progress: {self.idle} equilibria within {within}"))
        return replace(self, idle=self.idle + 1)

    def met(self, target: Target, state: State) -> Course:
        """After one more stop."""
        after = replace(self, reached=self.reached + 1, idle=0)
        after.tell(f"stop {after.reached} of {self.total}: {target.named(6)}", state)
        return after

    def without(self, jump: InsideJump) -> Course:
        """After a stop that is left out."""
        return replace(self, missed=(*self.missed, jump))

    def tell(self, name: str, state: State) -> None:
        """Tell where the path is."""
        if self.progress is not None:
            contact = self.contact
            self.progress(
                f"{name}, separation {state.separation / contact.rms_height:.4f} h_rms, "
                f"A/A0 {contact.area_fraction(state):.4e}, {contact.spot_count(state)} spots"
            )

    def require_covered(self, before: State, after: State, stop: Stop | None, waiting: Queue, loading: bool) -> None:
        """Refuse a state that the model does not cover, at a stop or before stops that are still to come."""
        contact = self.contact
        what = (stop or waiting.foremost[0]).target.named() if stop or waiting else "separation"
        area = contact.area_fraction(after)
        if area > contact.largest_area_fraction:
            reason = f"the contact area runs to {area:.2f} of the nominal one, beyond what the model covers,"
            raise self.ended(before, loading, NotConverged(f"{reason} before {what}"))
        if stop is None and contact.mean_gap(after) <= 0:
            reason = f"the mean planes met before {what}, beyond what the model covers"
            raise self.ended(after, loading, NotConverged(reason))

    def ended(self, state: State, loading: bool, *failures: NotConverged) -> NotConverged:
        """Where the path ended and why; says so if the surfaces stick together by themselves."""
        contact, failures = self.contact, (*self.missed, *failures)
        sticky = ""
        # Without a load, adhesion alone has spread the contact, or the very first one does not come to rest.
        lone = contact.spot_count(state) == 0 and not any(isinstance(failure, InsideJump) for failure in failures)
        if contact.adhesive and loading and (contact.pressure(state) < 0 or lone):
            sticky = (
                "; the load is not yet compressive: the surface is sticky, adhesion is pulling it towards full contact"
            )
        return NotConverged(
            f"at a mean separation of {state.separation / contact.rms_height:.4f} h_rms, "
            f"A/A0 = {contact.area_fraction(state):.3g}, after {self.reached} of {self.total} stops: "
            f"{'; '.join(map(str, failures))}{sticky}"
        )


def halved(step: float, longest: float, failure: NotConverged) -> float:
    """Half the step, after an equilibrium was not found; raises the failure where no shorter step helps."""
    if step / 2 < _SMALLEST_STEP * longest:
        raise failure
    return step / 2


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
