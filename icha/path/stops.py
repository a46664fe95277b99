"""A target as a function of the state of the contact, and the equilibrium that meets it between two states."""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from icha.contact.model import PRESSURE, ContactModel, Control, NotConverged, State
from icha.path.targets import LEAST_PRESSURE, MEAN_SEPARATION, Target

# Relative excess over a target that is rounding.
SAME_EXCESS = 1e-9


@dataclass(frozen=True, eq=False)
class Stop:
    """A target turned into a function of the state that is zero at the target and rises on loading."""

    target: Target
    contact: ContactModel

    def excess(self, state: State) -> float:
        """Relative excess of the state over the target; of no load, in units of the least that can be asked for."""
        quantity, value = self.target.quantity, self.target.value
        if quantity.held is None:
            return (value - state.separation) / self.contact.rms_height
        found = quantity.of(self.contact, state)
        if quantity.held == PRESSURE:
            return (found - value) / (abs(value) or LEAST_PRESSURE)
        return found / value - 1

    @property
    def control(self) -> Control | None:
        """What a solve has to hold to meet the target; None for a separation."""
        return self.target.quantity.control(self.contact, self.target.value)

    def expected_separation(self, state: State) -> float:
        """The separation at which the target may be met: load and area grow about exponentially; -inf if unknown."""
        control = self.control
        if control is None:
            return self.target.value
        value, slope = 1 + self.excess(state), self.contact.slope(control.quantity, state) / control.target
        return state.separation - np.log(value) / (slope / value) if value > 0 and slope < 0 else -np.inf

    def meet(self, state: State, separation: float) -> State:
        """The equilibrium at the target, from a state not far away; the separation is a first guess."""
        return self.contact.equilibrium(state, separation, self.control)


class Queue:
    """Stops that are still to be met, of each kind in the order in which they are; empty is false."""

    def __init__(self, stops: Iterable[Stop], direction: int):
        """Sort them for a direction of the separation: -1 on loading, 1 on unloading."""
        self._by_kind: dict[str, list[Stop]] = {}
        for stop in sorted(stops, key=lambda stop: stop.target.value):
            self._by_kind.setdefault(stop.target.kind, []).append(stop)
        for kind, waiting in self._by_kind.items():
            # The next one is the last.
            if (kind == MEAN_SEPARATION) != (direction < 0):
                waiting.reverse()

    def __bool__(self) -> bool:
        """Whether there are any."""
        return any(self._by_kind.values())

    @property
    def foremost(self) -> list[Stop]:
        """The next of every kind."""
        return [waiting[-1] for waiting in self._by_kind.values() if waiting]

    def remove(self, stop: Stop) -> None:
        """Without one of the foremost."""
        self._by_kind[stop.target.kind].pop()


# Two separations closer than this (in h_rms) bracket a jump, not a root.
SAME_SEPARATION = 1e-10
# A solve that fails in a bracket narrower than this (in h_rms) fails at a jump, where spots have infinite slopes.
CLOSE_TO_A_JUMP = 1e-4
_MAX_HALVINGS = 80
# Of the halvings the target is tried before the first nine; later only before the seventeenth, the thirty-third, ...:
# what was not met so often mostly is in a jump.
_TRIED = 8


class InsideJump(NotConverged):
    """The target is passed in a jump, and there is no equilibrium at it. `before` is the state just before the jump."""

    def __init__(self, stop: Stop, before: State, beyond: State):
        """Say where the jump is, and keep which stop, and where the path can go on."""
        contact = stop.contact
        low, high = (contact.area_fraction(state) for state in (before, beyond))
        super().__init__(
            f"{stop.target.named()} lies inside a jump: at a mean separation of "
            f"{beyond.separation / contact.rms_height:.4f} h_rms the contact area jumps from {low:.3g} to "
            f"{high:.3g} of the nominal one, and its far side does not reach back to the target; leave it out, or give "
            "the path by mean separations"
        )
        self.stop, self.before = stop, before


def reach(stop: Stop, before: State, beyond: State) -> State:
    """The state at a target that lies between two states of the path, in either direction.

    The bracket is halved until the target is met inside it. When it closes on a jump (an event that carries the
    quantity past its target), the target is met on the branch after the event, where load control would be.

    Raises
    ------
    InsideJump
        If there is no equilibrium at the target on that branch.
    NotConverged
        If an equilibrium far from any jump is not found.
    """
    contact = stop.contact
    if stop.control is None:
        return stop.meet(before, stop.target.value)
    sign = 1.0 if beyond.separation < before.separation else -1.0
    for halvings in range(_MAX_HALVINGS):
        width = sign * (before.separation - beyond.separation)
        if width <= SAME_SEPARATION * contact.rms_height:
            try:
                return stop.meet(beyond, beyond.separation)
            except NotConverged:
                raise InsideJump(stop, before, beyond) from None
        met = None
        if halvings < _TRIED or halvings & (halvings - 1) == 0:
            with suppress(NotConverged):
                met = stop.meet(before, _guess(stop, before, beyond))
        if met is not None and 0 < sign * (before.separation - met.separation) <= width:
            return met
        try:
            middle = contact.equilibrium(before, beyond.separation + sign * 0.5 * width)
        except NotConverged:
            if width > CLOSE_TO_A_JUMP * contact.rms_height:
                raise
            raise InsideJump(stop, before, beyond) from None
        if sign * stop.excess(middle) >= 0:
            beyond = middle
        else:
            before = middle
    raise NotConverged("the search for the target did not end")


def _guess(stop, before, beyond):
    """A guess of the separation at the target."""
    if beyond.separation < before.separation and stop.target.value > 0:
        return max(stop.expected_separation(before), beyond.separation)
    start, end = stop.excess(before), stop.excess(beyond)
    return before.separation + start / (start - end) * (beyond.separation - before.separation)


def first_passed(waiting: Iterable[Stop], before: State, beyond: State, direction: int) -> tuple[Stop | None, State]:
    """The stop passed first on the way from one state to another, and its state; or None and the other state.

    direction : of the separation: -1 on loading, 1 on unloading.
    """
    first: tuple[Stop | None, State] = None, beyond
    for stop in waiting:
        if abs(stop.excess(beyond)) <= SAME_EXCESS and first[0] is None:
            first = stop, beyond
        elif direction * stop.excess(beyond) <= 0:
            met = reach(stop, before, beyond)
            if first[0] is None or direction * (met.separation - first[1].separation) < 0:
                first = stop, met
    return first
