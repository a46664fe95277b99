"""Fig. 17: force against indentation, in loading and unloading, beside Hertz and JKR."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.datasets.quantities import label_of
from icha.figures import select
from icha.figures.drawn import Name, plot, say
from icha.figures.indenter_curves import select_series, theory_curves
from icha.figures.looks import BRANCH_DASHES, legend_below
from icha.figures.select import lacks_sphere
from icha.figures.style import BLACK, GREY, in_style, legend_handle, new_panels
from icha.support.formatting import choose_unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


# Largest number of series in a panel.
_MOST_SERIES = 3
_LOOP = {"lw": 0.9, "alpha": 0.85}
_THEORIES = {"JKR": {"color": GREY, "lw": 2.4, "alpha": 0.45}, "Hertz": {"color": GREY, "lw": 0.9, "ls": ":"}}
_THEORY_WORDS = {
    "Hertz": """The dotted line is the theory of Hertz for a smooth sphere with the radius and the modulus of the runs
    in the same panel.""",
    "JKR": """The wide grey line is the theory of Johnson, Kendall and Roberts (JKR) for this sphere with the work of
    adhesion of these runs, with the states that are unstable under load control, from the pull-off force to the
    jump-off under displacement control.""",
}
# Space around the states of the runs, divided by their range.
_MARGIN = 0.06


@in_style
def figure(campaign: xr.DataTree, *, study: str) -> Figure:
    """Draw force against indentation for all runs of a study, with the theories for each radius and material.

    Series have a panel each if they are many, or if they differ in more than the rms height.
    """
    series = select_series(campaign, study)
    runs = [run for each in series for run in each.runs.by_seed.values()]
    force, depth = (np.concatenate([run[name].values for run in runs]) for name in ("force", "indentation"))
    (per_newton, force_unit), (per_metre, depth_unit) = (
        choose_unit(float(np.abs(values).max()), unit) for values, unit in ((force, "N"), (depth, "m"))
    )
    together = len(series) <= _MOST_SERIES and not any(each.contact for each in series)
    shown = [series] if together else [[each] for each in series]
    columns = min(len(shown), 2)
    rows = -(-len(shown) // columns)
    fig, panels = new_panels(2.7 * rows, rows, columns, width=3.55 * max(columns, 1.3), sharex=True, sharey=True)
    say(
        fig,
        """Force against indentation in loading (solid lines) and unloading (dashed lines). The indentation is the
        distance by which the apex of the shape without roughness has moved beyond the undeformed plane of the elastic
        body. Tension is negative. Every seed is a line of its own.""",
        """Colours become brighter with the rms height of the roughness; runs without roughness are black."""
        if not any(each.contact for each in series)
        else "",
    )
    largest = max(float(run["contact_radius"].max()) for run in runs)
    theories = {}
    for ax, of_panel in zip(panels.ravel(), shown, strict=False):
        of_sphere = theory_curves(of_panel[0].first_run, 1.5 * largest)
        theories |= of_sphere
        for name, (x, y) in of_sphere.items():
            plot(ax, x * per_metre, y * per_newton, name, zorder=1, **_THEORIES[name])
        for each in of_panel:
            for seed, run in each.runs.by_seed.items():
                for branch, leg in select.branches(run):
                    name = Name(branch, each.runs.labels._replace(seed=seed))
                    x, y = leg["indentation"] * per_metre, leg["force"] * per_newton
                    plot(ax, x.values, y.values, name, color=each.colour, ls=BRANCH_DASHES[branch], **_LOOP)
        ax.axhline(0, color=GREY, lw=0.5, zorder=0)
        if len(shown) > 1:
            ax.set_title(of_panel[0].name, loc="right")
        ax.set(xlabel=label_of("indentation", depth_unit), ylabel=label_of("force", force_unit))
        ax.set(xlim=_limits(depth * per_metre), ylim=_limits(force * per_newton))
        ax.label_outer()
    for ax in panels.ravel()[len(shown) :]:
        ax.remove()
    say(fig, *(_THEORY_WORDS[name] for name in ("Hertz", "JKR") if name in theories))
    dataset = campaign[study].to_dataset()
    if "JKR" in theories and (dataset["surface_energy"] == 0).any():
        say(fig, "Runs without adhesion have no line of JKR.")
    if lacks_sphere(dataset):
        say(fig, "Shapes without a radius and layers have neither line." if theories else "")
    named = [] if len(shown) > 1 else series
    handles = {each.name: legend_handle(color=each.colour, **_LOOP) for each in named}
    handles |= {name: legend_handle(color=BLACK, ls=dashes, **_LOOP) for name, dashes in BRANCH_DASHES.items()}
    handles |= {f"{name}, smooth sphere": legend_handle(**_THEORIES[name]) for name in theories}
    legend_below(fig, handles)
    return fig


def _limits(values):
    """Return the limits of an axis around some values."""
    room = _MARGIN * np.ptp(values)
    return float(values.min() - room), float(values.max() + room)
