"""Every file that a campaign computes: what is there, what is to be done, and what that is expected to cost."""

import json
import statistics
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from icha.configuration.campaign import Campaign
from icha.configuration.settings import run_settings, run_sha256
from icha.configuration.surfaces import SelfAffineSurface
from icha.contact.models import ASPERITIES
from icha.datasets.results import job_file
from icha.planning import costs
from icha.planning.resources import run_threads
from icha.planning.results import campaign_files
from icha.support.checksums import is_whole

DONE, TO_DO, CHANGED, FAILED, DAMAGED = "done", "to do", "changed", "failed", "damaged"
# So many of the files that are there are compared with what was expected of them.
_SAMPLE = 200


@dataclass(frozen=True)
class Item:
    """One file: the part of the campaign that it belongs to, its path in the results, its state and its cost.

    `threads` are the cores that its job takes.
    """

    part: str
    path: str
    state: str
    cost: costs.Cost
    threads: int = 1
    reason: str = ""

    @property
    def is_run(self) -> bool:
        """Whether it is a run of a study."""
        return self.path.startswith("runs/")

    @property
    def to_do(self) -> bool:
        """Whether it is still to be computed; a run that failed is not, it would fail again."""
        return self.state in (TO_DO, CHANGED, DAMAGED)


def plan(campaign: Campaign, results: Path) -> list[Item]:
    """All files of a campaign but those that are made of others at little cost, in the order of the configuration.

    A run counts as done if its file is there and was made with the present settings (`config_sha256`); whether the
    program has changed since is known to Snakemake only. Other files count as done if they are there. What is not what
    was written, by its record (`icha.support.checksums`), is damaged, and to be made again.

    Parameters
    ----------
    campaign : the campaign.
    results : its folder of results. Benchmarks in there of jobs that were done say how fast this machine is.
    """
    return list(_calibrated(_items(campaign, results), results))


def _items(campaign, results) -> Iterator[Item]:
    grid = campaign.grid

    @cache
    def asperities(surface):
        return _asperities(campaign, surface, results / "surfaces" / surface)

    def there(part, path, cost, threads=1):
        state = TO_DO if not (results / path).is_file() else DONE if is_whole(results, path) else DAMAGED
        return Item(part, path, state, cost, threads)

    def threads(surface):
        return costs.job_threads(grid(surface))

    def beside(part, entries, cases, cost, asked):
        for path, case in cases.items():
            entry = entries[case.entry]
            adhesive = campaign.materials[case.material].surface_energy > 0
            nodes = grid(case.surface) * entry.refinement
            yield there(f"{part} {case.entry}", path, cost(nodes, asked(entry, case), adhesive=adhesive))

    files = campaign_files(campaign)
    for path, (name, _) in files.surfaces.items():
        yield there("surfaces", path, costs.surface_cost(grid(name)), threads(name))
    sweep_cost, patch_cost = cache(costs.sweep_cost), cache(costs.patch_cost)
    for path, case in files.runs.items():
        state, reason = run_state(results / path, run_sha256(campaign, case))
        if not is_whole(results, path):
            state, reason = DAMAGED, ""
        settings = _described(run_settings(campaign, case), case.rms_slope)
        part, cores = f"study {case.study}", run_threads(campaign, case)
        if case.model == ASPERITIES:
            cost = sweep_cost(grid(case.surface), asperities(case.surface), settings)
        else:
            cost = patch_cost(grid(case.surface), asperities(case.surface), settings)
            part = f"{part}, boundary elements"
        yield Item(part, path, state, cost, cores, reason)
    yield from beside(
        "boundary elements",
        campaign.boundary_elements,
        files.solutions,
        costs.solution_cost,
        lambda entry, case: case.reduced_pressure,
    )
    yield from beside(
        "boundary elements both ways",
        campaign.boundary_element_loops,
        files.loops,
        costs.loop_cost,
        lambda entry, case: entry.separation_step,
    )
    yield from beside(
        "error sources",
        campaign.error_sources,
        files.error_sources,
        costs.sources_cost,
        lambda entry, case: tuple(entry.reduced_pressures),
    )
    for path, tabor_parameter in files.one_asperity.items():
        yield there("one asperity", path, costs.one_asperity_cost(tabor_parameter))
    for path in files.figures:
        if path.endswith(".png"):  # the same job makes the other
            yield there("figures", path, costs.FIGURE)


