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
from icha.figures.curves import AREA_LABEL, PRESSURE_LABEL, SEPARATION_LABEL
from icha.figures.declaration import Campaign, Declaration, Inputs, TruthFigure, unloading_problems
from icha.figures.ensembles import draw_scatter, lines_handles, mark_fewer
from icha.figures.hysteresis import ROUNDING, Leg, average_legs, pull_off_step, select_unloaded_runs
from icha.figures.legends import legend_below, words_handle
from icha.figures.looks import BRANCH_DASHES, MODEL_MARKERS, UNLOADING_MARKERS, looks_of_studies
from icha.figures.select import (
    ContactRuns,
    branches,
    group_by_contact,
    pick,
    select_runs,
    unloading_legs,
)
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
        """Yield in addition the problem of a study that does not unload."""
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
# Height of the panel of areas over that of its curves, if it has an inset above them.
_HEADROOM = 1.8
# Distance between marks of boundary elements, in diagonals of the panel.
_APART = 0.025
_LOOP = {"lw": 0.9}
_PULL_OFF = {"ls": "none", "mec": "black", "mew": 0.7, "ms": 4.6, "zorder": 6}
_TRUTH = {"ls": "none", "ms": 3.6, "mew": 0.7, "zorder": 5}


class _Loop(NamedTuple):
    """The runs of a contact, the legs that are drawn of them, and boundary elements of the same contact."""

    runs: ContactRuns
    legs: list[Leg]
    truths: list[xr.Dataset]


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
    seed : left out, the first that has boundary elements, or else the mean over all.
    """
    drawn, surface, seed = _loops(campaign, study, boundary_elements or study, loops or (), surface, seed)
    slopes = sorted({loop.runs.labels.rms_slope for loop in drawn}, reverse=True)
    contacts = {loop.runs.contact for loop in drawn}
    own_rows = len(contacts) > _MOST_LOOPS and 1 < len(slopes) < len(contacts)
    # Slopes that have panels of their own need no other distinction.
    contacts = [(*loop.runs.contact[:2], None if own_rows else loop.runs.labels.rms_slope) for loop in drawn]
    looks = looks_of_studies(campaign, [study], contacts)

    rows = [[slope] for slope in slopes] if own_rows else [slopes]
    fig, panels = new_panels(2.7 * len(rows), len(rows))
    for row, shown in zip(panels, rows, strict=True):
        shown_loops = [
            (loop, looks.look(contact, applicable=loop.runs.applicable))
            for loop, contact in zip(drawn, contacts, strict=True)
            if loop.runs.labels.rms_slope in shown
        ]
        _draw_row(row, shown_loops, turn=len(shown) > 1)
        if own_rows:
            row[-1].set_title(slope_label(shown[0]), loc="right")
    for ax, axis in zip(panels[-1], (_LOADS, _AREAS), strict=True):
        ax.set_xlabel(axis.x_label)
    title = f"surface {surface}" + ("" if seed is None else f", seed {seed}")
    panels[0, 0].set_title(title, loc="right", parse_math=False)
    handles = _handles(looks, drawn, marked=len(rows[0]) > 1) | _others(campaign[study].to_dataset(), seed)
    legend_below(fig, handles, scale=looks.scale, panels=panels.ravel())
    return fig


def _loops(campaign, study, other_study, loops, surface, seed):
    """Return the loops of a surface and seed, and which surface and seed (None: all) these are."""
    runs = select_unloaded_runs(campaign, study)
    surface = pick("surface", surface, [labels.surface for labels, _ in runs])
    others = select_runs(campaign, other_study, ragged=False, model=REFERENCE_MODEL)
    truths = _truths(study, runs, [*(run for _, run in others if unloading_legs(run)), *loops])
    runs = [(labels, run) for labels, run in runs if labels.surface == surface]
    if seed is None:
        seed = next((labels.seed for labels, _ in runs if labels in truths), None)
    else:
        pick("seed", seed, [labels.seed for labels, _ in runs])
    found = []
    for group in group_by_contact(campaign, [each for each in runs if seed in (None, each[0].seed)]):
        legs = average_legs([list(branches(run)) for run in group.by_seed.values()])
        group = group if seed is None else group._replace(asked=1)
        found.append(_Loop(group, legs, truths.get(group.labels, [])))
    return found, surface, seed


def _draw_row(row, loops, *, turn):
    """Draw loops and their looks in a panel of loads and one of areas."""
    from matplotlib.ticker import MaxNLocator

    for ax, axis in zip(row, (_LOADS, _AREAS), strict=True):
        for loop, look in loops:
            _draw(ax, loop, look, axis, turn=turn, lines=len(loops))
        ax.set_ylabel(axis.y_label)
        ax.xaxis.set_major_locator(MaxNLocator(5))
    _enlarge(*row, loops)


def _others(dataset, seed):
    """Return legend entries about surfaces and seeds that are not drawn."""
    drawn = {"surface": 1, "seed": dataset.sizes["seed"] if seed is None else 1}
    words = [
        f"{drawn[label]} of {dataset.sizes[label]} {label}s; choose with `{label}:`"
        for label in drawn
        if drawn[label] < dataset.sizes[label]
    ]
    return words_handle("; ".join(words)) if words else {}


class _Axis(NamedTuple):
    x: str
    y: str
    x_label: str
    y_label: str


_LOADS = _Axis("reduced_separation", "reduced_pressure", SEPARATION_LABEL, PRESSURE_LABEL)
_AREAS = _Axis("reduced_pressure", "contact_area_fraction", PRESSURE_LABEL, AREA_LABEL)


def _draw(ax, loop, look, axis, *, turn, lines):
    """Draw a loop and a mark at its pull-off; with `turn`, or if seeds are missing, mark its first turning point."""
    colour = look["color"]
    for leg in loop.legs:
        x, y = leg.values[axis.x], leg.values[axis.y]
        dashes = BRANCH_DASHES[leg.branch]
        ax.plot(x, y, ls=dashes, color=colour, **_LOOP)
        if leg.members:
            members = leg.members.get(axis.x, x), leg.members[axis.y]
            draw_scatter(ax, *members, colour, positive=False, lines=lines, ls=dashes)
    runs = loop.runs.by_seed.values()
    marked = []
    if turn or len(runs) < loop.runs.asked:
        ends = [run.isel(step=int(np.flatnonzero(run["leg"].values == 0)[-1])) for run in runs]
        marked.append((ends, look | {"ls": "none", "zorder": 5}))
    pulls = [run.isel(step=at) for run in runs if (at := pull_off_step(run)) is not None]
    if pulls:
        marked.append((pulls, look | _PULL_OFF))
    for states, mark in marked:
        x, y = (np.mean([[float(state[name])] for state in states], axis=0) for name in (axis.x, axis.y))
        ax.plot(x, y, **mark)
        mark_fewer(ax, x, y, np.ones((len(states), 1), bool), mark, loop.runs.asked)
    for truth in loop.truths:
        for branch, markers in _CROSSES.items():
            states = truth.isel(step=truth["branch"].values == branch)
            marker = markers[_truth_name(truth)]
            ax.plot(states[axis.x], states[axis.y], color=colour, marker=marker, markevery=_APART, **_TRUTH)


def _enlarge(left, right, loops):
    """Add insets around zero load, if the largest tension is positive but small."""
    from matplotlib.ticker import MaxNLocator

    legs = [leg.values for loop, _ in loops for leg in loop.legs]
    pressures, separations, areas = (
        np.concatenate([leg[name] for leg in legs])
        for name in ("reduced_pressure", "reduced_separation", "contact_area_fraction")
    )
    tension = -pressures.min()
    if not ROUNDING * pressures.max() < tension < _SMALL_TENSION * pressures.max():
        return
    reach = np.array([-1, 1]) * _REACH * tension
    enlarged = (np.abs(pressures) <= reach[1]) & (areas > 0)
    separations, areas = separations[enlarged], areas[enlarged]
    room = 0.06 * np.ptp(separations)
    right.set_ylim(top=_HEADROOM * right.dataLim.y1)
    for ax, axis, corner, limits in (
        (left, _LOADS, (0.5, 0.44), ((separations.min() - room, separations.max() + room), reach)),
        (right, _AREAS, (0.1, 0.58), (reach, (0, 1.1 * areas.max()))),
    ):
        inset = ax.inset_axes((*corner, 0.46, 0.33 if ax is right else 0.48))
        for loop, look in loops:
            _draw(inset, loop, look, axis, turn=False, lines=len(loops))
        inset.set(xlim=limits[0], ylim=limits[1])
        inset.axhline(0, color=GREY, lw=0.5, zorder=1)
        inset.tick_params(labelsize=6.5, pad=2)
        inset.ticklabel_format(style="sci", scilimits=(-2, 3), useMathText=True)
        for each in (inset.xaxis, inset.yaxis):
            each.get_offset_text().set_fontsize(6.5)
            each.set_major_locator(MaxNLocator(4))


def _handles(looks, loops, *, marked):
    """Return the handles of the legend by name; `marked`: whether loops have markers, since slopes share a panel."""
    handles = looks.handles(**_LOOP, **({} if marked else {"marker": "none"}))
    for branch, dashes in BRANCH_DASHES.items():
        handles[branch] = legend_handle(color=GREY, ls=dashes, **_LOOP)
    handles |= lines_handles(len(loop.runs.by_seed) for loop in loops)
    if any(pull_off_step(run) is not None for loop in loops for run in loop.runs.by_seed.values()):
        handles["pull-off"] = legend_handle(marker="o", mfc=GREY, **_PULL_OFF)
    for name in dict.fromkeys(_truth_name(truth) for loop in loops for truth in loop.truths):
        for branch, markers in _CROSSES.items():
            handles[f"{name}, {branch}"] = legend_handle(color=GREY, marker=markers[name], **_TRUTH)
    return handles


_CROSSES = {"loading": MODEL_MARKERS, "unloading": UNLOADING_MARKERS}


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
