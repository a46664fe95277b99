"""Figures of loading and unloading: loops of rough contact (13), force of indenters (17), straight line of JKR (18)."""

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from icha.analysis.model_error import difference_of_contacts
from icha.contact.model import EVENT_KINDS
from icha.contact.models import MODELS, REFERENCE_MODEL
from icha.datasets.quantities import label_of, symbol_of
from icha.figures import select
from icha.figures.captions import attractions_of, grid_of_loops, only_spheres, range_of_attraction
from icha.figures.curves import Panel, panel_in_units
from icha.figures.drawn import Name, plot, record, say
from icha.figures.indenter_curves import read_measured, select_series, theory_curves
from icha.figures.looks import BRANCH_DASHES, MODEL_MARKERS, UNLOADING_MARKERS, Looks, legend_below, pale, surface_label
from icha.figures.style import BLACK, GREY, format_number, in_style, legend_handle, new_grid, new_panels, slope_label
from icha.references.indenter_runs import BRANCHES, reason_without_fit, spaced_states, steps_of
from icha.support.formatting import choose_unit, format_quantity

# --- figure 13 ---

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
    others = select.select_runs(campaign, boundary_elements or study, ragged=False, model=REFERENCE_MODEL)
    shown = {labels for labels, _ in runs}
    truths = [run for labels, run in others if labels not in shown and select.unloading_legs(run)]
    slopes = sorted({labels.rms_slope for labels, _ in runs}, reverse=True)
    own_rows = len(runs) > _MOST_LOOPS and 1 < len(slopes) < len(runs)
    # Slopes that have their own panels need no markers.
    contacts = [(labels.material, labels.surface, None if own_rows else labels.rms_slope) for labels, _ in runs]
    looks, drawn = Looks(campaign, [study], contacts, by_place=None), []
    for (labels, run), contact in zip(runs, contacts, strict=True):
        look = looks.look(contact, applicable=select.is_good_loop(run), model=labels.model)
        drawn.append((labels, run, [each for each in truths if not difference_of_contacts(run, each)], look))

    # A smooth shape has no roughness, whose height and slope are the reduced units.
    physical = units == "physical" or not any(float(run["rms_height"]) for _, run in runs)
    pressures, areas = _panels(campaign[study].to_dataset(), physical=physical)
    rows = [[slope] for slope in slopes] if own_rows else [slopes]
    by_row = [[loop for loop in drawn if loop[0].rms_slope in shown] for shown in rows]
    windows = [_small_tensions(loops_of_row, pressures) for loops_of_row in by_row]
    columns = 3 if any(windows) else 2
    fig, panels = new_panels(2.7 * len(rows), len(rows), columns)
    say(fig, _LOOPS if physical else f"{_LOOPS} In reduced units, that energy is divided by E* h'rms h_rms.")
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
    labels, _ = runs[0]
    models = dict.fromkeys([labels.model, *(REFERENCE_MODEL for _, _, beside, _ in drawn if beside)])
    title = " and ".join(MODELS[model].words for model in models)
    words = title, surface_label(campaign, labels.surface), f"seed {labels.seed}"
    fig.suptitle(", ".join(words), fontsize="medium")
    shown = [each for _, run, beside, _ in drawn for each in (run, *beside)]
    studies = list(dict.fromkeys(filter(None, (study, boundary_elements))))
    say(fig, range_of_attraction(attractions_of(shown)), grid_of_loops(campaign, studies))
    legend_below(fig, _handles(looks, drawn, marked=len(rows[0]) > 1), looks.heading())
    return fig


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
            # The colour is already pale if the asperity model is not applicable.
            crosses = crosses if select.is_good_loop(truth) or "label" in look else pale(crosses, REFERENCE_MODEL)
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
    return _limits(np.concatenate(shown)), (-_REACH * tension, _REACH * tension)


# Space around the states of the runs, divided by their range.
_MARGIN = 0.06


def _limits(values):
    """Return the limits of an axis around some values."""
    room = _MARGIN * np.ptp(values)
    return float(values.min() - room), float(values.max() + room)


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


# --- figure 17 ---

# Largest number of series in a panel.
_MOST_SERIES = 3
_LOOP = {"lw": 0.9, "alpha": 0.85}
_THEORIES = {
    "JKR": {"color": GREY, "lw": 2.4, "alpha": 0.45},
    "JKR, receding": {"color": GREY, "lw": 2.4, "alpha": 0.25},
    "Hertz": {"color": GREY, "lw": 0.9, "ls": ":"},
}
_INDENTATION = """Force against indentation. The indentation is the distance by which the apex of the shape without
roughness has moved beyond the undeformed plane of the elastic body. Tension is negative. Every seed is a line of its
own."""
_SPHERES = """The theories of Hertz, and of Johnson, Kendall and Roberts (JKR), are for a smooth sphere with the radius,
the modulus and the works of adhesion of the runs in the same panel. The line of JKR includes states that are unstable
under load control, up to the jump-off under displacement control. Runs without adhesion have no line of JKR; shapes
without a radius and layers have no line."""


