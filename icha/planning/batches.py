"""Batches: short computations that one job of Snakemake does one after the other.

Starting a job takes longer than most computations. So the computations of a batch together take about
`icha.planning.costs.BATCH`, and one that takes longer is a batch of its own. The runs of a batch have the same study
and model. They are in the order of the seeds, and a batch depends only on the files before it. So a new seed at the end
of the list changes only the last batch. Measured times have no effect, because the batches of finished results must
stay the same.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple, TypeVar

from icha.configuration.campaign import Campaign
from icha.contact.models import MODELS
from icha.datasets.labels import RunLabels
from icha.datasets.results import figure_number
from icha.planning import costs
from icha.planning.run_costs import run_costs

# The first batches of a group are shorter, so that several cores share a small group: their number, and their length as
# a part of `costs.BATCH`.
_SHORT_BATCHES, _SHORT = 4, 0.2
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
    memory, threads, minutes : memory (MB), cores and time limit (min) that Snakemake reserves.
    """

    name: str
    files: list[str]
    seconds: float = 0.0
    memory: int = 0
    threads: int = 1
    minutes: int = 0


def surface_batches(campaign: Campaign, surfaces: Mapping[str, tuple[str, int]]) -> list[Batch]:
    """Return the batches of surfaces; `surfaces` has name and seed of each surface by path."""
    ordered = _by_seed(surfaces, lambda surface: surface)
    return _divide((path, "surfaces", costs.surface_cost(campaign.grid(name))) for path, (name, _) in ordered)


def theory_batches(theories: Mapping[str, str]) -> list[Batch]:
    """Return the batches of files of theories; `theories` has the name of the surface by path."""
    return _divide((path, "theories", costs.analysis_cost(0.0, 0.0)) for path in theories)


def run_batches(campaign: Campaign, runs: Mapping[str, RunLabels]) -> list[Batch]:
    """Return the batches of runs; `runs` has the labels of each run by path. A run that can resume is alone."""
    cost_of = run_costs(campaign)

    def cost(case):
        alone = is_resumable(campaign, case)
        return replace(cost_of[case], seconds=max(cost_of[case].seconds, costs.BATCH)) if alone else cost_of[case]

    ordered = _by_seed(runs, lambda case: (case.study, case.seed))
    return _divide((path, f"{case.study}_{case.model}", cost(case)) for path, case in ordered)


def figure_batches(nodes: Mapping[str, int]) -> list[Batch]:
    """Return the batches of figures; `nodes` has the number of nodes of the topography that a figure holds, by name.

    An own figure is alone, because its script may fail.
    """
    cost_of = {name: costs.figure_cost(0.0, count) for name, count in nodes.items()}
    return _divide((name, "figures" if figure_number(name) else f"figure_{name}", cost_of[name]) for name in nodes)


def is_resumable(campaign: Campaign, case: RunLabels) -> bool:
    """Return whether a run takes so long that it saves checkpoints."""
    return MODELS[case.model].resumable and costs.is_large(campaign.grid(case.surface))


def largest_grid(campaign: Campaign) -> int:
    """Return the largest number of nodes along a side of the surfaces in studies."""
    return max(map(campaign.grid, campaign.used_surfaces))


def _by_seed(files: Mapping[str, T], labels: Callable[[T], tuple[str, int]]) -> list[tuple[str, T]]:
    """Sort files by the position of their seed among the seeds of the same name; `labels` gives name and seed."""
    seeds: dict[str, dict[int, int]] = {}
    positions = {}
    for path, (name, seed) in zip(files, map(labels, files.values()), strict=True):
        of_name = seeds.setdefault(name, {})
        positions[path] = of_name.setdefault(seed, len(of_name))
    return sorted(files.items(), key=lambda item: positions[item[0]])


def _divide(files: Iterable[tuple[str, str, costs.Cost]]) -> list[Batch]:
    """Divide files into batches of jobs with the same cores; each file is given as path, group and expected cost."""
    groups: dict[str, list[Batch]] = {}
    for path, group, cost in files:
        group += "_large" if cost.threads > 1 else ""
        batches, memory = groups.setdefault(group, []), int(_MARGIN * cost.memory / 1e6 + _UNEXPECTED)
        longest = costs.BATCH * (_SHORT if len(batches) <= _SHORT_BATCHES else 1)
        if not batches or batches[-1].seconds + cost.seconds > longest or len(batches[-1].files) == _MOST_FILES:
            batches.append(Batch(f"{group}_{len(batches)}", []))
        name, paths, seconds, most, _, minutes = batches[-1]
        needs = max(most, memory), cost.threads, max(minutes, cost.minutes)
        batches[-1] = Batch(name, [*paths, path], seconds + cost.seconds, *needs)
    return [batch for batches in groups.values() for batch in batches]
