"""Targets of a path: separations, loads or areas with their ranges, and turning points."""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from icha.contact.model import AREA_FRACTION as CONTROLLED_AREA
from icha.contact.model import PRESSURE, ContactModel, Control, State
from icha.support.formatting import format_quantity, html_table
from icha.support.rules import FORCES, INDENTATIONS, LENGTH, NUMBER, PRESSURES, FloatRange

# Largest reduced pressure and area fraction of a target with the asperity model. At larger values the spots are not
# separate, and without adhesion the mean gap soon becomes zero.
MAX_REDUCED_PRESSURE = 0.15
MAX_AREA_FRACTION = 0.25
# Limits of the asperity model, from a comparison on sixty surfaces (`validation/applicability.py`): largest contact
# area fraction, divided by U_full/dgamma, and smallest mean gap, divided by h_rms.
_AREA_PER_ENERGY_RATIO = 0.02
LEAST_GAP = 0.3
# Largest reduced pressure of any target. Rough surfaces are in full contact at a reduced pressure of about 1.
LARGEST_REDUCED_PRESSURE = 100.0
# Smallest nonzero reduced pressure and smallest area fraction. Smaller values are below the error of an equilibrium.
LEAST_PRESSURE, LEAST_AREA = 1e-12, 1e-9
# Limits and default of the longest step of the separation, in h_rms. With 1e-4 a path has some 10 000 equilibria.
MIN_STEP, MAX_STEP = 1e-4, 0.5
DEFAULT_STEP = 0.15

STEP = FloatRange("h_rms", least=MIN_STEP, most=MAX_STEP)


@dataclass(frozen=True)
class TargetQuantity:
    """Quantity that a target prescribes.

    Attributes
    ----------
    name : name in targets and in files.
    rule : range and unit of the values that a target may have.
    controlled : PRESSURE or CONTROLLED_AREA if the solver prescribes this quantity; None for a separation.
    scale : function of the contact: the factor that converts a target, or the power of a target, to the unit of the
        solver. The result is a pressure (Pa), an area fraction or a separation (m).
    power : power of the target that the solver prescribes: 2 for a contact radius, otherwise 1.
    plural : name of a list of targets; except for relative loads, `Path` has an argument of this name.
    """

    name: str
    rule: FloatRange
    controlled: str | None
    scale: Callable[[ContactModel], float]
    power: int = 1
    plural: str = ""

    def __post_init__(self):
        """Set the default plural."""
        object.__setattr__(self, "plural", self.plural or f"{self.name}s")

    def evaluate(self, contact: ContactModel, state: State) -> float:
        """Return the value of the quantity in a state, in the same unit as the value of a target."""
        if self.controlled is None:
            found = state.separation
        else:
            found = contact.pressure(state) if self.controlled == PRESSURE else contact.area_fraction(state)
        return (found / self.scale(contact)) ** (1 / self.power)

    def prescribed(self, contact: ContactModel, value: float) -> float:
        """Return the pressure (Pa), area fraction or separation (m) of a target value."""
        return value**self.power * self.scale(contact)

    def control(self, contact: ContactModel, value: float) -> Control | None:
        """Return the load or area that the solver must prescribe for a target value; None for a separation."""
        return None if self.controlled is None else Control(self.controlled, self.prescribed(contact, value))


