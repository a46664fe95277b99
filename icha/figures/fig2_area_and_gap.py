"""Fig. 2: contact area and mean separation against load, with theories and published points."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.datasets import results
from icha.datasets.labels import place_of, surfaces_and_slopes
from icha.datasets.variables.model_error import FINITE_RANGE
from icha.figures.curves import (
    AREA_LABEL,
    PRESSURE_LABEL,
    UNLOADING,
    Curve,
    add_legend,
    area_points,
    cross_look,
    draw_curves,
    drop_rounding_errors,
    gap_label,
    gap_points,
    study_curves,
    theories_handle,
)
from icha.figures.declaration import Campaign, Declaration, Inputs, StudyFigure, finite_range_error
from icha.figures.ensembles import draw_members, mark_fewer
from icha.figures.select import asked_of_entry, errors_of_run, finite_range_errors
from icha.figures.style import BLACK, GREY, TWO_COLUMNS, in_style, logarithmic_axes, new_figure, panel_label
from icha.support.statistics import ensemble

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def inputs(campaign: Campaign, options: StudyFigure, files: results.ResultFiles) -> Inputs:
    """Return the runs, theories for their first surface, and boundary elements at a finite range, if any."""
    theories = files.path(results.THEORIES, surface=campaign.studies[options.study].surfaces[0])
    found = {"campaign": files.path(results.DATASET), "references": theories}
    return found | finite_range_error(campaign, options.study, files)


DECLARATION = Declaration(
    description="Contact area and mean separation against load, with theories, and what the logarithmic axes hide.",
    options=StudyFigure,
    inputs=inputs,
)

# Height of the panels of differences over that of the panels above them.
_LOWER = 0.42
# Largest relative difference of loads that are the same, since each model has its tolerance.
_SAME_LOAD = 1e-6


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
    curves = study_curves(campaign, study)
    dataset, entries = campaign[study].to_dataset(), finite_range_errors(model_error, study)
    differences = _differences(curves, entries, references)
    fig = new_figure(TWO_COLUMNS, 4.5)
    mosaic = "ab;cd" if differences[1] else "ab;cb"
    axes = fig.subplot_mosaic(mosaic, height_ratios=(1, _LOWER))
    left, right = axes["a"], axes["b"]
    (p, areas), (_, gaps) = draw_curves(curves, {left: area_points, right: gap_points}, unloading=True)
    if curves.unloaded:
        left.plot([], [], color=GREY, label="unloading", **UNLOADING)
    states = [(p, areas, gaps), *_draw_solutions([left, right], curves.looks, entries)]
    pressures, areas, gaps = (drop_rounding_errors(np.concatenate(values)) for values in zip(*states, strict=True))
    x = (pressures.min() / 1.6, pressures.max() * 1.6)
    if references is not None:
        if "gfmd_reduced_pressure" in references:
            x = (x[0], max(x[1], 1.2 * float(references["gfmd_reduced_pressure"].max())))
        _draw_references(left, right, references, x)
        _draw_separate_summits(left, right, references, dataset, curves.looks.colours)
    left.set(ylabel=AREA_LABEL, ylim=(min(areas.min(), 1.6 * x[0]) / 1.5, min(1, 3 * areas.max())))
    right.set(ylabel=gap_label(dataset), ylim=(gaps.min() / 1.4, gaps.max() * 1.4))
    _label_separations(right, gaps)
    for letter, difference in zip("cd", differences, strict=True):
        if difference:
            _draw_difference(axes[letter], difference, len(curves.lines))
    for letter, ax in axes.items():
        panel_label(ax, letter)
        lowest = letter in mosaic.split(";")[1]
        ax.set(xlim=x, xlabel=PRESSURE_LABEL if lowest else "")
        ax.tick_params(labelbottom=lowest)
    add_legend(fig, [left, right], curves, theories_handle(dataset) if references is not None else {})
    return fig


def _label_separations(ax, gaps):
    """Label the separations by plain numbers, round ones if they span less than two powers of ten."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_minor_formatter(NullFormatter())
    if np.log10(gaps.max() / gaps.min()) < 1.5:
        low, high = ax.get_ylim()
        ax.set_yticks([tick for tick in (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1, 1.5, 2, 3, 5) if low < tick < high])


