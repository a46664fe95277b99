"""Compare boundary elements in the limit of short range with everything known: tables of docs/short_range.md.

    python -m validation.short_range [--parts PART ...] [--tables]

Each part is one kind of contact (`validation.single_contacts`, `validation.rough_contacts`). Measurements are saved in
validation/results/short_range, and the tables are written from them; with `--tables` nothing is measured.
"""

from __future__ import annotations

import math
from functools import partial
from itertools import product

import numpy as np
import pandas as pd

from validation import rough_contacts as rough
from validation import single_contacts as single
from validation.measurements import Parts, Rows, measure_page, read_rows
from validation.rough_contacts import HARD, SOFT
from validation.tables import Table, by, by_radius, percent, worst

_OFFSETS = tuple(single.offsets(5))
_ROUGH = rough.rough(128)
# Reduced pressures of the comparison with Tamaas.
_LOADS = (1e-3, 1e-2, 5e-2, 0.146, 0.35, 0.73, 1.0)
# Ranges (m), and refinements of the grid that resolve them, for dgamma/E* = 20 nm and waves from 6.25 um on.
_RANGES = ((400e-9, 1), (283e-9, 2), (200e-9, 2), (141e-9, 4), (100e-9, 8))


PARTS: Parts = {
    "sphere": (single.sphere_loop, [*product((40, 64, 100, 140), _OFFSETS)]),
    "load": (single.sphere_under_load, [*product((40, 64, 100), _OFFSETS[:3])]),
    "pull_off": (single.sphere_pull_off, [*product((40, 64, 100), _OFFSETS[:3])]),
    "jump_in": (single.sphere_jump_in, [*product((40, 64, 100), (0.2, 0.5))]),
    "ellipse": (single.ellipse, [*product((48, 64, 100, 160), (0.0, 20.0, 45.0))]),
    "punches": (
        single.flat_punch,
        [(*size, square) for square in (False, True) for size in ((64, 8), (96, 12), (128, 16))],
    ),
    "sinusoid": (single.sinusoid, [*product((32, 64, 128), (0.1, 0.3))]),
    "crack": (single.crack, [(48,), (64,), (96,), (128,)]),
    "pair": (single.pair, [(96,), (128,)]),
    "tamaas": (
        rough.without_adhesion,
        [(rough.rough(grid, grid // 8, seed=seed), _LOADS) for grid, seed in product((128, 256), (1, 2))],
    ),
    "ranges": (rough.towards_short_range, [(rough.rough(128, 8, 16), (2.0, 1.5), _RANGES, 0.5)]),
    "loops": (rough.loop, [(_ROUGH, 1e-2, step, material) for material, step in product((HARD, SOFT), (0.2, 0.1))]),
    "cells": (rough.by_cells_per_wave, [(16, (4, 8, 16, 32), (2.4, 2.0, 1.6))]),
    "symmetry": (rough.symmetries, [(_ROUGH, 2.0)]),
    "steps": (rough.by_steps, [(_ROUGH, 1.8, (5, 50))]),
}


# --- errors -------------------------------------------------------------------------------------------------------


def bounds(rows: Rows) -> Table:
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
    ranges = (("4 to 8 cells", 4, 8, 0.025), ("8 cells and more", 8, math.inf, 0.01))
    places = (("elsewhere in a cell", False), ("with the symmetry of the grid", True))
    for (cells, low, high, bound), (place, symmetric), (what, part, name) in product(ranges, places, targets):
        members = [row for row in rows[part] if low <= row["cells"] < high]
        members = [row for row in members if (set(row["offset"]) <= {0.0, 0.5}) == symmetric]
        share = f"{100 * sum(abs(row[name]) <= bound for row in members) / len(members):.0f} %"
        add(f"sphere of {cells}, centre {place}: {what}", worst(members, name), bound, share)
    add("turned elliptic paraboloids, short axis of 8 cells and more", _turned_error(rows["ellipse"]), 0.01)
    add("without adhesion, mean gap against Tamaas", worst(rows["tamaas"], "separation_error"), 1e-4)
    add("without adhesion, gap everywhere (rms, over h_rms)", worst(rows["tamaas"], "gap_error"), 1e-3)
    add("without adhesion, area against Tamaas", worst(rows["tamaas"], "area_error"), 1e-4)
    hard, soft = ([row for row in rows["loops"] if row["adhesion"] == adhesion] for adhesion in (False, True))
    lost = max(abs(row["work"]) / row["largest_work"] for row in hard)
    add("closed loop without adhesion, work over the most work", lost, 1e-4)
    coarse, fine = soft
    add("closed loop with adhesion, work at half the step", abs(coarse["work"] / fine["work"] - 1), 0.01)
    errors = ("pressure_error", "area_error")
    add("shifted, reflected, turned by 90°: load and area", worst(rows["symmetry"], *errors), 1e-4)
    add("5 against 50 steps to one stop: load and area", worst(rows["steps"], *errors), 1e-4)
    return Table(["what", "largest error", "states within the target", "target", ""], lines)


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
    errors, lines = _over_finest(rows).sort_values("approach", ascending=False), []
    for (grid, angle), group in errors.groupby(["grid", "angle"]):
        pairs = zip(group["area_error"], group["force_error"], strict=True)
        cells = [" / ".join(map(percent, pair)) for pair in pairs]
        lines.append([f"{grid}²", f"{angle:g}°", *cells, percent(group["pull_off_error"].iloc[-1])])
    head = [f"approach {approach:g}: area / force" for approach in errors["approach"].unique()]
    return Table(["grid", "angle", *head, "pull-off"], lines)


def _over_finest(rows):
    """Return the rows with errors of area, force and pull-off, relative to the mean of the finest grid."""
    rows, names = pd.DataFrame(rows), ["area", "force", "pull_off"]
    means = rows[rows["grid"] == rows["grid"].max()].groupby("approach")[names].mean()
    wanted = means.loc[rows["approach"]].set_axis(rows.index)
    # Forces change sign, so their error is over the pull-off force if that is larger.
    unit = wanted.assign(force=np.maximum(wanted["force"].abs(), rows["pull_off"]))
    return rows.join(((rows[names] - wanted) / unit).add_suffix("_error"))


def _turned_error(rows):
    """Return the largest error of area and force of paraboloids whose short axis has at least 8 cells."""
    errors = _over_finest(rows)
    cells = np.sqrt(errors["area"] / math.pi) / errors["spacing"] / 2**0.25
    resolved = errors[(errors["grid"] < errors["grid"].max()) & (cells >= 8)]
    return resolved[["area_error", "force_error"]].abs().to_numpy().max()


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
    names = {"reduced_pressure": "p\\*", "area": "area of zero gap", "energetic_area": "energetic area"}
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


# Tables with a line for every row of a part: by name, and by part if it has another name.
_BY_ROW = {
    "jump_off pull_off": "grid: grid g; jump_off_cells: cells in the radius g; jump_off_approach: approach .4g",
    "jump_in": """grid: grid g; range: range g; approach: approach .6g; approach_exact: Wu .6g;
        spots_before: spots before g; spots_after: after g; area_error: area %; force_error: force %""",
    "punches": """square: square (1) or round (0) g; cells: radius in cells g; pull_off: pull-off .4g;
        pull_off_of_nodes: pull-off by nodes .4g; compliance: compliance .4g""",
    "wave sinusoid": """alpha: α g; grid: grid g; psi: ψ g; cells: half-width in cells .3g; width_error: width %;
        pressure: p/p\\* .4g; pressure_exact: exact .4g; pressure_error: pressure %; energy_error: energy %""",
    "crack": """grid: grid g; radius: c/L g; cells: radius in cells .3g; radius_error: radius %;
        pressure_error: pressure %""",
    "pair": """grid: grid g; approach: approach g; spots: patches g; asymmetry: asymmetry .2g; area_error: area %;
        force_error: force %""",
    "loops": """with: adhesion s; step: longest step/h_rms g; steps: equilibria g; largest_work: largest work .4g;
        work: work of the loop .2e; jump_in: jumps in .2e; jump_off: jumps off .2e;
        coalescence: merging and splitting .2e; unattributed: no event .2e; not_closed: imbalance .2e""",
}
_SAME = """what: the same state s; pressure_error: load .2g; area_error: area .2g;
    fraction_error: largest difference of a cell .2g"""
_EDGES = (4, 8, 12, 20)


def tables(rows: Rows) -> dict[str, Table]:
    """Return all tables of the page from the rows of all parts."""
    for row in rows["loops"]:
        row["with"] = "with" if row["adhesion"] else "without"
    in_fewer_steps = [row | {"what": f"in {row['steps']} instead of 50 steps"} for row in rows["steps"][1:]]
    found = {
        "bounds": bounds(rows),
        "sphere": by_radius(rows["sphere"], {"area_error": "area", "force_error": "force"}, _EDGES),
        "convergence": convergence(rows["sphere"]),
        "load": by_radius(rows["load"], {"area_error": "area", "approach_error": "approach"}, _EDGES),
        "pull_off": by_radius(rows["pull_off"], {"pull_off_error": "pull-off force"}, _EDGES),
        "ellipse": turned(rows["ellipse"]),
        "ranges": towards_zero(rows["ranges"]),
        "cells": by_grid(rows["cells"]),
        "symmetry": by([*rows["symmetry"], *in_fewer_steps], _SAME),
        **{name.split()[0]: by(rows[name.split()[-1]], columns) for name, columns in _BY_ROW.items()},
    }
    return {f"short_range_{name}": table for name, table in found.items()}


read_measurements = partial(read_rows, "short_range", PARTS)

if __name__ == "__main__":
    measure_page("short_range", PARTS, tables, __doc__)
