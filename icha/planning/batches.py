"""Batches: short computations that one job of Snakemake does one after the other.

Starting a job takes longer than most computations. So the computations of a batch together take about
`icha.planning.costs.BATCH`, and one that takes longer is a batch of its own. The runs of a batch have the same study
and model. They are in the order of the seeds, and a batch depends only on the files before it. So a new seed at the end
of the list changes only the last batch. Measured times have no effect, because the batches of finished results must
stay the same.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import cache
from typing import NamedTuple, TypeVar

from icha.configuration.campaign import Campaign
from icha.datasets.labels import RunLabels
from icha.datasets.results import figure_number
from icha.planning import costs
from icha.planning.requirements import is_resumable, run_threads, surface_threads
from icha.planning.run_costs import run_costs

# The first batches of a group are shorter, so that several cores share a small group: their number, and their length as
# a part of `costs.BATCH`.
_SHORT_BATCHES, _SHORT = 4, 0.2
# Expected time of a figure, s.
_FIGURE = 1.6
# Snakemake reserves this multiple of the expected memory, and this memory in addition, MB.
_MARGIN, _UNEXPECTED = 1.25, 400
# Largest number of files in a batch. For each input, Snakemake searches the list of outputs of the batch.
_MOST_FILES = 180
T = TypeVar("T")


class Batch(NamedTuple):
    """Files, or names of figures, that one job computes.

    Attributes
    ----------
    name : name of the batch; names differ among the batches of one kind of file.
    files : paths of the files, or names of the figures.
    seconds : expected time of the computations, s.
    memory : memory that Snakemake reserves, MB.
    """

    name: str
    files: list[str]
    seconds: float
    memory: int


def surface_batches(campaign: Campaign, surfaces: Mapping[str, tuple[str, int]]) -> list[Batch]:
    """Return the batches of surfaces; `surfaces` has name and seed of each surface by path."""
    return _divide(
        (path, f"surfaces{_large(surface_threads(campaign, name))}", costs.surface_cost(campaign.grid(name)))
        for path, (name, _) in _by_seed(surfaces, lambda surface: surface)
    )


def theory_batches(theories: Mapping[str, str]) -> list[Batch]:
    """Return the batches of files of theories; `theories` has the name of the surface by path."""
    return _divide((path, "theories", costs.analysis_cost(0.0, 0.0)) for path in theories)


def run_batches(campaign: Campaign, runs: Mapping[str, RunLabels]) -> list[Batch]:
    """Return the batches of runs; `runs` has the labels of each run by path. A run that can resume is alone."""
    cost_of = run_costs(campaign)

    @cache
    def group_and_cost(contact):
        cost, group = cost_of[contact], f"{contact.study}_{contact.model}{_large(run_threads(campaign, contact))}"
        return group, replace(cost, seconds=max(cost.seconds, costs.BATCH)) if is_resumable(campaign, contact) else cost

    return _divide((path, *group_and_cost(case)) for path, case in _by_seed(runs, lambda case: (case.study, case.seed)))


def figure_batches(nodes: Mapping[str, int]) -> list[Batch]:
    """Return the batches of figures; `nodes` has the number of nodes of the topography that a figure holds, by name.

    An own figure is alone, because its script may fail.
    """
    return _divide(
        (
            name,
            "figures" if figure_number(name) else f"figure_{name}",
            replace(costs.figure_cost(0.0, n), seconds=_FIGURE),
        )
        for name, n in nodes.items()
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


def _large(threads: int) -> str:
    """Return the ending of the names of batches whose jobs use several cores."""
    return "_large" if threads > 1 else ""


def _divide(files: Iterable[tuple[str, str, costs.Cost]]) -> list[Batch]:
    """Divide files into batches; each file is given as path, group and expected cost."""
    groups: dict[str, list[Batch]] = {}
    for path, group, cost in files:
        batches, memory = groups.setdefault(group, []), int(_MARGIN * cost.memory / 1e6 + _UNEXPECTED)
        longest = costs.BATCH * (_SHORT if len(batches) <= _SHORT_BATCHES else 1)
        if not batches or batches[-1].seconds + cost.seconds > longest or len(batches[-1].files) == _MOST_FILES:
            batches.append(Batch(f"{group}_{len(batches)}", [], 0.0, 0))
        name, paths, seconds, most = batches[-1]
        batches[-1] = Batch(name, [*paths, path], seconds + cost.seconds, max(most, memory))
    return [batch for batches in groups.values() for batch in batches]