@in_style
def force_indentation(
    campaign: xr.DataTree,
    tables: Sequence[str | os.PathLike] = (),
    *,
    study: str,
    measurements: Sequence[Mapping[str, Any]] = (),
) -> Figure:
    """Draw force against indentation for all runs of a study, with the theories for each radius and material.

    Series have a panel each if they are many, or if they differ in more than the rms height. Tables and measurements
    (`icha.figures.indenter_curves.read_measured`) with forces and indentations are shown too.
    """
    series = select_series(campaign, study)
    runs = [run for each in series for run in each.runs.by_seed.values()]
    names = "indentation", "force"
    panel = panel_in_units(*names, *runs)
    limits = [_limits(values) for values in map(np.concatenate, zip(*map(panel.points, runs), strict=True))]
    together = len(series) <= _MOST_SERIES and not any(each.contact for each in series)
    shown = [series] if together else [[each] for each in series]
    fig, panels, columns = new_grid(len(shown), 2, 2.7, 3.55, least=1.3, sharex=True, sharey=True)
    say(fig, _INDENTATION)
    measured = read_measured(fig, tables, measurements, *names)
    points = [(panel.points(each.values), each) for each in measured]
    for axis, ends in enumerate(limits):
        drawn = np.concatenate([ends, *(values[axis] for values, _ in points)])
        limits[axis] = _limits(drawn) if points else ends
    largest = max(float(run["contact_radius"].max()) for run in runs)
    theories = {}
    for ax, of_panel in zip(panels, shown, strict=True):
        of_sphere = theory_curves(of_panel[0].first_run, 1.5 * largest)
        theories |= of_sphere
        for name, states in of_sphere.items():
            plot(ax, *panel.points(dict(zip(names, states, strict=True))), name, zorder=1, **_THEORIES[name])
        for each in of_panel:
            for seed, run in each.runs.by_seed.items():
                for branch, leg in select.branches(run):
                    name = Name(branch, each.runs.labels._replace(seed=seed))
                    plot(ax, *panel.points(leg), name, color=each.colour, ls=BRANCH_DASHES[branch], **_LOOP)
        for values, each in points:
            if each.material in (None, *(one.runs.labels.material for one in of_panel)):
                plot(ax, *values, each.label, **each.look)
        ax.axhline(0, color=GREY, lw=0.5, zorder=0)
        if len(shown) > 1:
            ax.set_title(of_panel[0].name, loc="right")
        ax.set(xlim=limits[0], ylim=limits[1])
    for ax in panels[-columns:]:
        ax.set_xlabel(label_of(panel.x, panel.units[0]))
    for ax in panels[::columns]:
        ax.set_ylabel(label_of(panel.y, panel.units[1]))
    say(fig, _SPHERES if theories else "")
    named = [] if len(shown) > 1 else series
    handles = {each.name: legend_handle(color=each.colour, **_LOOP) for each in named}
    handles |= {name: legend_handle(color=BLACK, ls=dashes, **_LOOP) for name, dashes in BRANCH_DASHES.items()}
    handles |= {f"{name}, smooth sphere": legend_handle(**_THEORIES[name]) for name in theories}
    handles |= {each.label: legend_handle(**each.look) for each in measured}
    legend_below(fig, handles)
    return fig


# --- figure 18 ---

# Variables of the works of adhesion; title of the panel and marker of the states.
_TITLES = {"approach": ("loading", "o"), "retraction": ("unloading", "s")}
_STATES = {"ls": "none", "ms": 2.8, "mew": 0.6, "mfc": "white"}
_FIT = {"lw": 0.9, "ls": "-"}

_LINE = """Linearised plot of the equation of Johnson, Kendall and Roberts (JKR), for the first loading (a) and the
last unloading up to the largest tension (b). Here F is the force, R the radius of the smooth sphere, and a the radius
of a circle with the true contact area. A smooth sphere with a Tabor parameter of 3 or more gives a straight line of
slope 3/(4 E*), and the work of adhesion w follows from the value at F = 0, 3 sqrt(8 π E* w)/(4 E*). Markers are states
of all seeds, at most one hundred of each run at equal steps of the indentation. States with F/a^(3/2) below -sqrt(8 π
E* Δγ), where no sphere of JKR has contact (Δγ of receding edges), are not shown; in unloading with two works of
adhesion, neither are states whose edge stands. A fit minimises the squared differences of a³ at given F, with the given
E* and R, so states with a large radius have most weight. The legend gives means over the seeds."""


