"""Error of the asperity model against load, which figures 10 and 11 draw."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.datasets.labels import place_of, surfaces_and_slopes
from icha.datasets.variables.model_error import FINITE_RANGE
from icha.figures.curves import PRESSURE_LABEL
from icha.figures.ensembles import draw_points, points_handles
from icha.figures.legends import legend_below, words_handle
from icha.figures.looks import Looks, collect_interfaces
from icha.figures.select import NothingToDraw, asked_of_entry, study_errors
from icha.figures.style import (
    DASHES,
    GREY,
    format_number,
    in_style,
    legend_handle,
    logarithmic_axes,
    material_label,
    new_panels,
)
from icha.support.statistics import ensemble

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# Largest number of surfaces and slopes for which all materials share their panels.
_MOST_LINES = 2
# Ratio of the positions of points at one load, so that their bars do not hide each other.
_APART = 1.025
# Ratio of loads below which they count as one load; the axis then extends by this ratio to both sides.
_ONE_LOAD = 1.3
# Errors against another quantity of the boundary elements.
_OTHER = {"ls": ":", "lw": 0.9, "marker": ".", "ms": 3}
_OTHER_NAME = "relative to the energetic area (energy of adhesion / that of full contact)"


class ErrorPanel(NamedTuple):
    """A panel that shows a variable of the model error.

    Parameters
    ----------
    name : name of the variable.
    label : label of the axis.
    factor : factor from values to the unit of the axis.
    limits : limits of the axis; None where the data set them.
    other : variable drawn as a dotted line if boundary elements with adhesion have a finite range.
    positive : whether values cannot be negative.
    words : explanation in the legend.
    """

    name: str
    label: str
    factor: float = 1.0
    limits: tuple[float | None, float | None] = (None, None)
    other: str = ""
    positive: bool = False
    words: str = ""


class _Curve(NamedTuple):
    """The errors of an entry for one contact, of the runs to which the asperity model is applicable or of the others.

    Attributes
    ----------
    name : name of the entry.
    errors : the errors along seeds and loads.
    contact : material, surface and rms slope.
    applicable : whether the asperity model is applicable.
    """

    name: str
    errors: xr.Dataset
    contact: tuple[str, str, float]
    applicable: bool

    @property
    def truth(self) -> str:
        """Name of the boundary elements that the model is compared with."""
        return self.errors.attrs["truth"]

    @property
    def has_cohesive_zone(self) -> bool:
        """True if the boundary elements have attraction outside of contact, and so a second, energetic area."""
        return self.truth == FINITE_RANGE and float(self.errors["surface_energy"]) > 0


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
    ValueError
        If the study has no boundary elements beside it.
    """
    curves = _curves(model_error, study, quantities)
    contacts = [curve.contact for curve in curves]
    own_rows = len({tuple(place) for _, *place in contacts}) > _MOST_LINES
    interfaces = collect_interfaces(study_errors(model_error, study).values())
    looks = Looks(campaign, interfaces, contacts, by_place=own_rows)
    rows = [[material] for material in looks.materials] if own_rows else [looks.materials]
    fig, panels = new_panels(0.55 + 2.35 * len(rows), len(rows), len(quantities), sharex=True, sharey="col")
    named: dict[str, object] = {}
    counts: set[int] = set()
    for row, shown in zip(panels, rows, strict=True):
        shown_curves = [curve for curve in curves if curve.contact[0] in shown]
        for k, curve in enumerate(shown_curves):
            same = [each for each in shown_curves if each[2:] == curve[2:]]
            name, dashes = _words(curve, same, looks, own_rows=own_rows)
            look = looks.look(curve.contact, applicable=curve.applicable) | {"ls": dashes}
            handle = _draw_curve(row, curve, quantities, look, _APART ** (k - (len(shown_curves) - 1) / 2), counts)
            if curve.applicable:
                named.setdefault(name, handle)
        if own_rows:
            row[-1].set_title(material_label(interfaces, shown[0]), loc="right")
    _finish(panels, quantities)
    if len(named) == 1 or looks.scale:
        named.pop("", None)
    if any(each.other for each in quantities) and any(curve.has_cohesive_zone for curve in curves):
        named[_OTHER_NAME] = legend_handle(color=GREY, **_OTHER)
    named |= points_handles(counts)
    for quantity in quantities:
        named |= words_handle(quantity.words) if quantity.words else {}
    legend_below(fig, named, scale=looks.scale, panels=panels.ravel())
    return fig


