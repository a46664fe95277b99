"""Section `studies`, and the sections `finite_range` and `boundary_element_loops`, which belong to studies."""

import math
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal

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

from icha.asperity.cohesive_zone import resolution_problem
from icha.asperity.material import Material
from icha.configuration.surfaces import SURFACE_KINDS, MaterialSection
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.path.states import AreaFraction, ReducedPressure, Snapshot
from icha.path.targets import (
    ASPERITY_RANGES,
    DEFAULT_STEP,
    LARGEST_REDUCED_PRESSURE,
    MAX_AREA_FRACTION,
    MAX_REDUCED_PRESSURE,
    RELATIVE_LOAD,
    STEP,
    Path,
)
from icha.support.rules import NUMBER, REFINEMENT, SLOPE, TOLERANCE, FloatRange
from icha.support.values import (
    Label,
    Length,
    Name,
    Positive,
    Problem,
    Section,
    Seed,
    Seeds,
    Text,
    decreasing,
    distinct,
    exactly_one,
    increasing,
    integer,
    list_names,
    list_of_names,
    number,
    stops,
    to_number,
    unknown,
)

# Word that stands for the measured slope of a topography.
MEASURED = "measured"


def _slope(value: Any) -> float | str:
    try:
        slope = to_number(value)
    except ValueError as error:
        if value == MEASURED:
            return value
        raise ValueError(f"{error}; expected {SLOPE.expected}, or {MEASURED}") from None
    if not SLOPE.contains(slope):
        raise ValueError(f"is out of range; expected {SLOPE.expected}, or {MEASURED}")
    return slope


_ONE_SLOPE = {"anyOf": [{"type": "number", "minimum": SLOPE.least, "maximum": SLOPE.most}, {"const": MEASURED}]}
Slope = Annotated[Any, BeforeValidator(_slope), WithJsonSchema(_ONE_SLOPE)]
Slopes = Annotated[
    list[Slope],
    BeforeValidator(lambda value: [value] if value == MEASURED else value),
    Field(min_length=1),
    AfterValidator(distinct),
    WithJsonSchema({"anyOf": [{"const": MEASURED}, {"type": "array", "minItems": 1, "items": _ONE_SLOPE}]}),
]
SCALAR_SCHEMA = {"type": ["string", "number", "boolean"]}


def scalar(value: Any) -> Any:
    """Refuse a value that is a list or a mapping."""
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
    """The targets of the loading path: exactly one of the three lists."""

    reduced_pressures: stops(ReducedPressure, increasing) | None = Field(
        default=None,
        description=f"Reduced pressures p/(E* h'rms), increasing; with asperities up to {MAX_REDUCED_PRESSURE}.",
    )
    area_fractions: stops(AreaFraction, increasing) | None = Field(
        default=None,
        description=f"Contact area fractions A/A0, increasing; with asperities up to {MAX_AREA_FRACTION}.",
    )
    mean_separations: stops(Length, decreasing) | None = None
    """Mean separations with their unit, decreasing."""

    _check = model_validator(mode="after")(exactly_one)

    @property
    def states(self) -> list[tuple[str, float]]:
        """Kind and value (SI units) of every target."""
        ((kinds, values),) = self.model_dump(exclude_none=True).items()
        return [(kinds.removesuffix("s"), value) for value in values]

    @property
    def last(self) -> tuple[str, float]:
        """Kind and value (SI units) of the last target."""
        return self.states[-1]


EVERY_STOP = "every_stop"


def _list_or_word(value: Any, read_list: Callable[[Any], Any]) -> Any:
    """Read a list of snapshots, or the word that stands for all targets."""
    if isinstance(value, str) and value != EVERY_STOP:
        raise ValueError(f"is not a choice; expected a list of snapshots, or {EVERY_STOP!r}")
    return value if value == EVERY_STOP else read_list(value)


class _OrEveryStop:
    """Annotation for the JSON schema: a list, or the word `every_stop`."""

    def __get_pydantic_json_schema__(self, core_schema: Any, handler: Callable[[Any], dict]) -> dict:
        """Return the schema of the list or the word."""
        return {"anyOf": [handler(core_schema), {"const": EVERY_STOP}]}


class TurningPoint(Snapshot):
    """A state at which the path turns: exactly one of the keys. Loads may be tensile (negative) or zero."""

    reduced_pressure: number(FloatRange(most=LARGEST_REDUCED_PRESSURE)) | None = None
    """At this p/(E* h'rms)."""
    relative_load: number(NUMBER) | None = None
    """At this p/E* = F/(E* A0)."""


# Names and descriptions of the parameters that a study may vary: all except files and sections.
SCALARS: dict[str, str] = {}
for _section in (*SURFACE_KINDS.values(), MaterialSection):
    for _name, _field in _section.model_fields.items():
        if _name not in ("kind", "path", "crop"):
            SCALARS.setdefault(_name, str(_field.description))


def _section_of_scalars(name, kind, doc, fields=None):
    """Make a section with a key of the type `kind` for every parameter that a study may vary."""
    scalars = {key: (kind | None, Field(default=None, description=text)) for key, text in SCALARS.items()}
    return create_model(name, __base__=Section, __doc__=doc, __module__=__name__, **(fields or {}), **scalars)


