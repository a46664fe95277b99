"""The path: from first contact down to given separations, loads or areas, all of them hit exactly, and back.

The way back follows the stable JKR branch of every spot until it jumps off, up to complete separation or to a turning
point. It stops at the separations of the way in, so that both can be compared; where an event changes the pressure the
steps become short enough that the work lost in it is known, whatever the longest step.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from icha.contact.failures import NotConverged
from icha.contact.model import AREA_FRACTION as AREA
from icha.contact.model import PRESSURE, ContactModel, Control, State
from icha.equilibrium.energy import EnergyBalance, Step
from icha.equilibrium.problem import DETACHMENT, OVERLAP
from icha.path.limits import DEFAULT_STEP, MAX_AREA_FRACTION, MAX_REDUCED_PRESSURE, MAX_STEP
from icha.support.validation import number, positive

REDUCED_PRESSURE = "reduced_pressure"
RELATIVE_LOAD = "relative_load"
AREA_FRACTION = "area_fraction"
MEAN_SEPARATION = "mean_separation"
KINDS = (REDUCED_PRESSURE, RELATIVE_LOAD, AREA_FRACTION, MEAN_SEPARATION)
# What an equilibrium between the stops of a path is asked to reach: its mean separation.
BETWEEN = "path"

SEPARATION_CONTROL, LOAD_CONTROL = "separation", "load"
CONTROLS = (SEPARATION_CONTROL, LOAD_CONTROL)
UNITED_UNTIL = (DETACHMENT, OVERLAP)

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
# Of the energy that jumps have set free so far, the part that may be unknown after a step for not knowing where in it
# its events happened; where nothing jumps, of the work so far.
_UNRESOLVED_LOSS = 5e-4
_UNRESOLVED_WORK = 2e-4
# Of the work so far, the part by which the pressure's curvature may matter in a step without events, unless work and
# energy agree within the other one.
_ROUGH_WORK = 1e-4
_BALANCED_WORK = 3e-6
# Unions and their undoing are found within this part of the longest step.
_UNITING_STEP = 1 / 16
# Of the largest tension so far, the part by which it may be missed between two equilibria: at an event, and else.
_MISSED_TENSION = 1e-3
_MISSED_SMOOTH_TENSION = 1e-8
# The first contact is made and the last one broken within this change of separation, in h_rms.
_SHARP = 1e-12


@dataclass(frozen=True)
class Target:
    """One stop of a path: the kind of quantity, its value (SI units), and whether it is a snapshot."""

    kind: str
    value: float
    snapshot: bool = False


@dataclass(frozen=True, init=False)
class Path:
    """Stops of a path, and the longest step between them.

    Parameters
    ----------
    reduced_pressures : p/(E* h'_rms), increasing, in (0, 0.15].
    area_fractions : A/A0, increasing, in (0, 0.25].
    mean_separations : u in m, decreasing, positive. Exactly one of these three lists is given.
    snapshots : pairs (kind, value), in any order, of states whose fields and spots are kept, with kind one of
        "reduced_pressure", "relative_load" (F/(E* A0)), "area_fraction" and "mean_separation" (m). A snapshot is a stop
        of its own, unless the list holds the same kind and value; the dataset has them in the order in which they are
        met. None: the last stop of the list.
    turning_points : pairs (kind, value) at which the path turns after its last stop: the first ends unloading, the
        second loading, and so on. Kinds as for snapshots; loads may be tensile (negative) or zero.
    unload : whether the path ends with complete separation, met by the stops once more on the way.
    control : "separation": the mean separation is imposed. "load": the load is; the state runs along the same curve
        and jumps, at constant load, where it would have to turn back. Then all stops and turning points are loads.
    united_until : until when united spots stay united on the way back: "detachment", where they let go as a whole and
        fall back into their asperities, or "overlap", where the two spots that they were made of would just touch.
    max_step : longest change of the mean separation between two equilibria, in units of h_rms, in (0, 0.5].

    Raises
    ------
    ValueError
        Naming the argument whose value is not allowed.
    """

    targets: tuple[Target, ...]
    turning_points: tuple[Target, ...]
    unload: bool
    control: str
    united_until: str
    max_step: float

    def __init__(
        self,
        reduced_pressures=None,
        area_fractions=None,
        mean_separations=None,
        *,
        snapshots=None,
        turning_points=(),
        unload=False,
        control=SEPARATION_CONTROL,
        united_until=DETACHMENT,
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
        if not isinstance(unload, bool):
            raise ValueError(f"unload: {unload!r} is neither True nor False")
        if control not in CONTROLS:
            raise ValueError(f"control: {control!r} must be one of {', '.join(CONTROLS)}")
        if united_until not in UNITED_UNTIL:
            raise ValueError(f"united_until: {united_until!r} must be one of {', '.join(UNITED_UNTIL)}")
        max_step = positive("max_step", max_step, "h_rms")
        if max_step > MAX_STEP:
            raise ValueError(f"max_step: {max_step!r} must not exceed {MAX_STEP} (in h_rms)")
        ((kind, (name, values)),) = given.items()
        values = _stops(name, kind, values)
        if snapshots is None:
            snapshots = [(kind, values[-1])]
        wanted = []
        for label, snapshot_kind, value in _pairs("snapshots", snapshots):
            value = _covered(label, snapshot_kind, value)
            if (snapshot_kind, value) in wanted:
                raise ValueError(f"{label}: {snapshot_kind} {value!r} is given twice")
            wanted.append((snapshot_kind, value))
        targets = [Target(kind, value, (kind, value) in wanted) for value in values]
        targets += [Target(k, v, True) for k, v in wanted if k != kind or v not in values]
        turns = _turns(turning_points, targets[len(values) - 1])
        if control == LOAD_CONTROL:
            for target in (*targets, *turns):
                if target.kind not in (REDUCED_PRESSURE, RELATIVE_LOAD):
                    raise ValueError(
                        f"control: {control!r} with the stop {target.kind} = {target.value:g}; allowed: stops and "
                        "turning points that are loads"
                    )
            if not turns and not unload:
                raise ValueError(
                    f"control: {control!r} without a way back; allowed: {SEPARATION_CONTROL!r}, or a path that unloads "
                    "or has turning points"
                )
        object.__setattr__(self, "targets", tuple(targets))
        object.__setattr__(self, "turning_points", turns)
        object.__setattr__(self, "unload", unload)
        object.__setattr__(self, "control", control)
        object.__setattr__(self, "united_until", united_until)
        object.__setattr__(self, "max_step", max_step)

    @property
    def cyclic(self) -> bool:
        """Whether the path goes on after the first loading."""
        return self.unload or bool(self.turning_points)


def _pairs(name, pairs):
    """Label, kind and value of every pair of a list."""
    if not isinstance(pairs, list | tuple):
        raise ValueError(f"{name}: {pairs!r} is not a list of pairs (kind, value)")
    for index, pair in enumerate(pairs):
        label = f"{name}[{index}]"
        try:
            kind, value = pair
        except (TypeError, ValueError):
            raise ValueError(f"{label}: {pair!r} is not a pair (kind, value)") from None
        if kind not in KINDS:
            raise ValueError(f"{label}: kind {kind!r} must be one of {', '.join(KINDS)}")
        yield label, kind, value


def _turns(turning_points, last):
    """The turning points, which lie before and beyond each other in turn, as far as they are of one kind."""
    turns, before = [], last
    for k, (label, kind, value) in enumerate(_pairs("turning_points", turning_points)):
        tensile = kind in (REDUCED_PRESSURE, RELATIVE_LOAD) and k % 2 == 0
        value = number(label, value, "1") if tensile else _covered(label, kind, value)
        if kind == before.kind:
            opened = value > before.value if kind == MEAN_SEPARATION else value < before.value
            if value == before.value or opened != (k % 2 == 0):
                way = "unloading" if k % 2 == 0 else "loading"
                side = "less" if (k % 2 == 0) != (kind == MEAN_SEPARATION) else "more"
                raise ValueError(
                    f"{label}: {value!r} cannot end {way} that begins at {before.value!r}; allowed: {side} than that"
                )
        before = Target(kind, value)
        turns.append(before)
    return tuple(turns)


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

    def __init__(self, message: str, stop: _Stop, before: State):
        """Keep which stop, and where the path can go on."""
        super().__init__(message)
        self.stop, self.before = stop, before


@dataclass(frozen=True, eq=False)
class _Stop:
    """A target turned into a function of the state that is zero at the target and rises on loading."""

    target: Target
    contact: ContactModel
    pressure_scale: float

    def excess(self, state: State) -> float:
        """Relative excess of the state over the target; of a load that is zero in units of its scale."""
        kind, value = self.target.kind, self.target.value
        if kind == MEAN_SEPARATION:
            return (value - state.separation) / self.contact.rms_height
        if kind == AREA_FRACTION:
            return self.contact.area_fraction(state) / value - 1
        pressure = self.contact.pressure(state) / self.pressure_scale
        return (pressure - value) / (abs(value) or 1.0)

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
        if self.target.kind == MEAN_SEPARATION:
            return self.target.value
        value, slope = 1 + self.excess(state), self.contact.slope(self.control.quantity, state) / self.control.target
        return state.separation - np.log(value) / (slope / value) if value > 0 and slope < 0 else -np.inf

    def meet(self, state: State, separation: float) -> State:
        """The equilibrium at the target, from a state not far away; the separation is a first guess."""
        return self.contact.equilibrium(state, separation, self.control)

    def reach(self, before: State, beyond: State) -> State:
        """The state at the target, which lies between two states of the path, in either direction.

        The bracket is halved until the target is met inside it. When it closes on a jump (an event that carries the
        quantity past its target), the target is met on the branch after the event, where load control would be.
        """
        if self.control is None:
            return self.meet(before, self.target.value)
        sign = 1.0 if beyond.separation < before.separation else -1.0
        for _ in range(80):
            width = sign * (before.separation - beyond.separation)
            if width <= _SAME_SEPARATION * self.contact.rms_height:
                try:
                    return self.meet(beyond, beyond.separation)
                except NotConverged:
                    raise self._inside_jump(before, beyond) from None
            try:
                met = self.meet(before, self._between(before, beyond))
                if 0 < sign * (before.separation - met.separation) <= width:
                    return met
            except NotConverged:
                pass
            try:
                middle = self.contact.equilibrium(before, beyond.separation + sign * 0.5 * width)
            except NotConverged:
                if width > _CLOSE_TO_A_JUMP * self.contact.rms_height:
                    raise
                raise self._inside_jump(before, beyond) from None
            if sign * self.excess(middle) >= 0:
                beyond = middle
            else:
                before = middle
        raise NotConverged("the search for the target did not end")

    def _between(self, before, beyond):
        """A guess of the separation at the target."""
        if beyond.separation < before.separation and self.target.value > 0:
            return max(self.expected_separation(before), beyond.separation)
        start, end = self.excess(before), self.excess(beyond)
        return before.separation + start / (start - end) * (beyond.separation - before.separation)

    def _inside_jump(self, before, beyond):
        low, high = (self.contact.area_fraction(state) for state in (before, beyond))
        return InsideJump(
            f"{_name(self.target)} lies inside a jump: at a mean separation of "
            f"{beyond.separation / self.contact.rms_height:.4f} h_rms the contact area jumps from {low:.3g} to "
            f"{high:.3g} of the nominal one, and its far side does not reach back to the target; leave it out, or give "
            "the path by mean separations",
            self,
            before,
        )


@dataclass(frozen=True, eq=False)
class Waypoint:
    """An equilibrium on a path: what it was asked to reach, and on which leg (0 the first loading, 1 back, …).

    balance: of the energy, on a cyclic path.
    """

    target: Target
    state: State
    leg: int = 0
    balance: EnergyBalance | None = None

    @property
    def loading(self) -> bool:
        """Whether the surfaces are being pressed together."""
        return self.leg % 2 == 0


def follow(
    contact: ContactModel,
    path: Path,
    pressure_unit: float,
    progress: Callable[[str], None] | None = None,
) -> Iterator[Waypoint]:
    """Follow the path and yield its waypoints in the order in which they are met.

    Of a path that ends with the first loading these are its targets; of a cyclic one all its equilibria.

    Parameters
    ----------
    contact : the contact problem.
    path : its stops.
    pressure_unit : E* h'_rms in Pa, the unit of reduced pressures.
    progress : called with a line of text at every stop.

    Raises
    ------
    NotConverged
        If an equilibrium is not found even with short steps, or a target lies beyond what the model covers. Stops that
        lie inside a jump are left out; on the first loading those after them are yielded before the error is raised.
    """
    scale = {REDUCED_PRESSURE: pressure_unit, RELATIVE_LOAD: contact.contact_modulus}
    journey = _Journey(contact, path, scale, progress)
    if not path.cyclic:
        yield from journey.load()
        return
    waypoints = journey.cycle()
    if path.control == LOAD_CONTROL:
        yield from _under_load(contact, waypoints)
        return
    before, balance = None, EnergyBalance()
    for waypoint in waypoints:
        if before is not None:
            balance = balance.after(contact, Step.between(contact, before, waypoint.state))
        before = waypoint.state
        yield replace(waypoint, balance=balance)


class _Journey:
    """The way along a path: where it is, how long its steps are, and which stops are still to come."""

    def __init__(self, contact, path, scale, progress):
        self.contact, self.path, self.scale, self.progress = contact, path, scale, progress
        self.longest = path.max_step * contact.rms_height
        self.step = self.longest
        self.first_contact = self.state = contact.untouched()
        self.missed, self.reached, self.loading = [], 0, True
        self.stations = []  # separations met on the way in, in increasing order
        self.total = len(path.targets)
        self.event_at = np.inf  # where, counted along the leg, events were seen that are not resolved yet
        self.effort = 0.0  # work and losses of all steps so far, without their signs
        self.jumped = 0.0  # energy that jumps have set free so far, as if every spot were alone
        self.lowest = 0.0  # pressure so far

    def _stop(self, target):
        return _Stop(target, self.contact, self.scale.get(target.kind, 1.0))

    def _end(self, *failures):
        reasons = [*self.missed, *failures]
        return NotConverged(_epitaph(self.contact, self.state, self.reached, self.total, reasons, self.loading))

    def _shorten(self, failure):
        """Halve the step after an equilibrium that was not found."""
        self.step /= 2
        if self.step < _SMALLEST_STEP * self.longest:
            raise self._end(failure) from failure

    def _arrive(self, state, stop, waiting):
        """Go to a state, at a stop or before those that wait, where the model still holds."""
        what = _name((stop or waiting[0]).target) if stop or waiting else "separation"
        area = self.contact.area_fraction(state)
        if area > _AREA_MARGIN * MAX_AREA_FRACTION:
            reason = f"the contact area runs to {area:.2f} of the nominal one, beyond what the model covers,"
            raise self._end(NotConverged(f"{reason} before {what}"))
        self.state = state
        if stop is None and self.contact.mean_gap(state) <= 0:
            raise self._end(NotConverged(f"the mean planes met before {what}, beyond what the model covers"))

    def _tell(self, name):
        if self.progress is not None:
            state, contact = self.state, self.contact
            self.progress(
                f"{name}, separation {state.separation / contact.rms_height:.4f} h_rms, "
                f"A/A0 {contact.area_fraction(state):.4e}, {contact.spot_count(state)} spots"
            )

    def _tell_stop(self, target):
        self.reached += 1
        self._tell(f"stop {self.reached} of {self.total}: {_name(target, 6)}")

    # --- the first loading alone: straight from stop to stop ------------------------------------------------

    def load(self) -> Iterator[Waypoint]:
        """The stops of a path that ends with the first loading."""
        waiting = [self._stop(target) for target in self.path.targets]
        while waiting:
            if not self.contact.spot_count(self.state) and self.state.separation > self.first_contact.separation:
                self.state = self.first_contact  # nothing happens on the way there
            try:
                stop, beyond = _aim(waiting, self.state, self.step) or self._pass(waiting)
            except InsideJump as jump:
                waiting.remove(jump.stop)
                self.missed.append(jump)
                self.state = jump.before
                continue
            except NotConverged as failure:
                self._shorten(failure)
                continue
            self.step = min(self.longest, 2 * self.step)
            self._arrive(beyond, stop, waiting)
            if stop is None:
                continue
            waiting.remove(stop)
            self._tell_stop(stop.target)
            yield Waypoint(stop.target, beyond)
        if self.missed:
            raise self._end()

    def _pass(self, waiting):
        """A step of the separation: the stop that it passes first, and its state; or None and the state after it."""
        beyond = self.contact.equilibrium(self.state, self.state.separation - self.step)
        return self._first_passed(waiting, beyond, -1)

    def _first_passed(self, waiting, beyond, direction):
        """The stop passed first on the way to the state `beyond`, and its state; or None and `beyond`."""
        first = None, beyond
        for stop in waiting:
            if abs(stop.excess(beyond)) <= _SAME_EXCESS and first[0] is None:
                first = stop, beyond
            elif direction * stop.excess(beyond) <= 0:
                met = stop.reach(self.state, beyond)
                if first[0] is None or direction * (met.separation - first[1].separation) < 0:
                    first = stop, met
        return first

    # --- to and fro: every equilibrium ----------------------------------------------------------------------

    def cycle(self) -> Iterator[Waypoint]:
        """All equilibria of a path that goes on after the first loading."""
        path = self.path
        yield self._between(0)
        if self.contact.adhesive:
            self.step = _SHARP * self.contact.rms_height
        yield from self._until(0, [self._stop(t) for t in path.targets])
        if self.missed:
            raise self._end()
        for leg, turn in enumerate(path.turning_points, start=1):
            stop = self._stop(turn)
            if (stop.excess(self.state) > 0) != (leg % 2 == 1):
                raise self._end(NotConverged(f"the turning point {_name(turn)} lies behind where leg {leg} begins"))
            yield from self._until(leg, [stop])
            self._tell(f"turning point {_name(turn)}")
        if path.unload:
            leg = len(path.turning_points) + (len(path.turning_points) % 2 == 0)
            stops = [self._stop(replace(target, snapshot=False)) for target in path.targets]
            yield from self._until(leg, [s for s in stops if s.excess(self.state) > _SAME_EXCESS], apart=True)
            self._tell("apart")

    def _between(self, leg):
        return Waypoint(Target(BETWEEN, self.state.separation), self.state, leg)

    def _until(self, leg, waiting, apart=False) -> Iterator[Waypoint]:
        """One leg: until all stops are met or, `apart`, nothing touches any more."""
        direction, self.loading = (1, False) if leg % 2 else (-1, True)
        waiting, visited, self.event_at = list(waiting), [self.state.separation], np.inf
        # Not every separation around an event is one to come back to.
        between = self.longest / 64 if self.contact.adhesive else _SAME_SEPARATION * self.contact.rms_height
        highest = self.first_contact.separation - _SAME_SEPARATION * self.contact.rms_height
        while waiting or apart:
            if direction > 0 and not self.contact.spot_count(self.state) and self.state.separation >= highest:
                if apart:
                    return
                raise self._end(NotConverged(self._never_so_far(waiting[0].target)))
            beyond, step = self._resolved(direction)
            try:
                stop, met = self._first_passed(waiting, beyond, direction)
            except InsideJump as jump:
                waiting.remove(jump.stop)
                if not apart:
                    self.missed.append(jump)
                    if leg:
                        raise self._end() from None
                continue
            except NotConverged as failure:
                self._shorten(failure)
                continue
            if met is not beyond:
                step = Step.between(self.contact, self.state, met)
            self._arrive(met, stop, waiting)
            self.effort += abs(step.work) + abs(step.lost)
            self.jumped += step.set_free(self.contact)
            self.lowest = min(self.lowest, self.contact.pressure(met))
            first = leg == 0 and len(visited) == 1
            self.step = self.longest if first else min(self.longest, 2 * self.step)
            if abs(met.separation - visited[-1]) > between:
                visited.append(met.separation)
            if stop is None:
                yield self._between(leg)
                continue
            waiting.remove(stop)
            if leg == 0:
                self._tell_stop(stop.target)
            yield Waypoint(stop.target, met, leg)
        if direction < 0:
            # A way back meets the separations of the way in; what an inner loop adds to them it takes away again.
            lowest = min(self.stations, default=np.inf)
            self.stations = sorted({*self.stations, *(s for s in [*visited, self.state.separation] if s < lowest)})

    def _never_so_far(self, target):
        """That the surfaces come apart before a turning point; of a load, what tension they bear."""
        reason = f"the surfaces are apart before the turning point {_name(target)}"
        if target.kind in self.scale:
            reason += f"; the largest tension is {max(-self.lowest / self.scale[target.kind], 0.0):.4g}"
        return reason

    def _next_station(self, direction):
        """How far it is to the next separation of the way in; without one a step."""
        apart = _SAME_SEPARATION * self.contact.rms_height
        ahead = [d for d in ((s - self.state.separation) * direction for s in self.stations) if d > apart]
        return min(ahead, default=self.step)

    def _resolved(self, direction):
        """The next equilibrium, near enough that the work up to it is known, and the step to it.

        On the way back the spots may lose their equilibrium together before any of them has come to its own jump-off:
        then the one that is nearest to it, at the rate at which all of them run towards it, lets go.
        """
        start, width = self.state, self._next_station(direction)
        while True:
            collective = direction > 0 and self.contact.adhesive and width < _CLOSE_TO_A_JUMP * self.contact.rms_height
            try:
                beyond = self._equilibrium(start, start.separation + direction * width, collective)
            except NotConverged as failure:
                self._shorten(failure)
                width = min(0.5 * width, self.step)
                continue
            step = Step.between(self.contact, start, beyond)
            sharp = _SHARP * self.contact.rms_height
            # Within the accuracy of an equilibrium an event may happen after a long step and not after a short one.
            passed = step.sudden and direction * start.separation + sharp >= self.event_at
            if width <= sharp or passed:
                self.event_at = np.inf if step.sudden else self.event_at
                return beyond, step
            if self._is_resolved(start, beyond, step):
                self.event_at = np.inf if step.sudden else self.event_at
                at = self._largest_tension(start, beyond, step)
                if at is None:
                    return beyond, step
                width = at - start.separation
            else:
                if step.sudden:
                    self.event_at = min(self.event_at, direction * beyond.separation)
                width *= 0.5
            self.step = min(self.step, width)

    def _equilibrium(self, start, separation, collective):
        """The equilibrium at a separation; if there is none and it may be lost `collectively`, with spots let go."""
        try:
            beyond = self.contact.equilibrium(start, separation)
            if separation > start.separation and self.contact.is_unstable(beyond):
                raise NotConverged("spots would come closer as the surfaces part: an unstable equilibrium")
            return beyond
        except NotConverged:
            if not collective:
                raise
        count = 1
        while True:
            try:
                return self.contact.equilibrium(start, separation, let_go=count)
            except NotConverged:
                count *= 2
                if count > self.contact.spot_count(start):
                    raise

    def _is_resolved(self, start, beyond, step):
        effort = self.effort + abs(step.work) + abs(step.lost)
        jumped = _UNRESOLVED_LOSS * (self.jumped + step.set_free(self.contact))
        if step.unresolved > (jumped or _UNRESOLVED_WORK * effort):
            return False
        # What a union makes of two spots depends on how far they overlap when it is found.
        if step.unites and abs(step.width) > _UNITING_STEP * self.longest:
            return False
        scale = effort
        if step.width > 0 and self.contact.pressure(beyond) < 0:
            scale = min(effort, 10 * self.jumped)  # there is no way in here that has the same error
        unbalanced = step.roughness > _ROUGH_WORK * scale and abs(step.lost) > _BALANCED_WORK * scale
        if not step.sudden and unbalanced and abs(step.width) > self.longest / 256:
            return False
        if step.width < 0:
            return True
        if self.contact.adhesive and self.contact.spot_count(start) and not self.contact.spot_count(beyond):
            return False  # the last contact breaks: seen as sharply as can be
        if not step.pressure_jump:
            return True
        # The pressure has fallen on along its tangent until the event.
        p, slope = self.contact.pressure(start), -self.contact.stiffness(start)
        lowest, deepest = min(p, p + step.width * slope), min(p, self.contact.pressure(beyond))
        return lowest >= self.lowest or deepest - lowest <= _MISSED_TENSION * abs(lowest)

    def _largest_tension(self, start, beyond, step):
        """Where between two states without an event the tension is largest, if it is a new largest one; else None."""
        slope, end_slope = (-self.contact.stiffness(state) for state in (start, beyond))
        if step.width < 0 or step.pressure_jump or not slope < 0 < end_slope:
            return None
        p, q = (self.contact.pressure(state) for state in (start, beyond))
        # The tangents meet below the curve.
        meet = (q - end_slope * step.width - p) / (slope - end_slope)
        lowest = p + slope * meet
        if lowest >= self.lowest or min(p, q) - lowest <= _MISSED_SMOOTH_TENSION * abs(lowest):
            return None
        curve = CubicHermiteSpline([0.0, step.width], [p, q], [slope, end_slope])
        turns = [u for u in curve.derivative().roots(extrapolate=False) if 0 < u < step.width]
        return start.separation + (min(turns, key=curve) if turns else meet)


def _under_load(contact, waypoints) -> Iterator[Waypoint]:
    """Of the states of a path those that load control visits.

    Where the pressure would have to go back, the state jumps at constant pressure to where the curve goes on; with the
    last contact, to where nothing touches any more.
    """
    visited = hidden = None
    balance = EnergyBalance()
    level = 0.0
    for waypoint in waypoints:
        state = waypoint.state
        pressure = contact.pressure(state)
        ahead = pressure >= level if waypoint.loading else pressure <= level
        # The turning point itself begins the next leg; without contact there is nothing yet to jump from.
        if visited is not None and not ahead:
            hidden = waypoint
            continue
        if hidden is not None:
            landed = waypoint.state
            if pressure != level:
                stop = _Stop(Target(REDUCED_PRESSURE, level), contact, 1.0)
                try:
                    landed = stop.reach(hidden.state, state)
                except InsideJump:
                    pass
            work = -level * (landed.separation - visited.separation)
            balance = balance.after_load_jump(work, contact.stored_energy(landed) - contact.stored_energy(visited))
            if landed is not state:
                yield Waypoint(Target(BETWEEN, landed.separation), landed, waypoint.leg, balance)
            visited, hidden = landed, None
        if visited is not None and visited is not state:
            balance = balance.after(contact, Step.between(contact, visited, state))
        yield replace(waypoint, balance=balance)
        visited, level = state, pressure
    if hidden is not None:
        work = -level * (hidden.state.separation - visited.separation)
        balance = balance.after_load_jump(work, contact.stored_energy(hidden.state) - contact.stored_energy(visited))
        yield replace(hidden, balance=balance)


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


def _name(target, digits=None):
    return f"{target.kind} = {target.value:{f'.{digits}' if digits else ''}g}"


def _epitaph(contact, state, reached, total, failures, loading):
    """Where the path ended and why; a surface that sticks together by itself is called so."""
    pressure = contact.pressure(state)
    sticky = ""
    # Without a load, adhesion alone has spread the contact, or the very first one does not come to rest.
    lone = not contact.spot_count(state) and not any(isinstance(failure, InsideJump) for failure in failures)
    if contact.adhesive and loading and (pressure < 0 or lone):
        sticky = "; the load is not yet compressive: the surface is sticky, adhesion is pulling it towards full contact"
    return (
        f"at a mean separation of {state.separation / contact.rms_height:.4f} h_rms, "
        f"A/A0 = {contact.area_fraction(state):.3g}, after {reached} of {total} stops: "
        f"{'; '.join(map(str, failures))}{sticky}"
    )
