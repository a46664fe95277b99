"""Figures of all runs of a study against load: area and separation (2), area and measurements (5), stiffness (7)."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.analysis.common_loads import at_common_loads, interpolate
from icha.datasets.labels import RunLabels
from icha.datasets.quantities import label_of, quantity
from icha.figures import curves
from icha.figures.captions import of_other_study, theories_of_flat_surfaces
from icha.figures.curves import Panel, draw_theory, panel_in_units
from icha.figures.drawn import Name, plot, record, say
from icha.figures.ensembles import draw_members
from icha.figures.looks import ASPERITIES_NAME, legend_below
from icha.figures.measured import Measured, name_sources
from icha.figures.select import NothingToDraw, has_layer, has_shape
from icha.figures.style import BLACK, DASHES, GREY, in_style, logarithmic_axes, new_panels
from icha.references.bare_runs import ciavarella_states

_BLACK = {"color": BLACK, "lw": 1, "zorder": 2}

# --- figure 2 ---

# Height of the lower panels divided by the height of the upper panels. The lower panels show differences.
_LOWER = 0.42
# Loads of two models count as equal up to this relative difference, because each model has its own load tolerance.
_SAME_LOAD = 1e-6
# Ticks of the separation axis, if the ratio of the ends of this axis is less than 60.
_SEPARATIONS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1, 1.5, 2, 3, 5)
# Look of Ciavarella's estimate from boundary elements without adhesion.
_ESTIMATE = {"ls": (0, (6, 1.5, 1, 1.5, 1, 1.5)), "lw": 0.9, "zorder": 1.9}
_AREA_OVER_PRESSURE = Panel("reduced_pressure", "contact_area_fraction")

_COMPARED = """Panels (c) and (d) show the relative difference between asperity model and boundary elements (BEM), of
each topography at the same load, as a mean over the seeds. Symbols end at the largest load that both models reach."""
_CIAVARELLA = """The estimate of Ciavarella (2018) follows from boundary elements without adhesion; its loads are not
those of the symbols."""
_THEORIES = """Theories are those of contact without adhesion, except that of Fuller and Tabor. Those of Greenwood and
Williamson and of Fuller and Tabor are of separate summits. Xu et al. (2024) correct Persson's theory for the variance
of the pressure in partial contact."""
_GFMD = """Oblique crosses are published results of Green's function molecular dynamics without adhesion for this
spectrum (Xu et al., 2024), with standard deviations over surfaces. These areas are counts of cells on a coarse grid; a
correction for the perimeter would make them up to 7 % smaller."""


@in_style
def area_and_gap(
    campaign: xr.DataTree, references: xr.Dataset | None = None, *, study: str, units: str = "reduced"
) -> Figure:
    """Draw area over load and mean gap of all runs of a study, or in physical units the area and the mean gap.

    `references` are theories and published results for the study's first surface (`icha.references.theories`). In
    physical units, theories are drawn only if one pressure unit holds for all runs.
    """
    shown, dataset = curves.study_curves(campaign, study), campaign[study].to_dataset()
    physical = units == "physical"
    panels = Panel("reduced_pressure", "area_over_load"), Panel("reduced_pressure", curves.gap_name(dataset))
    if physical:
        panels = [panel_in_units("nominal_pressure", y, dataset) for y in ("contact_area_fraction", "mean_gap")]
    truths = {} if physical else {truth.runs.line.contact: truth for truth in shown.crosses}
    compared = [(line, truths[line.runs.line.contact]) for line in shown.lines if line.runs.line.contact in truths]
    fig, axes = new_panels(4.5, 2, sharex=True, height_ratios=(1, _LOWER)) if compared else new_panels(3.3)
    left, right = axes[0]
    (loads, areas), (_, gaps) = (
        map(curves.drop_rounding_errors, drawn)
        for drawn in curves.draw_curves(shown, dict(zip(axes[0], panels, strict=True)), unloading=True)
    )
    say(fig, "Results are of one realisation of the surface." if dataset.sizes["seed"] == 1 else "")
    x = (loads.min() / 1.6, loads.max() * 1.6)
    if references is not None and not physical:
        say(fig, _THEORIES)
        _draw_references(axes[0], panels, references, x)
        if dataset.sizes["surface"] > 1:
            say(fig, "Theories are those of the first surface.")
        _draw_separate_summits(axes[0], panels, references, study, dataset, shown.looks)
    elif references is not None and (unit := _only_unit(shown)):
        say(fig, "Theories are those of contact without adhesion.", theories_of_flat_surfaces(dataset))
        _draw_persson(axes[0], panels, references, x, unit)
    for ax, panel in zip(axes[0], panels, strict=True):
        panel.label(ax, lowest=not compared)
    if not physical:
        curves.limit_ratios(left, areas)
        low, high = gaps.min() / 1.4, gaps.max() * 1.4
        right.set_ylim(low, high)
        right.yaxis.set_major_formatter("{x:g}")
        right.yaxis.set_minor_formatter("")
        if high < 60 * low:
            right.set_yticks([tick for tick in _SEPARATIONS if low < tick < high])
    if compared:
        say(fig, _COMPARED)
        _draw_differences(axes[1], shown, compared, panels[1])
    say(fig, "" if physical else theories_of_flat_surfaces(dataset))
    for ax in axes[-1]:
        ax.set(xlim=x, xlabel=label_of(panels[0].x, panels[0].units[0]))
    legend_below(fig, shown.handles)
    return fig


def _only_unit(shown):
    """Return the unit of reduced pressures, Pa, and the unit of reduced separations, m; None if runs differ."""
    runs = [run for line in shown.lines for run in line.runs.by_seed.values()]
    units = [(float(run["contact_modulus"] * run["unit_slope"]), float(run["unit_height"])) for run in runs]
    return units[0] if len({float(f"{pressure:.6g}") for pressure, _ in units}) == 1 else None


def _states(pressure, area, separation=None, unit=(1.0, 1.0)):
    """Return the states of a theory as variables of a run; `unit` has the units of pressure and separation."""
    found = {"reduced_pressure": pressure, "nominal_pressure": pressure * unit[0], "contact_area_fraction": area}
    if separation is not None:
        found |= {"reduced_separation": separation, "mean_gap": separation * unit[1]}
    return {name: np.asarray(values, float) for name, values in found.items()}


def _draw_persson(axes, panels, references, limits, unit=(1.0, 1.0)):
    """Draw the theories of Persson for the area, and of Yang and Persson for the separation."""
    separation = references.get("persson_reduced_separation")
    states = _states(references["reduced_pressure"], references["persson_area_fraction"], separation, unit)
    draw_theory(axes[0], panels[0], states, limits, label="Persson", **_BLACK)
    if separation is not None:
        look = _BLACK | {"ls": (0, (7, 2))}
        draw_theory(axes[1], panels[1], states, limits, label="Yang & Persson", **look)


def _draw_references(axes, panels, references, limits):
    """Draw published results and theories of rough contact; `limits` are the smallest and the largest load."""
    (left, _), (area, _) = axes, panels
    _draw_persson(axes, panels, references, limits)
    for label, load, name, look in (
        ("Persson, corrected by Xu et al.", "reduced_pressure", "xu_area_fraction", {"ls": (0, (1, 1))}),
        ("Bush, Gibson & Thomas", "linear_pressure", "bush_gibson_thomas_area_fraction", {"ls": "--", "color": GREY}),
    ):
        draw_theory(left, area, _states(references[load], references[name]), limits, label=label, **_BLACK | look)
    if "gfmd_reduced_pressure" in references:
        load, fraction, scatter = (
            references[f"gfmd_{name}"].values for name in ("reduced_pressure", "area_fraction", "area_scatter")
        )
        points = {"fmt": "x", "color": BLACK, "ms": 6, "mew": 1.2, "lw": 1.2, "zorder": 5}
        say(left, _GFMD)
        record(left, load, fraction / load, "GFMD", low=(fraction - scatter) / load, high=(fraction + scatter) / load)
        left.errorbar(load, fraction / load, scatter / load, label="GFMD, no adhesion", **points)


def _draw_separate_summits(axes, panels, references, study, dataset, looks):
    """Draw theories of separate summits: Greenwood & Williamson, and Fuller & Tabor for each material and slope."""
    theories = []
    if "greenwood_williamson_reduced_pressure" in references:
        name, look = Name("Greenwood & Williamson"), {"ls": (0, (5, 2, 1, 2)), "color": GREY}
        theories.append((name, look, "greenwood_williamson", references))
    for k in range(references.sizes.get("fuller_tabor_curve", 0)):
        theory = references.isel(fuller_tabor_curve=k)
        material, slope = str(theory["fuller_tabor_material"].values), float(theory["fuller_tabor_rms_slope"])
        if material in looks.materials and np.isclose(slope, dataset["rms_slope"].values, rtol=1e-9).any():
            surface = str(dataset["surface"].values[0])
            name = Name("Fuller & Tabor", RunLabels(study, None, surface, None, slope, material))
            look = {"ls": (0, (1, 1.5)), "color": looks.material_colour(material)}
            theories.append((name, look, "fuller_tabor", theory))
    for name, look, prefix, theory in theories:
        pressure, separation = (theory[f"{prefix}_reduced_{each}"] for each in ("pressure", "separation"))
        states = _states(pressure.where(pressure > 0), theory["summit_area_fraction"], separation)
        look |= {"lw": 0.8, "zorder": 1.8}
        for ax, panel in zip(axes, panels, strict=True):
            draw_theory(ax, panel, states, (0.0, np.inf), name, **look)
        axes[0].plot([], [], label=name.curve, **look | ({} if len(theories) <= 2 else {"color": GREY}))


def _draw_differences(axes, shown, compared, gap):
    """Draw the differences in area and `gap` between asperities and boundary elements, and of Ciavarella's estimate."""
    errors = {_AREA_OVER_PRESSURE: "area_error", gap: "gap_error" if gap.y == "reduced_gap" else "separation_error"}
    for ax, (panel, error) in zip(axes, errors.items(), strict=True):
        for line, truth in compared:
            seeds = [seed for seed in line.stops if seed in truth.stops]
            members = [_difference(panel, panel.points(line.stops[k]), panel.points(truth.stops[k])) for k in seeds]
            if members := [each for each in members if each[0].size]:
                load, values = at_common_loads(members, logarithmic=False)
                name = line.runs.drawn_name._replace(curve="asperities relative to boundary elements")
                of_curve = {"name": name, "asked": min(line.runs.asked, truth.runs.asked), "curves": len(compared)}
                draw_members(ax, load, values, line.look | {"lw": 0.6}, positive=False, **of_curve)
        logarithmic_axes(ax, "x")
        ax.axhline(0, color="0.6", lw=0.6, zorder=0)
        ax.set_ylabel(rf"${quantity(error).symbol}$  (%)")
    flat = [truth for _, truth in compared if not has_layer(truth.runs.first)]
    bare = {truth.runs.line.place: truth.runs.by_seed for truth in flat if not truth.runs.surface_energy}
    adhesive = [truth for truth in flat if truth.runs.surface_energy]
    for truth in adhesive:
        seed = next(iter(truth.stops))
        without = bare.get(truth.runs.line.place, {}).get(seed)
        states = None if without is None else _estimate(without, truth.runs.by_seed[seed])
        for ax, panel in zip(axes, errors if states else (), strict=False):
            colour = shown.looks.material_colour(truth.runs.labels.material)
            drawn = _difference(panel, panel.points(states), panel.points(truth.stops[seed]))
            plot(ax, *drawn, truth.runs.drawn_name._replace(curve="Ciavarella"), color=colour, **_ESTIMATE)
            named = colour if len(adhesive) == 1 else GREY
            ax.plot([], [], color=named, label="Ciavarella, from runs without adhesion", **_ESTIMATE)
            say(ax, _CIAVARELLA)


