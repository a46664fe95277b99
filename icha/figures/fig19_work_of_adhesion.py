"""Fig. 19: apparent work of adhesion of spherical indenters against the rms height of the roughness."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from icha.figures.captions import only_spheres, without_fit
from icha.figures.drawn import Name, plot, say
from icha.figures.indenter_curves import select_series
from icha.figures.looks import distinct_colours, legend_below
from icha.figures.select import NothingToDraw
from icha.figures.style import COLOURS, GREY, ONE_COLUMN, in_style, legend_handle, new_figure
from icha.support.formatting import choose_unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


# Name in the legend and marker of each quantity.
_QUANTITIES = {
    "work_of_adhesion_approach": ("JKR fit to loading", "o"),
    "work_of_adhesion_retraction": ("JKR fit to unloading", "s"),
    "pull_off": ("pull-off force over that of JKR", "^"),
}
_ONE_SEED = {"ls": "none", "ms": 3.2, "mew": 0.6, "mfc": "white"}
_MEAN = {"lw": 0.9, "ms": 5.0}

_CAPTION = """Apparent work of adhesion of rough spheres, divided by the work of adhesion Δγ of the material, against
the rms height of the roughness. Circles are fits of the theory of Johnson, Kendall and Roberts (JKR) to the first
loading, squares fits to the last unloading up to the largest tension. Each fit compares cubes of contact radii at given
forces, with the given E* and R. Triangles are the pull-off force divided by the pull-off force 3/2 π Δγ R of a smooth
sphere. Closed markers are means over the seeds; open markers are the single seeds. Lines join means of the same surface
or shape and the same material. Values of a smooth sphere by JKR are 1."""


@in_style
def figure(campaign: xr.DataTree, *, study: str) -> Figure:
    """Draw works of adhesion of fits and of pull-off, divided by the surface energy.

    Lines join means over seeds of series that differ only in their rms height.
    """
    series = select_series(campaign, study, only_jkr=True)
    if not any("pull_off_force_over_jkr" in run for each in series for run in each.runs.by_seed.values()):
        raise NothingToDraw(f"study {study}: no sphere with adhesion was pulled off; see the surfaces and materials")
    largest = max(float(run["rms_height"]) for each in series for run in each.runs.by_seed.values())
    scale, unit = choose_unit(largest, "m")
    contacts = list(dict.fromkeys(each.contact for each in series))
    colours = distinct_colours(len(contacts))
    fig = new_figure(1.25 * ONE_COLUMN, 2.9)
    ax = fig.subplots()
    dataset = campaign[study].to_dataset()
    say(fig, _CAPTION, without_fit(dataset), only_spheres(dataset))
    handles = {name: legend_handle(color=colour, lw=4) for name, colour in zip(contacts, colours, strict=True) if name}
    for (k, (quantity, (name, marker))), contact in itertools.product(enumerate(_QUANTITIES.items()), contacts):
        # Colours distinguish the quantities, or surfaces and materials if there are several.
        colour, means = colours[contacts.index(contact)] if contact else COLOURS[k], []
        for group in (each.runs for each in series if each.contact == contact):
            points = [(float(run["rms_height"]) * scale, value) for run, value in _values(group, quantity)]
            if points:
                of_seeds = Name(f"{name}, single seeds", group.labels._replace(seed=None))
                plot(ax, *np.transpose(points), of_seeds, marker=marker, mec=colour, **_ONE_SEED)
                means.append(np.mean(points, axis=0))
        if means:
            plot(ax, *np.transpose(means), f"{name}, mean", marker=marker, color=colour, **_MEAN)
            handles[name] = legend_handle(color=GREY if contact else colour, marker=marker, **_MEAN)
    ax.axhline(1, color=GREY, lw=0.6, zorder=0)
    ax.set(xlabel=f"rms height of the roughness ({unit})", ylabel=r"work of adhesion over $\Delta\gamma$")
    ax.margins(y=0.15)
    if not largest:
        ax.set_xticks([0])
    legend_below(fig, handles)
    return fig


def _values(group, quantity):
    """Return pairs of a run and its value, divided by the surface energy, for runs that have the quantity."""
    found = []
    for run in group.by_seed.values():
        if quantity == "pull_off" and "pull_off_force_over_jkr" in run:
            found.append((run, float(run["pull_off_force_over_jkr"])))
        elif quantity in run:
            found.append((run, float(run[quantity]) / float(run["surface_energy"])))
    return found
