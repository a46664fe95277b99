"""A target as a function of the state of the contact, and the equilibrium that meets it."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from icha.contact.model import AREA_FRACTION as AREA
from icha.contact.model import PRESSURE, ContactModel, Control, State
from icha.path.limits import LEAST_PRESSURE
from icha.path.targets import AREA_FRACTION, MEAN_SEPARATION, Target

# Relative excess over a target that is rounding.
SAME_EXCESS = 1e-9


@dataclass(frozen=True, eq=False)
class Stop:
    """A target turned into a function of the state that is zero at the target and rises on loading.

    pressure_scale: of a load, the pressure (Pa) that is its unit.
    """

    target: Target
    contact: ContactModel
    pressure_scale: float

    def excess(self, state: State) -> float:
        """Relative excess of the state over the target; of no load, in units of the least that can be asked for."""
        kind, value = self.target.kind, self.target.value
        if kind == MEAN_SEPARATION:
            return (value - state.separation) / self.contact.rms_height
        if kind == AREA_FRACTION:
            return self.contact.area_fraction(state) / value - 1
        pressure = self.contact.pressure(state) / self.pressure_scale
        return (pressure - value) / (abs(value) or LEAST_PRESSURE)

    @property
    def control(self) -> Control | None:
        """What a solve has to hold to meet the target; None for a separation."""
        if self.target.kind == MEAN_SEPARATION:
            return None
        if self.target.kind == AREA_FRACTION:
            return Control(AREA, self.target.value)
        return Control(PRESSURE, self.target.value * self.pressure_scale)

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