REDUCED_PRESSURE, RELATIVE_LOAD = "reduced_pressure", "relative_load"
NOMINAL_PRESSURE, FORCE = "pressure", "force"
AREA_FRACTION, CONTACT_RADIUS = "area_fraction", "contact_radius"
MEAN_SEPARATION, INDENTATION = "mean_separation", "indentation"
_PRESSURES = FloatRange(most=LARGEST_REDUCED_PRESSURE)
_AREAS = FloatRange(least=LEAST_AREA, most=1.0)
# Ranges of targets with the asperity model.
ASPERITY_RANGES = {
    REDUCED_PRESSURE: FloatRange(most=MAX_REDUCED_PRESSURE, model_ends=True),
    AREA_FRACTION: FloatRange(least=LEAST_AREA, most=MAX_AREA_FRACTION, model_ends=True),
}
QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        TargetQuantity(REDUCED_PRESSURE, _PRESSURES, PRESSURE, lambda contact: contact.pressure_unit),
        TargetQuantity(RELATIVE_LOAD, NUMBER, PRESSURE, lambda contact: contact.contact_modulus),
        TargetQuantity(AREA_FRACTION, _AREAS, CONTROLLED_AREA, lambda contact: 1.0),
        TargetQuantity(MEAN_SEPARATION, LENGTH, None, lambda contact: 1.0),
        TargetQuantity(NOMINAL_PRESSURE, PRESSURES, PRESSURE, lambda contact: 1.0),
        TargetQuantity(FORCE, FORCES, PRESSURE, lambda contact: 1 / contact.area),
        TargetQuantity(INDENTATION, INDENTATIONS, None, lambda contact: -1.0),
        TargetQuantity(
            CONTACT_RADIUS, LENGTH, CONTROLLED_AREA, lambda contact: math.pi / contact.area, 2, "contact_radii"
        ),
    )
}
LOADS = (REDUCED_PRESSURE, RELATIVE_LOAD, NOMINAL_PRESSURE, FORCE)
AREAS = (AREA_FRACTION, CONTACT_RADIUS)
# Quantities of a state whose means are estimated, with the kinds of targets that prescribe the quantity.
ESTIMATED_AT_TARGETS: dict[str, tuple[str, ...]] = {
    "contact_area_fraction": AREAS,
    "mean_gap": (MEAN_SEPARATION, INDENTATION),
    "contact_stiffness": (),
    "spot_count": (),
    "nominal_pressure": LOADS,
}
# Quantities of a loop whose means are estimated.
ESTIMATED_OF_LOOPS: tuple[str, ...] = ("pull_off_pressure", "hysteresis_loss")
# Quantities per nominal area, which mean nothing for one square such as a lens, and further ones for a square. Some
# need adhesion.
PER_NOMINAL_AREA = (*ESTIMATED_AT_TARGETS.keys() - {"spot_count"}, *ESTIMATED_OF_LOOPS)
_OF_ADHESIVE_SQUARES = ("loss_over_contact", "work_of_adhesion_approach", "work_of_adhesion_retraction")
OF_SQUARES = ("contact_radius", "stiffness", "force", "pull_off_force", *_OF_ADHESIVE_SQUARES)
OF_ADHESION = ("pull_off_pressure", "pull_off_force", "hysteresis_loss", *_OF_ADHESIVE_SQUARES)
ESTIMATED_AT_TARGETS |= {"contact_radius": AREAS, "stiffness": (), "force": LOADS}
ESTIMATED_OF_LOOPS += tuple(name for name in OF_SQUARES if name not in ESTIMATED_AT_TARGETS)
# Estimated quantities that may be negative: the load of a contact with adhesion may be a tension.
SIGNED = ("nominal_pressure", "force")
# Kind of the target of an equilibrium between the targets of a path. The value of this target is the mean separation.
BETWEEN = "path"
# Beginning of the kind of a snapshot on the last unloading, such as "unloading_force".
UNLOADING = "unloading_"
# Units of the values of targets with a unit, by kind; the values of all other kinds have no unit.
UNITS = {name: each.rule.unit for name, each in QUANTITIES.items() if each.rule.unit != "1"} | {BETWEEN: "m"}
UNITS |= {UNLOADING + kind: unit for kind, unit in UNITS.items()}

# Reason for refusing loads that need adhesion, after the load in messages.
WITHOUT_ADHESION = "is not a load of a contact without adhesion; expected a positive load, or a positive surface_energy"

SEPARATION_CONTROL, LOAD_CONTROL = "separation", "load"


def largest_area_fraction(energy_ratio: float) -> float:
    """Return the largest contact area fraction A/A0 to which the asperity model is applicable.

    The roughness between neighbouring spots stores about U_full per nominal area when it is flattened. With a smaller
    U_full/dgamma, adhesion closes the valleys between spots of a smaller contact, and the model computes too small an
    area.

    energy_ratio : U_full/dgamma, the elastic energy of full contact divided by the work of adhesion.
    """
    return _AREA_PER_ENERGY_RATIO * energy_ratio


