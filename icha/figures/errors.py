"""Figures of errors of the asperity model against load: area and separation (10), distributions and maps (11)."""

import itertools

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.datasets.campaign import runs_with_all_loads
from icha.datasets.labels import RunLabels, place_of, surfaces_and_slopes
from icha.datasets.quantities import label_of, quantity
from icha.datasets.variables.campaign import NOT_IN_DESIGN
from icha.figures.captions import range_of_attraction
from icha.figures.drawn import Name, say, show_runs
from icha.figures.ensembles import draw_points
from icha.figures.looks import Looks, legend_below
from icha.figures.select import NOT_APPLICABLE, Line, NothingToDraw
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
    return _draw_errors(campaign, model_error, study, names, _AREA_AND_SEPARATION)


def distribution_error(campaign: xr.DataTree, model_error: xr.DataTree, *, study: str) -> Figure:
    """Draw the distances of the distributions of pressure and gap, and the overlap of the contact maps."""
    names = "pressure_distribution_distance", "gap_distribution_distance", "jaccard"
    return _draw_errors(campaign, model_error, study, names, _DISTRIBUTIONS)


@in_style
def _draw_errors(campaign, model_error, study, names, words):
    """Draw variables of the model error against load, with a column of panels for each; `words` are the caption."""
    factor, unit = quantity(names[0]).in_unit(1.0)  # relative errors are in per cent, and may be negative
    curves = _curves(model_error, study, names)
    own_rows = len({line.place for line in curves}) > _MOST_LINES
    looks = Looks(campaign, [study], curves, by_place=own_rows)
    rows = [[material] for material in looks.materials] if own_rows else [looks.materials]
    fig, panels = new_panels(0.55 + 2.35 * len(rows), len(rows), len(names), sharex=True, sharey="col")
    say(fig, words)
    show_runs(fig, study, runs_with_all_loads(campaign[study].to_dataset()))
    named: dict[str, object] = {}
    for row, shown in zip(panels, rows, strict=True):
        drawn = {line: errors for line, errors in curves.items() if line.material in shown}
        for position, (line, errors) in enumerate(drawn.items()):
            look = looks.look(line)
            loads, shift = errors["reduced_pressure"].values, _APART ** (position - (len(drawn) - 1) / 2)
            labels = RunLabels(study, None, line.surface, None, line.rms_slope, line.material)
            asked = int((errors["status"] != NOT_IN_DESIGN).sum("seed"))
            of_curve = {"name": Name("asperities and boundary elements", labels), "asked": asked}
            for ax, name in zip(row, names, strict=True):
                members = factor * errors[name].values
                handle = draw_points(ax, loads, members, look, positive=not unit, shift=shift, **of_curve)
            named.setdefault(looks.name(line), handle)
        for ax in row if own_rows else ():
            ax.set_title(looks.label(shown[0]), loc="right", fontsize=8)
    low, high = panels[0, 0].dataLim.intervalx
    middle, reach = np.sqrt(low * high), max(_MARGIN * np.sqrt(high / low), _LEAST_REACH)
    for ax, name in zip(panels.ravel(), itertools.cycle(names), strict=False):
        logarithmic_axes(ax, "x")
        ax.set(xlim=(middle / reach, middle * reach), ylabel=label_of(name, unit))
        ax.axhline(0, color="0.6", lw=0.7, zorder=0)
    for ax in panels[-1]:
        ax.set(xlabel=label_of("reduced_pressure"), ylim=(None if unit else 0, None))
    legend_below(fig, looks.colour_handles() if own_rows else looks.handles() if looks.many else named)
    say(
        fig, range_of_attraction(model_error[study]["attraction"].values.ravel()), "Points at one load are drawn apart."
    )
    return fig


def _curves(model_error, study, names) -> dict[Line, xr.Dataset]:
    """Return the errors of a study along seeds and loads, by line."""
    found = {}
    if study in model_error.children:
        errors = model_error[study].to_dataset().transpose("seed", ...)
        places = surfaces_and_slopes(errors)
        for material, (surface, slope) in itertools.product(errors["material"].values.tolist(), places):
            labels = {"surface": surface, "rms_slope": slope, "material": material}
            of_contact = errors.isel(place_of(errors, labels))
            for doubt in ("", NOT_APPLICABLE):
                runs = (of_contact["applicability"] == "") == (not doubt)
                shown = of_contact.assign({name: of_contact[name].where(runs) for name in names})
                if any(np.isfinite(shown[name].values).any() for name in names):
                    found[Line(material, surface, slope, doubt=doubt)] = shown
    if not found:
        raise NothingToDraw(f"study {study}: no run that was compared with boundary elements is complete")
    return found
