"""Expected time, memory and disk space of the jobs of a campaign.

The time of a run follows a power law. Powers and scales of the laws are least-squares fits to the logarithms of
measured times, mostly on one core of an AMD EPYC. Of the times in `tests/planning/measured_times.csv`, 90 % differ
from the law by less than a factor of two. The times of finished runs correct the times of other runs.
"""

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from icha.contact.models import MODELS
from icha.path.targets import DEFAULT_STEP
from icha.support.parallel import LARGE_GRID

MiB = 2**20
_DOUBLE = 8
# Time in s for planning, and for starting analysis and report; memory in bytes of `icha run` and Snakemake.
START, WORKFLOW_MEMORY = 8.0, 310 * MiB
# Time in s for starting a job, and memory in bytes of a job before its computation: Python and its libraries.
JOB, JOB_MEMORY = 1.5, 130 * MiB
# Time in s of the computation of another file, and of a figure.
_SHORT, _FIGURE = 0.3, 1.6
# Computing time in s for which a job gets a batch of short runs. A job takes `JOB` in addition.
BATCH = 25.0


@dataclass(frozen=True)
class PowerLaw:
    """Power law of the time of a run: scale * product of quantity^power.

    Attributes
    ----------
    scale : time if all quantities are 1, s.
    powers : power of each quantity. Quantities are `nodes` of the grid, `spots` at the largest load, `stops`, the
        number of targets, and `load`, the largest reduced pressure.
    """

    scale: float
    powers: Mapping[str, float]

    def seconds(self, **quantities: float) -> float:
        """Return the expected time of a run in s; quantities without a power have no effect."""
        return self.scale * math.prod(quantities[name] ** power for name, power in self.powers.items())


# Time of a run for reading and writing files, s, in addition to the time of the law.
FILES = 0.14
# Law of the loading path of a model, with adhesion if the name says so, and laws of loops without adhesion. A loop of
# boundary elements has a law of its own: fourteen loops on 64 to 256 nodes a side were within a factor of 2.1.
LAWS = {
    "asperities": PowerLaw(1.6e-3, {"spots": 1.06}),
    "asperities, loop": PowerLaw(0.3, {"spots": 0.5}),
    "boundary_elements, loop": PowerLaw(5.5e-4, {"nodes": 1.0}),
    "boundary_elements": PowerLaw(2.6e-7, {"nodes": 1.22, "stops": 0.49}),
    "boundary_elements, adhesion": PowerLaw(1.5e-3, {"nodes": 0.35, "stops": 0.55, "spots": 0.71}),
    # On fine grids with few spots. Of twenty runs, 17 were within a factor of two, and all within 2.5.
    "boundary_elements, few spots": PowerLaw(4.5e-5, {"nodes": 1.05, "load": 0.35}),
    # A loop with adhesion on a free square; eleven of fifteen measured loops were within a factor of 2.1.
    "boundary_elements, free loop": PowerLaw(4e-4, {"nodes": 1.05}),
}
# Time of a loop of asperities with adhesion, divided by the time without: each jump of a spot takes several steps.
_STICKY_LOOP = 5.0
# A loop with boundary elements and adhesion takes the time of this number of targets.
_STICKY_LOOP_STOPS = 100
# Time of a loop with few spots, divided by that of its loading; six loops were within a factor of two.
_LOOP_OF_FEW_SPOTS = 9.0


@dataclass(frozen=True)
class Cost:
    """Expected cost of a job.

    Attributes
    ----------
    seconds : time in s on the number of cores that the job uses, without the start of the job.
    memory : largest memory of the job, bytes.
    disk : size of the job's file, bytes.
    values : size in bytes of the values that a run adds to the campaign dataset; `disk` includes this size.
    threads : number of cores that the job uses.
    minutes : time limit of the job, min; many times the longest measured time.
    """

    seconds: float
    memory: float
    disk: float
    values: float = 0.0
    threads: int = 1
    minutes: int = 10

    @property
    def work(self) -> float:
        """Expected work in core-seconds, with the share of the file in the start of the job of its batch."""
        return (self.seconds + min(1.0, self.seconds / BATCH) * JOB) * self.threads


@dataclass(frozen=True)
class RunSize:
    """Memory, disk space and time limits of the runs with one contact model.

    Attributes
    ----------
    arrays : number of arrays of the size of the grid that are in memory at the same time.
    summit : memory for each summit, bytes.
    maps : bytes of the compressed maps in the file, for each grid cell and snapshot.
    sticky, sticky_loop : if U_full/dgamma is below this value, the time of a run for loading only, or for a loop, is
        proportional to dgamma/U_full.
    minutes : three time limits, min: for loading only, for a loop, and for a run on a large grid.
    """

    arrays: int
    summit: int = 0
    maps: float = 0.0
    sticky: float = 0.0
    sticky_loop: float = 0.0
    minutes: tuple[int, int, int] = (30, 120, 240)


