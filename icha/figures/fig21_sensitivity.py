"""Fig. 21: share of the variance of each result that each sampled parameter causes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.datasets.quantities import symbol_of
from icha.figures.drawn import record, say
from icha.figures.looks import legend_below
from icha.figures.samples import responses, title_of
from icha.figures.select import NothingToDraw
from icha.figures.style import BLUE, GREY, TWO_COLUMNS, in_style, new_panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

_COLUMNS = 2
_BAR = 0.36
_CAP = {"ecolor": GREY, "elinewidth": 0.8, "capsize": 1.5, "ls": "none"}


@in_style
def figure(sensitivity: xr.DataTree, *, study: str, target: int = -1) -> Figure:
    """Draw one panel for each result, with two bars for each parameter."""
    data = sensitivity[study].to_dataset()
    shown = responses(data, target)
    shown = shown.isel(response=(shown["degree"] > 0).values)
    count = shown.sizes["response"]
    if not count:
        raise NothingToDraw(f"study {study}: too few cases have results; expected at least twice the parameters")
    names = data["parameter"].values.tolist()
    rows = -(-count // _COLUMNS)
    columns = min(count, _COLUMNS)
    height = rows * (0.75 + 0.34 * len(names)) + 0.4
    width = TWO_COLUMNS * columns / _COLUMNS if columns > 1 else 0.5 * TWO_COLUMNS
    fig, panels = new_panels(height, rows, columns, width=width, sharex=True, sharey=True)
    say(
        fig,
        """Share of the variance of the logarithm of each result that each sampled parameter causes. Filled bars: the
        parameter alone (first-order index). Open bars: the parameter alone and together with other parameters (total
        index). The shares are those of a polynomial that is fitted to the cases; error bars are intervals of 90 %
        (jackknife over the cases).""",
    )
    places = np.arange(len(names))
    handles = {}
    for k, ax in enumerate(panels.ravel()):
        if k >= count:
            ax.remove()
            continue
        row = shown.isel(response=k)
        for words, key, offset, look in (
            ("the parameter alone (first order)", "first_order", -_BAR / 2, {"color": BLUE}),
            ("with all other parameters (total)", "total_order", _BAR / 2, {"color": "white", "ec": BLUE}),
        ):
            values, widths = 100 * row[key].values, 100 * row[f"{key}_half_width"].values
            handles[words] = ax.barh(places + offset, values, _BAR, lw=0.8, **look)
            ends = np.clip([values - widths, values + widths], 0, 100)
            record(ax, values, names, f"{title_of(data, row)}, {words}", low=ends[0], high=ends[1])
            ax.errorbar(values, places + offset, xerr=abs(ends - values), **_CAP)
        ax.set_title(title_of(data, row), loc="right", fontsize=8)
        ax.set(xlim=(0, 105), xlabel="share of variance (%)", yticks=places, yticklabels=[symbol_of(n) for n in names])
        ax.tick_params(axis="y", length=0)
        if k + columns < count:
            ax.set_xlabel("")
    panels[0, 0].invert_yaxis()
    legend_below(fig, handles)
    return fig
