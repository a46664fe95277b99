"""What keeps a campaign from being run although each of its values is allowed by itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from icha.asperity.cohesive_zone import resolution_problem
from icha.asperity.material import Material as Interface
from icha.configuration.expansion import run_cases
from icha.configuration.model import (
    BESIDE_STUDIES,
    Campaign,
    ComparedFigure,
    LoopsFigure,
    LossFigure,
    PullOffFigure,
    SelfAffineSurface,
    SlopesFigure,
    SnapMapFigure,
    SnapshotFigure,
    SourcesFigure,
    TaborFigure,
)
from icha.configuration.values import MAX_GRID
from icha.path.limits import MAX_REDUCED_PRESSURE
from icha.support.values import ROUNDING

# Location in the configuration, value, and what is wrong with it and allowed.
Problem = tuple[tuple, Any, str]


def problems(campaign: Campaign) -> list[Problem]:
    """Names that lead nowhere, as (location, value, what is allowed)."""
    found = []

    def known(location, name, names):
        if name not in names:
            found.append((location, name, f"is not defined; allowed: {', '.join(names) or 'none, for there is none'}"))

    for label, study in campaign.studies.items():
        found += _load_problems(("studies", label), study)
        found += _path_problems(campaign, ("studies", label), study)
    for label, entry in campaign.boundary_element_loops.items():
        if entry.study in campaign.studies:
            found += _loop_problems(campaign, ("boundary_element_loops", label), entry)
    for section in BESIDE_STUDIES:
        for label, entry in getattr(campaign, section).items():
            known((section, label, "study"), entry.study, campaign.studies)
            if entry.study in campaign.studies:
                found += _solution_problems(campaign, (section, label), entry)
    for label, measurement in campaign.measurements.items():
        known(("measurements", label, "study"), measurement.study, campaign.studies)
        if measurement.material is not None:
            known(("measurements", label, "material"), measurement.material, campaign.materials)
    found += _publication_problems(campaign)
    for label, figure in campaign.figures.drawn().items():
        if isinstance(figure, SourcesFigure):
            known(("figures", label, "entry"), figure.entry, campaign.error_sources)
            if figure.entry in campaign.error_sources:
                found += _sources_problems(campaign, ("figures", label, "entry"), figure.entry)
        for key in ("studies", "load_studies"):
            names = figure.model_dump().get(key) or []
            for index, name in enumerate(names):
                known(("figures", label, key, index), name, campaign.studies)
                found += _apart_problems(campaign, ("figures", label, key, index), figure, name)
        if not hasattr(figure, "study"):
            continue
        known(("figures", label, "study"), figure.study, campaign.studies)
        found += _apart_problems(campaign, ("figures", label, "study"), figure, figure.study)
        if figure.study in campaign.studies:
            found += _figure_problems(campaign, ("figures", label), figure, campaign.studies[figure.study])
    return found


def _publication_problems(campaign: Campaign):
    """Failures that are known of runs that are none."""
    failures = campaign.publication.known_failures
    runs = {case.path for case in run_cases(campaign)} if failures else set()
    for index, failure in enumerate(failures):
        if failure.run not in runs:
            location = ("publication", "known_failures", index, "run")
            yield location, failure.run, f"is not a run; allowed: a run of the campaign, such as {min(runs)}"


def _apart_problems(campaign: Campaign, location, figure, name):
    """Studies that do not come back, in figures of the way back."""
    if name not in campaign.studies or not isinstance(figure, LoopsFigure | PullOffFigure | LossFigure | SnapMapFigure):
        return
    study = campaign.studies[name]
    if not study.unload and (isinstance(figure, PullOffFigure | LossFigure) or not study.turning_points):
        yield location, name, "is not unloaded; allowed: a study with `unload: true`"


def _load_problems(location, study):
    """Loads that a slope of a study makes too large for the model."""
    for key in ("snapshots", "turning_points"):
        for index, state in enumerate(getattr(study, key) or []):
            for slope in study.rms_slopes:
                if (state.relative_load or 0) / slope > MAX_REDUCED_PRESSURE:
                    yield (
                        (*location, key, index, "relative_load"),
                        state.relative_load,
                        f"at rms slope {slope:g} is a reduced pressure of {state.relative_load / slope:g}; allowed: "
                        f"relative loads up to {MAX_REDUCED_PRESSURE * min(study.rms_slopes):g}",
                    )


def _path_problems(campaign: Campaign, location, study):
    """What keeps the way back of a study from being a path."""
    if not (study.unload or study.turning_points or study.control != "separation"):
        return
    try:
        study.check_path(campaign.snapshots_of(location[1]))
    except ValueError as error:
        key, _, reason = str(error).partition(": ")
        name, _, index = key.partition("[")
        place, value = (name,), getattr(study, name)
        if index:
            kind, value = value[int(index.rstrip("]"))].target
            place = (name, int(index.rstrip("]")), kind)
        yield (*location, *place), value, reason.removeprefix(f"{value!r} ")


def _loop_problems(campaign: Campaign, location, entry):
    """What boundary elements both ways need of their study."""
    study = campaign.studies[entry.study]
    if not study.unload or study.turning_points:
        yield (
            (*location, "study"),
            entry.study,
            "does not come straight back; allowed: a study with `unload: true` and without turning points",
        )
    if study.targets.last[0] != "reduced_pressure":
        yield (
            (*location, "study"),
            entry.study,
            "has no reduced pressures for targets; allowed: a study with them, whose last one is where to turn",
        )


def _solution_problems(campaign: Campaign, location, entry):
    study = campaign.studies[entry.study]
    for key in ("surfaces", "seeds", "rms_slopes", "materials"):
        there = getattr(study, key)
        for index, value in enumerate(getattr(entry, key) or []):
            if value not in there:
                allowed = ", ".join(map(str, there))
                yield (*location, key, index), value, f"is not in study {entry.study!r}; allowed: {allowed}"
    contacts = campaign.solved(entry)
    if not contacts:
        yield location, entry.study, "has no run with all that is asked for; allowed: combinations that the study has"
    for name in dict.fromkeys(each.surface for each in contacts):
        if campaign.boundary(name) != "periodic":
            reason = "has a surface without periods; allowed: studies of periodic surfaces, as boundary elements are"
            yield (*location, "study"), entry.study, f"{reason} ({name!r} is not)"
            continue
        yield from _unresolved(campaign, location, entry, name)
        nodes = campaign.grid(name) * entry.refinement
        if nodes > MAX_GRID:
            yield (
                (*location, "refinement"),
                entry.refinement,
                f"gives {nodes} nodes a side on {name!r}; allowed: {MAX_GRID} at most",
            )


def _unresolved(campaign: Campaign, location, entry, surface: str) -> Iterator[Problem]:
    """Materials of an entry beside a study whose attraction the grid of a surface does not resolve."""
    spacing = campaign.period(surface) / (campaign.grid(surface) * entry.coarsest)
    for label in dict.fromkeys(each.material for each in campaign.solved(entry) if each.surface == surface):
        material = Interface(**campaign.materials[label].model_dump())
        if problem := resolution_problem(material, spacing):
            yield (*location, "materials"), label, f"on surface {surface!r}: {problem}"


def _sources_problems(campaign: Campaign, location, name):
    """What keeps the runs without adhesion of an entry of error sources from differing in their seeds only."""
    entry = campaign.error_sources[name]
    if entry.study not in campaign.studies:
        return
    contacts = campaign.solved(entry)
    bare = [each for each in contacts if campaign.materials[each.material].surface_energy == 0]
    for what, asked in (
        ("surface", [each.surface for each in contacts]),
        ("rms slope", [each.rms_slope for each in contacts]),
        ("material without adhesion", [each.material for each in bare]),
    ):
        there = list(dict.fromkeys(asked))
        if len(there) != 1:
            listed = f" ({', '.join(map(str, there))})" if there else ""
            yield (
                location,
                name,
                f"has not one {what} but {len(there)}{listed}; allowed: an entry with one, and any seeds",
            )


def _figure_problems(campaign: Campaign, location, figure, study):
    for key, there in (
        ("surface", study.surfaces),
        ("seed", study.seeds),
        ("material", study.materials),
        ("rms_slope", study.rms_slopes),
    ):
        value = getattr(figure, key, None)
        if value is not None and value not in there:
            allowed = ", ".join(map(str, there))
            yield (*location, key), value, f"is not in study {figure.study!r}; allowed: {allowed}"
    snapshots = campaign.snapshots_of(figure.study)
    kinds = [kind for kind, _ in snapshots or []]
    if isinstance(figure, SlopesFigure):
        for kind in ("relative_load", "area_fraction"):
            if kind not in kinds:
                reason = f"has no snapshot of kind {kind}; allowed: a study with one"
                yield (*location, "study"), figure.study, reason
    if isinstance(figure, TaborFigure):
        if not any(campaign.materials[name].surface_energy > 0 for name in study.materials):
            reason = "has no material with adhesion, so no Tabor parameter; allowed: a study with one"
            yield (*location, "study"), figure.study, reason
    if isinstance(figure, ComparedFigure) and figure.study not in {
        e.study for e in campaign.boundary_elements.values()
    }:
        reason = "has no boundary elements beside it; allowed: a study that an entry of boundary_elements names"
        yield (*location, "study"), figure.study, reason
    if isinstance(figure, SnapshotFigure) and snapshots == []:
        yield (*location, "study"), figure.study, "keeps no snapshot to draw; allowed: a study with one"
    snapshot = getattr(figure, "snapshot", None)
    if snapshot is not None and snapshot.target not in (snapshots or []):
        there = ", ".join(f"{kind} {value:g}" for kind, value in snapshots or [])
        kind, value = snapshot.target
        yield (
            (*location, "snapshot"),
            f"{kind} {value:g}",
            f"is no snapshot of study {figure.study!r}; allowed: {there or 'none, for the study names none'}",
        )


# Rms slopes beyond this are rather a mistake about units than a surface.
_STEEP = 3.0


def warnings(campaign: Campaign) -> list[str]:
    """What is allowed but not advisable."""
    found = []
    for name in dict.fromkeys(name for study in campaign.studies.values() for name in study.surfaces):
        surface, topography = campaign.surfaces[name], campaign.topography(name)
        origin = campaign.origin("surfaces", name)
        variant = "" if origin == name else f" (variant {name})"
        if isinstance(surface, SelfAffineSurface) and surface.cells_per_short_wave < 4 * (1 - ROUNDING):
            found.append(
                f"surfaces.{origin}.grid: {surface.grid!r} gives {surface.cells_per_short_wave:.3g} grid cells per "
                f"shortest wavelength{variant}; 4 are the least advisable, 8 recommended"
            )
        if topography is not None and (topography.rms_slope or 0) > _STEEP:
            found.append(
                f"surfaces.{origin}: the topography has an rms slope of {topography.rms_slope:g}{variant}; check its "
                "units of height and length, its size, and whether a number stands for points that are missing"
            )
    return found
