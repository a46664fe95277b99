"""Means over seeds in figures: lines with bands and points with bars, or the single seeds where these are few."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from icha.figures.style import GREY, legend_handle
from icha.support.statistics import ENOUGH, ensemble

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.container import ErrorbarContainer
    from matplotlib.lines import Line2D

# What captions say of them.
LINES_OF_SEEDS = (
    "Where there are several seeds, lines are means over them at common loads. With five seeds or more they have the "
    "95 % confidence band of the mean (Student's t, of the logarithm on a logarithmic axis). With fewer, such a band "
    "would be wider than the scatter, and pale thin lines show the single seeds instead."
)
POINTS_OF_SEEDS = (
    "Points are means over the seeds. With five seeds or more, bars are 95 % confidence intervals of the mean "
    "(Student's t; of the logarithm, and therefore not symmetric, where a quantity is positive). With fewer, such bars "
    "would be longer than the scatter, and pale dots show the single seeds instead."
)

# A mean has about so many markers.
_MEAN_MARKERS = 8
_SEED_LINE = {"ls": "-", "lw": 0.5, "alpha": 0.5, "zorder": 1.6}
_SEED_DOT = {"ls": "none", "marker": ".", "ms": 5, "mew": 0, "alpha": 0.5, "zorder": 2.5}
_BARS = {"elinewidth": 0.6, "capsize": 1.5}
_SHADE = 0.22
_FEW_BANDS = 3


def draw_members(
    axes: Axes, x: np.ndarray, members: np.ndarray, look: dict, *, positive: bool, lines: int = 1, **alone: object
) -> None:
    """Draw the values (members, k) of an ensemble: their mean with its band or the members; with `alone` the only one.

    Parameters
    ----------
    positive : whether the axis is logarithmic, so that the band is positive and zeros have no place.
    lines : number of lines of the panel; the more there are, the paler are the bands.
    """
    if len(members) == 1:
        axes.plot(x, members[0], **alone, **look)
        return
    over = ensemble(members)
    draw_scatter(axes, x, members, look["color"], positive=positive, lines=lines)
    every = max(1, -(-len(x) // _MEAN_MARKERS))
    axes.plot(x, over.mean, **{"lw": 0.9} | look | {"ls": "-", "markevery": every})


def draw_scatter(
    axes: Axes, x: np.ndarray, members: np.ndarray, colour: str, *, positive: bool, lines: int = 1, **dashes: object
) -> None:
    """Draw how an ensemble scatters: a band, which does not widen the panel, or every member where they are few.

    The members (members, k) have one x (k,), or each its own. Their lines are solid unless `dashes` says otherwise.
    """
    x = np.broadcast_to(x, members.shape)
    if len(members) < ENOUGH:
        if members.shape[1] == 1:
            dashes = _SEED_DOT  # of a single point there is no line
        for own, member in zip(x, members, strict=True):
            axes.plot(
                own, np.where(member > 0, member, np.nan) if positive else member, color=colour, **_SEED_LINE | dashes
            )
        return
    limits = axes.dataLim.frozen()
    look = {"alpha": _SHADE * min(1.0, _FEW_BANDS / lines), "lw": 0, "zorder": 1.5}
    axes.fill_between(x.mean(axis=0), *ensemble(members).band(positive=positive), color=colour, **look)
    axes.dataLim.set(limits)


def draw_points(axes: Axes, x: np.ndarray, members: np.ndarray, look: dict, *, positive: bool) -> ErrorbarContainer:
    """Draw the means of an ensemble (members, k; NaN where a member has none) with bars, or with its members."""
    over = ensemble(members)
    low, high = over.band(positive=positive)
    return draw_means(axes, (x, None), (over.mean, (low, high)), over.count, (x, members), look)


def draw_means(axes: Axes, x: tuple, y: tuple, counts: np.ndarray, members: tuple, look: dict) -> ErrorbarContainer:
    """Draw points with bars where they are of enough members, and with their members where these are few.

    Parameters
    ----------
    x, y : of all points the mean, and lower and upper end of its band, or None.
    counts : numbers of members of the points.
    members : x (k,) or (members, k), and y (members, k), of the members.
    """
    few = (counts > 1) & (counts < ENOUGH)
    own = [np.where(few, values, np.nan) for values in np.broadcast_arrays(*members)]
    if few.any():
        axes.plot(*(values.ravel() for values in own), color=look["color"], **_SEED_DOT)
    bars = {}
    for name, (mean, band) in (("xerr", x), ("yerr", y)):
        if band is not None and (counts >= ENOUGH).any():
            lengths = np.array([mean - band[0], band[1] - mean])
            bars[name] = np.where(counts >= ENOUGH, lengths, np.nan)
    return axes.errorbar(x[0], y[0], **bars, **_BARS | look)


def lines_handles(counts: Iterable[int]) -> dict[str, Line2D]:
    """What the legend says of lines of so many seeds; nothing of single ones."""
    band = legend_handle(color=GREY, alpha=0.35, lw=6, solid_capstyle="butt")
    seeds = legend_handle(color=GREY, **_SEED_LINE)
    return _handles(counts, ("mean and 95 % band", band), ("single seeds beside their mean", seeds))


def points_handles(counts: Iterable[int]) -> dict[str, Line2D]:
    """What the legend says of points of so many seeds; nothing of single ones."""
    bars = legend_handle(color=GREY, marker="|", ls="none", ms=8)
    seeds = legend_handle(color=GREY, **_SEED_DOT)
    return _handles(counts, ("means, bars 95 %", bars), ("single seeds beside their mean", seeds))


def _handles(counts, enough, few):
    counts = sorted({int(count) for count in counts if count > 1})
    found = {}
    for (words, handle), own in (
        (enough, [count for count in counts if count >= ENOUGH]),
        (few, [count for count in counts if count < ENOUGH]),
    ):
        if own:
            span = f"{own[0]}" if len(own) == 1 else f"{own[0]}–{own[-1]}"
            found[f"{words}, n = {span}"] = handle
    return found
