"""The loading path: from first contact down to given separations, loads or areas, all of them hit exactly."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from icha.equilibrium import (
    Contact,
    ContactState,
    Control,
    NotConverged,
    area_fraction,
    equilibrium,
    mean_pressure,
    untouched,
)
from icha.limits import DEFAULT_STEP, MAX_AREA_FRACTION, MAX_REDUCED_PRESSURE, MAX_STEP
from icha.validation import positive

REDUCED_PRESSURE = "reduced_pressure"
RELATIVE_LOAD = "relative_load"
AREA_FRACTION = "area_fraction"
MEAN_SEPARATION = "mean_separation"
KINDS = (REDUCED_PRESSURE, RELATIVE_LOAD, AREA_FRACTION, MEAN_SEPARATION)

# A step that does not converge is halved down to this fraction of the longest one.
_SMALLEST_STEP = 2.0**-14
# Two separations closer than this (in h_rms) bracket a jump, not a root.
_SAME_SEPARATION = 1e-10
# A solve that fails in a bracket narrower than this (in h_rms) fails at a jump, where spots have infinite slopes.
_CLOSE_TO_A_JUMP = 1e-4
# Relative excess over a target that is rounding.
_SAME_EXCESS = 1e-9
# How far past the covered area the path looks for a target before it gives up.
_AREA_MARGIN = 1.5


@dataclass(frozen=True)
class Target:
    """One stop of a path: the kind of quantity, its value (SI units), and whether it is a snapshot."""

    kind: str
    value: float
    snapshot: bool = False


@dataclass(frozen=True, init=False)
class Path:
    """Stops of a loading path, and the longest step between them.

    Parameters
    ----------
    reduced_pressures : p/(E* h'_rms), increasing, in (0, 0.15].
    area_fractions : A/A0, increasing, in (0, 0.25].
    mean_separations : u in m, decreasing, positive. Exactly one of these three lists is given.
    snapshots : pairs (kind, value), in any order, of states whose fields and spots are kept, with kind one of
        "reduced_pressure", "relative_load" (F/(E* A0)), "area_fraction" and "mean_separation" (m). A snapshot is a stop
        of its own, unless the list holds the same kind and value; the dataset has them in the order in which they are
        met. None: the last stop of the list.
    unload : not available yet; must be False.
    max_step : longest change of the mean separation between two equilibria, in units of h_rms, in (0, 0.5].

    Raises
    ------
    ValueError
        Naming the argument whose value is not allowed.
    """

    targets: tuple[Target, ...]
    max_step: float

    def __init__(
        self,
        reduced_pressures=None,
        area_fractions=None,
        mean_separations=None,
        *,
        snapshots=None,
        unload=False,
        max_step=DEFAULT_STEP,
    ):
        """Check the values and build the list of stops."""
        given = {
            kind: (name, values)
            for kind, name, values in (
                (REDUCED_PRESSURE, "reduced_pressures", reduced_pressures),
                (AREA_FRACTION, "area_fractions", area_fractions),
                (MEAN_SEPARATION, "mean_separations", mean_separations),
            )
            if values is not None
        }
        if len(given) != 1:
            raise ValueError(
                "reduced_pressures, area_fractions, mean_separations: exactly one must be given, "
                f"not {', '.join(name for name, _ in given.values()) or 'none'}"
            )
        if unload is not False:
            raise ValueError(f"unload: {unload!r} is not available in this version; only False is")
        max_step = positive("max_step", max_step, "h_rms")
        if max_step > MAX_STEP:
            raise ValueError(f"max_step: {max_step!r} must not exceed {MAX_STEP} (in h_rms)")
        ((kind, (name, values)),) = given.items()
        values = _stops(name, kind, values)
        if snapshots is None:
            snapshots = [(kind, values[-1])]
        if not isinstance(snapshots, list | tuple):
            raise ValueError(f"snapshots: {snapshots!r} is not a list of pairs (kind, value)")
        wanted = []
        for index, snapshot in enumerate(snapshots):
            label = f"snapshots[{index}]"
            try:
                snapshot_kind, value = snapshot
            except (TypeError, ValueError):
                raise ValueError(f"{label}: {snapshot!r} is not a pair (kind, value)") from None
            if snapshot_kind not in KINDS:
                raise ValueError(f"{label}: kind {snapshot_kind!r} must be one of {', '.join(KINDS)}")
            value = _covered(label, snapshot_kind, value)
            if (snapshot_kind, value) in wanted:
                raise ValueError(f"{label}: {snapshot_kind} {value!r} is given twice")
            wanted.append((snapshot_kind, value))
        targets = [Target(kind, value, (kind, value) in wanted) for value in values]
        targets += [Target(k, v, True) for k, v in wanted if k != kind or v not in values]
        object.__setattr__(self, "targets", tuple(targets))
        object.__setattr__(self, "max_step", max_step)


def _covered(name, kind, value):
    value = positive(name, value, "m" if kind == MEAN_SEPARATION else "1")
    limit = {REDUCED_PRESSURE: MAX_REDUCED_PRESSURE, AREA_FRACTION: MAX_AREA_FRACTION}.get(kind)
    if limit is not None and value > limit:
        raise ValueError(f"{name}: {value!r} lies beyond what the model covers (at most {limit})")
    return value


def _stops(name, kind, values):
    try:
        values = list(values)
    except TypeError:
        raise ValueError(f"{name}: {values!r} is not a list of numbers") from None
    if not values:
        raise ValueError(f"{name}: the list is empty")
    values = [_covered(f"{name}[{i}]", kind, v) for i, v in enumerate(values)]
    for i, (one, next_one) in enumerate(itertools.pairwise(values)):
        if not (next_one < one if kind == MEAN_SEPARATION else next_one > one):
            order = "decreasing" if kind == MEAN_SEPARATION else "increasing"
            raise ValueError(f"{name}[{i + 1}]: {next_one!r} after {one!r}; the list must be strictly {order}")
    return values


class InsideJump(NotConverged):
    """The target is passed in a jump, and there is no equilibrium at it. `before` is the state just before the jump."""

    def __init__(self, message: str, stop: _Stop, before: ContactState):
        """Keep which stop, and where the path can go on."""
        super().__init__(message)
        self.stop, self.before = stop, before


@dataclass(frozen=True, eq=False)
class _Stop:
    """A target turned into a function of the state that rises along the path through zero at the target."""

    target: Target
    contact: Contact
    pressure_scale: float

    def excess(self, state: ContactState) -> float:
        """Relative excess of the state over the target."""
        kind, value = self.target.kind, self.target.value
        if kind == MEAN_SEPARATION:
            return (value - state.separation) / self.contact.rms_height
        if kind == AREA_FRACTION:
            return area_fraction(self.contact, state.spots) / value - 1
        return mean_pressure(self.contact, state.spots) / (value * self.pressure_scale) - 1

    @property
    def control(self) -> Control | None:
        """What a solve has to hold to meet the target; None for a separation."""
        if self.target.kind == MEAN_SEPARATION:
            return None
        if self.target.kind == AREA_FRACTION:
            return Control("area_fraction", self.target.value)
        return Control("pressure", self.target.value * self.pressure_scale)

    def expected_separation(self, state: ContactState) -> float:
        """The separation at which the target may be met: load and area grow about exponentially; -inf if unknown."""
        if self.target.kind == MEAN_SEPARATION:
            return self.target.value
        value, slope = 1 + self.excess(state), self.control.slope(self.contact, state) / self.control.target
        return state.separation - np.log(value) / (slope / value) if value > 0 and slope < 0 else -np.inf

    def meet(self, state: ContactState, separation: float) -> ContactState:
        """The equilibrium at the target, from a state not far away; the separation is a first guess."""
        return equilibrium(self.contact, state, separation, self.control)

    def reach(self, before: ContactState, beyond: ContactState) -> ContactState:
        """The state at the target, which lies between two states of the path.

        The bracket is halved until the target is met inside it. When it closes on a jump (an event that carries the
        quantity past its target), the target is met on the branch after the event, where load control would be.
        """
        if self.control is None:
            return self.meet(before, self.target.value)
        for _ in range(80):
            width = before.separation - beyond.separation
            if width <= _SAME_SEPARATION * self.contact.rms_height:
                try:
                    return self.meet(beyond, beyond.separation)
                except NotConverged:
                    raise self._inside_jump(before, beyond) from None
            try:
                met = self.meet(before, max(self.expected_separation(before), beyond.separation))
                if beyond.separation <= met.separation < before.separation:
                    return met
            except NotConverged:
                pass
            try:
                middle = equilibrium(self.contact, before, beyond.separation + 0.5 * width)
            except NotConverged:
                if width > _CLOSE_TO_A_JUMP * self.contact.rms_height:
                    raise
                raise self._inside_jump(before, beyond) from None
            if self.excess(middle) >= 0:
                beyond = middle
            else:
                before = middle
        raise NotConverged("the search for the target did not end")

    def _inside_jump(self, before, beyond):
        low, high = (area_fraction(self.contact, state.spots) for state in (before, beyond))
        return InsideJump(
            f"{_name(self)} lies inside a jump: at a mean separation of "
            f"{beyond.separation / self.contact.rms_height:.4f} h_rms the contact area jumps from {low:.3g} to "
            f"{high:.3g} of the nominal one, and its far side does not reach back to the target; leave it out, or give "
            "the path by mean separations",
            self,
            before,
        )


def load(
    contact: Contact,
    path: Path,
    pressure_unit: float,
    contact_modulus: float,
    progress: Callable[[str], None] | None = None,
) -> Iterator[tuple[Target, ContactState]]:
    """Follow the loading path and yield every target with its state, in the order in which they are met.

    Parameters
    ----------
    contact : the contact problem.
    path : its stops.
    pressure_unit : E* h'_rms in Pa, the unit of reduced pressures.
    contact_modulus : E* in Pa, the unit of relative loads.
    progress : called with a line of text at every stop.

    Raises
    ------
    NotConverged
        If an equilibrium is not found even with short steps, or a target lies beyond what the model covers. Stops that
        lie inside a jump are left out; those after them are yielded before the error is raised.
    """
    scale = {REDUCED_PRESSURE: pressure_unit, RELATIVE_LOAD: contact_modulus}
    waiting = [_Stop(target, contact, scale.get(target.kind, 1.0)) for target in path.targets]
    total = len(waiting)
    first_contact = untouched(contact)
    state = first_contact
    longest = path.max_step * contact.rms_height
    step = longest
    missed, reached = [], 0

    def end(*failures):
        return NotConverged(_epitaph(contact, state, reached, total, [*missed, *failures]))

    while waiting:
        if not len(state.spots) and state.separation > first_contact.separation:
            state = first_contact  # nothing happens on the way there
        try:
            stop, beyond = _aim(waiting, state, step) or _step(waiting, contact, state, step)
        except InsideJump as jump:
            waiting.remove(jump.stop)
            missed.append(jump)
            state = jump.before
            continue
        except NotConverged as failure:
            step /= 2
            if step < _SMALLEST_STEP * longest:
                raise end(failure) from failure
            continue
        step = min(longest, 2 * step)
        area = area_fraction(contact, beyond.spots)
        if area > _AREA_MARGIN * MAX_AREA_FRACTION:
            what = f"the contact area runs to {area:.2f} of the nominal one, beyond what the model covers,"
            raise end(NotConverged(f"{what} before {_name(stop or waiting[0])}"))
        state = beyond
        if stop is None:
            if state.separation <= 0:
                raise end(NotConverged(f"the mean planes met before {_name(waiting[0])}, beyond what the model covers"))
            continue
        waiting.remove(stop)
        reached += 1
        if progress is not None:
            progress(
                f"stop {reached} of {total}: {stop.target.kind} = {stop.target.value:.6g}, "
                f"separation {state.separation / contact.rms_height:.4f} h_rms, "
                f"A/A0 {area:.4e}, {len(state.spots)} spots"
            )
        yield stop.target, state
    if missed:
        raise end()


def _aim(waiting, state, step):
    """Go straight to the next stop, if it seems no farther than a step; None if it is not met there after all."""
    expected = {stop: stop.expected_separation(state) for stop in waiting}
    stop = max(expected, key=expected.get)
    if expected[stop] < state.separation - step:
        return None
    try:
        met = stop.meet(state, expected[stop])
    except NotConverged:
        return None
    same = _SAME_SEPARATION * stop.contact.rms_height
    if stop.control and not state.separation - step <= met.separation <= state.separation + same:
        return None
    if any(other.excess(met) > _SAME_EXCESS for other in waiting if other is not stop):
        return None
    return stop, met


def _step(waiting, contact, state, step):
    """A step of the separation: the stop that it passes first, and its state; or None and the state after it."""
    beyond = equilibrium(contact, state, state.separation - step)
    reached = None, beyond
    for stop in waiting:
        if stop.excess(beyond) >= 0:
            # The first of the targets between the two states is the one met at the largest separation.
            met = stop.reach(state, beyond)
            if reached[0] is None or met.separation > reached[1].separation:
                reached = stop, met
    return reached


def _name(stop):
    return f"{stop.target.kind} = {stop.target.value:g}"


def _epitaph(contact, state, reached, total, failures):
    """Where the path ended and why; a surface that sticks together by itself is called so."""
    pressure = mean_pressure(contact, state.spots)
    sticky = ""
    # Without a load, adhesion alone has spread the contact, or the very first one does not come to rest.
    lone = not len(state.spots) and not any(isinstance(failure, InsideJump) for failure in failures)
    if contact.adhesive and (pressure < 0 or lone):
        sticky = "; the load is not yet compressive: the surface is sticky, adhesion is pulling it towards full contact"
    return (
        f"at a mean separation of {state.separation / contact.rms_height:.4f} h_rms, "
        f"A/A0 = {area_fraction(contact, state.spots):.3g}, after {reached} of {total} stops: "
        f"{'; '.join(map(str, failures))}{sticky}"
    )
