"""Compare boundary elements in the limit of short range with everything known: tables of docs/short_range.md.

    python -m validation.short_range [--parts PART ...] [--tables]

Each part is one kind of contact (`validation.single_contacts`, `validation.rough_contacts`). Measurements are saved in
validation/results/short_range, and the tables are written from them; with `--tables` nothing is measured.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from validation import rough_contacts as rough
from validation import single_contacts as single
from validation.rough_contacts import HARD, SOFT
from validation.tables import Table, by, percent, write_tables

RESULTS = Path(__file__).resolve().parent / "results/short_range"
_OFFSETS = tuple(single.offsets(5))
# Ranges (m), and refinements of the grid that resolve them, for dgamma/E* = 20 nm and waves from 6.25 um on.
_RANGES = ((400e-9, 1), (283e-9, 2), (200e-9, 2), (141e-9, 4), (100e-9, 8))


def _all(solve: Callable, *lists: Iterable):
    """Yield the rows of all combinations of the arguments."""
    for arguments in itertools.product(*lists):
        rows = solve(*arguments)
        yield from [rows] if isinstance(rows, dict) else rows


def _loops():
    for material, step in itertools.product((HARD, SOFT), (0.2, 0.1)):
        yield rough.loop(rough.rough(128), 1e-2, step, material) | {"adhesion": material is SOFT}


def _tamaas(grid, seed):
    return rough.without_adhesion(rough.rough(grid, grid // 8, seed=seed), (1e-3, 1e-2, 5e-2, 0.146, 0.35, 0.73, 1.0))


def _punch(square, grid_and_cells):
    return single.flat_punch(*grid_and_cells, square)


PARTS: dict[str, Callable] = {
    "sphere": lambda: _all(single.sphere_loop, (40, 64, 100, 140), _OFFSETS),
    "load": lambda: _all(single.sphere_under_load, (40, 64, 100), _OFFSETS[:3]),
    "pull_off": lambda: _all(single.sphere_pull_off, (40, 64, 100), _OFFSETS[:3]),
    "jump_in": lambda: _all(single.sphere_jump_in, (40, 64, 100), (0.2, 0.5)),
    "ellipse": lambda: _all(single.ellipse, (48, 64, 100, 160), (0.0, 20.0, 45.0)),
    "punches": lambda: _all(_punch, (False, True), ((64, 8), (96, 12), (128, 16))),
    "strips": lambda: _all(single.row_of_strips, (64, 96), (0.2,)),
    "sinusoid": lambda: _all(single.sinusoid, (32, 64, 128), (0.1, 0.3)),
    "crack": lambda: _all(single.crack, (48, 64, 96, 128)),
    "pair": lambda: _all(single.pair, (96, 128)),
    "tamaas": lambda: _all(_tamaas, (128, 256), (1, 2)),
    "ranges": lambda: rough.towards_short_range(rough.rough(128, 8, 16), (2.0, 1.5), _RANGES, 0.5),
    "loops": _loops,
    "cells": lambda: rough.by_cells_per_wave(16, (4, 8, 16, 32), (2.4, 2.0, 1.6)),
    "symmetry": lambda: rough.symmetries(rough.rough(128), 2.0),
    "steps": lambda: rough.by_steps(rough.rough(128), 1.8, (5, 50)),
}


# --- errors -------------------------------------------------------------------------------------------------------


def _worst(rows: Iterable[dict], *names: str) -> float:
    """Return the largest error of these names."""
    return max(abs(row[name]) for row in rows for name in names)


def _within(rows: Iterable[dict], low: float, high: float) -> list[dict]:
    """Return the rows with a contact radius from `low` to less than `high` cells."""
    return [row for row in rows if low <= row["cells"] < high]


def bounds(rows: dict[str, list[dict]]) -> Table:
    """Table of all targets with the measured errors."""
    lines = []

    def add(what, error, bound, share=""):
        verdict = "met" if error <= bound else "**missed**"
        lines.append([what, f"{100 * error:.3g} %", share, f"{100 * bound:.3g} %", verdict])

    targets = (
        ("area at given approach", "sphere", "area_error"),
        ("force at given approach", "sphere", "force_error"),
        ("area under given load", "load", "area_error"),
        ("approach under given load", "load", "approach_error"),
        ("pull-off", "pull_off", "pull_off_error"),
    )
    for low, high, bound in ((4, 8, 0.025), (8, math.inf, 0.01)):
        cells = f"{low} to {high} cells" if math.isfinite(high) else f"{low} cells and more"
        for symmetric, place in ((False, "elsewhere in a cell"), (True, "with the symmetry of the grid")):
            for what, part, name in targets:
                rows_at_place = [
                    row
                    for row in _within(rows[part], low, high)
                    if all(shift in (0.0, 0.5) for shift in row["offset"]) == symmetric
                ]
                share = sum(abs(row[name]) <= bound for row in rows_at_place) / len(rows_at_place)
                add(
                    f"sphere of {cells}, centre {place}: {what}",
                    _worst(rows_at_place, name),
                    bound,
                    f"{100 * share:.0f} %",
                )
    add("turned elliptic paraboloids, short axis of 8 cells and more", _turned_error(rows["ellipse"]), 0.01)
    add("without adhesion, mean gap against Tamaas", _worst(rows["tamaas"], "separation_error"), 1e-4)
    add("without adhesion, gap everywhere (rms, over h_rms)", _worst(rows["tamaas"], "gap_error"), 1e-3)
    add("without adhesion, area against Tamaas", _worst(rows["tamaas"], "area_error"), 1e-4)
    hard, soft = ([row for row in rows["loops"] if row["adhesion"] == adhesion] for adhesion in (False, True))
    lost = max(abs(row["work"]) / row["largest_work"] for row in hard)
    add("closed loop without adhesion, work over the most work", lost, 1e-4)
    coarse, fine = soft
    add("closed loop with adhesion, work at half the step", abs(coarse["work"] / fine["work"] - 1), 0.01)
    errors = ("pressure_error", "area_error")
    add("shifted, reflected, turned by 90°: load and area", _worst(rows["symmetry"], *errors), 1e-4)
    add("5 against 50 steps to one stop: load and area", _worst(rows["steps"], *errors), 1e-4)
    return Table(["what", "largest error", "states within the target", "target", ""], lines)


def by_radius(rows: list[dict], names: dict[str, str]) -> Table:
    """Table of the mean and range of errors in classes of the contact radius."""

    def spread(members, name):
        values = np.array([row[name] for row in members])
        return f"{percent(values.mean())} ({percent(values.min())} to {percent(values.max())})"

    lines = []
    for low, high in ((4, 8), (8, 12), (12, 20), (20, math.inf)):
        if members := _within(rows, low, high):
            label = f"{low} to {high}" if math.isfinite(high) else f"over {low}"
            lines.append([label, str(len(members)), *(spread(members, name) for name in names)])
    return Table(["cells in the radius", "states", *names.values()], lines)


def convergence(rows: list[dict]) -> Table:
    """Table of the order of convergence of the rms error over offsets and approaches with the spacing."""
    grids = sorted({row["grid"] for row in rows})
    lines = []
    for name, what in (("area_error", "area"), ("force_error", "force")):
        errors = [math.sqrt(np.mean([row[name] ** 2 for row in rows if row["grid"] == grid])) for grid in grids]
        slope = -np.polyfit(np.log(grids), np.log(errors), 1)[0]
        lines.append([what, f"{slope:.1f}", *(f"{100 * error:.2f} %" for error in errors)])
    return Table(["", "order", *(f"{grid}²" for grid in grids)], lines)


# --- tables of some parts -----------------------------------------------------------------------------------------


def turned(rows: list[dict]) -> Table:
    """Table of areas, forces and pull-off of elliptic paraboloids, relative to the mean of the finest grid."""
    approaches = sorted({row["approach"] for row in rows}, reverse=True)
    lines = []
    for grid, angle in sorted({(row["grid"], row["angle"]) for row in rows}):
        by_approach = {row["approach"]: row for row in rows if (row["grid"], row["angle"]) == (grid, angle)}
        cells = [
            " / ".join(percent(_over_finest(rows, by_approach[approach], name)) for name in ("area", "force"))
            for approach in approaches
        ]
        cells.append(percent(_over_finest(rows, by_approach[approaches[-1]], "pull_off")))
        lines.append([f"{grid}²", f"{angle:g}°", *cells])
    head = [f"approach {approach:g}: area / force" for approach in approaches]
    return Table(["grid", "angle", *head, "pull-off"], lines)


def _over_finest(rows, row, name):
    finest = max(other["grid"] for other in rows)
    wanted = np.mean([r[name] for r in rows if r["grid"] == finest and r["approach"] == row["approach"]])
    # Forces change sign, so their error is over the pull-off force if that is larger.
    unit = max(abs(wanted), row["pull_off"]) if name == "force" else wanted
    return float((row[name] - wanted) / unit)


def _turned_error(rows):
    """Return the largest error of area and force of paraboloids whose short axis has at least 8 cells."""
    finest = max(row["grid"] for row in rows)
    resolved = [
        row for row in rows if row["grid"] < finest and math.sqrt(row["area"] / math.pi) / row["spacing"] / 2**0.25 >= 8
    ]
    return max(abs(_over_finest(rows, row, name)) for row in resolved for name in ("area", "force"))


def by_grid(rows: list[dict]) -> Table:
    """Table of areas and loads of one rough surface on several grids, relative to the finest."""
    finest = {row["separation"]: row for row in rows if row["cells"] == max(other["cells"] for other in rows)}
    lines = []
    for row in sorted(rows, key=lambda row: (-row["separation"], row["cells"])):
        best = finest[row["separation"]]
        errors = [percent(row[name] / best[name] - 1) for name in ("reduced_pressure", "area")]
        numbers = [f"{row['reduced_pressure']:.3e}", f"{row['area']:.3e}", str(row["patches"])]
        lines.append([f"{row['separation']:g}", str(row["cells"]), f"{row['grid']}²", *numbers, *errors])
    head = ["u/h_rms", "cells in the shortest wave", "grid", "p\\*", "A/A0", "patches"]
    return Table([*head, "load over the finest", "area over the finest"], lines)


def towards_zero(rows: list[dict]) -> Table:
    """Table of load and areas at falling ranges, their linear extrapolation to zero, and the limit."""
    names = {"pressure": "p\\*", "zero_gap_area": "area of zero gap", "energetic_area": "energetic area"}
    lines = []
    for separation in sorted({row["separation"] for row in rows}, reverse=True):
        *finite, limit = sorted((r for r in rows if r["separation"] == separation), key=lambda row: -row["range"])
        before, last = finite[-2:]
        weight = last["range"] / (before["range"] - last["range"])
        at_zero = {name: last[name] + weight * (last[name] - before[name]) for name in names}
        labelled = [(f"{1e9 * row['range']:.0f} nm", f"{row['grid']}²", row) for row in finite]
        for label, grid, row in (*labelled, ("→ 0", "", at_zero), ("limit", f"{limit['grid']}²", limit)):
            lines.append([f"{separation:g}", label, grid, *(f"{row[name]:.4g}" for name in names)])
    return Table(["u/h_rms", "range", "grid", *names.values()], lines)


_SAME = {"pressure_error": ("load", ".2g"), "area_error": ("area", ".2g")}
_SAME |= {"fraction_error": ("largest difference of a cell", ".2g")}
_JUMP_IN = {"approach": ("approach", ".6g"), "approach_exact": ("Wu", ".6g")}
_JUMP_IN |= {"spots_before": ("spots before", "g"), "spots_after": ("after", "g")}
_WAVE = {"alpha": ("α", "g"), "grid": ("grid", "g"), "psi": ("ψ", "g")}
_WAVE |= {"cells": ("half-width in cells", ".3g"), "width_error": ("width", "%"), "pressure": ("p/p\\*", ".4g")}
_WAVE |= {"pressure_exact": ("exact", ".4g"), "pressure_error": ("pressure", "%"), "energy_error": ("energy", "%")}
_LOOP = {"with": ("adhesion", "s"), "step": ("longest step/h_rms", "g"), "steps": ("equilibria", "g")}
_LOOP |= {"largest_work": ("largest work", ".4g"), "work": ("work of the loop", ".2e"), "jump_in": ("jumps in", ".2e")}
_LOOP |= {"jump_off": ("jumps off", ".2e"), "coalescence": ("merging and splitting", ".2e")}
_LOOP |= {"unattributed": ("no event", ".2e"), "not_closed": ("imbalance", ".2e")}
_GRID = {"grid": ("grid", "g")}
_ERRORS = {"area_error": ("area", "%"), "force_error": ("force", "%")}
_CELLS = "cells in the radius"

# Tables with a line for every row of a part: the part, and its columns.
_BY_ROW = {
    "jump_off": ("pull_off", _GRID | {"jump_off_cells": (_CELLS, "g"), "jump_off_approach": ("approach", ".4g")}),
    "jump_in": ("jump_in", _GRID | {"range": ("range", "g")} | _JUMP_IN | _ERRORS),
    "punches": (
        "punches",
        {"square": ("square (1) or round (0)", "g"), "cells": ("radius in cells", "g"), "pull_off": ("pull-off", ".4g")}
        | {"pull_off_of_nodes": ("pull-off by nodes", ".4g"), "compliance": ("compliance", ".4g")},
    ),
    "strips": (
        "strips",
        _GRID
        | {"cells": ("half-width in cells", "g"), "pull_off_error": ("pull-off", "%")}
        | {"compliance_error": ("compliance", "%")},
    ),
    "wave": ("sinusoid", _WAVE),
    "crack": (
        "crack",
        _GRID
        | {"radius": ("c/L", "g"), "cells": ("radius in cells", ".3g"), "radius_error": ("radius", "%")}
        | {"pressure_error": ("pressure", "%")},
    ),
    "pair": (
        "pair",
        _GRID | {"approach": ("approach", "g"), "spots": ("patches", "g"), "asymmetry": ("asymmetry", ".2g")} | _ERRORS,
    ),
    "loops": ("loops", _LOOP),
}


def tables(rows: dict[str, list[dict]]) -> dict[str, Table]:
    """Return all tables of the page from the rows of all parts."""
    for row in rows["loops"]:
        row["with"] = "with" if row["adhesion"] else "without"
    in_fewer_steps = [row | {"what": f"in {row['steps']} instead of 50 steps"} for row in rows["steps"][1:]]
    found = {
        "bounds": bounds(rows),
        "sphere": by_radius(rows["sphere"], {"area_error": "area", "force_error": "force"}),
        "convergence": convergence(rows["sphere"]),
        "load": by_radius(rows["load"], {"area_error": "area", "approach_error": "approach"}),
        "pull_off": by_radius(rows["pull_off"], {"pull_off_error": "pull-off force"}),
        "ellipse": turned(rows["ellipse"]),
        "ranges": towards_zero(rows["ranges"]),
        "cells": by_grid(rows["cells"]),
        "symmetry": by([*rows["symmetry"], *in_fewer_steps], {"what": ("the same state", "s")} | _SAME),
        **{name: by(rows[part], columns) for name, (part, columns) in _BY_ROW.items()},
    }
    return {f"short_range_{name}": table for name, table in found.items()}


def read_measurements() -> dict[str, list[dict]]:
    """Read the rows of all parts."""
    return {part: json.loads((RESULTS / f"{part}.json").read_text(encoding="utf-8"))["rows"] for part in PARTS}


def main() -> None:
    """Measure parts, save their numbers, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS, metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--tables", action="store_true", help="write the tables from saved measurements")
    options = parser.parse_args()
    for part in () if options.tables else options.parts:
        print(f"{part} ...", end=" ", flush=True)
        clock = time.perf_counter()
        with threadpool_limits(1):
            rows = list(PARTS[part]())
        found = {"seconds": round(time.perf_counter() - clock, 1), "rows": rows}
        (RESULTS / f"{part}.json").write_text(
            json.dumps(found, indent=1, default=lambda number: number.item()) + "\n", encoding="utf-8"
        )
        print(f"{len(rows)} rows in {found['seconds']:.0f} s", flush=True)
    write_tables(tables(read_measurements()))


if __name__ == "__main__":
    main()