class _Difference(NamedTuple):
    """The difference of a quantity of all lines from a reference.

    Attributes
    ----------
    drawn : of every line the loads, the values in per cent (members, loads), and the number of members asked for.
    label : label of the axis.
    """

    drawn: list[tuple[Curve, np.ndarray, np.ndarray, int]]
    label: str


def _differences(curves, entries, references):
    """Return the differences of contact area and separation from boundary elements or else from theories."""
    from icha.references.persson import persson_area

    # The limit of a short range comes first: with adhesion, finite ranges only bound it.
    truths = {truth.runs.contact: truth for truth in curves.crosses}
    areas, separations = [], []
    for line in curves.lines:
        if truth := truths.get(line.runs.contact):
            asked = min(line.runs.asked, truth.runs.asked)
            areas.append((line, *_from_runs(line, truth, area_points, logarithmic=True), asked))
            separations.append((line, *_from_runs(line, truth, gap_points, logarithmic=False), asked))
            continue
        for errors in errors_of_run(entries, line.runs.labels, "surface", "rms_slope", "material"):
            if np.isfinite(errors["area_error"].values).any():
                errors = errors.dropna("reduced_pressure", how="all", subset=["area_error"])
                load, asked = errors["reduced_pressure"].values, asked_of_entry(errors)
                of_seeds = errors.sel(seed=[seed for seed in line.runs.by_seed if seed in errors["seed"].values])
                areas.append((line, load, _per_cent(of_seeds["area_error"]), asked))
                separations.append((line, load, _per_cent(of_seeds["separation_error"]), asked))
                break
    if areas:
        return [
            _Difference(areas, r"$A/A_{\mathrm{BEM}}-1$  (%)"),
            _Difference(separations, r"$\bar{u}/\bar{u}_{\mathrm{BEM}}-1$  (%)"),
        ]
    found = [_Difference(_from_theory(curves.lines, area_points, persson_area), r"$A/A_{\mathrm{Persson}}-1$  (%)")]
    if references is None or "persson_reduced_separation" not in references:
        return [*found, None]
    known = (np.log(references["reduced_pressure"].values), references["persson_reduced_separation"].values)
    drawn = _from_theory(curves.lines, gap_points, lambda p: np.interp(np.log(p), *known))
    return [*found, _Difference(drawn, r"$\bar{u}/\bar{u}_{\mathrm{Persson}}-1$  (%)")]


def _from_runs(line, truth, points, *, logarithmic):
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
            true_values = interpolate(true_load, true_values, at[reached], logarithmic=logarithmic)
            members.append((load[reached], 100 * (values[reached] / true_values - 1)))
    return at_common_loads(members, logarithmic=False) if members else (np.empty(0), np.empty((0, 0)))


def _per_cent(errors):
    """Return errors (seeds, loads) in per cent, of the seeds that have any."""
    return 100 * errors.dropna("seed", how="all").transpose("seed", "reduced_pressure").values


def _from_theory(lines, points, theory):
    """Return the differences of all lines from a function of the reduced pressure."""
    from icha.analysis.common_loads import at_common_loads

    found = []
    for line in lines:
        members = []
        for run in line.stops.values():
            load, values = points(run)
            load, values = load[load > 0], values[load > 0]
            members.append((load, 100 * (values / theory(load) - 1)))
        found.append((line, *at_common_loads(members, logarithmic=False), line.runs.asked))
    return found


def _draw_difference(ax, difference, lines):
    """Draw the differences of all lines in a lower panel."""
    for line, load, members, asked in difference.drawn:
        if members.size:
            look = line.look | {"ls": "-", "lw": 0.6}
            draw_members(ax, load, members, look, positive=False, lines=lines, asked=asked)
    logarithmic_axes(ax, "x")
    ax.axhline(0, color="0.6", lw=0.6, zorder=0)
    ax.set_ylabel(difference.label)


