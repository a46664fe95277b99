"""Tables of numbers with their scatter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class Table(NamedTuple):
    """Headings of the columns, and rows of cells; as text, Markdown."""

    head: list[str]
    rows: list[list[str]]

    def __str__(self) -> str:
        """The table in Markdown."""
        return "\n".join(f"| {' | '.join(line)} |" for line in (self.head, ["---"] * len(self.head), *self.rows))


def means(values: Sequence[np.ndarray], form: str) -> list[str]:
    """Mean ± standard deviation of several rows of numbers, number by number; the mean alone if there is one row.

    `form` writes a number, such as `"{:+.1f}"`; deviations go without its sign.
    """

    def written(value):
        text = form.format(value)
        return text.replace("-", "+") if float(text) == 0 else text

    mean = np.mean(values, axis=0)
    if len(values) == 1:
        return [written(m) for m in mean]
    deviation = np.std(values, axis=0, ddof=1)
    return [f"{written(m)} ± {form.replace('+', '').format(d)}" for m, d in zip(mean, deviation, strict=True)]


def pressures(values: np.ndarray) -> list[str]:
    """Headings of columns, one for each reduced pressure."""
    return [f"p\\* = {p:.3g}" for p in values]
