"""A campaign: rough surfaces, elastic materials, and studies of the contacts between surface and material.

Values are in SI units. `icha.configuration.load` reads a campaign from a configuration file,
`icha.configuration.errors` writes the messages, and `icha.configuration.schema` generates the JSON schema of the file.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, NamedTuple

from pydantic import AfterValidator, Field, PrivateAttr

from icha.configuration.figures import Figures
from icha.configuration.measurements import Measurement
from icha.configuration.publication import Line, Prose, Publication
from icha.configuration.studies import MEASURED, RmsHeight, Study, is_unread, slope_of_height
from icha.configuration.surfaces import AnySurface, MaterialSection
from icha.contact.models import MODELS
from icha.datasets.labels import LABELS, RunLabels, is_derived_study
from icha.path.targets import AREAS, CONTACT_RADIUS, FORCE, INDENTATION, WITHOUT_ADHESION, Target
from icha.support import formatting
from icha.support.tables import read_columns
from icha.support.values import Name, Problem, Section, Text, distinct
from icha.surfaces.moments import FullContact
from icha.surfaces.resolution import Resolution

# Largest number of entries in a section. The number is small, because the check of an entry goes through all runs of
# its study.
_FEW = Field(max_length=100)


class Topography(NamedTuple):
    """Properties of a topography from a file.

    Attributes
    ----------
    grid : nodes along a side.
    period : side of the square, m.
    rms_slope : measured rms slope; None if no study uses the measured slope.
    rms_height : rms height at rms slope 1, m.
    sha256 : SHA-256 of the file.
    full_contact : full contact with a half-space at rms slope 1.
    rms_curvature : rms curvature of profiles at rms slope 1, 1/m.
    shortest_wave : shortest wavelength of the surface, m, and whether it is an estimate.
    repeated_height : description of a height that many points of a scan share; "" without.
    """

    grid: int
    period: float
    rms_slope: float | None
    sha256: str
    full_contact: FullContact
    rms_height: float
    rms_curvature: float
    shortest_wave: tuple[float, bool]
    repeated_height: str


class Defaults(Section):
    """Default values for surfaces, materials and studies."""

    surfaces: dict[str, Any] = {}
    """Default values for the keys of surfaces. Each surface takes only the keys of its kind."""
    materials: dict[str, Any] = {}
    """Default values for the keys of materials."""
    studies: dict[str, Any] = {}
    """Default values for the keys of studies."""


class Campaign(Section):
    """A campaign: the content of one configuration file."""

    name: Name
    """Name of the campaign. ICHA writes results to `results/<name>/`."""
    title: Line
    """Title of the campaign, one line."""
    summary: Prose
    """A few sentences about the campaign. Datasets and report contain this text."""
    license: Line
    """Licence of the data, as an SPDX identifier such as `CC-BY-4.0`."""
    confirmed: Annotated[list[Text], AfterValidator(distinct)] = []
    """Keys of unusual values that you intend, such as `materials.soft.contact_modulus`. For an entry of a list, give
    the key of the list. ICHA refuses unusual values that are not confirmed."""
    defaults: Defaults = Defaults()
    """Default values for all surfaces, materials or studies."""
    surfaces: Annotated[dict[Name, AnySurface], Field(min_length=1)]
    """Surfaces by name. Each surface has `kind: self_affine`, `kind: spectrum`, `kind: measured`, `kind: file` or
    `kind: smooth`."""
    materials: Annotated[dict[Name, MaterialSection], Field(min_length=1)]
    """Materials by name."""
    studies: Annotated[dict[Name, Study], Field(min_length=1)]
    """Studies by name."""
    measurements: Annotated[dict[Name, Measurement], _FEW] = {}
    """Your own measurements by name. Figures 5 and 17 to 19 show them together with the results of runs."""
    figures: Figures = Figures()
    """Figures to draw, with options."""
    publication: Publication = Publication()
    """Metadata of a deposit. Metadata do not change any result."""

    # Runs of each study, model by model. A slope may be `measured` or an `RmsHeight` until the files are read.
    _runs: dict[str, tuple[RunLabels, ...]] = PrivateAttr(default={})
    _topographies: dict[str, Topography] = PrivateAttr(default={})
    _origins: dict[tuple[str, str], str] = PrivateAttr(default={})

    def deposit_metadata(self) -> Publication:
        """Return the metadata of a deposit. A missing title, summary or licence is taken from the campaign."""
        given = self.publication
        return given.model_copy(
            update={key: getattr(given, key) or getattr(self, key) for key in ("title", "summary", "license")}
        )

    def compares_models(self, study: str) -> bool:
        """Return whether a study has runs with both contact models at the same reduced pressures."""
        section = self.studies[study]
        return set(section.models) == set(MODELS) and bool(section.targets.reduced_pressures)

    def runs(self, study: str) -> list[RunLabels]:
        """Return the runs of a study, model by model."""
        return list(self._runs[study])

    @property
    def all_runs(self) -> list[RunLabels]:
        """Labels of all runs, study by study and model by model, in the order of the file."""
        return [run for study in self.studies for run in self._runs[study]]

    @property
    def used_surfaces(self) -> list[str]:
        """Names of the surfaces that runs have, in the order of the runs."""
        return list(dict.fromkeys(run.surface for run in self.all_runs))

    @property
    def own_studies(self) -> dict[str, Study]:
        """Studies of the file, without those that ICHA derives from them."""
        return {name: study for name, study in self.studies.items() if not is_derived_study(name, self.studies)}

    def contacts(self, study: str) -> list[RunLabels]:
        """Return the first run of a study for each surface, slope and material; other seeds and models do not count."""
        found: dict[tuple, RunLabels] = {}
        for run in self._runs[study]:
            found.setdefault((run.surface, run.rms_slope, run.material), run)
        return list(found.values())

    def with_runs(self, runs: Mapping[str, Iterable[RunLabels]]) -> Campaign:
        """Return the campaign with the given runs; their values replace the lists of each study."""
        runs = {study: tuple(dict.fromkeys(each)) for study, each in runs.items()}
        studies = {}
        for label, study in self.studies.items():
            columns = dict(zip(RunLabels._fields, zip(*runs[label], strict=True), strict=True))
            lists = {f"{name}s": list(dict.fromkeys(columns[name])) for name in LABELS}
            studies[label] = study.model_copy(update=lists)
        campaign = self.model_copy(update={"studies": studies})
        campaign._runs = runs
        return campaign

    def with_topographies(self, topographies: Mapping[str, Topography]) -> Campaign:
        """Return the campaign with properties of topographies from files; numbers replace the slope `measured`."""

        def with_slope(run):
            if isinstance(run.rms_slope, RmsHeight):
                return run._replace(rms_slope=slope_of_height(run.rms_slope, topographies[run.surface].rms_height))
            return run._replace(rms_slope=topographies[run.surface].rms_slope) if run.rms_slope == MEASURED else run

        campaign = self.with_runs({study: map(with_slope, runs) for study, runs in self._runs.items()})
        campaign._topographies = dict(topographies)
        return campaign

    @property
    def topographies(self) -> dict[str, Topography]:
        """Properties of the surfaces that come from files, by name; empty until the files are read."""
        return self._topographies

    def origin(self, section: str, name: str) -> str:
        """Return the name of the surface or material from which a variant was made; return other names unchanged."""
        return self._origins.get((section, name), name)

    def is_free(self, surface: str) -> bool:
        """Return whether a surface is a square with free edges; False for periodic surfaces."""
        return self.surfaces[surface].free

    def is_flat(self, surface: str) -> bool:
        """Return whether a surface is nominally flat: it has no shape."""
        return self.surfaces[surface].shape is None

    def grid(self, surface: str) -> int | None:
        """Return the number of nodes along a side of a surface; None if its file has not been read."""
        return getattr(self._grid_and_period(surface), "grid", None)

    def period(self, surface: str) -> float:
        """Return the side of a surface, m; if the surface comes from a file, the file must have been read."""
        return self._grid_and_period(surface).period

    def slope_of_height(self, surface: str, rms_height: float) -> float:
        """Return the rms slope of the spectrum or the file of a surface at an rms height, m; 0 without roughness."""
        section, topography = self.surfaces[surface], self.topographies.get(surface)
        if section.smooth:
            return 0.0
        unit = topography.rms_height if topography else section.rms_height_at_unit_slope
        return slope_of_height(RmsHeight(rms_height), unit)

    def resolution(self, surface: str) -> Resolution:
        """Return the number of grid cells per shortest wave of a surface; its file must have been read."""
        section, topography = self.surfaces[surface], self.topographies.get(surface)
        wavelength, estimated = topography.shortest_wave if topography else (math.inf, False)
        if topography is None and not section.smooth:
            wavelength = section.short_wavelength
        if section.shape is not None and section.shape.shape.shortest_wave < wavelength:
            wavelength, estimated = section.shape.shape.shortest_wave, False
        return Resolution(wavelength * self.grid(surface) / self.period(surface), estimated=estimated)

    def _grid_and_period(self, surface):
        """Return the object with the grid and the period of a surface; both are missing if its file is not read."""
        return self.topographies.get(surface) or self.surfaces[surface]

    def problems(self) -> Iterator[Problem]:
        """Yield the problems that concern several values of the campaign, such as names that are not defined.

        Problems that depend on files (measured slopes, grids) are left out until the files are read.
        """
        unknown_slopes = any(is_unread(slope) for study in self.studies.values() for slope in study.rms_slopes)
        for location, value, reason in self._problems():
            if not (unknown_slopes and any(str(key).startswith("rms_slope") for key in location)):
                yield location, value, reason
        if not unknown_slopes:
            # This check compares names of runs, and these names contain slopes.
            yield from _within(("publication",), self.publication.problems(self))

    def _problems(self):
        own = self.own_studies
        for label, study in self.studies.items():
            yield from _within(("studies", label), self._model_problems(study))
            if label not in own:
                continue  # its problems are those of the study from which it is derived
            yield from _within(("studies", label), study.problems(*self.units_of(label)))
            yield from _within(("studies", label), self._tension_problems(study))
            yield from _within(("studies", label), self._edge_problems(study))
        for section, entries in {"measurements": self.measurements, "figures": self.figures.by_name()}.items():
            for label, entry in entries.items():
                yield from _within((section, label), entry.problems(self))

    def file_problems(self) -> Iterator[Problem]:
        """Yield a problem for each table of measurements, and each script of an own figure, that cannot be used."""
        yield from self.figures.script_problems()
        for label, entry in self.measurements.items():
            try:
                columns = read_columns(entry.path, entry.columns, entry.limits(self), entry.signed)
                if entry.force:
                    # Slow to import.
                    from icha.references.jkr_tables import refuse_lost_order, refuse_wrong_signs

                    values = dict(zip(entry.si_units, columns, strict=True))
                    places = [f"row {k}" for k in range(1, 1 + len(columns[0]))]
                    refuse_wrong_signs(values, places)
                    if entry.contact_radius:  # figure 18 shows loading and unloading in two panels
                        refuse_lost_order(values, places)
            except ValueError as error:
                yield ("measurements", label, "path"), entry.path, str(error)

    def units_of(self, study: str) -> tuple[float, float, float]:
        """Return the smallest E* h'rms (Pa), E* A0 h'rms (N) and side (m) of a study; infinite if they are unknown."""
        known = [each for each in self.contacts(study) if hasattr(self._grid_and_period(each.surface), "period")]
        sides = {each.surface: self.period(each.surface) for each in known}
        units = {
            each: self.materials[each.material].contact_modulus * each.rms_slope
            for each in known
            # The reduced pressure of a surface with a shape does not depend on its roughness.
            if not is_unread(each.rms_slope) and self.is_flat(each.surface)
        }
        forces = (pressure * sides[each.surface] ** 2 for each, pressure in units.items())
        return tuple(min(values, default=math.inf) for values in (units.values(), forces, sides.values()))

    def _model_problems(self, study: Study) -> Iterator[Problem]:
        """Yield a problem for each surface or material that a model of the study does not support."""
        unsupported = []
        for name in study.materials:
            if self.materials[name].thickness is not None:
                reason = f"need a half-space, because their law is that of a half-space, but {name!r} is a layer"
                unsupported.append(f"{reason}; expected [boundary_elements], or no `thickness` in {name!r}")
            if self.materials[name].adhesion_map:
                reason = f"have the same work of adhesion everywhere, but {name!r} has a map"
                unsupported.append(f"{reason}; expected [boundary_elements], or no map in {name!r}")
        for name in itertools.filterfalse(self.is_flat, study.surfaces):
            reason = f"need a nominally flat surface, because they are wrong on shapes, but {name!r} has a shape"
            unsupported.append(f"{reason}; expected [boundary_elements]")
        for (index, label), reason in itertools.product(enumerate(study.models), unsupported):
            if MODELS[label].by_summits:
                yield ("models", index), label, reason
        for name, label in itertools.product(study.surfaces, study.materials):
            thickness, known = self.materials[label].thickness, self._grid_and_period(name)
            if not (hasattr(known, "grid") and hasattr(known, "period")):
                continue  # the file is not read yet
            if places := self.materials[label].adhesion_map:
                try:
                    places.field.on_nodes(known.grid, known.period, periodic=not self.is_free(name))
                except ValueError as error:
                    reason = f"contains {label!r}, whose work of adhesion does not fit the surface {name!r}: {error}"
                    yield ("materials",), study.materials, reason
            if thickness and self.is_free(name) and thickness < known.period / known.grid:
                layer, cell = formatting.length(thickness), formatting.length(known.period / known.grid, 3)
                reason = f"contains the layer {label!r} of {layer}, thinner than a grid cell of {name!r} ({cell})"
                yield ("materials",), study.materials, f"{reason}; expected a thicker layer or a finer grid"

    def _tension_problems(self, study: Study) -> Iterator[Problem]:
        """Yield a problem for each load that a material without adhesion cannot have."""
        without = [name for name in study.materials if not self.materials[name].surface_energy]
        for location, kind, value in study.states() if without else ():
            if Target(kind, value).needs_adhesion and (value < 0 or location[0] != "turning_points"):
                yield location, value, f"{WITHOUT_ADHESION} of {without[0]!r}"

    def contact_radii(self, study: Study, surface: str, material: str) -> dict[tuple, tuple[str, float]]:
        """Return the radii (m) of the contacts that theory expects of a smooth shape on a half-space, by location.

        The locations are those of targets and turning points; () is the contact after the jump-in, with adhesion. In
        front of each radius stands the prescribed quantity: CONTACT_RADIUS, INDENTATION or FORCE. A layer counts as a
        half-space.
        """
        from icha.references.indentation import contact_radius_at
        from icha.references.limits import convert_target

        shape, section, side = self.surfaces[surface].shape.shape, self.materials[material], self.period(surface)

        def radius(quantity, value):
            if quantity == CONTACT_RADIUS:
                return value
            return contact_radius_at(quantity, value, shape, section.contact_modulus, section.surface_energy)

        radii = {(): (INDENTATION, radius(INDENTATION, 0.0))} if section.surface_energy else {}
        for location, kind, value in study.states():
            quantity, value = convert_target(shape, side, section.contact_modulus, kind, value)
            radii[location] = quantity, radius(quantity, value)
        return radii

    def _edge_problems(self, study: Study) -> Iterator[Problem]:
        """Yield a problem for each shape whose contact is larger than its square, by the theory of smooth shapes."""
        values = {location: value for location, _, value in study.states()} | {(): study.surfaces}
        for name, label in itertools.product(study.surfaces, study.materials):
            side = getattr(self._grid_and_period(name), "period", None)
            if side is None or not self.surfaces[name].shape:
                continue
            radii, material = self.contact_radii(study, name, label), self.materials[label]
            # At an indentation without adhesion, the contact on a layer is larger than on a half-space. At a force, or
            # with adhesion, it may be smaller.
            bounded = {CONTACT_RADIUS, INDENTATION, FORCE}
            if material.thickness is not None:
                bounded = {CONTACT_RADIUS} if material.surface_energy else {CONTACT_RADIUS, INDENTATION}
            for location, (quantity, a) in radii.items():
                # Roughness may prevent the jump-in of the smooth shape.
                if quantity in bounded and 2 * a > side and (location or self.surfaces[name].smooth):
                    radius, given, least = (formatting.length(each, 3) for each in (a, side, 3 * a))
                    reason = f"gives {label!r} on {name!r} a contact radius of about {radius}"
                    reason += "" if location else " after the jump-in"
                    reason += f", but the square has the side {given}; expected a side of at least {least}"
                    yield location or ("surfaces",), values[location], f"{reason}, or smaller targets"
                    break
            yield from self._jump_in_problems(study, name, label, radii)

    def _jump_in_problems(
        self, study: Study, surface: str, material: str, radii: dict[tuple, tuple[str, float]]
    ) -> Iterator[Problem]:
        """Yield a problem for a target contact smaller than that of pull-off: a smooth sphere jumps over it.

        `radii` are those of `contact_radii`.
        """
        from icha.references.indentation import pull_off_state

        section, adhesive = self.surfaces[surface], self.materials[material]
        shape = section.shape.shape
        if not (section.smooth and shape.sphere_radius and adhesive.surface_energy and adhesive.thickness is None):
            return
        radius = float(pull_off_state(shape, adhesive.contact_modulus, adhesive.surface_energy).contact_radius)
        reason = f"lies inside the jump into contact of {material!r} on {surface!r}, which pulls off from a"
        reason += f" contact radius of {formatting.length(radius, 3)}; expected larger contacts, or `indentations`"
        for location, kind, value in study.states():
            if location[0] == "targets" and kind in AREAS and radii[location][1] < radius:
                yield location, value, reason
                return


def _within(location: tuple, problems: Iterable[Problem]) -> Iterator[Problem]:
    """Put the location of a section in front of the locations of its problems."""
    for inner, value, reason in problems:
        yield (*location, *inner), value, reason
