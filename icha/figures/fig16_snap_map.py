"""Fig. 16: where and when spots form and break in loading and unloading."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.datasets import results
from icha.figures.curves import SEPARATION_LABEL
from icha.figures.declaration import Campaign, Declaration, Inputs, RunFigure, unloading_problems
from icha.figures.legends import legend_below, words_handle
from icha.figures.looks import BRANCH_DASHES, NOT_APPLICABLE_ALONE
from icha.figures.maps import average_blocks, draw_whole
from icha.figures.select import NothingToDraw, is_applicable, run_on_topography, unloading_legs
from icha.figures.style import (
    BLACK,
    GREY,
    choose_unit,
    in_style,
    legend_handle,
    logarithmic_axes,
    material_label,
    new_panels,
    slope_label,
)
from icha.support.values import Problem

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class SnapMapFigure(RunFigure):
    """A figure of the events of one run; options that are left out take the study's first value."""

    def problems(self, campaign: Campaign) -> Iterator[Problem]:
        """Yield the problem of a study that does not unload."""
        yield from super().problems(campaign)
        yield from unloading_problems(campaign, ("study",), self.study, partly=True)


def inputs(campaign: Campaign, options: SnapMapFigure, files: results.ResultFiles) -> Inputs:
    """Return the runs, and the topography of the one that is drawn."""
    return {"campaign": files.path(results.DATASET), "surface": files.path(results.SURFACE, options.run(campaign))}


DECLARATION = Declaration(
    description="Where and when spots of one run snap into and out of contact.",
    options=SnapMapFigure,
    inputs=inputs,
    holds_topography=True,
)


class _Kind(NamedTuple):
    """A kind of events.

    Attributes
    ----------
    names : its names with and without adhesion.
    branch : the branch whose events the map shows.
    look : look of its marks.
    width : width of its curve.
    """

    names: tuple[str, str]
    branch: str
    look: dict
    width: float


# Events that form a spot are black, those that break one red; other colours are those of materials.
_RED = (0.9, 0.0, 0.05)
_KINDS = {
    "jump_in": _Kind(
        ("jump into contact", "contact formed"), "loading", {"marker": "o", "mfc": BLACK, "mec": BLACK}, 1.3
    ),
    "jump_off": _Kind(("jump off", "contact broken"), "unloading", {"marker": "o", "mfc": "none", "mec": _RED}, 1.3),
    "coalescence": _Kind(("union",) * 2, "loading", {"marker": "D", "mfc": "none", "mec": BLACK}, 0.6),
    "split": _Kind(("union undone",) * 2, "unloading", {"marker": "+", "mec": _RED}, 0.6),
}
# Size of the marks of up to so many events, in points; the marks of more cover about the same area together.
_FEW = 60
_SIZE = 5.0
_LEAST_SIZE = 1.6


@in_style
def figure(campaign: xr.DataTree, surface: xr.Dataset, *, study: str, **which: object) -> Figure:
    """Draw the events of one run over its topography, which `surface` must be, and against the separation."""
    labels, run = run_on_topography(campaign, study, surface, **which)
    if not unloading_legs(run):
        raise NothingToDraw(f"study {study}: no run was unloaded; expected a study that unloads")
    events = _events(run)
    fig, [(where, when)] = new_panels(3.1, width_ratios=(1.3, 1))
    handles = _draw_places(where, run, surface, events)
    _draw_counts(when, events)
    title = f"{material_label(campaign[study].to_dataset(), labels.material)}, {slope_label(labels.rms_slope)}"
    when.set_title(title, loc="right", fontsize="small")
    handles |= {name: legend_handle(color=GREY, ls=dashes, lw=1.1) for name, dashes in BRANCH_DASHES.items()}
    legend_below(fig, handles if is_applicable(run) else handles | words_handle(NOT_APPLICABLE_ALONE))
    return fig


def _draw_places(ax, run, surface, events):
    """Draw events over the topography; return what the legend shows, by name."""
    adhesive = float(run["surface_energy"]) > 0
    heights = surface["height"].transpose("y", "x").values * float(run["rms_height"]) / float(surface["rms_height"])
    period = float(run["period"])
    length, length_unit = choose_unit(period, "m")
    height, height_unit = choose_unit(float(np.abs(heights).max()), "m")
    highest = float(np.abs(heights).max()) * height
    side = period * length
    # Light, so that the marks show.
    look = {"origin": "lower", "cmap": "gray", "vmin": -2.2 * highest, "vmax": highest}
    image = draw_whole(ax, average_blocks(heights) * height, len(heights), side, **look)
    marks = {name: (events["kind"] == name) & (events["branch"] == kind.branch) for name, kind in _KINDS.items()}
    most = max(np.count_nonzero(shown) for shown in marks.values())
    size = max(_LEAST_SIZE, _SIZE * min(1.0, (_FEW / max(most, 1)) ** 0.5))
    handles = {}
    for name, kind in _KINDS.items():
        shown = marks[name]
        # Marks of a spot that formed and broke at the same place: a ring around a dot, a square around a cross.
        ring = 1.6 if name in ("jump_off", "coalescence") else 1.0
        look = {"ls": "none", "ms": ring * size, "mew": 0.9} | kind.look
        (points,) = ax.plot(events["x"][shown] * length, events["y"][shown] * length, **look)
        if shown.any():
            handles[f"{kind.names[0 if adhesive else 1]} ({np.count_nonzero(shown)})"] = points
    ax.set(xlim=(0, side), ylim=(0, side), xlabel=f"x ({length_unit})", ylabel=f"y ({length_unit})")
    ax.tick_params(direction="out", top=False, right=False)
    bar = ax.figure.colorbar(image, ax=ax, shrink=0.9, pad=0.02, aspect=28)
    bar.set_label(f"height ({height_unit})")
    bar.ax.set_ylim(-highest, highest)
    return handles


def _draw_counts(ax, events):
    """Draw the number of events of every kind so far against the separation on every branch."""
    from matplotlib.ticker import MaxNLocator

    for name, kind in _KINDS.items():
        for branch, dashes in BRANCH_DASHES.items():
            separation = events["separation"][(events["kind"] == name) & (events["branch"] == branch)]
            if len(separation):
                steps, counts = np.append(separation[0], separation), np.arange(len(separation) + 1)
                look = {"color": kind.look["mec"], "ls": dashes, "lw": kind.width, "drawstyle": "steps-post"}
                ax.plot(steps, counts, **look)
    most = max((line.get_ydata()[-1] for line in ax.get_lines()), default=1)
    if most > _FEW:
        logarithmic_axes(ax, "y")
        ax.set_ylim(bottom=0.8)
    else:
        ax.set_ylim(0, 1.06 * most)
        ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set(xlabel=SEPARATION_LABEL, ylabel="events so far")


def _events(run):
    """Return the events of the first loading and the last unloading: kind, branch, x and y in m, u/h_rms."""
    kind = run["event_kind"]
    names = dict(
        zip(np.atleast_1d(kind.attrs["flag_values"]).tolist(), kind.attrs["flag_meanings"].split(), strict=True)
    )
    steps = run["event_step"].values.astype(int)
    leg = run["leg"].sel(step=steps).values
    last = unloading_legs(run)[-1]["leg"].values[-1]
    shown = (leg == 0) | (leg == last)
    return {
        "kind": np.array([names[int(value)] for value in kind.values], dtype=object)[shown],
        "branch": run["branch"].sel(step=steps).values.astype(object)[shown],
        "x": run["event_x"].values[shown],
        "y": run["event_y"].values[shown],
        "separation": run["event_separation"].values[shown] / float(run["rms_height"]),
    }
