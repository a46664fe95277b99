"""Fig. 5: contact area against load for several rms slopes and materials, with measurements where there are any."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from icha.figures.curves import (
    AREA_LABEL,
    PRESSURE_LABEL,
    UNLOADING,
    band_handle,
    draw_line,
    draw_ways_back,
    study_curves,
)
from icha.figures.select import name_of_place
from icha.figures.style import (
    BLACK,
    COLOURS,
    DASHES,
    GREY,
    MARKERS,
    TWO_COLUMNS,
    logarithmic_axes,
    material_label,
    new_figure,
    panel_label,
    slope_label,
    styled,
)

CAPTION = (
    "Real contact area over nominal area against the reduced pressure F/(E* h'rms A0) (a) and against F/(E* A0) (b) "
    "for several surfaces and rms slopes (shape of the markers) and materials (colour and size). Where there are "
    "several seeds the lines are means over them at common loads, with the 95 % band of confidence of the mean "
    "(Student's t). Without "
    "adhesion the curves of one topography, scaled to different slopes, are one curve in (a); what adhesion adds "
    "depends on the material and grows as the slope falls. In (b) the slope orders the curves: at a given load the "
    "area falls as the slope rises. Thin dashed lines, where there are any: the way back, unloading, while the load "
    "is compressive. Measurements, where given, are drawn as lines."
)


@dataclass(frozen=True, eq=False)
class MeasuredAreas:
    """A measured area-load curve: arrays of p/(E* h'rms) and A/A0, and what was measured, as far as it is known."""

    label: str
    citation: str
    reduced_pressure: np.ndarray
    area_fraction: np.ndarray
    material: str | None = None
    rms_slope: float | None = None


@styled
def figure(campaign: xr.DataTree, *, study: str, measurements: Sequence[MeasuredAreas] = ()) -> Figure:
    """Draw all runs of a study.

    Parameters
    ----------
    campaign : the campaign dataset.
    study : name of the study.
    measurements : measured curves to lay over; in panel (b) only those whose slope is known.

    Raises
    ------
    ValueError
        If there is no such study or no run in it.
    """
    curves = study_curves(campaign, study)
    dataset = campaign[study].to_dataset()
    materials = list(curves.colours)
    # The largest slope comes first and gets circles, as in the paper.
    places = dict.fromkeys((line.labels.surface, line.labels.rms_slope) for line in curves.lines)
    surfaces = dataset["surface"].values.tolist()
    places = sorted(places, key=lambda place: (surfaces.index(place[0]), -place[1]))
    colour, marker, size = curves.colours, {}, {}
    if curves.scale is None:
        colour = {name: COLOURS[k % len(COLOURS)] for k, name in enumerate(materials)}
        marker = {place: MARKERS[k % len(MARKERS)] for k, place in enumerate(places)}
        # Of curves that lie on each other all stay visible: later materials have smaller markers.
        size = {name: 7.0 * 0.68**k for k, name in enumerate(materials)}

    fig = new_figure(TWO_COLUMNS, 3.5)
    left, right = fig.subplots(1, 2, sharey=True)
    for line in curves.lines:
        labels = line.labels
        if curves.scale is None:
            own = {"marker": marker[labels.surface, labels.rms_slope], "mfc": "none", "ms": size[labels.material]}
            line = line._replace(look=line.look | own | dict.fromkeys(("color", "mec"), colour[labels.material]))
        line = line._replace(look=line.look | {"label": None})
        slope = float(line.runs[0]["rms_slope"])
        draw_ways_back([(left, lambda p, a, _: (p, a)), (right, lambda p, a, _, slope=slope: (p * slope, a))], line)
        draw_line(left, line, _points, logarithmic=True, lines=len(curves.lines))
        draw_line(right, line, _points_at_load, logarithmic=True, lines=len(curves.lines))
    for ax in (left, right):
        logarithmic_axes(ax)
    for k, measured in enumerate(measurements):
        look = {
            "color": colour.get(measured.material, BLACK),
            "ls": DASHES[k % len(DASHES)],
            "lw": 1.1,
            "zorder": 1,
        }
        left.plot(measured.reduced_pressure, measured.area_fraction, label=measured.label, **look)
        if measured.rms_slope is not None:
            right.plot(measured.reduced_pressure * measured.rms_slope, measured.area_fraction, **look)
    left.set_xlabel(PRESSURE_LABEL)
    right.set_xlabel(r"relative load  $F/(E^{\ast}A_0)$")
    left.set_ylabel(AREA_LABEL)

    several = len({surface for surface, _ in marker}) > 1
    place_handles = [
        Line2D(
            [],
            [],
            ls="none",
            marker=marker[place],
            mec=GREY,
            mfc="none",
            ms=6,
            label=name_of_place(dataset, *place) if several else slope_label(place[1]),
        )
        for place in marker
    ]
    material_handles = [
        Line2D(
            [],
            [],
            ls="none",
            marker="o",
            mec=colour[m],
            mfc="none",
            mew=1.1,
            ms=size[m],
            label=material_label(dataset, m),
        )
        for m in size
    ]
    if curves.scale:
        curves.scale.draw(fig, [left, right])
        named = {line.look["label"]: line.look | {"ls": "none", "ms": 5} for line in curves.lines if line.look["label"]}
        material_handles = [Line2D([], [], **look) for look in named.values()]
    if curves.unloaded:
        place_handles.append(Line2D([], [], color=GREY, label="unloading", **UNLOADING))
    if curves.several_seeds:
        place_handles.append(band_handle(len(line.runs) for line in curves.lines))
    if several:
        # Names of surfaces are long.
        handles = material_handles + place_handles
        fig.set_figheight(fig.get_figheight() + 0.1 * len(handles))
        fig.legend(handles=handles, loc="outside lower center", ncols=2)
        material_handles, place_handles = [], []
    if place_handles:
        right.legend(handles=place_handles, loc="lower right")
    first = left.legend(handles=material_handles, loc="lower right") if material_handles else None
    if measurements:
        if first is not None:
            left.add_artist(first)
        left.legend(loc="upper left", title="measured")
    for ax, letter in ((left, "a"), (right, "b")):
        panel_label(ax, letter)
    return fig


def _points(run):
    return run["reduced_pressure"].values, run["contact_area_fraction"].values


def _points_at_load(run):
    return run["reduced_pressure"].values * float(run["rms_slope"]), run["contact_area_fraction"].values