@in_style
def jkr_plot(
    campaign: xr.DataTree,
    tables: Sequence[str | os.PathLike] = (),
    *,
    study: str,
    measurements: Sequence[Mapping[str, Any]] = (),
) -> Figure:
    """Draw a^(3/2)/R against F/a^(3/2) for loading and unloading, with the fitted JKR lines.

    The equation of JKR, F = 4 E* a^3/(3 R) - sqrt(8 pi E* w a^3), is the straight line y = 3 (x + sqrt(8 pi E* w))/(4
    E*) with x = F/a^(3/2) and y = a^(3/2)/R. Runs without adhesion, without a radius R, and on a layer are left out.
    Tables and measurements (`icha.figures.indenter_curves.read_measured`) with forces and contact radii are shown too.
    The largest force is the end of loading, and R is that of the runs.
    """
    series = select_series(campaign, study, only_jkr=True)
    drawn = []
    for each in series:
        for seed, run in each.runs.by_seed.items():
            labels = each.runs.labels._replace(seed=seed)
            for branch, choose in BRANCHES.items():
                states = choose(steps_of(run))
                chosen = [states[k] for k in spaced_states([state["indentation"] for state in states])]
                force, radius = (np.array([state[name] for state in chosen]) for name in ("force", "contact_radius"))
                x, y = force / radius**1.5, radius**1.5 / float(run["shape_radius"])
                # The line of JKR is zero here. States beyond it, of little contact area, would hide the others.
                work = max(float(run["surface_energy"]), float(run["receding_energy"]))
                inside = x > -np.sqrt(8 * np.pi * float(run["contact_modulus"]) * work)
                drawn.append((branch, each, labels, run, x[inside], y[inside]))
    scale, unit = choose_unit(max(float(np.abs(x).max(initial=0.0)) for *_, x, _ in drawn), "N")
    fig, [panels] = new_panels(3.0, sharex=True, sharey=True)
    say(fig, _LINE, only_spheres(campaign[study].to_dataset()))
    for branch, each, labels, run, x, y in drawn:
        ax = panels[list(_TITLES).index(branch)]
        plot(ax, x * scale, y * 1e3, Name("states", labels), marker=_TITLES[branch][1], mec=each.colour, **_STATES)
        if (name := f"work_of_adhesion_{branch}") in run:
            modulus = float(run["contact_modulus"])
            line = 0.75 / modulus * (x + np.sqrt(8 * np.pi * modulus * float(run[name])))
            plot(ax, x * scale, line * 1e3, Name("fit of JKR", labels), color=each.colour, **_FIT)
    measured = read_measured(fig, tables, measurements, "force", "contact_radius")
    for each in measured:
        force, radius = each.values["force"], each.values["contact_radius"]
        x, y = force / radius**1.5, radius**1.5 / float(series[0].first_run["shape_radius"])
        top = int(np.argmax(force))
        for ax, part in zip(panels, (slice(top + 1), slice(top, None)), strict=True):
            plot(ax, x[part] * scale, y[part] * 1e3, each.label, **each.look)
    for ax, (name, _) in zip(panels, _TITLES.values(), strict=True):
        ax.set_title(name, loc="right")
        ax.set(xlabel=rf"$F/a^{{3/2}}$  ({unit} m$^{{-3/2}}$)", ylabel=r"$a^{3/2}/R$  ($10^{-3}$ m$^{1/2}$)")
        ax.label_outer()
    handles = {f"{each.name}: {_works(each)}": legend_handle(color=each.colour, **_FIT) for each in series}
    states = {"states": legend_handle(marker="o", mec=GREY, **_STATES), "fit of JKR": legend_handle(color=GREY, **_FIT)}
    legend_below(fig, handles | states | {each.label: legend_handle(**each.look) for each in measured})
    return fig


def _works(series):
    """Return the mean fitted works of adhesion of a series as text, or why there are none."""
    words, runs = [], list(series.runs.by_seed.values())
    for branch, (title, _) in _TITLES.items():
        name = f"work_of_adhesion_{branch}"
        values = [float(run[name]) for run in runs if name in run]
        if values:
            fewer = f" ({len(values)} of {len(runs)} seeds)" if len(values) < len(runs) else ""
            words.append(f"{title} {format_quantity(float(f'{np.mean(values):.3g}'), 'J/m²')}{fewer}")
        else:
            words.append(f"{title} no fit ({reason_without_fit(runs[0], branch)})")
    return ", ".join(words)
