"""Fig. 22: a result against each sampled parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.datasets import quantities
from icha.figures.drawn import plot, say
from icha.figures.looks import legend_below
from icha.figures.samples import best_model, responses, scale_of, title_of
from icha.figures.style import BLUE, TWO_COLUMNS, VERMILLION, in_style, legend_handle, logarithmic_axes, new_panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


_COLUMNS = 3
# The axis of the result is logarithmic if the largest value is so many times the smallest.
_DECADE = 5.0

_CASE = {"ls": "none", "marker": "o", "ms": 3.2, "mfc": "none", "mec": BLUE, "mew": 0.7}


@in_style
def figure(
    sensitivity: xr.DataTree, *, study: str, target: int = -1, quantity: str = "contact_area_fraction"
) -> Figure:
    """Draw one panel for each parameter: a point for each case, and the mean over the other parameters as a line."""
    from icha.figures.select import NothingToDraw

    data, described = sensitivity[study].to_dataset(), quantities.quantity(quantity)
    shown = responses(data, target)
    shown = shown.isel(response=(shown["response_quantity"] == quantity).values)
    if not shown.sizes["response"]:
        raise NothingToDraw(f"study {study}: no case has a result for {described.name}")
    row = shown.isel(response=0)
    number = int(row["response_target"])
    values = data[quantity].sel(model=best_model(data["model"].values.tolist()))
    values = np.exp(np.log((values if number < 0 else values.isel(target=number)).where(lambda v: v > 0)).mean("seed"))
    factor, unit = described.in_unit(float(row["middle"]))
    results = values.values * factor
    names = data["parameter"].values.tolist()
    columns = min(len(names), _COLUMNS)
    rows = -(-len(names) // columns)
    width = TWO_COLUMNS * columns / _COLUMNS if columns > 1 else 0.5 * TWO_COLUMNS
    fig, panels = new_panels(2.0 * rows + 0.3, rows, columns, width=width, sharey=True)
    say(fig, "A result of every sampled case against each sampled parameter.")
    if int(row["degree"]):
        say(
            fig,
            """Lines: mean over the other parameters, from the polynomial of figure 21, between the 5 % and the 95 %
            quantile of the parameter.""",
        )
    for k, ax in enumerate(panels.ravel()):
        if k >= len(names):
            ax.remove()
            continue
        scale, label = scale_of(data, names[k])
        plot(ax, data[names[k]].values * scale, results, "case", **_CASE)
        if int(row["degree"]):
            mean = row["main_effect"].values[k] * factor
            plot(ax, data["effect_value"].values[k] * scale, mean, "mean over the other parameters", color=VERMILLION)
        ax.set_xlabel(label)
        if k % columns == 0:
            ax.set_ylabel(described.label(unit))
    if np.nanmax(results) > _DECADE * np.nanmin(results):
        logarithmic_axes(panels[0, 0], "y")
    words = title_of(data, row)
    handles = {f"one case: {words}": legend_handle(**_CASE)}
    if int(row["degree"]):
        handles["mean over the other parameters"] = legend_handle(color=VERMILLION)
    legend_below(fig, handles)
    return fig
