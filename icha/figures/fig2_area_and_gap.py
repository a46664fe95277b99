"""Fig. 2: contact area and mean separation against load, with theories and published points."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from icha.figures.select import path_steps, study_runs
from icha.figures.style import (
    BLACK,
    COLOURS,
    GREY,
    MARKERS,
    TWO_COLUMNS,
    material_label,
    new_figure,
    panel_label,
    styled,
)

CAPTION = (
    "Real contact area over nominal area (a) and mean separation over rms height (b) against the reduced pressure "
    "F/(E* h'rms A0), on double logarithmic axes. Markers: ICHA, one for each stop of the loading path; open markers "
    "are without adhesion. Lines: adhesionless theories of Persson (area) and of Yang and Persson (separation), and "
    "the linear law of Bush, Gibson and Thomas where few summits touch. Crosses: adhesionless Green's function "
    "molecular dynamics (GFMD) of other surfaces (H = 0.8, q1/q0 = 100, no roll-off), reduced from published data."
)

PRESSURE_LABEL = r"reduced pressure  $F/(E^{\ast}h_{\mathrm{rms}}^{\prime}A_0)$"
AREA_LABEL = r"contact area  $A/A_0$"


@styled
def figure(campaign: xr.DataTree, references: xr.Dataset | None = None, *, study: str) -> Figure:
    """Draw all runs of a study.

    Parameters
    ----------
    campaign : the campaign dataset.
    references : theories and points for the study's surface (`icha.reference.reference_dataset`), if any.
    study : name of the study.

    Raises
    ------
    ValueError
        If there is no such study or no run in it.
    """
    runs = study_runs(campaign, study)
    dataset = campaign[study].to_dataset()
    materials = [str(name) for name in dataset["material"].values]
    lines = list(dict.fromkeys((labels.surface, labels.rms_slope) for labels, _ in runs))

    fig = new_figure(TWO_COLUMNS, 3.3 + (0.1 * len(lines) * len(materials) if len(lines) * len(materials) > 3 else 0))
    left, right = fig.subplots(1, 2)
    pressures, areas, gaps = [], [], []
    named, shown = set(), set()
    for labels, run in runs:
        adhesive = float(run["surface_energy"]) > 0
        style = materials.index(labels.material)
        marker = MARKERS[lines.index((labels.surface, labels.rms_slope)) % len(MARKERS)]
        if len(lines) == 1:
            marker = MARKERS[style % len(MARKERS)]
        key = (labels.material, labels.surface, labels.rms_slope)
        name = material_label(dataset, labels.material)
        # Only what differs within the study is named.
        if len({surface for surface, _ in lines}) > 1:
            name += f", {labels.surface}"
        if len({slope for _, slope in lines}) > 1:
            name += rf", $h_{{\mathrm{{rms}}}}^{{\prime}}$ = {labels.rms_slope:g}"
        look = {
            "ls": "none",
            "marker": marker,
            "mec": COLOURS[(style + 1) % len(COLOURS)],
            "mfc": COLOURS[(style + 1) % len(COLOURS)] if adhesive else "white",
            "mew": 0.9,
            "label": None if key in named else name,
            "zorder": 4 if adhesive else 3,
            # Open markers are larger, so that they show behind closed ones where the results agree.
            "ms": 3.8 if adhesive else 5.6,
        }
        named.add(key)
        shown.add(name)
        run = path_steps(run)
        p = run["reduced_pressure"].values
        left.loglog(p, run["contact_area_fraction"].values, **look)
        right.loglog(p, run["reduced_separation"].values, **look)
        pressures.append(p[p > 0])
        areas.append(run["contact_area_fraction"].values)
        gaps.append(run["reduced_separation"].values)
    pressures, areas, gaps = map(np.concatenate, (pressures, areas, gaps))
    gaps = gaps[gaps > 0]

    x = (pressures.min() / 1.6, max(pressures.max() * 1.6, 0.3))
    if references is not None:
        _draw_references(left, right, references, x)
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
    right.set_ylabel(r"mean separation  $\bar{u}/h_{\mathrm{rms}}$")
    if len(named) <= 3:
        left.legend(loc="lower right")
        right.legend(loc="lower left")
    else:
        # Too many for the panels: the runs go below, the references stay.
        handles, names = left.get_legend_handles_labels()
        runs_shown = [(handle, name) for handle, name in zip(handles, names, strict=True) if name in shown]
        fig.legend(*zip(*runs_shown, strict=True), loc="outside lower center", ncols=2)
        for ax, corner in ((left, "lower right"), (right, "lower left")):
            others = [pair for pair in zip(*ax.get_legend_handles_labels(), strict=True) if pair[1] not in shown]
            if others:
                ax.legend(*zip(*others, strict=True), loc=corner)
    return fig


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
