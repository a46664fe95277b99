"""What a campaign is: surfaces, materials, and the studies that press one against the other.

Values are kept in SI units. The text of a configuration file becomes these objects in
`icha.configuration.load`, which also words the errors; the JSON schema is generated from them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path as FilePath
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, get_args, get_origin

from pydantic import (
    AfterValidator,
    Field,
    PrivateAttr,
    WithJsonSchema,
    create_model,
    field_validator,
    model_validator,
)

from icha.configuration.figures import Figures
from icha.configuration.publication import Publication
from icha.configuration.topography import MeasuredSurface
from icha.configuration.values import MAX_GRID, MEASURED, Slope, Slopes, Values
from icha.path.limits import DEFAULT_STEP, MAX_AREA_FRACTION, MAX_REDUCED_PRESSURE, MAX_STEP
from icha.path.states import AreaFraction, ReducedPressure, Snapshot
from icha.path.targets import Path
from icha.support.units import conversion_factor
from icha.support.values import (
    ROUNDING,
    File,
    Flag,
    Label,
    Length,
    Modulus,
    Name,
    Positive,
    Section,
    Seeds,
    SurfaceEnergy,
    Text,
    decreasing,
    distinct,
    exactly_one,
    increasing,
    integer,
    list_of_names,
    number,
    stops,
)

# Sections of entries that belong to a study.
BESIDE_STUDIES = ("boundary_elements", "boundary_element_loops", "error_sources")


class SelfAffineSurface(Section):
    """A random periodic surface, self-affine with roll-off, made by spectral synthesis."""

    random: ClassVar[bool] = True

    kind: Literal["self_affine"] = Field(description="Surface made from a self-affine spectrum.")
    period: Length = Field(description="Side L of the periodic cell.")
    rolloff_wavelength: Length = Field(
        description="Roll-off wavelength 2π/q0: the spectrum is flat for longer waves. At most the period."
    )
    short_wavelength: Length = Field(
        description="Short cut-off 2π/q1: there are no shorter waves. Less than the roll-off wavelength; at least 2 "
        "grid cells (an error below), better 4 (a warning below) or 8."
    )
    hurst: number("a number in (0, 1]", above=0, most=1) = Field(description="Hurst exponent H, in (0, 1].")
    grid: integer(8, MAX_GRID) = Field(description="Grid points along a side.")
    amplitudes: Literal["fixed", "gaussian"] = Field(
        default="fixed",
        description="Amplitudes of the waves: `fixed` by the spectrum, so that all seeds have the same rms height and "
        "slope, or `gaussian`, drawn at random about it.",
    )

    @property
    def cells_per_short_wave(self) -> float:
        """Grid cells per shortest wavelength."""
        return self.grid * self.short_wavelength / self.period

    @field_validator("rolloff_wavelength")
    @classmethod
    def _q0_not_below_ql(cls, value, info):
        period = info.data.get("period")
        if period is not None and value > period * (1 + ROUNDING):
            raise ValueError(f"is longer than the period (q0 < qL); allowed: at most {period:g} m")
        return value

    @field_validator("short_wavelength")
    @classmethod
    def _q1_above_q0(cls, value, info):
        rolloff = info.data.get("rolloff_wavelength")
        if rolloff is not None and value >= rolloff * (1 - ROUNDING):
            raise ValueError(
                f"is not shorter than the roll-off wavelength (q1 <= q0); allowed: less than {rolloff:g} m"
            )
        return value

    @field_validator("grid")
    @classmethod
    def _grid_holds_the_spectrum(cls, value, info):
        period, short = info.data.get("period"), info.data.get("short_wavelength")
        if period is None or short is None:
            return value
        if value * short / period < 2 * (1 - ROUNDING):
            least = math.ceil(2 * period / short * (1 - ROUNDING))
            raise ValueError(
                f"gives {value * short / period:.3g} grid cells per shortest wavelength, 2 are the least; "
                f"allowed: at least {least}, advisable: {2 * least} or more"
            )
        return value


class FileSurface(Section):
    """A periodic height map from a file, for example a surface that others have published."""

    random: ClassVar[bool] = False

    kind: Literal["file"] = Field(description="Surface read from a file.")
    path: File = Field(
        description="File of a square array of heights, first axis y: `.npy`, or netCDF (`.nc`) with a "
        "variable `height`. Relative to the configuration file. Heights point towards the elastic body."
    )
    height_unit: Annotated[str, Field(strict=True)] = Field(
        description="Unit of the heights in the file, such as `um`. All studies scale the heights to their rms slopes."
    )
    period: Length = Field(description="Side L of the periodic cell.")

    @field_validator("height_unit")
    @classmethod
    def _is_a_length(cls, value):
        try:
            conversion_factor(value, "m")
        except ValueError as error:
            raise ValueError(f"{error}; allowed: a unit of length, such as 'um'") from None
        return value

    @property
    def metres_per_unit(self) -> float:
        """The unit of the heights, in m."""
        return float(conversion_factor(self.height_unit, "m"))


# By the value of their key `kind`.
SURFACE_KINDS = {"self_affine": SelfAffineSurface, "file": FileSurface, "measured": MeasuredSurface}
AnySurface = Annotated[SelfAffineSurface | FileSurface | MeasuredSurface, Field(discriminator="kind")]


class Material(Section):
    """Elastic half-space and interface."""

    contact_modulus: Modulus = Field(description="Composite elastic modulus E*.")
    surface_energy: SurfaceEnergy = Field(description="Energy of adhesion Δγ per area; `0 J/m^2` is adhesionless.")
    interaction_range: Length = Field(
        description="Range ε of the attraction, which sets the separation at which asperities jump into contact. It "
        "gives a surface of rms curvature 1/R the Tabor parameter μ = (RΔγ²/E*²)^(1/3)/ε."
    )


class Targets(Section):
    """The stops of the loading path: exactly one of the three lists."""

    reduced_pressures: stops(ReducedPressure, increasing) | None = Field(
        default=None, description=f"Reduced pressures p/(E* h'rms), increasing, up to {MAX_REDUCED_PRESSURE}."
    )
    area_fractions: stops(AreaFraction, increasing) | None = Field(
        default=None, description=f"Contact area fractions A/A0, increasing, up to {MAX_AREA_FRACTION}."
    )
    mean_separations: stops(Length, decreasing) | None = Field(
        default=None, description="Mean separations with their unit, decreasing."
    )

    _check = model_validator(mode="after")(exactly_one)

    @property
    def last(self) -> tuple[str, float]:
        """Kind and value (SI units) of the last stop."""
        ((kinds, values),) = self.model_dump(exclude_none=True).items()
        return kinds.removesuffix("s"), values[-1]


class TurningPoint(Section):
    """A state at which the path turns: exactly one of the four keys. Loads may be tensile (negative) or zero."""

    reduced_pressure: (
        number(f"a number of at most {MAX_REDUCED_PRESSURE}, which the model covers", most=MAX_REDUCED_PRESSURE) | None
    ) = Field(default=None, description="At this p/(E* h'rms).")
    relative_load: number("a number") | None = Field(default=None, description="At this p/E* = F/(E* A0).")
    area_fraction: AreaFraction | None = Field(default=None, description="At this contact area fraction A/A0.")
    mean_separation: Length | None = Field(default=None, description="At this mean separation, with its unit.")

    _check = model_validator(mode="after")(exactly_one)

    @property
    def target(self) -> tuple[str, float]:
        """Kind and value (SI units) of the state."""
        ((kind, value),) = self.model_dump(exclude_none=True).items()
        return kind, value


def _scalars(*sections: type[Section]) -> dict[str, str]:
    """Names of the parameters of some kinds of sections that a study may vary, and what they mean."""
    found: dict[str, str] = {}
    for section in sections:
        for name, field in section.model_fields.items():
            kinds = get_args(field.annotation) or (field.annotation,)
            whole = any(get_origin(kind) is tuple or isinstance(kind, type(Section)) for kind in kinds)
            if name not in ("kind", "path") and not whole:
                found.setdefault(name, field.description)
    return found


SCALARS = _scalars(*SURFACE_KINDS.values(), Material)


def _of_scalars(name, kind, doc, fields=None):
    """A section with a key, of type `kind`, for every parameter that can be varied."""
    scalars = {key: (kind | None, Field(default=None, description=text)) for key, text in SCALARS.items()}
    return create_model(name, __base__=Section, __doc__=doc, __module__=__name__, **(fields or {}), **scalars)


Vary = _of_scalars(
    "Vary", Values, "Parameters of a study's surfaces and materials that it varies: a value each, or a list of them."
)
Scalar = Annotated[Any, WithJsonSchema({"type": ["string", "number", "boolean"]})]
Case = _of_scalars(
    "Case",
    Scalar,
    "One entry of an explicit list of runs; what it does not name is taken from the lists of its study.",
    {
        "surface": (Name | None, Field(default=None, description="Name of a surface.")),
        "seed": (integer(0) | None, Field(default=None, description="Seed.")),
        "rms_slope": (Slope | None, Field(default=None, description="Rms slope, or `measured`.")),
        "material": (Name | None, Field(default=None, description="Name of a material.")),
    },
)


class Study(Section):
    """Every surface, seed, slope and material of the lists, each with each, along one path."""

    surfaces: list_of_names("Names of surfaces.") = Field(default=[], description="Names of surfaces.")
    seeds: Seeds = Field(
        default=[1],
        description="Seeds of the random phases: a list, or a range such as `1..50`. Surfaces read from a file have "
        "none and are used once.",
    )
    rms_slopes: Slopes = Field(
        default=[],
        description="Rms slopes h'rms to which each topography's heights are scaled; `measured` is the slope that a "
        "topography read from a file has.",
    )
    materials: list_of_names("Names of materials.") = Field(default=[], description="Names of materials.")
    vary: Vary | None = Field(
        default=None,
        description="Parameters of the surfaces and materials that take other values in this study, each with each.",
    )
    zip: list[Annotated[list[Text], Field(min_length=2)]] = Field(
        default=[],
        description="Groups of lists that go along together, first with first and second with second, instead of each "
        "with each: `[[rms_slopes, surface_energy]]`.",
    )
    cases: Annotated[list[Case], Field(min_length=1)] | None = Field(
        default=None,
        description="An explicit list of runs instead of the lists of the study, which serve for what a case does not "
        "name.",
    )
    targets: Targets = Field(description="Stops of the loading path.")
    snapshots: Annotated[list[Snapshot], AfterValidator(distinct)] | None = Field(
        default=None,
        description="States of which spots and distributions are kept; each is hit exactly. Left out: the last target.",
    )
    unload: Flag = Field(
        default=False, description="Whether the surfaces are pulled apart again, until nothing touches any more."
    )
    turning_points: list[TurningPoint] = Field(
        default=[],
        description="States at which the path turns after its last target: the first ends unloading, the second "
        "loading again, and so on.",
    )
    control: Literal["separation", "load"] = Field(
        default="separation",
        description="What is imposed: the mean separation, or the load, under which the state jumps where the curve "
        "turns back; then all targets and turning points are loads.",
    )
    united_until: Literal["detachment", "overlap"] = Field(
        default="detachment",
        description="Until when coalesced spots stay one on the way back: until they detach as a whole and fall back "
        "into their asperities, or until the two spots that they were made of would no longer overlap.",
    )
    max_step: number(f"a number in (0, {MAX_STEP}]", above=0, most=MAX_STEP) = Field(
        default=DEFAULT_STEP, description="Longest change of mean separation between two equilibria, in units of h_rms."
    )

    def check_path(self, snapshots: list[tuple[str, float]] | None) -> None:
        """Raise ValueError naming the argument of `icha.Path` that is not allowed."""
        Path(**self.path_settings(snapshots))

    def path_settings(self, snapshots: list[tuple[str, float]] | None) -> dict:
        """Arguments of the path of its runs (`icha.Path`); those that are left at their defaults are left out."""
        settings = self.targets.model_dump(exclude_none=True) | {"snapshots": snapshots, "max_step": self.max_step}
        if self.unload or self.turning_points:
            settings |= {
                "unload": self.unload,
                "turning_points": [point.target for point in self.turning_points],
                "control": self.control,
                "united_until": self.united_until,
            }
        elif self.control != "separation":
            settings["control"] = self.control
        return settings


class Column(Section):
    """A column of a table of measurements."""

    column: Text = Field(description="Heading of the column.")
    unit: Annotated[str, Field(strict=True)] = Field(
        description="Unit of its numbers: `1` or `percent` for ratios, a unit of pressure for nominal pressures."
    )


class Measurement(Section):
    """Measured contact areas, drawn over the figure of the study that they belong to."""

    path: File = Field(description="CSV file with a line of headings. Relative to the configuration file.")
    label: Text = Field(description="What the legend calls it.")
    citation: Text = Field(description="Where the numbers come from; printed in the report.")
    study: Name = Field(description="Name of the study that it is compared with.")
    load: Column = Field(
        description="Load: reduced pressures p/(E* h'rms) (unit `1`) or nominal pressures (unit `kPa`, …), which need "
        "material and rms_slope."
    )
    area: Column = Field(description="Contact area fraction A/A0 (unit `1` or `percent`).")
    material: Name | None = Field(default=None, description="Material that was measured; a load in Pa needs it.")
    rms_slope: Positive | None = Field(default=None, description="Rms slope that was measured; a load in Pa needs it.")

    @field_validator("load")
    @classmethod
    def _load_is_ratio_or_pressure(cls, value):
        for si_unit in ("1", "Pa"):
            try:
                conversion_factor(value.unit, si_unit)
                return value
            except ValueError:
                pass
        raise ValueError(f"unit {value.unit!r}; allowed: '1' or a unit of pressure, such as 'kPa'")

    @field_validator("area")
    @classmethod
    def _area_is_ratio(cls, value):
        try:
            conversion_factor(value.unit, "1")
        except ValueError as error:
            raise ValueError(f"unit: {error}; allowed: '1' or 'percent'") from None
        return value

    @property
    def load_is_pressure(self) -> bool:
        """Whether the load column holds nominal pressures."""
        try:
            conversion_factor(self.load.unit, "1")
        except ValueError:
            return True
        return False

    @property
    def columns(self) -> dict[str, float]:
        """Headings of the columns of load and area, and the factors that turn them into SI units."""
        load = conversion_factor(self.load.unit, "Pa" if self.load_is_pressure else "1")
        area = conversion_factor(self.area.unit, "1")
        return {self.load.column: float(load), self.area.column: float(area)}

    @field_validator("area")
    @classmethod
    def _columns_differ(cls, value, info):
        if "load" in info.data and info.data["load"].column == value.column:
            raise ValueError(f"column {value.column!r} is the load's; allowed: another one")
        return value

    @model_validator(mode="after")
    def _pressure_can_be_reduced(self):
        if self.load_is_pressure and (self.material is None or self.rms_slope is None):
            raise ValueError(
                f"load in {self.load.unit!r} without material and rms_slope; allowed: both given, or loads of unit '1'"
            )
        return self


class BesideStudy(Section):
    """Boundary elements on the topographies of a study."""

    study: Name = Field(description="Name of the study on whose topographies they are solved.")
    surfaces: list_of_names("Surfaces, of the study's. Left out: all.", Label) | None = Field(
        default=None, description="Surfaces, of the study's. Left out: all."
    )
    seeds: Seeds | None = Field(default=None, description="Seeds, of the study's. Left out: all.")
    rms_slopes: Annotated[list[Positive], Field(min_length=1), AfterValidator(distinct)] | None = Field(
        default=None, description="Rms slopes, of the study's. Left out: all."
    )
    materials: list_of_names("Materials, of the study's. Left out: all.", Label) | None = Field(
        default=None,
        description="Materials, of the study's. Left out: all. With adhesion the grid must resolve their "
        "`interaction_range`.",
    )
    tolerance: number("a number in [1e-12, 1e-4]", least=1e-12, most=1e-4) = Field(
        default=1e-8, description="Relative error at which the solver may stop."
    )


Loads = Annotated[
    stops(ReducedPressure, increasing),
    Field(
        description="Loads p/(E* h'rms), increasing. Those of `boundary_elements` become snapshots of the study's runs."
    ),
]
Refinement = Annotated[
    integer(1, 16),
    Field(description="Cells per cell of the surface's own grid, along a side; heights are interpolated."),
]


class BoundaryElements(BesideStudy):
    """Boundary-element solutions of a study's own topographies, beside its runs."""

    reduced_pressures: Loads
    refinement: Refinement = 1

    @property
    def coarsest(self) -> int:
        """Smallest number of cells per cell of the surface's grid."""
        return self.refinement


