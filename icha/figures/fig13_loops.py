"""Fig. 13: load and contact area in loading and unloading."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.model import EVENT_KINDS
from icha.contact.models import MODELS, REFERENCE_MODEL
from icha.datasets.labels import RunLabels
from icha.datasets.quantities import label_of
from icha.figures import select
from icha.figures.captions import attractions_of, grid_of_loops, range_of_attraction
from icha.figures.curves import Axis, physical_units
from icha.figures.drawn import Name, plot, record, say
from icha.figures.looks import (
    BRANCH_DASHES,
    MODEL_MARKERS,
    REFERENCE_NAME,
    UNLOADING_MARKERS,
    legend_below,
    looks_of_studies,
    pale,
    surface_label,
)
from icha.figures.style import GREY, format_number, in_style, legend_handle, new_panels, slope_label

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


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
_TRUTH_WORDS = {
    REFERENCE_NAME: """Crosses are boundary elements on the same topography, upright in loading and oblique in
    unloading.""",
    select.FINITE_RANGE_NAME: "Crosses with three arms are boundary elements at a finite range of attraction.",
}
# Variables along x and y of the two panels; `separation` and `load` are in the units of the figure.
_LOADS = ("separation", "load")
_AREAS = ("load", "contact_area_fraction")


class _Loop(NamedTuple):
    """A run in loading and unloading.

    Attributes
    ----------
    labels : labels of the run.
    run : the run.
    truths : runs with boundary elements on the same topography, with the same material.
    look : arguments of `Axes.plot` for lines and markers.
    """

    labels: RunLabels
    run: xr.Dataset
    truths: list[xr.Dataset]
    look: dict


@in_style
def figure(
    campaign: xr.DataTree,
    *,
    study: str,
    boundary_elements: str | None = None,
    surface: str | None = None,
    seed: int | None = None,
    units: str = "reduced",
) -> Figure:
    """Draw the runs of all slopes and materials of a study on one topography.

    Parameters
    ----------
    campaign : the campaign dataset.
    surface, seed : labels of the topography. Default: surface and seed of the first complete run.
    units : "reduced" or "physical".
    """
    from matplotlib.ticker import MaxNLocator

    from icha.analysis.model_error import difference_of_contacts

    runs = select.select_by_labels(select.select_unloaded_runs(campaign, study), surface=surface, seed=seed)
    others = select.select_runs(campaign, boundary_elements or study, ragged=False, model=REFERENCE_MODEL)
    shown = {labels for labels, _ in runs}
    truths = [run for labels, run in others if labels not in shown and select.unloading_legs(run)]
    slopes = sorted({labels.rms_slope for labels, _ in runs}, reverse=True)
    own_rows = len(runs) > _MOST_LOOPS and 1 < len(slopes) < len(runs)
    # Slopes that have their own panels need no markers.
    contacts = [(labels.material, labels.surface, None if own_rows else labels.rms_slope) for labels, _ in runs]
    looks = looks_of_studies(campaign, [study], contacts)
    pressure, gap = (Axis(label_of(name), 1.0) for name in ("reduced_pressure", "reduced_separation"))
    if units == "physical":
        pressure, gap = physical_units(campaign[study].to_dataset(), "mean_separation")
    drawn = []
    for (labels, run), contact in zip(runs, contacts, strict=True):
        look = looks.look(contact, applicable=select.is_good_loop(run), model=labels.model)
        beside = [truth for truth in truths if not difference_of_contacts(run, truth)]
        factors = 1.0, 1.0
        if units == "physical":
            pressure_unit = float(run["contact_modulus"] * run["unit_slope"])
            factors = pressure_unit * pressure.factor, float(run["unit_height"]) * gap.factor
        run, *beside = (_in_units(each, *factors) for each in (run, *beside))
        drawn.append(_Loop(labels, run, beside, look))

    rows = [[slope] for slope in slopes] if own_rows else [slopes]
    by_row = [[loop for loop in drawn if loop.labels.rms_slope in shown] for shown in rows]
    windows = [_small_tensions(loops_of_row) for loops_of_row in by_row]
    columns = 3 if any(windows) else 2
    fig, panels = new_panels(2.7 * len(rows), len(rows), columns)
    physical = units == "physical"
    load = "nominal pressure" if physical else "reduced pressure"
    against = "mean separation" if physical else "mean separation divided by the rms height"
    unit = "" if physical else ", multiplied by E* h'rms hrms,"
    say(
        fig,
        f"""Loading (wide lines) and unloading (dashed lines) on one topography, which the title names: the
        {load}{"" if physical else " F/(E* h'rms A0)"} against the {against} (left), and the contact area divided by the
        nominal area against the {load} (right).""",
        "The middle panel enlarges the region around zero load of the left panel." if columns > 2 else "",
        """Where both lines coincide, contact is reversible. Tension is negative. Sudden changes along a line are jumps
        of one or several spots. A straight line joins the states before and after a jump, as at both ends of a path,
        where the load is zero because there is no contact.""",
        f"The area between loading and unloading on the left{unit} is the energy lost per nominal area.",
    )
    for (left, *middle, right), shown_loops, window in zip(panels, by_row, windows, strict=True):
        for loop in shown_loops:
            for ax, names in ((left, _LOADS), *((ax, _LOADS) for ax in middle), (right, _AREAS)):
                _draw(ax, loop, names, turn=len(slopes) > 1)
        for ax in middle:
            ax.axhline(0, color=GREY, lw=0.5, zorder=1)
            ax.xaxis.set_major_locator(MaxNLocator(4))
            ax.text(0.95, 0.9, "near zero load", transform=ax.transAxes, ha="right", fontsize=8)
            if window:
                ax.set(xlim=window[0], ylim=window[1])
            exponent = min(int(np.floor(np.log10(ax.get_ylim()[1]))), 0)
            ax.yaxis.set_major_formatter(lambda value, _, unit=10.0**exponent: format_number(value / unit))
            times = rf"$10^{{{-exponent}}}\times$ " if exponent else ""
            ax.set_ylabel(times + pressure.label.partition("  ")[2])
        left.set_ylabel(pressure.label)
        right.set_ylabel(label_of("contact_area_fraction"))
        if own_rows:
            right.set_title(slope_label(shown_loops[0].labels.rms_slope), loc="right")
    for ax in panels[-1, :-1]:
        ax.set_xlabel(gap.label)
    panels[-1, -1].set_xlabel(pressure.label)
    labels, _ = runs[0]
    models = dict.fromkeys([labels.model, *(REFERENCE_MODEL for loop in drawn if loop.truths)])
    title = " and ".join(MODELS[model].words for model in models)
    words = title, surface_label(campaign, labels.surface), f"seed {labels.seed}"
    fig.suptitle(", ".join(words), fontsize="medium")
    shown = [run for loop in drawn for run in (loop.run, *loop.truths)]
    studies = list(dict.fromkeys(filter(None, (study, boundary_elements))))
    say(fig, range_of_attraction(attractions_of(shown)), grid_of_loops(campaign, studies))
    legend_below(fig, _handles(looks, drawn, marked=len(rows[0]) > 1), looks.heading())
    return fig


def _in_units(run, pressure, separation):
    """Return a run with the variables `load` and `separation`, reduced values times two factors, and their `slope`."""
    # The area of a loop is the loss only against the mean separation, which is not the mean gap of a free square.
    load, apart = run["reduced_pressure"] * pressure, run["mean_separation"] / run["unit_height"] * separation
    unit = run["contact_modulus"] * run["unit_slope"] / run["unit_height"]
    run = run.assign(load=load, separation=apart)
    return run.assign(slope=-run["contact_stiffness"] / unit * pressure / separation)


def _draw(ax, loop, names, *, turn):
    """Draw a loop with a marker at pull-off; if `turn` is True, also mark the end of the first loading."""
    run, colour, words = loop.run, loop.look["color"], select.name_of_model(loop.run)
    for branch, leg in select.branches(run):
        line = _curve(leg) if names == _LOADS else [leg[name].values for name in names]
        record(ax, *(leg[name].values for name in names), Name(f"{words}, {branch}", loop.labels))
        ax.plot(*line, ls=BRANCH_DASHES[branch], color=colour, **_BRANCHES[branch])
    marked = [(np.flatnonzero(run["leg"] == 0)[-1], {"ls": "none", "zorder": 5})] if turn else []
    if turn:
        say(ax, "Symbols without an edge mark the end of the first loading.")
    if (at := select.pull_off_step(run)) is not None:
        say(ax, "Symbols with a black edge mark pull-off, the largest tension in the last unloading.")
        marked.append((at, _PULL_OFF))
    for step, look in marked:
        ax.plot(*(run[name].values[step] for name in names), **loop.look | look)
    for truth in loop.truths:
        say(ax, _TRUTH_WORDS[select.name_of_model(truth)])
        for branch, markers in _TRUTH_MARKERS.items():
            states = truth.isel(step=truth["branch"].values == branch)
            look = {"color": colour, "marker": markers[select.name_of_model(truth)], **_TRUTH}
            # The colour is already pale if the asperity model is not applicable.
            look = look if select.is_good_loop(truth) or "label" in loop.look else pale(look, REFERENCE_MODEL)
            name = Name(f"{select.name_of_model(truth)}, {branch}", loop.labels._replace(model=REFERENCE_MODEL))
            plot(ax, *(states[each].values for each in names), name, markevery=_APART, **look)


def _curve(leg):
    """Return separations and loads along a leg: cubic between two states, or straight if an event lies between them."""
    separation, load, slope = leg["separation"].values, leg["load"].values, leg["slope"].values
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


def _small_tensions(loops):
    """Return the limits of separation and load around zero load, if the tension is small but not zero; else None."""
    pressures = np.concatenate([loop.run["load"].values for loop in loops])
    tension = -pressures.min()
    if not select.ROUNDING * pressures.max() < tension < _SMALL_TENSION * pressures.max():
        return None
    shown = []
    for run in (loop.run for loop in loops):
        near = (np.abs(run["load"].values) <= _REACH * tension) & (run["contact_area_fraction"].values > 0)
        at = np.flatnonzero(near)
        # The first state after separation is shown as well.
        shown.append(run["separation"].values[np.unique([*at, min(at[-1] + 1, len(near) - 1)])] if at.size else [])
    shown = np.concatenate(shown)
    room = 0.06 * np.ptp(shown)
    return (shown.min() - room, shown.max() + room), (-_REACH * tension, _REACH * tension)


def _handles(looks, loops, *, marked):
    """Return the legend entries by name; `marked` is True if markers distinguish the loops."""
    handles = looks.handles(lw=4, ls="-", **({} if marked else {"marker": "none"}))
    for branch, dashes in BRANCH_DASHES.items():
        handles[branch] = legend_handle(color=GREY, ls=dashes, **_BRANCHES[branch])
    if any(select.pull_off_step(loop.run) is not None for loop in loops):
        handles["pull-off"] = legend_handle(marker="o", mfc=GREY, **_PULL_OFF)
    for name in dict.fromkeys(select.name_of_model(truth) for loop in loops for truth in loop.truths):
        for branch, markers in _TRUTH_MARKERS.items():
            handles[f"{name}, {branch}"] = legend_handle(color=GREY, marker=markers[name], **_TRUTH)
    return handles
