"""Cost model: expected time, memory and disk space of each job of a campaign.

The time of each kind of job is a power law. Powers and scales are a least-squares fit to the logarithms of measured
times, mostly on one core of an AMD EPYC. Of the times in `tests/planning/measured_times.csv`, 90 % differ from the
power law by less than a factor of two. `correction` adapts expected times to the present machine. It uses the measured
times of completed jobs of the campaign.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from icha.path.targets import DEFAULT_STEP
from icha.support.parallel import LARGE_GRID

MiB = 2**20
_DOUBLE = 8


@dataclass(frozen=True)
class Workflow:
    """Time (s) and memory (bytes) that a campaign needs in addition to the computations in its jobs.

    Attributes
    ----------
    start : time for starting `icha run`, Snakemake and the parent process of jobs, before the first job.
    planned : time for planning each file of the campaign, in addition to `start`.
    job : time of a job in addition to its computation: scheduling, fork, log, checksums.
    memory : memory of `icha run`, Snakemake and the parent process of jobs.
    forked : memory of a job that is a fork of the parent process, before its computation.
    program : memory of a job that is a separate process, before its computation.
    """

    start: float = 4.6
    planned: float = 0.0012
    job: float = 0.17
    memory: float = 310 * MiB
    forked: float = 22 * MiB
    program: float = 130 * MiB


WORKFLOW = Workflow()


@dataclass(frozen=True)
class PowerLaw:
    """Power law of the time of one kind of job: base + scale * product of quantity^power.

    Attributes
    ----------
    base : time for imports and files, s.
    scale : time of the computation if all quantities are 1, s.
    powers : power of each quantity, by name.
    """

    base: float
    scale: float
    powers: Mapping[str, float]

    def seconds(self, **quantities: float) -> float:
        """Return the expected time of a job in s from its quantities; quantities without a power have no effect."""
        return self.base + self.scale * math.prod(quantities[name] ** power for name, power in self.powers.items())


# Power laws by name. The law of a contact has the name of the solver, followed by `adhesion` and `cycle` if they apply.
# The law of another job has the name of the Snakemake rule. Quantities: `nodes`, `spots` (at the largest load), `stops`
# (targets of the path) and `runs` are counts; `load` is p/(E* h'rms); `step` is a step of the mean gap in h_rms.
LAWS = {
    "surface": PowerLaw(0.015, 2.4e-7, {"nodes": 1}),
    "asperities": PowerLaw(0.14, 1.6e-3, {"spots": 1.06}),
    "asperities, adhesion": PowerLaw(0.14, 1.6e-3, {"spots": 1.06}),
    "asperities, cycle": PowerLaw(0.14, 0.3, {"spots": 0.43}),
    "asperities, adhesion, cycle": PowerLaw(0.14, 0.9, {"spots": 0.9}),
    "boundary_elements": PowerLaw(0.14, 2.6e-7, {"nodes": 1.22, "stops": 0.49}),
    "boundary_elements, adhesion": PowerLaw(0.14, 1.5e-3, {"nodes": 0.35, "stops": 0.55, "spots": 0.71}),
    "boundary_elements, cycle": PowerLaw(0.25, 6e-6, {"nodes": 1.25}),
    "boundary_elements, adhesion, cycle": PowerLaw(0.6, 1.4e-4, {"nodes": 1}),
    "reference": PowerLaw(0.28, 0, {}),
    "campaign_dataset": PowerLaw(0.07, 0.015, {"runs": 1}),
    "table": PowerLaw(0.1, 0.008, {"runs": 1}),
    "comparison": PowerLaw(0.07, 0.003, {"runs": 1}),
    "model_error": PowerLaw(0.07, 0.05, {"runs": 1}),
    "answers": PowerLaw(0.1, 0.003, {"runs": 1}),
    "sensitivity": PowerLaw(0.1, 0.003, {"runs": 1}),
    "checks": PowerLaw(0.06, 0.006, {"runs": 1}),
    "figure": PowerLaw(1.3, 0.007, {"runs": 1}),
    "map": PowerLaw(0, 9.5e-8, {"nodes": 1}),
    "report_page": PowerLaw(0.25, 0.01, {"runs": 1}),
}


def _law(solver: str, *, adhesive: bool, cycle: bool = False) -> PowerLaw:
    """Return the power law of a solver with or without adhesion, for loading only or for a cycle."""
    return LAWS[", ".join([solver, *["adhesion"] * adhesive, *["cycle"] * cycle])]


@dataclass(frozen=True)
class Cost:
    """Expected cost of a job.

    Attributes
    ----------
    seconds : time in s on the number of cores that the job uses.
    memory : largest memory of the job, bytes.
    disk : size of the job's file, bytes.
    values : size in bytes of the values that a run adds to the campaign dataset; `disk` includes this size.
    """

    seconds: float
    memory: float
    disk: float
    values: float = 0.0


def job_threads(grid: int) -> int:
    """Return the number of cores for each job of a surface: two for large grids, to save time, else one."""
    return 2 if grid >= LARGE_GRID else 1


def _memory_before(grid):
    """Return the memory of a job before its computation, bytes. Only jobs on one core are forks of a parent process."""
    return WORKFLOW.program if job_threads(grid) > 1 else WORKFLOW.forked


def surface_cost(grid: int) -> Cost:
    """Return the expected cost of generating a topography with `grid` nodes along a side."""
    heights = _DOUBLE * grid**2
    seconds = LAWS["surface"].seconds(nodes=grid**2)
    return Cost(seconds, _memory_before(grid) + 2.7 * heights, 18e3 + heights)


def spots(summits: float, load: float) -> float:
    """Estimate the number of contact spots at a reduced pressure, within a factor of 2 for 10 to 2e5 summits."""
    return max(1.0, summits * min(0.6, math.sqrt(load)))


@dataclass(frozen=True)
class RunSize:
    """Memory, disk space and time limits of the runs with one contact model.

    Attributes
    ----------
    arrays : number of arrays of the size of the grid that are in memory at the same time.
    summit : memory for each summit, bytes.
    maps : bytes of the compressed maps in the file, for each grid cell and snapshot.
    sticky, sticky_cycle : if U_full/dgamma is below this value, the time of a run for loading only, or for a cycle, is
        proportional to dgamma/U_full.
    minutes : three time limits, min: for loading only, for a cycle, and for a run on several cores.
    free : nodes of the transforms of a free square, divided by those of its grid.
    """

    arrays: int
    summit: int = 0
    maps: float = 0.0
    sticky: float = 0.0
    sticky_cycle: float = 0.0
    minutes: tuple[int, int, int] = (30, 120, 240)
    free: int = 1


RUN_SIZES = {
    "asperities": RunSize(arrays=1, summit=9 * 1024),
    # Measured time, divided by the time at U_full/dgamma = 7: 1.5 at 1.8, 4.3 at 0.72, and up to 21 at 0.14. Time of
    # loops, divided by the time at 100: 2 at 15, 6 at 3.2.
    "boundary_elements": RunSize(arrays=45, maps=8.0, sticky=3.0, sticky_cycle=20.0, minutes=(240, 960, 1440), free=4),
}


def run_cost(
    model: str,
    grid: int,
    summits: float,
    *,
    load: float,
    stops: int,
    snapshots: int,
    adhesive: bool,
    legs: int = 0,
    max_step: float = DEFAULT_STEP,
    energy_ratio: float = math.inf,
    free: bool = False,
) -> Cost:
    """Return the expected cost of one run of `icha.simulate`.

    In a cycle with adhesion by boundary elements, a free square counts with the nodes of its transforms, which have
    twice the side. Then seven of ten measured loops of indenters are within a factor of two. Other runs on free squares
    take about as long as on periodic surfaces of the same grid.

    Parameters
    ----------
    model : contact model.
    grid : nodes along a side of the surface.
    summits : number of summits of the surface.
    load : largest reduced pressure p/(E* h'_rms) of the first loading.
    stops : number of targets of the first loading.
    snapshots : number of targets with a snapshot.
    adhesive : True if the surface energy is not zero.
    legs : number of unloadings and loadings after the first loading.
    max_step : longest step of the mean separation, in h_rms.
    energy_ratio : U_full/dgamma, elastic energy of full contact per area divided by the work of adhesion.
    free : True if the surface is a free square.
    """
    most, nodes = spots(summits, load), grid**2
    law = _law(model, adhesive=adhesive, cycle=bool(legs))
    size = RUN_SIZES[model]
    transformed = nodes * (size.free if free and adhesive and legs else 1)
    seconds = law.seconds(nodes=transformed, spots=most, stops=stops)
    seconds *= max(1.0, (size.sticky_cycle if legs else size.sticky) / energy_ratio)
    steps: float = stops
    if legs:
        # Each contact spot forms and detaches. With adhesion, each jump-in and each jump-off needs several steps.
        further = DEFAULT_STEP / max_step
        steps = (1 + legs) / 2 * (120 * further + (40 if adhesive else 0.75) * most)
        seconds *= (1 + legs) / 2 * further
    snapshots += bool(legs)
    memory = _memory_before(grid) + 9 * MiB * (1 + bool(legs))
    memory += size.arrays * _DOUBLE * nodes + size.summit * summits
    values = 20e3 + 57 * most * max(snapshots, 1) + 160 * steps + 20e3 * bool(legs)
    # Names and attributes in a file take 53 kB.
    return Cost(seconds, memory, 53e3 + values + size.maps * nodes * snapshots, values)


# Memory that a job needs for the values of runs: bytes for each byte in `values`, up to a limit in bytes. The limit
# exists because arrays above `icha.datasets.results.LEFT_IN_FILE` are not read as a whole.
_COPIES, _MOST_READ = 3.9, 1.9e9
# Largest memory for values of runs in the job that writes the campaign dataset block by block, bytes.
_BLOCKS = 35 * MiB
# Number of arrays of the size of the topography that a contact map needs, for one model and for two models.
MAP_ARRAYS = {1: 2, 2: 7}
# Memory for the libraries of a figure, and for the page of the report, by the rule of the job, bytes.
_LIBRARIES = {"figure": 85 * MiB, "report_page": 18 * MiB}


def derived_cost(rule: str, runs: int, disk: float, values: float = 0.0, *, nodes: int = 0, models: int = 1) -> Cost:
    """Return the expected cost of a file that is computed from a surface or from runs.

    Parameters
    ----------
    rule : name of the Snakemake rule of the file, and of the power law in `LAWS`.
    runs : number of runs that the file contains or shows.
    disk : size of the file, bytes.
    values : sum of the `values` of all runs of the campaign, bytes.
    nodes : number of nodes of the topography that a figure shows, or 0.
    models : number of contact models that a figure shows.
    """
    seconds = LAWS[rule].seconds(runs=runs) + LAWS["map"].seconds(nodes=nodes)
    read = min(_COPIES * values, _BLOCKS if rule == "campaign_dataset" else _MOST_READ)
    memory = _LIBRARIES.get(rule, 4 * MiB) + MAP_ARRAYS[models] * _DOUBLE * nodes + read
    return Cost(seconds, WORKFLOW.forked + memory, disk)


def correction(pairs: Sequence[tuple[float, float]]) -> float:
    """Return the factor that corrects expected times; `pairs` are expected and measured times of similar jobs, s.

    For n pairs, the factor is m^(n/(n + 1)), where m is the median of measured/expected time; without pairs it is 1.
    """
    if not pairs:
        return 1.0
    ratio = statistics.median(math.log(measured / expected) for expected, measured in pairs)
    return math.exp(ratio * len(pairs) / (len(pairs) + 1))
