"""Studies written out into runs."""

from __future__ import annotations

import hashlib
import itertools
import json

from icha.configuration.model import BesideStudy, Campaign
from icha.configuration.topography import MeasuredSurface
from icha.datasets.labels import ContactLabels, RunLabels, SolutionLabels, number_label


def run_cases(campaign: Campaign) -> list[RunLabels]:
    """All runs of a campaign, study by study, in the order of the configuration's lists."""
    return [RunLabels(label, *contact) for label in campaign.studies for contact in campaign.contacts(label)]


def solution_cases(campaign: Campaign) -> list[SolutionLabels]:
    """All boundary-element solutions of a campaign, entry by entry."""
    return [
        SolutionLabels(label, entry.study, *contact, pressure)
        for label, entry in campaign.boundary_elements.items()
        for contact, pressure in itertools.product(campaign.solved(entry), entry.reduced_pressures)
    ]


def source_cases(campaign: Campaign) -> list[ContactLabels]:
    """All studies of the sources of the model's error, entry by entry."""
    return _cases(campaign, campaign.error_sources)


def loop_cases(campaign: Campaign) -> list[ContactLabels]:
    """All boundary elements both ways of a campaign, entry by entry."""
    return _cases(campaign, campaign.boundary_element_loops)


def _cases(campaign: Campaign, entries: dict[str, BesideStudy]) -> list[ContactLabels]:
    return [ContactLabels(label, *contact) for label, entry in entries.items() for contact in campaign.solved(entry)]


def source_settings(campaign: Campaign, case: ContactLabels) -> dict:
    """Everything but the topography that determines a study of the sources of the error, in SI units."""
    entry = campaign.error_sources[case.entry]
    return _solver_settings(campaign, entry, case) | {"reduced_pressures": entry.reduced_pressures}


def loop_settings(campaign: Campaign, case: ContactLabels) -> dict:
    """Everything but the topography that determines boundary elements both ways, in SI units."""
    entry = campaign.boundary_element_loops[case.entry]
    own = {"largest_reduced_pressure": campaign.loop_load(entry), "separation_step": entry.separation_step}
    return _solver_settings(campaign, entry, case) | own


def asperity_cases(campaign: Campaign) -> dict[str, float | None]:
    """Names of the comparisons of one asperity, and their Tabor parameters; None is Hertz's contact."""
    if campaign.one_asperity is None:
        return {}
    return {"hertz": None} | {f"mu{number_label(mu)}": mu for mu in campaign.one_asperity.tabor_parameters}


def map_solution(campaign: Campaign) -> SolutionLabels | None:
    """The finest boundary-element solution of the state that the contact map (figure 4) shows, if there is any."""
    figure = campaign.figures.fig4_contact_map
    snapshots = campaign.snapshots_of(figure.study) or [campaign.studies[figure.study].targets.last]
    if figure.snapshot is not None:
        kind, value = figure.snapshot.target
    elif {kind for kind, _ in snapshots} == {"reduced_pressure"}:
        kind, value = min(snapshots)  # the first one that is met
    else:
        return None
    if kind != "reduced_pressure":
        return None
    run = figure.run(campaign)
    found = [case for case in solution_cases(campaign) if case.run == run and case.reduced_pressure == value]
    return max(found, key=lambda case: campaign.boundary_elements[case.entry].refinement, default=None)


def solution_settings(campaign: Campaign, case: SolutionLabels) -> dict:
    """Everything but the topography that determines a boundary-element solution, in SI units."""
    entry = campaign.boundary_elements[case.entry]
    return _solver_settings(campaign, entry, case) | {"reduced_pressure": case.reduced_pressure}


def _solver_settings(campaign: Campaign, entry: BesideStudy, case: SolutionLabels | ContactLabels) -> dict:
    """What boundary elements are told but for their loads."""
    return {
        "material": campaign.materials[case.material].model_dump(),
        "rms_slope": case.rms_slope,
        "seed": case.seed,
        "refinement": entry.refinement,
        "tolerance": entry.tolerance,
    }


def surface_cases(campaign: Campaign) -> list[tuple[str, int]]:
    """The topographies of a campaign, as (surface, seed), each once though many runs share it."""
    return list(dict.fromkeys((case.surface, case.seed) for case in run_cases(campaign)))


def run_settings(campaign: Campaign, case: RunLabels) -> dict:
    """Everything that determines a run's numbers, in SI units: arguments of the model's own objects."""
    return {
        "material": campaign.materials[case.material].model_dump(),
        "path": campaign.studies[case.study].path_settings(campaign.snapshots_of(case.study)),
        "rms_slope": case.rms_slope,
        "seed": case.seed,
    }


def surface_settings(campaign: Campaign, name: str) -> dict:
    """Everything that determines a topography but its seed and its file, in SI units."""
    surface = campaign.surfaces[name]
    if surface.random:
        return surface.model_dump()
    if isinstance(surface, MeasuredSurface):
        return {"kind": surface.kind} | surface.preparation
    return {"kind": surface.kind, "period": surface.period, "metres_per_unit": surface.metres_per_unit}


def measurement_settings(campaign: Campaign, study: str) -> list[dict]:
    """The measurements that belong to a study, as a figure needs them, but for their files."""
    return [
        {
            "label": measurement.label,
            "citation": measurement.citation,
            "columns": measurement.columns,
            "load_unit": _load_unit(campaign, measurement),
            "material": measurement.material,
            "rms_slope": measurement.rms_slope,
        }
        for measurement in campaign.measurements.values()
        if measurement.study == study
    ]


def _load_unit(campaign, measurement) -> float:
    """What a measured load is divided by to become p/(E* h'rms)."""
    if not measurement.load_is_pressure:
        return 1.0
    return campaign.materials[measurement.material].contact_modulus * measurement.rms_slope


def run_sha256(campaign: Campaign, case: RunLabels) -> str:
    """Checksum of everything that determines a run."""
    topography = campaign.topography(case.surface)
    file = [topography.sha256] if topography else []
    return _sha256([run_settings(campaign, case), surface_settings(campaign, case.surface), *file])


def campaign_sha256(campaign: Campaign) -> str:
    """Checksum of everything that determines the runs of a campaign: not of its figures or its title."""
    return _sha256({case.path: run_sha256(campaign, case) for case in run_cases(campaign)})


def _sha256(settings) -> str:
    """Checksum of settings, whatever their order or the units that they were written in."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()
