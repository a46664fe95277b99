"""Fig. 2: contact area and mean separation against load, with theories and published points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from icha.datasets import results
from icha.figures.curves import (
    AREA_LABEL,
    PRESSURE_LABEL,
    UNLOADING,
    add_legends,
    draw_line,
    draw_ways_back,
    gap_label,
    say_whose_theories,
    study_curves,
)
from icha.figures.declaration import Campaign, Declaration, Inputs
from icha.figures.options import StudyFigure, is_compared
from icha.figures.select import is_short_range, study_errors
from icha.figures.style import BLACK, GREY, TWO_COLUMNS, logarithmic_axes, new_figure, panel_label, styled
from icha.support.statistics import ensemble

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def inputs(campaign: Campaign, options: StudyFigure, files: results.ResultFiles) -> Inputs:
    """The runs, theories for their first surface, and boundary elements beside them, if there are any."""
    theories = files.path(results.THEORIES, surface=campaign.studies[options.study].surfaces[0])
    found = {"campaign": files.path(results.DATASET), "references": theories}
    return found | ({"model_error": files.path(results.MODEL_ERROR)} if is_compared(campaign, options.study) else {})


DECLARATION = Declaration(
    description="Contact area and mean separation against load, with theories.",
    caption=(
        "Real contact area over nominal area (a) and mean separation over rms height (b; for a free square the "
        "mean gap) against the reduced pressure "
        "F/(E* h'rms A0), on double logarithmic axes. Markers are results of ICHA, one for each stop of the loading "
        "path; open markers are without adhesion. Where there are several seeds, the lines are means over them at "
        "common loads, with the 95 % confidence band of the mean (Student's t). Thin dashed lines, if there are any, "
        "show unloading as long as the load is compressive. Upright crosses, if there are any, are boundary elements "
        "in the limit of a short range of attraction, on the same topographies (means over their seeds), in the colour "
        "of the material. Crosses with three arms, if there are any, are boundary elements by an independent code at "
        "the finite interaction range of the material. Their area is corrected by the perimeter of the contact. At "
        "ranges that a grid resolves they show practically no hysteresis; with adhesion they therefore bound the "
        "result in the limit of short ranges (JKR), but do not determine it. Lines are the adhesionless theories of "
        "Persson (area) and of Yang and Persson (separation), the linear law of Bush, Gibson and Thomas where few "
        "summits touch, and the theories of separate summits of Greenwood and Williamson (no adhesion) and of Fuller "
        "and Tabor (with adhesion, in the colour of the material). The theories use the spectral moments of the "
        "surface, or of the first one if there are several. Oblique crosses are adhesionless Green's function "
        "molecular dynamics (GFMD) of other surfaces (H = 0.8, q1/q0 = 100, no roll-off), reduced from published data."
    ),
    options=StudyFigure,
    inputs=inputs,
)


# Boundary elements in the limit of a short range, and at finite ones; further solutions of the same states, on other
# grids, have markers of their own.
_CROSS, _FINITE_RANGE = "+", ("1", "2", "3", "4")


@styled
def figure(
    campaign: xr.DataTree,
    references: xr.Dataset | None = None,
    model_error: xr.DataTree | None = None,
    *,
    study: str,
) -> Figure:
    """Draw all runs of a study.

    Parameters
    ----------
    campaign : the campaign dataset.
    references : theories and points for the study's first surface (`icha.references.theories`), if any.
    model_error : `icha.analysis.model_error.model_error` of the campaign, for boundary elements beside runs, if any.
    study : name of the study.

    Raises
    ------
    ValueError
        If there is no such study or no run in it.
    """
    from matplotlib.ticker import FuncFormatter, NullFormatter

    curves = study_curves(campaign, study)
    fig = new_figure(TWO_COLUMNS, 3.3)
    left, right = fig.subplots(1, 2)
    pressures, areas, gaps = [], [], []
    for line in curves.lines:
        p, area = draw_line(left, line, _areas, logarithmic=True, lines=len(curves.lines))
        areas.append(area)
        pressures.append(p[p > 0])
        p, gap = draw_line(right, line, _separations, logarithmic=True, lines=len(curves.lines))
        gaps.append(gap)
        draw_ways_back([(left, lambda p, area, _: (p, area)), (right, lambda p, _, gap: (p, gap))], line)
    for ax in (left, right):
        logarithmic_axes(ax)
    if curves.unloaded:
        left.plot([], [], color=GREY, label="unloading", **UNLOADING)
    for p, area, gap in _draw_solutions(left, right, curves.colours, study_errors(model_error, study)):
        pressures.append(p)
        areas.append(area)
        gaps.append(gap)
    pressures, areas, gaps = map(np.concatenate, (pressures, areas, gaps))
    gaps = gaps[gaps > 0]

    x = (pressures.min() / 1.6, max(pressures.max() * 1.6, 0.3))
    if references is not None:
        _draw_references(left, right, references, x)
        _draw_separate_summits(left, right, references, campaign[study].to_dataset(), curves.colours)
        say_whose_theories([left, right], campaign[study].to_dataset())
    left.set_xlim(x)
    right.set_xlim(x)
    left.set_ylim(min(areas.min(), 1.6 * x[0]) / 1.5, 1)
    right.set_ylim(gaps.min() / 1.6, gaps.max() * 1.6)
    right.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    right.yaxis.set_minor_formatter(NullFormatter())
    if np.log10(gaps.max() / gaps.min()) < 1.5:
        right.set_yticks([t for t in (0.05, 0.1, 0.2, 0.5, 1, 2, 5) if gaps.min() / 1.6 < t < gaps.max() * 1.6])
    for ax, letter in ((left, "a"), (right, "b")):
        ax.set_xlabel(PRESSURE_LABEL)
        panel_label(ax, letter)
    left.set_ylabel(AREA_LABEL)
    right.set_ylabel(gap_label(campaign[study].to_dataset()))
    add_legends(fig, {left: "lower right", right: "lower left"}, curves)
    return fig


def _areas(run):
    return run["reduced_pressure"].values, run["contact_area_fraction"].values


def _separations(run):
    return run["reduced_pressure"].values, run["reduced_separation"].values


def _draw_solutions(left, right, colours, entries):
    """Mark the states of boundary elements, means over their seeds; returns pressures, areas and separations."""
    states, drawn, named = [], [], set()
    for entry, errors in entries.items():
        name = errors.attrs["truth"]
        for material in errors["material"].values.tolist():
            again = drawn.count((name, material))
            drawn.append((name, material))
            own = errors.sel(material=material)
            area, gap = (
                ensemble(own[f"{name}_boundary_elements"].transpose("seed", ..., "reduced_pressure").values).mean
                for name in ("contact_area_fraction", "reduced_separation")
            )
            p = np.broadcast_to(own["reduced_pressure"].values, area.shape)
            # Of measured surfaces each has its own slope, and no states at those of others.
            there = np.isfinite(area)
            look = {
                "ls": "none",
                "marker": _CROSS if is_short_range(errors) else _FINITE_RANGE[again % len(_FINITE_RANGE)],
                "mec": colours.get(material, GREY),
                "mew": 1.0,
                # The larger ones show behind the others where the results agree, as the runs' markers do.
                "ms": 8 if float(own["surface_energy"]) > 0 else 11,
                "zorder": 6,
            }
            states.append((p[there], area[there], gap[there]))
            for ax, values in ((left, states[-1][1]), (right, states[-1][2])):
                ax.plot(states[-1][0], values, **look)
            label = f"{name}, {entry}" if again else name
            if label not in named:
                named.add(label)
                for ax in (left, right):
                    ax.plot([], [], **look | {"mec": GREY, "ms": 8}, label=label)
    return states


def _draw_references(left, right, references, limits):
    p = references["reduced_pressure"].values
    shown = (p >= limits[0] / 1.5) & (p <= limits[1] * 1.5)
    left.plot(
        p[shown], references["persson_area_fraction"].values[shown], "-", color=BLACK, lw=1, label="Persson", zorder=2
    )
    linear = references["linear_pressure"].values
    own = linear >= limits[0] / 1.5
    left.plot(
        linear[own],
        references["bush_gibson_thomas_area_fraction"].values[own],
        "--",
        color=GREY,
        lw=1,
        label="Bush, Gibson & Thomas",
        zorder=2,
    )
    left.plot(
        references["gfmd_reduced_pressure"].values,
        references["gfmd_area_fraction"].values,
        "x",
        color=BLACK,
        ms=6,
        mew=1.2,
        label="GFMD, no adhesion",
        zorder=5,
    )
    if "persson_reduced_separation" in references:
        right.plot(
            p[shown],
            references["persson_reduced_separation"].values[shown],
            "-",
            color=BLACK,
            lw=1,
            label="Yang & Persson",
            zorder=2,
        )


def _draw_separate_summits(left, right, references, dataset, colours):
    """Thin lines of the theories of separate summits, where the references have them; Fuller & Tabor by material."""
    area, look = references.get("summit_area_fraction"), {"lw": 0.8, "zorder": 1.8}
    dashes = {"Greenwood & Williamson": (0, (5, 2, 1, 2)), "Fuller & Tabor": (0, (1, 1.5))}
    curves = []
    if "greenwood_williamson_reduced_pressure" in references:
        values = [references[f"greenwood_williamson_reduced_{name}"].values for name in ("pressure", "separation")]
        curves.append(("Greenwood & Williamson", GREY, *values))
    if "fuller_tabor_reduced_pressure" in references:
        for k, name in enumerate(references["fuller_tabor_material"].values.tolist()):
            slope = float(references["fuller_tabor_rms_slope"][k])
            if name in colours and np.isclose(slope, dataset["rms_slope"].values, rtol=1e-9).any():
                own = references.isel(fuller_tabor_curve=k)
                values = [own[f"fuller_tabor_reduced_{quantity}"].values for quantity in ("pressure", "separation")]
                curves.append(("Fuller & Tabor", colours[name], *values))
    for name, colour, p, separation in curves:
        pushed = p > 0
        for ax, values in ((left, area.values), (right, separation)):
            ax.plot(p[pushed], values[pushed], color=colour, ls=dashes[name], **look)
    for name in dict.fromkeys(name for name, *_ in curves):
        for ax in (left, right):
            ax.plot([], [], color=GREY, ls=dashes[name], label=name, **look)
