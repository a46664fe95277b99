"""Figure of loading and unloading of rough contact (13)."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from icha.analysis.model_error import difference_of_contacts
from icha.contact.model import EVENT_KINDS
from icha.contact.models import MODELS, REFERENCE_MODEL
from icha.datasets.campaign import runs_with_labels, runs_with_unloading
from icha.datasets.quantities import symbol_of
from icha.figures import select
from icha.figures.captions import attractions_of, grid_of_loops, of_other_study, range_of_attraction
from icha.figures.curves import Panel, panel_in_units
from icha.figures.drawn import Name, plot, record, say, show_runs
from icha.figures.looks import BRANCH_DASHES, MODEL_MARKERS, UNLOADING_MARKERS, Looks, legend_below, pale, surface_label
from icha.figures.style import GREY, format_number, in_style, legend_handle, limits_around, new_panels, slope_label
from icha.path.targets import LOAD_CONTROL

# All slopes share a panel if there are at most this number of loops.
_MOST_LOOPS = 4
# A panel enlarges the tension if the largest tension is smaller than the largest pressure times this factor.
_SMALL_TENSION = 0.25
# Largest pressure in this panel, divided by the largest tension.
_REACH = 1.4
# Distance between the markers of boundary elements, divided by the diagonal of the panel.
_APART = 0.025
# Loading is a pale, wide line, so that it is visible where unloading coincides with it.
_BRANCHES = {"loading": {"lw": 2.6, "alpha": 0.4}, "unloading": {"lw": 0.9}}
# Number of points that are drawn for each step of the path.
_POINTS_BETWEEN = 8
_PULL_OFF = {"ls": "none", "mec": "black", "mew": 0.7, "ms": 4.6, "zorder": 6}
_TRUTH = {"ls": "none", "ms": 3.6, "mew": 0.7, "zorder": 5}
_TRUTH_MARKERS = {"loading": MODEL_MARKERS, "unloading": UNLOADING_MARKERS}
_LOOPS = """Load against mean separation (left), and contact area against load (right), on one topography, which the
title names. Where loading and unloading coincide, contact is reversible. Tension is negative; pull-off is the largest
tension in the last unloading. Sudden changes along a line are jumps of one or several spots. A straight line joins the
states before and after a jump, as at both ends of a path, where the load is zero because there is no contact. The area
between loading and unloading on the left is the energy lost per nominal area."""
_UNDER_LOAD = """Under load control, more energy is lost than this area, because the load is constant in a jump and does
not follow the straight line."""


@in_style
def loops(
    campaign: xr.DataTree,
    *,
    study: str,
    boundary_elements: str | None = None,
    surface: str | None = None,
    seed: int | None = None,
    units: str = "reduced",
) -> Figure:
    """Draw the runs of all slopes and materials of a study on one topography.

    Defaults are surface and seed of the first complete run. Smooth shapes are always in physical units.
    """
    runs = select.select_by_labels(select.select_unloaded_runs(campaign, study), surface=surface, seed=seed)
    # Boundary elements of the study itself are drawn beside another model only.
    own = runs[0][0].model == REFERENCE_MODEL and boundary_elements in (None, study)
    others = select.select_runs(campaign, boundary_elements or study, ragged=False, model=REFERENCE_MODEL)
    truths = [] if own else [loop for loop in others if select.unloading_legs(loop[1])]
    slopes = sorted({labels.rms_slope for labels, _ in runs}, reverse=True)
    own_rows = len(runs) > _MOST_LOOPS and 1 < len(slopes) < len(runs)
    drawn = [(labels, run, select.Line.of(labels, select.doubt_about_loop(run))) for labels, run in runs]
    if own_rows:  # Slopes that have their own panels need no markers.
        drawn = [(*loop, line._replace(rms_slope=None)) for *loop, line in drawn]
    looks = Looks(campaign, [study], [line for *_, line in drawn], by_place=None)
    drawn = [(labels, run, _of_same_contact(labels, run, truths), looks.look(line)) for labels, run, line in drawn]

    # A smooth shape has no roughness, whose height and slope are the reduced units.
    physical = units == "physical" or not any(float(run["rms_height"]) for _, run in runs)
    dataset = campaign[study].to_dataset()
    pressures, areas = _panels(dataset, physical=physical)
    rows = [[slope] for slope in slopes] if own_rows else [slopes]
    by_row = [[loop for loop in drawn if loop[0].rms_slope in shown] for shown in rows]
    windows = [_small_tensions(loops_of_row, pressures) for loops_of_row in by_row]
    columns = 3 if any(windows) else 2
    fig, panels = new_panels(2.7 * len(rows), len(rows), columns)
    labels, _ = runs[0]
    topography = runs_with_labels(dataset, surface=labels.surface, seed=labels.seed)
    show_runs(fig, study, runs_with_unloading(dataset), topography)
    say(fig, _LOOPS if physical else f"{_LOOPS} In reduced units, that energy is divided by E* h'rms h_rms.")
    say(fig, _UNDER_LOAD if any(run["control"].item() == LOAD_CONTROL for _, run in runs) else "")
    say(fig, of_other_study(boundary_elements))
    for (left, *middle, right), shown_loops, window in zip(panels, by_row, windows, strict=True):
        for ax, panel in ((left, pressures), *((ax, pressures) for ax in middle), (right, areas)):
            for loop in shown_loops:
                _draw(ax, *loop, panel, turn=len(slopes) > 1)
            panel.label(ax, lowest=shown_loops is by_row[-1])
        for ax in middle:
            ax.axhline(0, color=GREY, lw=0.5, zorder=1)
            ax.xaxis.set_major_locator(MaxNLocator(4))
            ax.text(0.95, 0.9, "near zero load", transform=ax.transAxes, ha="right", fontsize=8)
            if window:
                ax.set(xlim=window[0], ylim=window[1])
            ax.yaxis.set_major_formatter(lambda value, _: format_number(value))
            ax.set_ylabel(symbol_of(pressures.y) + (f" ({pressures.units[1]})" if physical else ""))
        if own_rows:
            right.set_title(slope_label(shown_loops[0][0].rms_slope), loc="right")
    models = dict.fromkeys([labels.model, *(REFERENCE_MODEL for _, _, beside, _ in drawn if beside)])
    title = " and ".join(MODELS[model].words for model in models)
    words = title, surface_label(campaign, labels.surface), f"seed {labels.seed}"
    fig.suptitle(", ".join(words), fontsize="medium")
    shown = [each for _, run, beside, _ in drawn for each in (run, *beside)]
    studies = list(dict.fromkeys(filter(None, (study, boundary_elements))))
    say(fig, range_of_attraction(attractions_of(shown)), grid_of_loops(campaign, studies))
    legend_below(fig, _handles(looks, drawn, marked=len(rows[0]) > 1), looks.heading())
    return fig


def _of_same_contact(labels, run, truths):
    """Return the runs among `truths` with the material and the topography of a run; their grids may differ."""
    alike = [truth for others, truth in truths if others.material == labels.material]
    return [truth for truth in alike if not difference_of_contacts(run, truth)]


def _panels(dataset, *, physical):
    """Return panels of load against separation, and of area against load."""
    if not physical:
        return Panel("reduced_separation", "reduced_pressure"), Panel("reduced_pressure", "contact_area_fraction")
    loads = panel_in_units("mean_separation", "nominal_pressure", dataset)
    return loads, panel_in_units("nominal_pressure", "contact_area_fraction", dataset)


def _draw(ax, labels, run, truths, look, panel, *, turn):
    """Draw a run with a marker at pull-off, and runs with boundary elements beside it.

    If `turn` is True, also mark the end of the first loading.
    """
    colour, words = look["color"], select.name_of_model(run)
    for branch, leg in select.branches(run):
        record(ax, *panel.points(leg), Name(f"{words}, {branch}", labels))
        line = panel.points(leg) if panel.y == "contact_area_fraction" else _curve(leg, panel)
        ax.plot(*line, ls=BRANCH_DASHES[branch], color=colour, **_BRANCHES[branch])
    marked = [(np.flatnonzero(run["leg"] == 0)[-1], {"ls": "none", "zorder": 5})] if turn else []
    if turn:
        say(ax, "Symbols without an edge mark the end of the first loading.")
    if (at := select.pull_off_step(run)) is not None:
        marked.append((at, _PULL_OFF))
    for step, mark in marked:
        ax.plot(*(values[step] for values in panel.points(run)), **look | mark)
    for truth in truths:
        name = select.name_of_model(truth)
        for branch, markers in _TRUTH_MARKERS.items():
            states = truth.isel(step=truth["branch"].values == branch)
            crosses = {"color": colour, "marker": markers[name], **_TRUTH}
            # The colour may be pale already, like that of the run.
            crosses = crosses if "label" in look else pale(crosses, select.doubt_about_loop(truth))
            of_truth = Name(f"{name}, {branch}", labels._replace(model=REFERENCE_MODEL))
            plot(ax, *panel.points(states), of_truth, markevery=_APART, **crosses)


def _curve(leg, panel):
    """Return separations and loads along a leg: cubic between two states, or straight if an event lies between them."""
    separation, load = panel.points(leg)
    # The stiffness in the units of the axes.
    unit = panel.factors[0] / panel.factors[1]
    if panel.y == "reduced_pressure":
        unit *= float(leg["contact_modulus"] * leg["unit_slope"] / leg["unit_height"])
    slope = -leg["contact_stiffness"].values / unit
    width, change = np.diff(separation)[:, None], np.diff(load)[:, None]
    t = np.linspace(0, 1, _POINTS_BETWEEN, endpoint=False)
    with np.errstate(invalid="ignore"):  # the slope may be infinite, just before a jump and in full contact
        # Slopes relative to the chord determine how far the cubic polynomial is from the chord.
        start, end = (width * each[:, None] - change for each in (slope[:-1], slope[1:]))
        bulge = t * (1 - t) * ((1 - t) * start - t * end)
    smooth = np.all([np.diff(leg[f"{kind}_count"].values) == 0 for kind in EVENT_KINDS], axis=0)[:, None]
    # A cubic polynomial that leaves the range of both loads by as much as they differ would not be the curve.
    bulge = np.where(smooth & (np.abs(bulge) <= np.abs(change)).all(axis=1, keepdims=True), bulge, 0.0)
    separations, loads = separation[:-1, None] + width * t, load[:-1, None] + change * t + bulge
    return np.append(separations, separation[-1]), np.append(loads, load[-1])


def _small_tensions(drawn, panel):
    """Return the limits of separation and load around zero load, if the tension is small but not zero; else None."""
    points = [panel.points(run) for _, run, *_ in drawn]
    pressures = np.concatenate([load for _, load in points])
    tension = -pressures.min()
    if not select.ROUNDING * pressures.max() < tension < _SMALL_TENSION * pressures.max():
        return None
    shown = []
    for (_, run, *_), (separation, load) in zip(drawn, points, strict=True):
        near = (np.abs(load) <= _REACH * tension) & (run["contact_area_fraction"].values > 0)
        at = np.flatnonzero(near)
        # The first state after separation is shown as well.
        shown.append(separation[np.unique([*at, min(at[-1] + 1, len(near) - 1)])] if at.size else [])
    return limits_around(np.concatenate(shown)), (-_REACH * tension, _REACH * tension)


def _handles(looks, loops, *, marked):
    """Return the legend entries by name; `marked` is True if markers distinguish the loops."""
    handles = looks.handles(lw=4, ls="-", **({} if marked else {"marker": "none"}))
    for branch, dashes in BRANCH_DASHES.items():
        handles[branch] = legend_handle(color=GREY, ls=dashes, **_BRANCHES[branch])
    if any(select.pull_off_step(run) is not None for _, run, *_ in loops):
        handles["pull-off"] = legend_handle(marker="o", mfc=GREY, **_PULL_OFF)
    for name in dict.fromkeys(select.name_of_model(truth) for _, _, truths, _ in loops for truth in truths):
        for branch, markers in _TRUTH_MARKERS.items():
            handles[f"{name}, {branch}"] = legend_handle(color=GREY, marker=markers[name], **_TRUTH)
    return handles
