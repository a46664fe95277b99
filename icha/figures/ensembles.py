"""Means over seeds: lines with bands and points with bars, or the single seeds where these are few."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.figures.looks import FEWER_SEEDS
from icha.figures.select import ContactRuns
from icha.figures.style import GREY, legend_handle
from icha.support.statistics import ENOUGH, ensemble

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.container import ErrorbarContainer
    from matplotlib.lines import Line2D

# Approximate number of markers of a mean.
_MEAN_MARKERS = 8
_SEED_LINE = {"ls": "-", "lw": 0.5, "alpha": 0.5, "zorder": 1.6}
_SEED_DOT = {"ls": "none", "marker": ".", "ms": 5, "mew": 0, "alpha": 0.5, "zorder": 2.5}
_BARS = {"elinewidth": 0.6, "capsize": 1.5}
_CROSS = {"ls": "none", "marker": "x", "mew": 0.7, "label": FEWER_SEEDS}
# Distance in zorder of the marks of means over fewer seeds from their curve.
_BEFORE_POINTS = 0.101
# Opacity of bands.
_SHADE = 0.18


def draw_members(axes: Axes, x: np.ndarray, members: np.ndarray, look: dict, *, positive: bool, asked: int = 0) -> None:
    """Draw the mean of the members (members, k) of an ensemble as a line, with the scatter of several members.

    Parameters
    ----------
    positive : whether the axis is logarithmic, so that the band is positive and zeros are left out.
    asked : number of members requested; marks of means over fewer show it (`mark_fewer`).
    """
    mean, known = ensemble(members).mean, np.isfinite(members)
    if len(members) > 1:
        _draw_scatter(axes, x, members, look["color"], positive=positive)
    every = max(1, -(-len(x) // _MEAN_MARKERS))
    axes.plot(*_break_lines(known, x, mean), **{"lw": 0.9} | look | {"ls": "-", "markevery": every})
    mark_fewer(axes, x, mean, known, look, asked, every)


def _break_lines(known, *rows):
    """Insert NaN into each row where the members (members, k) change, so that no line joins means over others."""
    breaks = 1 + np.flatnonzero((known[:, 1:] != known[:, :-1]).any(axis=0))
    return [np.insert(np.asarray(row, float), breaks, np.nan, axis=-1) for row in rows]


def mark_fewer(
    axes: Axes, x: np.ndarray, y: np.ndarray, known: np.ndarray, look: dict, asked: int | np.ndarray, every: int = 1
) -> None:
    """Cross the marks of means over fewer members than requested.

    Parameters
    ----------
    x, y : (k,) float, the means.
    known : (members, k) bool, which members each mean is over.
    look : look of the marks, arguments of `Axes.plot`.
    asked : number of requested members, of all points or of each.
    every : distance between marked points, in points.
    """
    counts = known.sum(axis=0)
    fewer = (counts > 0) & (counts < asked)
    if fewer.any():
        mark = {"color": look["color"], "ms": look.get("ms", 5) + 4, "zorder": look.get("zorder", 2) + _BEFORE_POINTS}
        axes.plot(x, np.where(fewer, y, np.nan), markevery=every, **mark, **_CROSS)


def _draw_scatter(axes, x, members, colour, *, positive):
    """Draw the scatter of an ensemble: a band, which does not widen the panel, or every member if they are few."""
    over = ensemble(members)
    if over.count.min(initial=len(members)) < ENOUGH:
        # A single point has no line.
        look = _SEED_DOT if members.shape[1] == 1 else _SEED_LINE
        for member in members:
            axes.plot(x, np.where(member > 0, member, np.nan) if positive else member, color=colour, **look)
        return
    limits = axes.dataLim.frozen()
    band = _break_lines(np.isfinite(members), x, *over.band(positive=positive))
    axes.fill_between(*band, color=colour, alpha=_SHADE, lw=0, zorder=1.5)
    axes.dataLim.set(limits)


def join_bins(edges: np.ndarray, contents: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
    """Join neighbouring bins until the members (members, bins) together have a content of `least` in each.

    Empty bins at both ends are left out; the last joined bin also has the rest.

    Returns
    -------
    Edges of the joined bins, and densities (members, joined bins); empty if all bins are.
    """
    filled = np.flatnonzero(contents.any(axis=0))
    if not len(filled):
        return np.empty(0), np.empty((len(contents), 0))
    ends, gathered = [], 0.0
    for k in range(filled[0], filled[-1] + 1):
        gathered += contents[:, k].sum()
        if gathered >= least:
            ends.append(k + 1)
            gathered = 0.0
    bounds = [filled[0], *ends[:-1], filled[-1] + 1]
    edges = edges[bounds]
    return edges, np.add.reduceat(contents, bounds[:-1], axis=1) / np.diff(edges)


def draw_points(
    axes: Axes, x: np.ndarray, members: np.ndarray, look: dict, *, positive: bool, asked: int | np.ndarray = 0
) -> ErrorbarContainer:
    """Draw the means of an ensemble with bars along y, or with the single members if there are few.

    A line joins neighbouring points only if they are means over the same members.

    Parameters
    ----------
    x : (k,) or (members, k) float.
    members : (members, k) float, NaN where a member has no value.
    positive : whether values are positive, so that their bars are.
    asked : number of members requested, of all points or of each; marks of means over fewer show it (`mark_fewer`).
    """
    known, over = np.isfinite(members), ensemble(members)
    x = np.where(known, x, np.nan)
    few, enough = (over.count > 1) & (over.count < ENOUGH), over.count >= ENOUGH
    if few.any():
        dots = (np.where(few, values, np.nan).ravel() for values in (x, members))
        axes.plot(*dots, color=look["color"], **_SEED_DOT)
    low, high = over.band(positive=positive)
    x, bars = ensemble(x).mean, np.where(enough, [over.mean - low, high - over.mean], np.nan)
    *points, below, above = _break_lines(known, x, over.mean, *bars)
    handle = axes.errorbar(*points, yerr=[below, above] if enough.any() else None, **_BARS | look)
    mark_fewer(axes, x, over.mean, known, look, asked)
    return handle


class Points:
    """A line of points, each a mean over its seeds, in the order of x.

    Means are over the seeds that all points have, or over all seeds of each point if they share none.

    Parameters
    ----------
    groups : the runs of each point.
    quantities : names of x and of one or several y of a run.
    factor : unit of y, by which they are multiplied.

    Attributes
    ----------
    members : (quantities, seeds, k) float, values of every seed; NaN where a point lacks it.
    same_seeds : whether all points are of the same seeds.
    asked : (k,) int, numbers of seeds requested.
    """

    def __init__(self, groups: Sequence[ContactRuns], *quantities: str, factor: float = 1.0):
        """Arrange the values by seed."""
        common = set.intersection(*(set(group.by_seed) for group in groups))
        seeds = sorted(common or set().union(*(group.by_seed for group in groups)))
        members = np.full((len(quantities), len(seeds), len(groups)), np.nan)
        for (i, name), (j, seed), (k, group) in itertools.product(*map(enumerate, (quantities, seeds, groups))):
            if seed in group.by_seed:
                members[i, j, k] = float(group.by_seed[seed][name]) * (factor if i else 1.0)
        order = np.argsort(ensemble(members[0]).mean, kind="stable")
        self.members = members[..., order]
        self.same_seeds = bool(common)
        self.asked = np.array([group.asked for group in groups])[order]

    @property
    def means(self) -> np.ndarray:
        """Means over the seeds, (quantities, k)."""
        return ensemble(self.members, axis=1).mean

    @property
    def counts(self) -> list[int]:
        """Numbers of seeds that the means are over, (k,)."""
        return np.isfinite(self.members[0]).sum(axis=0).tolist()

    def draw(self, axes: Axes, look: dict, quantity: int = 1) -> ErrorbarContainer:
        """Draw one of the quantities against the first quantity."""
        return draw_points(axes, self.members[0], self.members[quantity], look, positive=True, asked=self.asked)


def lines_handles(counts: Iterable[int]) -> dict[str, Line2D]:
    """Return legend entries of lines that are means over these numbers of seeds."""
    band = {"alpha": 0.35, "lw": 6, "solid_capstyle": "butt"}
    return _handles(counts, {"mean and 95 % band": band, "single seeds beside their mean": _SEED_LINE})


def points_handles(counts: Iterable[int]) -> dict[str, Line2D]:
    """Return legend entries of points that are means over these numbers of seeds."""
    bars = {"marker": "|", "ls": "none", "ms": 8}
    return _handles(counts, {"means, bars 95 %": bars, "single seeds beside their mean": _SEED_DOT})


def _handles(counts, looks):
    """Return legend entries, with words and looks of means over enough seeds and of means over few."""
    sizes, found = {int(count) for count in counts if count > 1}, {}
    for enough, (words, look) in zip((True, False), looks.items(), strict=True):
        if group := {size for size in sizes if (size >= ENOUGH) == enough}:
            span = "–".join(map(str, sorted({min(group), max(group)})))
            found[f"{words}, n = {span}"] = legend_handle(color=GREY, **look)
    return found
