"""Error of boundary elements due to the grid: pull-off, loss, and areas at light loads.

    python -m validation.loop_grid [--parts PART ...] [--tables]

Every surface is the same on all grids: a finer grid interpolates the waves of the coarsest grid. Measurements are saved
in validation/results/loop_grid, and the tables are written from them; with `--tables` nothing is measured.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from functools import cache, partial
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize

import icha
from icha.uncertainty.grid_error import LEAST_MEASURED, LOOP_ERRORS, AreaError, LoopError
from validation.measurements import Parts, Rows, measure_page, read_rows
from validation.tables import Table, percent

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


def follow(case: int, cells: int, *, adhesive: bool = True, **path):
    """Return the run of a case on a grid along a path, up to a target that lies inside a jump."""
    surface, material = CASES[case].surface(cells), CASES[case].material(adhesive=adhesive)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return icha.simulate(surface, material, icha.Path(snapshots=[], **path), model="boundary_elements")
        except icha.ConvergenceError as error:
            return error.dataset


def measure_light(case: int, cells: int, adhesive: bool) -> Iterator[dict]:
    """Yield areas and numbers of patches at light loads; the last loads may lie inside a jump."""
    run = follow(case, cells, adhesive=adhesive, reduced_pressures=_LIGHT_PRESSURES)
    of_case = {"case": case, "cells": cells, "adhesive": adhesive}
    columns = (run[name].values.tolist() for name in ("step_target", "contact_area_fraction", "spot_count"))
    for load, area, patches in zip(*columns, strict=True):
        yield of_case | {"load": load, "area": area, "patches": patches}


@cache
def measure_turn(case: int) -> dict:
    """Return the mean separation at which the loops of a case turn on all grids, m, and their largest work, J/m2."""
    run = follow(case, _COARSEST, area_fractions=[_AREA], unload=True)
    at_target = np.flatnonzero(run["step_kind"] == "area_fraction")
    turn = at_target[0] if len(at_target) else int(run["contact_area_fraction"].argmax())
    return {"case": case, "separation": float(run["mean_separation"][turn]), "work": float(abs(run["work"]).max())}


def measure_loop(case: int, cells: int) -> dict:
    """Return pull-off (Pa) and loss (J/m2) of a loop."""
    surface, material = CASES[case].surface(cells), CASES[case].material()
    run = follow(case, cells, mean_separations=[measure_turn(case)["separation"]], unload=True)
    return {
        "case": case,
        "cells": cells,
        "length": float((material.surface_energy / _MODULUS * surface.summit_radius**2) ** (1 / 3) / surface.spacing),
        "pull_off": float(run["pull_off_pressure"]),
        "loss": float(run["hysteresis_loss"]),
        "area": float(run["largest_contact_area_fraction"]),
        "failed": run.attrs.get("failed_checks", ""),
    }


PARTS: Parts = {
    "turn": (measure_turn, [(case,) for case in range(len(CASES))]),
    "light": (measure_light, [*product(range(len(CASES)), CELLS, (False, True))]),
    "loop": (measure_loop, [*product(range(len(CASES)), CELLS), *product(_ON_FINEST, [_FINEST])]),
}


# --- laws and tables ----------------------------------------------------------------------------------------------

# Quantities of a loop in the saved rows, by variable of a run.
_NAMES = {"pull_off_pressure": "pull_off", "hysteresis_loss": "loss"}
# Cells in the length l on the finest grid of a case in the fit, so that the error of this grid is small.
_FINEST_FROM = 5.0
# Numerical error of a loss, divided by the largest work (docs/short_range.md, section h).
_LOSS_ERROR = 1e-3


def loops_of(rows: Rows, least: float = 0.0) -> pd.DataFrame:
    """Return the loops with at least `least` cells in the length l that passed their checks, two or more of each case.

    Further columns: the length on the finest grid of the case, and errors relative to this grid (0 on this grid).
    """
    loops = pd.DataFrame(rows["loop"]).sort_values(["case", "cells"])
    loops = loops[(loops["failed"] == "") & (loops["length"] >= least)]
    cases = loops.groupby("case")
    loops = loops[cases["cells"].transform("size") > 1]
    finest = {name: cases[name].transform("last") for name in ("length", *_NAMES.values())}
    errors = {f"{name}_error": loops[name] / finest[name] - 1 for name in _NAMES.values()}
    return loops.assign(finest_length=finest["length"], is_finest=loops["length"] == finest["length"], **errors)


def _in_fit(rows, least=0.0):
    """Return the loops to which the laws are fitted."""
    loops = loops_of(rows, least)
    return loops[~loops["is_finest"] & (loops["finest_length"] >= _FINEST_FROM)]


def fit_loops(rows: Rows, variable: str) -> LoopError:
    """Fit the law of a quantity by least squares of ratios: each loop over the loop on the finest grid of its case."""
    columns = _in_fit(rows, LEAST_MEASURED)[["length", "finest_length", f"{_NAMES[variable]}_error"]]
    cells, finest_cells, errors = columns.to_numpy().T

    def residuals(parameters):
        law = LoopError("", *np.exp(parameters), 0.0)
        return (1 - law.at(cells)) / (1 - law.at(finest_cells)) - 1 - errors

    found = minimize(lambda parameters: np.sum(residuals(parameters) ** 2), [0.0, 0.0], method="Nelder-Mead").x
    scatter = math.sqrt(np.sum(residuals(found) ** 2) / (len(cells) - len(found)))
    return LoopError(LOOP_ERRORS[variable].words, *np.exp(found).tolist(), scatter)


def areas_of(rows: Rows) -> pd.DataFrame:
    """Return patches, cells in contact and error of the area of all light loads, relative to the finest grid."""
    light = pd.DataFrame(rows["light"])
    finest = light[light["cells"] == CELLS[-1]].drop(columns=["cells", "patches"])
    light = light[light["cells"] < CELLS[-1]].merge(finest, on=["case", "adhesive", "load"], suffixes=("", "_finest"))
    nodes = light["case"].map(lambda case: CASES[case].waves) * light["cells"]
    error = light["area"] / light["area_finest"] - 1
    return pd.DataFrame({"patches": light["patches"], "contact_cells": light["area"] * nodes**2, "error": error})


def fit_areas(areas: pd.DataFrame) -> AreaError:
    """Fit the standard deviation of the error of areas by the largest likelihood of normal errors."""

    def unlikely(parameters):
        deviation = (math.exp(parameters[0]) / areas["contact_cells"]) ** math.exp(parameters[1])
        return np.sum(np.log(deviation) + (areas["error"] / deviation) ** 2 / 2)

    return AreaError(*np.exp(minimize(unlikely, [0.0, 0.0], method="Nelder-Mead").x).tolist())


def _loops(rows):
    """Table of all loops: pull-off and loss relative to the finest grid of each case."""
    loops, lines = loops_of(rows), []
    work = {row["case"]: row["work"] for row in rows["turn"]}
    known = {run.case: run.loss > _LOSS_ERROR * work[run.case] for run in loops[loops["is_finest"]].itertuples()}
    for run in loops.itertuples():
        case, loss = CASES[run.case], percent(run.loss_error, 0) if known[run.case] else "not known"
        errors = ["", ""] if run.is_finest else [percent(run.pull_off_error, 0), loss]
        numbers = [f"{case.hurst:g}", f"{case.waves}, {case.rolls}", f"{case.ratio:g}"]
        lines.append([*numbers, str(run.cells), f"{run.length:.2f}", *errors])
    head = ["H", "shortest waves, roll-off waves", "U_full/Δγ", "cells per shortest wave", "cells in l", "pull-off, %"]
    return Table([*head, "loss, %"], lines, numbers=True)


def _law(rows):
    """Table of the error of pull-off and loss by cells in the length l, for cases in the fit, with the laws."""
    laws, loops, lines = {variable: fit_loops(rows, variable) for variable in _NAMES}, _in_fit(rows), []
    for low, high in pairwise(_CLASSES):
        members = loops[(loops["length"] >= low) & (loops["length"] < high)]
        cells = [f"{low:g} to {high:g}", str(len(members))]
        for variable, name in _NAMES.items():
            errors = members[f"{name}_error"]
            ends = [percent(end, 0) for end in (errors.min(), errors.max())] if len(errors) else []
            cells += [" to ".join(ends), percent(-laws[variable].at(math.sqrt(low * high)), 0)]
        lines.append(cells)
    return Table(["cells in l", "loops", "pull-off, %", "law", "loss, %", "law"], lines, numbers=True)


# Classes of cells in the length l, of cells in contact, and of numbers of patches.
_CLASSES = (0.6, 1.0, 1.4, 2.0, 2.8, 4.0, 6.0)
_CONTACT_CELLS, _PATCHES = (0, 32, 64, 128, 256, 512, 10**9), (1, 3, 13, 10**9)


def _areas(rows):
    """Table of the error of areas by cells in contact and number of patches."""
    areas, lines = areas_of(rows), []
    law = fit_areas(areas)
    for (low, high), (few, many) in product(*map(pairwise, (_CONTACT_CELLS, _PATCHES))):
        cells, patches = areas["contact_cells"], areas["patches"]
        members = areas[(cells >= low) & (cells < high) & (patches >= few) & (patches < many)]
        if not len(members):
            continue
        patches, cells, error = (members[name] for name in ("patches", "contact_cells", "error"))
        contact = f"{low} to {high}" if high < 10**9 else f"over {low}"
        count = f"{few} to {many - 1}" if many < 10**9 else f"over {few - 1}"
        numbers = [f"{np.mean(cells / patches):.0f}", str(len(members)), percent(error.mean(), 1)]
        rms = 100 * math.sqrt(np.mean(error**2))
        span = f"{percent(error.min(), 1)} to {percent(error.max(), 1)}"
        lines.append([contact, count, *numbers, f"{rms:.1f}", f"{100 * law.at(cells.mean()):.1f}", span])
    head = ["cells in contact", "patches", "cells per patch", "states", "mean, %", "rms, %", "law, %", "range, %"]
    return Table(head, lines, numbers=True)


def tables(rows: Rows) -> dict[str, Table]:
    """Return all tables from the saved rows."""
    return {"loop_grid_loops": _loops(rows), "loop_grid_law": _law(rows), "loop_grid_areas": _areas(rows)}


read_measurements = partial(read_rows, "loop_grid", PARTS)

if __name__ == "__main__":
    measure_page("loop_grid", PARTS, tables, __doc__)
    print(
        *(fit_loops(read_measurements(), name) for name in _NAMES), fit_areas(areas_of(read_measurements())), sep="\n"
    )
