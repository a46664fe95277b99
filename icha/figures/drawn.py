"""Record what a figure draws: sentences for its caption, and data for the table `figures/NAME.csv`.

Functions that draw something also say so in the caption, and record its data. The table has a row for each point, and
the columns `COLUMNS`; columns without any value are left out.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from icha.datasets.labels import LABELS, RunLabels
from icha.datasets.quantities import plain

_RUN = "label of the run; empty if the curve shows several runs"
# Meaning and unit of each column; "x" and "y" stand for the units in `x_quantity` and `y_quantity`.
COLUMNS = {
    "panel": ("letter of the panel", ""),
    "curve": ("what the point belongs to: a model, a theory, a kind of event", ""),
    **dict.fromkeys(LABELS, (_RUN, "")),
    "x": ("value on the horizontal axis", "x"),
    "y": ("value on the vertical axis", "y"),
    "low": ("lower end of the error bar or band: of the 95 % interval for five or more seeds, else of the range", "y"),
    "high": ("upper end of the error bar or band", "y"),
    "seeds": ("number of seeds in the mean", "1"),
    "radius": ("radius of a contact spot at x and y", "x"),
    "pressure": ("contact pressure at x and y", "Pa"),
    "x_quantity": ("label of the horizontal axis, with its unit", ""),
    "y_quantity": ("label of the vertical axis, with its unit", ""),
}


class Name(NamedTuple):
    """Name of a curve in the table: its name in words, and the labels that all its runs have in common."""

    curve: str
    labels: RunLabels | None = None


def say(owner: Artist, *sentences: str) -> None:
    """Append sentences to the caption of a figure, or of the figure of a panel; the caption has each sentence once."""
    said = owner.figure.__dict__.setdefault("sentences", {})
    said.update({" ".join(sentence.split()): True for sentence in sentences if sentence})


def caption_of(figure: Figure) -> str:
    """Return the sentences of a figure."""
    return " ".join(getattr(figure, "sentences", ()))


def plot(axes: Axes, x: Any, y: Any, name: Name | str = "", **look: Any) -> Line2D:
    """Draw a line and record its points; `look` are arguments of `Axes.plot`. The label is the default of the name."""
    record(axes, x, y, name or look.get("label") or "")
    (line,) = axes.plot(x, y, **look)
    return line


def record(axes: Axes, x: Any, y: Any, name: Name | str, **columns: Any) -> None:
    """Record points of a panel; `columns` are further columns of the table, with a value for each or for all points."""
    name = Name(name) if isinstance(name, str) else name
    labels = {} if name.labels is None else {label: getattr(name.labels, label) for label in LABELS}
    figure = axes.get_figure()
    figure.__dict__.setdefault("recorded", []).append((axes, {"curve": name.curve, "x": x, "y": y} | labels | columns))


def show_runs(owner: Artist, study: str, shown: xr.DataArray, wanted: xr.DataArray | None = None) -> None:
    """Record which runs of a study a figure shows, because they reach its states; the caption counts the others.

    The arrays have the labels of the runs and are True for the runs that are `shown`, and for those that the figure
    should show (`wanted`; None for all runs).
    """
    owner.figure.__dict__.setdefault("shown_runs", {})[study] = shown, wanted


def shown_runs(figure: Figure) -> dict[str, tuple[xr.DataArray, xr.DataArray | None]]:
    """Return the runs that a figure shows and those that it should show, by study."""
    return getattr(figure, "shown_runs", {})


def models_of(figure: Figure) -> set[str]:
    """Return the names of the models whose runs a figure has recorded."""
    return {columns["model"] for _, columns in getattr(figure, "recorded", []) if columns.get("model")}


def count_seeds(axes: Axes, words: str, handle: Artist, counts: Iterable[int]) -> None:
    """Name the scatter of means over `counts` seeds in the legend of a figure."""
    found = axes.get_figure().__dict__.setdefault("scatter_of_means", {})
    found.setdefault(words, (handle, set()))[1].update(counts)


def scatter_handles(figure: Figure) -> dict[str, Artist]:
    """Return the legend entries of the scatter of means, with the numbers of seeds."""
    found = {}
    for words, (handle, counts) in getattr(figure, "scatter_of_means", {}).items():
        span = "–".join(map(str, sorted({min(counts), max(counts)})))
        found[f"{words}, n = {span}"] = handle
    return found


def table_of(figure: Figure) -> pd.DataFrame:
    """Return the recorded points of a figure; points that are not finite are left out."""
    frames = []
    for axes, columns in getattr(figure, "recorded", []):
        frame = pd.DataFrame(columns, index=range(len(columns["x"])))
        finite = np.all([frame[key].map(lambda value: value == value) for key in "xy"], axis=0)
        texts = {"panel": axes.get_title("left").strip("()")}
        texts |= {f"{direction}_quantity": plain(_label(axes, direction)) for direction in "xy"}
        frames.append(frame[finite].assign(**texts))
    table = pd.concat([pd.DataFrame(columns=["panel"]), *(each for each in frames if len(each))])
    shown = [column for column in COLUMNS if column in table and not table[column].isin([None, "", np.nan]).all()]
    return table[shown or list(COLUMNS)] if frames else pd.DataFrame(columns=list(COLUMNS))


def _label(axes, direction):
    """Return the label of an axis, or of the same axis in another panel of the column (x) or of the row (y)."""
    figure, span = axes.get_figure(), {"x": "colspan", "y": "rowspan"}[direction]

    def place(panel):
        return getattr(panel.get_subplotspec(), span, None)

    alike = [axes, *(panel for panel in figure.axes if place(panel) == place(axes))]
    labels = (getattr(panel, f"get_{direction}label")() for panel in alike)
    return " ".join(next(filter(None, labels), "").replace("$", "").split())
