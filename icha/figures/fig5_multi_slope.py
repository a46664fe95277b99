"""Fig. 5: contact area against load for several rms slopes and materials, with measurements."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from icha.datasets import results
from icha.figures.curves import (
    AREA_LABEL,
    PRESSURE_LABEL,
    RATIO_LABEL,
    add_legend,
    draw_curves,
    limit_ratios,
    ratio_points,
    study_curves,
)
from icha.figures.declaration import Campaign, Declaration, Inputs, TruthFigure
from icha.figures.style import DASHES, in_style, new_panels
from icha.support.input_files import read_columns

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class SlopesAndMaterialsFigure(TruthFigure):
    """A figure of all runs of a study, with boundary elements and measurements."""

    def arguments(self, campaign: Campaign) -> dict[str, Any]:
        """Return the arguments of `figure`, with the `measurements`."""
        known = []
        for each in self.measurements(campaign):
            names = ("label", "columns", "material", "rms_slope")
            unit = 1.0
            if each.load_is_pressure:
                unit = campaign.materials[each.material].contact_modulus * each.rms_slope
            known.append({name: getattr(each, name) for name in names} | {"load_unit": unit})
        return super().arguments(campaign) | ({"measurements": known} if known else {})

    def measurements(self, campaign: Campaign) -> list:
        """Return the measurements that belong to the study."""
        return [measurement for measurement in campaign.measurements.values() if measurement.study == self.study]


def inputs(campaign: Campaign, options: SlopesAndMaterialsFigure, files: results.ResultFiles) -> Inputs:
    """Return the paths of the campaign dataset and of the tables of measurements for the study, if any."""
    tables = [measurement.path for measurement in options.measurements(campaign)]
    return {"campaign": files.path(results.DATASET)} | ({"tables": tables} if tables else {})


DECLARATION = Declaration(
    description="Contact area against load for all slopes and materials, with measurements.",
    options=SlopesAndMaterialsFigure,
    inputs=inputs,
)


@in_style
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
    tables : files of measured curves; the left panel shows only curves with a known rms slope.
    measurements : for each table, the values of `label`, `columns` (headings and factors), `load_unit`, `material` and
        `rms_slope`. The `load_unit` is the load divided by the reduced pressure. Unknown values are None.
    """
    curves = study_curves(campaign, study, boundary_elements)
    looks = curves.looks
    # If colours distinguish surfaces and slopes, every material has a row of panels.
    own_rows = looks.by_place and len(looks.materials) > 1
    if not own_rows:
        # Open markers do not hide each other where curves coincide.
        curves = study_curves(campaign, study, boundary_elements, mfc="none")
    rows = [[material] for material in looks.materials] if own_rows else [looks.materials]
    fig, panels = new_panels(0.5 + 2.8 * len(rows), len(rows), sharex="col", sharey="col")
    ratios = []
    for (left, right), shown in zip(panels, rows, strict=True):
        of_row = curves._replace(
            lines=[line for line in curves.lines if line.runs.contact[0] in shown],
            crosses=[line for line in curves.crosses if line.runs.contact[0] in shown],
        )
        *_, (_, drawn) = draw_curves(of_row, {left: _points_at_load, right: ratio_points}, unloading=True)
        ratios.append(drawn)
        left.set_ylabel(AREA_LABEL)
        right.set_ylabel(RATIO_LABEL)
        if own_rows:
            right.set_title(looks.material_name(shown[0]), loc="right")
    limit_ratios(panels[0, 1], np.concatenate(ratios))
    left, right = panels[0]
    for k, (table, known) in enumerate(zip(tables, measurements, strict=True)):
        colour = looks.material_colour(known["material"])
        _draw_measured(left, right, table, known, colour, DASHES[k % len(DASHES)])
    panels[-1, 0].set_xlabel(r"relative load  $F/(E^{\ast}A_0)$")
    panels[-1, 1].set_xlabel(PRESSURE_LABEL)
    add_legend(fig, [left, right], curves)
    return fig


def _draw_measured(left, right, table, known, colour, dashes):
    """Draw a measured curve in the right panel, and also in the left panel if the rms slope is known."""
    load, area = read_columns(table, known["columns"])
    pressure, slope = load / known["load_unit"], known["rms_slope"]
    look = {"color": colour, "ls": dashes, "lw": 1.1, "zorder": 1}
    right.plot(pressure, area / pressure, label=known["label"], **look)
    if slope is not None:
        left.plot(pressure * slope, area, **look)


def _points_at_load(run):
    return run["reduced_pressure"].values * float(run["rms_slope"]), run["contact_area_fraction"].values
