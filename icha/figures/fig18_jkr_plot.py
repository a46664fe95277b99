"""Fig. 18: the straight line of JKR, with the works of adhesion fitted to loading and unloading."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.figures.declaration import Declaration
from icha.figures.indenter_curves import IndenterFigure, first_run, select_series, sphere_of, steps_of
from icha.figures.looks import legend_below
from icha.figures.select import NothingToDraw
from icha.figures.style import GREY, in_style, legend_handle, new_panels
from icha.support.formatting import choose_unit, format_quantity

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

DECLARATION = Declaration(
    description="Linearised JKR plot of spherical indenters, with fits to loading and unloading.",
    options=IndenterFigure,
)

# Variables of the works of adhesion; title of the panel and marker of the states.
_BRANCHES = {"approach": ("loading", "o"), "retraction": ("unloading", "s")}
_STATES = {"ls": "none", "ms": 2.8, "mew": 0.6, "mfc": "white"}
_FIT = {"lw": 0.9, "ls": "-"}


@in_style
def figure(campaign: xr.DataTree, *, study: str) -> Figure:
    """Draw a^(3/2)/R against F/a^(3/2) for loading and unloading, with the fitted JKR lines.

    The equation of JKR, F = 4 E* a^3/(3 R) - sqrt(8 pi E* w a^3), is the straight line y = 3 (x + sqrt(8 pi E* w))/(4
    E*) with x = F/a^(3/2) and y = a^(3/2)/R. Runs without a radius R and runs on a layer are left out.
    """
    from icha.references.indenter_runs import first_approach, last_retraction, spaced_states

    # The runs of a series have the same shape and material.
    spheres = [(each, sphere_of(first_run([each]))) for each in select_series(campaign, study)]
    series = [each for each, sphere in spheres if sphere]
    if not any(sphere and sphere[2] for _, sphere in spheres):
        raise NothingToDraw(f"study {study}: no sphere with adhesion; the figure needs a radius and a surface energy")
    states_of = {"approach": first_approach, "retraction": last_retraction}
    drawn = []
    for each in series:
        for run in each.runs.by_seed.values():
            for branch, choose in states_of.items():
                states = choose(steps_of(run))
                chosen = [states[k] for k in spaced_states([state["indentation"] for state in states])]
                force, radius = (np.array([state[name] for state in chosen]) for name in ("force", "contact_radius"))
                drawn.append((branch, each, run, force / radius**1.5, radius**1.5 / float(run["shape_radius"])))
    scale, unit = choose_unit(max(float(np.abs(x).max()) for *_, x, _ in drawn), "N")
    fig, [panels] = new_panels(3.0, sharex=True, sharey=True)
    for branch, each, run, x, y in drawn:
        ax = panels[list(_BRANCHES).index(branch)]
        ax.plot(x * scale, y * 1e3, marker=_BRANCHES[branch][1], mec=each.colour, **_STATES)
        if (name := f"work_of_adhesion_{branch}") in run:
            modulus = float(run["contact_modulus"])
            line = 0.75 / modulus * (x + np.sqrt(8 * np.pi * modulus * float(run[name])))
            ax.plot(x * scale, line * 1e3, color=each.colour, **_FIT)
    for ax, (name, _) in zip(panels, _BRANCHES.values(), strict=True):
        ax.set_title(name, loc="right")
        ax.set(xlabel=rf"$F/a^{{3/2}}$  ({unit} m$^{{-3/2}}$)", ylabel=r"$a^{3/2}/R$  ($10^{-3}$ m$^{1/2}$)")
        ax.label_outer()
    handles = {f"{each.name}: {_works(each)}": legend_handle(color=each.colour, **_FIT) for each in series}
    states = {"states": legend_handle(marker="o", mec=GREY, **_STATES), "fit of JKR": legend_handle(color=GREY, **_FIT)}
    legend_below(fig, handles | states)
    return fig


def _works(series):
    """Return the mean fitted works of adhesion of a series as text."""
    words = []
    for branch, (title, _) in _BRANCHES.items():
        name = f"work_of_adhesion_{branch}"
        values = [float(run[name]) for run in series.runs.by_seed.values() if name in run]
        words.append(f"{title} {format_quantity(float(f'{np.mean(values):.3g}'), 'J/m²') if values else 'no fit'}")
    return ", ".join(words)
