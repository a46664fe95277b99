"""Fig. 14: pull-off pressure against the rms slope and against the largest load."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.contact.models import REFERENCE_MODEL
from icha.datasets.quantities import label_of
from icha.figures.captions import attractions_of, grid_of_loops, only_model, range_of_attraction
from icha.figures.curves import cross_look, drop_rounding_errors
from icha.figures.drawn import say
from icha.figures.ensembles import Points, points_handles
from icha.figures.looks import (
    ASPERITIES_NAME,
    REFERENCE_NAME,
    TRUTH_LINE,
    UNLOADING_MARKERS,
    legend_below,
    looks_of_studies,
    model_handle,
    pale,
)
from icha.figures.select import names_of_models, select_detached_lines
from icha.figures.style import GREY, ONE_COLUMN, TWO_COLUMNS, in_style, logarithmic_axes, new_panels
from icha.support.formatting import choose_unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


# The axis is linear if the ratio of the largest to the smallest positive value is at most this number, without and with
# zeros.
_SPAN, _SPAN_WITH_ZEROS = 5.0, 30.0
_LINE = {"lw": 0.9, "ls": "-"}
_TRUTH = {name: TRUTH_LINE[name] for name in ("lw", "ls")}
# Oblique crosses can be told from bars.
_OBLIQUE = UNLOADING_MARKERS[REFERENCE_NAME]
# Points at the same slope or load are drawn side by side. The last and the first of many lines have nearly this ratio,
# or the root of the ratio of the closest different values; values count as the same up to the second ratio.
_SPREAD, _SAME = 1.15, 1.001
# A slope has a tick if its ratio to the next smaller slope is at least this number.
_APART = 1.06
# Size of the markers, divided by the usual size, so that short bars are visible.
_SMALLER = 0.7
# Variable on the y axis.
_Y = "pull_off_pressure"


@in_style
def figure(campaign: xr.DataTree, *, study: str, load_studies: Sequence[str] = ()) -> Figure:
    """Draw the pull-off pressure (mean over the seeds) against slope, and against the largest load of the path."""
    load_studies = list(dict.fromkeys(load_studies))
    by_slope = select_detached_lines(campaign, [study], quantity=_Y, along_slopes=True, both_models=True)
    by_load = select_detached_lines(campaign, load_studies, quantity=_Y, both_models=True)
    points = list(itertools.chain(*by_slope.values(), *by_load.values()))
    if len({point.labels.rms_slope for point in points}) == 1:  # the same markers in both panels
        by_load = {((*contact[:2], None), *of): line for (contact, *of), line in by_load.items()}
    models = names_of_models(points)
    contacts = [contact for contact, *_ in (*by_slope, *by_load)]
    looks = looks_of_studies(campaign, [study, *load_studies], contacts, crosses=len(models) > 1)
    factor, unit = choose_unit(max(float(run[_Y]) for point in points for run in point.by_seed.values()), "Pa")

    fig, [panels] = new_panels(2.9, columns=2 if by_load else 1, width=TWO_COLUMNS if by_load else ONE_COLUMN)
    second = " (a) and against the largest reduced pressure F/(E* h'rms A0) of the path (b)" if by_load else ""
    say(
        fig,
        f"""Pull-off pressure against the rms slope{second} of runs that separated completely. The pull-off pressure is
        the largest nominal tension in unloading.""",
    )
    counts = []
    for ax, x, drawn in zip(panels, ("rms_slope", "largest_reduced_pressure"), (by_slope, by_load), strict=False):
        lines = {key: Points(line, x, _Y, factor=factor) for key, line in drawn.items()}
        spread = _spread([line.means[0] for line in lines.values()])
        for position, ((contact, applicable, model), line) in enumerate(lines.items()):
            look = looks.look(contact, applicable=applicable, model=model) | _LINE
            if len(models) > 1 and model == REFERENCE_MODEL:
                look = cross_look(looks, contact, shape=_OBLIQUE) | _TRUTH
                look = look if applicable else pale(look, model)
            look["ms"] *= _SMALLER
            line.draw(ax, look, shift=spread ** ((position + 0.5) / len(lines) - 0.5))
            counts += line.counts
        loads, values = np.concatenate([line.means for line in lines.values()], axis=1)
        _scale(ax, values)
        ax.set_ylabel(label_of(_Y, unit))
    slopes = sorted({point.labels.rms_slope for line in by_slope.values() for point in line})
    scale = "log" if slopes[-1] > 3 * slopes[0] > 0 else "linear"
    panels[0].set(xlabel=label_of("rms_slope"), xscale=scale)
    room = 0.25 * (slopes[-1] or 1)  # a smooth shape has the slope 0
    panels[0].set_xlim(slopes[0] / 1.25 if slopes[0] else -room, slopes[-1] + room)
    ticks = [slope for k, slope in enumerate(slopes) if not k or slope > _APART * slopes[k - 1]]
    panels[0].set_xticks(ticks, [f"{slope:.4g}" for slope in ticks])
    panels[0].xaxis.minorticks_off()
    if by_load:
        panels[1].set_xlabel(label_of("largest_reduced_pressure"))
        if loads.min() > 0:
            logarithmic_axes(panels[1], "x")
            panels[1].set_xlim(loads.min() / 1.6, loads.max() * 1.6)
    handles = looks.handles(**_LINE)
    if len(models) > 1:
        handles = looks.colour_handles() if looks.by_place else handles
        handles |= {ASPERITIES_NAME: model_handle(ASPERITIES_NAME, **_LINE | looks.fill())}
        crossed = [contact for contact, _, model in (*by_slope, *by_load) if model == REFERENCE_MODEL]
        for contact in crossed:
            look = {"marker": cross_look(looks, contact, shape=_OBLIQUE)["marker"]}
            words = [REFERENCE_NAME, *([looks.shape_name(contact)] if any(map(looks.rank, crossed)) else [])]
            handles[", ".join(words)] = model_handle(REFERENCE_NAME, **look | _TRUTH)
        crosses = "Crosses and stars" if any(map(looks.rank, crossed)) else "Crosses"
        say(
            fig,
            f"""{crosses} with dashed lines are boundary elements, other symbols are the asperity model, on the same
            topographies.""",
        )
    runs = (run for point in points for run in point.by_seed.values())
    or_load = " or load" if by_load else ""
    say(
        fig,
        only_model(models),
        range_of_attraction(attractions_of(runs)),
        f"Points of several lines at one slope{or_load} are drawn side by side; lines guide the eye.",
    )
    if not all(point.surface_energy for point in points):
        say(fig, "Without adhesion (open markers), it is zero; a logarithmic axis is linear near zero.")
    say(fig, grid_of_loops(campaign, list(dict.fromkeys([study, *load_studies]))))
    title = [models[0] if len(models) == 1 else None, looks.heading()]
    panels[0].set_title(", ".join(filter(None, title)), loc="right", fontsize=8)
    legend_below(fig, handles | points_handles(fig, counts))
    return fig


def _scale(ax, values):
    """Set a linear y axis; if values span much, a logarithmic axis, which is linear near zero if there are zeros."""
    from matplotlib.ticker import LogLocator

    positive = drop_rounding_errors(values)
    zeros = len(positive) < np.isfinite(values).sum()
    if len(positive) and not zeros and positive.max() > _SPAN * positive.min():
        ax.set_yscale("log")
        ax.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        ax.yaxis.set_major_formatter("{x:g}")
        ax.yaxis.set_minor_formatter("")
        return
    if len(positive) and positive.max() > _SPAN_WITH_ZEROS * positive.min():
        least = 10.0 ** np.floor(np.log10(positive.min()))
        ax.set_yscale("symlog", linthresh=least, linscale=0.4)
        ax.set_ylim(-0.3 * least, 2 * positive.max())
    elif len(positive):
        ax.set_ylim(bottom=-0.04 * positive.max())
    ax.axhline(0, color=GREY, lw=0.6, zorder=1)


def _spread(positions):
    """Return the ratio of the last and the first of points side by side, so that points keep their order."""
    values = np.unique(np.concatenate(positions))
    ratios = values[1:] / values[:-1] if values.size and values[0] > 0 else np.empty(0)
    return min([_SPREAD, *np.sqrt(ratios[ratios > _SAME])])