def _difference(panel, points, true):
    """Return loads, and the differences in per cent from the points `true` of boundary elements, by interpolation.

    Loads are those of the `points` in the range of `true`, and the largest load that both reach. With adhesion, areas
    may be reached in tension, so only compressive loads count.
    """
    (load, values), (true_load, true_values) = (tuple(each[x > 0] for each in (x, y)) for x, y in (points, true))
    if not load.size or not true_load.size:
        return np.empty(0), np.empty(0)
    at = np.clip(load, true_load.min(), true_load.max())
    at = at[np.isclose(at, load, rtol=_SAME_LOAD, atol=0)]
    largest = min(load.max(), true_load.max())
    if at.size and not np.isclose(at.max(), largest, rtol=_SAME_LOAD, atol=0):
        at = np.append(at, largest)
    logarithmic = panel.y == "contact_area_fraction"
    own, true = (interpolate(*each, at, logarithmic=logarithmic) for each in ((load, values), (true_load, true_values)))
    return at, 100 * (own / true - 1)


def _estimate(bare, adhesive):
    """Return the states of Ciavarella's estimate; None for few states."""
    loading, height = bare["leg"].values == 0, float(bare["unit_height"])
    loads = (bare["nominal_pressure"] / bare["contact_modulus"]).values[loading]
    areas, gaps = bare["contact_area_fraction"].values[loading], bare["reduced_gap"].values[loading]
    length = float(adhesive["surface_energy"] / adhesive["contact_modulus"])
    states = ciavarella_states(loads, areas, gaps * height, length)
    slope = float(bare["unit_slope"])
    return states and _states(states.relative_load / slope, states.area_fraction, states.separation / height)


