"""Draw means over seeds. With many seeds, bands or bars show the scatter; with few seeds, every seed is drawn.

What draws a mean also explains it in the caption and names its scatter for the legend.
"""

import itertools
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer

from icha.datasets.labels import RunLabels
from icha.figures.drawn import Name, count_seeds, record, say
from icha.figures.looks import FEWER_SEEDS
from icha.figures.select import ContactRuns
from icha.figures.style import GREY, legend_handle
from icha.uncertainty.ensembles import ENOUGH, ensemble
from icha.uncertainty.left_out import too_few

# Largest number of curves whose single seeds are drawn; with more curves, only the means could be told apart.
MOST_SCATTERED = 4
# Approximate number of markers on the line of a mean.
_MEAN_MARKERS = 24
_SEED_LINE = {"ls": "-", "lw": 0.5, "alpha": 0.5, "zorder": 1.6}
_SEED_DOT = {"ls": "none", "marker": ".", "ms": 5, "mew": 0, "alpha": 0.5, "zorder": 2.5}
_CROSS = {"ls": "none", "marker": "x", "mew": 0.7, "label": FEWER_SEEDS}
_MEANS = """Results are means over the seeds (realisations of the surface). For five seeds or more, intervals are those
of Student's t, for positive quantities of the logarithm."""
# Legend entry of each kind of scatter, and its look.
_BAND = "mean and 95 % band", {"alpha": 0.35, "lw": 6, "solid_capstyle": "butt"}
_SEEDS = "single seeds beside their mean", _SEED_LINE
_UNSEEN = "means over the seeds", {"ls": "none"}
_BARS = "mean and 95 % interval", {"marker": "|", "ls": "none", "ms": 8}
_RANGE = "mean and range", _BARS[1]


