"""Fig. 13: load and contact area in loading and unloading."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from pydantic import Field

from icha.contact.models import REFERENCE_MODEL
from icha.datasets import results
from icha.datasets.labels import ContactLabels
from icha.datasets.variables.model_error import FINITE_RANGE, SHORT_RANGE
from icha.figures import select
from icha.figures.curves import AREA_LABEL, PRESSURE_LABEL, SEPARATION_LABEL
from icha.figures.declaration import Campaign, Declaration, Inputs, TruthFigure, unloading_problems
from icha.figures.ensembles import draw_scatter, lines_handles, mark_fewer
from icha.figures.looks import BRANCH_DASHES, MODEL_MARKERS, UNLOADING_MARKERS, legend_below, looks_of_studies
from icha.figures.style import GREY, in_style, legend_handle, new_panels, slope_label
from icha.support.values import Label, Problem, Seed

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class LoopsFigure(TruthFigure):
    """A figure of the runs of a study in loading and unloading, on one topography."""

    surface: Label | None = Field(default=None, description="Surface to show. Default: the first of the study.")
    seed: Seed | None = Field(default=None, description="Seed to show. Default: the first of the study.")

    def problems(self, campaign: Campaign) -> Iterator[Problem]:
        """Also yield a problem if the study does not unload."""
        yield from super().problems(campaign)
        yield from unloading_problems(campaign, ("study",), self.study, partly=True)


def inputs(campaign: Campaign, options: LoopsFigure, files: results.ResultFiles) -> Inputs:
    """Return the runs, and loading and unloading with boundary elements at a finite range, if there are any."""
    loops = [
        files.path(results.LOOP, ContactLabels(label, *contact))
        for label, entry in campaign.boundary_element_loops.items()
        if entry.study == options.study
        for contact in campaign.contacts_beside(entry)
    ]
    return {"campaign": files.path(results.DATASET)} | ({"loops": loops} if loops else {})


DECLARATION = Declaration(
    description="Pressure against mean separation and contact area against load, in loading and unloading.",
    options=LoopsFigure,
    inputs=inputs,
)

# Largest number of loops for which all slopes share their panels.
_MOST_LOOPS = 4
# Tension over the largest pressure, below which an inset enlarges it, and range of the inset over the tension.
_SMALL_TENSION = 0.25
_REACH = 1.4
# Distance between marks of boundary elements, in diagonals of the panel.
_APART = 0.025
_LOOP = {"lw": 0.9}
_PULL_OFF = {"ls": "none", "mec": "black", "mew": 0.7, "ms": 4.6, "zorder": 6}
_TRUTH = {"ls": "none", "ms": 3.6, "mew": 0.7, "zorder": 5}
_TRUTH_MARKERS = {"loading": MODEL_MARKERS, "unloading": UNLOADING_MARKERS}
# Variables along x and y of the two panels.
_LOADS = ("reduced_separation", "reduced_pressure")
_AREAS = ("reduced_pressure", "contact_area_fraction")


class _Loop(NamedTuple):
    """A loop of a figure.

    Attributes
    ----------
    runs : runs of the contact, one for each seed.
    legs : legs that are drawn: of the run, or means over the seeds.
    truths : boundary elements of the same contact.
    look : look of the lines and marks, arguments of `Axes.plot`.
    """

    runs: select.ContactRuns
    legs: list[select.Leg]
    truths: list[xr.Dataset]
    look: dict


@in_style
def figure(
    campaign: xr.DataTree,
    loops: Sequence[xr.Dataset] | None = None,
    *,
    study: str,
    boundary_elements: str | None = None,
    surface: str | None = None,
    seed: int | None = None,
) -> Figure:
    """Draw the runs of all slopes and materials of a study on one surface, and one seed or the mean over the seeds.

    Parameters
    ----------
    campaign : the campaign dataset.
    loops : loading and unloading of runs of the study with boundary elements at finite ranges, if there are any.
        Only those of the surface and seed that are drawn are shown.
    seed : None for the first seed that has boundary elements or, if no seed has any, for the mean over all seeds.
    """
    runs = select.select_unloaded_runs(campaign, study)
    others = select.select_runs(campaign, boundary_elements or study, ragged=False, model=REFERENCE_MODEL)
    truths = _truths(study, runs, [*(run for _, run in others if select.unloading_legs(run)), *(loops or ())])
    surface = select.pick("surface", surface, [labels.surface for labels, _ in runs])
    runs = [(labels, run) for labels, run in runs if labels.surface == surface]
    if seed is None:
        seed = next((labels.seed for labels, _ in runs if labels in truths), None)
    else:
        select.pick("seed", seed, [labels.seed for labels, _ in runs])
    groups = select.group_by_contact(campaign, [each for each in runs if seed in (None, each[0].seed)])
    if seed is not None:
        groups = [group._replace(asked=1) for group in groups]
    slopes = sorted({group.labels.rms_slope for group in groups}, reverse=True)
    contacts = {group.contact for group in groups}
    own_rows = len(contacts) > _MOST_LOOPS and 1 < len(slopes) < len(contacts)
    # Slopes that have panels of their own need no other distinction.
    contacts = [(*group.contact[:2], None if own_rows else group.labels.rms_slope) for group in groups]
    looks = looks_of_studies(campaign, [study], contacts)
    drawn = []
    for group, contact in zip(groups, contacts, strict=True):
        legs = select.average_legs([list(select.branches(run)) for run in group.by_seed.values()])
        look = looks.look(contact, applicable=group.applicable)
        drawn.append(_Loop(group, legs, truths.get(group.labels, []), look))

    rows = [[slope] for slope in slopes] if own_rows else [slopes]
    fig, panels = new_panels(2.7 * len(rows), len(rows))
    for (left, right), shown in zip(panels, rows, strict=True):
        shown_loops = [loop for loop in drawn if loop.runs.labels.rms_slope in shown]
        for loop in shown_loops:
            for ax, names in ((left, _LOADS), (right, _AREAS)):
                _draw(ax, loop, names, turn=len(shown) > 1, lines=len(shown_loops))
        _enlarge(left, shown_loops)
        left.set_ylabel(PRESSURE_LABEL)
        right.set_ylabel(AREA_LABEL)
        if own_rows:
            right.set_title(slope_label(shown[0]), loc="right")
    panels[-1, 0].set_xlabel(SEPARATION_LABEL)
    panels[-1, 1].set_xlabel(PRESSURE_LABEL)
    title = f"surface {surface}" + ("" if seed is None else f", seed {seed}")
    panels[0, 0].set_title(title, loc="right", parse_math=False)
    legend_below(fig, _handles(looks, drawn, marked=len(rows[0]) > 1))
    return fig


def _draw(ax, loop, names, *, turn, lines):
    """Draw a loop and a mark at its pull-off; with `turn`, or if seeds are missing, mark its first turning point."""
    colour = loop.look["color"]
    for leg in loop.legs:
        x, y = (leg.values[name].values for name in names)
        dashes = BRANCH_DASHES[leg.branch]
        ax.plot(x, y, ls=dashes, color=colour, **_LOOP)
        if leg.members:
            members = leg.members.get(names[0], x), leg.members[names[1]]
            draw_scatter(ax, *members, colour, positive=False, lines=lines, ls=dashes)
    runs = loop.runs.by_seed.values()
    marked = []
    if turn or len(runs) < loop.runs.asked:
        ends = [run.isel(step=int(np.flatnonzero(run["leg"].values == 0)[-1])) for run in runs]
        marked.append((ends, loop.look | {"ls": "none", "zorder": 5}))
    pulls = [run.isel(step=at) for run in runs if (at := select.pull_off_step(run)) is not None]
    if pulls:
        marked.append((pulls, loop.look | _PULL_OFF))
    for states, mark in marked:
        x, y = (np.mean([[float(state[name])] for state in states], axis=0) for name in names)
        ax.plot(x, y, **mark)
        mark_fewer(ax, x, y, np.ones((len(states), 1), bool), mark, loop.runs.asked)
    for truth in loop.truths:
        for branch, markers in _TRUTH_MARKERS.items():
            states = truth.isel(step=truth["branch"].values == branch)
            marker = markers[_truth_name(truth)]
            ax.plot(*(states[name] for name in names), color=colour, marker=marker, markevery=_APART, **_TRUTH)


def _enlarge(ax, loops):
    """Add an inset around zero load to the panel of loads, if the largest tension is positive but small."""
    from matplotlib.ticker import MaxNLocator

    separations, pressures, areas = (
        np.concatenate([leg.values[name].values for loop in loops for leg in loop.legs])
        for name in (*_LOADS, "contact_area_fraction")
    )
    tension = -pressures.min()
    if not select.ROUNDING * pressures.max() < tension < _SMALL_TENSION * pressures.max():
        return
    shown = separations[(np.abs(pressures) <= _REACH * tension) & (areas > 0)]
    room = 0.06 * np.ptp(shown)
    inset = ax.inset_axes((0.5, 0.44, 0.46, 0.48))
    for loop in loops:
        _draw(inset, loop, _LOADS, turn=False, lines=len(loops))
    inset.set(xlim=(shown.min() - room, shown.max() + room), ylim=(-_REACH * tension, _REACH * tension))
    inset.axhline(0, color=GREY, lw=0.5, zorder=1)
    inset.tick_params(labelsize=6.5, pad=2)
    inset.ticklabel_format(style="sci", scilimits=(-2, 3), useMathText=True)
    inset.yaxis.get_offset_text().set_fontsize(6.5)
    inset.xaxis.set_major_locator(MaxNLocator(4))


def _handles(looks, loops, *, marked):
    """Return the handles of the legend by name; `marked`: whether loops have markers, since slopes share a panel."""
    handles = looks.handles(**_LOOP, **({} if marked else {"marker": "none"}))
    for branch, dashes in BRANCH_DASHES.items():
        handles[branch] = legend_handle(color=GREY, ls=dashes, **_LOOP)
    handles |= lines_handles(len(loop.runs.by_seed) for loop in loops)
    if any(select.pull_off_step(run) is not None for loop in loops for run in loop.runs.by_seed.values()):
        handles["pull-off"] = legend_handle(marker="o", mfc=GREY, **_PULL_OFF)
    for name in dict.fromkeys(_truth_name(truth) for loop in loops for truth in loop.truths):
        for branch, markers in _TRUTH_MARKERS.items():
            handles[f"{name}, {branch}"] = legend_handle(color=GREY, marker=markers[name], **_TRUTH)
    return handles


def _truth_name(truth):
    """Return the name of boundary elements; only runs of a campaign have the attribute `contact_model`."""
    return SHORT_RANGE if truth.attrs.get("contact_model") == REFERENCE_MODEL else FINITE_RANGE


def _truths(study, runs, loops):
    """Return the boundary elements of the runs of a study that have some, by the labels of the runs."""
    from icha.analysis.model_error import run_of_same_contact

    found = {}
    for loop in loops:
        try:
            found.setdefault(run_of_same_contact(runs, loop), []).append(loop)
        except ValueError as error:
            raise ValueError(f"study {study}: {error}") from None
    return found
