"""Error of the asperity model against load, which figures 10 and 11 draw."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.datasets.variables.model_error import FINITE_RANGE
from icha.figures.curves import PRESSURE_LABEL
from icha.figures.ensembles import draw_points, points_handles
from icha.figures.looks import Looks, legend_below
from icha.figures.select import NothingToDraw, asked_of_entry, select_errors
from icha.figures.style import DASHES, in_style, logarithmic_axes, material_label, new_panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# Largest number of surfaces and slopes for which all materials share their panels.
_MOST_LINES = 2
# Ratio of the positions of points at one load, so that their bars do not hide each other.
_APART = 1.025
# Ratio by which the axis of loads extends beyond the loads, and the least one from the middle, with a label.
_MARGIN, _LEAST_REACH = 1.2, 1.6


class ErrorPanel(NamedTuple):
    """A panel that shows a variable of the model error.

    Parameters
    ----------
    name : name of the variable.
    label : label of the axis.
    factor : factor from values to the unit of the axis.
    positive : whether values cannot be negative, so that the axis begins at zero.
    """

    name: str
    label: str
    factor: float = 1.0
    positive: bool = False


class _Curve(NamedTuple):
    """The errors of an entry for one contact, of the runs to which the asperity model is applicable or of the others.

    Attributes
    ----------
    name : name of the entry.
    truth : name of the boundary elements that the model is compared with.
    errors : the errors along seeds and loads.
    contact : material, surface and rms slope.
    applicable : whether the asperity model is applicable.
    """

    name: str
    truth: str
    errors: xr.Dataset
    contact: tuple[str, str, float]
    applicable: bool


@in_style
def draw_errors(
    campaign: xr.DataTree, model_error: xr.DataTree, *, study: str, quantities: tuple[ErrorPanel, ...]
) -> Figure:
    """Draw quantities of the model error against load, a panel for each, for every surface, slope and material.

    Parameters
    ----------
    campaign : the campaign dataset, from which materials have their colours.
    model_error : `icha.analysis.model_error.model_error` of the campaign.
    study : name of the study; all entries that compare its runs are drawn.
    quantities : what is drawn of them.

    Raises
    ------
    NothingToDraw
        If no run of the study that was compared is complete.
    """
    curves = _curves(model_error, study, quantities)
    contacts = [curve.contact for curve in curves]
    own_rows = len({tuple(place) for _, *place in contacts}) > _MOST_LINES
    interfaces = campaign[study].to_dataset()
    looks = Looks(campaign, interfaces, contacts, by_place=own_rows)
    rows = [[material] for material in looks.materials] if own_rows else [looks.materials]
    fig, panels = new_panels(0.55 + 2.35 * len(rows), len(rows), len(quantities), sharex=True, sharey="col")
    named: dict[str, object] = {}
    counts: set[int] = set()
    for row, shown in zip(panels, rows, strict=True):
        shown_curves = [curve for curve in curves if curve.contact[0] in shown]
        for k, curve in enumerate(shown_curves):
            same = [each for each in shown_curves if each[3:] == curve[3:]]
            name, dashes = _words(curve, same, looks, own_rows=own_rows)
            look = looks.look(curve.contact, applicable=curve.applicable) | {"ls": dashes}
            handle = _draw_curve(row, curve, quantities, look, _APART ** (k - (len(shown_curves) - 1) / 2), counts)
            if curve.applicable:
                named.setdefault(name, handle)
        if own_rows:
            row[-1].set_title(material_label(interfaces, shown[0]), loc="right")
    _finish(panels, quantities)
    named.pop("", None)
    legend_below(fig, (looks.handles() if looks.many else named) | points_handles(counts))
    return fig


def _curves(model_error, study, quantities):
    """Return the curves of all entries that compare the runs of a study."""
    found = []
    for name, contact, errors in select_errors(model_error, study):
        for applicable in (True, False):
            runs = (errors["applicability"] == "") == applicable if "applicability" in errors else applicable
            shown = errors.assign({each.name: errors[each.name].where(runs) for each in quantities})
            if any(np.isfinite(shown[each.name].values).any() for each in quantities):
                found.append(_Curve(name, errors.attrs["truth"], shown, contact, applicable))
    if not found:
        raise NothingToDraw(f"study {study}: no run beside boundary elements is complete")
    return found


def _words(curve, same, looks, *, own_rows):
    """Return name and dashes of a curve beside the other curves of the `same` contact.

    The other curves are solutions of the same states at a finite range, or on another grid.
    """
    repetition, truths = same.index(curve), [each.truth for each in same]
    name = looks.place_name(curve.contact[1:]) if own_rows else looks.name(curve.contact)
    words = [name] if name else []
    words += ["at finite range"] if len(set(truths)) > 1 and curve.truth == FINITE_RANGE else []
    words += [curve.name] if truths.index(curve.truth) < repetition else []
    return ", ".join(words), DASHES[repetition % len(DASHES)]


def _draw_curve(row, curve, quantities, look, apart, counts):
    """Draw a curve in all panels of a row; return its handle, and add the number of seeds of each point to `counts`."""
    p, asked = curve.errors["reduced_pressure"].values * apart, asked_of_entry(curve.errors)
    for ax, quantity in zip(row, quantities, strict=True):
        members = quantity.factor * curve.errors[quantity.name].values
        handle = draw_points(ax, p, members, look, positive=quantity.positive, asked=asked)
        counts.update(np.isfinite(members).sum(axis=0).tolist())
    return handle


def _finish(panels, quantities):
    """Set axes and labels of all panels."""
    low, high = panels[0, 0].dataLim.intervalx
    middle, reach = np.sqrt(low * high), max(_MARGIN * np.sqrt(high / low), _LEAST_REACH)
    for ax, quantity in zip(panels.ravel(), itertools.cycle(quantities), strict=False):
        logarithmic_axes(ax, "x")
        ax.set_xlim(middle / reach, middle * reach)
        ax.axhline(0, color="0.6", lw=0.7, zorder=0)
        ax.set_ylabel(quantity.label)
    for ax, quantity in zip(panels[-1], quantities, strict=True):
        ax.set_xlabel(PRESSURE_LABEL)
        if quantity.positive:
            ax.set_ylim(bottom=0)
