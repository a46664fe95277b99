"""Legends, which stand below the panels, off the data."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from icha.figures.style import GREY, legend_handle

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# More names than this are written smaller.
_MANY_NAMES = 12
# Inches that an entry takes beside its name, and a character of it, in 8 point; and of the height of a row.
_BESIDE, _CHARACTER, _ROW = 0.7, 0.062, 0.155
_MOST_COLUMNS = 4

# Labels of what is drawn of incomplete ensembles and of runs that are no use as predictions, and how legends show it.
FEWER_SEEDS = "crossed: mean over n seeds, fewer than asked for"
NOT_APPLICABLE = "pale: asperity model not applicable"
_PALE_GREY = "0.72"


def legend_below(figure: Figure, handles: Mapping[str, object]) -> None:
    """Add a legend below the panels, in as many columns as have room; the figure grows by its height."""
    handles = dict(handles) | _marks(figure)
    if not handles:
        return
    size = 8 if len(handles) <= _MANY_NAMES else 7
    lengths = [_printed_length(name) * size / 8 for name in handles]
    columns = next(
        (count for count in range(_MOST_COLUMNS, 1, -1) if _width(lengths, count) < figure.get_figwidth()), 1
    )
    rows = -(-len(handles) // columns)
    figure.set_figheight(figure.get_figheight() + 0.06 + _ROW * size / 8 * rows)
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=columns, fontsize=size)


def _marks(figure):
    """What the legend says of crossed and pale marks, as far as a panel has some."""
    shown = named_handles(figure.axes)
    ring = {"ls": "none", "marker": "o", "ms": 5, "mew": 0.9, "mfc": "white"}
    looks = {
        FEWER_SEEDS: (
            legend_handle(color=GREY, **ring),
            legend_handle(color=GREY, **ring | {"marker": "x", "mew": 0.7}),
        ),
        NOT_APPLICABLE: legend_handle(color=_PALE_GREY, **ring | {"ls": "-", "lw": 0.9}),
    }
    return {name: look for name, look in looks.items() if name in shown}


def named_handles(panels: Iterable[Axes]) -> dict[str, object]:
    """What is named in some panels, each name once."""
    found: dict[str, object] = {}
    for axes in panels:
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(name, handle)
    return found


def words_handle(text: str) -> dict[str, object]:
    """An explanation in a legend, without a look of its own."""
    return {text: legend_handle(color=GREY, ls="none")}


def _width(lengths, columns):
    """Inches that so many columns of names take, at most as many as there are names."""
    parts = np.array_split(lengths, min(columns, len(lengths)))
    return sum(_BESIDE + _CHARACTER * max(part) for part in parts)


def _printed_length(name):
    """About how many characters a name has when its formulas are set."""
    return len(re.sub(r"\\mathrm|\\prime|\\ast|\\bar|[{}$^_]", "", name).replace(r"\Delta\gamma", "Δγ"))