RUN_SIZES = {
    "asperities": RunSize(arrays=1, summit=9 * 1024),
    # Measured time, divided by the time at U_full/dgamma = 7: 1.5 at 1.8, 4.3 at 0.72, and up to 21 at 0.14. Time of
    # loops, divided by the time at 100: 2 at 15, 6 at 3.2.
    "boundary_elements": RunSize(arrays=45, maps=8.0, sticky=3.0, sticky_loop=20.0, minutes=(240, 960, 1440)),
}


def is_large(grid: int) -> bool:
    """Return whether a grid is so large that jobs use two cores, and that a resumable run saves checkpoints."""
    return grid >= LARGE_GRID


def surface_cost(grid: int) -> Cost:
    """Return the expected cost of generating a topography with `grid` nodes along a side."""
    heights, threads = _DOUBLE * grid**2, 1 + is_large(grid)
    return Cost(0.015 + 2.4e-7 * grid**2, JOB_MEMORY + 2.7 * heights, 18e3 + heights, threads=threads, minutes=30)


def spots(summits: float, load: float) -> float:
    """Estimate the number of contact spots at a reduced pressure, within a factor of 2 for 10 to 2e5 summits."""
    return max(1.0, summits * min(0.6, math.sqrt(load)))


def run_seconds(
    model: str, *, adhesive: bool, loop: bool, nodes: float, spots: float, load: float, stops: int, free: bool = False
) -> float:
    """Return the expected time in s of a run for loading only, or of one loop; arguments are those of `run_cost`."""
    law, factor = LAWS.get(f"{model}, adhesion" if adhesive else model, LAWS[model]), 1.0
    if loop and adhesive and MODELS[model].by_cells:
        law, stops = LAWS[f"{model}, free loop"] if free else law, _STICKY_LOOP_STOPS
    elif loop:
        law, factor = LAWS[f"{model}, loop"], _STICKY_LOOP if adhesive else 1.0
    seconds = factor * law.seconds(nodes=nodes, spots=spots, stops=stops)
    if adhesive and MODELS[model].by_cells and not (loop and free):
        few_spots = LAWS[f"{model}, few spots"].seconds(nodes=nodes, load=load)
        seconds = max(seconds, few_spots * (_LOOP_OF_FEW_SPOTS if loop else 1.0))
    return FILES + seconds


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
    most, nodes, size = spots(summits, load), grid**2, RUN_SIZES[model]
    task = {"nodes": nodes, "spots": most, "load": load, "stops": stops, "free": free}
    seconds = run_seconds(model, adhesive=adhesive, loop=bool(legs), **task)
    seconds *= max(1.0, (size.sticky_loop if legs else size.sticky) / energy_ratio)
    steps: float = stops
    if legs:
        # Each contact spot forms and detaches. With adhesion, each jump-in and each jump-off needs several steps.
        further = DEFAULT_STEP / max_step
        steps = (1 + legs) / 2 * (120 * further + (40 if adhesive else 0.75) * most)
        seconds *= (1 + legs) / 2 * further
    snapshots += bool(legs)
    memory = JOB_MEMORY + 9 * MiB * (1 + bool(legs)) + size.arrays * _DOUBLE * nodes + size.summit * summits
    values = 20e3 + 57 * most * max(snapshots, 1) + 160 * steps + 20e3 * bool(legs)
    # Boundary elements use one core on every grid.
    threads = 1 if MODELS[model].by_cells else 1 + is_large(grid)
    minutes = size.minutes[2 if is_large(grid) else bool(legs)]
    # Names and attributes in a file take 53 kB.
    return Cost(seconds, memory, 53e3 + values + size.maps * nodes * snapshots, values, threads, minutes)


# Memory of a job that reads all runs, in bytes for each byte in `values`.
_COPIES = 3.9
# Number of arrays of the size of the topography that a contact map needs.
MAP_ARRAYS = 7
# Memory for the libraries of a figure, bytes.
_DRAWING = 85 * MiB


def analysis_cost(disk: float, values: float) -> Cost:
    """Return the expected cost of a file of size `disk` that is computed from runs with the `values`, bytes."""
    return Cost(_SHORT, JOB_MEMORY + _COPIES * values, disk)


def figure_cost(values: float, nodes: int) -> Cost:
    """Return the expected cost of a figure of runs with the `values`, bytes, and of a topography with `nodes` or 0."""
    return Cost(_FIGURE, JOB_MEMORY + _DRAWING + MAP_ARRAYS * _DOUBLE * nodes + _COPIES * values, 400e3)


def correction(pairs: Sequence[tuple[float, float]]) -> float:
    """Return the factor that corrects expected times; `pairs` are expected and measured times of similar jobs, s.

    For n pairs, the factor is m^(n/(n + 1)), where m is the median of measured/expected time.
    """
    ratio = statistics.median(math.log(measured / expected) for expected, measured in pairs)
    return math.exp(ratio * len(pairs) / (len(pairs) + 1))
