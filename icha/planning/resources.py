"""Memory, time and cores that jobs are given, generously: what they are expected to take is in `costs`."""

from icha.configuration.boundary_elements import BesideStudy
from icha.configuration.campaign import Campaign
from icha.contact.models import ASPERITIES
from icha.datasets.labels import RunLabels
from icha.planning.costs import MAP_ARRAYS, PATCH_ARRAYS, job_threads

_ARRAY = 8e-6
"""Megabytes of a number."""


def surface_threads(campaign: Campaign, surface: str) -> int:
    """Cores for a surface and its sweeps: one, with sweeps side by side, but where transforms of large arrays pay."""
    return job_threads(campaign.grid(surface))


def surface_memory(campaign: Campaign, surface: str) -> int:
    """Megabytes for making a surface, or a sweep of it: some arrays of its size, and the program."""
    return int(600 + 4 * _ARRAY * campaign.grid(surface) ** 2)


def run_threads(campaign: Campaign, case: RunLabels) -> int:
    """Cores for a run: those of its surface."""
    return surface_threads(campaign, case.surface)


def run_memory(campaign: Campaign, case: RunLabels) -> int:
    """Megabytes for a run: some arrays of the surface's size, for boundary elements some dozens, and the program."""
    if case.model == ASPERITIES:
        return surface_memory(campaign, case.surface)
    return int(600 + 1.25 * PATCH_ARRAYS * _ARRAY * campaign.grid(case.surface) ** 2)


def run_minutes(campaign: Campaign, case: RunLabels) -> int:
    """Minutes after which a run is taken for stuck: many times what such runs have taken."""
    if surface_threads(campaign, case.surface) > 1:
        return 240 if case.model == ASPERITIES else 1440
    asked = campaign.studies[case.study]
    minutes = 120 if asked.unload or asked.turning_points else 30
    return minutes if case.model == ASPERITIES else 8 * minutes


def solver_memory(campaign: Campaign, surface: str, entry: BesideStudy) -> int:
    """Megabytes for boundary elements: some thirty arrays of their grid, and the program."""
    return int(400 + 30 * _ARRAY * (campaign.grid(surface) * entry.refinement) ** 2)


def figure_memory(campaign: Campaign, *, holds_topography: bool) -> int:
    """Megabytes for a figure, which may hold the largest topography, and who is in contact where by both models."""
    largest = max(campaign.grid(surface) for study in campaign.studies.values() for surface in study.surfaces)
    return int(1000 + max(MAP_ARRAYS.values()) * _ARRAY * largest**2 * holds_topography)
