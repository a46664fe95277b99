"""Legends, which stand below the panels, and marks of incomplete ensembles that they explain."""

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

# More names than this are written smaller.
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
    handles : what the legend shows, by name.
    scale : a scale of colours, if any, that is added beside the `panels`.
    panels : the axes beside which the scale stands.
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


def model_handle(name: str, **look: object) -> Line2D:
    """What a legend shows of a model."""
    return legend_handle(**{"ls": "none", "marker": MODEL_MARKERS[name], "color": GREY, "mec": GREY, "ms": 6} | look)


def words_handle(text: str) -> dict[str, object]:
    """An explanation in a legend, without a look of its own."""
    return {text: legend_handle(color=GREY, ls="none")}


# Where the number of seeds may stand beside a mark: points to the right, or to the left, and up.
_NUMBER_PLACES = [(side * right, up) for right, up in ((5, -8), (5, 5), (9, -2), (5, -17), (5, 14)) for side in (1, -1)]
_NUMBER = {"fontsize": 6.5, "textcoords": "offset points", "annotation_clip": True}


def write_seed_count(axes: Axes, count: int, x: float, y: float, **look: object) -> None:
    """Write a number of seeds beside a mark; `legend_below` moves numbers that would overlap."""
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=1.5, foreground="white")]
    axes.annotate(f"n={count}", (x, y), _NUMBER_PLACES[0], path_effects=halo, **_NUMBER, **look)


def _spread_numbers(figure):
    """Move numbers of seeds that would lie on each other, or out of their panel, to another side of their mark."""
    panels = [each for axes in figure.axes for each in (axes, *axes.child_axes)]
    numbers = [(axes, text) for axes in panels for text in axes.texts if text.get_text().startswith("n=")]
    if numbers:
        figure.draw_without_rendering()
    taken = []
    for axes, text in numbers:
        frame, boxes = axes.get_window_extent(), {}
        for place in _NUMBER_PLACES:
            text.set(ha="left" if place[0] > 0 else "right", position=place)
            boxes[place] = text.get_window_extent()
        free = [place for place, box in boxes.items() if not any(box.overlaps(other) for other in taken)]
        inside = [place for place in free if frame.contains(*boxes[place].min) and frame.contains(*boxes[place].max)]
        place = (inside or free or _NUMBER_PLACES)[0]
        text.set(ha="left" if place[0] > 0 else "right", position=place)
        taken.append(boxes[place])