def _curves(model_error, study, quantities):
    """Return the curves of all entries that compare the runs of a study."""
    entries = study_errors(model_error, study)
    if not entries:
        compared = ", ".join(sorted({str(node.attrs["study"]) for node in model_error.children.values()}))
        raise ValueError(f"no boundary elements beside study {study!r}; expected one of: {compared}")
    variables = {variable for each in quantities for variable in (each.name, each.other) if variable}
    found = []
    for (name, errors), applicable in itertools.product(entries.items(), (True, False)):
        for material, (surface, slope) in itertools.product(errors["material"].values, surfaces_and_slopes(errors)):
            labels = {"surface": surface, "rms_slope": slope, "material": material}
            values = errors.isel(place_of(errors, labels))
            runs = (values["applicability"] == "") == applicable if "applicability" in values else applicable
            values = values.assign({variable: values[variable].where(runs) for variable in variables})
            # A campaign need not request all combinations of the labels of an entry.
            if any(np.isfinite(values[each.name].values).any() for each in quantities):
                found.append(_Curve(name, values, (material, surface, slope), applicable))
    if not found:
        raise NothingToDraw(f"study {study}: no run beside boundary elements is complete")
    return found


def _words(curve, same, looks, *, own_rows):
    """Return name and dashes of a curve beside the other curves of the `same` contact.

    Those are solutions of the same states at a finite range, or on another grid.
    """
    repetition, truths = same.index(curve), [each.truth for each in same]
    name = looks.place_name(curve.contact[1:]) if own_rows else looks.name(curve.contact)
    words = [] if looks.scale else [name] if name else []
    words += ["at finite range"] if len(set(truths)) > 1 and curve.truth == FINITE_RANGE else []
    words += [curve.name] if truths.index(curve.truth) < repetition else []
    return ", ".join(words), DASHES[repetition % len(DASHES)]


def _draw_curve(row, curve, quantities, look, apart, counts):
    """Draw a curve in all panels of a row; return its handle, and add the number of seeds of each point to `counts`."""
    p, asked = curve.errors["reduced_pressure"].values * apart, int(asked_of_entry(curve.errors))
    errors = curve.errors.transpose("seed", ...)
    for ax, quantity in zip(row, quantities, strict=True):
        members = quantity.factor * errors[quantity.name].values
        handle = draw_points(ax, p, members, look, positive=quantity.positive, asked=asked)
        counts.update(np.isfinite(members).sum(axis=0).tolist())
        if quantity.other and curve.has_cohesive_zone:
            ax.plot(p, quantity.factor * ensemble(errors[quantity.other].values).mean, color=look["color"], **_OTHER)
    return handle


def _finish(panels, quantities):
    """Set axes and labels of all panels."""
    for ax, quantity in zip(panels.ravel(), itertools.cycle(quantities), strict=False):
        logarithmic_axes(ax, "x")
        ax.axhline(0, color="0.6", lw=0.7, zorder=0)
        ax.set_ylabel(quantity.label)
    low, high = panels[0, 0].dataLim.intervalx
    if high < _ONE_LOAD * low:
        load = float(f"{np.sqrt(low * high):.3g}")
        panels[0, 0].set_xlim(load / _ONE_LOAD, load * _ONE_LOAD)
        panels[0, 0].set_xticks([load], [format_number(load)])
        for ax in panels.ravel():
            ax.minorticks_off()
    for ax, quantity in zip(panels[-1], quantities, strict=True):
        ax.set_xlabel(PRESSURE_LABEL)
        ax.set_ylim(*quantity.limits)