def _described(settings, rms_slope) -> costs.Sweep:
    """What of a run's settings its cost depends on."""
    path = settings["path"]
    stops = path.get("reduced_pressures") or path.get("area_fractions") or path.get("mean_separations")
    snapshots = path["snapshots"] if path["snapshots"] is not None else [()]
    return costs.Sweep(
        stops=len(stops),
        snapshots=len(snapshots),
        largest_load=_largest_load(path, snapshots, rms_slope),
        adhesive=settings["material"]["surface_energy"] > 0,
        legs=len(path.get("turning_points", ())) + bool(path.get("unload")),
        max_step=path["max_step"],
    )


def _largest_load(path, snapshots, rms_slope):
    """Largest reduced pressure of a path, roughly: half of the area fraction; unknown for separations."""
    loads = {
        "reduced_pressure": lambda value: value,
        "relative_load": lambda value: value / rms_slope,
        "area_fraction": lambda value: value / 2,
    }
    states = [(kind, value) for kind, value in (tuple(s) for s in snapshots if s) if kind in loads]
    for kind in ("reduced_pressure", "area_fraction"):
        states += [(kind, value) for value in path.get(f"{kind}s") or ()]
    return max((loads[kind](value) for kind, value in states), default=0.05)


def _asperities(campaign: Campaign, name: str, folder: Path) -> float:
    """Expected number of summits: from the spectrum, or else from the moments of a surface file that is there."""
    surface = campaign.surfaces[name]
    if isinstance(surface, SelfAffineSurface):
        return costs.self_affine_summits(
            surface.period, surface.rolloff_wavelength, surface.short_wavelength, surface.hurst
        )
    from icha.datasets.surface_file import read_spectral_moments

    for file in sorted(folder.glob("seed*.nc")):
        try:
            moments = read_spectral_moments(file)
        except ValueError:
            continue
        return costs.gaussian_summits(campaign.period(name), moments.m2, moments.m4)
    return costs.summits_of_grid(campaign.grid(name))


def run_state(file: Path, sha256: str) -> tuple[str, str]:
    """State of a run's file, and the reason why the run failed, if it did."""
    if not file.is_file():
        return TO_DO, ""
    try:
        attributes = read_attributes(file)
    except DamagedFile:
        return DAMAGED, ""
    if attributes.get("config_sha256") != sha256:
        return CHANGED, ""
    if reason := attributes.get("incomplete"):
        return FAILED, str(reason)
    return DONE, ""


class DamagedFile(Exception):
    """A file that is there but is no netCDF-4 file, or only a part of one."""


def read_attributes(file: Path) -> dict[str, str]:
    """What a file says of the settings and the end of a run, read without its variables.

    Raises
    ------
    DamagedFile
        If its content cannot be read.
    OSError
        If the system does not let it be read.
    """
    import h5py

    try:
        with h5py.File(file, "r") as data:
            return {name: _text(data.attrs[name]) for name in ("config_sha256", "incomplete") if name in data.attrs}
    except OSError as error:
        if error.errno is not None:  # no permission, for one: that says nothing of the content
            raise
        raise DamagedFile(file) from None


def _text(attribute) -> str:
    return attribute.decode() if isinstance(attribute, bytes) else str(attribute)


