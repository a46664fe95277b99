"""What a campaign is: surfaces, materials, and the studies that press one against the other.

Values are kept in SI units. The text of a configuration file becomes these objects in `icha.configuration.load`; what
is wrong with it is worded in `icha.configuration.errors`; the JSON schema is generated from them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path as FilePath
from typing import Annotated, Any, NamedTuple

from pydantic import AfterValidator, Field, PrivateAttr

from icha.configuration.boundary_elements import BesideStudy, BoundaryElementLoops, BoundaryElements
from icha.configuration.figures import Figures, Measurement
from icha.configuration.publication import Publication
from icha.configuration.studies import MEASURED, Study
from icha.configuration.surfaces import AnySurface, MaterialSection
from icha.contact.models import MODELS, Model
from icha.support.values import ROUNDING, Name, Problem, Section, Text, distinct

# Sections of entries that belong to a study.
BESIDE_STUDIES = ("finite_range", "boundary_element_loops")
# Each of these looks at all runs of its study.
_FEW = Field(max_length=100)
# Cells per shortest wavelength: with fewer, boundary elements are refused and asperities warned of; those to recommend.
_LEAST_CELLS, _ADVISABLE_CELLS = 4, 8


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
    rms_slope: float | None  # None where no study asks for it
    sha256: str
    full_contact_energy: float  # U_full/E* at rms slope 1, m; NaN where nothing may adhere


class Defaults(Section):
    """Values for every entry of a section that does not give its own."""

    surfaces: dict[str, Any] = Field(
        default={}, description="Keys of surfaces; every surface takes those that its kind has."
    )
    materials: dict[str, Any] = Field(default={}, description="Keys of materials.")
    studies: dict[str, Any] = Field(default={}, description="Keys of studies.")


class Campaign(Section):
    """A campaign: everything that one configuration file describes."""

    name: Name = Field(description="Name of the campaign; results go to `results/<name>/`.")
    title: Text = Field(description="One line that says what the campaign is.")
    summary: Text = Field(description="A few sentences for readers of the datasets and of the report.")
    license: Text = Field(description="Licence of the data, as an SPDX identifier such as `CC-BY-4.0`.")
    confirmed: Annotated[list[Text], AfterValidator(distinct)] = Field(
        default=[],
        description="Keys of values that are unusual and meant, such as `materials.soft.contact_modulus`; all entries "
        "of a list by the key of the list. Others that are unusual are refused.",
    )
    defaults: Defaults = Field(
        default=Defaults(), description="Values for all surfaces, materials or studies that do not give their own."
    )
    surfaces: Annotated[dict[Name, AnySurface], Field(min_length=1)] = Field(
        description="Surfaces by name: `kind: self_affine`, `kind: measured` or `kind: file`."
    )
    materials: Annotated[dict[Name, MaterialSection], Field(min_length=1)] = Field(description="Materials by name.")
    studies: Annotated[dict[Name, Study], Field(min_length=1)] = Field(description="Studies by name.")
    finite_range: Annotated[dict[Name, BoundaryElements], _FEW] = Field(
        default={}, description="Boundary-element solutions by name, compared with the runs of a study."
    )
    boundary_element_loops: Annotated[dict[Name, BoundaryElementLoops], _FEW] = Field(
        default={},
        description="Boundary elements in loading and unloading by name, to compare with the runs of a "
        "study that unloads.",
    )
    measurements: Annotated[dict[Name, Measurement], _FEW] = Field(
        default={}, description="Measurements by name, drawn over figure 5. None come with ICHA."
    )
    figures: Figures = Field(default=Figures(), description="Figures and what they show.")
    publication: Publication = Field(
        default=Publication(), description="Metadata of a deposit; nothing else depends on them."
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

    def compares_models(self, study: str) -> bool:
        """Whether the runs of a study by asperities have others by boundary elements beside them at given loads."""
        asked = self.studies[study]
        return set(asked.models) == set(MODELS) and bool(asked.targets.reduced_pressures)

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

    def is_free(self, surface: str) -> bool:
        """Whether a surface is a square with free edges; all others are periodic."""
        return getattr(self.surfaces[surface], "boundary", None) == "free"

    def grid(self, surface: str) -> int | None:
        """Nodes along a side of a surface; None of one from a file that was not inspected."""
        return getattr(self.topography(surface) or self.surfaces[surface], "grid", None)

    def period(self, surface: str) -> float:
        """Side of a surface whose grid is known, m."""
        return (self.topography(surface) or self.surfaces[surface]).period

    def snapshots_of(self, study: str) -> list[tuple[str, float]] | None:
        """Kind and value of all states that the runs of a study keep; None where they keep their last one.

        The loads of the study's boundary elements are among them.
        """
        loads = sorted({p for e in self.finite_range.values() if e.study == study for p in e.reduced_pressures})
        if self.studies[study].snapshots is None and not loads:
            return None
        own = self.studies[study].own_snapshots
        kept = set(own)
        return own + [("reduced_pressure", p) for p in loads if ("reduced_pressure", p) not in kept]

    def solved(self, entry: BesideStudy) -> list[Contact]:
        """The contacts for which an entry beside a study asks."""
        lists = (entry.surfaces, entry.seeds, entry.rms_slopes, entry.materials)
        asked = [None if values is None else set(values) for values in lists]

        def is_asked_for(contact):
            seedless = not self.surfaces[contact.surface].random
            return all(
                values is None or value in values or (seedless and name == "seed")
                for name, value, values in zip(Contact._fields, contact, asked, strict=True)
            )

        return list(filter(is_asked_for, self._contacts[entry.study]))

    def problems(self) -> Iterator[Problem]:
        """What keeps it from being run although each of its values is allowed by itself.

        What depends on measured slopes and on grids of files is left out until these are known.
        """
        unknown_slopes = any(MEASURED in study.rms_slopes for study in self.studies.values())
        for place, value, reason in self._problems():
            if not (unknown_slopes and any(str(part).startswith("rms_slope") for part in place)):
                yield place, value, reason
        if not unknown_slopes:
            # Runs are called by their slopes.
            yield from _within(("publication",), self.publication.problems(self))

    def _problems(self):
        for label, study in self.studies.items():
            yield from _within(("studies", label), study.problems(self.snapshots_of(label)))
            yield from _within(("studies", label), self._model_problems(study))
        for section in (*BESIDE_STUDIES, "measurements"):
            for label, entry in getattr(self, section).items():
                yield from _within((section, label), entry.problems(self))
        for label in self.finite_range:
            if label in self.studies and self.compares_models(label):
                reason = "is the name of a study that has boundary elements of its own; allowed: another name"
                yield ("finite_range", label), label, reason
        for label, figure in self.figures.drawn().items():
            yield from _within(("figures", label), figure.problems(self))

    def measurement_problems(self) -> Iterator[Problem]:
        """Tables of measurements that cannot be read."""
        for label, entry in self.measurements.items():
            yield from _within(("measurements", label), entry.table_problems())

    def _model_problems(self, study: Study) -> Iterator[Problem]:
        """Surfaces of a study that its models cannot press."""
        for index, model in enumerate(study.models):
            for name in study.surfaces:
                for reason in self._reasons_against(MODELS[model], name):
                    yield ("models", index), model, reason

    def _reasons_against(self, model: Model, name: str) -> Iterator[str]:
        """Reasons why a model cannot press a surface."""
        surface, least = self.surfaces[name], model.least_cells
        if model.periodic_only and self.is_free(name):
            yield (
                f"need a periodic surface, and {name!r} is a square with free edges; allowed: asperities, or another "
                "`boundary`, which makes a surface periodic"
            )
        if surface.cells_per_short_wave < least * (1 - ROUNDING):
            yield (
                f"need at least {least} grid cells per shortest wavelength, and {name!r} has "
                f"{surface.cells_per_short_wave:.3g}; allowed: asperities, or a `grid` of "
                f"{surface.grid_of_cells(least)} or more for {name!r} (recommended: "
                f"{surface.grid_of_cells(_ADVISABLE_CELLS)})"
            )

    def warnings(self) -> list[str]:
        """What is allowed but not advisable."""
        found = []
        studies = self.studies.values()
        by_cells = {
            name
            for each in studies
            if any(MODELS[model].least_cells for model in each.models)
            for name in each.surfaces
        }
        for name in dict.fromkeys(name for study in studies for name in study.surfaces):
            surface, origin = self.surfaces[name], self.origin("surfaces", name)
            variant = "" if origin == name else f" (variant {name})"
            cells = surface.cells_per_short_wave
            if cells < _LEAST_CELLS * (1 - ROUNDING):
                found.append(
                    f"surfaces.{origin}.grid: {surface.grid!r} gives {cells:.3g} grid cells per shortest wavelength"
                    f"{variant}; recommended: {_ADVISABLE_CELLS}, at least {_LEAST_CELLS}"
                )
            elif cells < _ADVISABLE_CELLS * (1 - ROUNDING) and name in by_cells:
                found.append(
                    f"surfaces.{origin}.grid: {surface.grid!r} gives boundary elements {cells:.3g} cells per shortest "
                    f"wavelength{variant}, with which areas are off by a few per cent; recommended: "
                    f"{surface.grid_of_cells(_ADVISABLE_CELLS)} or more"
                )
        return found

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


def _within(location: tuple, problems: Iterable[Problem]) -> Iterator[Problem]:
    """The problems of a section at their places in the whole."""
    for place, value, reason in problems:
        yield (*location, *place), value, reason
