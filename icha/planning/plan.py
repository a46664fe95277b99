"""Plan of a campaign: files to compute, states of the files, and expected costs of the jobs."""

import itertools
import os
import shutil
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from icha.configuration.campaign import Campaign
from icha.configuration.cases import campaign_sha256
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.datasets.attributes import why_failed
from icha.datasets.stamp import OTHER_LICENCE, difference, read_stamp
from icha.datasets.variables.campaign import STATUS_ATTRIBUTES
from icha.planning import costs
from icha.planning.batches import largest_grid
from icha.planning.results import NEEDED, campaign_files, expected_stamps
from icha.planning.run_costs import corrected_costs, run_costs
from icha.support import formatting
from icha.support.formatting import format_count

DONE, TO_DO, OUTDATED, FAILED = "done", "to do", "outdated", "failed"
# Memory in bytes that Snakemake lets parallel jobs use together (profiles/default/config.yaml).
_MOST_MEMORY = 14e9
# Parts of a campaign, named as the targets of the workflow, and the parts that these targets need.
SURFACES, RUNS, THEORIES = "surfaces", "runs", "references"
ANALYSIS, FIGURES, REPORT = "dataset", "figures", "report"
_NEEDED = NEEDED | {
    ANALYSIS: [SURFACES, RUNS, ANALYSIS],
    FIGURES: [SURFACES, RUNS, THEORIES, ANALYSIS, FIGURES],
}


@dataclass(frozen=True)
class Item:
    """One file of a campaign: state and expected cost.

    Attributes
    ----------
    part : part of the campaign to which the file belongs, such as RUNS.
    group : name of the part in the output of `icha describe`; runs of each study and model are one group.
    path : path in the folder of results.
    state : state of the file: DONE, TO_DO, OUTDATED or FAILED.
    reason : why the file is outdated, why the run failed, or why physics ended it; otherwise empty.
    cost : expected cost of the file.
    """

    part: str
    group: str
    path: str
    state: str
    reason: str
    cost: costs.Cost

    @property
    def to_do(self) -> bool:
        """True if the file must be computed; False for a failed run, which would fail again."""
        return self.state in (TO_DO, OUTDATED)

    @property
    def may_be_written(self) -> bool:
        """True if a call may write the file; a file with the expected stamp is kept."""
        return self.to_do or self.part not in (SURFACES, RUNS, THEORIES)


def needed_for(targets: Iterable[str], items: Iterable[Item]) -> list[Item]:
    """Return the items that targets of the workflow need.

    Without targets, and for the targets `all`, `report` and `publish`, these are all items. For a file, it is the file.
    Options of Snakemake, which begin with a minus, end the targets.
    """
    names = list(itertools.takewhile(lambda target: not target.startswith("-"), targets)) or ["all"]

    def is_needed(item, name):
        return name.endswith(item.path) if "/" in name else item.part in _NEEDED.get(name, [item.part])

    return [item for item in items if any(is_needed(item, name) for name in names)]


def plan(campaign: Campaign, results: Path | None) -> list[Item]:
    """List all files of a campaign, except files of negligible cost, in the order of their computation.

    A surface, run or file of theories is done if it has the present stamp (`icha.datasets.stamp`). A file that is
    computed from runs is done if it exists and no surface or run must be computed. Measured times of finished runs
    correct the expected times. If `results` is None, nothing counts as done.
    """
    files, items = campaign_files(campaign), []
    if results is not None and results.is_dir():
        cost_of_run, state_of = corrected_costs(campaign, results), _states(campaign, results)
    else:  # without checksums and fingerprints, which take time
        cost_of_run, state_of = run_costs(campaign), lambda path: (TO_DO, "")

    def item(part, group, path, cost):
        return Item(part, group, path, *state_of(path), cost)

    for path, (name, _) in files.surfaces.items():
        items.append(item(SURFACES, "surfaces", path, costs.surface_cost(campaign.grid(name))))
    for path, case in files.runs.items():
        group = f"study {case.study}" + (f", {MODELS[case.model].words}" if case.model != DEFAULT_MODEL else "")
        items.append(item(RUNS, group, path, cost_of_run[case]))
    analysis = list(_analysis(campaign, results, items))
    items += [item(THEORIES, "theories", path, costs.analysis_cost(35e3, 0.0)) for path in files.theories]
    return items + analysis


