"""Compare single indenters on a free half-space or a layer with everything known: tables of docs/indenter.md.

    python -m validation.indenter [--parts PART ...] [--tables]

Each part is one kind of contact (`validation.indenter_contacts`, `validation.rough_indenters`). Measurements are saved
in validation/results/indenter, and the tables are written from them; with `--tables` nothing is measured. The part
`without_adhesion` needs ContactMechanics: make .venv-benchmarks/.installed
"""

from __future__ import annotations

from functools import partial
from itertools import product

from validation import indenter_contacts as single
from validation import rough_indenters as rough
from validation.measurements import Parts, Rows, measure_page, read_rows
from validation.tables import Table, by, by_radius, worst

# Cell sizes and grids: the contact of zero load has a radius of 6 to 20 cells.
_GRIDS = ((1 / 4, 64), (1 / 6, 96), (1 / 9, 128))

PARTS: Parts = {
    "hertz": (single.hertz, [*product((4, 8, 12, 20), single.PLACES)]),
    "sphere": (
        single.sphere,
        [(*grid, *others, 4.0) for grid, *others in product(_GRIDS, single.PLACES, ("separation", "load"))],
    ),
    "pull_off": (single.sphere_pull_off, [(*grid, place) for grid, place in product(_GRIDS, single.PLACES)]),
    "punch": (single.punch, [(cells, square) for square, cells in product((False, True), (8, 12, 16))]),
    "cone": (single.cone, [(1 / 2,), (1 / 4, 144)]),
    "without_adhesion": (rough.without_adhesion, [("sphere",), ("rough square",), ("layer",)]),
    "layer_limits": (rough.layer_limits, [()]),
    "convergence": (rough.rough_loop, [(64,), (128,), (256,)]),
    "smooth_loop": (rough.smooth_loop, [()]),
    "front": (
        single.pinned_front,
        [(cells, *others) for others, cells in product(((2, 0), (4, 0), (8, 0), (2, 3.0)), (16, 32, 48))],
    ),
}


# --- tables -------------------------------------------------------------------------------------------------------


def bounds(rows: Rows) -> Table:
    """Table of all targets with the measured errors."""
    lines = []

    def add(what, error, bound, form="{:.3g} %"):
        factor = 100 if "%" in form else 1
        verdict = "met" if error <= bound else "**missed**"
        lines.append([what, form.format(factor * error), form.format(factor * bound), verdict])

    for places, where in ((single.PLACES[::3], "at general positions"), (single.PLACES[1:3], "on and between nodes")):
        for least in (8, 12):
            what = f"JKR sphere, {least} cells and more, apex {where}"
            fine, off = (
                [row for row in rows[part] if row["cells"] >= least and tuple(row["place"]) in places]
                for part in ("sphere", "pull_off")
            )
            given = [row for row in fine if row["control"] == "separation"]
            add(f"{what}: force at the radius", worst(fine, "force_error"), 0.01)
            add(f"{what}: force at the indentation", worst(given, "given_error"), 0.01)
            add(f"{what}: pull-off", worst(off, "pull_off_error"), 0.005)
    errors = ("area_error", "gap_error", "force_error")
    add("ContactMechanics: area, gap and force", worst(rows["without_adhesion"], *errors), 1e-4, "{:.1g}")
    layers = [row for row in rows["without_adhesion"] if row["kind"] == "layer"]
    add("ContactMechanics: compliance of layers", worst(layers, "kernel_error"), 1e-10, "{:.1g}")
    *coarse, finest = rows["convergence"]
    for row in coarse[1:]:
        error = abs(row["pull_off"] / finest["pull_off"] - 1)
        add(f"rough sphere: pull-off with {row['grid']}² instead of {finest['grid']}² cells", error, 0.02)
    add("time of a cycle, smooth sphere, 96² cells", rows["smooth_loop"][0]["seconds"], 6, "{:.3g} s")
    add(f"time of a cycle, rough sphere, {finest['grid']}² cells", finest["seconds"], 120, "{:.3g} s")
    return Table(["what", "largest error, or time", "target", ""], lines)


def cost(rows: Rows) -> Table:
    """Table of the computing times of cycles of single indenters, for the page of the benchmarks."""
    cycles = [
        (f"{what} sphere", row)
        for what, part in (("smooth", "smooth_loop"), ("rough", "convergence"))
        for row in rows[part]
    ]
    lines = [[what, f"{row['grid']}²", str(row["steps"]), f"{row['seconds']:.1f} s"] for what, row in cycles]
    return Table(["indenter", "grid", "equilibria", "processor"], lines, numbers=True)


# Tables with a line for every row of a part.
_BY_ROW = {
    "without_adhesion": """kind: contact s; thickness: thickness .2g; poisson: ν .2g; area: A/A0 .3f;
        area_error: area .1g; force_error: force .1g; gap_error: gap .1g; kernel_error: compliance .2g""",
    "punch": """square: square (1) or round (0) g; cells: radius in cells g; stiffness: stiffness .4g;
        stiffness_of_nodes: stiffness by nodes .4g; pull_off: pull-off .4g;
        pull_off_of_nodes: pull-off by nodes .4g""",
    "cone": "adhesion: adhesion s; cells: cells in the radius .3g; force_error: force %; approach_error: indentation %",
    "layer_limits": """limit: limit s; thickness: thickness over √(Rδ) .3g; cells: in cells .3g;
        area_over: A/(πRδ) .3f; force_error: force %""",
    "convergence": """grid: grid g; wave_cells: cells in the shortest wave g; steps: equilibria g;
        pull_off: pull-off .4f; loss: loss .3f; largest_area: largest area .3f; seconds: time in s .1f""",
    "front": """work: work of adhesion s; waves: waves of the front g; cells: cells in the radius g;
        shift: shift in cells .3f; error: error of the shift %""",
}
_by_radius = partial(
    by_radius, edges=(4, 8, 12), places={"general": single.PLACES[::3], "node, middle": single.PLACES[1:3]}
)


def tables(rows: Rows) -> dict[str, Table]:
    """Return all tables of the page from the rows of all parts."""
    by_control = {how: [row for row in rows["sphere"] if row["control"] == how] for how in ("separation", "load")}
    at_radius = {"force_error": "force at the radius", "approach_error": "indentation at the radius"}
    given = {"separation": "force at the indentation", "load": "indentation at the force"}
    found = {
        "bounds": bounds(rows),
        "hertz": _by_radius(rows["hertz"], {"area_error": "area", "force_error": "force", "gap_error": "gap"}),
        **{how: _by_radius(by_control[how], at_radius | {"given_error": given[how]}) for how in given},
        "pull_off": _by_radius(rows["pull_off"], {"pull_off_error": "pull-off", "jump_off_error": "jump-off"}),
        **{name: by(rows[name], columns) for name, columns in _BY_ROW.items()},
    }
    return {f"indenter_{name}": table for name, table in found.items()} | {"benchmarks_indenter": cost(rows)}


read_measurements = partial(read_rows, "indenter", PARTS)

if __name__ == "__main__":
    measure_page("indenter", PARTS, tables, __doc__)
