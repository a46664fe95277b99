"""Fig. 5: contact area against load for several rms slopes and materials, with measurements where there are any."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from icha.datasets import results
from icha.figures.curves import (
    AREA_LABEL,
    PRESSURE_LABEL,
    UNLOADING,
    draw_crosses,
    draw_line,
    draw_ways_back,
    study_curves,
)
from icha.figures.declaration import Campaign, Declaration, Inputs
from icha.figures.ensembles import LINES_OF_SEEDS, lines_handles
from icha.figures.legends import legend_below, named_handles
from icha.figures.options import TruthFigure
from icha.figures.style import (
    BLACK,
    DASHES,
    GREY,
    TWO_COLUMNS,
    legend_handle,
    logarithmic_axes,
    material_label,
    new_figure,
    panel_label,
    styled,
)
from icha.support.input_files import read_columns

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
        "(b), for several surfaces and rms slopes (shape of the markers) and materials (colour and size). All shapes "
        f"are open, so that none hides another, and are interacting asperities. {LINES_OF_SEEDS} Without adhesion, "
        "the curves of one topography that is scaled to different slopes are one curve in (a). What adhesion adds "
        "depends on the material and grows as the slope falls. In (b) the curves are ordered by slope: at a given "
        "load the area falls as the slope rises. Upright crosses, if there are any, are boundary elements in the "
        "limit of a short range of attraction, on the same topographies (means over their seeds), in the colour of the "
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
    curves = study_curves(campaign, study, boundary_elements)
    dataset = campaign[study].to_dataset()
    # Of curves that lie on each other all stay visible: later materials have smaller markers.
    drawn = [
        name for name in dataset["material"].values.tolist() if any(x.labels.material == name for x in curves.lines)
    ]
    size = {name: max(7.0 * 0.7**k, 1.6) for k, name in enumerate(drawn)}

    fig = new_figure(TWO_COLUMNS, 3.5)
    left, right = fig.subplots(1, 2, sharey=True)
    for line in curves.lines:
        labels = line.labels
        if curves.scale is None:
            line = line._replace(look=line.look | {"mfc": "none", "ms": size[labels.material]})
        slope = float(line.runs[0]["rms_slope"])
        draw_ways_back([(left, lambda p, a, _: (p, a)), (right, lambda p, a, _, slope=slope: (p * slope, a))], line)
        draw_line(left, line, _points, logarithmic=True, lines=len(curves.lines))
        draw_line(right, line, _points_at_load, logarithmic=True, lines=len(curves.lines))
    for line in curves.beside:
        draw_crosses(left, line, _points, logarithmic=True)
        draw_crosses(right, line, _points_at_load, logarithmic=True)
    for ax in (left, right):
        logarithmic_axes(ax)
    for k, (table, known) in enumerate(zip(tables, measurements, strict=True)):
        _draw_measured(left, right, table, known, curves.colours.get(known["material"], BLACK), DASHES[k % len(DASHES)])
    left.set_xlabel(PRESSURE_LABEL)
    right.set_xlabel(r"relative load  $F/(E^{\ast}A_0)$")
    left.set_ylabel(AREA_LABEL)

    if curves.scale:
        curves.scale.draw(fig, [left, right])
    unloading = {"unloading": legend_handle(color=GREY, **UNLOADING)} if curves.unloaded else {}
    seeds = lines_handles(len(line.runs) for line in curves.lines)
    open_shapes = {} if curves.scale else {material_label(dataset, m): _open(curves.colours[m], size[m]) for m in size}
    legend_below(fig, curves.handles | open_shapes | unloading | seeds | named_handles([left]))
    for ax, letter in ((left, "a"), (right, "b")):
        panel_label(ax, letter)
    return fig


def _open(colour, size):
    """What the legend shows of a material."""
    return legend_handle(ls="none", marker="o", color=colour, mfc="none", mew=1.1, ms=size)


def _draw_measured(left, right, table, known, colour, dashes):
    """Draw a measured curve; over the load only if its slope is known."""
    load, area = read_columns(table, known["columns"])
    pressure, slope = load / known["load_unit"], known["rms_slope"]
    look = {"color": colour, "ls": dashes, "lw": 1.1, "zorder": 1}
    left.plot(pressure, area, label=known["label"], **look)
    if slope is not None:
        right.plot(pressure * slope, area, **look)


def _points(run):
    return run["reduced_pressure"].values, run["contact_area_fraction"].values


def _points_at_load(run):
    return run["reduced_pressure"].values * float(run["rms_slope"]), run["contact_area_fraction"].values
