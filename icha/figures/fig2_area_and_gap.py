"""Fig. 2: contact area and mean separation against load, with theories and published results."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.datasets.quantities import label_of, quantity
from icha.figures import curves
from icha.figures.captions import theories_of_flat_surfaces
from icha.figures.drawn import Name, plot, record, say
from icha.figures.ensembles import draw_members
from icha.figures.looks import ASPERITIES_NAME
from icha.figures.style import BLACK, GREY, in_style, logarithmic_axes, new_panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


# Height of the lower panels divided by the height of the upper panels. The lower panels show differences.
_LOWER = 0.42
# Loads of two models count as equal up to this relative difference, because each model has its own load tolerance.
_SAME_LOAD = 1e-6
# Ticks of the separation axis, if the ratio of the ends of this axis is less than 60.
_SEPARATIONS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1, 1.5, 2, 3, 5)
# Look of Ciavarella's estimate from boundary elements without adhesion.
_ESTIMATE = {"ls": (0, (6, 1.5, 1, 1.5, 1, 1.5)), "lw": 0.9, "zorder": 1.9}
# For each lower panel, the function that returns the points of a run, and the difference that is drawn.
_QUANTITIES = ((curves.area_points, "area_error"), (curves.gap_points, "separation_error"))

_COMPARED = """Panels (c) and (d) show the relative difference between asperity model and boundary elements (BEM), on
the same topographies at the same loads; thin lines join the symbols, which end at the largest load that both models
reach."""
_CIAVARELLA = """Lines with two dots show the estimate of Ciavarella (2018) in place of the asperity model; it follows
from boundary elements without adhesion, and its loads are not those of the symbols."""
_PERSSON = "Other lines are theories of contact without adhesion: that of Persson for the area (a)."
_BUSH = "That of Bush, Gibson and Thomas, also for the area, is grey and dashed."
_YANG = "That of Yang and Persson for the separation is in (b)."
_XU = "Xu et al. (2024) correct Persson's theory for the variance of the pressure in partial contact."
_SUMMITS = {
    "Greenwood & Williamson": "The theory of Greenwood and Williamson, in (a) and (b), describes separate summits.",
    "Fuller & Tabor": """Of these theories, only that of Fuller and Tabor, also in (a) and (b) and of separate summits,
    includes adhesion.""",
}
_GFMD = """Oblique crosses are published results of Green's function molecular dynamics without adhesion for this
spectrum (Xu et al., 2024), with standard deviations over surfaces. These areas are counts of cells on a coarse grid; a
correction for the perimeter would make them up to 7 % smaller."""


@in_style
def figure(
    campaign: xr.DataTree,
    references: xr.Dataset | None = None,
    *,
    study: str,
    units: str = "reduced",
) -> Figure:
    """Draw all runs of a study.

    Parameters
    ----------
    campaign : the campaign dataset.
    references : theories and published results for the study's first surface (`icha.references.theories`), if flat.
    units : "reduced" or "physical".
    """
    if units == "physical":
        return _in_physical_units(campaign, study, references)
    shown, dataset = curves.study_curves(campaign, study), campaign[study].to_dataset()
    truths = {truth.runs.contact: truth for truth in shown.crosses}
    compared = [(line, truths[line.runs.contact]) for line in shown.lines if line.runs.contact in truths]
    fig, axes = new_panels(4.5, 2, sharex=True, height_ratios=(1, _LOWER)) if compared else new_panels(3.3)
    left, right = axes[0]
    gap = label_of(curves.gap_name(dataset)).partition("  ")[0]
    say(
        fig,
        f"""Ratio of contact area and load (a), A/A0 divided by the reduced pressure F/(E* h'rms A0), and {gap} divided
        by rms height (b), against the reduced pressure.""",
    )
    _say_symbols(fig, shown, dataset)
    panels = {left: curves.ratio_points, right: curves.gap_points}
    (pressures, ratios), (_, gaps) = (
        map(curves.drop_rounding_errors, drawn) for drawn in curves.draw_curves(shown, panels, unloading=True)
    )
    x = (pressures.min() / 1.6, pressures.max() * 1.6)
    curves.limit_ratios(left, ratios)
    if references is not None:
        _draw_references(left, right, references, x)
        if dataset.sizes["surface"] > 1:
            say(fig, "Theories are those of the first surface.")
        _draw_separate_summits(left, right, references, dataset, shown.looks)
    left.set_ylabel(label_of("area_over_load"))
    low, high = gaps.min() / 1.4, gaps.max() * 1.4
    right.set(ylabel=label_of(curves.gap_name(dataset)), ylim=(low, high))
    right.yaxis.set_major_formatter("{x:g}")
    right.yaxis.set_minor_formatter("")
    if high < 60 * low:
        right.set_yticks([tick for tick in _SEPARATIONS if low < tick < high])
    for ax, (points, error) in zip(axes[1:].ravel(), _QUANTITIES, strict=False):
        for line, truth in compared:
            load, members = _difference(line, truth, points)
            if members.size:
                look, asked = line.look | {"lw": 0.6}, min(line.runs.asked, truth.runs.asked)
                name = line.runs.drawn_name._replace(curve="asperities relative to boundary elements")
                of_curve = {"name": name, "asked": asked, "curves": len(compared)}
                draw_members(ax, load, members, look, positive=False, **of_curve)
        logarithmic_axes(ax, "x")
        ax.axhline(0, color="0.6", lw=0.6, zorder=0)
        ax.set_ylabel(rf"${quantity(error).symbol}$  (%)")
    if compared:
        say(fig, _COMPARED)
        _draw_estimates(axes[1], shown, compared)
    say(fig, theories_of_flat_surfaces(dataset))
    for ax in axes[-1]:
        ax.set(xlim=x, xlabel=label_of("reduced_pressure"))
    curves.add_legend(fig, [left, right, *axes[1:].ravel()], shown)
    return fig


def _in_physical_units(campaign, study, references):
    """Draw area and mean gap against the nominal pressure; theories only if one pressure unit holds for all runs."""
    shown, dataset = curves.study_curves(campaign, study), campaign[study].to_dataset()
    pressure, gap = curves.physical_units(dataset)
    fig, [(left, right)] = new_panels(3.3)
    say(fig, "Contact area divided by nominal area (a), and mean gap (b), against the nominal pressure.")
    _say_symbols(fig, shown, dataset)
    panels = {
        left: curves.physical_points("contact_area_fraction", pressure),
        right: curves.physical_points("mean_gap", pressure, gap.factor),
    }
    curves.draw_curves(shown, panels, unloading=True)
    units = {
        (float(run["contact_modulus"] * run["unit_slope"]), float(run["unit_height"]))
        for line in shown.lines
        for run in line.runs.by_seed.values()
    }
    if references is not None and len({float(f"{each:.6g}") for each, _ in units}) == 1:
        limits = left.get_xlim()
        (modulus, height) = next(iter(units))
        p = references["reduced_pressure"].values * modulus * pressure.factor
        inside = (p >= limits[0]) & (p <= limits[1])
        look = {"color": BLACK, "lw": 1, "zorder": 2}
        say(fig, _PERSSON)
        plot(left, p[inside], references["persson_area_fraction"].values[inside], label="Persson", **look)
        if "persson_reduced_separation" in references:
            separation = references["persson_reduced_separation"].values[inside] * height * gap.factor
            say(fig, _YANG)
            plot(right, p[inside], separation, label="Yang & Persson", **look | {"ls": (0, (7, 2))})
    for ax in (left, right):
        ax.set_xlabel(pressure.label)
    left.set_ylabel(label_of("contact_area_fraction"))
    right.set_ylabel(gap.label)
    curves.add_legend(fig, [left, right], shown)
    return fig


def _say_symbols(fig, shown, dataset):
    """Explain symbols and their filling in the caption."""
    curves.say_models(fig, shown, " in loading", stars="Crosses and stars")
    energies = {curve.runs.surface_energy > 0 for curve in (*shown.lines, *shown.crosses)}
    if False in energies and any(curve.runs.model_name == ASPERITIES_NAME for curve in shown.lines):
        say(fig, "Open shapes are without adhesion.")
    if len(energies) > 1 and shown.crosses:
        say(
            fig,
            """Crosses without adhesion are larger. Where adhesion has little effect, closed shapes and small crosses
            lie inside open shapes and large crosses.""",
        )
    if dataset.sizes["seed"] == 1:
        say(fig, "Results are of one realisation of the surface.")


def _difference(line, truth, points):
    """Return loads, and for each seed the differences in per cent between a curve and boundary elements.

    Loads are those of the curve in the load range of boundary elements, and the largest load that both reach. Values of
    both models are interpolated to these loads.
    """
    from icha.analysis.common_loads import at_common_loads, interpolate

    members, runs, truths = [], line.stops, truth.stops
    for seed in [seed for seed in runs if seed in truths]:
        (load, values), (true_load, true_values) = _pressed(points, runs[seed]), _pressed(points, truths[seed])
        if load.size and true_load.size:
            at = np.clip(load, true_load.min(), true_load.max())
            at = at[np.isclose(at, load, rtol=_SAME_LOAD, atol=0)]
            largest = min(load.max(), true_load.max())
            if at.size and not np.isclose(at.max(), largest, rtol=_SAME_LOAD, atol=0):
                at = np.append(at, largest)
            logarithmic = points is curves.area_points
            own, true = (
                interpolate(*each, at, logarithmic=logarithmic) for each in ((load, values), (true_load, true_values))
            )
            members.append((at, 100 * (own / true - 1)))
    return at_common_loads(members, logarithmic=False) if members else (np.empty(0), np.empty((0, 0)))


def _pressed(points, run):
    """Return the points of a run at compressive loads; with adhesion, areas may be reached in tension."""
    load, values = points(run)
    return load[load > 0], values[load > 0]


def _draw_references(left, right, references, limits):
    """Draw published results and theories of rough contact; `limits` are the smallest and the largest load."""
    say(left, _PERSSON, _BUSH, _XU)
    p, black = references["reduced_pressure"].values, {"color": BLACK, "lw": 1, "zorder": 2}
    shown = (p >= limits[0] / 1.5) & (p <= limits[1] * 1.5)
    plot(left, p[shown], references["persson_area_fraction"].values[shown] / p[shown], label="Persson", **black)
    corrected = references["xu_area_fraction"].values[shown]
    plot(left, p[shown], corrected / p[shown], label="Persson, corrected by Xu et al.", **black | {"ls": (0, (1, 1))})
    linear = references["linear_pressure"].values
    touching = linear >= limits[0] / 1.5
    area = references["bush_gibson_thomas_area_fraction"].values[touching]
    plot(
        left,
        linear[touching],
        area / linear[touching],
        label="Bush, Gibson & Thomas",
        **black | {"ls": "--", "color": GREY},
    )
    if "gfmd_reduced_pressure" in references:
        load, area, scatter = (
            references[f"gfmd_{n}"].values for n in ("reduced_pressure", "area_fraction", "area_scatter")
        )
        points = {"fmt": "x", "color": BLACK, "ms": 6, "mew": 1.2, "lw": 1.2, "zorder": 5}
        say(left, _GFMD)
        record(left, load, area / load, "GFMD", low=(area - scatter) / load, high=(area + scatter) / load)
        left.errorbar(load, area / load, scatter / load, label="GFMD, no adhesion", **points)
    if "persson_reduced_separation" in references:
        say(left, _YANG)
        plot(
            right,
            p[shown],
            references["persson_reduced_separation"].values[shown],
            label="Yang & Persson",
            **black | {"ls": (0, (7, 2))},
        )


def _draw_estimates(axes, shown, compared):
    """Draw the difference between Ciavarella's estimate from boundary elements without adhesion, and those with it."""
    from icha.analysis import common_loads

    bare = {truth.runs.contact[1:]: truth.runs.by_seed for _, truth in compared if not truth.runs.surface_energy}
    single = sum(truth.runs.surface_energy > 0 for _, truth in compared) == 1
    for line, truth in compared:
        seed = next(iter(truth.stops))
        without = bare.get(line.runs.contact[1:], {}).get(seed)
        states = (
            None if without is None or not truth.runs.surface_energy else _estimate(without, truth.runs.by_seed[seed])
        )
        if states is None:
            continue
        colour = shown.looks.material_colour(line.runs.labels.material)
        for ax, (points, _), values in zip(axes, _QUANTITIES, states[1:], strict=True):
            load, true = _pressed(points, truth.stops[seed])
            if not load.size:
                continue
            inside = (states[0] >= load.min()) & (states[0] <= load.max())
            at = states[0][inside]
            known = common_loads.interpolate(load, true, at, logarithmic=points is curves.area_points)
            name = Name("Ciavarella, from runs without adhesion", truth.runs.labels._replace(seed=seed))
            say(ax, _CIAVARELLA)
            plot(ax, at, 100 * (values[inside] / known - 1), name, color=colour, **_ESTIMATE)
            named = colour if single else GREY
            ax.plot([], [], color=named, label="Ciavarella, from runs without adhesion", **_ESTIMATE)


def _estimate(bare, adhesive):
    """Return reduced pressure, area fraction and reduced separation of Ciavarella's estimate; None for few states."""
    from icha.datasets.campaign import reduced_gap, unit_height
    from icha.references.bare_runs import ciavarella_states

    loading, height = bare["leg"].values == 0, float(unit_height(bare))
    loads = (bare["nominal_pressure"] / bare["contact_modulus"]).values[loading]
    areas, gaps = bare["contact_area_fraction"].values[loading], reduced_gap(bare).values[loading]
    length = float(adhesive["surface_energy"] / adhesive["contact_modulus"])
    states = ciavarella_states(loads, areas, gaps * height, length)
    return states and (
        states.relative_load / float(bare["unit_slope"]),
        states.area_fraction,
        states.separation / height,
    )


def _draw_separate_summits(left, right, references, dataset, looks):
    """Draw theories of separate summits: Greenwood & Williamson, and Fuller & Tabor for each material."""
    theories = []
    if "greenwood_williamson_reduced_pressure" in references:
        theories.append(("Greenwood & Williamson", (0, (5, 2, 1, 2)), GREY, "greenwood_williamson", references))
    for k in range(references.sizes.get("fuller_tabor_curve", 0)):
        theory = references.isel(fuller_tabor_curve=k)
        material, slope = str(theory["fuller_tabor_material"].values), float(theory["fuller_tabor_rms_slope"])
        if material in looks.materials and np.isclose(slope, dataset["rms_slope"].values, rtol=1e-9).any():
            theories.append(("Fuller & Tabor", (0, (1, 1.5)), looks.material_colour(material), "fuller_tabor", theory))
    for label, dashes, colour, name, theory in theories:
        say(left, _SUMMITS[label])
        p, separation = (theory[f"{name}_reduced_{quantity}"].values for quantity in ("pressure", "separation"))
        look, pressed = {"ls": dashes, "lw": 0.8, "zorder": 1.8}, p > 0
        area = theory["summit_area_fraction"].values[pressed] / p[pressed]
        for ax, values in ((left, area), (right, separation[pressed])):
            plot(ax, p[pressed], values, label, color=colour, **look)
            ax.plot([], [], color=colour if len(theories) <= 2 else GREY, label=label, **look)
