"""Batches: short computations that one job of Snakemake does one after the other.

Starting a job takes longer than most runs. So the runs of a batch together take `BATCH_SECONDS`, and a run that takes
longer is a batch of its own. The runs of a batch have the same study and model. They are in the order of the seeds, so
that a new seed at the end of the list changes only the last batch. Measured times have no effect, because batches of
finished results must stay the same.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple, TypeVar

from icha.configuration.campaign import Campaign
from icha.configuration.surfaces import SelfAffineSurface
from icha.contact.models import MODELS
from icha.datasets.labels import RunLabels
from icha.planning import costs
from icha.planning.requirements import surface_threads
from icha.planning.run_costs import expected_cost
from icha.planning.validity import surface_facts

# Expected time of the computations of a batch on one core, s.
BATCH_SECONDS = 25.0
# Assumed number of nodes for each summit of a surface from a file, because this estimate reads no files.
_NODES_PER_SUMMIT = 20
T = TypeVar("T")


class Batch(NamedTuple):
    """Files that one job computes.

    Attributes
    ----------
    name : name of the batch; names differ among the batches of one kind of file.
    files : paths of the files.
    seconds : expected time of the computations, s.
    """

    name: str
    files: list[str]
    seconds: float


def surface_batches(campaign: Campaign, surfaces: Mapping[str, tuple[str, int]]) -> list[Batch]:
    """Return the batches of surfaces; `surfaces` has name and seed of each surface by path."""
    return _divide(
        (path, f"surfaces{_large(campaign, name)}", costs.surface_cost(campaign.grid(name)).seconds)
        for path, (name, _) in _by_seed(surfaces, lambda surface: surface)
    )


def theory_batches(theories: Mapping[str, str]) -> list[Batch]:
    """Return the batches of files of theories; `theories` has the name of the surface by path."""
    return _divide((path, "theories", costs.LAWS["reference"].seconds()) for path in theories)


def run_batches(campaign: Campaign, runs: Mapping[str, RunLabels]) -> list[Batch]:
    """Return the batches of runs; `runs` has the labels of each run by path. A run that can resume is alone."""
    # Runs that differ only in the seed have the same expected time.
    contacts = dict.fromkeys(case._replace(seed=0) for case in runs.values())
    seconds = {contact: run_seconds(campaign, contact) for contact in contacts}
    return _divide(
        (
            path,
            f"{case.study}_{case.model}{_large(campaign, case.surface)}",
            max(seconds[case._replace(seed=0)], BATCH_SECONDS * is_resumable(campaign, case)),
        )
        for path, case in _by_seed(runs, lambda case: (case.study, case.seed))
    )


def _by_seed(files: Mapping[str, T], labels: Callable[[T], tuple[str, int]]) -> list[tuple[str, T]]:
    """Sort files by the position of their seed among the seeds of the same name; `labels` gives name and seed."""
    positions: dict[str, dict[int, int]] = {}
    for name, seed in map(labels, files.values()):
        of_name = positions.setdefault(name, {})
        of_name.setdefault(seed, len(of_name))

    def position(item: tuple[str, T]) -> int:
        name, seed = labels(item[1])
        return positions[name][seed]

    return sorted(files.items(), key=position)


def _large(campaign: Campaign, surface: str) -> str:
    """Return the ending of the names of batches on large grids, whose jobs use several cores."""
    return "_large" if surface_threads(campaign, surface) > 1 else ""


def is_resumable(campaign: Campaign, case: RunLabels) -> bool:
    """Return whether a run saves checkpoints, because with its model and grid it may take hours."""
    return MODELS[case.model].resumable and surface_threads(campaign, case.surface) > 1


def run_seconds(campaign: Campaign, case: RunLabels) -> float:
    """Return the expected time of a run from the cost law alone, s."""
    section = campaign.surfaces[case.surface]
    if section.shape:
        summits = 1.0  # few summits of an indenter come into contact
    elif isinstance(section, SelfAffineSurface):
        summits = surface_facts(campaign, case.surface)["summits"]
    else:
        summits = campaign.grid(case.surface) ** 2 / _NODES_PER_SUMMIT
    return expected_cost(campaign, case, summits).seconds


def _divide(files: Iterable[tuple[str, str, float]]) -> list[Batch]:
    """Divide files into batches; each file is given as path, group and expected time, s."""
    batches: dict[str, list[Batch]] = {}
    for path, group, seconds in files:
        of_group = batches.setdefault(group, [])
        if of_group and of_group[-1].seconds + seconds <= BATCH_SECONDS:
            last = of_group[-1]
            last.files.append(path)
            of_group[-1] = last._replace(seconds=last.seconds + seconds)
        else:
            of_group.append(Batch(f"{group}_{len(of_group)}", [path], seconds))
    return [batch for of_group in batches.values() for batch in of_group]
