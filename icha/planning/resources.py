"""Memory, time and cores that jobs are given, generously: what they are expected to take is in `costs`."""

from icha.configuration.boundary_elements import BesideStudy
from icha.configuration.campaign import Campaign
from icha.planning.costs import job_threads

_ARRAY = 8e-6
"""Megabytes of a number."""


def surface_threads(campaign: Campaign, surface: str) -> int:
    """Cores for a surface and its sweeps: one, with sweeps side by side, but where transforms of large arrays pay."""
    return job_threads(campaign.grid(surface))


def surface_memory(campaign: Campaign, surface: str) -> int:
    """Megabytes for making a surface, or a sweep of it: some arrays of its size, and the program."""
    return int(600 + 4 * _ARRAY * campaign.grid(surface) ** 2)


def sweep_minutes(campaign: Campaign, study: str, surface: str) -> int:
    """Minutes after which a sweep is taken for stuck: many times what such sweeps have taken."""
    if surface_threads(campaign, surface) > 1:
        return 240
    asked = campaign.studies[study]
    return 120 if asked.unload or asked.turning_points else 30


def solver_memory(campaign: Campaign, surface: str, entry: BesideStudy) -> int:
    """Megabytes for boundary elements: some thirty arrays of their grid, and the program."""
    return int(400 + 30 * _ARRAY * (campaign.grid(surface) * entry.refinement) ** 2)


def figure_memory(campaign: Campaign, *, holds_topography: bool) -> int:
    """Megabytes for a figure, which may hold the largest topography."""
    largest = max(campaign.grid(surface) for study in campaign.studies.values() for surface in study.surfaces)
    return int(2000 + 2 * _ARRAY * largest**2 * holds_topography)
