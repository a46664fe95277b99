"""Requirements of a campaign: memory, time and cores of its jobs, free disk space, and optional software."""

import importlib.util
import math
import os
import shutil
from collections.abc import Collection, Mapping
from pathlib import Path

from icha.configuration.campaign import Campaign
from icha.configuration.studies import BesideStudy
from icha.datasets.labels import RunLabels
from icha.planning.costs import MAP_ARRAYS, RUN_SIZES, job_threads
from icha.planning.plan import Item, memory_on
from icha.support import formatting
from icha.support.formatting import format_count

TAMAAS = "tamaas"
# Sections of a campaign that Tamaas solves.
BY_TAMAAS = ("finite_range", "boundary_element_loops")


def further_software(campaign: Campaign) -> tuple[str, ...]:
    """Return optional packages that a campaign needs."""
    return (TAMAAS,) if _sections(campaign) else ()


def missing_software(campaign: Campaign) -> str | None:
    """Describe the optional package that a campaign needs and that is not installed; None if it is installed."""
    if not further_software(campaign) or importlib.util.find_spec(TAMAAS):
        return None
    return (
        f"{', '.join(_sections(campaign))}: solved by Tamaas, which is not installed; `make tamaas` installs it in a "
        "clone, `pip install tamaas` elsewhere. It is an extra of the package because its licence is AGPL-3.0-or-later."
    )


def _sections(campaign):
    return [name for name in BY_TAMAAS if getattr(campaign, name)]


def surface_threads(campaign: Campaign, surface: str) -> int:
    """Return the number of cores for a surface and for each of its runs: two on large grids, otherwise one."""
    return job_threads(campaign.grid(surface))


def _megabytes(program: float, arrays: float, nodes: int) -> int:
    """Return the memory of a job, MB: that of its program plus a number of arrays of nodes x nodes values."""
    return int(program + arrays * 8e-6 * nodes**2)


def surface_memory(campaign: Campaign, surface: str) -> int:
    """Return the memory for making a surface, MB."""
    return _megabytes(600, 4, campaign.grid(surface))


def run_memory(campaign: Campaign, case: RunLabels) -> int:
    """Return the memory for a run, MB."""
    arrays = max(4, 1.25 * RUN_SIZES[case.model].arrays)
    return _megabytes(600, arrays, campaign.grid(case.surface))


def solver_memory(campaign: Campaign, surface: str, entry: BesideStudy) -> int:
    """Return the memory for boundary elements at a finite range, MB."""
    return _megabytes(400, 30, campaign.grid(surface) * entry.refinement)


def figure_memory(campaign: Campaign, *, holds_topography: bool) -> int:
    """Return the memory for a figure, MB. The figure may show the largest topography and the maps of both models."""
    largest = max(campaign.grid(surface) for study in campaign.studies.values() for surface in study.surfaces)
    return _megabytes(1000, max(MAP_ARRAYS.values()) * holds_topography, largest)


def run_minutes(campaign: Campaign, case: RunLabels) -> int:
    """Return the time limit of a run, minutes: many times the longest measured time of such runs."""
    loading, cycle, several_cores = RUN_SIZES[case.model].minutes
    if surface_threads(campaign, case.surface) > 1:
        return several_cores
    study = campaign.studies[case.study]
    return cycle if study.unload or study.turning_points else loading


def memory_of_machine() -> int:
    """Return the memory of this machine, bytes."""
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def free_disk(folder: Path) -> int:
    """Return the free disk space where a folder is or will be, bytes."""
    existing = next(path for path in (folder, *folder.resolve().parents) if path.exists())
    return shutil.disk_usage(existing).free


def find_shortages(items: Collection[Item], cores: int, results: Path, profile: Mapping) -> list[str]:
    """Describe the memory or disk space that this machine lacks for the remaining jobs.

    `profile` contains the settings of a Snakemake profile: the executor, and the largest memory of all parallel jobs.
    """
    shortages = []
    disk, free = sum(item.cost.disk for item in items if item.to_do), free_disk(results)
    if disk > free:
        shortages.append(
            f"about {formatting.size(disk)} of disk are needed for {results}, and {formatting.size(free)} are free "
            "there; free some space, or work in another folder: --directory FOLDER"
        )
    if profile.get("executor", "local") not in ("local", "icha"):
        return shortages
    limits = [str(each).partition("=") for each in profile.get("resources") or ()]
    most = next((1e6 * float(value) for name, _, value in limits if name == "mem_mb"), math.inf)
    available = memory_of_machine()
    if (needed := memory_on(items, cores, most)) > available:
        message = (
            f"about {formatting.size(needed)} of memory are needed on {format_count(cores, 'core')}, and this machine "
            f"has {formatting.size(available)}"
        )
        fewer = [number for number in range(1, cores) if memory_on(items, number, most) <= available]
        if fewer:
            message += f"; --cores {fewer[-1]} needs {formatting.size(memory_on(items, fewer[-1], most))}"
        shortages.append(message)
    return shortages
