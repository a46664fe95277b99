"""Fig. 2: contact area and mean separation against load, with theories and published points."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from icha.figures.curves import (
    AREA_LABEL,
    PRESSURE_LABEL,
    SEPARATION_LABEL,
    add_legends,
    extra_height,
    study_curves,
)
from icha.figures.style import BLACK, GREY, TWO_COLUMNS, new_figure, panel_label, styled

CAPTION = (
    "Real contact area over nominal area (a) and mean separation over rms height (b) against the reduced pressure "
    "F/(E* h'rms A0), on double logarithmic axes. Markers: ICHA, one for each stop of the loading path; open markers "
    "are without adhesion. Lines: adhesionless theories of Persson (area) and of Yang and Persson (separation), and "
    "the linear law of Bush, Gibson and Thomas where few summits touch. Crosses: adhesionless Green's function "
    "molecular dynamics (GFMD) of other surfaces (H = 0.8, q1/q0 = 100, no roll-off), reduced from published data."
)


@styled
def figure(campaign: xr.DataTree, references: xr.Dataset | None = None, *, study: str) -> Figure:
    """Draw all runs of a study.

    Parameters
    ----------
    campaign : the campaign dataset.
    references : theories and points for the study's surface (`icha.reference.reference_dataset`), if any.
    study : name of the study.

    Raises
    ------
    ValueError
        If there is no such study or no run in it.
    """
    curves = study_curves(campaign, study)
    fig = new_figure(TWO_COLUMNS, 3.3 + extra_height(curves))
    left, right = fig.subplots(1, 2)
    pressures, areas, gaps = [], [], []
    for run, look in curves:
        p = run["reduced_pressure"].values
        left.loglog(p, run["contact_area_fraction"].values, **look)
        right.loglog(p, run["reduced_separation"].values, **look)
        pressures.append(p[p > 0])
        areas.append(run["contact_area_fraction"].values)
        gaps.append(run["reduced_separation"].values)
    pressures, areas, gaps = map(np.concatenate, (pressures, areas, gaps))
    gaps = gaps[gaps > 0]

    x = (pressures.min() / 1.6, max(pressures.max() * 1.6, 0.3))
    if references is not None:
        _draw_references(left, right, references, x)
    left.set_xlim(x)
    right.set_xlim(x)
    left.set_ylim(min(areas.min(), 1.6 * x[0]) / 1.5, 1)
    right.set_ylim(gaps.min() / 1.6, gaps.max() * 1.6)
    right.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    right.yaxis.set_minor_formatter(NullFormatter())
    if np.log10(gaps.max() / gaps.min()) < 1.5:
        right.set_yticks([t for t in (0.05, 0.1, 0.2, 0.5, 1, 2, 5) if gaps.min() / 1.6 < t < gaps.max() * 1.6])
    for ax, letter in ((left, "a"), (right, "b")):
        ax.set_xlabel(PRESSURE_LABEL)
        panel_label(ax, letter)
    left.set_ylabel(AREA_LABEL)
    right.set_ylabel(SEPARATION_LABEL)
    add_legends(fig, {left: "lower right", right: "lower left"}, curves)
    return fig


def _draw_references(left, right, references, limits):
    p = references["reduced_pressure"].values
    shown = (p >= limits[0] / 1.5) & (p <= limits[1] * 1.5)
    left.plot(
        p[shown], references["persson_area_fraction"].values[shown], "-", color=BLACK, lw=1, label="Persson", zorder=2
    )
    linear = references["linear_pressure"].values
    own = linear >= limits[0] / 1.5
    left.plot(
        linear[own],
        references["bush_gibson_thomas_area_fraction"].values[own],
        "--",
        color=GREY,
        lw=1,
        label="Bush, Gibson & Thomas",
        zorder=2,
    )
    left.plot(
        references["gfmd_reduced_pressure"].values,
        references["gfmd_area_fraction"].values,
        "x",
        color=BLACK,
        ms=6,
        mew=1.2,
        label="GFMD, no adhesion",
        zorder=5,
    )
    if "persson_reduced_separation" in references:
        right.plot(
            p[shown],
            references["persson_reduced_separation"].values[shown],
            "-",
            color=BLACK,
            lw=1,
            label="Yang & Persson",
            zorder=2,
        )
