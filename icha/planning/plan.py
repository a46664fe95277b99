"""Plan of a campaign: files to compute, states of the files, and expected costs of the jobs."""

import json
import math
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

from icha.configuration.campaign import Campaign
from icha.configuration.cases import campaign_sha256, run_settings, run_sha256
from icha.configuration.plausibility import energy_ratio
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.datasets import results as results_files
from icha.datasets.attributes import why_failed
from icha.datasets.labels import RunLabels
from icha.datasets.results import ResultFiles, job_file
from icha.datasets.variables.campaign import STATUS_ATTRIBUTES
from icha.figures.registry import declaration_of
from icha.path.targets import QUANTITIES
from icha.planning import costs
from icha.planning.costs import WORKFLOW
from icha.planning.results import CampaignFiles, campaign_files
from icha.planning.validity import surface_facts
from icha.support.checksums import is_whole
from icha.support.input_files import text

DONE, TO_DO, CHANGED, FAILED, DAMAGED = "done", "to do", "changed", "failed", "damaged"
# Largest number of measured times from which the correction for one kind of job is computed.
_SAMPLE = 200
# Assumed reduced pressure of a target that is given as a mean separation.
_UNKNOWN_LOAD = 0.03


@dataclass(frozen=True)
class Item:
    """One file of a campaign: state, job and expected cost.

    Attributes
    ----------
    part : part of the campaign to which the file belongs, as in the output of `icha describe`.
    rule : Snakemake rule that computes the file.
    path : path in the folder of results.
    state : state of the file: DONE, TO_DO, CHANGED, FAILED or DAMAGED.
    cost : expected cost of the job.
    threads : number of cores that the job uses.
    reason : reason why the run failed; empty if the run did not fail.
    stage : number of the stage; jobs of a stage start after all jobs of earlier stages.
    """

    part: str
    rule: str
    path: str
    state: str
    cost: costs.Cost
    threads: int = 1
    reason: str = ""
    stage: int = 0

    @property
    def is_run(self) -> bool:
        """True if the file is a run of a study."""
        return self.rule == "run"

    @property
    def to_do(self) -> bool:
        """True if the file must be computed; False for a failed run, which would fail again."""
        return self.state in (TO_DO, CHANGED, DAMAGED)

    @property
    def work(self) -> float:
        """Expected work of the job in core-seconds: time multiplied by the number of cores."""
        return self.cost.seconds * self.threads


def plan(campaign: Campaign, results: Path) -> list[Item]:
    """List all files of a campaign, except files of negligible cost, in the order of their computation.

    A run is done if its file exists and has the present settings (`config_sha256`). Only Snakemake detects changes of
    the program. Any other file is done if the file and its inputs exist. A file is damaged if it differs from
    its checksum (`icha.support.checksums`). Measured times in the folder `results` correct the expected times for this
    machine.
    """
    items = _items(campaign, results)
    kinds: dict[tuple[str, str], list[Item]] = {}
    for item in items:
        kinds.setdefault((item.part, item.rule), []).append(item)
    factors = {kind: _correction(members, results) for kind, members in kinds.items()}
    seconds = (item.cost.seconds * factors[item.part, item.rule] for item in items)
    return [replace(item, cost=replace(item.cost, seconds=each)) for item, each in zip(items, seconds, strict=True)]


