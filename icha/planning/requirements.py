"""Requirements of jobs, which Snakemake reserves: cores and time limits. `icha.planning.batches` has the memory."""

from icha.configuration.campaign import Campaign
from icha.contact.models import MODELS
from icha.datasets.labels import RunLabels
from icha.planning.costs import RUN_SIZES, is_large


def surface_threads(campaign: Campaign, surface: str) -> int:
    """Return the number of cores for generating a surface: two for large grids, to save time, otherwise one."""
    return 2 if is_large(campaign.grid(surface)) else 1


def run_threads(campaign: Campaign, case: RunLabels) -> int:
    """Return the number of cores for a run; boundary elements use one core on every grid."""
    return 1 if MODELS[case.model].by_cells else surface_threads(campaign, case.surface)


def is_resumable(campaign: Campaign, case: RunLabels) -> bool:
    """Return whether a run takes so long that it saves checkpoints."""
    return MODELS[case.model].resumable and is_large(campaign.grid(case.surface))


def largest_grid(campaign: Campaign) -> int:
    """Return the largest number of nodes along a side of the surfaces in studies."""
    return max(campaign.grid(surface) for study in campaign.studies.values() for surface in study.surfaces)


def run_minutes(campaign: Campaign, case: RunLabels) -> int:
    """Return the time limit of a run in minutes; the limit is many times the longest measured time of a run."""
    loading, loop, large = RUN_SIZES[case.model].minutes
    if is_large(campaign.grid(case.surface)):
        return large
    study = campaign.studies[case.study]
    return loop if study.unload or study.turning_points else loading