Vary = _section_of_scalars(
    "Vary", Values, "Parameters of surfaces and materials that a study varies: one value or a list each."
)
Scalar = Annotated[Any, AfterValidator(scalar), WithJsonSchema(SCALAR_SCHEMA)]
Case = _section_of_scalars(
    "Case",
    Scalar,
    "An entry of an explicit list of runs. Parameters that it does not give take all values of the lists of the study.",
    {
        "surface": (Name | None, Field(default=None, description="Name of a surface.")),
        "seed": (Seed | None, Field(default=None, description="Seed of the random phases.")),
        "rms_slope": (Slope | None, Field(default=None, description="Rms slope, or `measured`.")),
        "material": (Name | None, Field(default=None, description="Name of a material.")),
    },
)


class Study(Section):
    """All combinations of surfaces, seeds, slopes and materials, along one loading path."""

    surfaces: list_of_names() = []
    """Names of surfaces."""
    seeds: Seeds = [1]
    """Seeds of the random phases: a list, or a range such as `1..50`. Surfaces from a file have no seeds and are used
    once."""
    rms_slopes: Slopes = []
    """Rms slopes h'rms to which the heights of each topography are scaled. `measured` stands for the slope of the
    topography in its file."""
    materials: list_of_names() = []
    """Names of materials."""
    vary: Vary | None = None
    """Values of parameters that replace those of the surfaces and materials in this study, in all combinations."""
    zip: list[Annotated[list[Text], Field(min_length=2)]] = []
    """Groups of lists whose entries are combined one by one (first with first, second with second) instead of in all
    combinations, such as `[[rms_slopes, surface_energy]]`."""
    cases: Annotated[list[Case], Field(min_length=1)] | None = None
    """An explicit list of runs instead of all combinations. Parameters that a case does not give take all values of the
    lists of the study."""
    models: Annotated[list[Literal[tuple(MODELS)]], Field(min_length=1), AfterValidator(distinct)] = [DEFAULT_MODEL]
    """Contact models of every run: `asperities` is fast; `boundary_elements`, in the limit of a short range of
    attraction, needs a periodic surface and a grid of at least 4 cells (better 8) per shortest wavelength."""
    targets: Targets
    """Targets of the loading path."""
    snapshots: (
        Annotated[list[Snapshot], AfterValidator(distinct), WrapValidator(_list_or_word), _OrEveryStop()] | None
    ) = None
    """States at which the run saves its spots and distributions. The path reaches each of these states exactly.
    `every_stop` stands for all targets. Default: the last target."""
    unload: StrictBool = False
    """True to unload after loading, until the surfaces no longer touch."""
    turning_points: list[TurningPoint] = []
    """States at which the path turns after its last target: at the first one unloading ends, at the second one the next
    loading ends, and so on."""
    control: Literal["separation", "load"] = "separation"
    """Quantity that is imposed: the mean separation or the load. Under load control the state jumps where the curve of
    load against separation turns back, and all targets and turning points must be loads."""
    max_step: number(STEP) = DEFAULT_STEP
    """Largest change of mean separation between two equilibria, in units of h_rms."""

    @property
    def own_snapshots(self) -> list[tuple[str, float]]:
        """Kind and value of the states that the runs of the study save."""
        if self.snapshots is None:
            return [self.targets.last]
        if self.snapshots == EVERY_STOP:
            return self.targets.states
        return [snapshot.kind_and_value for snapshot in self.snapshots]

    def path_settings(self, snapshots: list[tuple[str, float]] | None) -> dict:
        """Return the arguments of the path of the runs (`icha.Path`), without unused ones."""
        settings = self.targets.model_dump(exclude_none=True) | {"snapshots": snapshots, "max_step": self.max_step}
        if self.unload or self.turning_points:
            settings |= {
                "unload": self.unload,
                "turning_points": [point.kind_and_value for point in self.turning_points],
                "control": self.control,
            }
        elif self.control != "separation":
            settings["control"] = self.control
        return settings

    def problems(self, snapshots: list[tuple[str, float]] | None) -> Iterator[Problem]:
        """Yield the reasons why the study cannot run with these snapshots (`Campaign.snapshots_of`)."""
        alone = self.models == [DEFAULT_MODEL]
        # The smallest slope makes the largest reduced pressure.
        slope = min((slope for slope in self.rms_slopes if slope != MEASURED), default=math.inf)
        most = (MAX_REDUCED_PRESSURE if DEFAULT_MODEL in self.models else LARGEST_REDUCED_PRESSURE) * slope
        for location, kind, value in self._states():
            # Beside another model, asperities end loading at the limit of their range, but must begin within it.
            needed = alone or (DEFAULT_MODEL in self.models and (location[-1] == 0 or location[0] == "turning_points"))
            if needed and kind in ASPERITY_RANGES and value > ASPERITY_RANGES[kind].most:
                reason = f"is out of range; expected {ASPERITY_RANGES[kind].expected}, or models: [boundary_elements]"
                yield location, value, reason
            if kind == RELATIVE_LOAD and value > most:
                reason = f"at rms slope {slope:g} is a reduced pressure of {value / slope:g}"
                yield location, value, f"{reason}; expected relative loads up to {most:g}"
        if self.unload or self.turning_points or self.control != "separation":
            yield from self._path_problems(snapshots)

    def _states(self) -> Iterator[tuple[tuple, str, float]]:
        """Yield location, kind and value of the targets, snapshots and turning points in the configuration."""
        for k, (kind, value) in enumerate(self.targets.states):
            yield ("targets", f"{kind}s", k), kind, value
        snapshots = [] if self.snapshots == EVERY_STOP else self.snapshots or []
        for key, states in (("snapshots", snapshots), ("turning_points", self.turning_points)):
            for k, state in enumerate(states):
                kind, value = state.kind_and_value
                yield (key, k, kind), kind, value

    def _path_problems(self, snapshots):
        """Report the reason why `icha.Path` refuses the settings."""
        try:
            Path(**self.path_settings(snapshots))
        except ValueError as error:
            key, _, reason = str(error).partition(": ")
            name, _, index = key.partition("[")
            location, value = (name,), getattr(self, name)
            if index:
                kind, value = value[int(index.rstrip("]"))].kind_and_value
                location = (name, int(index.rstrip("]")), kind)
            yield location, value, reason.removeprefix(f"{value!r} ")


