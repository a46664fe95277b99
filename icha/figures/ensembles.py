"""Means over seeds in figures: lines with bands and points with bars, or the single seeds where these are few."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from icha.figures.looks import FEWER_SEEDS, NUMBER_PLACES
from icha.figures.style import GREY, legend_handle
from icha.support.statistics import ENOUGH, ensemble

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.container import ErrorbarContainer
    from matplotlib.lines import Line2D

# A mean has about so many markers.
_MEAN_MARKERS = 8
_SEED_LINE = {"ls": "-", "lw": 0.5, "alpha": 0.5, "zorder": 1.6}
_SEED_DOT = {"ls": "none", "marker": ".", "ms": 5, "mew": 0, "alpha": 0.5, "zorder": 2.5}
_BARS = {"elinewidth": 0.6, "capsize": 1.5}
# A cross over a hollow mark, and the number of seeds beside it, in points.
_CROSS = {"ls": "none", "marker": "x", "mew": 0.7}
_NUMBER = {"fontsize": 6.5, "textcoords": "offset points", "annotation_clip": True}
# Points with bars are this far in front of what their look says.
_BEFORE_POINTS = 0.101
_SHADE = 0.22
_FEW_BANDS = 3


def draw_members(
    axes: Axes,
    x: np.ndarray,
    members: np.ndarray,
    look: dict,
    *,
    positive: bool,
    lines: int = 1,
    asked: int = 0,
    **alone: object,
) -> None:
    """Draw the values (members, k) of an ensemble: their mean with its band or the members; with `alone` the only one.

    Parameters
    ----------
    positive : whether the axis is logarithmic, so that the band is positive and zeros have no place.
    lines : number of lines of the panel; the more there are, the paler are the bands.
    asked : number of members asked for; where a mean has fewer, its marks show it (`mark_fewer`).
    """
    if len(members) == 1:
        axes.plot(x, members[0], **alone, **look)
        mark_fewer(axes, x, members[0], np.isfinite(members), look, asked, alone.get("markevery", 1))
        return
    over, known = ensemble(members), np.isfinite(members)
    draw_scatter(axes, x, members, look["color"], positive=positive, lines=lines)
    every = max(1, -(-len(x) // _MEAN_MARKERS))
    breaks = _changes(known)
    marked = every
    if len(breaks):
        at = np.arange(0, len(x), every)
        marked = (at + np.searchsorted(breaks, at, side="right")).tolist()
    axes.plot(*_break_lines(breaks, x, over.mean), **{"lw": 0.9} | look | {"ls": "-", "markevery": marked})
    mark_fewer(axes, x, over.mean, known, look, asked, every)


def _changes(known):
    """Positions of the points (members, k) that other members have than the point before."""
    return 1 + np.flatnonzero((known[:, 1:] != known[:, :-1]).any(axis=0))


def _break_lines(breaks, *rows):
    """Insert NaN before the given positions of each row, so that no line joins means over different members."""
    return [np.insert(np.asarray(row, float), breaks, np.nan, axis=-1) for row in rows]


def mark_fewer(
    axes: Axes, x: np.ndarray, y: np.ndarray, known: np.ndarray, look: dict, asked: int | np.ndarray, every: int = 1
) -> None:
    """Draw the marks of means over fewer members than asked for hollow and crossed, with n beside them.

    Parameters
    ----------
    x, y : (k,) float, the means.
    known : (members, k) bool, which members each mean is over.
    look : look of the marks, arguments of `Axes.plot`.
    asked : number of members asked for, of all points or of each.
    every : one in so many points has a mark.

    Notes
    -----
    Points in a row that are means over the same members have one n, beside the last or the first of them.
    """
    from matplotlib.patheffects import withStroke

    counts = known.sum(axis=0)
    fewer = (counts > 0) & (counts < asked) & np.isfinite(y)
    if not fewer.any():
        return
    stretches = [own for own in np.split(np.arange(len(counts)), _changes(known)) if fewer[own].any()]
    stretches = [own[fewer[own]] for own in stretches]
    marks = np.unique(np.concatenate([[*own[own % every == 0], own[0], own[-1]] for own in stretches]))
    look = {name: look[name] for name in ("color", "mec", "mew", "ms", "marker", "zorder") if name in look}
    colour, order = look.get("color", look.get("mec")), look.get("zorder", 2) + _BEFORE_POINTS
    if look.get("marker") not in (None, "none", "+", "x", "1", "2", "3", "4"):
        axes.plot(x[marks], y[marks], **look | {"ls": "none", "mfc": "white", "zorder": order})
    cross = {"color": colour, "ms": look.get("ms", _SEED_DOT["ms"]), "zorder": order + 0.001, "label": FEWER_SEEDS}
    axes.plot(x[marks], y[marks], **cross | _CROSS)
    halo = [withStroke(linewidth=1.5, foreground="white")]
    for own in stretches:
        # Beside the last mark of one stretch and the first of the next; the legend moves those that lie on each other.
        place = NUMBER_PLACES[sum(text.get_text().startswith("n=") for text in axes.texts) % 2]
        at = own[-1] if place.right > 0 else own[0]
        beside = {"ha": place.align, "color": colour, "zorder": order + 1, "path_effects": halo} | _NUMBER
        axes.annotate(f"n={counts[at]}", (x[at], y[at]), (place.right, place.up), **beside)


def draw_scatter(
    axes: Axes, x: np.ndarray, members: np.ndarray, colour: str, *, positive: bool, lines: int = 1, **dashes: object
) -> None:
    """Draw how an ensemble scatters: a band, which does not widen the panel, or every member where they are few.

    The members (members, k) have one x (k,), or each its own. Their lines are solid unless `dashes` says otherwise.
    """
    x, over = np.broadcast_to(x, members.shape), ensemble(members)
    if over.count.min(initial=len(members)) < ENOUGH:
        if members.shape[1] == 1:
            dashes = _SEED_DOT  # of a single point there is no line
        for own, member in zip(x, members, strict=True):
            axes.plot(
                own, np.where(member > 0, member, np.nan) if positive else member, color=colour, **_SEED_LINE | dashes
            )
        return
    limits = axes.dataLim.frozen()
    look = {"alpha": _SHADE * min(1.0, _FEW_BANDS / lines), "lw": 0, "zorder": 1.5}
    band = _break_lines(_changes(np.isfinite(members)), x.mean(axis=0), *over.band(positive=positive))
    axes.fill_between(*band, color=colour, **look)
    axes.dataLim.set(limits)


def draw_points(
    axes: Axes, x: np.ndarray, members: np.ndarray, look: dict, *, positive: bool, asked: int | np.ndarray = 0
) -> ErrorbarContainer:
    """Draw the means of an ensemble (members, k; NaN where a member has none) with bars, or with its members."""
    over = ensemble(members)
    low, high = over.band(positive=positive)
    return draw_means(axes, (x, None), (over.mean, (low, high)), over.count, (x, members), look, asked)


def draw_means(
    axes: Axes, x: tuple, y: tuple, counts: np.ndarray, members: tuple, look: dict, asked: int | np.ndarray = 0
) -> ErrorbarContainer:
    """Draw points with bars where they are of enough members, and with their members where these are few.

    A line joins neighbouring points that are means over the same members alone.

    Parameters
    ----------
    x, y : of all points the mean, and lower and upper end of its band, or None.
    counts : numbers of members of the points.
    members : x (k,) or (members, k), and y (members, k), of the members.
    asked : number of members asked for, of all points or of each; marks of means over fewer show it (`mark_fewer`).
    """
    few = (counts > 1) & (counts < ENOUGH)
    own = [np.where(few, values, np.nan) for values in np.broadcast_arrays(*members)]
    if few.any():
        axes.plot(*(values.ravel() for values in own), color=look["color"], **_SEED_DOT)
    known = np.isfinite(members[1])
    breaks = _changes(known) if look.get("ls", "-") != "none" else []
    bars = {}
    for name, (mean, band) in (("xerr", x), ("yerr", y)):
        if band is not None and (counts >= ENOUGH).any():
            lengths = np.array([mean - band[0], band[1] - mean])
            (bars[name],) = _break_lines(breaks, np.where(counts >= ENOUGH, lengths, np.nan))
    handle = axes.errorbar(*_break_lines(breaks, x[0], y[0]), **bars, **_BARS | look)
    mark_fewer(axes, x[0], y[0], known, look, asked)
    return handle


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
