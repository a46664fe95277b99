"""What a path is asked to meet: separations, loads or areas within their ranges, and turning points between them."""

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

from icha.contact.model import AREA_FRACTION as HELD_AREA
from icha.contact.model import PRESSURE, ContactModel, Control, State
from icha.support.rules import LENGTH, NUMBER, POSITIVE, Real

# Beyond these the spots have lost their identity: soon after, the computed mean planes of a surface without
# adhesion meet.
MAX_REDUCED_PRESSURE = 0.15
MAX_AREA_FRACTION = 0.25
# Smaller loads, but for none at all, and areas are less than the errors of the equilibria that have them.
LEAST_PRESSURE, LEAST_AREA = 1e-12, 1e-9
# Shortest and longest step of the mean separation, in h_rms, that may be asked for, and the one taken if none is. With
# the shortest a path has some ten thousand equilibria.
MIN_STEP, MAX_STEP = 1e-4, 0.5
DEFAULT_STEP = 0.15
# Of the energy that jumps have set free so far, the part that may be unknown after a step for not knowing where in it
# its events happened.
UNRESOLVED_LOSS = 5e-4

STEP = Real("h_rms", least=MIN_STEP, most=MAX_STEP)


@dataclass(frozen=True)
class Quantity:
    """A quantity that a path can be asked to meet.

    Parameters
    ----------
    name : of one value, in targets and in files.
    unit : of its values.
    rule : values that a stop may have.
    listed : argument of `Path` that lists stops of it; empty where there is none.
    held : what a solve holds to meet it; None for the mean separation, which is imposed.
    unit_of_held : attribute of the contact that is the unit of that, Pa; empty where it has none.
    """

    name: str
    unit: str
    rule: Real
    listed: str = ""
    held: str | None = None
    unit_of_held: str = ""

    def scale(self, contact: ContactModel) -> float:
        """The unit of its values, in that of what is held."""
        return getattr(contact, self.unit_of_held) if self.unit_of_held else 1.0

    def of(self, contact: ContactModel, state: State) -> float:
        """The value of a state."""
        if self.held == PRESSURE:
            return contact.pressure(state) / self.scale(contact)
        return state.separation if self.held is None else contact.area_fraction(state)

    def control(self, contact: ContactModel, value: float) -> Control | None:
        """What a solve has to hold to meet a value; None for a separation."""
        return None if self.held is None else Control(self.held, value * self.scale(contact))


REDUCED_PRESSURE, RELATIVE_LOAD = "reduced_pressure", "relative_load"
AREA_FRACTION, MEAN_SEPARATION = "area_fraction", "mean_separation"
QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity(
            REDUCED_PRESSURE,
            "1",
            Real(least=LEAST_PRESSURE, most=MAX_REDUCED_PRESSURE, model_ends=True),
            "reduced_pressures",
            PRESSURE,
            "pressure_unit",
        ),
        Quantity(RELATIVE_LOAD, "1", POSITIVE, held=PRESSURE, unit_of_held="contact_modulus"),
        Quantity(
            AREA_FRACTION,
            "1",
            Real(least=LEAST_AREA, most=MAX_AREA_FRACTION, model_ends=True),
            "area_fractions",
            HELD_AREA,
        ),
        Quantity(MEAN_SEPARATION, "m", LENGTH, "mean_separations"),
    )
}
LOADS = tuple(name for name, quantity in QUANTITIES.items() if quantity.held == PRESSURE)
# By the kind of their values, the arguments that list the stops of a path.
LISTS = {name: quantity.listed for name, quantity in QUANTITIES.items() if quantity.listed}
# What an equilibrium between the stops of a path is asked to reach: its mean separation.
BETWEEN = "path"

# Kinds of which values are in m; those of all others have no unit.
IN_METRES = (*(name for name, quantity in QUANTITIES.items() if quantity.unit == "m"), BETWEEN)

SEPARATION_CONTROL, LOAD_CONTROL = "separation", "load"
CONTROLS = (SEPARATION_CONTROL, LOAD_CONTROL)


@dataclass(frozen=True)
class Target:
    """One stop of a path: the kind of quantity, its value (SI units), and whether it is a snapshot."""

    kind: str
    value: float
    snapshot: bool = False

    @property
    def quantity(self) -> Quantity:
        """What is to be met."""
        return QUANTITIES[self.kind]

    def named(self, digits: int | None = None) -> str:
        """Kind and value in words."""
        return f"{self.kind} = {self.value:{f'.{digits}' if digits else ''}g}"


