"""Tables of the pages of the documentation, written to docs/tables, which the pages include."""

from __future__ import annotations

import itertools
import math
import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

DOCS = Path(__file__).resolve().parents[1] / "docs"


class Table(NamedTuple):
    """Headings and rows of cells of a table; `numbers` aligns all columns but the first to the right."""

    head: list[str]
    rows: list[list[str]]
    numbers: bool = False

    def __str__(self) -> str:
        """Return the table as Markdown."""
        rule = ["---"] + ["---:" if self.numbers else "---"] * (len(self.head) - 1)
        return "".join(f"| {' | '.join(line)} |\n" for line in (self.head, rule, *self.rows))


def write_tables(tables: Mapping[str, Table]) -> None:
    """Write tables by name to docs/tables."""
    for name, table in tables.items():
        (DOCS / "tables" / f"{name}.md").write_text(str(table), encoding="utf-8")


def percent(value: float, digits: int = 2) -> str:
    """Format a relative error in per cent, zero without a minus sign."""
    return _without_minus_zero(100 * value, f"{{:+.{digits}f}}")


def _without_minus_zero(value, form):
    text = form.format(value)
    return text.replace("-", "+") if float(text) == 0 else text


def means(values: Sequence[np.ndarray], form: str) -> list[str]:
    """Format mean ± standard deviation over rows of numbers, or the mean of a single row.

    `form` formats a number, such as `"{:+.1f}"`; deviations have no sign.
    """
    found = [_without_minus_zero(mean, form) for mean in np.mean(values, axis=0)]
    if len(values) == 1:
        return found
    deviation = np.std(values, axis=0, ddof=1)
    return [f"{mean} ± {form.replace('+', '').format(d)}" for mean, d in zip(found, deviation, strict=True)]


def by(rows: Sequence[Mapping], columns: str) -> Table:
    """Table with a line for each row that has all columns.

    A line that repeats an earlier one, such as a state of loading and of unloading, is left out.

    Parameters
    ----------
    columns : `name: heading format` of each column, such as "area_error: area %"; `%` formats errors in per cent.
    """

    def written(value, form):
        return "" if value is None else percent(value) if form == "%" else format(value, form)

    described = [re.fullmatch(r"\s*(\w+): (.*) (\S+)", each).groups() for each in columns.split(";")]
    shown = [row for row in rows if all(name in row for name, _, _ in described)]
    lines = dict.fromkeys(tuple(written(row[name], form) for name, _, form in described) for row in shown)
    return Table([heading for _, heading, _ in described], [list(line) for line in lines])


def worst(rows: Iterable[Mapping], *names: str) -> float:
    """Return the largest error of these names."""
    return max(abs(row[name]) for row in rows for name in names if name in row)


def by_radius(
    rows: Sequence[Mapping],
    names: Mapping[str, str],
    edges: Sequence[float],
    places: Mapping[str, Sequence[tuple[float, float]]] = {},
) -> Table:
    """Table of the mean and range of errors in classes of the contact radius, and of the place of the apex.

    Parameters
    ----------
    names : headings of the errors, by their names.
    edges : lower ends of the classes, in cells.
    places : places of the apex by words; empty for a table without places.
    """

    def spread(members, name):
        values = np.array([row[name] for row in members])
        return f"{percent(values.mean())} ({percent(values.min())} to {percent(values.max())})"

    lines = []
    for (low, high), where in itertools.product(itertools.pairwise((*edges, math.inf)), places or [""]):
        members = [row for row in rows if low <= row["cells"] < high]
        members = [row for row in members if not places or tuple(row["place"]) in places[where]]
        if members:
            label = f"{low} to {high}" if math.isfinite(high) else f"over {low}"
            words = [label, where] if places else [label]
            lines.append([*words, str(len(members)), *(spread(members, name) for name in names)])
    return Table(["cells in the radius", *(["apex"] if places else []), "states", *names.values()], lines)


def pressures(values: np.ndarray) -> list[str]:
    """Return a heading for each reduced pressure."""
    return [f"p\\* = {p:.3g}" for p in values]


def copy_figures(page: str, results: Path) -> None:
    """Copy the figures of a page, whose names begin with `fig`, from the results of their campaign."""
    for figure in re.findall(r"\]\(images/(fig.*?\.png)\)", (DOCS / f"{page}.md").read_text(encoding="utf-8")):
        shutil.copyfile(results / "figures" / figure, DOCS / "images" / figure)