def failed_runs(campaign: Campaign, results: Path) -> dict[str, str]:
    """Paths of the runs that did not reach the end of their path with the present settings, with their reasons."""
    states = {
        case.path: run_state(results / path, run_sha256(campaign, case))
        for path, case in campaign_files(campaign).runs.items()
    }
    return {path: reason for path, (state, reason) in states.items() if state == FAILED}


def expected_seconds(campaign: Campaign, results: Path) -> dict[str, float]:
    """Expected seconds of the job of every file of `plan`, by its path from the folder in which results/ stands."""
    return {f"results/{results.name}/{item.path}": item.cost.seconds for item in plan(campaign, results)}


def whole_cost(campaign: Campaign, results: Path) -> costs.Cost:
    """What a whole campaign is expected to take: seconds on one core, memory of the largest job, disk.

    By the cost model alone, whatever the jobs of this machine have taken: the same wherever it is asked for.
    """
    each = [(item.cost, item.threads) for item in _items(campaign, results)]
    return costs.Cost(
        sum(cost.seconds * threads for cost, threads in each),
        max(cost.memory for cost, _ in each),
        sum(cost.disk for cost, _ in each),
    )


def _calibrated(items: Iterable[Item], results: Path) -> Iterator[Item]:
    """The items with times and memories scaled to what the jobs of their kind that are done have taken."""
    items = list(items)
    kinds: dict[str, list[Item]] = {}
    for item in items:
        kinds.setdefault(_kind(item), []).append(item)
    factors = {}
    for kind, members in kinds.items():
        done = [item for item in members if item.state in (DONE, FAILED)]
        done = done[:: max(1, len(done) // _SAMPLE)]
        measured = [(item, _benchmark(results, item)) for item in done]
        pairs = [(item.cost.seconds, seconds) for item, seconds in measured if seconds]
        factors[kind] = costs.correction(pairs)
    for item in items:
        yield replace(item, cost=item.cost.slower(factors[_kind(item)]))


def _kind(item):
    return item.part if item.part.startswith("study ") else item.path.rsplit("/", 1)[0].split("/")[0] + item.part


def _benchmark(results: Path, item: Item) -> float | None:
    """Seconds that the job of a file took when it last ran."""
    try:
        lines = (results / job_file(item.path, "benchmarks", ".jsonl")).read_text(encoding="utf-8").splitlines()
        return float(json.loads(lines[-1])["s"])
    except (OSError, ValueError, KeyError, IndexError, TypeError):
        return None


@dataclass(frozen=True)
class Total:
    """Several items together: how many there are and in which state, and what those to be done cost.

    `work` is in core-seconds, `longest` in s, `memory` that of the largest job and `disk` that of all files, in bytes.
    """

    count: int
    done: int
    failed: int
    to_do: int
    work: float
    longest: float
    memory: float
    disk: float
    typical: float


def total(items: Iterable[Item]) -> Total:
    """Take items together."""
    items = list(items)
    left = [item for item in items if item.to_do]
    return Total(
        len(items),
        sum(item.state == DONE for item in items),
        sum(item.state == FAILED for item in items),
        len(left),
        sum(item.cost.seconds * item.threads for item in left),
        max((item.cost.seconds for item in left), default=0.0),
        max((item.cost.memory for item in items), default=0.0),
        sum(item.cost.disk for item in items),
        statistics.median(item.cost.seconds for item in items) if items else 0.0,
    )


def time_on(items: Iterable[Item], cores: int) -> float:
    """Seconds that what is to be done takes on some cores: the work shared out, but never less than the longest job."""
    sums = total(items)
    return max(sums.work / cores, sums.longest)


def memory_on(items: Iterable[Item], cores: int) -> float:
    """Bytes that the largest jobs to be done take, as many as run side by side."""
    memory, free = 0.0, cores
    for item in sorted((item for item in items if item.to_do), key=lambda item: -item.cost.memory):
        if item.threads <= free or free == cores:
            memory, free = memory + item.cost.memory, free - item.threads
    return memory
