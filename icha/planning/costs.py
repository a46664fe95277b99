"""What computing costs: seconds on one core, memory and disk of whatever a campaign makes, beforehand.

The formulas say how costs grow: with the nodes of a grid, with summits and spots, with loads and jumps. Their
constants, `icha.planning.constants`, were fitted to processor times of some dozens of small cases;
`benchmarks/costs.py` prints expected over measured for others. Expect a factor of two either way, more where nothing
can be known beforehand of how a path will go; `correction` brings in what a campaign's own jobs took.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from icha.datasets.results import COMPRESSED_SIZES, LEFT_IN_FILE
from icha.path.limits import DEFAULT_STEP
from icha.planning.constants import FITTED, Constants, MiB
from icha.support.parallel import LARGE_GRID
from icha.surfaces.moments import summit_density

_DOUBLE = 8


class Recorded(NamedTuple):
    """Numbers of steps and snapshots of a run, and of spots in all of its snapshots."""

    steps: float
    snapshots: int
    spots: float


@dataclass(frozen=True)
class Cost:
    """Cost of a job.

    seconds : on one core.
    memory : largest memory that is the job's own; bytes.
    disk : bytes.
    recorded : what a run adds to the campaign dataset.
    """

    seconds: float
    memory: float
    disk: float
    recorded: Recorded | None = None

    def slower(self, factor: float) -> Cost:
        """The same on a machine that takes `factor` times as long."""
        return replace(self, seconds=self.seconds * factor)


@dataclass(frozen=True)
class Roughness:
    """What of a surface the cost of a run depends on.

    Parameters
    ----------
    grid : nodes a side.
    summits : number of summits.
    hills : number of hills that carry them: area over the square of the ratio of rms height and slope of a profile.
    sharpness : h_rms^(3/2) kappa_rms^(1/2) at rms slope 1, m, with the rms curvature kappa of a profile: what the
        adhesion of a spot is held against.
    """

    grid: int
    summits: float
    hills: float
    sharpness: float


@dataclass(frozen=True)
class Sweep:
    """What of a path and a material the cost of a run depends on.

    Parameters
    ----------
    loads : reduced pressures p/(E* h'_rms) of the stops of the first loading.
    snapshots : number of stops that keep their fields.
    adhesion : surface energy over E* and the sharpness of the surface at its slope: 0 without adhesion.
    legs : legs after the first loading: 0, or 1 and more for ways back and in again.
    max_step : longest step of the mean separation, in h_rms.
    """

    loads: tuple[float, ...]
    snapshots: int
    adhesion: float
    legs: int = 0
    max_step: float = DEFAULT_STEP


def roughness_of(grid: int, period: float, m0: float, m2: float, m4: float, summits: float | None = None) -> Roughness:
    """Of a surface with variances m0 (m^2), m2, m4 (m^-2) of a profile's heights, slopes and curvatures.

    Its summits, unless they were counted, are those expected of an isotropic Gaussian surface.
    """
    expected = period**2 * summit_density(m2, m4) if summits is None else summits
    # At rms slope 1 of the surface m2 is 1/2.
    sharpness = m0**0.75 * m4**0.25 / (2 * m2)
    return Roughness(grid, expected, period**2 * m2 / m0, sharpness)


def self_affine_moments(
    period: float, rolloff_wavelength: float, short_wavelength: float, hurst: float
) -> tuple[float, float, float]:
    """m0, m2, m4 of a self-affine surface with roll-off, but for a common factor; lengths in m.

    Of the spectrum's moments as integrals over the plane of wave vectors, m0 = int C, m2 = 1/2 int q^2 C,
    m4 = 3/8 int q^4 C.
    """
    q_l, q_0, q_1 = (2 * math.pi / length for length in (period, rolloff_wavelength, short_wavelength))

    def moment(order):
        # int q^(order + 1) C dq: flat up to the roll-off, falling as q^(-2 (1 + H)) from there on.
        power = order - 2 * hurst
        falling = math.log(q_1 / q_0) if power == 0 else math.expm1(power * math.log(q_1 / q_0)) / power
        return (q_0 ** (order + 2) - q_l ** (order + 2)) / (order + 2) + q_0 ** (order + 2) * falling

    return moment(0), moment(2) / 2, 3 / 8 * moment(4)


def job_threads(grid: int) -> int:
    """Cores that a job of a surface takes, and is given: two where they pay, else one."""
    return 2 if grid >= LARGE_GRID else 1


def surface_cost(grid: int, of: Constants = FITTED) -> Cost:
    """Making a topography of `grid` nodes a side, and writing it."""
    heights = _DOUBLE * grid**2
    # Compression makes heights smaller by about a sixth.
    compression = 0.84 if grid**2 in COMPRESSED_SIZES else 1.0
    start, memory = _before(grid, of)
    seconds = start + _shared_out(of.making.file + of.making.node * grid**2, grid, of)
    return Cost(seconds, memory + 2.7 * heights, 18e3 + compression * heights)


def _shared_out(seconds, grid, of):
    """How long the job of a surface takes with its cores for so many seconds of work."""
    return seconds * of.workflow.two_cores if job_threads(grid) > 1 else seconds


def _before(grid, of):
    """Seconds and memory that the job of a surface takes before it begins: only those of one core are forks."""
    here = of.workflow
    return (here.own_process, here.program) if job_threads(grid) > 1 else (0.0, here.forked)


def sweep_cost(rough: Roughness, sweep: Sweep, of: Constants = FITTED) -> Cost:
    """A run of `icha.simulate` by asperities."""
    here, nodes = of.loading, rough.grid**2
    met = [spots(rough, load) for load in sweep.loads]
    most = max(met)
    at_stops = sum(here.spot * each * _crowded(each, here) for each in met)
    start, before = _before(rough.grid, of)
    seconds = here.run + (here.node + here.field * sweep.snapshots) * nodes
    # On a broad spectrum spots stand in groups, and whatever happens to one concerns many.
    grouped = (rough.summits / rough.hills) ** here.breadth
    seconds += here.stop * len(met) + grouped * (at_stops + here.event * most * _crowded(most, here))
    steps = len(sweep.loads)
    if sweep.legs:
        steps = cyclic_steps(most, sweep, of)
        seconds += steps * (of.cycle.step + of.cycle.spot * most)
    kept = sweep.snapshots + bool(sweep.legs)
    disk = 58e3 + 57 * most * max(kept, 1) + 160 * steps + 20e3 * bool(sweep.legs)
    memory = before + here.memory * (2 if sweep.legs else 1) + _DOUBLE * nodes + 9 * 1024 * rough.summits
    recorded = Recorded(steps, kept, most * kept)
    return Cost(start + _shared_out(seconds, rough.grid, of), memory, disk, recorded)


def _crowded(count, here):
    return 1 + (count / here.crowd) ** 0.6


def spots(rough: Roughness, load: float) -> float:
    """Spots at a reduced pressure: the more, the more summits and hills there are.

    The powers are those of some eighty surfaces of 10 to 4000 summits, and of the challenge's 170 000, at loads of 3e-3
    to 8e-2; the number is off by a factor of 1.4 as a rule.
    """
    return max(1.0, min(0.6 * rough.summits, rough.summits**0.7 * rough.hills**0.36 * load**0.54))


# Arrays of the grid that boundary elements hold at a time; bytes of a cell that a snapshot's maps take, compressed.
PATCH_ARRAYS = 20
_MAPS = 1.5


def patch_cost(rough: Roughness, sweep: Sweep, of: Constants = FITTED) -> Cost:
    """A run of `icha.simulate` by boundary elements in the limit of a short range."""
    cells = rough.grid**2
    transforms = cells * math.log2(rough.grid)
    here = of.patches
    longer = 1.0
    if sweep.adhesion:
        density = max(rough.summits, 1) / cells
        longer = here.adhesion * (sweep.adhesion / 0.01) ** here.strength * (density / 0.01) ** here.density
        longer *= max(1.0, rough.grid / LARGE_GRID) ** here.large
    states = len(sweep.loads) + here.way * DEFAULT_STEP / sweep.max_step
    harder = [(load / 0.01) ** here.load for load in sweep.loads]
    at_stops = sum(harder) + here.way * DEFAULT_STEP / sweep.max_step * max(harder)
    seconds = of.loading.run + at_stops * here.stop * transforms * longer
    most = max(spots(rough, load) for load in sweep.loads)
    if sweep.legs:
        here, states = of.patch_cycle, cyclic_steps(most, sweep, of)
        seconds += states * (here.step + here.cell * transforms) * (here.adhesion if sweep.adhesion else 1)
    start, before = _before(rough.grid, of)
    kept = sweep.snapshots + bool(sweep.legs)
    disk = 80e3 + 160 * states + _MAPS * cells * kept
    memory = before + of.loading.memory + PATCH_ARRAYS * _DOUBLE * cells
    recorded = Recorded(states, kept, most * kept)
    return Cost(start + _shared_out(seconds, rough.grid, of), memory, disk, recorded)


def cyclic_steps(most: float, sweep: Sweep, of: Constants = FITTED) -> float:
    """Equilibria of a path both ways: every spot comes and goes, and with adhesion each of its jumps is resolved."""
    here = of.cycle
    jumps = here.jumps * most**here.together if sweep.adhesion else here.touches * most
    return (1 + sweep.legs) / 2 * (here.way * DEFAULT_STEP / sweep.max_step + jumps)


def solution_cost(nodes: int, reduced_pressure: float, of: Constants = FITTED, *, adhesive: bool) -> Cost:
    """Boundary elements of `nodes` a side at one load; with adhesion the mean gap that carries it is searched for."""
    seconds = of.finite_range.run + _solver(nodes, reduced_pressure, of, adhesive)
    return Cost(seconds, of.workflow.forked + 20 * _DOUBLE * nodes**2, 40e3 + 0.04 * nodes**2)


def _solver(nodes, reduced_pressure, of, adhesive):
    if adhesive:
        # At light loads the search for the gap takes longer.
        return of.finite_range.adhesive * (nodes / 256) ** 3 * (0.01 / reduced_pressure) ** 0.5
    return of.finite_range.bare * (nodes / 512) ** 3.1 * (reduced_pressure / 0.01) ** 0.3


def loop_cost(nodes: int, separation_step: float, of: Constants = FITTED, *, adhesive: bool) -> Cost:
    """Boundary elements both ways in steps of `separation_step` (in h_rms), which are divided where spots jump."""
    steps = 7 / separation_step + (35 if adhesive else 0)
    seconds = of.finite_range.run + of.finite_range.loop_step * steps * _solver(nodes, 0.01, of, adhesive)
    return Cost(seconds, of.workflow.forked + 20 * _DOUBLE * nodes**2, 33e3)


def sources_cost(nodes: int, reduced_pressures: Sequence[float], of: Constants = FITTED, *, adhesive: bool) -> Cost:
    """Sources of the model's error: some variants of the model and of boundary elements at every load."""
    here = of.finite_range
    each = sum(0.2 + here.sources * _solver(nodes, load, of, adhesive) for load in reduced_pressures)
    return Cost(here.run + 0.7 + each, of.workflow.forked + 25 * MiB + 20 * _DOUBLE * nodes**2, 28e3)


def one_asperity_cost(tabor_parameter: float | None, of: Constants = FITTED) -> Cost:
    """One asperity by model and boundary elements, whose nodes a side grow with the square of the Tabor parameter."""
    nodes = 800 * ((tabor_parameter or 1.5) / 4) ** 2
    seconds = of.finite_range.run + 2.0 + of.finite_range.asperity * (nodes / 800) ** 3
    return Cost(seconds, of.workflow.forked + 20 * _DOUBLE * nodes**2, 23e3)


def theories_cost(of: Constants = FITTED) -> Cost:
    """Theories and literature for a surface."""
    return Cost(of.gathering.theories, of.workflow.forked, 35e3)


# Edges of the bins of `icha.contact.bins`, whose imports `icha describe` would wait for.
GAP_EDGES, PRESSURE_EDGES = 112, 501
# Arrays along the steps and the spots of runs; texts count for several.
_STEP_ARRAYS, _SPOT_ARRAYS = 30, 11


def dataset_memory(cells: int, runs: Sequence[Recorded]) -> float:
    """Bytes of the arrays of a study that are read as a whole from the campaign dataset.

    Parameters
    ----------
    cells : number of combinations of the labels in the dataset, whether they have runs or not.
    runs : what is recorded of each run.
    """
    steps, snapshots = cells * max(run.steps for run in runs), cells * max(run.snapshots for run in runs)
    # Number of arrays, and values of each: densities, edges and bounds of bins, steps and spots.
    arrays = [
        (2, snapshots * PRESSURE_EDGES),
        (1, snapshots * GAP_EDGES),
        (2, cells * PRESSURE_EDGES),
        (1, 2 * cells * PRESSURE_EDGES),
        (4, cells * GAP_EDGES),
        (_STEP_ARRAYS, steps),
        (_SPOT_ARRAYS, sum(run.spots for run in runs)),
    ]
    return sum(count * _DOUBLE * values for count, values in arrays if _DOUBLE * values <= LEFT_IN_FILE)


def dataset_cost(seconds: float, disk: float, held: float, of: Constants = FITTED) -> Cost:
    """The campaign dataset, whose arrays take `held` bytes and are written block by block."""
    here = of.gathering
    memory = of.workflow.forked + here.table_memory + min(here.copies * held, here.blocks)
    return Cost(here.table + seconds, memory, disk)


def table_cost(seconds: float, disk: float, held: float, of: Constants = FITTED) -> Cost:
    """A file made of a dataset whose arrays take `held` bytes, which takes so many seconds for all runs."""
    here = of.gathering
    return Cost(here.table + seconds, of.workflow.forked + here.table_memory + here.copies * held, disk)


# Arrays of a topography that a map of contacts holds at a time, by the number of models that it shows.
MAP_ARRAYS = {1: 2, 2: 7}


def figure_cost(runs: int, nodes: int, models: int = 1, held: float = 0.0, of: Constants = FITTED) -> Cost:
    """A figure of so many runs, as PNG and PDF, with a topography of so many nodes and contacts by so many models.

    The arrays of the campaign dataset take `held` bytes.
    """
    here = of.gathering
    seconds = here.figure + here.figure_run * runs + here.map_node * nodes
    memory = here.figure_memory + MAP_ARRAYS[models] * _DOUBLE * nodes + here.copies * held
    return Cost(seconds, of.workflow.forked + memory, 400e3)


def report_cost(runs: int, figures: int, held: float = 0.0, of: Constants = FITTED) -> Cost:
    """The report, which holds its figures; the arrays of the campaign dataset take `held` bytes."""
    here = of.gathering
    seconds = here.report + here.report_run * runs + here.report_figure * figures
    memory = of.workflow.forked + here.report_memory + here.copies * held
    return Cost(seconds, memory, 700e3 + 250e3 * figures)


def correction(pairs: Sequence[tuple[float, float]]) -> float:
    """By what the seconds expected of jobs are to be multiplied, from pairs (expected, measured) of jobs of one kind.

    The median ratio; few pairs count for less, and none leaves 1.
    """
    if not pairs:
        return 1.0
    ratio = statistics.median(math.log(measured / expected) for expected, measured in pairs)
    return math.exp(ratio * len(pairs) / (len(pairs) + 1))
