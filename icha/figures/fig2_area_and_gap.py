"""Fig. 2: contact area and mean separation against load, with theories and published points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.datasets import results
from icha.datasets.variables.model_error import FINITE_RANGE
from icha.figures import curves
from icha.figures.declaration import (
    Campaign,
    Declaration,
    Inputs,
    StudyFigure,
    dataset_and_theories,
    is_solved_at_finite_range,
)
from icha.figures.ensembles import draw_members, mark_fewer
from icha.figures.select import asked_of_entry, select_errors
from icha.figures.style import BLACK, GREY, TWO_COLUMNS, in_style, logarithmic_axes, new_figure, panel_label
from icha.support.statistics import ensemble

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def inputs(campaign: Campaign, options: StudyFigure, files: results.ResultFiles) -> Inputs:
    """Return the runs, theories for their first surface, and boundary elements at a finite range, if any."""
    found = dataset_and_theories(campaign, options, files)
    if is_solved_at_finite_range(campaign, options.study):
        found["model_error"] = files.path(results.MODEL_ERROR)
    return found


DECLARATION = Declaration(
    description="Contact area and mean separation against load, with theories, and what the logarithmic axes hide.",
    options=StudyFigure,
    inputs=inputs,
)

# Height of the panels of differences over that of the panels above them.
_LOWER = 0.42
# Largest relative difference of loads that are the same, since each model has its tolerance.
_SAME_LOAD = 1e-6
# Labels of the axis of separations if it is short.
_SEPARATIONS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1, 1.5, 2, 3, 5)
# Points of a run, their error in a model error, and their symbol.
_QUANTITIES = ((curves.area_points, "area_error", "A"), (curves.gap_points, "separation_error", r"\bar{u}"))


@in_style
def figure(
    campaign: xr.DataTree, references: xr.Dataset | None = None, model_error: xr.DataTree | None = None, *, study: str
) -> Figure:
    """Draw all runs of a study.

    Parameters
    ----------
    campaign : the campaign dataset.
    references : theories and points for the study's first surface (`icha.references.theories`), if any.
    model_error : boundary elements at a finite range (`icha.analysis.model_error.model_error`), if any.
    """
    shown, dataset = curves.study_curves(campaign, study), campaign[study].to_dataset()
    solutions = [
        (contact, errors)
        for _, contact, errors in select_errors(model_error, study)
        if errors.attrs["truth"] == FINITE_RANGE
        and np.isfinite(errors["contact_area_fraction_boundary_elements"].values).any()
    ]
    differences = _differences(shown, solutions, references)
    fig = new_figure(TWO_COLUMNS, 4.5)
    mosaic = "ab;cd" if len(differences) == 2 else "ab;cb"
    axes = fig.subplot_mosaic(mosaic, height_ratios=(1, _LOWER))
    left, right = axes["a"], axes["b"]
    panels = {left: curves.area_points, right: curves.gap_points}
    (p, areas), (_, gaps) = curves.draw_curves(shown, panels, unloading=True)
    states = [(p, areas, gaps), *_draw_solutions([left, right], shown.looks, solutions)]
    pressures, areas, gaps = (
        curves.drop_rounding_errors(np.concatenate(values)) for values in zip(*states, strict=True)
    )
    x = (pressures.min() / 1.6, pressures.max() * 1.6)
    if references is not None:
        _draw_references(left, right, references, x)
        _draw_separate_summits(left, right, references, dataset, shown.looks)
    left.set(ylabel=curves.AREA_LABEL, ylim=(min(areas.min(), 1.6 * x[0]) / 1.5, min(1.3, 3 * areas.max())))
    low, high = gaps.min() / 1.4, gaps.max() * 1.4
    right.set(ylabel=curves.gap_label(dataset), ylim=(low, high))
    right.yaxis.set_major_formatter("{x:g}")
    right.yaxis.set_minor_formatter("")
    if high < 60 * low:
        right.set_yticks([tick for tick in _SEPARATIONS if low < tick < high])
    for letter, (label, drawn) in zip("cd", differences, strict=False):
        _draw_differences(axes[letter], drawn, len(shown.lines))
        axes[letter].set_ylabel(label)
    for letter, ax in axes.items():
        panel_label(ax, letter)
        lowest = letter in mosaic.split(";")[1]
        ax.set(xlim=x, xlabel=curves.PRESSURE_LABEL if lowest else "")
        ax.tick_params(which="both", labelbottom=lowest)
    curves.add_legend(fig, [left, right], shown)
    return fig


def _differences(shown, solutions, references):
    """Return the differences of area and separation from boundary elements, or else from theories, in per cent.

    Returns
    -------
    Of each quantity the label of the axis, and of each curve the loads, the differences (members, loads), and the
    number of requested members. Without a theory of the separation, there is no second quantity.
    """
    from icha.references.persson import persson_area

    theories = {curves.area_points: persson_area, curves.gap_points: None}
    if references is not None and "persson_reduced_separation" in references:
        known = (np.log(references["reduced_pressure"].values), references["persson_reduced_separation"].values)
        theories[curves.gap_points] = lambda p: np.interp(np.log(p), *known)
    # The limit of a short range comes first: with adhesion, finite ranges only bound it.
    truths, solved = {truth.runs.contact: truth for truth in shown.crosses}, dict(reversed(solutions))
    found = []
    for points, error, symbol in _QUANTITIES:
        drawn, name = [], "BEM"
        for line in shown.lines:
            if truth := truths.get(line.runs.contact):
                drawn.append((line, *_from_runs(line, truth, points), min(line.runs.asked, truth.runs.asked)))
            elif (errors := solved.get(line.runs.contact)) is not None:
                own = errors.isel(seed=np.isin(errors["seed"], list(line.runs.by_seed)))
                own = own[error].dropna("reduced_pressure", how="all").dropna("seed", how="all")
                drawn.append((line, own["reduced_pressure"].values, 100 * own.values, asked_of_entry(errors)))
        if not drawn and theories[points]:
            name = "Persson"
            drawn = [(line, *_from_theory(line, points, theories[points]), line.runs.asked) for line in shown.lines]
        if drawn:
            found.append((rf"${symbol}/{symbol}_{{\mathrm{{{name}}}}}-1$  (%)", drawn))
    return found


def _from_runs(line, truth, points):
    """Return loads, and differences (seeds, loads) of runs from boundary elements with the same seed, in per cent.

    The loads are those of the runs, as far as boundary elements reach. Their values are interpolated.
    """
    from icha.analysis.common_loads import at_common_loads, interpolate

    members, runs, truths = [], line.stops, truth.stops
    for seed in [seed for seed in runs if seed in truths]:
        (load, values), (true_load, true_values) = points(runs[seed]), points(truths[seed])
        pressed = true_load > 0
        if pressed.any():
            true_load, true_values = true_load[pressed], true_values[pressed]
            at = np.clip(load, true_load.min(), true_load.max())
            reached = np.isclose(at, load, rtol=_SAME_LOAD, atol=0)
            logarithmic = points is curves.area_points
            true_values = interpolate(true_load, true_values, at[reached], logarithmic=logarithmic)
            members.append((load[reached], 100 * (values[reached] / true_values - 1)))
    return at_common_loads(members, logarithmic=False) if members else (np.empty(0), np.empty((0, 0)))


def _from_theory(line, points, theory):
    """Return loads, and differences (seeds, loads) of runs from a function of the reduced pressure, in per cent."""
    from icha.analysis.common_loads import at_common_loads

    members = []
    for load, values in map(points, line.stops.values()):
        pressed = load > 0
        members.append((load[pressed], 100 * (values[pressed] / theory(load[pressed]) - 1)))
    return at_common_loads(members, logarithmic=False)


def _draw_differences(ax, drawn, lines):
    """Draw the differences of all curves in a lower panel."""
    for line, load, members, asked in drawn:
        if members.size:
            look = line.look | {"ls": "-", "lw": 0.6}
            draw_members(ax, load, members, look, positive=False, lines=lines, asked=asked)
    logarithmic_axes(ax, "x")
    ax.axhline(0, color="0.6", lw=0.6, zorder=0)


def _draw_solutions(panels, looks, solutions):
    """Mark the states of boundary elements at a finite range, means over their seeds; return loads and values."""
    states = []
    for contact, errors in solutions:
        names = ("contact_area_fraction_boundary_elements", "reduced_separation_boundary_elements")
        solved = errors.dropna("reduced_pressure", how="all", subset=names[:1])
        members, p = [solved[name].values for name in names], solved["reduced_pressure"].values
        states.append((p, *(ensemble(values).mean for values in members)))
        look = curves.cross_look(looks, contact, FINITE_RANGE)
        for ax, values in zip(panels, states[-1][1:], strict=True):
            ax.plot(p, values, **look)
            mark_fewer(ax, p, values, np.isfinite(members[0]), look, asked_of_entry(errors))
    if states:
        for ax in panels:
            ax.plot([], [], **look | {"color": GREY, "mec": GREY, "ms": 8}, label=FINITE_RANGE)
    return states


def _draw_references(left, right, references, limits):
    """Draw theories of rough contact and published points within the limits of the loads."""
    p, black = references["reduced_pressure"].values, {"color": BLACK, "lw": 1, "zorder": 2}
    shown = (p >= limits[0] / 1.5) & (p <= limits[1] * 1.5)
    left.plot(p[shown], references["persson_area_fraction"].values[shown], label="Persson", **black)
    corrected = references["xu_area_fraction"].values[shown]
    left.plot(p[shown], corrected, label="Persson, corrected by Xu et al.", **black | {"ls": (0, (1, 1))})
    linear = references["linear_pressure"].values
    touching = linear >= limits[0] / 1.5
    area = references["bush_gibson_thomas_area_fraction"].values[touching]
    left.plot(linear[touching], area, label="Bush, Gibson & Thomas", **black | {"ls": "--", "color": GREY})
    if "gfmd_reduced_pressure" in references:
        gfmd = references[["gfmd_reduced_pressure", "gfmd_area_fraction", "gfmd_area_scatter"]].values()
        points = {"fmt": "x", "color": BLACK, "ms": 6, "mew": 1.2, "lw": 1.2, "zorder": 5}
        left.errorbar(*(values.values for values in gfmd), label="GFMD, no adhesion", **points)
    if "persson_reduced_separation" in references:
        right.plot(p[shown], references["persson_reduced_separation"].values[shown], label="Yang & Persson", **black)


def _draw_separate_summits(left, right, references, dataset, looks):
    """Draw theories of separate summits as thin lines, if the references have them; Fuller & Tabor by material."""
    theories = []
    if "greenwood_williamson_reduced_pressure" in references:
        theories.append(("Greenwood & Williamson", (0, (5, 2, 1, 2)), GREY, "greenwood_williamson", references))
    for k in range(references.sizes.get("fuller_tabor_curve", 0)):
        theory = references.isel(fuller_tabor_curve=k)
        material, slope = str(theory["fuller_tabor_material"].values), float(theory["fuller_tabor_rms_slope"])
        if material in looks.materials and np.isclose(slope, dataset["rms_slope"].values, rtol=1e-9).any():
            theories.append(("Fuller & Tabor", (0, (1, 1.5)), looks.material_colour(material), "fuller_tabor", theory))
    for label, dashes, colour, name, theory in theories:
        p, separation = (theory[f"{name}_reduced_{quantity}"].values for quantity in ("pressure", "separation"))
        look = {"ls": dashes, "lw": 0.8, "zorder": 1.8}
        for ax, values in ((left, theory["summit_area_fraction"].values), (right, separation)):
            ax.plot(p[p > 0], values[p > 0], color=colour, **look)
            ax.plot([], [], color=GREY, label=label, **look)
