"""Fig. 7: contact stiffness against load."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.datasets.quantities import label_of
from icha.figures.captions import theories_of_flat_surfaces
from icha.figures.curves import add_legend, draw_curves, drop_rounding_errors, say_models, study_curves
from icha.figures.drawn import plot, say
from icha.figures.looks import ASPERITIES_NAME
from icha.figures.select import NothingToDraw
from icha.figures.style import BLACK, in_style, new_panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

_CAPTION = """Contact stiffness K = -dp/du against the reduced pressure F/(E* h'rms A0), with the nominal pressure p and
the mean separation u, in units of E* h'rms/h_rms (a) and of p/h_rms (b). In panel (b), a stiffness proportional to the
pressure is a horizontal line."""
_EDGES = """Boundary elements include the motion of the edges of contact. With adhesion they vary as the edges move
across cells, for a single sphere by 7 to 60 %."""
_YANG = """The black line is the theory of Yang and Persson for an infinite surface without adhesion, where the
stiffness at small loads is proportional to the load. On a finite surface it is larger, because only the highest parts
touch (Pastewka et al., Phys. Rev. E 87 (2013) 062809)."""


@in_style
def figure(campaign: xr.DataTree, references: xr.Dataset | None = None, *, study: str) -> Figure:
    """Draw all runs of a study, and the theory for the study's first surface (`icha.references.theories`), if any."""
    curves = study_curves(campaign, study, points=stiffness_points)
    fig, [(left, right)] = new_panels(3.3)
    dataset = campaign[study].to_dataset()
    say(fig, _CAPTION)
    say_models(fig, curves)
    models = {curve.runs.model_name for curve in (*curves.lines, *curves.crosses)}
    if ASPERITIES_NAME in models:
        say(fig, "The asperity model gives the stiffness for spots that do not form, break or unite.")
        if not all(line.runs.surface_energy for line in curves.lines):
            say(fig, "Open shapes are results without adhesion.")
    if models - {ASPERITIES_NAME}:
        say(fig, _EDGES)
    (pressures, stiffnesses), _ = draw_curves(curves, {left: stiffness_points, right: _over_pressure})
    right.set_yscale("linear")
    if not len(pressures):
        raise NothingToDraw(f"study {study}: no step of the first loading has a positive load and a positive stiffness")
    x = (drop_rounding_errors(pressures).min() / 1.6, pressures.max() * 1.6)
    ratio = stiffnesses / pressures
    if references is not None and "persson_reduced_stiffness" in references:
        p = references["reduced_pressure"].values
        theory = references["persson_reduced_stiffness"].values
        shown = (p >= x[0] / 1.5) & (p <= x[1] * 1.5)
        say(fig, _YANG)
        look = {"ls": "-", "color": BLACK, "lw": 1, "label": "Yang & Persson", "zorder": 2}
        plot(left, p[shown], theory[shown], **look)
        plot(right, p[shown], theory[shown] / p[shown], **look)
        ratio = np.concatenate([ratio, theory[shown] / p[shown]])
    y = (drop_rounding_errors(stiffnesses).min() / 2, stiffnesses.max() * 2)
    label = label_of("reduced_pressure")
    left.set(xlim=x, xlabel=label, ylim=y, ylabel=label_of("reduced_stiffness"))
    right.set(xlim=x, xlabel=label, ylim=(0, 1.15 * ratio.max()), ylabel=label_of("stiffness_over_pressure"))
    say(fig, "States with negative pressure or negative stiffness are left out.", theories_of_flat_surfaces(dataset))
    add_legend(fig, [left, right], curves)
    return fig


def _over_pressure(run):
    p, stiffness = stiffness_points(run)
    return p, stiffness / p


def stiffness_points(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return p* and the reduced stiffness -dp*/d(u/h_rms) of all steps at which both quantities are positive."""
    unit = float(run["contact_modulus"] * run["unit_slope"] / run["unit_height"])
    p, stiffness = run["reduced_pressure"].values, run["contact_stiffness"].values / unit
    positive = (p > 0) & (stiffness > 0)
    return p[positive], stiffness[positive]
