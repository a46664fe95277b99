"""Error of boundary elements due to the grid: pull-off, loss, and areas at light loads.

    python -m validation.loop_grid [--minutes N] [--tables]

Every surface is the same on all grids: a finer grid interpolates the waves of the coarsest grid. Every run is saved in
validation/results/loop_grid.json as soon as it is complete, so that a later call continues where this one ends. To
measure again, for example with another solver, delete this file. `--minutes` is the largest computing time of a call.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import time
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

import icha
from icha.uncertainty.grid_error import LEAST_MEASURED, LOOP_ERRORS, AreaError, LoopError
from validation.tables import Table, percent, write_tables

RESULTS = Path(__file__).resolve().parent / "results/loop_grid.json"
_PERIOD, _MODULUS, _SLOPE, _TABOR = 100e-6, 25e6, 0.1, 5.0
# Cells per shortest wave of the grids, and the cases whose loops are also on the finest grid.
_COARSEST, CELLS, _FINEST, _ON_FINEST = 8, (8, 16, 32), 64, (0, 1, 2, 3, 5, 9)
# Contact area at which loops turn, and reduced pressures of light loads.
_AREA, _LIGHT_PRESSURES = 0.1, (0.002, 0.005, 0.01, 0.03)


class Case(NamedTuple):
    """A random surface and a material.

    Attributes
    ----------
    hurst : Hurst exponent.
    waves, rolls : shortest waves and roll-off waves along a side.
    ratio : elastic energy of full contact over the work of adhesion.
    seed : seed of the surface.
    """

    hurst: float
    waves: int
    rolls: int
    ratio: float
    seed: int

    def surface(self, cells: int) -> icha.Surface:
        """Return the surface on a grid with a number of cells per shortest wave."""
        spectrum = icha.SelfAffineSpectrum(_PERIOD, _PERIOD / self.rolls, _PERIOD / self.waves, self.hurst, _SLOPE)
        return spectrum.realise(_COARSEST * self.waves, self.seed).refined(cells // _COARSEST)

    def material(self, *, adhesive: bool = True) -> icha.Material:
        """Return the material, with the same Tabor parameter of a typical summit on every surface."""
        surface = self.surface(_COARSEST)
        energy = surface.full_contact_energy * _MODULUS / self.ratio
        reach = (surface.summit_radius * (energy / _MODULUS) ** 2) ** (1 / 3) / _TABOR
        return icha.Material(_MODULUS, energy if adhesive else 0.0, reach)


CASES = (
    Case(0.8, 8, 2, 30, 1),
    Case(0.8, 6, 1, 5, 2),
    Case(0.5, 8, 2, 15, 3),
    Case(0.5, 6, 3, 4, 4),
    Case(0.3, 8, 4, 60, 5),
    Case(0.3, 6, 2, 8, 6),
    Case(1.0, 8, 1, 10, 7),
    Case(1.0, 6, 2, 3, 8),
    Case(0.8, 10, 4, 20, 9),
    Case(0.5, 6, 2, 100, 10),
)


def measure_light(case: int, cells: int, adhesive: int) -> dict:
    """Return areas and numbers of patches at light loads."""
    surface, material = CASES[case].surface(cells), CASES[case].material(adhesive=bool(adhesive))
    try:
        run = icha.simulate(
            surface, material, icha.Path(reduced_pressures=_LIGHT_PRESSURES, snapshots=[]), model="boundary_elements"
        )
    except icha.ConvergenceError as error:  # the last loads lie inside a jump
        run = error.dataset
    names = {"reduced_pressure": "step_target", "area": "contact_area_fraction", "patches": "spot_count"}
    return {name: run[key].values.tolist() for name, key in names.items()}


def measure_turn(case: int) -> dict:
    """Return the mean separation at which the loops of a case turn on all grids, m, and their largest work, J/m2."""
    surface, material = CASES[case].surface(_COARSEST), CASES[case].material()
    path = icha.Path(area_fractions=[_AREA], unload=True, snapshots=[])
    try:
        run = icha.simulate(surface, material, path, model="boundary_elements")
    except icha.ConvergenceError as error:  # this area lies inside a jump
        run = error.dataset
    at_target = np.flatnonzero(run["step_kind"] == "area_fraction")
    turn = at_target[0] if len(at_target) else int(run["contact_area_fraction"].argmax())
    return {"separation": float(run["mean_separation"][turn]), "work": float(abs(run["work"]).max())}


def measure_loop(case: int, cells: int, separation: float) -> dict:
    """Return pull-off (Pa) and loss (J/m2) of a loop."""
    surface, material = CASES[case].surface(cells), CASES[case].material()
    path = icha.Path(mean_separations=[separation], unload=True, snapshots=[])
    run = icha.simulate(surface, material, path, model="boundary_elements")
    return {
        "length": float((material.surface_energy / _MODULUS * surface.summit_radius**2) ** (1 / 3) / surface.spacing),
        "pull_off": float(run["pull_off_pressure"]),
        "loss": float(run["hysteresis_loss"]),
        "area": float(run["largest_contact_area_fraction"]),
        "failed": run.attrs.get("failed_checks", ""),
    }


def read_measurements() -> dict[str, dict]:
    """Return all saved runs by name."""
    return json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}


def measure(seconds: float) -> None:
    """Measure and save the runs that the file lacks, in the order of their cost, for at most a computing time."""
    done, begin = read_measurements(), time.process_time()

    def save(name: str, function, *arguments):
        """Measure one run unless it is saved, and return it."""
        if name not in done and time.process_time() - begin < seconds:
            clock = time.process_time()
            found = function(*arguments)
            done[name] = found | {"seconds": round(time.process_time() - clock, 1)}
            RESULTS.write_text(json.dumps(done, indent=1) + "\n", encoding="utf-8")
            print(name, done[name], flush=True)
        return done.get(name)

    for case in range(len(CASES)):
        save(f"turn {case}", measure_turn, case)
    for cells, case in itertools.product(CELLS, range(len(CASES))):
        for adhesive in (0, 1):
            save(f"light {case} {cells} {adhesive}", measure_light, case, cells, adhesive)
    loops = [*itertools.product(CELLS, range(len(CASES))), *itertools.product([_FINEST], _ON_FINEST)]
    for cells, case in loops:
        if turn := done.get(f"turn {case}"):
            save(f"loop {case} {cells}", measure_loop, case, cells, turn["separation"])


# --- laws and tables ----------------------------------------------------------------------------------------------

# Quantities of a loop in the saved runs, by variable of a run.
_NAMES = {"pull_off_pressure": "pull_off", "hysteresis_loss": "loss"}
# Cells in the length l on the finest grid of a case in the fit, so that the error of this grid is small.
_FINEST_FROM = 5.0
# Numerical error of a loss, divided by the largest work (docs/short_range.md, section h).
_LOSS_ERROR = 1e-3


def loops_of(runs: dict[str, dict], least: float = 0.0) -> dict[int, dict[int, dict]]:
    """Return the saved loops by case and cells per shortest wave, without loops that failed a check.

    `least` is the smallest number of cells in the length l. Cases have at least two loops.
    """
    found: dict[int, dict[int, dict]] = {}
    for name, run in runs.items():
        kind, case, *cells = name.split()
        if kind == "loop" and not run["failed"] and run["length"] >= least:
            found.setdefault(int(case), {})[int(cells[0])] = run
    return {case: by_cells for case, by_cells in found.items() if len(by_cells) > 1}


def _is_loss_known(runs, case):
    """Return whether the loss of a case on its finest grid is larger than its numerical error."""
    by_cells = loops_of(runs)[case]
    return by_cells[max(by_cells)]["loss"] > _LOSS_ERROR * runs[f"turn {case}"]["work"]


def fit_loops(runs: dict[str, dict], variable: str) -> LoopError:
    """Fit the law of a quantity by least squares of ratios: each loop over the loop on the finest grid of its case."""
    rows = []
    for by_cells in loops_of(runs, LEAST_MEASURED).values():
        finest = by_cells.pop(max(by_cells))
        if finest["length"] >= _FINEST_FROM:
            values = _NAMES[variable]
            rows += [(run["length"], finest["length"], run[values] / finest[values]) for run in by_cells.values()]
    cells, finest_cells, ratios = np.array(rows).T

    def residuals(parameters):
        law = LoopError("", *np.exp(parameters), 0.0)
        return (1 - law.at(cells)) / (1 - law.at(finest_cells)) - ratios

    found = minimize(lambda parameters: np.sum(residuals(parameters) ** 2), [0.0, 0.0], method="Nelder-Mead").x
    scatter = math.sqrt(np.sum(residuals(found) ** 2) / (len(rows) - len(found)))
    return LoopError(LOOP_ERRORS[variable].words, *np.exp(found).tolist(), scatter)


def areas_of(runs: dict[str, dict]) -> np.ndarray:
    """Return rows (patches, cells in contact, error of the area) of all light loads, relative to the finest grid."""
    rows = []
    for name, run in runs.items():
        kind, case, *others = name.split()
        if kind != "light" or int(others[0]) == CELLS[-1]:
            continue
        finest = runs.get(f"light {case} {CELLS[-1]} {others[1]}")
        nodes = (CASES[int(case)].waves * int(others[0])) ** 2
        for patches, area, exact in zip(run["patches"], run["area"], finest["area"] if finest else [], strict=False):
            rows.append((patches, area * nodes, area / exact - 1))
    return np.array(rows)


def fit_areas(rows: np.ndarray) -> AreaError:
    """Fit the standard deviation of the error of areas by the largest likelihood of normal errors."""
    _, cells, error = rows.T

    def unlikely(parameters):
        deviation = (math.exp(parameters[0]) / cells) ** math.exp(parameters[1])
        return np.sum(np.log(deviation) + (error / deviation) ** 2 / 2)

    return AreaError(*np.exp(minimize(unlikely, [0.0, 0.0], method="Nelder-Mead").x).tolist())


def _loops(runs):
    """Table of all loops: pull-off and loss relative to the finest grid of each case."""
    rows = []
    for case, by_cells in loops_of(runs).items():
        surface, finest = CASES[case], by_cells[max(by_cells)]
        for cells, run in by_cells.items():
            errors = [percent(run[name] / finest[name] - 1, 0) for name in _NAMES.values()]
            if not _is_loss_known(runs, case):
                errors[1] = "not known"
            numbers = [f"{surface.hurst:g}", f"{surface.waves}, {surface.rolls}", f"{surface.ratio:g}"]
            rows.append([*numbers, str(cells), f"{run['length']:.2f}", *(errors if run is not finest else ["", ""])])
    head = ["H", "shortest waves, roll-off waves", "U_full/Δγ", "cells per shortest wave", "cells in l", "pull-off, %"]
    return Table([*head, "loss, %"], rows, numbers=True)


def _law(runs):
    """Table of the error of pull-off and loss by cells in the length l, for cases in the fit, with the laws."""
    laws = {variable: fit_loops(runs, variable) for variable in _NAMES}
    rows = []
    for low, high in itertools.pairwise(_CLASSES):
        errors = {name: [] for name in _NAMES.values()}
        for by_cells in loops_of(runs).values():
            finest = by_cells.pop(max(by_cells))
            for run in by_cells.values() if finest["length"] >= _FINEST_FROM else ():
                for name in errors if low <= run["length"] < high else ():
                    errors[name].append(run[name] / finest[name] - 1)
        cells = [f"{low:g} to {high:g}", str(len(errors["loss"]))]
        for variable, name in _NAMES.items():
            ends = [percent(end(errors[name]), 0) for end in (min, max)] if errors[name] else []
            cells += [" to ".join(ends), percent(-laws[variable].at(math.sqrt(low * high)), 0)]
        rows.append(cells)
    return Table(["cells in l", "loops", "pull-off, %", "law", "loss, %", "law"], rows, numbers=True)


# Classes of cells in the length l, of cells in contact, and of numbers of patches.
_CLASSES = (0.6, 1.0, 1.4, 2.0, 2.8, 4.0, 6.0)
_CONTACT_CELLS, _PATCHES = (0, 32, 64, 128, 256, 512, 10**9), (1, 3, 13, 10**9)


def _areas(runs):
    """Table of the error of areas by cells in contact and number of patches."""
    rows, law, lines = areas_of(runs), fit_areas(areas_of(runs)), []
    for (low, high), (few, many) in itertools.product(*map(itertools.pairwise, (_CONTACT_CELLS, _PATCHES))):
        members = rows[(rows[:, 1] >= low) & (rows[:, 1] < high) & (rows[:, 0] >= few) & (rows[:, 0] < many)]
        if not len(members):
            continue
        patches, cells, error = members.T
        contact = f"{low} to {high}" if high < 10**9 else f"over {low}"
        count = f"{few} to {many - 1}" if many < 10**9 else f"over {few - 1}"
        numbers = [f"{np.mean(cells / patches):.0f}", str(len(members)), percent(error.mean(), 1)]
        rms = 100 * math.sqrt(np.mean(error**2))
        span = f"{percent(error.min(), 1)} to {percent(error.max(), 1)}"
        lines.append([contact, count, *numbers, f"{rms:.1f}", f"{100 * law.at(cells.mean()):.1f}", span])
    head = ["cells in contact", "patches", "cells per patch", "states", "mean, %", "rms, %", "law, %", "range, %"]
    return Table(head, lines, numbers=True)


def tables(runs: dict[str, dict]) -> dict[str, Table]:
    """Return all tables from the saved runs."""
    return {"loop_grid_loops": _loops(runs), "loop_grid_law": _law(runs), "loop_grid_areas": _areas(runs)}


def main() -> None:
    """Measure, save, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=40.0, help="largest computing time of this call")
    parser.add_argument("--tables", action="store_true", help="write the tables from saved measurements")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    if not options.tables:
        measure(60 * options.minutes)
    runs = read_measurements()
    write_tables(tables(runs))
    for law in (*(fit_loops(runs, variable) for variable in _NAMES), fit_areas(areas_of(runs))):
        print(law)


if __name__ == "__main__":
    main()
