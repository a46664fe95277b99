"""Batches: short computations that one job of Snakemake does one after the other.

Starting a job takes longer than most computations. So the computations of a batch together take about
`icha.planning.costs.BATCH`, and one that takes longer is a batch of its own. The runs of a batch have the same study
and model. They are in the order of the seeds, and a batch depends only on the files before it. So a new seed at the end
of the list changes only the last batch. Measured times have no effect, because the batches of finished results must
stay the same.
"""

from collections.abc import Callable, Iterable, Mapping
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
    """

    name: str
    files: list[str]
    seconds: float


def surface_batches(campaign: Campaign, surfaces: Mapping[str, tuple[str, int]]) -> list[Batch]:
    """Return the batches of surfaces; `surfaces` has name and seed of each surface by path."""
    return _divide(
        (path, f"surfaces{_large(surface_threads(campaign, name))}", costs.surface_cost(campaign.grid(name)).seconds)
        for path, (name, _) in _by_seed(surfaces, lambda surface: surface)
    )


def theory_batches(theories: Mapping[str, str]) -> list[Batch]:
    """Return the batches of files of theories; `theories` has the name of the surface by path."""
    return _divide((path, "theories", costs.analysis_cost(0.0, 0.0).seconds) for path in theories)


def run_batches(campaign: Campaign, runs: Mapping[str, RunLabels]) -> list[Batch]:
    """Return the batches of runs; `runs` has the labels of each run by path. A run that can resume is alone."""
    cost_of = run_costs(campaign)

    @cache
    def group_and_seconds(contact):
        seconds = costs.BATCH if is_resumable(campaign, contact) else 0.0
        return f"{contact.study}_{contact.model}{_large(run_threads(campaign, contact))}", seconds

    return _divide(
        (path, group, max(cost_of[case].seconds, seconds))
        for path, case in _by_seed(runs, lambda case: (case.study, case.seed))
        for group, seconds in [group_and_seconds(case._replace(seed=0))]
    )


def figure_batches(names: Iterable[str]) -> list[Batch]:
    """Return the batches of figures, by name. An own figure is alone, because its script may fail."""
    return _divide((name, "figures" if figure_number(name) else f"figure_{name}", _FIGURE) for name in names)


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


def _divide(files: Iterable[tuple[str, str, float]]) -> list[Batch]:
    """Divide files into batches; each file is given as path, group and expected time, s."""
    groups: dict[str, list[tuple[str, float]]] = {}
    for path, group, seconds in files:
        groups.setdefault(group, []).append((path, seconds))
    batches = []
    for group, members in groups.items():
        of_group: list[Batch] = []
        for path, seconds in members:
            longest = costs.BATCH * (_SHORT if len(of_group) <= _SHORT_BATCHES else 1)
            if not of_group or of_group[-1].seconds + seconds > longest or len(of_group[-1].files) == _MOST_FILES:
                of_group.append(Batch(f"{group}_{len(of_group)}", [], 0.0))
            last = of_group[-1]
            of_group[-1] = last._replace(files=[*last.files, path], seconds=last.seconds + seconds)
        batches += of_group
    return batches
