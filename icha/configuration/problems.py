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
    SelfAffineSurface,
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
        found += [(("figures", label, *place), value, reason) for place, value, reason in figure.problems(campaign)]
    return found


def _publication_problems(campaign: Campaign):
    """Failures that are known of runs that are none."""
    failures = campaign.publication.known_failures
    runs = {case.path for case in run_cases(campaign)} if failures else set()
    for index, failure in enumerate(failures):
        if failure.run not in runs:
            location = ("publication", "known_failures", index, "run")
            yield location, failure.run, f"is not a run; allowed: a run of the campaign, such as {min(runs)}"


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