# --- figure 5 ---

_AREA = Panel("relative_load", "contact_area_fraction")
_RATIO, _RATIO_OF_SHAPE = Panel("reduced_pressure", "area_over_load"), Panel("relative_load", "area_over_relative_load")


@in_style
def multi_slope(
    campaign: xr.DataTree,
    *,
    study: str,
    boundary_elements: str | None = None,
    measurements: Sequence[Measured] = (),
) -> Figure:
    """Draw all runs of a study: area, and area over load.

    Area over load is drawn against the reduced pressure. If a surface has a shape, it is drawn against the relative
    load, because the unit of reduced pressures of a shape is not the rms slope, which a measurement has.
    Axes of relative loads show only measurements whose relative loads are known.
    """
    shown = curves.study_curves(campaign, study, boundary_elements, open_markers=True)
    looks, shaped = shown.looks, has_shape(campaign[study].to_dataset())
    # If colours distinguish surfaces and slopes, every material has a row of panels.
    rows = [[material] for material in looks.materials] if looks.by_place else [looks.materials]
    fig, panels = new_panels(0.5 + 2.8 * len(rows), len(rows), sharex="col")
    columns = _AREA, _RATIO_OF_SHAPE if shaped else _RATIO
    for row, materials in zip(panels, rows, strict=True):
        lines, crosses = (
            [curve for curve in of_model if curve.runs.labels.material in materials]
            for of_model in (shown.lines, shown.crosses)
        )
        of_row, of_panels = shown._replace(lines=lines, crosses=crosses), dict(zip(row, columns, strict=True))
        drawn = curves.draw_curves(of_row, of_panels, unloading=True)
        for (ax, panel), (_, values) in zip(of_panels.items(), drawn, strict=True):
            for k, each in enumerate(measurements):
                if each.material in (None, *materials):
                    look = {"color": looks.material_colour(each.material), "ls": DASHES[k % len(DASHES)]}
                    values = np.append(values, _draw_measured(ax, panel, each, look))
            ax.set_title(looks.label(materials[0]) if len(rows) > 1 else "", loc="right", fontsize=8)
            panel.label(ax, lowest=materials is rows[-1])
        curves.limit_ratios(row[1], values)
    legend_below(fig, shown.handles)
    say(fig, of_other_study(boundary_elements))
    if measurements:
        say(fig, f"Lines without markers are measurements: {name_sources(measurements)}.")
    return fig


