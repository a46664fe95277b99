"""What a campaign needs: memory, time and cores for its jobs, room on the disk, and software that only some need."""

import importlib.util
import math
import os
import shutil
from collections.abc import Collection, Mapping
from pathlib import Path

from icha.configuration.boundary_elements import BesideStudy
from icha.configuration.campaign import Campaign
from icha.datasets.labels import RunLabels
from icha.planning.costs import MAP_ARRAYS, RUN_SIZES, job_threads
from icha.planning.plan import Item, memory_on
from icha.support import formatting
from icha.support.formatting import format_count

TAMAAS = "tamaas"
# Sections of a campaign that ask for boundary elements at finite ranges.
BY_TAMAAS = ("finite_range", "boundary_element_loops")


def further_software(campaign: Campaign) -> tuple[str, ...]:
    """Packages that a campaign needs besides those that every campaign needs."""
    return (TAMAAS,) if _sections(campaign) else ()


def missing_software(campaign: Campaign) -> str | None:
    """What is not installed that a campaign needs, and how to install it; None if all is there."""
    if not further_software(campaign) or importlib.util.find_spec(TAMAAS):
        return None
    return (
        f"{', '.join(_sections(campaign))}: solved by Tamaas, which is not installed; `make tamaas` installs it in a "
        "clone, `pip install tamaas` elsewhere. It is an extra of the package, for its licence is AGPL-3.0-or-later."
    )


def _sections(campaign):
    return [name for name in BY_TAMAAS if getattr(campaign, name)]


def surface_threads(campaign: Campaign, surface: str) -> int:
    """Cores for a surface and its runs: one, with runs side by side, but where transforms of large arrays pay."""
    return job_threads(campaign.grid(surface))


def _megabytes(program: float, arrays: float, nodes: int) -> int:
    """Memory of a job that holds some arrays of `nodes` a side besides its program, MB."""
    return int(program + arrays * 8e-6 * nodes**2)


def surface_memory(campaign: Campaign, surface: str) -> int:
    """Megabytes for making a surface, or a run of asperities on it."""
    return _megabytes(600, 4, campaign.grid(surface))


def run_memory(campaign: Campaign, case: RunLabels) -> int:
    """Megabytes for a run."""
    arrays = max(4, 1.25 * RUN_SIZES[case.model].arrays)
    return _megabytes(600, arrays, campaign.grid(case.surface))


def solver_memory(campaign: Campaign, surface: str, entry: BesideStudy) -> int:
    """Megabytes for boundary elements at a finite range."""
    return _megabytes(400, 30, campaign.grid(surface) * entry.refinement)


def figure_memory(campaign: Campaign, *, holds_topography: bool) -> int:
    """Megabytes for a figure, which may hold the largest topography, and who is in contact where by both models."""
    largest = max(campaign.grid(surface) for study in campaign.studies.values() for surface in study.surfaces)
    return _megabytes(1000, max(MAP_ARRAYS.values()) * holds_topography, largest)


def run_minutes(campaign: Campaign, case: RunLabels) -> int:
    """Minutes after which a run is taken for stuck: many times what such runs have taken."""
    loading, cycle, several_cores = RUN_SIZES[case.model].minutes
    if surface_threads(campaign, case.surface) > 1:
        return several_cores
    asked = campaign.studies[case.study]
    return cycle if asked.unload or asked.turning_points else loading


def memory_of_machine() -> int:
    """Bytes of memory of this machine."""
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def free_disk(folder: Path) -> int:
    """Bytes that are free where a folder is, or will be."""
    there = next(path for path in (folder, *folder.resolve().parents) if path.exists())
    return shutil.disk_usage(there).free


def memory_wanting(items: Collection[Item], cores: int, there: float, most: float = math.inf) -> str | None:
    """That the jobs which run side by side need more memory than is there, and what would do; None if they do not.

    `most` is what they are let take together.
    """

    def memory(cores):
        return memory_on(items, cores, most)

    needed = memory(cores)
    if needed <= there:
        return None
    said = (
        f"about {formatting.size(needed)} of memory are needed on {format_count(cores, 'core')}, and this machine has "
        f"{formatting.size(there)}"
    )
    fewer = next((count for count in range(cores - 1, 0, -1) if memory(count) <= there), None)
    return f"{said}; --cores {fewer} needs {formatting.size(memory(fewer))}" if fewer else said


def disk_wanting(items: Collection[Item], results: Path, there: int) -> str | None:
    """That what is to be written needs more room than is free in the folder of results; None if it does not."""
    needed = sum(item.cost.disk for item in items if item.to_do)
    if needed <= there:
        return None
    return (
        f"about {formatting.size(needed)} of disk are needed for {results}, and {formatting.size(there)} are "
        f"free there; make room, or work in another folder: --directory FOLDER"
    )


def wanting(items: Collection[Item], cores: int, results: Path, profile: Mapping) -> list[str]:
    """What this machine lacks for what is to be done, in words.

    `profile` are the settings of a profile of Snakemake: how much memory jobs may take together, and whether they are
    computed here at all.
    """
    lacks = [disk_wanting(items, results, free_disk(results))]
    if profile.get("executor", "local") in ("local", "icha"):
        lacks.append(memory_wanting(items, cores, memory_of_machine(), _most_memory(profile)))
    return [lack for lack in lacks if lack]


def _most_memory(profile):
    """Bytes that a profile lets jobs take together."""
    limits = [str(each).partition("=") for each in profile.get("resources") or ()]
    return next((1e6 * float(value) for name, _, value in limits if name == "mem_mb"), math.inf)
