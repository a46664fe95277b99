"""Legends below the panels, and numbers of seeds beside marks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from icha.figures.looks import MODEL_MARKERS, NOT_APPLICABLE, Scale
from icha.figures.style import GREY, legend_handle

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

FEWER_SEEDS = "crossed: mean over n seeds, fewer than asked for"

# Largest number of names in the larger font.
_MANY_NAMES = 12
_MOST_COLUMNS = 4
_PALE_GREY = "0.72"


def legend_below(
    figure: Figure, handles: Mapping[str, object], *, scale: Scale | None = None, panels: Sequence[Axes] = ()
) -> None:
    """Add a legend below the panels, in as many columns as have room; the figure grows by its height.

    Parameters
    ----------
    figure : the figure, in which all else is drawn.
    handles : handles of the legend, by name.
    scale : scale of colours that is added beside the `panels`, if any.
    """
    if scale:
        scale.draw(figure, list(panels))
    handles = dict(handles) | _marks(figure)
    look = {"loc": "outside lower center", "fontsize": 8 if len(handles) <= _MANY_NAMES else 7}
    for columns in range(_MOST_COLUMNS if handles else 0, 0, -1):
        legend = figure.legend(handles.values(), handles.keys(), ncols=columns, **look)
        size = legend.get_window_extent().size / figure.dpi
        if size[0] < figure.get_figwidth() or columns == 1:
            figure.set_figheight(figure.get_figheight() + size[1])
            break
        legend.remove()
    _spread_numbers(figure)


def _marks(figure):
    """Return handles of crossed and pale marks, if a panel has some."""
    shown = named_handles(figure.axes)
    ring = {"ls": "none", "marker": "o", "ms": 5, "mew": 0.9, "mfc": "white"}
    cross = ring | {"marker": "x", "mew": 0.7}
    looks = {
        FEWER_SEEDS: (legend_handle(color=GREY, **ring), legend_handle(color=GREY, **cross)),
        NOT_APPLICABLE: legend_handle(color=_PALE_GREY, **ring | {"ls": "-", "lw": 0.9}),
    }
    return {name: look for name, look in looks.items() if name in shown}


def named_handles(panels: Iterable[Axes]) -> dict[str, object]:
    """Return the handles of all names in some panels."""
    found: dict[str, object] = {}
    for axes in panels:
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(name, handle)
    return found


def model_handle(name: str, **look: object) -> Line2D:
    """Return the handle of a model."""
    return legend_handle(**{"ls": "none", "marker": MODEL_MARKERS[name], "color": GREY, "mec": GREY, "ms": 6} | look)


def words_handle(text: str) -> dict[str, object]:
    """Return an entry of a legend without a mark."""
    return {text: legend_handle(color=GREY, ls="none")}


# Positions of the number of seeds beside a mark, in points to the right and up, the best one first.
_NUMBER_OFFSETS = [(side * x, y) for x, y in ((5, -8), (5, 5), (9, -2), (5, -17), (5, 14)) for side in (1, -1)]
_NUMBER = {"fontsize": 6.5, "textcoords": "offset points", "annotation_clip": True}


def write_seed_count(axes: Axes, count: int, x: float, y: float, **look: object) -> None:
    """Write a number of seeds beside a mark; `legend_below` moves numbers that overlap."""
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=1.5, foreground="white")]
    axes.annotate(f"n={count}", (x, y), _NUMBER_OFFSETS[0], path_effects=halo, **_NUMBER, **look)


def _spread_numbers(figure):
    """Move numbers of seeds that overlap, or lie outside of their panel, to another side of their mark."""
    panels = [each for axes in figure.axes for each in (axes, *axes.child_axes)]
    numbers = [(axes, text) for axes in panels for text in axes.texts if text.get_text().startswith("n=")]
    if numbers:
        figure.draw_without_rendering()
    taken = []
    for axes, text in numbers:
        frame, found = axes.get_window_extent(), []
        for offset in _NUMBER_OFFSETS:
            box = _move(text, offset)
            overlaps = any(box.overlaps(other) for other in taken)
            found.append((overlaps, not (frame.contains(*box.min) and frame.contains(*box.max)), offset))
        _, _, offset = min(found, key=lambda each: each[:2])
        taken.append(_move(text, offset))


def _move(text, offset):
    """Move a number of seeds to an offset from its mark; return the box that it fills."""
    text.set(ha="left" if offset[0] > 0 else "right", position=offset)
    return text.get_window_extent()
