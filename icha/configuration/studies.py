"""Section `studies`: runs for all combinations of surfaces, seeds, slopes and materials."""

import itertools
import math
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    StrictBool,
    WithJsonSchema,
    WrapValidator,
    create_model,
    model_validator,
)

from icha.configuration.samples import Sample
from icha.configuration.surfaces import PARAMETERS
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.path.snapshots import AreaFraction, Indentation, PathState, ReducedPressure, Snapshot
from icha.path.targets import (
    ASPERITY_RANGES,
    CONTACT_RADIUS,
    DEFAULT_STEP,
    ESTIMATED_AT_TARGETS,
    ESTIMATED_OF_LOOPS,
    FORCE,
    LARGEST_REDUCED_PRESSURE,
    LEAST_PRESSURE,
    MAX_AREA_FRACTION,
    MAX_REDUCED_PRESSURE,
    NOMINAL_PRESSURE,
    QUANTITIES,
    REDUCED_PRESSURE,
    RELATIVE_LOAD,
    STEP,
    UNLOADING,
    Path,
)
from icha.support.formatting import format_quantity, length
from icha.support.rules import SLOPE, FloatRange
from icha.support.values import (
    Force,
    Length,
    Name,
    Names,
    OrSchema,
    Pressure,
    Problem,
    Section,
    Seed,
    Seeds,
    decreasing,
    distinct,
    exactly_one,
    increasing,
    number,
    quantity,
    reader,
    stops,
    to_number,
)

# Value of `rms_slopes` that means the measured slope of a topography.
MEASURED = "measured"


class RmsHeight(NamedTuple):
    """Rms height to which a surface is scaled, m."""

    metres: float


def is_unread(slope: Any) -> bool:
    """Return whether an rms slope is unknown until the file of a surface is read."""
    return slope == MEASURED or isinstance(slope, RmsHeight)


def slope_of_height(height: RmsHeight, unit: float) -> float:
    """Return the rms slope at which a surface has an rms height; `unit` is the rms height at rms slope 1, m.

    The slope has six digits, because names of files contain it.
    """
    return float(f"{height.metres / unit:.6g}")


_read_slope = reader(to_number, SLOPE, f"{SLOPE.expected}, or {MEASURED}")
_ONE_SLOPE = {"anyOf": [{"type": "number", "minimum": SLOPE.least, "maximum": SLOPE.most}, {"const": MEASURED}]}
Slope = Annotated[
    Any,
    BeforeValidator(lambda value: value if value == MEASURED else _read_slope(value)),
    WithJsonSchema(_ONE_SLOPE),
]
Slopes = Annotated[
    list[Slope],
    BeforeValidator(lambda value: [value] if value == MEASURED else value),
    Field(min_length=1),
    AfterValidator(distinct),
    WithJsonSchema({"anyOf": [{"const": MEASURED}, {"type": "array", "minItems": 1, "items": _ONE_SLOPE}]}),
]
SCALAR_SCHEMA = {"type": ["string", "number", "boolean"]}


def scalar(value: Any) -> Any:
    """Return a number, text or boolean; raise ValueError for a list or a mapping."""
    if not isinstance(value, str | int | float):
        raise ValueError("is not a single value; expected a number, a text, true or false")
    return value


Values = Annotated[
    list[Annotated[Any, AfterValidator(scalar)]],
    BeforeValidator(lambda value: value if isinstance(value, list) else [value]),
    Field(min_length=1),
    AfterValidator(distinct),
    WithJsonSchema({"anyOf": [SCALAR_SCHEMA, {"type": "array", "minItems": 1, "items": SCALAR_SCHEMA}]}),
]


class Targets(Section):
    """The targets of the loading path. Exactly one of the lists must be given.

    With adhesion, loads may be zero or tensile (negative); loading meets them in contact, where the load rises to them.
    """

    reduced_pressures: stops(ReducedPressure, increasing) | None = Field(
        default=None,
        description="Reduced pressures p/(E* h'rms), increasing. On a surface with a shape, `unit_slope` replaces "
        f"h'rms: the rms height of the shape divided by the side. Limit of the asperity model: {MAX_REDUCED_PRESSURE}.",
    )
    area_fractions: stops(AreaFraction, increasing) | None = Field(
        default=None,
        description=f"Contact area fractions A/A0, increasing. Limit of the asperity model: {MAX_AREA_FRACTION}.",
    )
    mean_separations: stops(Length, decreasing) | None = None
    """Mean separations with unit, decreasing."""
    pressures: stops(Pressure, increasing) | None = None
    """Nominal pressures F/A0 with unit, such as `[10 kPa, 20 kPa]`, increasing."""
    forces: stops(Force, increasing) | None = None
    """Normal forces with unit, such as `[1 mN, 2 mN]`, increasing."""
    indentations: stops(Indentation, increasing) | None = None
    """Indentations with unit, such as `[-50 nm, 1 um]`, increasing. The indentation is the negative separation. On a
    surface with a shape, it is zero where the apex of the smooth shape meets the undeformed half-space."""
    contact_radii: stops(Length, increasing) | None = None
    """Contact radii √(A/π) with unit, increasing. A is the contact area."""

    _check = model_validator(mode="after")(exactly_one)

    @property
    def states(self) -> list[tuple[str, float]]:
        """Kind (such as reduced_pressure) and value (SI units) of every target."""
        ((plural, values),) = self.model_dump(exclude_none=True).items()
        (kind,) = (name for name, quantity in QUANTITIES.items() if quantity.plural == plural)
        return [(kind, value) for value in values]

    @property
    def last(self) -> tuple[str, float]:
        """Kind (such as reduced_pressure) and value (SI units) of the last target."""
        return self.states[-1]


