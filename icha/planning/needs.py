"""What a campaign needs against what the machine has, before it is begun."""

import math
import os
import shutil
from collections.abc import Collection, Mapping
from pathlib import Path

from icha.planning.plan import Item, memory_on
from icha.support import in_words
from icha.support.in_words import counted


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
        f"about {in_words.size(needed)} of memory are needed on {counted(cores, 'core')}, and this machine has "
        f"{in_words.size(there)}"
    )
    fewer = next((count for count in range(cores - 1, 0, -1) if memory(count) <= there), None)
    return f"{said}; --cores {fewer} needs {in_words.size(memory(fewer))}" if fewer else said


def disk_wanting(items: Collection[Item], results: Path, there: int) -> str | None:
    """That what is to be written needs more room than is free in the folder of results; None if it does not."""
    needed = sum(item.cost.disk for item in items if item.to_do)
    if needed <= there:
        return None
    return (
        f"about {in_words.size(needed)} of disk are needed for {results}, and {in_words.size(there)} are free there; "
        f"make room, or work in another folder: --directory FOLDER"
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
