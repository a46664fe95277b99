"""Requirements of jobs, which Snakemake reserves: cores, memory and time limits."""

from icha.configuration.campaign import Campaign
from icha.contact.models import MODELS
from icha.datasets.labels import RunLabels
from icha.planning.costs import MAP_ARRAYS, RUN_SIZES, is_large


def surface_threads(campaign: Campaign, surface: str) -> int:
    """Return the number of cores for generating a surface: two for large grids, to save time, otherwise one."""
    return 2 if is_large(campaign.grid(surface)) else 1


def run_threads(campaign: Campaign, case: RunLabels) -> int:
    """Return the number of cores for a run; boundary elements use one core on every grid."""
    return 1 if MODELS[case.model].by_cells else surface_threads(campaign, case.surface)


def is_resumable(campaign: Campaign, case: RunLabels) -> bool:
    """Return whether a run takes so long that it saves checkpoints."""
    return MODELS[case.model].resumable and is_large(campaign.grid(case.surface))


def _megabytes(program: float, arrays: float, nodes: int) -> int:
    """Return the memory of a job in MB: `program`, plus `arrays` arrays that have nodes x nodes numbers each."""
    return int(program + arrays * 8e-6 * nodes**2)


def surface_memory(campaign: Campaign, surface: str) -> int:
    """Return the memory that Snakemake reserves for generating a surface, MB."""
    return _megabytes(600, 4, campaign.grid(surface))


def run_memory(campaign: Campaign, case: RunLabels) -> int:
    """Return the memory that Snakemake reserves for a run, MB."""
    arrays = max(4, 1.25 * RUN_SIZES[case.model].arrays)
    return _megabytes(600, arrays, campaign.grid(case.surface))


def figure_memory(campaign: Campaign, *, holds_topography: bool) -> int:
    """Return the memory that Snakemake reserves for a figure, MB; drawing a topography needs more memory."""
    return _megabytes(1000, MAP_ARRAYS * holds_topography, largest_grid(campaign))


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
