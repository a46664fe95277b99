"""Numbers of the page on boundary elements in the limit of short range, from what benchmarks/short_range.py kept."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from pages.tables import Table

# Classes of contact radius, in cells, and what is asked of spheres there.
RADII = ((4, 8, 0.025), (8, 12, 0.01), (12, 20, 0.01), (20, math.inf, 0.01))


class Bound(NamedTuple):
    """What is asked of the solver, the largest error that was measured, the bound, and the part of states within it."""

    what: str
    measured: float
    bound: float
    share: float = math.nan

    @property
    def met(self) -> bool:
        """Whether it holds."""
        return self.measured <= self.bound


def percent(value: float, digits: int = 2) -> str:
    """A relative error in per cent."""
    text = f"{100 * value:+.{digits}f}"
    return text.replace("-", "+") if float(text) == 0 else text


def largest(rows: Iterable[dict], *names: str) -> float:
    """Largest error of these names; not a number without any."""
    values = [abs(row[name]) for row in rows for name in names if name in row]
    return max(values, default=math.nan)


def share_within(rows: list[dict], name: str, bound: float) -> float:
    """Part of the rows whose error is within a bound."""
    return sum(abs(row[name]) <= bound for row in rows) / len(rows) if rows else math.nan


def is_symmetric(row: dict) -> bool:
    """Whether the centre of a contact is a node or in the middle between four."""
    return all(shift in (0.0, 0.5) for shift in row["offset"])


def within(rows: Iterable[dict], low: float, high: float, name: str = "cells") -> list[dict]:
    """Rows whose contact has from `low` to less than `high` cells."""
    return [row for row in rows if low <= row[name] < high]


def spread(rows: list[dict], name: str) -> str:
    """Mean, and least to largest, of an error in per cent."""
    values = np.array([row[name] for row in rows if name in row])
    if not len(values):
        return "–"
    return f"{percent(values.mean())} ({percent(values.min())} to {percent(values.max())})"


def by_radius(rows: list[dict], names: dict[str, str]) -> Table:
    """Errors in classes of the contact radius."""
    lines = []
    for low, high, _ in RADII:
        own = within(rows, low, high)
        if own:
            label = f"{low} to {high}" if math.isfinite(high) else f"over {low}"
            lines.append([label, str(len(own)), *(spread(own, name) for name in names)])
    return Table(["cells in the radius", "states", *names.values()], lines)


def by(rows: list[dict], keys: dict[str, str], columns: dict[str, str | tuple[str, Callable]]) -> Table:
    """A line for every row: what it is, and its numbers; errors in per cent unless a column says how to write it."""

    def written(row, name, column):
        value = row.get(name)
        if value is None:
            return "–"
        return column[1](value) if isinstance(column, tuple) else percent(value)

    def key(value):
        return f"{value:g}" if isinstance(value, float | int) else str(value)

    lines = [
        [*(key(row[name]) for name in keys), *(written(row, name, column) for name, column in columns.items())]
        for row in rows
    ]
    heads = [column[0] if isinstance(column, tuple) else column for column in columns.values()]
    return Table([*keys.values(), *heads], lines)


def number(digits: int) -> Callable[[float], str]:
    """How to write a number with so many significant digits."""
    return lambda value: f"{value:.{digits}g}"


def order(rows: list[dict], name: str) -> str:
    """Order of convergence: slope of the root mean square of an error over offsets and approaches, with the spacing."""
    grids = sorted({row["grid"] for row in rows})
    errors = [math.sqrt(np.mean([row[name] ** 2 for row in rows if row["grid"] == grid])) for grid in grids]
    slope = -np.polyfit(np.log(grids), np.log(errors), 1)[0]
    each = ", ".join(f"{100 * error:.2f} % at {grid}²" for grid, error in zip(grids, errors, strict=True))
    return f"{slope:.1f} ({each})"


def hysteresis(rows: list[dict]) -> float:
    """Largest difference between the areas on the way off and on at the same approach."""
    found = {}
    for row in rows:
        found.setdefault((row["grid"], tuple(row["offset"]), row["approach"]), []).append(row["area_error"])
    return max((max(each) - min(each) for each in found.values()), default=math.nan)


def turned(rows: list[dict]) -> Table:
    """Areas, forces and pull-off of the elliptic paraboloid at every angle, over the mean of the finest grid."""
    finest = max(row["grid"] for row in rows)
    approaches = sorted({row["approach"] for row in rows}, reverse=True)
    lines = []
    for grid, angle in sorted({(row["grid"], row["angle"]) for row in rows}):
        cells = []
        for approach in approaches:
            own = next(r for r in rows if (r["grid"], r["angle"], r["approach"]) == (grid, angle, approach))
            cells.append(" / ".join(percent(_turned_error(rows, own, name, finest)) for name in ("area", "force")))
        cells.append(percent(_turned_error(rows, own, "pull_off", finest)))
        lines.append([f"{grid}²", f"{angle:g}°", *cells])
    head = [f"approach {approach:g}: area / force" for approach in approaches]
    return Table(["grid", "angle", *head, "pull-off"], lines)


def _turned_error(rows, row, name, finest):
    same = [r[name] for r in rows if r["grid"] == finest and r["approach"] == row["approach"]]
    wanted = float(np.mean(same))
    # Forces change sign: they are over the largest tension where that is more.
    unit = max(abs(wanted), row["pull_off"]) if name == "force" else wanted
    return (row[name] - wanted) / unit


def turned_errors(rows: list[dict], least_cells: float) -> float:
    """Largest error of area and force of the turned paraboloids whose short axis has at least so many cells."""
    finest = max(row["grid"] for row in rows)
    own = [
        row
        for row in rows
        if row["grid"] < finest and math.sqrt(row["area"] / math.pi) / row["spacing"] / 2**0.25 >= least_cells
    ]
    return max(
        (abs(_turned_error(rows, row, name, finest)) for row in own for name in ("area", "force")), default=math.nan
    )


def by_grid(rows: list[dict]) -> Table:
    """Areas and loads of one rough surface on finer and finer grids, over those of the finest."""
    finest = max(row["cells"] for row in rows)
    lines = []
    for separation, cells in sorted({(row["separation"], row["cells"]) for row in rows}, key=lambda e: (-e[0], e[1])):
        row, best = (
            next(r for r in rows if r["separation"] == separation and r["cells"] == count) for count in (cells, finest)
        )
        errors = [percent(row[name] / best[name] - 1) for name in ("reduced_pressure", "area")]
        numbers = [f"{row['reduced_pressure']:.3e}", f"{row['area']:.3e}", str(row["patches"])]
        lines.append([f"{separation:g}", str(cells), f"{row['grid']}²", *numbers, *errors])
    head = ["u/h_rms", "cells in the shortest wave", "grid", "p\\*", "A/A0", "patches"]
    return Table([*head, "load over the finest", "area over the finest"], lines)


def towards_zero(rows: list[dict]) -> Table:
    """Load and areas at falling ranges, what a straight line through the two shortest gives at zero, and the limit."""
    names = {"pressure": "p\\*", "zero_gap_area": "area of zero gap", "energetic_area": "energetic area"}
    lines = []
    for separation in sorted({row["separation"] for row in rows}, reverse=True):
        own = sorted((row for row in rows if row["separation"] == separation), key=lambda row: -row["range"])
        *finite, limit = own
        for row in finite:
            numbers = [f"{row[name]:.4g}" for name in names]
            lines.append([f"{separation:g}", f"{1e9 * row['range']:.0f} nm", f"{row['grid']}²", *numbers])
        lines.append([f"{separation:g}", "→ 0", "", *(f"{value:.4g}" for value in _extrapolated(finite, names))])
        lines.append([f"{separation:g}", "0 (ours)", f"{limit['grid']}²", *(f"{limit[name]:.4g}" for name in names)])
    return Table(["u/h_rms", "range", "grid", *names.values()], lines)


def _extrapolated(finite, names):
    before, last = finite[-2:]
    weight = last["range"] / (before["range"] - last["range"])
    return [last[name] + weight * (last[name] - before[name]) for name in names]


def loop_table(rows: list[dict]) -> Table:
    """Work of closed loops and where it went."""
    names = ("work", "jump_in", "jump_off", "coalescence", "unattributed", "not_closed")
    lines = []
    for row in rows:
        about = ["with" if row["adhesion"] else "without", f"{row['step']:g}", str(row["steps"])]
        lines.append([*about, f"{row['largest_work']:.4g}", *(f"{row[name]:.2e}" for name in names)])
    head = ["adhesion", "longest step/h_rms", "equilibria", "most work", "work of the loop"]
    return Table([*head, "jumps in", "jumps off", "joins and splits", "no event", "not accounted for"], lines)


def loop_change(rows: list[dict]) -> float:
    """Relative change of the work of the adhesive loop at half the step."""
    coarse, fine = sorted((row for row in rows if row["adhesion"]), key=lambda row: -row["step"])[:2]
    return abs(coarse["work"] / fine["work"] - 1)


def bounds(parts: dict[str, dict]) -> list[Bound]:
    """Everything that is asked for with a number, against what was measured."""
    rows = {name: part["rows"] for name, part in parts.items()}
    found = []
    asked = (
        ("area", "at given approach", "sphere", "area_error"),
        ("force", "at given approach", "sphere", "force_error"),
        ("area", "under given load", "load", "area_error"),
        ("approach", "under given load", "load", "approach_error"),
        ("pull-off", "", "pull_off", "pull_off_error"),
    )
    for low, high, bound in ((4, 8, 0.025), (8, math.inf, 0.01)):
        cells = f"{low} to {high} cells" if math.isfinite(high) else f"{low} cells and more"
        for symmetric in (False, True):
            place = "with the symmetry of the grid" if symmetric else "elsewhere in a cell"
            for what, control, part, name in asked:
                own = [row for row in within(rows[part], low, high) if is_symmetric(row) == symmetric]
                words = f"sphere of {cells}, centre {place}: {what} {control}".rstrip()
                found.append(Bound(words, largest(own, name), bound, share_within(own, name, bound)))
    found.append(
        Bound("turned elliptic paraboloids, short axis of 8 cells and more", turned_errors(rows["ellipse"], 8), 0.01)
    )
    found.append(Bound("without adhesion, mean gap against Tamaas", largest(rows["tamaas"], "separation_error"), 1e-3))
    found.append(
        Bound("without adhesion, gap everywhere (rms, over h_rms)", largest(rows["tamaas"], "gap_error"), 1e-3)
    )
    found.append(Bound("without adhesion, area against Tamaas", largest(rows["tamaas"], "area_error"), 5e-3))
    hard = [row for row in rows["loops"] if not row["adhesion"]]
    found.append(
        Bound(
            "closed loop without adhesion, work over the most work",
            max((abs(row["work"]) / row["largest_work"] for row in hard), default=math.nan),
            1e-4,
        )
    )
    if len([row for row in rows["loops"] if row["adhesion"]]) > 1:
        found.append(Bound("closed loop with adhesion, work at half the step", loop_change(rows["loops"]), 0.01))
    found.append(
        Bound(
            "shifted, reflected, turned by 90°: load and area",
            largest(rows["symmetry"], "pressure_error", "area_error"),
            1e-4,
        )
    )
    found.append(
        Bound(
            "5 against 50 steps to one stop: load and area",
            largest(rows["steps"], "pressure_error", "area_error"),
            1e-4,
        )
    )
    digests = {row["digest"] for row in rows["threads"]}
    found.append(Bound("kinds of bytes with 1 and 2 threads, less one", len(digests) - 1 if digests else math.nan, 0))
    return found


def bounds_table(parts: dict[str, dict]) -> Table:
    """The bounds, and whether they hold."""
    lines = []
    for one in bounds(parts):
        if one.what.startswith("kinds"):
            cells = ["the same bytes with 1 and 2 threads", "", "", "", "met" if one.met else "**missed**"]
        else:
            verdict = "not measured" if math.isnan(one.measured) else "met" if one.met else "**missed**"
            share = "" if math.isnan(one.share) else f"{100 * one.share:.0f} %"
            cells = [one.what, f"{100 * one.measured:.3g} %", share, f"{100 * one.bound:.3g} %", verdict]
        lines.append(cells)
    return Table(["what", "largest error", "states within the bound", "asked for", ""], lines)


def failures(parts: dict[str, dict]) -> list[str]:
    """What ended early, and why."""
    return [f"{name}: {part['failure']}" for name, part in parts.items() if part["failure"]]


def seconds(parts: dict[str, dict]) -> str:
    """Time of all measurements."""
    return f"{sum(part['seconds'] for part in parts.values()) / 60:.0f} min"
