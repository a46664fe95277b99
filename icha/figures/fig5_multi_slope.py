"""Fig. 5: contact area against load for several rms slopes and materials, with measurements."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from icha.datasets.quantities import label_of
from icha.figures.curves import (
    add_legend,
    draw_curves,
    limit_ratios,
    ratio_points,
    say_models,
    study_curves,
)
from icha.figures.drawn import plot, say
from icha.figures.looks import ASPERITIES_NAME, MODEL_MARKERS, REFERENCE_NAME, TRUTH_LINE, model_handle, surface_label
from icha.figures.select import has_shape
from icha.figures.style import DASHES, in_style, new_panels
from icha.support.tables import read_columns

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


# Largest number of surfaces that have their own columns of panels.
_MOST_SURFACES = 3

_AREA = "Contact area divided by nominal area, A/A0, against the relative load F/(E* A0) (left), and on the right: "
_SHAPED = "Because a surface has a shape, relative loads F/(E* A0) take the place of reduced pressures."


@in_style
def figure(
    campaign: xr.DataTree,
    tables: Sequence[str | os.PathLike] = (),
    *,
    study: str,
    boundary_elements: str | None = None,
    measurements: Sequence[Mapping[str, Any]] = (),
) -> Figure:
    """Draw all runs of a study: area, and area over load; with several slopes of several surfaces, only the latter.

    Area over load is drawn against the reduced pressure. If a surface has a shape, it is drawn against the relative
    load, because the unit of reduced pressures of a shape is not the rms slope, which a measurement has.

    Parameters
    ----------
    campaign : the campaign dataset.
    tables : files of measured curves; axes of relative loads show only curves whose relative loads are known.
    measurements : for each table, the values of `label`, `citation`, `columns` (headings and factors), `material`,
        `rms_slope` and `contact_modulus`. The last is E*, Pa, if the loads are pressures in Pa; it is None if they are
        reduced pressures p/(E* h'rms). Unknown values are None.
    """
    curves = study_curves(campaign, study, boundary_elements)
    looks = curves.looks
    # If colours distinguish surfaces and slopes, every material has a row of panels; a few surfaces have columns.
    own_rows = looks.by_place and len(looks.materials) > 1
    if own_rows and curves.crosses:
        curves = _with_one_shape_per_model(curves)
    elif not own_rows:
        # Open markers do not hide each other where curves coincide.
        curves = study_curves(campaign, study, boundary_elements, mfc="none")
    rows = [[material] for material in looks.materials] if own_rows else [looks.materials]
    ratio = _ratio_at_load if has_shape(campaign[study].to_dataset()) else ratio_points
    columns = [(_area_at_load, None), (ratio, None)]
    surfaces = list(dict.fromkeys(surface for surface, _ in looks.places))
    if looks.slopes_per_surface and len(surfaces) <= _MOST_SURFACES:
        columns = [(ratio, surface) for surface in surfaces]
    fig, panels = new_panels(0.5 + 2.8 * len(rows), len(rows), len(columns), sharex="col")
    shaped = ratio is not ratio_points
    by_load = "relative load F/(E* A0)" if shaped else "reduced pressure"
    unit = "relative load" if shaped else "reduced pressure F/(E* h'rms A0)"
    area = (_area_at_load, None) in columns
    say(
        fig,
        (_AREA if area else "") + f"Ratio of contact area and load, A/A0 divided by the {unit}, against the {by_load}.",
        _SHAPED if shaped else "",
    )
    say_models(fig, curves)
    measured = [
        (read_columns(table, known["columns"]), known) for table, known in zip(tables, measurements, strict=True)
    ]
    for row, materials in zip(panels, rows, strict=True):
        ratios = []
        for ax, (points, surface) in zip(row, columns, strict=True):
            of_panel = curves._replace(
                lines=_select(curves.lines, materials, surface), crosses=_select(curves.crosses, materials, surface)
            )
            [(_, values)] = draw_curves(of_panel, {ax: points}, unloading=True, count=len(curves.lines))
            for k, (curve, known) in enumerate(measured):
                if known["material"] in (None, *materials):
                    look = {"color": looks.material_colour(known["material"]), "ls": DASHES[k % len(DASHES)]}
                    values = np.append(values, _draw_measured(ax, points, *curve, known, look))
            words = [surface_label(campaign, surface)] if surface else []
            words += [looks.material_name(materials[0])] if own_rows else []
            ax.set_title(", ".join(words), loc="right", fontsize=8)
            ax.set_ylabel(label_of(_DRAWN[points][1]))
            ratios += [values] if points is ratio else []
        for ax in row[[points is ratio for points, _ in columns]]:
            limit_ratios(ax, np.concatenate(ratios))
    for ax, (points, _) in zip(panels[-1], columns, strict=True):
        ax.set_xlabel(label_of(_DRAWN[points][0]))
    add_legend(fig, panels.ravel(), curves)
    materials = {each.runs.surface_energy > 0 for each in curves.lines}
    if len(looks.places) > 1 and len({slope for _, slope in looks.places}) > 1:
        if False in materials:
            say(
                fig,
                """Without adhesion, the ratios of one topography at different slopes coincide, so that they hide each
                other.""",
            )
        if True in materials:
            say(fig, "Adhesion increases the contact area, most for the smallest slopes.")
    if own_rows:
        open_circles = "Open circles are without adhesion. " if False in materials else ""
        say(fig, f"{open_circles}Rows of panels have different scales.")
    if measurements:
        named = "; ".join(f"{each['label']} ({each['citation']})" for each in measurements)
        say(fig, f"Lines without markers are measurements: {named}.")
    return fig


def _with_one_shape_per_model(curves):
    """Return curves whose boundary elements all are upright crosses with a dashed line; the legend names the models."""
    shape = {"marker": MODEL_MARKERS[REFERENCE_NAME], "ls": TRUTH_LINE["ls"], "lw": 0.6}
    handles = {ASPERITIES_NAME: model_handle(ASPERITIES_NAME, **{"ls": "-", "lw": 0.9} | curves.looks.fill())}
    handles = curves.looks.colour_handles() | handles | {REFERENCE_NAME: model_handle(REFERENCE_NAME, **shape)}
    return curves._replace(crosses=[each._replace(look=each.look | shape) for each in curves.crosses], handles=handles)


def _select(curves, materials, surface):
    """Return the curves of some materials, and of one surface or, if it is None, of all surfaces."""
    contacts = [(curve, *curve.runs.contact) for curve in curves]
    return [curve for curve, material, place, _ in contacts if material in materials and surface in (None, place)]


def _draw_measured(ax, points, load, area, known, look):
    """Draw a measured curve, if its loads are known in the unit of the axis, and return the values that are drawn."""
    slope, modulus = known["rms_slope"], known["contact_modulus"]
    if points is ratio_points and modulus is None:  # reduced pressures already
        unit = 1.0
    elif points is ratio_points:
        unit = modulus * slope if slope else None
    else:
        unit = modulus or (1 / slope if slope else None)
    if unit is None:
        return np.empty(0)
    load = load / unit
    values = area if points is _area_at_load else area / load
    plot(ax, load, values, **look | {"lw": 1.1, "zorder": 1, "label": known["label"]})
    return values


def _area_at_load(run):
    return run["reduced_pressure"].values * float(run["unit_slope"]), run["contact_area_fraction"].values


def _ratio_at_load(run):
    pressure, ratio = ratio_points(run)
    return pressure * float(run["unit_slope"]), ratio / float(run["unit_slope"])


# Load and drawn quantity, by the function that returns the points of a run.
_DRAWN = {
    ratio_points: ("reduced_pressure", "area_over_load"),
    _area_at_load: ("relative_load", "contact_area_fraction"),
    _ratio_at_load: ("relative_load", "area_over_relative_load"),
}
