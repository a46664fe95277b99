"""Figures of errors of the asperity model against load: area and separation (10), distributions and maps (11)."""

import itertools

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.datasets.labels import RunLabels
from icha.datasets.quantities import label_of
from icha.figures.captions import range_of_attraction
from icha.figures.drawn import Name, say
from icha.figures.ensembles import draw_points
from icha.figures.looks import Contact, Looks, legend_below
from icha.figures.select import NothingToDraw, compared_seeds, select_errors
from icha.figures.style import in_style, logarithmic_axes, new_panels

# All materials share a panel if each material has at most this number of lines.
_MOST_LINES = 2
# Points at the same load are drawn side by side. The positions of two neighbours on the load axis have this ratio.
_APART = 1.045
# The load axis extends beyond all loads by the factor _MARGIN. The end of the axis is at least _LEAST_REACH times the
# middle of the axis, which leaves room for a tick label.
_MARGIN, _LEAST_REACH = 1.2, 1.6


_SAME = "on the same topographies at the same loads, against the reduced pressure F/(E* h'rms A0)."
_AREA_AND_SEPARATION = f"""Relative differences between asperity model and boundary elements in contact area (left) and
mean separation (right), {_SAME}"""
_DISTRIBUTIONS = f"""Differences between asperity model and boundary elements, {_SAME} The left panels show the first
Wasserstein distance W1 between the distributions of the contact pressure over the nominal area, in units of the nominal
pressure. The middle panels show W1 of the gap, in units of the rms height. W1 is the area between two cumulative
distributions. The right panels show the overlap of the contact maps: the area in contact in both models divided by the
area in contact in at least one model."""


def model_error(campaign: xr.DataTree, model_error: xr.DataTree, *, study: str) -> Figure:
    """Draw the relative errors of contact area and mean separation."""
    names = "area_error", "separation_error"
    return _draw_errors(campaign, model_error, study, names, percent=True, words=_AREA_AND_SEPARATION)


def distribution_error(campaign: xr.DataTree, model_error: xr.DataTree, *, study: str) -> Figure:
    """Draw the distances of the distributions of pressure and gap, and the overlap of the contact maps."""
    names = "pressure_distribution_distance", "gap_distribution_distance", "jaccard"
    return _draw_errors(campaign, model_error, study, names, percent=False, words=_DISTRIBUTIONS)


@in_style
def _draw_errors(campaign, model_error, study, names, *, percent, words):
    """Draw variables of the model error against load, with one panel for each variable.

    Parameters
    ----------
    campaign : the campaign dataset; the order of the materials in the dataset determines the colours.
    model_error : the errors of the campaign, from `icha.analysis.model_error.model_error`.
    study : name of the study; the figure shows all errors of this study.
    names : the variables, one for each column of panels.
    percent : True for relative errors, which are drawn in per cent; False for variables that are never negative.
    words : first sentences of the caption.
    """
    curves = _curves(model_error, study, names)
    contacts = [contact for contact, _ in curves]
    own_rows = len({tuple(place) for _, *place in contacts}) > _MOST_LINES
    looks = Looks(campaign, [study], contacts, by_place=own_rows)
    rows = [[material] for material in looks.materials] if own_rows else [looks.materials]
    fig, panels = new_panels(0.55 + 2.35 * len(rows), len(rows), len(names), sharex=True, sharey="col")
    say(fig, words)
    named: dict[str, object] = {}
    for row, shown in zip(panels, rows, strict=True):
        drawn = [(*of, errors) for of, errors in curves.items() if of[0][0] in shown]
        if own_rows and not looks.adhesive(shown[0]):
            drawn = _different(drawn, names)
        for position, (contact, applicable, errors) in enumerate(drawn):
            look = looks.look(contact, applicable=applicable)
            loads, shift = errors["reduced_pressure"].values, _APART ** (position - (len(drawn) - 1) / 2)
            material, surface, slope = contact
            labels = RunLabels(study, None, surface, None, slope, material)
            of_curve = {"name": Name("asperities and boundary elements", labels), "asked": compared_seeds(errors)}
            for ax, name in zip(row, names, strict=True):
                members = (100 if percent else 1) * errors[name].values
                handle = draw_points(ax, loads, members, look, positive=not percent, shift=shift, **of_curve)
            named.setdefault(looks.place_name(contact[1:]) if own_rows else looks.name(contact), handle)
        for ax in row if own_rows else ():
            ax.set_title(looks.material_name(shown[0]), loc="right", fontsize=8)
    low, high = panels[0, 0].dataLim.intervalx
    middle, reach = np.sqrt(low * high), max(_MARGIN * np.sqrt(high / low), _LEAST_REACH)
    for ax, name in zip(panels.ravel(), itertools.cycle(names), strict=False):
        logarithmic_axes(ax, "x")
        ax.set(xlim=(middle / reach, middle * reach), ylabel=label_of(name, "%" if percent else ""))
        ax.axhline(0, color="0.6", lw=0.7, zorder=0)
    for ax in panels[-1]:
        ax.set(xlabel=label_of("reduced_pressure"), ylim=(None if percent else 0, None))
    named.pop("", None)
    named = looks.colour_handles() if own_rows else looks.handles() if looks.many else named
    legend_below(fig, named, rows=looks.slopes_per_surface)
    errors = model_error[study]
    say(fig, range_of_attraction(errors["attraction"].values.ravel() if "attraction" in errors else ()))
    if not all(looks.adhesive(material) for material in looks.materials):
        coinciding = "; slopes whose results coincide without adhesion are drawn once" if own_rows else ""
        say(fig, f"Open markers are without adhesion{coinciding}.")
    say(fig, "Points at one load are drawn apart.")
    return fig


def _different(drawn, names):
    """Leave out errors without adhesion that equal those of the same surface at another slope."""
    found = {}
    for contact, applicable, errors in drawn:
        values = np.concatenate([errors[name].values.ravel() for name in names])
        alike = found.setdefault((contact[1], applicable), [])
        if not any(
            each.shape == values.shape and np.allclose(each, values, rtol=1e-2, equal_nan=True) for each, _ in alike
        ):
            alike.append((values, (contact, applicable, errors)))
    return [curve for alike in found.values() for _, curve in alike]


def _curves(model_error, study, names) -> dict[tuple[Contact, bool], xr.Dataset]:
    """Return the errors of a study by material, surface and slope, and by applicability of the asperity model."""
    found = {}
    for contact, errors in select_errors(model_error, study):
        for applicable in (True, False):
            runs = (errors["applicability"] == "") == applicable if "applicability" in errors else applicable
            shown = errors.assign({name: errors[name].where(runs) for name in names})
            if any(np.isfinite(shown[name].values).any() for name in names):
                found[contact, applicable] = shown
    if not found:
        raise NothingToDraw(f"study {study}: no run that was compared with boundary elements is complete")
    return found
