"""What computing costs: seconds on one core, memory and disk of surfaces, runs and boundary elements, beforehand.

The formulas say how costs grow: with the nodes of a grid, with the number of summits, with the load. Their constants
were fitted by eye to processor times on one core of an Intel Xeon: of about a hundred runs on grids of 64 to 1024 nodes
a side like those of group `fitted` of `benchmarks/costs.py`, of boundary elements on 32 to 512 nodes a side, and of the
scaling and the full challenge surface in docs/benchmarks.md. That benchmark prints predicted over measured, also for
surfaces and loads that were not part of the fit. Expect a factor of two either way, more where nothing can be known
beforehand of how a path will go; `correction` brings in what a campaign's own jobs took.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, replace

from icha.path.limits import DEFAULT_STEP

_MiB = 2**20
# A job's process: start, imports and files in s, memory in bytes.
JOB_SECONDS = 0.4
_PROGRAM = 140 * _MiB
_DOUBLE = 8
# Seconds for the labelled dataset of a run, and for that of boundary elements.
_DATASET, _SOLUTION = 0.2, 0.15


@dataclass(frozen=True)
class Cost:
    """Seconds on one core, largest memory in bytes, and disk in bytes."""

    seconds: float
    memory: float
    disk: float

    def slower(self, factor: float) -> Cost:
        """The same on a machine that takes `factor` times as long."""
        return replace(self, seconds=self.seconds * factor)


@dataclass(frozen=True)
class Sweep:
    """What of a path and a material the cost of a run depends on.

    Parameters
    ----------
    stops, snapshots : number of stops, and of those that keep their fields.
    largest_load : largest reduced pressure p/(E* h'_rms).
    adhesive : whether there is adhesion.
    legs : legs after the first loading: 0, or 1 and more for ways back and in again.
    max_step : longest step of the mean separation, in h_rms.
    """

    stops: int
    snapshots: int
    largest_load: float
    adhesive: bool
    legs: int = 0
    max_step: float = DEFAULT_STEP


# A figure as PNG and PDF.
FIGURE = Cost(3.0, 230 * _MiB, 170e3)


def gaussian_summits(period: float, m2: float, m4: float) -> float:
    """Expected number of maxima of an isotropic Gaussian surface, A0 m4/(6 sqrt(3) pi m2).

    P. R. Nayak, J. Lubr. Technol. 93 (1971) 398-407, doi:10.1115/1.3451608.

    Parameters
    ----------
    period : side of the periodic cell, m.
    m2, m4 : variances of a profile's slope (1) and curvature (m^-2).
    """
    return period**2 * m4 / (6 * math.sqrt(3) * math.pi * m2)


def self_affine_summits(period: float, rolloff_wavelength: float, short_wavelength: float, hurst: float) -> float:
    """Expected number of summits of a self-affine surface with roll-off; m.

    Of the spectrum's moments as integrals over the plane of wave vectors, m2 = 1/2 int q^2 C, m4 = 3/8 int q^4 C.
    """
    q_l, q_0, q_1 = (2 * math.pi / length for length in (period, rolloff_wavelength, short_wavelength))

    def moment(order):
        # int q^(order + 1) C dq: flat up to the roll-off, falling as q^(-2 (1 + H)) from there on.
        power = order - 2 * hurst
        falling = math.log(q_1 / q_0) if power == 0 else math.expm1(power * math.log(q_1 / q_0)) / power
        return (q_0 ** (order + 2) - q_l ** (order + 2)) / (order + 2) + q_0 ** (order + 2) * falling

    return gaussian_summits(period, moment(2) / 2, 3 / 8 * moment(4))


def summits_of_grid(grid: int) -> float:
    """A guess at the number of summits where only the nodes a side are known: shortest waves of eight cells."""
    return (grid / 8) ** 2 / 4.5


def job_threads(grid: int) -> int:
    """Cores that a job of a surface takes, and is given: two where transforms of large arrays pay, else one."""
    return 2 if grid >= 2048 else 1


def surface_cost(grid: int) -> Cost:
    """Making a topography of `grid` nodes a side, and writing it."""
    heights = _DOUBLE * grid**2
    # Heights of grids between 64 and 2048 nodes are compressed, by about a sixth.
    compression = 0.84 if 64 <= grid < 2048 else 1.0
    return Cost(JOB_SECONDS + 1.2e-7 * grid**2, _PROGRAM + 2.7 * heights, 18e3 + compression * heights)


def sweep_cost(grid: int, summits: float, sweep: Sweep) -> Cost:
    """A run of `icha.simulate` on a surface of `grid` nodes a side with so many summits."""
    loaded = _loaded(sweep)
    spots = _spots(summits, sweep)
    fields = (1e-7 + 2e-7 * sweep.snapshots) * grid**2
    # Loading solves at jumps and unions, whose number is that of the spots, more than at the stops that are asked for.
    effort = 1 + 0.008 * (sweep.stops + 2 / sweep.max_step)
    loading = 6.3e-4 * summits * (1 + (summits / 1.5e5) ** 0.6)
    seconds = JOB_SECONDS + _DATASET + fields + loaded * loading * effort
    steps = sweep.stops
    if sweep.legs:
        steps += cyclic_steps(spots, sweep)
        seconds += steps * ((0.0135 if sweep.adhesive else 0.0095) + 1e-5 * summits)
    disk = 58e3 + 57 * spots * max(sweep.snapshots + bool(sweep.legs), 1) + 160 * steps + 20e3 * bool(sweep.legs)
    return Cost(seconds, _PROGRAM + _DOUBLE * grid**2 + 9 * 1024 * summits, disk)


def _loaded(sweep):
    """How far a path goes, of the largest loads that the model covers."""
    return min(1.0, (sweep.largest_load / 0.08) ** 0.55)


def _spots(summits, sweep):
    """Spots at the largest load: up to about half of the summits, where the model ends; small surfaces have more."""
    return max(1.0, min(summits, (summits + 40) * _loaded(sweep) / 2))


# Boundary elements in the limit of a short range: seconds of a pair of transforms over n^2 log2 n; pairs for a state
# with adhesion and without; states for a stop, and the way in from first contact, in h_rms, along which steps are long.
_TRANSFORMS = 6.5e-10
_PAIRS, _PAIRS_WITHOUT_ADHESION = 300, 65
_STATES_AT_STOP, _WAY_IN = 3, 3.0
# Arrays of the grid that they hold at a time; bytes of a cell that a snapshot's maps take, compressed.
PATCH_ARRAYS = 30
_MAPS = 1.5


def patch_states(summits: float, sweep: Sweep) -> float:
    """Equilibria of a run by boundary elements: at its stops, between them, and on ways back at every jump."""
    states = (1 + sweep.legs) * (_STATES_AT_STOP * sweep.stops + _WAY_IN / sweep.max_step)
    return states + (cyclic_steps(_spots(summits, sweep), sweep) if sweep.legs else 0)


def patch_cost(grid: int, summits: float, sweep: Sweep) -> Cost:
    """A run of `icha.simulate` by boundary elements on a surface of `grid` nodes a side with so many summits."""
    cells, states = grid**2, patch_states(summits, sweep)
    pairs = _PAIRS if sweep.adhesive else _PAIRS_WITHOUT_ADHESION
    seconds = JOB_SECONDS + _DATASET + states * pairs * _TRANSFORMS * cells * math.log2(grid)
    disk = 80e3 + 160 * states + _MAPS * cells * (sweep.snapshots + bool(sweep.legs))
    return Cost(seconds, _PROGRAM + PATCH_ARRAYS * _DOUBLE * cells, disk)


def cyclic_steps(spots: float, sweep: Sweep) -> float:
    """Equilibria of a path both ways: every spot comes and goes, and with adhesion each of its jumps is resolved."""
    events = 2 * spots
    jumps = 40 * events**0.6 if sweep.adhesive else 55 + 0.5 * events
    return (1 + sweep.legs) / 2 * (45 * DEFAULT_STEP / sweep.max_step + jumps)


def solution_cost(nodes: int, reduced_pressure: float, *, adhesive: bool) -> Cost:
    """Boundary elements of `nodes` a side at one load; with adhesion the mean gap that carries it is searched for."""
    seconds = JOB_SECONDS + _SOLUTION + _solver(nodes, reduced_pressure, adhesive)
    return Cost(seconds, _PROGRAM + 20 * _DOUBLE * nodes**2, 40e3 + 0.04 * nodes**2)


def _solver(nodes, reduced_pressure, adhesive):
    if adhesive:
        return 2.6 * (nodes / 256) ** 3
    return 2.2 * (nodes / 512) ** 3.1 * (reduced_pressure / 0.01) ** 0.3


def loop_cost(nodes: int, separation_step: float, *, adhesive: bool) -> Cost:
    """Boundary elements both ways in steps of `separation_step` (in h_rms), which are divided where spots jump."""
    steps = 7 / separation_step + (35 if adhesive else 0)
    seconds = JOB_SECONDS + _SOLUTION + 1.2 * steps * _solver(nodes, 0.01, adhesive)
    return Cost(seconds, _PROGRAM + 20 * _DOUBLE * nodes**2, 33e3)


def sources_cost(nodes: int, reduced_pressures: Sequence[float], *, adhesive: bool) -> Cost:
    """Sources of the model's error: some variants of the model and of boundary elements at every load."""
    seconds = JOB_SECONDS + 0.7 + sum(0.2 + 2.5 * _solver(nodes, load, adhesive) for load in reduced_pressures)
    return Cost(seconds, _PROGRAM + 25 * _MiB + 20 * _DOUBLE * nodes**2, 28e3)


def one_asperity_cost(tabor_parameter: float | None) -> Cost:
    """One asperity by model and boundary elements, whose nodes a side grow with the square of the Tabor parameter."""
    nodes = 800 * ((tabor_parameter or 1.5) / 4) ** 2
    return Cost(JOB_SECONDS + 2.0 + 240 * (nodes / 800) ** 3, _PROGRAM + 20 * _DOUBLE * nodes**2, 23e3)


def correction(pairs: Sequence[tuple[float, float]]) -> float:
    """By what the seconds expected of jobs are to be multiplied, from pairs (expected, measured) of jobs of one kind.

    The median ratio; few pairs count for less, and none leaves 1.
    """
    if not pairs:
        return 1.0
    ratio = statistics.median(math.log(measured / expected) for expected, measured in pairs)
    return math.exp(ratio * len(pairs) / (len(pairs) + 1))