EVERY_STOP = "every_stop"
_OR_EVERY_STOP = OrSchema({"const": EVERY_STOP})


def _list_or_word(value: Any, read_list: Callable[[Any], Any]) -> Any:
    """Validate a list of snapshots, or the word `every_stop`."""
    if isinstance(value, str) and value != EVERY_STOP:
        raise ValueError(f"is not a choice; expected a list of snapshots, or {EVERY_STOP!r}")
    return value if value == EVERY_STOP else read_list(value)


class TurningPoint(PathState):
    """A state at which the loading direction changes. Exactly one key must be given. Tensile loads are negative."""


def _section_of_scalars(name, kind, doc, fields=None):
    """Make a section with one key for every parameter that a study may vary; `kind` is the type of the keys."""
    scalars = {
        key: (kind | None, Field(default=None, description=field.description)) for key, field in PARAMETERS.items()
    }
    return create_model(name, __base__=Section, __doc__=doc, __module__=__name__, **(fields or {}), **scalars)


Vary = _section_of_scalars(
    "Vary", Values, "Parameters of surfaces and materials that a study varies. Each key takes one value or a list."
)
Scalar = Annotated[Any, AfterValidator(scalar), WithJsonSchema(SCALAR_SCHEMA)]
Case = _section_of_scalars(
    "Case",
    Scalar,
    "A case of a study. If the case has no value for a parameter, the parameter takes all values of the study.",
    {
        "surface": (Name | None, Field(default=None, description="Name of a surface.")),
        "seed": (Seed | None, Field(default=None, description="Seed of the random phases.")),
        "rms_slope": (Slope | None, Field(default=None, description="Rms slope, or `measured`.")),
        "material": (Name | None, Field(default=None, description="Name of a material.")),
    },
)


class Levels(Section):
    """Seeds of three levels of accuracy, from which ICHA estimates the mean of each result with an interval.

    The seeds of `fine` must be among those of `coarse`, and the seeds of `coarse` among those of `asperities`.
    """

    asperities: Seeds | None = None
    """Seeds of the asperity model. Leave the key out for surfaces that are too sticky for the asperity model."""
    coarse: Seeds | None = None
    """Seeds of boundary elements on half the grid, which must have at least 4 cells per shortest wavelength."""
    fine: Seeds
    """Seeds of boundary elements on the grid of the surface."""

    @model_validator(mode="after")
    def _check_nested(self):
        given = [(name, getattr(self, name)) for name in type(self).model_fields if getattr(self, name)]
        for (outer, many), (inner, few) in itertools.pairwise(given):
            if missing := sorted(set(few) - set(many)):
                raise ValueError(f"{inner}: seed {missing[0]} is not among those of {outer}; expected seeds of {outer}")
        for name, seeds in given:
            if len(seeds) < 2:
                raise ValueError(f"{name}: has one seed, so that its scatter is unknown; expected two seeds or more")
        return self

    @property
    def seeds(self) -> list[int]:
        """Seeds of all levels."""
        return self.asperities or self.coarse or self.fine


# Levels of a study with `accuracy` before its own levels are computed: a pilot.
PILOT = Levels(asperities="1..8", coarse="1..6", fine="1..4")
_HalfWidth = quantity(FloatRange(least=1e-3, most=0.5), "3 %")
_Budget = quantity(FloatRange("s", above=0, most=1e8), "10 min")


