"""Fig. 5: contact area against load for several rms slopes and materials, with measurements."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from icha.datasets import results
from icha.figures.curves import AREA_LABEL, PRESSURE_LABEL, add_legend, area_points, draw_curves, study_curves
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


# Height of the lower panels divided by the height of the upper panels.
_LOWER = 0.5


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
    tables : files of measured curves; panel (b) shows only curves with a known rms slope.
    measurements : for each table, the values of `label`, `columns` (headings and factors), `load_unit`, `material` and
        `rms_slope`. The `load_unit` is the load divided by the reduced pressure. Unknown values are None.
    """
    # Open markers do not hide each other where curves coincide.
    curves = study_curves(campaign, study, boundary_elements, mfc="none")
    fig, panels = new_panels(4.9, 2, sharex="col", sharey="row", height_ratios=(1, _LOWER))
    (left, right), (left_ratio, right_ratio) = panels
    ratios = {left_ratio: _area_per_pressure, right_ratio: _area_per_pressure_at_load}
    *_, (_, drawn), _ = draw_curves(curves, {left: area_points, right: _points_at_load} | ratios, unloading=True)
    for axes in ratios:
        axes.set_yscale("linear")
    left_ratio.set_ylim(0.9 * drawn.min(), 1.1 * drawn.max())
    for k, (table, known) in enumerate(zip(tables, measurements, strict=True)):
        colour = curves.looks.material_colour(known["material"])
        _draw_measured(left, right, table, known, colour, DASHES[k % len(DASHES)])
    left.set_ylabel(AREA_LABEL)
    left_ratio.set(xlabel=PRESSURE_LABEL, ylabel=r"$A E^{\ast}h′_{\mathrm{rms}}/F$")
    right_ratio.set_xlabel(r"relative load  $F/(E^{\ast}A_0)$")
    add_legend(fig, [left, right], curves)
    return fig


def _draw_measured(left, right, table, known, colour, dashes):
    """Draw a measured curve in panel (a), and also in panel (b) if the rms slope is known."""
    load, area = read_columns(table, known["columns"])
    pressure, slope = load / known["load_unit"], known["rms_slope"]
    look = {"color": colour, "ls": dashes, "lw": 1.1, "zorder": 1}
    left.plot(pressure, area, label=known["label"], **look)
    if slope is not None:
        right.plot(pressure * slope, area, **look)


def _points_at_load(run):
    return run["reduced_pressure"].values * float(run["rms_slope"]), run["contact_area_fraction"].values


def _area_per_pressure(run):
    """Return reduced pressures, and contact area fractions divided by reduced pressures."""
    pressure, area = area_points(run)
    return pressure, np.divide(area, pressure, out=np.full(area.shape, np.nan), where=pressure > 0)


def _area_per_pressure_at_load(run):
    return _points_at_load(run)[0], _area_per_pressure(run)[1]