@dataclass(frozen=True)
class Target:
    """A state that a path must reach, or (kind BETWEEN) the mean separation of a state between targets.

    Attributes
    ----------
    kind : name of the prescribed quantity, a key of `QUANTITIES`; or BETWEEN.
    value : prescribed value, in the unit of `UNITS`.
    snapshot : whether the distributions and spots of the state are saved.
    unloading : whether the state is on the last unloading.
    """

    kind: str
    value: float
    snapshot: bool = False
    unloading: bool = False

    @property
    def quantity(self) -> TargetQuantity:
        """Prescribed quantity; `KeyError` for the kind BETWEEN."""
        return QUANTITIES[self.kind]

    @property
    def snapshot_kind(self) -> str:
        """Kind of the snapshot of this state: `kind`, with the beginning UNLOADING on the last unloading."""
        return f"{UNLOADING}{self.kind}" if self.unloading else self.kind

    @property
    def needs_adhesion(self) -> bool:
        """True for a load of zero or a tension: only adhesion gives a contact with such a load."""
        return self.kind in LOADS and self.value <= 0

    def describe(self) -> str:
        """Return a text such as `area_fraction = 0.01` or `force = -300 µN`, for messages."""
        unit = UNITS.get(self.kind)
        return f"{self.snapshot_kind} = {format_quantity(self.value, unit) if unit else f'{self.value:g}'}"


