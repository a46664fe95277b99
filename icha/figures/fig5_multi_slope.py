"""Fig. 5: contact area against load for several rms slopes and materials, with measurements where there are any."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from icha.datasets import results
from icha.datasets.measured_table import read_columns
from icha.figures.curves import (
    AREA_LABEL,
    PRESSURE_LABEL,
    UNLOADING,
    Line,
    band_handle,
    draw_line,
    draw_ways_back,
    study_curves,
)
from icha.figures.declaration import Campaign, Declaration, Inputs
from icha.figures.options import TruthFigure
from icha.figures.select import name_of_place, path_steps, runs_by_boundary_elements
from icha.figures.style import (
    BLACK,
    COLOURS,
    DASHES,
    GREY,
    MARKERS,
    TWO_COLUMNS,
    legend_handle,
    logarithmic_axes,
    material_label,
    new_figure,
    panel_label,
    slope_label,
    styled,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def inputs(campaign: Campaign, options: TruthFigure, files: results.ResultFiles) -> Inputs:
    """The runs, and tables of measurements that belong to the study, if there are any."""
    tables = [measurement.path for measurement in _measurements(campaign, options)]
    return {"campaign": files.path(results.DATASET)} | ({"tables": tables} if tables else {})


def arguments(campaign: Campaign, options: TruthFigure) -> dict[str, Any]:
    """What is to be known of each table."""
    known = [
        {
            "label": measurement.label,
            "columns": measurement.columns,
            "load_unit": _load_unit(campaign, measurement),
            "material": measurement.material,
            "rms_slope": measurement.rms_slope,
        }
        for measurement in _measurements(campaign, options)
    ]
    return {"measurements": known} if known else {}


def _measurements(campaign, options):
    return [measurement for measurement in campaign.measurements.values() if measurement.study == options.study]


def _load_unit(campaign, measurement) -> float:
    """What a measured load is divided by to become p/(E* h'rms)."""
    if not measurement.load_is_pressure:
        return 1.0
    return campaign.materials[measurement.material].contact_modulus * measurement.rms_slope


DECLARATION = Declaration(
    description="Contact area against load for all slopes and materials, with measurements.",
    caption=(
        "Real contact area over nominal area against the reduced pressure F/(E* h'rms A0) (a) and against F/(E* A0) "
        "(b), for several surfaces and rms slopes (shape of the markers) and materials (colour and size). Where there "
        "are several seeds, the lines are means over them at common loads, with the 95 % confidence band of the mean "
        "(Student's t). Without adhesion, the curves of one topography that is scaled to different slopes are one "
        "curve in (a). What adhesion adds depends on the material and grows as the slope falls. In (b) the curves are "
        "ordered by slope: at a given load the area falls as the slope rises. Upright crosses, if there are any, are "
        "boundary elements in the limit of a short range of attraction, on the same topographies, in the colour of the "
        "material. Thin dashed lines, if there are any, show unloading as long as the load is compressive. "
        "Measurements, if there are any, are drawn as lines."
    ),
    options=TruthFigure,
    inputs=inputs,
    arguments=arguments,
)


@styled
def figure(
    campaign: xr.DataTree,
    tables: Sequence[str | os.PathLike] = (),
    *,
    study: str,
    boundary_elements: str | None = None,
    measurements: Sequence[Mapping[str, Any]] = (),
) -> Figure:
    """Draw all runs of a study.

    Parameters
    ----------
    campaign : the campaign dataset.
    tables : files of measured curves to lay over; in panel (b) only those whose slope is known.
    study : name of the study.
    boundary_elements : name of a study whose runs by boundary elements are drawn beside; left out, the study itself.
    measurements : of each table its `label`, `columns` (headings of load and area, with factors), `load_unit` (what a
        load is divided by to become p/(E* h'rms)), and `material` and `rms_slope`, None where they are not known.

    Raises
    ------
    ValueError
        If there is no such study or no run in it, or a table cannot be read.
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
    crosses = _draw_boundary_elements((left, right), campaign, boundary_elements or study, colour)
    for ax in (left, right):
        logarithmic_axes(ax)
    for k, (table, known) in enumerate(zip(tables, measurements, strict=True)):
        _draw_measured(left, right, table, known, colour.get(known["material"], BLACK), DASHES[k % len(DASHES)])
    left.set_xlabel(PRESSURE_LABEL)
    right.set_xlabel(r"relative load  $F/(E^{\ast}A_0)$")
    left.set_ylabel(AREA_LABEL)

    _add_legends(fig, (left, right), curves, dataset, _Looks(colour, marker, size), crosses)
    if measurements:
        first = left.get_legend()
        if first is not None:
            left.add_artist(first)
        left.legend(loc="upper left", title="measured")
    for ax, letter in ((left, "a"), (right, "b")):
        panel_label(ax, letter)
    return fig


class _Looks(NamedTuple):
    """Colours of the materials, markers of the surfaces and slopes, sizes of the materials' markers."""

    colour: dict[str, str]
    marker: dict[tuple[str, float], str]
    size: dict[str, float]


def _draw_boundary_elements(panels, campaign, study, colour):
    """Mark the runs of a study by boundary elements, means over their seeds; returns their entries of the legend."""
    runs = runs_by_boundary_elements(campaign, study)
    lines: dict[tuple, list] = {}
    for labels, run in runs:
        lines.setdefault((labels.surface, labels.rms_slope, labels.material), []).append((labels, run))
    for (*_, material), members in lines.items():
        (first, *_), own = zip(*members, strict=True)
        look = _CROSS | dict.fromkeys(("color", "mec"), colour.get(material, GREY))
        line = Line(first, [path_steps(run) for run in own], [], look)
        for ax, points in zip(panels, (_points, _points_at_load), strict=True):
            draw_line(ax, line, points, logarithmic=True, lines=len(lines))
    return runs and [legend_handle(**_CROSS, mec=GREY, label="boundary elements")]


_CROSS = {"ls": "none", "marker": "+", "ms": 8, "mew": 1.0, "zorder": 6}


def _draw_measured(left, right, table, known, colour, dashes):
    """Draw a measured curve; over the load only if its slope is known."""
    load, area = read_columns(table, known["columns"])
    pressure, slope = load / known["load_unit"], known["rms_slope"]
    look = {"color": colour, "ls": dashes, "lw": 1.1, "zorder": 1}
    left.plot(pressure, area, label=known["label"], **look)
    if slope is not None:
        right.plot(pressure * slope, area, **look)


def _add_legends(fig, panels, curves, dataset, looks, crosses):
    """Name materials in the first panel and all else in the second, or, where names are long, all below."""
    left, right = panels
    several = len({surface for surface, _ in looks.marker}) > 1
    place_handles = [
        legend_handle(
            ls="none",
            marker=marker,
            mec=GREY,
            mfc="none",
            ms=6,
            label=name_of_place(dataset, *place) if several else slope_label(place[1]),
        )
        for place, marker in looks.marker.items()
    ]
    material_handles = [
        legend_handle(
            ls="none", marker="o", mec=looks.colour[m], mfc="none", mew=1.1, ms=size, label=material_label(dataset, m)
        )
        for m, size in looks.size.items()
    ]
    if curves.scale:
        curves.scale.draw(fig, [left, right])
        named = {line.look["label"]: line.look | {"ls": "none", "ms": 5} for line in curves.lines if line.look["label"]}
        material_handles = [legend_handle(**look) for look in named.values()]
    place_handles += crosses
    if curves.unloaded:
        place_handles.append(legend_handle(color=GREY, label="unloading", **UNLOADING))
    if curves.several_seeds:
        place_handles.append(band_handle(len(line.runs) for line in curves.lines))
    if several:
        # Names of surfaces are long.
        handles = material_handles + place_handles
        fig.set_figheight(fig.get_figheight() + 0.1 * len(handles))
        fig.legend(handles=handles, loc="outside lower center", ncols=2)
        return
    if place_handles:
        right.legend(handles=place_handles, loc="lower right")
    if material_handles:
        left.legend(handles=material_handles, loc="lower right")


def _points(run):
    return run["reduced_pressure"].values, run["contact_area_fraction"].values


def _points_at_load(run):
    return run["reduced_pressure"].values * float(run["rms_slope"]), run["contact_area_fraction"].values