def draw_members(
    axes: Axes,
    x: np.ndarray,
    members: np.ndarray,
    look: dict,
    *,
    positive: bool,
    name: Name,
    asked: int = 0,
    curves: int | None = 1,
    ls: object = "-",
) -> np.ndarray:
    """Draw the mean over the members of an ensemble as a line, with a band or lines that show the scatter.

    Return the values that are drawn: the members, or only their mean.

    Parameters
    ----------
    x : (k,) float, positions on the x axis.
    members : (members, k) float, values of every member; NaN where a member has no value.
    look : arguments of `Axes.plot` for the line.
    positive : True for a logarithmic axis; the confidence band is then positive, and zeros are left out.
    name : name of the curve in the table of the figure.
    asked : number of requested members; markers of means over fewer members are crossed out.
    curves : number of curves in the panel; with many curves, few members are not drawn. None for a line beside a curve.
    ls : style of the line.
    """
    mean, known = ensemble(members).mean, np.isfinite(members)
    scattered = len(members) > 1 and (len(members) >= ENOUGH or 0 < (curves or 0) <= MOST_SCATTERED)
    ends = _ends(members, positive=positive, asked=asked)
    if scattered:
        _draw_scatter(axes, x, members, ends, look["color"], positive=positive)
    elif len(members) > 1 and curves:
        _explain(axes, _UNSEEN, [len(members)])
    record(axes, x, mean, name, low=ends[0], high=ends[1], seeds=known.sum(axis=0))
    every = max(1, -(-len(x) // _MEAN_MARKERS))
    axes.plot(*_break_lines(known, x, mean), **{"lw": 0.9, "markevery": every} | look | {"ls": ls})
    mark_fewer(axes, x, mean, known.sum(axis=0), asked, look, every)
    return members if scattered else mean[None]


def _break_lines(known, *rows):
    """Insert NaN between neighbouring means over different members; `known` is True where a member has a value."""
    breaks = 1 + np.flatnonzero((known[:, 1:] != known[:, :-1]).any(axis=0))
    return [np.insert(np.asarray(row, float), breaks, np.nan, axis=-1) for row in rows]


def mark_fewer(
    axes: Axes,
    x: np.ndarray,
    y: np.ndarray,
    counts: int | np.ndarray,
    asked: int | np.ndarray,
    look: dict,
    every: int = 1,
) -> None:
    """Draw a cross over each marker of a mean `y` over fewer members than `asked`; arguments as of `draw_members`.

    `counts` are the numbers of members; `every` is the number of points from one marker to the next.
    """
    fewer = np.greater(counts, 0) & np.less(counts, asked)
    if np.any(fewer):
        mark = {"color": look["color"], "ms": look.get("ms", 5) + 4, "zorder": look.get("zorder", 2) + 0.2}
        axes.plot(x, np.where(fewer, y, np.nan), markevery=every, **mark, **_CROSS)


def _ends(members, *, positive, asked):
    """Return both ends of the confidence interval of the means, or of the range of few members; NaN for one member.

    There is no interval where too many of the `asked` members are missing.
    """
    over = ensemble(members)
    few = (over.count > 1) & (over.count < ENOUGH)
    ends = np.where(too_few(over.count, asked), np.nan, over.band(positive=positive))
    if few.any():
        ends[:, few] = np.nanmin(members[:, few], axis=0), np.nanmax(members[:, few], axis=0)
    return np.where(over.count > 1, ends, np.nan)


def _draw_scatter(axes, x, members, ends, colour, *, positive):
    """Draw a confidence band, or every member if members are few; the band does not change the limits of the axes."""
    over = ensemble(members)
    if over.count.min(initial=len(members)) < ENOUGH:
        _explain(axes, _SEEDS, [len(members)])
        # A line with a single point would be invisible.
        look = _SEED_DOT if members.shape[1] == 1 else _SEED_LINE
        for member in members:
            axes.plot(x, np.where(member > 0, member, np.nan) if positive else member, color=colour, **look)
        return
    _explain(axes, _BAND, [len(members)])
    limits = axes.dataLim.frozen()
    band = _break_lines(np.isfinite(members), x, *ends)
    axes.fill_between(*band, color=colour, alpha=0.18, lw=0, zorder=1.5)
    axes.dataLim.set(limits)


def _explain(axes, kind, counts):
    """Name means over `counts` seeds and their scatter in the legend, and explain them in the caption."""
    words, look = kind
    say(axes, _MEANS)
    count_seeds(axes, words, legend_handle(color=GREY, **look), counts)


def join_bins(edges: np.ndarray, contents: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
    """Join neighbouring bins until the content of every bin, summed over all members, is at least `least`.

    `edges` has the shape (bins + 1,), `contents` (members, bins): numbers or fractions. Empty bins at both ends are
    left out. The last joined bin also contains the remaining bins. Return the edges of the k joined bins, (k + 1,), and
    the contents of these bins divided by the bin width, (members, k).
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
    axes: Axes,
    x: np.ndarray,
    members: np.ndarray,
    look: dict,
    *,
    positive: bool,
    name: Name,
    asked: int | np.ndarray = 0,
    shift: float = 1.0,
) -> ErrorbarContainer:
    """Draw the means of an ensemble as points with confidence bars, or for few members with bars of their range.

    A line joins two neighbouring points only if both points are means over the same members. Parameters are those of
    `draw_members`, but `x` may also have the shape (members, k), and `asked` may differ between points. `shift` is a
    factor of the drawn positions, so that points at one position are side by side.
    """
    known, over = np.isfinite(members), ensemble(members)
    several, ends = over.count > 1, _ends(members, positive=positive, asked=asked)
    for kind, alike in ((_BARS, over.count >= ENOUGH), (_RANGE, several & (over.count < ENOUGH))):
        if alike.any():
            _explain(axes, kind, over.count[alike].tolist())
    x = ensemble(np.where(known, x, np.nan)).mean
    record(axes, x, over.mean, name, low=ends[0], high=ends[1], seeds=over.count)
    x, bars = shift * x, np.array([over.mean - ends[0], ends[1] - over.mean])
    *points, below, above = _break_lines(known, x, over.mean, *bars)
    bars = {"yerr": [below, above] if several.any() else None, "elinewidth": 0.6, "capsize": 1.5}
    handle = axes.errorbar(*points, **bars | look)
    mark_fewer(axes, x, over.mean, over.count, asked, look)
    return handle


class Points:
    """A line of points in ascending order of x; each point is a mean over seeds.

    Means are over the seeds that all points have in common. If there is no such seed, means are over all seeds.

    Parameters
    ----------
    groups : the runs of each point.
    quantities : names of the variables; the first is drawn along x, all others along y.
    factor : factor that converts the values of y to the unit in the figure.

    Attributes
    ----------
    members : (quantities, seeds, k) float, values of every seed; NaN if a point has no run with the seed.
    same_seeds : True if all points are means over the same seeds.
    asked : (k,) int, number of requested seeds of each point.
    """

    def __init__(self, groups: Sequence[ContactRuns], *quantities: str, factor: float = 1.0):
        """Arrange the values of all points in one array along seeds and points."""
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
        self._groups = groups

    @property
    def name(self) -> Name:
        """Name of the line in the table of a figure, with the labels that all points have in common."""
        labels = zip(*(group.labels._replace(seed=None) for group in self._groups), strict=True)
        common = RunLabels(*(each[0] if len({*each}) == 1 else None for each in labels))
        return Name(self._groups[0].model_name, common)

    @property
    def means(self) -> np.ndarray:
        """Means over the seeds, an array of shape (quantities, k)."""
        return ensemble(self.members, axis=1).mean

    def draw(self, axes: Axes, look: dict, quantity: int = 1, *, shift: float = 1.0) -> ErrorbarContainer:
        """Draw the variable with index `quantity` in `quantities` against the first variable, multiplied by `shift`."""
        x, y = self.members[0], self.members[quantity]
        return draw_points(axes, x, y, look, positive=True, name=self.name, asked=self.asked, shift=shift)
