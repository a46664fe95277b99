"""Fig. 16: where and when spots form and break in loading and unloading."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.contact.model import EVENT_KINDS
from icha.contact.models import REFERENCE_MODEL
from icha.datasets.labels import RunLabels
from icha.datasets.quantities import label_of
from icha.figures.captions import grid_of_loops
from icha.figures.drawn import plot, say
from icha.figures.looks import BRANCH_DASHES, COARSE_GRID_ALONE, NOT_APPLICABLE_ALONE, legend_below
from icha.figures.maps import topography_of
from icha.figures.select import is_good_loop, select_complete_run, unloading_legs
from icha.figures.style import BLACK, GREY, in_style, legend_handle, material_label, new_panels, slope_label

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


_RED = (0.9, 0.0, 0.05)
# Each kind of event has a name in the legend, a branch for which the map shows the events, and a look of the marks.
# Marks are black if spots form or unite, and red if spots break or separate. Other colours stand for materials.
_KINDS = {
    "jump_in": ("spot formed", "loading", {"marker": "o", "mfc": BLACK, "mec": BLACK}),
    "jump_off": ("spot broken", "unloading", {"marker": "o", "mfc": "none", "mec": _RED}),
    "coalescence": ("union", "loading", {"marker": "D", "mfc": "none", "mec": BLACK}),
    "split": ("union undone", "unloading", {"marker": "+", "mec": _RED}),
}
# If every kind has at most _FEW events, marks have the size _SIZE, in points. Otherwise marks are smaller, so that the
# total area of the marks remains about the same. No mark is smaller than _LEAST_SIZE.
_FEW = 60
_SIZE = 5.0
_LEAST_SIZE = 1.6


@in_style
def figure(campaign: xr.DataTree, surface: xr.Dataset, *, run: Sequence) -> Figure:
    """Draw the events of one run on a map of the topography, and the number of events against the mean separation.

    Parameters
    ----------
    campaign : the campaign dataset.
    surface : dataset of the surface file, with the topography of the run.
    run : labels of the run.
    """
    labels = RunLabels(*run)
    data = select_complete_run(campaign, labels)
    events = _events(data)
    fig, [(where, when)] = new_panels(3.1, width_ratios=(1.3, 1))
    unions = "coalescence" in events["kind"]
    say(
        fig,
        """Events of one run. Panel (a) shows where spots formed in the first loading and broke in the last unloading,
        on a map of the topography with the highest parts white.""",
        "A spot forms by a jump into contact and breaks by a jump off." if float(data["surface_energy"]) else "",
        "Marks of unions are at the centre of the united spot." if unions else "",
        """The legend gives the number of marks of each kind. Panel (b) shows the number of events since the beginning
        of loading (solid lines) or unloading (dashed lines) against the mean separation, in the colours of panel
        (a).""",
        "Thin lines count unions." if unions else "",
        grid_of_loops(campaign, [labels.study]),
    )
    handles = _draw_places(where, topography_of(data, surface), events)
    _draw_counts(when, events)
    title = f"{material_label(campaign[labels.study].to_dataset(), labels.material)}, {slope_label(labels.rms_slope)}"
    when.set_title(title, loc="right", fontsize="small")
    handles |= {name: legend_handle(color=GREY, ls=dashes, lw=1.1) for name, dashes in BRANCH_DASHES.items()}
    if not is_good_loop(data):
        words = COARSE_GRID_ALONE if labels.model == REFERENCE_MODEL else NOT_APPLICABLE_ALONE
        handles |= {words: legend_handle(ls="none")}
    legend_below(fig, handles)
    return fig


def _draw_places(ax, topography, events):
    """Draw events over the topography; return the legend entries by name."""
    # The map is light, so that the marks are visible.
    image = topography.draw(ax, cmap="gray", vmin=-2.2 * topography.highest, vmax=topography.highest)
    topography.label(ax)
    marks = {name: (events["kind"] == name) & (events["branch"] == branch) for name, (_, branch, _) in _KINDS.items()}
    most = max(np.count_nonzero(shown) for shown in marks.values())
    size = max(_LEAST_SIZE, _SIZE * min(1.0, (_FEW / max(most, 1)) ** 0.5))
    handles = {}
    for name, (words, _, look) in _KINDS.items():
        shown = marks[name]
        # Rings are larger than dots, and squares larger than crosses, so that both marks at one position are visible.
        ring = 1.6 if name in ("jump_off", "coalescence") else 1.0
        x, y = (events[axis][shown] * topography.length for axis in "xy")
        points = plot(ax, x, y, words, **{"ls": "none", "ms": ring * size, "mew": 0.9} | look)
        if shown.any():
            handles[f"{words} ({np.count_nonzero(shown)})"] = points
    bar = ax.figure.colorbar(image, ax=ax, shrink=0.9, pad=0.02, aspect=28)
    bar.set_label(f"height ({topography.height_unit})")
    bar.ax.set_ylim(-topography.highest, topography.highest)
    return handles


def _draw_counts(ax, events):
    """Draw the cumulative number of events against the mean separation, by kind of event and branch."""
    from matplotlib.ticker import MaxNLocator

    for name, (words, _, look) in _KINDS.items():
        width = 0.6 if name in ("coalescence", "split") else 1.3
        for branch, dashes in BRANCH_DASHES.items():
            separation = events["separation"][(events["kind"] == name) & (events["branch"] == branch)]
            if len(separation):
                steps, counts = np.append(separation[0], separation), np.arange(len(separation) + 1)
                plot(
                    ax,
                    steps,
                    counts,
                    f"{words}, {branch}",
                    color=look["mec"],
                    ls=dashes,
                    lw=width,
                    drawstyle="steps-post",
                )
    ax.set_ylim(bottom=0)
    ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set(xlabel=label_of("reduced_separation"), ylabel="events so far")


def _events(run):
    """Return kind, branch, position (m) and separation u/h_rms of the events in first loading and last unloading."""
    from icha.datasets.campaign import unit_height

    steps = run["event_step"].values.astype(int)
    leg = run["leg"].sel(step=steps).values
    shown = (leg == 0) | (leg == unloading_legs(run)[-1]["leg"].values[-1])
    return {
        "kind": np.array(EVENT_KINDS)[run["event_kind"].values[shown].astype(int)],
        "branch": run["branch"].sel(step=steps).values.astype(object)[shown],
        "x": run["event_x"].values[shown],
        "y": run["event_y"].values[shown],
        "separation": run["event_separation"].values[shown] / float(unit_height(run)),
    }