@dataclass(frozen=True, init=False)
class Path:
    """Path of loading and unloading: its targets, its turning points, and its longest step.

    Parameters
    ----------
    reduced_pressures : values of p/(E* h'_rms), increasing, at most 100; with the asperity model at most 0.15.
    area_fractions : values of A/A0, increasing, in [1e-9, 1]; with the asperity model at most 0.25.
    mean_separations : values of u in m, decreasing, in [1e-24, 1e9].
    pressures : values of the nominal pressure F/A0 in Pa, increasing, in [-1e30, 1e30].
    forces : values of the normal force in N, increasing, in [-1e30, 1e30].
    indentations : values of -u in m, increasing, in [-1e9, 1e9]; negative before the undeformed surfaces meet.
    contact_radii : values of sqrt(A/pi) in m, increasing, in [1e-24, 1e9]. Give exactly one of these seven lists. Zero
        and tensile (negative) loads need adhesion: the path meets them in contact, where the load first rises to them
        during the first loading. If the jump into contact passes such a load, the path goes back to it.
    snapshots : pairs (kind, value), in any order, of states of the first loading whose distributions and spots are
        saved. The kind is "reduced_pressure", "relative_load" (F/(E* A0)), "area_fraction", "mean_separation" (m),
        "pressure" (Pa), "force" (N), "indentation" (m) or "contact_radius" (m). A snapshot is an additional target
        unless the list contains the same kind and value. With `unloading_` in front, such as "unloading_force", a kind
        stands for a state of the last unloading; if the last unloading does not have this state, there is a warning
        and no snapshot. Snapshots are in the dataset in the order in which the path reaches them. Default: the last
        target of the list.
    turning_points : pairs (kind, value) at which the path turns after its last target: the first one ends unloading,
        the second one ends loading, and so on. The kinds are those of snapshots.
    unload : whether the path ends with complete separation. The last unloading meets again each target between its
        start and complete separation, except targets that the branch after a jump does not reach. If the number of
        turning points is odd, the last one lies on the last unloading: there the path does not turn, but continues to
        complete separation.
    control : "separation": the mean separation is prescribed. "load": the load is prescribed. All targets and turning
        points must then be loads, the targets positive, and the path must unload or have turning points. Load control
        follows the curve of separation control, but jumps at constant load where the pressure falls on loading or rises
        on unloading.
    max_step : longest change of the mean separation between two equilibria, in units of h_rms, in [1e-4, 0.5].

    Raises
    ------
    ValueError
        If an argument is not valid: wrong type, range, order or side, or repeated; the message names the argument.
    """

    targets: tuple[Target, ...]
    turning_points: tuple[Target, ...]
    unloading_snapshots: tuple[Target, ...]
    unload: bool
    control: str
    max_step: float

    def __init__(
        self,
        reduced_pressures: Iterable[float] | None = None,
        area_fractions: Iterable[float] | None = None,
        mean_separations: Iterable[float] | None = None,
        *,
        pressures: Iterable[float] | None = None,
        forces: Iterable[float] | None = None,
        indentations: Iterable[float] | None = None,
        contact_radii: Iterable[float] | None = None,
        snapshots: Sequence[tuple[str, float]] | None = None,
        turning_points: Sequence[tuple[str, float]] = (),
        unload: bool = False,
        control: str = SEPARATION_CONTROL,
        max_step: float = DEFAULT_STEP,
    ) -> None:
        """Validate the values and build the list of targets."""
        lists = {REDUCED_PRESSURE: reduced_pressures, AREA_FRACTION: area_fractions, MEAN_SEPARATION: mean_separations}
        lists |= {NOMINAL_PRESSURE: pressures, FORCE: forces, INDENTATION: indentations, CONTACT_RADIUS: contact_radii}
        given = [kind for kind, values in lists.items() if values is not None]
        if len(given) != 1:
            names, found = (", ".join(QUANTITIES[kind].plural for kind in kinds) for kinds in (lists, given))
            raise ValueError(f"{names}: expected exactly one of them, got {found or 'none'}")
        (kind,) = given
        if not isinstance(unload, bool):
            raise ValueError(f"unload: expected True or False, got {unload!r}")
        if control not in (SEPARATION_CONTROL, LOAD_CONTROL):
            raise ValueError(f"control: {control!r} must be one of {SEPARATION_CONTROL}, {LOAD_CONTROL}")
        max_step = STEP.validate("max_step", max_step)
        values = _validate_list(kind, lists[kind])
        saved = _validate_snapshots([(kind, values[-1])] if snapshots is None else snapshots, unload)
        targets = [Target(kind, value, Target(kind, value, True) in saved) for value in values]
        listed = {(kind, value) for value in values}
        turns = _validate_turning_points(turning_points, targets[-1])
        on_unloading = tuple(each for each in saved if each.unloading)
        targets += [each for each in saved if not each.unloading and (each.kind, each.value) not in listed]
        if control == LOAD_CONTROL:
            _require_loads(targets, (*turns, *on_unloading), unload)
        # A frozen dataclass sets its fields this way.
        vars(self).update(
            targets=tuple(targets),
            turning_points=turns,
            unloading_snapshots=on_unloading,
            unload=unload,
            control=control,
            max_step=max_step,
        )

    def _repr_html_(self) -> str:
        """Return a table for notebooks."""
        units = {target.kind: UNITS.get(target.kind, "") for target in self.targets}
        targets = ", ".join(f"{each.value:g} {units[each.kind]}".strip() for each in self.targets)
        rows = {QUANTITIES[self.targets[0].kind].plural.replace("_", " "): targets, "unload": str(self.unload)}
        return html_table("Path", rows | {"control": self.control})

    def within_asperity_range(self, pressure_units: Mapping[str, float]) -> Path:
        """Return a copy without loads and areas outside `ASPERITY_RANGES`; turning points always stay.

        pressure_units : load at a reduced pressure of 1, by kind of the load.
        """
        path, ranges = copy.copy(self), ASPERITY_RANGES
        within = (
            t
            for t in self.targets
            if (t.kind not in ranges or ranges[t.kind].contains(t.value))
            and t.value <= MAX_REDUCED_PRESSURE * pressure_units.get(t.kind, math.inf)
        )
        vars(path).update(targets=tuple(within))
        return path

    @property
    def cyclic(self) -> bool:
        """True if the path continues after the first loading."""
        return self.unload or bool(self.turning_points)


def _validate_list(kind, values):
    """Return the values of a list of targets as floats; raise `ValueError` if a value is out of range or order."""
    name, falls = QUANTITIES[kind].plural, kind == MEAN_SEPARATION
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise ValueError(f"{name}: expected a list of numbers, got {values!r}")
    values = [_validate_value(f"{name}[{k}]", kind, value) for k, value in enumerate(values)]
    if not values:
        raise ValueError(f"{name}: the list is empty; expected at least one number")
    for k, (one, following) in enumerate(itertools.pairwise(values), start=1):
        if not (following < one if falls else following > one):
            order = "decreasing" if falls else "increasing"
            raise ValueError(f"{name}[{k}]: {following!r} follows {one!r}; expected a strictly {order} list")
    return values


