"""Fig. 7: contact stiffness against load, with the proportional law that theory and computations find."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.datasets import results
from icha.figures.curves import (
    PRESSURE_LABEL,
    add_legend,
    draw_crosses,
    draw_line,
    plausible,
    study_curves,
    whose_theories,
)
from icha.figures.declaration import Campaign, Declaration, Inputs, StudyFigure
from icha.figures.select import NothingToDraw
from icha.figures.style import BLACK, TWO_COLUMNS, logarithmic_axes, new_figure, panel_label, styled

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def inputs(campaign: Campaign, options: StudyFigure, files: results.ResultFiles) -> Inputs:
    """The runs, and theories for their first surface."""
    theories = files.path(results.THEORIES, surface=campaign.studies[options.study].surfaces[0])
    return {"campaign": files.path(results.DATASET), "references": theories}


DECLARATION = Declaration(
    description="Contact stiffness against load, with theory.",
    options=StudyFigure,
    inputs=inputs,
)


@styled
def figure(campaign: xr.DataTree, references: xr.Dataset | None = None, *, study: str) -> Figure:
    """Draw all runs of a study.

    Parameters
    ----------
    campaign : the campaign dataset.
    references : theory for the study's first surface (`icha.references.theories`), if any.
    study : name of the study.

    Raises
    ------
    ValueError
        If there is no such study or no run in it, or nothing in it has a positive load and stiffness (`NothingToDraw`).
    """
    curves = study_curves(campaign, study)
    fig = new_figure(TWO_COLUMNS, 3.3)
    left, right = fig.subplots(1, 2)
    pressures, stiffnesses = [], []
    for line in curves.lines:
        p, stiffness = draw_line(left, line, stiffness_points, logarithmic=True, lines=len(curves.lines))
        draw_line(right, line, _over_pressure, logarithmic=True, lines=len(curves.lines))
        pressures.append(p)
        stiffnesses.append(stiffness)
    for line in curves.beside:
        p, stiffness = draw_crosses(left, line, stiffness_points, logarithmic=True)
        draw_crosses(right, line, _over_pressure, logarithmic=True)
        pressures.append(p)
        stiffnesses.append(stiffness)
    logarithmic_axes(left)
    logarithmic_axes(right, "x")
    pressures, stiffnesses = np.concatenate(pressures), np.concatenate(stiffnesses)
    if not len(pressures):
        raise NothingToDraw(f"study {study}: no stop with a positive load and a positive stiffness to draw")
    x = (plausible(pressures).min() / 1.6, pressures.max() * 1.6)
    ratio = stiffnesses / pressures
    if references is not None and "persson_reduced_stiffness" in references:
        p = references["reduced_pressure"].values
        theory = references["persson_reduced_stiffness"].values
        shown = (p >= x[0] / 1.5) & (p <= x[1] * 1.5)
        look = {"ls": "-", "color": BLACK, "lw": 1, "label": "Yang & Persson", "zorder": 2}
        left.plot(p[shown], theory[shown], **look)
        right.plot(p[shown], theory[shown] / p[shown], **look)
        ratio = np.concatenate([ratio, theory[shown] / p[shown]])
    for ax, letter in ((left, "a"), (right, "b")):
        ax.set_xlim(x)
        ax.set_xlabel(PRESSURE_LABEL)
        panel_label(ax, letter)
    left.set_ylim(plausible(stiffnesses).min() / 2, stiffnesses.max() * 2)
    right.set_ylim(0, 1.15 * ratio.max())
    left.set_ylabel(r"contact stiffness  $K h_{\mathrm{rms}}/(E^{\ast}h_{\mathrm{rms}}^{\prime})$")
    right.set_ylabel(r"$K h_{\mathrm{rms}}/p$")
    further = whose_theories(campaign[study].to_dataset()) if references is not None else {}
    add_legend(fig, [left, right], curves, further)
    return fig


def _over_pressure(run):
    p, stiffness = stiffness_points(run)
    return p, stiffness / p


def stiffness_points(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Reduced pressures, and K h_rms/(E* h'_rms) = -dp*/d(u/h_rms), of the steps where both are positive."""
    unit = float(run["contact_modulus"] * run["rms_slope"] / run["rms_height"])
    p, stiffness = run["reduced_pressure"].values, run["contact_stiffness"].values / unit
    positive = (p > 0) & (stiffness > 0)
    return p[positive], stiffness[positive]