def _draw_measured(ax, panel, measured, look):
    """Draw a measured curve, if its loads are known in the unit of the axis, and return the values that are drawn."""
    load, slope, modulus = measured.values["load"], measured.rms_slope, measured.contact_modulus
    states = {"contact_area_fraction": measured.values["area"]}
    if modulus:  # loads are pressures
        states |= {"relative_load": load / modulus} | ({"reduced_pressure": load / modulus / slope} if slope else {})
    else:
        states |= {"reduced_pressure": load} | ({"relative_load": load * slope} if slope else {})
    if panel.x not in states:
        return np.empty(0)
    x, y = panel.points(states)
    plot(ax, x, y, **look | {"lw": 1.1, "zorder": 1, "label": measured.label})
    return y


# --- figure 7 ---

STIFFNESS = Panel("reduced_pressure", "reduced_stiffness")
_STIFFNESS = """The contact stiffness K is -dp/du, with the nominal pressure p and the mean separation u. In panel (b),
a stiffness proportional to the pressure is a horizontal line."""
_EDGES = """Boundary elements include the motion of the edges of contact. With adhesion they vary as the edges move
across cells, for a single sphere by 7 to 60 %."""
_INFINITE = """The theory of Yang and Persson is for an infinite surface without adhesion, where the
stiffness at small loads is proportional to the load. On a finite surface it is larger, because only the highest parts
touch (Pastewka et al., Phys. Rev. E 87 (2013) 062809)."""