_Labels = list_of_names(Label)


class BesideStudy(Section):
    """Boundary elements on the topographies of a study."""

    study: Name
    """Name of the study with the topographies."""
    surfaces: _Labels | None = None
    """Surfaces of the study. Default: all."""
    seeds: Seeds | None = None
    """Seeds of the study. Default: all."""
    rms_slopes: Annotated[list[Positive], Field(min_length=1), AfterValidator(distinct)] | None = None
    """Rms slopes of the study. Default: all."""
    materials: _Labels | None = None
    """Materials of the study. Default: all. With adhesion, the grid must resolve their `interaction_range`."""
    tolerance: number(TOLERANCE) = 1e-8
    """Relative error at which the solver has converged."""
    refinement: integer(REFINEMENT) = 1
    """Number of cells of the solver per cell of the surface's grid, along a side. The heights are interpolated."""

    def problems(self, campaign: Any) -> Iterator[Problem]:
        """Report entries that the `icha.configuration.campaign.Campaign` does not have, or that cannot be solved."""
        yield from unknown(("study",), self.study, campaign.studies)
        if self.study in campaign.studies:
            yield from self._study_problems(campaign, campaign.studies[self.study])

    def _study_problems(self, campaign, study):
        if DEFAULT_MODEL not in study.models:
            reason = f"has no runs to compare with; expected a study with {DEFAULT_MODEL!r} among its `models`"
            yield ("study",), self.study, reason
        for key in ("surfaces", "seeds", "rms_slopes", "materials"):
            known = set(getattr(study, key))
            for index, value in enumerate(getattr(self, key) or []):
                if value not in known:
                    expected = list_names(getattr(study, key))
                    yield (key, index), value, f"is not in study {self.study!r}; expected one of {expected}"
        contacts = campaign.contacts_beside(self)
        if not contacts and MEASURED not in study.rms_slopes:
            reason = "has no run with these surfaces, seeds, slopes and materials; expected combinations of the study"
            yield ("study",), self.study, reason
        pairs = list(dict.fromkeys((each.surface, each.material) for each in contacts))
        for name in dict.fromkeys(name for name, _ in pairs):
            if campaign.is_free(name):
                reason = f"has the surface {name!r} with free edges; expected a study of periodic surfaces"
                yield ("study",), self.study, reason
            elif campaign.grid(name) is not None:
                nodes = campaign.grid(name) * self.refinement
                for label in (material for surface, material in pairs if surface == name):
                    material = Material(**campaign.materials[label].model_dump(exclude_none=True))
                    if problem := resolution_problem(material, campaign.period(name) / nodes):
                        yield ("materials",), label, f"on surface {name!r}: {problem}"


class BoundaryElements(BesideStudy):
    """Boundary elements at a finite range of attraction on the topographies of a study, to compare with its runs."""

    reduced_pressures: stops(ReducedPressure, increasing)
    """Loads p/(E* h'rms), increasing. The runs of the study save a snapshot at each of these loads."""


class BoundaryElementLoops(BesideStudy):
    """Boundary elements at a finite range of attraction, loaded to the largest load of a study and unloaded."""

    separation_step: number(STEP) = 0.05
    """Change of the mean gap from one solution to the next, in units of h_rms."""

    def _study_problems(self, campaign, study):
        """Report also a study that does not unload, or not from a reduced pressure."""
        if not study.unload or study.turning_points or study.targets.last[0] != "reduced_pressure":
            reason = "does not unload after its last reduced pressure; expected a study with `reduced_pressures`, "
            yield ("study",), self.study, f"{reason}`unload: true` and no turning points"
        yield from super()._study_problems(campaign, study)
