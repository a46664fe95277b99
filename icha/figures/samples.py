"""Figures of sampled cases: share of the variance that each parameter causes (21), and a result against each (22)."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.contact.models import MODELS
from icha.datasets import quantities
from icha.datasets.quantities import symbol_of
from icha.figures.drawn import plot, record, say
from icha.figures.looks import legend_below
from icha.figures.select import NothingToDraw
from icha.figures.style import BLUE, GREY, TWO_COLUMNS, VERMILLION, in_style, legend_handle, logarithmic_axes, new_grid
from icha.support.formatting import choose_unit
from icha.uncertainty.sensitivity import response_words

# Thickness of a bar.
_BAR = 0.36
_CAP = {"ecolor": GREY, "elinewidth": 0.8, "capsize": 1.5, "ls": "none"}
# Both bars of a parameter: name, variable, shift and look.
_SHARES = (
    ("the parameter alone (first order)", "first_order", -_BAR / 2, {"color": BLUE}),
    ("with all other parameters (total)", "total_order", _BAR / 2, {"color": "white", "ec": BLUE}),
)
# The axis of the result is logarithmic if the largest value is so many times the smallest.
_DECADE = 5.0
_CASE = {"ls": "none", "marker": "o", "ms": 3.2, "mfc": "none", "mec": BLUE, "mew": 0.7}
_MEAN = "mean over the other parameters"
_AGAINST = """A result of every sampled case against each sampled parameter. Means over the other parameters are from
the polynomial of figure 21, between the 5 % and the 95 % quantile of the parameter."""


@in_style
def sensitivity(sensitivity: xr.DataTree, *, study: str, target: int = -1) -> Figure:
    """Draw one panel for each result, with two bars for each parameter."""
    data = sensitivity[study].to_dataset()
    shown = _responses(data, target)
    shown = shown.isel(response=(shown["degree"] > 0).values)
    if not shown.sizes["response"]:
        raise NothingToDraw(f"study {study}: too few cases have results; expected at least twice the parameters")
    names = data["parameter"].values.tolist()
    size = 0.75 + 0.34 * len(names), TWO_COLUMNS / 2
    options = {"room": (0.0, 0.4), "xlabel": "share of variance (%)", "sharex": True, "sharey": True}
    fig, panels = new_grid(shown.sizes["response"], 2, *size, **options)
    say(
        fig,
        """Share of the variance of the logarithm of each result that each sampled parameter causes. Filled bars: the
        parameter alone (first-order index). Open bars: the parameter alone and together with other parameters (total
        index). The shares are those of a polynomial that is fitted to the cases; error bars are intervals of 90 %
        (jackknife over the cases).""",
    )
    places, handles = np.arange(len(names)), {}
    for k, ax in enumerate(panels):
        row = shown.isel(response=k)
        for words, key, shift, look in _SHARES:
            values, widths = 100 * row[key].values, 100 * row[f"{key}_half_width"].values
            handles[words] = ax.barh(places + shift, values, _BAR, lw=0.8, **look)
            ends = np.clip([values - widths, values + widths], 0, 100)
            record(ax, values, names, f"{response_words(data, row)}, {words}", low=ends[0], high=ends[1])
            ax.errorbar(values, places + shift, xerr=abs(ends - values), **_CAP)
        ax.set_title(response_words(data, row), loc="right", fontsize=8)
        ax.set(xlim=(0, 105), yticks=places, yticklabels=[symbol_of(name) for name in names])
        ax.tick_params(axis="y", length=0)
    panels[0].invert_yaxis()
    legend_below(fig, handles)
    return fig


@in_style
def parameters(
    sensitivity: xr.DataTree, *, study: str, target: int = -1, quantity: str = "contact_area_fraction"
) -> Figure:
    """Draw one panel for each parameter: a point for each case, and the mean over the other parameters as a line."""
    data, described = sensitivity[study].to_dataset(), quantities.quantity(quantity)
    shown = _responses(data, target)
    shown = shown.isel(response=(shown["response_quantity"] == quantity).values)
    if not shown.sizes["response"]:
        raise NothingToDraw(f"study {study}: no case has a result for {described.name}")
    row = shown.isel(response=0)
    number, fitted = int(row["response_target"]), int(row["degree"]) > 0
    values = data[quantity].sel(model=_best_model(data))
    values = np.exp(np.log((values if number < 0 else values.isel(target=number)).where(lambda v: v > 0)).mean("seed"))
    factor, unit = described.in_unit(float(row["middle"]))
    results = values.values * factor
    names = data["parameter"].values.tolist()
    options = {"room": (0.0, 0.3), "least": 1.5, "ylabel": described.label(unit), "sharey": True}
    fig, panels = new_grid(len(names), 3, 2.0, TWO_COLUMNS / 3, **options)
    say(fig, _AGAINST)
    handles = {f"one case: {response_words(data, row)}": legend_handle(**_CASE)}
    if fitted:
        handles[_MEAN] = legend_handle(color=VERMILLION)
    for k, (ax, name) in enumerate(zip(panels, names, strict=True)):
        scale, label = _scale(data, name)
        plot(ax, data[name].values * scale, results, "case", **_CASE)
        if fitted:
            mean = row["main_effect"].values[k] * factor
            plot(ax, data["effect_value"].values[k] * scale, mean, _MEAN, color=VERMILLION)
        ax.set_xlabel(label)
    if np.nanmax(results) > _DECADE * np.nanmin(results):
        logarithmic_axes(panels[0], "y")
    legend_below(fig, handles)
    return fig


def _responses(data: xr.Dataset, target: int) -> xr.Dataset:
    """Return the results at one target and of the whole loop, for the model that is closest to the truth."""
    if "response" not in data.dims:
        raise NothingToDraw(f"study {data.attrs['study']}: no case has a result")
    number = data.sizes["target"] - 1 if target < 0 else target
    shown = data["response_target"].isin((number, -1)) & (data["response_model"] == _best_model(data))
    return data.isel(response=shown.values)


def _best_model(data: xr.Dataset) -> str:
    """Return boundary elements if a study has them, otherwise the asperity model."""
    return next(name for name in reversed(MODELS) if name in data["model"].values)


def _scale(data: xr.Dataset, name: str) -> tuple[float, str]:
    """Return factor and label of the axis of a parameter."""
    unit = data[name].attrs["units"]
    if unit == "1":
        return 1.0, symbol_of(name)
    factor, prefixed = choose_unit(float(np.abs(data[name].values).max()), unit)
    return factor, f"{symbol_of(name)} ({prefixed})"