def _correction(items: list[Item], results: Path) -> float:
    """From the measured times of completed jobs of one kind, compute the factor that corrects expected times."""
    done = [item for item in items if item.state in (DONE, FAILED)]
    measured = [(item.cost.seconds, _benchmark(results, item)) for item in done[:: max(1, len(done) // _SAMPLE)]]
    return costs.correction([(expected, seconds) for expected, seconds in measured if seconds])


def _benchmark(results: Path, item: Item) -> float | None:
    """Return the measured time in s of the last job that computed a file; None if the time is unknown."""
    try:
        lines = (results / job_file(item.path, "benchmarks", ".jsonl")).read_text(encoding="utf-8").splitlines()
        return float(json.loads(lines[-1])["s"])
    except (OSError, ValueError, KeyError, IndexError, TypeError):
        return None


def _items(campaign, results) -> list[Item]:
    files, sha256_of_run = campaign_files(campaign), cache(partial(run_sha256, campaign))
    items = list(_computed_files(campaign, results, files, sha256_of_run))
    outdated = {item.path for item in items if item.to_do}
    for part, rule, path, stage, inputs, cost in _derived_files(campaign, files, items):
        state = _state(results, path)
        if state == DONE and not outdated.isdisjoint(inputs):
            state = TO_DO
        elif state == DONE and path == files.dataset:
            # Runs may have been removed from the campaign.
            state, _ = run_state(results / path, campaign_sha256(campaign, sha256_of_run))
        items.append(Item(part, rule, path, state, cost, stage=stage))
        if items[-1].to_do:
            outdated.add(path)
    return items


def _state(results, path):
    return TO_DO if not (results / path).is_file() else DONE if is_whole(results, path) else DAMAGED


def _computed_files(campaign, results, files, sha256_of_run) -> Iterator[Item]:
    """Yield the files of surfaces, runs, and theories."""
    run_cost = cache(costs.run_cost)

    @cache
    def summits(surface):
        # Few summits of an indenter come into contact.
        return 1 if campaign.surfaces[surface].shape else surface_facts(campaign, surface)["summits"]

    for path, (name, _) in files.surfaces.items():
        grid = campaign.grid(name)
        cost, threads = costs.surface_cost(grid), costs.job_threads(grid)
        yield Item("surfaces", "surface", path, _state(results, path), cost, threads)
    for path, case in files.runs.items():
        state, reason = run_state(results / path, sha256_of_run(case))
        if not is_whole(results, path):
            state, reason = DAMAGED, ""
        grid = campaign.grid(case.surface)
        sweep = _cost_parameters(run_settings(campaign, case), campaign.period(case.surface))
        # The contact of a shape stays small, however sticky its roughness is.
        spreads = sweep["adhesive"] and campaign.is_flat(case.surface)
        ratio = energy_ratio(campaign, case) if spreads else math.inf
        free = campaign.is_free(case.surface)
        cost = run_cost(case.model, grid, summits(case.surface), energy_ratio=ratio, free=free, **sweep)
        part = f"study {case.study}" + (f", {MODELS[case.model].words}" if case.model != DEFAULT_MODEL else "")
        yield Item(part, "run", path, state, cost, costs.job_threads(grid), reason)
    for path in files.theories:
        cost = costs.derived_cost("reference", 0, 35e3)
        yield Item("theories", "reference", path, _state(results, path), cost)


def _derived_files(campaign, files: CampaignFiles, computed: list[Item]) -> Iterator[tuple]:
    """For each file that is computed from runs, yield part of the campaign, rule, path, stage, inputs and cost."""
    runs, cost = len(files.runs), costs.derived_cost
    disk = sum(item.cost.disk for item in computed if item.is_run)
    values = sum(item.cost.values for item in computed)
    tables = [
        ("campaign_dataset", [files.dataset], 1, files.runs, runs, 0.5 * disk),
        ("table", [files.table], 2, [files.dataset], runs, 0.1 * disk),
        ("comparison", [files.comparison], 2, [files.dataset], runs, 0.03 * disk + 90e3),
        ("model_error", files.model_error, 2, [files.dataset, *files.compared], len(files.compared), 150e3),
        ("answers", files.answers, 2, [files.dataset], runs, 100e3),
        ("sensitivity", files.sensitivity, 2, [files.dataset], runs, 100e3),
        ("checks", [files.checks], 2, [files.dataset], runs, 5e3 * runs),
    ]
    for rule, paths, stage, inputs, count, disk_of_table in tables:
        for path in paths:
            yield "dataset and checks", rule, path, stage, inputs, cost(rule, count, disk_of_table, values)
    result_files = ResultFiles(campaign.name)
    for name, options in campaign.figures.by_name().items():
        path = result_files.path(results_files.FIGURE, name=name, ending="png")
        declaration = declaration_of(name)
        inputs = declaration.inputs(campaign, options, result_files).values()
        shown = set(options.studies_of(campaign))
        count = sum(case.study in shown for case in files.runs.values())
        grids = [campaign.grid(surface) for study in shown for surface in campaign.studies[study].surfaces]
        nodes = max(grids) ** 2 if declaration.holds_topography else 0
        models = max((len(campaign.studies[study].models) for study in shown), default=1)
        flat = [path for each in inputs for path in ([each] if isinstance(each, str) else each)]
        cost_of_figure = cost("figure", count, 400e3, values, nodes=nodes, models=models)
        yield "figures", "figure", path, 3, flat, cost_of_figure
    disk_of_report = 700e3 + 250e3 * len(files.figures) // 3
    cost_of_report = cost("report_page", runs, disk_of_report, values)
    yield "report", "report_page", files.report, 4, files.computed, cost_of_report


def _cost_parameters(settings, side) -> dict:
    """Convert the settings of a run to arguments of `run_cost`; `side` is the side of the surface, m."""
    path, snapshots = settings["path"], settings["path"]["snapshots"]
    modulus, slope = settings["material"]["contact_modulus"], settings["rms_slope"]
    # Reduced pressure of a target; about half of an area fraction, and `_UNKNOWN_LOAD` if the pressure is unknown.
    loads = {
        "reduced_pressure": lambda value: value,
        "relative_load": lambda value: value / (slope or 1.0),
        "pressure": lambda value: value / (modulus * (slope or 1.0)),
        "force": lambda value: value / (modulus * side**2 * (slope or 1.0)),
        "area_fraction": lambda value: value / 2,
        "contact_radius": lambda value: math.pi * value**2 / side**2 / 2,
    }
    stops = {(kind, value) for kind, each in QUANTITIES.items() for value in path.get(each.plural) or ()}
    stops |= {tuple(snapshot) for snapshot in snapshots or ()}
    return {
        # Targets in tension have few spots.
        "load": max(0.0, *(loads[kind](value) if kind in loads else _UNKNOWN_LOAD for kind, value in stops)),
        "stops": len(stops),
        "snapshots": 1 if snapshots is None else len(snapshots),
        "adhesive": settings["material"]["surface_energy"] > 0,
        "legs": len(path.get("turning_points", ())) + bool(path.get("unload")),
        "max_step": path["max_step"],
    }


def run_state(file: Path, sha256: str) -> tuple[str, str]:
    """Return the state of a run's file, and why the run failed or ended early; `sha256` is that of the settings."""
    import h5py

    if not file.is_file():
        return TO_DO, ""
    try:
        with h5py.File(file, "r") as data:
            names = ("config_sha256", *STATUS_ATTRIBUTES.values())
            attributes = {name: text(data.attrs[name]) for name in names if name in data.attrs}
    except OSError as error:
        if error.errno is not None:  # the file cannot be read, for example without permission
            raise
        return DAMAGED, ""  # not a valid netCDF-4 file
    if attributes.get("config_sha256") != sha256:
        return CHANGED, ""
    reason = why_failed(attributes)
    return (FAILED, reason) if reason else (DONE, attributes.get("beyond_model", ""))


def early_ends(campaign: Campaign, results: Path) -> tuple[dict[RunLabels, str], dict[RunLabels, str]]:
    """Return the reasons of runs that failed, and of runs that physics ended early, with the present settings."""
    failed, ended = {}, {}
    for path, case in campaign_files(campaign).runs.items():
        state, reason = run_state(results / path, run_sha256(campaign, case))
        if state == FAILED:
            failed[case] = reason
        elif state == DONE and reason:
            ended[case] = reason
    return failed, ended


def whole_cost(campaign: Campaign, results: Path) -> costs.Cost:
    """Return the expected cost of a whole campaign: time on one core, memory for one job at a time, disk space.

    Measured times are not used, so the cost is the same on every machine.
    """
    items = [replace(item, state=TO_DO) for item in _items(campaign, results)]
    return costs.Cost(time_on(items, 1), memory_on(items, 1), sum(item.cost.disk for item in items))


def time_on(items: Iterable[Item], cores: int) -> float:
    """Return the expected time in s from the call to the end, on `cores` cores; 0 if no file must be computed.

    The cores share the work of a stage equally. A stage takes at least the time of its longest job, and at least the
    time for scheduling all jobs one after the other.
    """
    items = list(items)
    seconds = start_up(items)
    for stage in {item.stage for item in items}:
        left = [item for item in items if item.stage == stage and item.to_do]
        scheduling = WORKFLOW.job * len(left)
        longest = max((item.cost.seconds for item in left), default=0.0)
        seconds += max((sum(item.work for item in left) + scheduling) / cores, longest, scheduling)
    return seconds


def start_up(items: Collection[Item]) -> float:
    """Return the time in s that `icha run` and Snakemake need before the first job: to start, and to plan the jobs."""
    if not any(item.to_do for item in items):
        return 0.0
    return WORKFLOW.start + WORKFLOW.planned * len(items)


def memory_on(items: Iterable[Item], cores: int, most: float = math.inf) -> float:
    """Return the largest memory in bytes that Snakemake and its parallel jobs use together.

    Parallel jobs together use at most `most` bytes, unless a single job needs more.
    """
    left = sorted((item for item in items if item.to_do), key=lambda item: -item.cost.memory)
    together, free = 0.0, cores
    for item in left:
        if item.threads <= free or free == cores:
            together, free = together + item.cost.memory, free - item.threads
    return WORKFLOW.memory + min(together, max(most, left[0].cost.memory)) if left else 0.0
