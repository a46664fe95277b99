"""How often the intervals of estimates contain the truth, and what the estimates cost.

For each case, boundary elements on the grid for many seeds are the truth. Groups of other seeds give estimates from
three levels of accuracy. The interval of an estimate must contain the truth in 85 to 97 % of all estimates. The truth
has an error of its own, because its seeds are not infinitely many; the interval is widened by this error.

`python -m validation.answers` computes all cases in about an hour, saves their values in results/answers.csv, and
writes the tables of docs/estimates.md. Values that the file already contains are not computed again.
"""

import csv
import itertools
import math
import time
import warnings
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from scipy.stats import t as students_t

import icha
from icha.uncertainty.control_variates import PROBABILITY, estimate_quantity
from validation.tables import Table, write_tables

FILE = Path("results/answers.csv")
CELLS, SLOPE, MODULUS = 8, 0.1, 2e6
GRID, LARGE_GRID = 96, 512
# Hurst exponent and number of roll-off wavelengths along a side of each surface.
SURFACES = ((0.3, 2), (0.3, 4), (0.5, 2), (0.5, 4), (0.8, 2), (0.8, 4), (0.8, 6))
# Elastic energy of full contact divided by the work of adhesion: without adhesion, weak, medium and sticky.
RATIOS = {"bare": math.inf, "weak": 100.0, "medium": 20.0, "sticky": 3.0}
PRESSURES = (1e-3, 3e-3, 1e-2, 3e-2)
QUANTITIES = {"contact area": "contact_area_fraction", "mean gap": "mean_gap", "stiffness": "contact_stiffness"}
LOOP_QUANTITIES = {"pull-off pressure": "pull_off_pressure", "loss": "hysteresis_loss"}
LOOP_SURFACES, LOOP_RATIOS = ((0.5, 4), (0.8, 2), (0.8, 4)), ("weak", "medium")
# Models and grids of the levels; sticky surfaces have no asperity level.
LEVELS = {
    "asperities": ("asperities", 1),
    "coarse": ("boundary_elements", 2),
    "fine": ("boundary_elements", 1),
}
# Numbers of seeds of one estimate: with asperities, without asperities, and of a loop.
PLAN, STICKY_PLAN = {"asperities": 24, "coarse": 8, "fine": 3}, {"coarse": 24, "fine": 3}
SEEDS, LOOP_SEEDS = 96, 48
# On the large grid, one surface with few seeds shows what the levels save: seeds of each level.
LARGE_SURFACE, LARGE_RATIOS = (0.8, 4), ("bare", "medium")
LARGE_PLAN = {"asperities": 24, "coarse": 8, "fine": 4}


def spectrum(surface, grid):
    """Return the spectrum of a surface."""
    hurst, waves = surface
    return icha.SelfAffineSpectrum(1e-4, 1e-4 / waves, 1e-4 * CELLS / grid, hurst, SLOPE)


