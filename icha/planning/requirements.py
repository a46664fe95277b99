"""Requirements of a campaign: memory, time limits and cores of jobs, free disk space."""

import math
import os
import shutil
from collections.abc import Collection, Mapping
from pathlib import Path

from icha.configuration.campaign import Campaign
from icha.datasets.labels import RunLabels
from icha.planning.costs import MAP_ARRAYS, RUN_SIZES, job_threads
from icha.planning.plan import Item, memory_on
from icha.support import formatting
from icha.support.formatting import format_count


def surface_threads(campaign: Campaign, surface: str) -> int:
    """Return the number of cores for each job of a surface: two for large grids, otherwise one."""
    return job_threads(campaign.grid(surface))


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
    largest = max(campaign.grid(surface) for study in campaign.studies.values() for surface in study.surfaces)
    return _megabytes(1000, max(MAP_ARRAYS.values()) * holds_topography, largest)


def run_minutes(campaign: Campaign, case: RunLabels) -> int:
    """Return the time limit of a run in minutes; the limit is many times the longest measured time of a run."""
    loading, cycle, several_cores = RUN_SIZES[case.model].minutes
    if surface_threads(campaign, case.surface) > 1:
        return several_cores
    study = campaign.studies[case.study]
    return cycle if study.unload or study.turning_points else loading


def memory_of_machine() -> int:
    """Return the total memory of this machine, bytes."""
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def free_disk(folder: Path) -> int:
    """Return the free space on the disk of a folder, bytes; the folder need not exist."""
    existing = next(path for path in (folder, *folder.resolve().parents) if path.exists())
    return shutil.disk_usage(existing).free


def find_shortages(items: Collection[Item], cores: int, results: Path, profile: Mapping) -> list[str]:
    """Return messages if this machine has too little memory or free disk space for the remaining jobs.

    `profile` contains the settings of a Snakemake profile: the executor, and the memory limit of all parallel jobs.
    """
    shortages = []
    disk, free = sum(item.cost.disk for item in items if item.to_do), free_disk(results)
    if disk > free:
        shortages.append(
            f"{results} needs about {formatting.size(disk)} of disk space, but only {formatting.size(free)} are "
            "free; free some space, or use another folder: --directory FOLDER"
        )
    if profile.get("executor", "local") not in ("local", "icha"):
        return shortages
    limits = [str(each).partition("=") for each in profile.get("resources") or ()]
    most = next((1e6 * float(value) for name, _, value in limits if name == "mem_mb"), math.inf)
    available = memory_of_machine()
    if (needed := memory_on(items, cores, most)) > available:
        message = (
            f"jobs on {format_count(cores, 'core')} need about {formatting.size(needed)} of memory, but this "
            f"machine has {formatting.size(available)}"
        )
        fewer = [number for number in range(1, cores) if memory_on(items, number, most) <= available]
        if fewer:
            message += f"; --cores {fewer[-1]} needs {formatting.size(memory_on(items, fewer[-1], most))}"
        shortages.append(message)
    return shortages