def _validate_snapshots(snapshots, unload):
    """Return the targets of all snapshots; raise `ValueError` if a value is out of range, repeated or never reached.

    The targets are the keys of a dictionary, in the order of the snapshots, because there may be thousands.
    """
    saved: dict[Target, None] = {}
    for label, name, value in _label_pairs("snapshots", snapshots, (*QUANTITIES, *(UNLOADING + k for k in QUANTITIES))):
        kind = name.removeprefix(UNLOADING)
        target = Target(kind, _validate_value(label, kind, value), True, kind != name)
        if target in saved:
            raise ValueError(f"{label}: {name} {value!r} is given twice; remove one of them")
        if target.unloading and not unload:
            raise ValueError(
                f"{label}: {value!r} is a state of unloading; expected `unload: true`, or unload=True in Python"
            )
        saved[target] = None
    return saved


def _validate_turning_points(turning_points, previous):
    """Return the turning points as targets; raise `ValueError` if a value is out of range or on the wrong side.

    A turning point that ends unloading must have a smaller load or area than the point before it, or a larger
    separation. A turning point that ends loading must have a larger load or area, or a smaller separation. Two points
    are compared only if both have the same kind. The point before the first one is `previous`, the last target.
    """
    turns = []
    for k, (label, kind, value) in enumerate(_label_pairs("turning_points", turning_points)):
        unloading = k % 2 == 0
        value = _validate_value(label, kind, value)
        falls = unloading != (kind == MEAN_SEPARATION)
        if kind == previous.kind and not (value < previous.value if falls else value > previous.value):
            leg, side = "unloading" if unloading else "loading", "less" if falls else "more"
            expected = f"expected {side} than {previous.value!r}"
            raise ValueError(f"{label}: {value!r} cannot end {leg} that begins at {previous.value!r}; {expected}")
        previous = Target(kind, value)
        turns.append(previous)
    return tuple(turns)


def _validate_value(label, kind, value):
    """Return the value of a target as a float; raise `ValueError` if it is out of range or too close to zero."""
    value = QUANTITIES[kind].rule.validate(label, value)
    if kind == REDUCED_PRESSURE and 0 < abs(value) < LEAST_PRESSURE:
        expected = f"expected 0, or an absolute value of at least {LEAST_PRESSURE:g}"
        raise ValueError(f"{label}: {value!r} is too close to zero; {expected}")
    return value


def _label_pairs(name, pairs, kinds=tuple(QUANTITIES)):
    """Yield label, such as `snapshots[0]`, kind and unchecked value of each pair; `ValueError` for an unknown kind."""
    if not isinstance(pairs, list | tuple):
        raise ValueError(f"{name}: expected a list of pairs (kind, value), got {pairs!r}")
    for index, pair in enumerate(pairs):
        label = f"{name}[{index}]"
        try:
            kind, value = pair
        except (TypeError, ValueError):
            raise ValueError(f"{label}: expected a pair (kind, value), got {pair!r}") from None
        if kind not in kinds:
            raise ValueError(f"{label}: kind {kind!r} must be one of {', '.join(kinds)}")
        yield label, kind, value


def _require_loads(targets, turns, unload):
    """Raise `ValueError` if a path under load control has targets that are not positive loads, or has no unloading."""
    for target in (*targets, *turns):
        if target.kind not in LOADS or (target.needs_adhesion and target in targets):
            expected = "expected positive loads as targets, and loads as turning points"
            raise ValueError(f"control: {LOAD_CONTROL!r} with the target {target.describe()}; {expected}")
    if not (unload or turns):
        reason = (
            f"{LOAD_CONTROL!r} without unloading changes nothing, because the path stops where it first reaches a load"
        )
        expected = f"expected {SEPARATION_CONTROL!r}, or a path that unloads or has turning points"
        raise ValueError(f"control: {reason}; {expected}")
