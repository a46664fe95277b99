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
# Distance in zorder of marks of means over fewer seeds from their curve; points with bars lie 0.1 in front of it.
_BEFORE_POINTS = 0.101
# Opacity of bands, and the largest number of lines in a panel for which it holds; of more lines they are paler.
_SHADE, _FEW_BANDS = 0.22, 3


def draw_members(
    axes: Axes, x: np.ndarray, members: np.ndarray, look: dict, *, positive: bool, lines: int = 1, asked: int = 0
) -> None:
    """Draw the mean of the members (members, k) of an ensemble as a line, with the scatter of several members.

    Parameters
    ----------
    positive : whether the axis is logarithmic, so that the band is positive and zeros are left out.
    lines : number of lines in the panel.
    asked : number of members requested; marks of means over fewer show it (`mark_fewer`).
    """
    mean, known = ensemble(members).mean, np.isfinite(members)
    if len(members) > 1:
        draw_scatter(axes, x, members, look["color"], positive=positive, lines=lines)
    every, breaks = max(1, -(-len(x) // _MEAN_MARKERS)), _changes(known)
    marked = np.insert(np.arange(len(x)) % every == 0, breaks, False)
    axes.plot(*_break_lines(breaks, x, mean), **{"lw": 0.9} | look | {"ls": "-", "markevery": marked})
    mark_fewer(axes, x, mean, known, look, asked, every)


def _changes(known):
    """Return the positions of the points (members, k) whose members differ from those of the point before."""
    return 1 + np.flatnonzero((known[:, 1:] != known[:, :-1]).any(axis=0))


def _break_lines(breaks, *rows):
    """Insert NaN before the given positions of each row, so that no line connects means over different members."""
    return [np.insert(np.asarray(row, float), breaks, np.nan, axis=-1) for row in rows]


def mark_fewer(
    axes: Axes, x: np.ndarray, y: np.ndarray, known: np.ndarray, look: dict, asked: int | np.ndarray, every: int = 1
) -> None:
    """Draw the marks of means over fewer members than requested hollow and crossed.

    Parameters
    ----------
    x, y : (k,) float, the means.
    known : (members, k) bool, which members each mean is over.
    look : look of the marks, arguments of `Axes.plot`.
    asked : number of requested members, of all points or of each.
    every : distance between marked points, in points. The first mean over other members than before is marked as well.
    """
    counts = known.sum(axis=0)
    marked = np.arange(len(counts)) % every == 0
    marked[_changes(known)] = True
    marked &= (counts > 0) & (counts < asked) & np.isfinite(y)
    if not marked.any():
        return
    order = look.get("zorder", 2) + _BEFORE_POINTS
    if look.get("marker") not in (None, "none", "+", "x", "1", "2"):
        ring = {name: look[name] for name in ("color", "mec", "mew", "ms", "marker") if name in look}
        axes.plot(x[marked], y[marked], ls="none", mfc="white", zorder=order, **ring)
    axes.plot(x[marked], y[marked], color=look["color"], ms=look.get("ms", 5), zorder=order + 0.001, **_CROSS)


def draw_scatter(
    axes: Axes, x: np.ndarray, members: np.ndarray, colour: str, *, positive: bool, lines: int = 1, **dashes: object
) -> None:
    """Draw the scatter of an ensemble: a band, which does not widen the panel, or every member if they are few.

    The members (members, k) have one x (k,), or one each. Their lines are solid unless `dashes` are given.
    """
    x, over = np.broadcast_to(x, members.shape), ensemble(members)
    if over.count.min(initial=len(members)) < ENOUGH:
        # A single point has no line.
        look = _SEED_LINE | (_SEED_DOT if members.shape[1] == 1 else dashes)
        for along, member in zip(x, members, strict=True):
            axes.plot(along, np.where(member > 0, member, np.nan) if positive else member, color=colour, **look)
        return
    limits = axes.dataLim.frozen()
    band = _break_lines(_changes(np.isfinite(members)), x.mean(axis=0), *over.band(positive=positive))
    axes.fill_between(*band, color=colour, alpha=_SHADE * min(1.0, _FEW_BANDS / lines), lw=0, zorder=1.5)
    axes.dataLim.set(limits)


def draw_points(
    axes: Axes,
    x: np.ndarray,
    members: np.ndarray,
    look: dict,
    *,
    positive: bool,
    asked: int | np.ndarray = 0,
) -> ErrorbarContainer:
    """Draw the means of an ensemble with bars, or with the single members if there are few.

    A line joins neighbouring points only if they are means over the same members.

    Parameters
    ----------
    x : (k,) or (members, k) float; of members that differ in x, the means have bars along x as well.
    members : (members, k) float, NaN where a member has no value.
    positive : whether values are positive, so that their bars are.
    asked : number of members requested, of all points or of each; marks of means over fewer show it (`mark_fewer`).
    """
    known = np.isfinite(members)
    x = np.where(known, x, np.nan)
    means = [ensemble(values) for values in (x, members)]
    counts = means[1].count
    few = (counts > 1) & (counts < ENOUGH)
    if few.any():
        dots = (np.where(few, values, np.nan).ravel() for values in (x, members))
        axes.plot(*dots, color=look["color"], **_SEED_DOT)
    breaks = _changes(known) if look.get("ls", "-") != "none" else []
    bars = {}
    for name, over, above_zero in zip(("xerr", "yerr"), means, (True, positive), strict=True):
        low, high = over.band(positive=above_zero)
        # A coordinate that all members share, such as a slope, has no bar.
        if (counts >= ENOUGH).any() and (name == "yerr" or np.any(high - low > 1e-9 * np.abs(low))):
            lengths = np.where(counts >= ENOUGH, [over.mean - low, high - over.mean], np.nan)
            (bars[name],) = _break_lines(breaks, lengths)
    x, y = (over.mean for over in means)
    handle = axes.errorbar(*_break_lines(breaks, x, y), **bars, **_BARS | look)
    mark_fewer(axes, x, y, known, look, asked)
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
