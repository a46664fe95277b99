"""Fig. 18: the straight line of JKR, with the works of adhesion fitted to loading and unloading."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.figures.captions import only_spheres, without_fit
from icha.figures.drawn import Name, plot, say
from icha.figures.indenter_curves import select_series
from icha.figures.looks import legend_below
from icha.figures.style import GREY, in_style, legend_handle, new_panels
from icha.support.formatting import choose_unit, format_quantity

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


# Variables of the works of adhesion; title of the panel and marker of the states.
_TITLES = {"approach": ("loading", "o"), "retraction": ("unloading", "s")}
_STATES = {"ls": "none", "ms": 2.8, "mew": 0.6, "mfc": "white"}
_FIT = {"lw": 0.9, "ls": "-"}

_CAPTION = """Linearised plot of the equation of Johnson, Kendall and Roberts (JKR), for the first loading (a) and the
last unloading up to the largest tension (b). Here F is the force, R the radius of the smooth sphere, and a the radius
of a circle with the true contact area. A smooth sphere with a Tabor parameter of 3 or more gives a straight line of
slope 3/(4 E*), and the work of adhesion w follows from the value at F = 0, 3 sqrt(8 π E* w)/(4 E*). Markers are states
of all seeds, at most one hundred of each run at equal steps of the indentation. States with F/a^(3/2) below -sqrt(8 π
E* Δγ), where no sphere of JKR has contact, are not shown. Lines are fits of JKR with the given E* and R, one for each
seed. A fit minimises the squared differences of a³ at given F, so states with a large radius have most weight. The
legend gives the means over the seeds of the fitted work of adhesion."""


@in_style
def figure(campaign: xr.DataTree, *, study: str) -> Figure:
    """Draw a^(3/2)/R against F/a^(3/2) for loading and unloading, with the fitted JKR lines.

    The equation of JKR, F = 4 E* a^3/(3 R) - sqrt(8 pi E* w a^3), is the straight line y = 3 (x + sqrt(8 pi E* w))/(4
    E*) with x = F/a^(3/2) and y = a^(3/2)/R. Runs without adhesion, without a radius R, and on a layer are left out.
    """
    from icha.references.indenter_runs import BRANCHES, spaced_states, steps_of

    series = select_series(campaign, study, only_jkr=True)
    drawn = []
    for each in series:
        for seed, run in each.runs.by_seed.items():
            labels = each.runs.labels._replace(seed=seed)
            for branch, choose in BRANCHES.items():
                states = choose(steps_of(run))
                chosen = [states[k] for k in spaced_states([state["indentation"] for state in states])]
                force, radius = (np.array([state[name] for state in chosen]) for name in ("force", "contact_radius"))
                x, y = force / radius**1.5, radius**1.5 / float(run["shape_radius"])
                # The line of JKR is zero here. States beyond it, of little contact area, would hide the others.
                inside = x > -np.sqrt(8 * np.pi * float(run["contact_modulus"] * run["surface_energy"]))
                drawn.append((branch, each, labels, run, x[inside], y[inside]))
    scale, unit = choose_unit(max(float(np.abs(x).max(initial=0.0)) for *_, x, _ in drawn), "N")
    fig, [panels] = new_panels(3.0, sharex=True, sharey=True)
    dataset = campaign[study].to_dataset()
    say(fig, _CAPTION, without_fit(dataset), only_spheres(dataset))
    for branch, each, labels, run, x, y in drawn:
        ax = panels[list(_TITLES).index(branch)]
        plot(ax, x * scale, y * 1e3, Name("states", labels), marker=_TITLES[branch][1], mec=each.colour, **_STATES)
        if (name := f"work_of_adhesion_{branch}") in run:
            modulus = float(run["contact_modulus"])
            line = 0.75 / modulus * (x + np.sqrt(8 * np.pi * modulus * float(run[name])))
            plot(ax, x * scale, line * 1e3, Name("fit of JKR", labels), color=each.colour, **_FIT)
    for ax, (name, _) in zip(panels, _TITLES.values(), strict=True):
        ax.set_title(name, loc="right")
        ax.set(xlabel=rf"$F/a^{{3/2}}$  ({unit} m$^{{-3/2}}$)", ylabel=r"$a^{3/2}/R$  ($10^{-3}$ m$^{1/2}$)")
        ax.label_outer()
    handles = {f"{each.name}: {_works(each)}": legend_handle(color=each.colour, **_FIT) for each in series}
    states = {"states": legend_handle(marker="o", mec=GREY, **_STATES), "fit of JKR": legend_handle(color=GREY, **_FIT)}
    legend_below(fig, handles | states)
    return fig


def _works(series):
    """Return the mean fitted works of adhesion of a series as text, or why there are none."""
    from icha.references.indenter_runs import reason_without_fit

    words, runs = [], list(series.runs.by_seed.values())
    for branch, (title, _) in _TITLES.items():
        name = f"work_of_adhesion_{branch}"
        values = [float(run[name]) for run in runs if name in run]
        if values:
            fewer = f" ({len(values)} of {len(runs)} seeds)" if len(values) < len(runs) else ""
            words.append(f"{title} {format_quantity(float(f'{np.mean(values):.3g}'), 'J/m²')}{fewer}")
        else:
            words.append(f"{title} no fit ({reason_without_fit(runs[0], branch)})")
    return ", ".join(words)