@dataclass(frozen=True, init=False)
class Path:
    """Stops of a path, and the longest step between them.

    Parameters
    ----------
    reduced_pressures : p/(E* h'_rms), increasing, in [1e-12, 0.15].
    area_fractions : A/A0, increasing, in [1e-9, 0.25].
    mean_separations : u in m, decreasing, in [1e-24, 1e9]. Exactly one of these three lists is given.
    snapshots : pairs (kind, value), in any order, of states whose fields and spots are kept, with kind one of
        "reduced_pressure", "relative_load" (F/(E* A0)), "area_fraction" and "mean_separation" (m). A snapshot is a stop
        of its own, unless the list holds the same kind and value; the dataset has them in the order in which they are
        met. None: the last stop of the list.
    turning_points : pairs (kind, value) at which the path turns after its last stop: the first ends unloading, the
        second loading, and so on. Kinds as for snapshots; loads may be tensile (negative) or zero.
    unload : whether the path ends with complete separation, met by the stops once more on the way, but for those above
        first contact.
    control : "separation": the mean separation is imposed. "load": the load is; the state runs along the same curve
        and jumps, at constant load, where it would have to turn back. Then all stops and turning points are loads.
    max_step : longest change of the mean separation between two equilibria, in units of h_rms, in [1e-4, 0.5].

    Raises
    ------
    ValueError
        Naming the argument whose value is not allowed.
    """

    targets: tuple[Target, ...]
    turning_points: tuple[Target, ...]
    unload: bool
    control: str
    max_step: float

    def __init__(
        self,
        reduced_pressures: Iterable[float] | None = None,
        area_fractions: Iterable[float] | None = None,
        mean_separations: Iterable[float] | None = None,
        *,
        snapshots: Iterable[tuple[str, float]] | None = None,
        turning_points: Iterable[tuple[str, float]] = (),
        unload: bool = False,
        control: str = SEPARATION_CONTROL,
        max_step: float = DEFAULT_STEP,
    ) -> None:
        """Check the values and build the list of stops."""
        kind, values = _one_list(reduced_pressures, area_fractions, mean_separations)
        if not isinstance(unload, bool):
            raise ValueError(f"unload: {unload!r} is neither True nor False")
        if control not in CONTROLS:
            raise ValueError(f"control: {control!r} must be one of {', '.join(CONTROLS)}")
        max_step = STEP.checked("max_step", max_step)
        values = _stops(LISTS[kind], kind, values)
        wanted = _wanted([(kind, values[-1])] if snapshots is None else snapshots)
        targets = [Target(kind, value, (kind, value) in wanted) for value in values]
        listed = set(values)
        targets += [Target(k, v, True) for k, v in wanted if k != kind or v not in listed]
        turns = _turns(turning_points, targets[len(values) - 1])
        if control == LOAD_CONTROL:
            _require_loads((*targets, *turns), unload or bool(turns))
        object.__setattr__(self, "targets", tuple(targets))
        object.__setattr__(self, "turning_points", turns)
        object.__setattr__(self, "unload", unload)
        object.__setattr__(self, "control", control)
        object.__setattr__(self, "max_step", max_step)

    @property
    def cyclic(self) -> bool:
        """Whether the path goes on after the first loading."""
        return self.unload or bool(self.turning_points)


def _one_list(*lists):
    """Kind and values of the one list that is given."""
    given = {kind: values for kind, values in zip(LISTS, lists, strict=True) if values is not None}
    if len(given) != 1:
        raise ValueError(
            f"{', '.join(LISTS.values())}: exactly one must be given, "
            f"not {', '.join(LISTS[kind] for kind in given) or 'none'}"
        )
    ((kind, values),) = given.items()
    return kind, values


def _wanted(snapshots):
    """Kinds and values of the snapshots."""
    wanted = {}
    for label, kind, value in _pairs("snapshots", snapshots):
        value = QUANTITIES[kind].rule.checked(label, value)
        if (kind, value) in wanted:
            raise ValueError(f"{label}: {kind} {value!r} is given twice")
        wanted[kind, value] = None
    return wanted


def _require_loads(targets, goes_back):
    """Refuse what has no meaning where the load is imposed."""
    for target in targets:
        if target.kind not in LOADS:
            raise ValueError(
                f"control: {LOAD_CONTROL!r} with the stop {target.kind} = {target.value:g}; allowed: stops and "
                "turning points that are loads"
            )
    if not goes_back:
        raise ValueError(
            f"control: {LOAD_CONTROL!r} without a way back; allowed: {SEPARATION_CONTROL!r}, or a path that unloads "
            "or has turning points"
        )


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
        if kind not in QUANTITIES:
            raise ValueError(f"{label}: kind {kind!r} must be one of {', '.join(QUANTITIES)}")
        yield label, kind, value


def _turns(turning_points, last):
    """The turning points, which lie before and beyond each other in turn, as far as they are of one kind."""
    turns, before = [], last
    for k, (label, kind, value) in enumerate(_pairs("turning_points", turning_points)):
        tensile = kind in LOADS and k % 2 == 0
        value = (NUMBER if tensile else QUANTITIES[kind].rule).checked(label, value)
        if tensile and 0 < abs(value) < LEAST_PRESSURE and kind == REDUCED_PRESSURE:
            raise ValueError(
                f"{label}: {value!r} is next to no load; allowed: 0, or an absolute value of at least "
                f"{LEAST_PRESSURE:g}"
            )
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


def _stops(name, kind, given):
    try:
        # Bytes would be numbers.
        values = None if isinstance(given, str | bytes) else list(given)
    except TypeError:
        values = None
    if values is None:
        raise ValueError(f"{name}: {given!r} is not a list of numbers")
    if not values:
        raise ValueError(f"{name}: the list is empty")
    values = [QUANTITIES[kind].rule.checked(f"{name}[{i}]", v) for i, v in enumerate(values)]
    for i, (one, next_one) in enumerate(itertools.pairwise(values)):
        if not (next_one < one if kind == MEAN_SEPARATION else next_one > one):
            order = "decreasing" if kind == MEAN_SEPARATION else "increasing"
            raise ValueError(f"{name}[{i + 1}]: {next_one!r} after {one!r}; the list must be strictly {order}")
    return values