class BoundaryElementLoops(BesideStudy):
    """Boundary elements from separation to the largest load of a study's runs and back."""

    refinement: Refinement = 1
    separation_step: number(f"a number in (0, {MAX_STEP}]", above=0, most=MAX_STEP) = Field(
        default=0.05, description="Change of the mean gap from one solution to the next, in units of h_rms."
    )

    @property
    def coarsest(self) -> int:
        """Smallest number of cells per cell of the surface's grid."""
        return self.refinement


class ErrorSources(BesideStudy):
    """Variants between the model and boundary elements, each of which changes one thing."""

    reduced_pressures: Loads
    refinement: integer(1, 16) = Field(
        default=2, description="Cells per cell of the surface's own grid, along a side: even, since half is tried too."
    )

    @field_validator("refinement")
    @classmethod
    def _half_of_it_can_be_tried(cls, value):
        if value % 2:
            raise ValueError("is odd; allowed: 2, 4, … 16")
        return value

    @property
    def coarsest(self) -> int:
        """Smallest number of cells per cell of the surface's grid."""
        return self.refinement // 2


class OneAsperity(Section):
    """One asperity by the model and by boundary elements, where the answer is known."""

    tabor_parameters: Annotated[
        list[number("a number in [1.5, 6]", least=1.5, most=6)], Field(min_length=1), AfterValidator(increasing)
    ] = Field(
        description="Tabor parameters, increasing; boundary elements take a grid that grows with their square, 800 "
        "nodes a side and some minutes at 4. Hertz's contact is always computed."
    )


