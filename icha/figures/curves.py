"""Curves of all runs of a study against load: the same marker for the same run in every figure, and their legends."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from icha.figures.select import path_steps, study_runs, ways_back
from icha.figures.style import COLOURS, MARKERS, material_label

PRESSURE_LABEL = r"reduced pressure  $F/(E^{\ast}h_{\mathrm{rms}}^{\prime}A_0)$"
AREA_LABEL = r"contact area  $A/A_0$"
SEPARATION_LABEL = r"mean separation  $\bar{u}/h_{\mathrm{rms}}$"

UNLOADING = {"ls": (0, (4, 2)), "lw": 0.7, "zorder": 2.2}


class Curve(NamedTuple):
    """A run on its study's stops, its ways back, and the look of its markers (arguments of `Axes.plot`)."""

    run: xr.Dataset
    back: list[xr.Dataset]
    look: dict


def study_curves(campaign: xr.DataTree, study: str) -> list[Curve]:
    """All runs of a study: a colour for every material, a marker for every surface and slope; open without adhesion.

    Only the first run of every kind has a label, so that seeds do not crowd the legend.

    Raises
    ------
    ValueError
        If there is no such study or no run in it.
    """
    runs = study_runs(campaign, study)
    dataset = campaign[study].to_dataset()
    materials = [str(name) for name in dataset["material"].values]
    lines = list(dict.fromkeys((labels.surface, labels.rms_slope) for labels, _ in runs))
    curves, named = [], set()
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
        curves.append(Curve(path_steps(run), ways_back(run), look))
    return curves


def draw_unloading(axes: Axes, load: xr.DataArray, values: xr.DataArray, colour: str) -> None:
    """Draw one way back of a run on logarithmic axes of load, where it is compressive; the axes keep their range."""
    # Just before separation loads are as small as can be.
    shown = np.where(load.values > 0, load.values, np.nan)
    axes.add_artist(Line2D(shown, values.values, color=colour, **UNLOADING))


# More runs than this are named below the panels, and all lines if a panel had more names than this.
_MOST_RUNS = 3
_MOST_NAMES = 6


def add_legends(figure: Figure, panels: dict, curves: list[Curve]) -> None:
    """Add a legend to every panel of `panels` (axes and corner); what would crowd them is named once, below.

    The figure grows by the height of what stands below.
    """
    runs = {curve.look["label"] for curve in curves} - {None}
    names = {axes: dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True)) for axes in panels}
    known = {name: handle for own in names.values() for name, handle in own.items()}
    if max(map(len, names.values())) - len(runs) * (len(runs) > _MOST_RUNS) > _MOST_NAMES:
        below = known
    else:
        below = {name: handle for name, handle in known.items() if name in runs and len(runs) > _MOST_RUNS}
    if below:
        figure.set_figheight(figure.get_figheight() + 0.1 * len(below))
        figure.legend(below.values(), below.keys(), loc="outside lower center", ncols=2)
    for axes, corner in panels.items():
        own = {name: handle for name, handle in names[axes].items() if name not in below}
        if own:
            axes.legend(own.values(), own.keys(), loc=corner)