def _states(campaign: Campaign, results: Path) -> Callable[[str], tuple[str, str]]:
    """Return a function that finds the state of a surface, run or file of theories, and the reason of the state."""
    stamps = expected_stamps(campaign)

    def state_of(path):
        try:
            found = read_stamp(results / path, STATUS_ATTRIBUTES.values())
        except FileNotFoundError:
            return TO_DO, ""
        if (reason := difference(found, stamps[path])) not in ("", OTHER_LICENCE):
            return OUTDATED, reason
        reason = why_failed(found)
        return (FAILED, reason) if reason else (DONE, found.get("beyond_model", ""))

    return state_of


def _analysis(campaign: Campaign, results: Path, computed: list[Item]) -> Iterator[Item]:
    """Yield the files that are computed from all surfaces and runs (`computed`); if one of those is to do, all are."""
    files = campaign_files(campaign)
    outdated = any(item.to_do for item in computed) or not _contains_runs(results / files.dataset, campaign)
    disk = sum(item.cost.disk for item in computed if item.part == RUNS)
    values = sum(item.cost.values for item in computed)

    def item(part, path, cost):
        state = DONE if not outdated and (results / path).is_file() else TO_DO
        group = "dataset and checks" if part == ANALYSIS else part
        return Item(part, group, path, state, "", cost)

    sizes = {files.dataset: 0.5 * disk, files.table: 0.1 * disk, files.comparison: 0.03 * disk + 90e3}
    others = (*files.model_error, *files.answers, *files.sensitivity, files.checks)
    sizes |= dict.fromkeys(others, 100e3)
    for path, size in sizes.items():
        yield item(ANALYSIS, path, costs.analysis_cost(size, values))
    pictures = (path for path in files.figures if path.endswith("png"))
    for path, request in zip(pictures, campaign.figures.by_name().values(), strict=True):
        nodes = largest_grid(campaign) ** 2 if request.holds_topography else 0
        yield item(FIGURES, path, costs.figure_cost(values, nodes))
    yield item(REPORT, files.report, costs.analysis_cost(700e3 + 80e3 * len(files.figures), values))


def _contains_runs(dataset: Path, campaign: Campaign) -> bool:
    """Return whether a campaign dataset exists and contains the runs of the campaign; some may have been removed."""
    return dataset.is_file() and (read_stamp(dataset) or {}).get("config_sha256") == campaign_sha256(campaign)


def whole_cost(campaign: Campaign) -> costs.Cost:
    """Return the expected cost of a whole campaign: time on one core, memory for one job at a time, disk space.

    Measured times are not used, so the cost is the same on every machine.
    """
    items = plan(campaign, None)
    return costs.Cost(time_on(items, 1), memory_on(items, 1), sum(item.cost.disk for item in items))


def time_on(items: Iterable[Item], cores: int) -> float:
    """Return the expected time in s from the call to the end, on `cores` cores; 0 if no file must be computed."""
    left = [item for item in items if item.to_do]
    if not left:
        return 0.0
    return costs.START + max(sum(item.cost.work for item in left) / cores, *(item.cost.seconds for item in left))


def memory_on(items: Iterable[Item], cores: int) -> float:
    """Return the largest memory in bytes that Snakemake and its parallel jobs use together."""
    left = sorted((item.cost.memory for item in items if item.to_do), reverse=True)
    return costs.WORKFLOW_MEMORY + min(sum(left[:cores]), max(_MOST_MEMORY, left[0])) if left else 0.0


def find_shortages(items: Iterable[Item], cores: int, results: Path, *, local: bool = True) -> list[str]:
    """Return messages if this machine has too little memory or free disk space for the remaining files.

    `local` is False if jobs run on other machines, whose memory is unknown.
    """
    items, shortages = list(items), []
    needed, free = sum(item.cost.disk for item in items if item.to_do), free_disk(results)
    if needed > free:
        shortages.append(
            f"{results} needs about {formatting.size(needed)} of disk space, but only {formatting.size(free)} are "
            "free; free some space, or use another folder: --directory FOLDER"
        )
    if local and (needed := memory_on(items, cores)) > (available := memory_of_machine()):
        shortages.append(
            f"jobs on {format_count(cores, 'core')} need about {formatting.size(needed)} of memory, but this machine "
            f"has {formatting.size(available)}; use a smaller grid, or fewer cores: --cores 1"
        )
    return shortages


def memory_of_machine() -> int:
    """Return the total memory of this machine, bytes."""
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def free_disk(folder: Path) -> int:
    """Return the free space on the disk of a folder, bytes; the folder need not exist."""
    existing = next(path for path in (folder, *folder.resolve().parents) if path.exists())
    return shutil.disk_usage(existing).free
