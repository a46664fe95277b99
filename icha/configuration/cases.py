"""Runs and everything else that a campaign asks for: their labels, the settings of their jobs, and their checksums."""

import hashlib
import itertools
import json
from collections.abc import Callable
from functools import partial

from icha.configuration.boundary_elements import BesideStudy
from icha.configuration.campaign import Campaign
from icha.configuration.surfaces import MeasuredSurface
from icha.contact.models import DEFAULT_MODEL
from icha.datasets.labels import ContactLabels, RunLabels, SolutionLabels


def run_cases(campaign: Campaign) -> list[RunLabels]:
    """All runs of a campaign, study by study and model by model, in the order of the configuration's lists."""
    return [
        RunLabels(label, model, *contact)
        for label, study in campaign.studies.items()
        for model, contact in itertools.product(study.models, campaign.contacts(label))
    ]


def surface_cases(campaign: Campaign) -> list[tuple[str, int]]:
    """The topographies of a campaign, as (surface, seed), each once though many runs share it."""
    return list(dict.fromkeys((case.surface, case.seed) for case in run_cases(campaign)))


def solution_cases(campaign: Campaign) -> list[SolutionLabels]:
    """All boundary-element solutions of a campaign, entry by entry."""
    return [
        SolutionLabels(label, entry.study, *contact, pressure)
        for label, entry in campaign.finite_range.items()
        for contact, pressure in itertools.product(campaign.solved(entry), entry.reduced_pressures)
    ]


def loop_cases(campaign: Campaign) -> list[ContactLabels]:
    """All boundary elements both ways of a campaign, entry by entry."""
    return [
        ContactLabels(label, *contact)
        for label, entry in campaign.boundary_element_loops.items()
        for contact in campaign.solved(entry)
    ]


def surface_settings(campaign: Campaign, name: str) -> dict:
    """Everything that determines a topography but its seed and its file, in SI units."""
    surface = campaign.surfaces[name]
    if surface.random:
        return surface.model_dump()
    if isinstance(surface, MeasuredSurface):
        return {"kind": surface.kind} | surface.preparation
    return {"kind": surface.kind, "period": surface.period, "metres_per_unit": surface.metres_per_unit}


def run_settings(campaign: Campaign, case: RunLabels) -> dict:
    """Everything that determines a run's numbers, in SI units: arguments of the model's own objects.

    Those that are left at their defaults are left out, the model among them.
    """
    return {
        "material": campaign.materials[case.material].model_dump(),
        "path": campaign.studies[case.study].path_settings(campaign.snapshots_of(case.study)),
        "rms_slope": case.rms_slope,
        "seed": case.seed,
    } | ({} if case.model == DEFAULT_MODEL else {"model": case.model})


def solution_settings(campaign: Campaign, case: SolutionLabels) -> dict:
    """Everything but the topography that determines a boundary-element solution, in SI units."""
    entry = campaign.finite_range[case.entry]
    return _solver_settings(campaign, entry, case) | {"reduced_pressure": case.reduced_pressure}


def loop_settings(campaign: Campaign, case: ContactLabels) -> dict:
    """Everything but the topography that determines boundary elements both ways, in SI units."""
    entry = campaign.boundary_element_loops[case.entry]
    own = {"largest_reduced_pressure": campaign.loop_load(entry), "separation_step": entry.separation_step}
    return _solver_settings(campaign, entry, case) | own


def _solver_settings(campaign: Campaign, entry: BesideStudy, case: SolutionLabels | ContactLabels) -> dict:
    """What boundary elements are told but for their loads."""
    return {
        "material": campaign.materials[case.material].model_dump(),
        "rms_slope": case.rms_slope,
        "seed": case.seed,
        "refinement": entry.refinement,
        "tolerance": entry.tolerance,
    }


def adhesive_contacts(campaign: Campaign, surface: str) -> list[dict]:
    """Slopes and materials with adhesion of a surface's runs, each once."""
    pairs = dict.fromkeys((case.rms_slope, case.material) for case in run_cases(campaign) if case.surface == surface)
    return [
        {"rms_slope": rms_slope, "name": name, "material": campaign.materials[name].model_dump()}
        for rms_slope, name in pairs
        if campaign.materials[name].surface_energy > 0
    ]


def run_sha256(campaign: Campaign, case: RunLabels) -> str:
    """Checksum of everything that determines a run."""
    topography = campaign.topography(case.surface)
    file = [topography.sha256] if topography else []
    return _sha256([run_settings(campaign, case), surface_settings(campaign, case.surface), *file])


def campaign_sha256(campaign: Campaign, of_run: Callable[[RunLabels], str] | None = None) -> str:
    """Checksum of everything that determines the runs of a campaign: not of its figures or its title.

    `of_run` gives those of its runs (`run_sha256`), where they are known already.
    """
    of_run = of_run or partial(run_sha256, campaign)
    return _sha256({case.path: of_run(case) for case in run_cases(campaign)})


def _sha256(settings) -> str:
    """Checksum of settings, whatever their order or the units that they were written in."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()