def values_of(job):
    """Compute one run; return its seconds and its values, by quantity and pressure (0 for a quantity of a loop)."""
    surface, grid, ratio, level, loop, seed = job
    model, coarsening = LEVELS[level]
    warnings.simplefilter("ignore")
    rough = spectrum(surface, grid).realise(grid // coarsening, seed)
    material = icha.Material(MODULUS, rough.full_contact_energy * MODULUS / RATIOS[ratio])
    path = icha.Path(reduced_pressures=[1e-2] if loop else PRESSURES, unload=loop)
    begin = time.perf_counter()
    try:
        run = icha.simulate(rough, material, path, model=model, seed=seed)
    except icha.ConvergenceError as error:  # a target lies inside a jump
        run, loop = error.dataset, False
    seconds = time.perf_counter() - begin
    if loop:
        return seconds, {(name, 0.0): float(run[key]) for name, key in LOOP_QUANTITIES.items()}
    return seconds, {
        (name, float(p)): float(run[key].values[k])
        for name, key in QUANTITIES.items()
        for k, p in enumerate(run["step_target"].values)
        if p in PRESSURES
    }


def jobs():
    """Return all runs as tuples (surface, grid, ratio, level, loop, seed)."""
    loading = [
        (surface, GRID, ratio, level, False, seed)
        for surface, ratio, level in itertools.product(SURFACES, RATIOS, LEVELS)
        if not (ratio == "sticky" and level == "asperities")
        for seed in range(1, SEEDS + 1)
    ]
    loops = itertools.product(LOOP_SURFACES, [GRID], LOOP_RATIOS, LEVELS, [True], range(1, LOOP_SEEDS + 1))
    large = [
        (LARGE_SURFACE, LARGE_GRID, ratio, level, False, seed)
        for ratio, level in itertools.product(LARGE_RATIOS, LARGE_PLAN)
        for seed in range(1, LARGE_PLAN[level] + 1)
    ]
    return [*loading, *loops, *large]


def compute():
    """Compute the runs that the file lacks, on two cores, and append their values to the file."""
    FILE.parent.mkdir(exist_ok=True)
    done = {tuple(row[:7]) for row in read_rows()}
    left = [job for job in jobs() if _key(job) not in done]
    with ProcessPoolExecutor(2) as pool, FILE.open("a", newline="") as file:
        writer = csv.writer(file)
        for job, (seconds, values) in zip(left, pool.map(values_of, left), strict=True):
            writer.writerows([*_key(job), *place, value, f"{seconds:.3f}"] for place, value in values.items())
            file.flush()


def _key(job):
    (hurst, waves), grid, ratio, level, loop, seed = job
    return tuple(map(str, (hurst, waves, grid, ratio, level, int(loop), seed)))


def read_rows():
    """Return the rows of the file; empty if the file does not exist."""
    return list(csv.reader(FILE.open(newline=""))) if FILE.exists() else []


def read_values():
    """Return values by case, level and seed, and seconds per run by case and level."""
    values, seconds = defaultdict(lambda: defaultdict(dict)), defaultdict(lambda: defaultdict(list))
    for hurst, waves, grid, ratio, level, _, seed, quantity, pressure, value, duration in read_rows():
        case = (hurst, waves, int(grid), ratio, quantity, float(pressure))
        values[case][level][int(seed)] = float(value)
        seconds[case][level].append(float(duration))
    return values, seconds


def judge(levels, plan):
    """Yield for each group of seeds: whether the interval contains the truth, its half-width, and the scatter of seeds.

    levels : values by level and seed.
    plan : number of seeds of each level in one group.
    """
    fine, most = levels["fine"], max(plan.values())
    for first in range(1, max(fine) - most + 2, most):
        groups = {level: range(first, first + count) for level, count in plan.items()}
        chosen = {
            level: {seed: levels[level][seed] for seed in groups.get(level, ()) if seed in levels[level]}
            for level in LEVELS
        }
        found = estimate_quantity(chosen["asperities"], chosen["coarse"], chosen["fine"])
        rest = np.array([value for seed, value in fine.items() if not first <= seed < first + most])
        if found is None or len(rest) < 8 or not found.value:
            continue
        rest = np.log(rest / found.value) if found.logarithmic else rest / found.value - 1
        quantile = students_t.ppf(0.5 * (1 + PROBABILITY), len(rest) - 1)
        error_of_truth = quantile * rest.std(ddof=1) / math.sqrt(len(rest))
        # The truth is on the same grid, so the error of the grid does not count.
        half = math.hypot(found.relative.scatter, found.relative.model, found.relative.refinement)
        yield abs(rest.mean()) <= math.hypot(half, error_of_truth), half, rest.std(ddof=1)


def tables():
    """Return the table of coverage and the table of costs."""
    values, seconds = read_values()
    found = defaultdict(list)
    for case, levels in values.items():
        grid, ratio, quantity = case[2], case[3], case[4]
        if grid != GRID:
            continue
        plan = STICKY_PLAN if ratio == "sticky" else PLAN
        spent = sum(count * np.mean(seconds[case][level]) for level, count in plan.items())
        price = np.mean(seconds[case]["fine"])
        for inside, half, scatter in judge(levels, plan):
            # Number of plain fine seeds n whose interval t(n - 1) s/sqrt(n) is as narrow.
            plain = next(n for n in range(2, 10**6) if students_t.ppf(0.95, n - 1) * scatter / math.sqrt(n) <= half)
            found[quantity, ratio].append((inside, half, plain * price / spent, case))
    rows = []
    for (quantity, ratio), each in found.items():
        inside, half, gain, cases = zip(*each, strict=True)
        cells = [str(len(set(cases))), str(len(each)), f"{100 * np.mean(inside):.0f} %"]
        rows.append([f"{quantity}, {ratio}", *cells, f"{100 * np.median(half):.1f} %", f"{np.median(gain):.1f}"])
    every = [each for group in found.values() for each in group]
    total = [str(len({each[3] for each in every})), str(len(every)), f"{100 * np.mean([e[0] for e in every]):.0f} %"]
    rows.append(["all", *total, "", f"{np.median([e[2] for e in every]):.1f}"])
    head = ["", "cases", "intervals", "contain the truth", "half-width", "saved time"]
    return {"answers_coverage": Table(head, rows, numbers=True), "answers_cost": _costs(values, seconds)}


def _costs(values, seconds):
    """Return the table of what levels save on the large grid; plain seeds have the scatter of the coarse level."""
    rows = []
    for case, levels in values.items():
        *_, grid, ratio, quantity, pressure = case
        if grid != LARGE_GRID or quantity == "stiffness":
            continue
        found = estimate_quantity(levels["asperities"], levels["coarse"], levels["fine"]).relative
        half = math.hypot(found.scatter, found.model, found.refinement)
        scatter = np.std(np.log(list(levels["coarse"].values())), ddof=1)
        plain = next(n for n in range(2, 10**6) if students_t.ppf(0.95, n - 1) * scatter / math.sqrt(n) <= half)
        spent = sum(count * np.mean(seconds[case][level]) for level, count in LARGE_PLAN.items())
        times = [f"{np.mean(seconds[case][level]):.1f} s" for level in LARGE_PLAN]
        cells = [f"{quantity}, {ratio}, p* = {pressure:g}", *times, f"{100 * half:.1f} %", str(plain)]
        rows.append([*cells, f"{plain * np.mean(seconds[case]['fine']) / spent:.1f}"])
    head = ["", *(f"one seed: {level}" for level in LARGE_PLAN), "half-width", "plain fine seeds", "saved time"]
    return Table(head, rows, numbers=True)


if __name__ == "__main__":
    compute()
    write_tables(tables())