@in_style
def stiffness(campaign: xr.DataTree, references: xr.Dataset | None = None, *, study: str) -> Figure:
    """Draw all runs of a study, and the theory for the study's first surface (`icha.references.theories`), if any."""
    shown = curves.study_curves(campaign, study, panel=STIFFNESS)
    fig, [axes] = new_panels(3.3)
    dataset = campaign[study].to_dataset()
    say(fig, _STIFFNESS)
    models = {curve.runs.model_name for curve in (*shown.lines, *shown.crosses)}
    if ASPERITIES_NAME in models:
        say(fig, "The asperity model gives the stiffness for spots that do not form, break or unite.")
    if models - {ASPERITIES_NAME}:
        say(fig, _EDGES)
    panels = dict(zip(axes, (STIFFNESS, Panel("reduced_pressure", "stiffness_over_pressure")), strict=True))
    (loads, stiffnesses), (_, ratios) = curves.draw_curves(shown, panels)
    if not len(loads):
        raise NothingToDraw(f"study {study}: no step of the first loading has a positive load and a positive stiffness")
    x = (curves.drop_rounding_errors(loads).min() / 1.6, loads.max() * 1.6)
    for ax, panel in panels.items():
        panel.label(ax)
        if references is not None and "persson_reduced_stiffness" in references:
            say(fig, _INFINITE)
            theory = {"reduced_pressure": "reduced_pressure", "reduced_stiffness": "persson_reduced_stiffness"}
            states = {name: references[variable].values for name, variable in theory.items()}
            drawn = draw_theory(ax, panel, states, x, label="Yang & Persson", ls="-", **_BLACK)
            ratios = np.append(ratios, drawn) if ax is axes[1] else ratios
    axes[1].set_yscale("linear")
    axes[0].set(xlim=x, ylim=(curves.drop_rounding_errors(stiffnesses).min() / 2, stiffnesses.max() * 2))
    axes[1].set(xlim=x, ylim=(0, 1.15 * ratios.max()))
    say(fig, "States with negative pressure or negative stiffness are left out.", theories_of_flat_surfaces(dataset))
    legend_below(fig, shown.handles)
    return fig
