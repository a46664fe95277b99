"""Runs and everything else that a campaign asks for, by their labels."""

import itertools

from icha.configuration.boundary_elements import BesideStudy
from icha.configuration.campaign import Campaign
from icha.datasets.labels import ContactLabels, RunLabels, SolutionLabels, number_label


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


def source_cases(campaign: Campaign) -> list[ContactLabels]:
    """All studies of the sources of the model's error, entry by entry."""
    return _cases(campaign, campaign.error_sources)


def loop_cases(campaign: Campaign) -> list[ContactLabels]:
    """All boundary elements both ways of a campaign, entry by entry."""
    return _cases(campaign, campaign.boundary_element_loops)


def _cases(campaign: Campaign, entries: dict[str, BesideStudy]) -> list[ContactLabels]:
    return [ContactLabels(label, *contact) for label, entry in entries.items() for contact in campaign.solved(entry)]


def asperity_cases(campaign: Campaign) -> dict[str, float | None]:
    """Names of the comparisons of one asperity, and their Tabor parameters; None is Hertz's contact."""
    if campaign.one_asperity is None:
        return {}
    return {"hertz": None} | {f"mu{number_label(mu)}": mu for mu in campaign.one_asperity.tabor_parameters}