class Accuracy(Section):
    """Accuracy that a study must reach. ICHA chooses the seeds of the levels, from the results of a pilot."""

    half_width: _HalfWidth
    """Half-width of the interval of 90 %, relative to the estimate. It holds at all targets and for all contacts of the
    study."""
    quantity: Literal[(*ESTIMATED_AT_TARGETS, *ESTIMATED_OF_LOOPS)] | None = None
    """Quantity with this accuracy. Default: the contact area; if areas are targets, the pressure."""
    budget: _Budget | None = None
    """Largest expected time of all runs of the study, pilot included. If the accuracy takes longer, ICHA computes as
    many seeds as the budget allows, and prints the accuracy that was reached."""


# An accuracy may be given by its half-width alone, such as `3 %`.
_ShortForm = BeforeValidator(
    lambda value: value if isinstance(value, dict | Accuracy | None) else {"half_width": value}
)


class Study(Section):
    """Runs for all combinations of surfaces, seeds, slopes and materials. All runs follow the same loading path."""

    surfaces: Names = []
    """Names of surfaces."""
    seeds: Seeds = [1]
    """Seeds of the random phases: a list, or a range such as `1..50`. A surface from a file, or without
    roughness, has no seeds and is used once."""
    rms_slopes: Slopes = []
    """Rms slopes h'rms. The heights of each topography are scaled to these slopes. With `measured`, a topography from a
    file keeps its own slope, and each seed of a surface with `kind: spectrum` has the slope of the spectrum. A surface
    with `kind: smooth` has no slope: it is used once, with the rms slope 0."""
    rms_heights: Annotated[list[Length], Field(min_length=1), AfterValidator(distinct)] | None = None
    """Rms heights with unit, such as `[100 nm]`, instead of `rms_slopes`. The heights of each topography are scaled to
    these values, also of each seed. The coordinate `rms_slope` of the results is then the slope of the spectrum at this
    height, with six digits. With `amplitudes: gaussian`, seeds have different slopes, √(2 `spectral_moment_2`)."""
    materials: Names = []
    """Names of materials."""
    vary: Vary | None = None
    """Values of parameters of surfaces and materials. The study runs all combinations of these values."""
    cases: Annotated[list[Case], Field(min_length=1)] | None = None
    """Explicit list of runs, instead of all combinations. If a case has no value for a parameter, the parameter takes
    all values of the study."""
    sample: Sample | None = None
    """Cases whose parameters are drawn from distributions, instead of `vary` and `cases`. ICHA computes which share of
    the variance each parameter causes. The study needs one surface, one material and one rms slope."""
    models: Annotated[list[Literal[tuple(MODELS)]], Field(min_length=1), AfterValidator(distinct)] = [DEFAULT_MODEL]
    """Contact models of every run. `asperities` is fast. `boundary_elements` has the `interaction_range` of the
    material where the grid resolves this range, and otherwise the limit of a short range. It needs a grid with at least
    4 (better 8) cells per shortest wavelength. On a surface with free edges, boundary
    elements take about four times as long as on a periodic surface."""
    error_check: StrictBool = False
    """If true, boundary elements also compute the first seed of each surface, slope and material, so that ICHA measures
    the error of the asperity model on these surfaces. Only for `models: [asperities]`; with targets by
    `reduced_pressures`, `icha run` and the report state the error."""
    levels: Levels | None = None
    """Seeds of three levels of accuracy, instead of `seeds` and `models`. ICHA estimates each result with an interval,
    and `icha answer` prints the estimates."""
    accuracy: Annotated[Accuracy | None, _ShortForm, OrSchema({"type": "string", "examples": ["3 %"]})] = None
    """Accuracy that the results must have, such as `3 %`, instead of `seeds` and `models`. `icha run` computes a pilot
    with few seeds, then the levels that reach the accuracy in the shortest time, and states the result."""
    targets: Targets
    """Targets of the loading path."""
    snapshots: (
        Annotated[list[Snapshot], AfterValidator(distinct), WrapValidator(_list_or_word), _OR_EVERY_STOP] | None
    ) = None
    """States at which each run saves its contact spots and distributions. The path reaches each of these states
    exactly. `every_stop` means all targets. Default: the last target."""
    unload: StrictBool = False
    """If true, each run unloads after loading until the surfaces no longer touch."""
    turning_points: list[TurningPoint] = []
    """States after the last target at which the loading direction changes. The first unloading ends at the first state,
    the next loading ends at the second state, and so on."""
    control: Literal["separation", "load"] = "separation"
    """Controlled quantity: the mean separation or the load. With `load`, all targets and turning points must be loads.
    The separation then jumps where the load has a maximum or minimum along the path."""
    max_step: number(STEP) = DEFAULT_STEP
    """Largest change of the mean separation between two equilibria, in units of the rms height."""

    @property
    def seeds_of_levels(self) -> Levels | None:
        """Seeds of each level: those of `levels`, or those of the pilot of `accuracy`."""
        return PILOT if self.levels is None and self.accuracy is not None else self.levels

    @property
    def saved_states(self) -> list[tuple[str, float]] | None:
        """Kind and value (SI units) of each state that the runs save; None if runs save only the last target."""
        if self.snapshots is None:
            return None
        if self.snapshots == EVERY_STOP:
            return self.targets.states
        return [snapshot.kind_and_value for snapshot in self.snapshots]

    def path_settings(self) -> dict:
        """Return the arguments of `icha.Path` for the runs of the study, without unused arguments."""
        settings = self.targets.model_dump(exclude_none=True)
        settings |= {"snapshots": self.saved_states, "max_step": self.max_step}
        if self.unload or self.turning_points:
            settings |= {
                "unload": self.unload,
                "turning_points": [point.kind_and_value for point in self.turning_points],
                "control": self.control,
            }
        elif self.control != "separation":
            settings["control"] = self.control
        return settings

    def problems(self, pressure_unit: float, force_unit: float, side: float) -> Iterator[Problem]:
        """Yield the problems that prevent the study from running.

        The arguments are those of `Campaign.units_of`; they are infinite if they are unknown.
        """
        alone, by_summits = self.models == [DEFAULT_MODEL], DEFAULT_MODEL in self.models
        # At a given load, the smallest slope has the largest reduced pressure. Smooth surfaces have the slope 0.
        slope = min((slope for slope in self.rms_slopes if not is_unread(slope) and slope > 0), default=math.inf)
        units = {RELATIVE_LOAD: (slope, ""), NOMINAL_PRESSURE: (pressure_unit, "Pa"), FORCE: (force_unit, "N")}
        largest_radius = side * math.sqrt((MAX_AREA_FRACTION if by_summits else 1.0) / math.pi)
        for location, kind, value in self.states():
            if kind == REDUCED_PRESSURE and 0 < abs(value) < LEAST_PRESSURE:
                yield location, value, f"is too close to zero; expected 0, or an absolute value from {LEAST_PRESSURE:g}"
            # If a study has both models, asperity runs may end early at the limit of the asperity model. Therefore only
            # the first target and the turning points must be within this limit.
            needed = alone or (DEFAULT_MODEL in self.models and (location[-1] == 0 or location[0] == "turning_points"))
            if needed and kind in ASPERITY_RANGES and value > ASPERITY_RANGES[kind].most:
                reason = f"is out of range; expected {ASPERITY_RANGES[kind].expected}, or models: [boundary_elements]"
                yield location, value, reason
            most = MAX_REDUCED_PRESSURE if needed else LARGEST_REDUCED_PRESSURE
            if kind in units and value > most * units[kind][0]:
                unit, symbol = units[kind]
                limit = format_quantity(most * unit, symbol) if symbol else f"{most * unit:g}"
                expected = f"{QUANTITIES[kind].plural.replace('_', ' ')} up to {limit}"
                if needed:
                    expected += f" (p* = {most:g}, the limit of the asperity model), or models: [boundary_elements]"
                yield location, value, f"is a reduced pressure of {value / unit:.3g}; expected {expected}"
            if kind == CONTACT_RADIUS and value > largest_radius:
                limit = f"A/A0 = {MAX_AREA_FRACTION:g}, the limit of the asperity model" if by_summits else "the square"
                reason = f"is too large on a square of side {length(side)}"
                yield location, value, f"{reason}; expected at most {length(largest_radius, 4)} ({limit})"
        saved = any(kind.startswith(UNLOADING) for kind, _ in self.saved_states or ())
        if self.unload or self.turning_points or saved or self.control != "separation":
            yield from self._path_problems()

    def states(self) -> Iterator[tuple[tuple, str, float]]:
        """Yield location (keys), kind and value of each target, snapshot and turning point."""
        for k, (kind, value) in enumerate(self.targets.states):
            yield ("targets", QUANTITIES[kind].plural, k), kind, value
        snapshots = [] if self.snapshots == EVERY_STOP else self.snapshots or []
        for key, states in (("snapshots", snapshots), ("turning_points", self.turning_points)):
            for k, state in enumerate(states):
                kind, value = state.kind_and_value
                kind = kind.removeprefix(UNLOADING)
                yield (key, k, kind), kind, value

    def _path_problems(self):
        """Yield a problem if `icha.Path` refuses the settings."""
        try:
            Path(**self.path_settings())
        except ValueError as error:
            key, _, reason = str(error).partition(": ")
            name, _, index = key.partition("[")
            location, value = (name,), getattr(self, name)
            if index:
                kind, value = value[int(index.rstrip("]"))].kind_and_value
                location = (name, int(index.rstrip("]")), kind.removeprefix(UNLOADING))
            yield location, value, reason.removeprefix(f"{value!r} ")