class Contact(NamedTuple):
    """What is pressed against what in one run of a study; the slope is `measured` until that is known."""

    surface: str
    seed: int
    rms_slope: float
    material: str


class Topography(NamedTuple):
    """What the plan of a campaign needs to know of a topography from a file."""

    grid: int
    period: float  # m
    boundary: str
    rms_slope: float | None  # None where no study asks for it
    sha256: str


class Defaults(Section):
    """Values for every entry of a section that does not give its own."""

    surfaces: dict[str, Any] = Field(
        default={}, description="Keys of surfaces; every surface takes those that its kind has."
    )
    materials: dict[str, Any] = Field(default={}, description="Keys of materials.")
    studies: dict[str, Any] = Field(default={}, description="Keys of studies.")


class Campaign(Section):
    """A campaign: everything that one configuration file asks for."""

    name: Name = Field(description="Name of the campaign; results go to `results/<name>/`.")
    title: Text = Field(description="One line that says what the campaign is.")
    summary: Text = Field(description="A few sentences for readers of the datasets and of the report.")
    license: Text = Field(description="Licence of the data, as an SPDX identifier such as `CC-BY-4.0`.")
    defaults: Defaults = Field(
        default=Defaults(), description="Values for all surfaces, materials or studies that do not give their own."
    )
    surfaces: Annotated[dict[Name, AnySurface], Field(min_length=1)] = Field(
        description="Surfaces by name: `kind: self_affine`, `kind: measured` or `kind: file`."
    )
    materials: Annotated[dict[Name, Material], Field(min_length=1)] = Field(description="Materials by name.")
    studies: Annotated[dict[Name, Study], Field(min_length=1)] = Field(description="Studies by name.")
    boundary_elements: dict[Name, BoundaryElements] = Field(
        default={}, description="Boundary-element solutions by name, compared with the runs of a study."
    )
    boundary_element_loops: dict[Name, BoundaryElementLoops] = Field(
        default={}, description="Boundary elements both ways by name, beside the runs of a study that unload."
    )
    error_sources: dict[Name, ErrorSources] = Field(
        default={}, description="Studies of where the model's error comes from, by name."
    )
    one_asperity: OneAsperity | None = Field(
        default=None, description="One asperity by the model and by boundary elements."
    )
    measurements: dict[Name, Measurement] = Field(
        default={}, description="Measurements by name, overlaid on figure 5. None are shipped with ICHA."
    )
    figures: Figures = Field(default=Figures(), description="Figures and what they show.")
    publication: Publication = Field(
        default=Publication(), description="What a deposit says of itself; nothing else depends on it."
    )

    _contacts: dict[str, tuple[Contact, ...]] = PrivateAttr(default={})
    _topographies: dict[str, Topography] = PrivateAttr(default={})
    _origins: dict[tuple[str, str], str] = PrivateAttr(default={})

    def published(self) -> Publication:
        """What a deposit says of itself; title, summary and licence are the campaign's where it has none of its own."""
        own = self.publication
        return own.model_copy(
            update={key: getattr(own, key) or getattr(self, key) for key in ("title", "summary", "license")}
        )

    def loop_load(self, entry: BoundaryElementLoops) -> float:
        """The reduced pressure at which boundary elements both ways turn: the last one of their study."""
        return self.studies[entry.study].targets.last[1]

    def contacts(self, study: str) -> list[Contact]:
        """What is pressed in a study, run by run."""
        return list(self._contacts[study])

    def with_contacts(self, contacts: Mapping[str, Iterable[Contact]]) -> Campaign:
        """The same campaign with the runs of its studies written out, and the lists of the studies to match."""
        contacts = {study: tuple(dict.fromkeys(runs)) for study, runs in contacts.items()}

        def lists(runs):
            columns = (list(dict.fromkeys(column)) for column in zip(*runs, strict=True))
            return dict(zip(("surfaces", "seeds", "rms_slopes", "materials"), columns, strict=True))

        studies = {label: study.model_copy(update=lists(contacts[label])) for label, study in self.studies.items()}
        campaign = self.model_copy(update={"studies": studies})
        campaign._contacts = contacts
        return campaign

    def with_topographies(self, topographies: Mapping[str, Topography]) -> Campaign:
        """The same campaign with what was read of its topographies, whose slopes stand in the place of `measured`."""
        contacts = {
            study: [
                each._replace(rms_slope=topographies[each.surface].rms_slope) if each.rms_slope == MEASURED else each
                for each in runs
            ]
            for study, runs in self._contacts.items()
        }
        campaign = self.with_contacts(contacts)
        campaign._topographies = dict(topographies)
        return campaign

    def topography(self, surface: str) -> Topography | None:
        """What was read of a topography from a file; None of a random one."""
        return self._topographies.get(surface)

    def origin(self, section: str, name: str) -> str:
        """The entry of a section (surfaces, materials) of which `name` is a variant, or itself."""
        return self._origins.get((section, name), name)

    def boundary(self, surface: str) -> str:
        """What lies beyond the edges of a surface: `periodic` or `free`."""
        topography = self.topography(surface)
        return topography.boundary if topography else "periodic"

    def grid(self, surface: str) -> int:
        """Nodes along a side of a surface."""
        topography = self.topography(surface)
        return topography.grid if topography else self.surfaces[surface].grid

    def period(self, surface: str) -> float:
        """Side of a surface, m."""
        topography = self.topography(surface)
        return topography.period if topography else self.surfaces[surface].period

    def snapshots_of(self, study: str) -> list[tuple[str, float]] | None:
        """Kind and value of all states that the runs of a study keep; None where they keep their last one.

        The loads of the study's boundary elements are among them.
        """
        asked = self.studies[study].snapshots
        loads = sorted({p for e in self.boundary_elements.values() if e.study == study for p in e.reduced_pressures})
        if asked is None and not loads:
            return None
        own = [self.studies[study].targets.last] if asked is None else [snapshot.target for snapshot in asked]
        return own + [("reduced_pressure", p) for p in loads if ("reduced_pressure", p) not in own]

    def solved(self, entry: BesideStudy) -> list[Contact]:
        """The contacts for which an entry beside a study asks."""

        def asked(wanted, value):
            return wanted is None or value in wanted

        return [
            each
            for each in self._contacts[entry.study]
            if asked(entry.surfaces, each.surface)
            and (asked(entry.seeds, each.seed) or not self.surfaces[each.surface].random)
            and asked(entry.rms_slopes, each.rms_slope)
            and asked(entry.materials, each.material)
        ]

    def with_files_beside(self, folder: FilePath) -> Campaign:
        """The same campaign with the paths of its files taken relative to `folder`."""

        def placed(section):
            return section.model_copy(update={"path": str(folder / section.path)})

        return self.model_copy(
            update={
                "surfaces": {n: s if s.random else placed(s) for n, s in self.surfaces.items()},
                "measurements": {name: placed(m) for name, m in self.measurements.items()},
            }
        )