def _draw_solutions(panels, looks, entries):
    """Mark the states of boundary elements at a finite range, means over their seeds; return loads and values."""
    states, quantities = [], ("contact_area_fraction", "reduced_separation")
    for errors in entries:
        for (surface, slope), material in itertools.product(surfaces_and_slopes(errors), errors["material"].values):
            labels = {"material": material, "surface": surface, "rms_slope": slope}
            solutions = errors.isel(place_of(errors, labels)).transpose("seed", ...)
            members = [solutions[f"{name}_boundary_elements"].values for name in quantities]
            # A surface has no states at the slopes of others.
            known = np.isfinite(members[0])
            p = solutions["reduced_pressure"].values
            if not known.any():
                continue
            means = [ensemble(values).mean for values in members]
            solved = known.any(axis=0)
            states.append((p[solved], *(values[solved] for values in means)))
            look = cross_look(looks, (material, surface, slope), FINITE_RANGE)
            for ax, values in zip(panels, states[-1][1:], strict=True):
                ax.plot(states[-1][0], values, **look)
                mark_fewer(ax, states[-1][0], values, known[:, solved], look, int(asked_of_entry(solutions)))
    if states:
        for ax in panels:
            ax.plot([], [], **look | {"color": GREY, "mec": GREY, "ms": 8}, label=FINITE_RANGE)
    return states


def _draw_references(left, right, references, limits):
    """Draw theories of rough contact and published points within the limits of the loads."""
    p, black = references["reduced_pressure"].values, {"color": BLACK, "lw": 1, "zorder": 2}
    shown = (p >= limits[0] / 1.5) & (p <= limits[1] * 1.5)
    left.plot(p[shown], references["persson_area_fraction"].values[shown], label="Persson", **black)
    linear = references["linear_pressure"].values
    touching = linear >= limits[0] / 1.5
    area = references["bush_gibson_thomas_area_fraction"].values[touching]
    left.plot(linear[touching], area, label="Bush, Gibson & Thomas", **black | {"ls": "--", "color": GREY})
    if "gfmd_reduced_pressure" in references:
        points = (references["gfmd_reduced_pressure"].values, references["gfmd_area_fraction"].values)
        left.plot(*points, "x", color=BLACK, ms=6, mew=1.2, label="GFMD, no adhesion", zorder=5)
    if "persson_reduced_separation" in references:
        right.plot(p[shown], references["persson_reduced_separation"].values[shown], label="Yang & Persson", **black)


def _draw_separate_summits(left, right, references, dataset, colours):
    """Draw theories of separate summits as thin lines, if the references have them; Fuller & Tabor by material."""
    curves = []
    if "greenwood_williamson_reduced_pressure" in references:
        curves.append(("Greenwood & Williamson", (0, (5, 2, 1, 2)), GREY, "greenwood_williamson", references))
    for k in range(references.sizes.get("fuller_tabor_curve", 0)):
        theory = references.isel(fuller_tabor_curve=k)
        material, slope = str(theory["fuller_tabor_material"].values), float(theory["fuller_tabor_rms_slope"])
        if material in colours and np.isclose(slope, dataset["rms_slope"].values, rtol=1e-9).any():
            curves.append(("Fuller & Tabor", (0, (1, 1.5)), colours[material], "fuller_tabor", theory))
    for label, dashes, colour, name, theory in curves:
        p, separation = (theory[f"{name}_reduced_{quantity}"].values for quantity in ("pressure", "separation"))
        look = {"ls": dashes, "lw": 0.8, "zorder": 1.8}
        for ax, values in ((left, theory["summit_area_fraction"].values), (right, separation)):
            ax.plot(p[p > 0], values[p > 0], color=colour, **look)
            ax.plot([], [], color=GREY, label=label, **look)
