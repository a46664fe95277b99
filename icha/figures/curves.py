"""Curves of a study against load: the same look for the same contact in every figure, means over seeds, legends."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.datasets.labels import RunLabels
from icha.figures.scale import MOST_COLOURS, Scale, materials_scale, places_scale
from icha.figures.select import Snapshots, name_of_place, path_steps, snapshot_label, study_runs, ways_back
from icha.figures.style import (
    BLACK,
    COLOURS,
    GREY,
    MARKERS,
    legend_handle,
    line_artist,
    line_look,
    material_label,
    panel_label,
    slope_label,
)
from icha.support.statistics import Ensemble, ensemble

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

PRESSURE_LABEL = r"reduced pressure  $F/(E^{\ast}h_{\mathrm{rms}}^{\prime}A_0)$"
AREA_LABEL = r"contact area  $A/A_0$"
SEPARATION_LABEL = r"mean separation  $\bar{u}/h_{\mathrm{rms}}$"
GAP_LABEL = r"mean gap  $\langle u\rangle/h_{\mathrm{rms}}$"

UNLOADING = {"ls": (0, (4, 2)), "lw": 0.7, "zorder": 2.2}


def gap_label(data: xr.Dataset) -> str:
    """What the mean gap of runs is called: of periodic surfaces the mean separation, of free squares not."""
    return GAP_LABEL if (data["boundary"] == "free").any() else SEPARATION_LABEL


class Line(NamedTuple):
    """The runs of one surface, slope and material, one for every seed, and the look of their markers.

    `labels` are those of the first run, `runs` are on their study's stops, `back` holds the ways back of each, `look`
    the arguments of `Axes.plot`.
    """

    labels: RunLabels
    runs: list[xr.Dataset]
    back: list[list[xr.Dataset]]
    look: dict


class Curves(NamedTuple):
    """The lines of a study, the colours of its materials, and the scale of colours where there are many lines."""

    lines: list[Line]
    colours: dict[str, str]
    scale: Scale | None

    @property
    def several_seeds(self) -> bool:
        """Whether there are means to be drawn."""
        return any(len(line.runs) > 1 for line in self.lines)

    @property
    def unloaded(self) -> bool:
        """Whether there are ways back."""
        return any(way for line in self.lines for way in line.back)


def study_curves(campaign: xr.DataTree, study: str) -> Curves:
    """All runs of a study: a colour for every material, a marker for every surface and slope; open without adhesion.

    Of many materials, or of many surfaces and slopes, those have colours of a scale instead.

    Raises
    ------
    ValueError
        If there is no such study or no run in it.
    """
    members: dict[tuple, list] = {}
    for labels, run in study_runs(campaign, study, ragged=False):
        members.setdefault((labels.material, labels.surface, labels.rms_slope), []).append((labels, run))
    dataset = campaign[study].to_dataset()
    materials = [str(name) for name in dataset["material"].values]
    places = list(dict.fromkeys((surface, slope) for _, surface, slope in members))
    colours = {name: COLOURS[(k + 1) % len(COLOURS)] for k, name in enumerate(materials)}
    of_place, scale = {}, None
    if len(places) > MOST_COLOURS:
        scale = places_scale(places)
        of_place, colours = dict(zip(places, scale.colours, strict=True)), dict.fromkeys(materials, BLACK)
    elif len(materials) > MOST_COLOURS:
        own = [name for name in materials if name in {material for material, *_ in members}]
        scale = materials_scale(dataset, own)
        colours = dict(zip(own, scale.colours, strict=True))
    lines = []
    for (material, *place), own in members.items():
        place = tuple(place)
        (first, *_), runs = zip(*own, strict=True)
        adhesive = float(runs[0]["surface_energy"]) > 0
        kind = materials.index(material) if of_place or len(places) == 1 else places.index(place)
        # Only what differs within the study is named, and not what the scale tells.
        name = [] if scale and (len(materials) == 1 or not of_place) else [material_label(dataset, material)]
        if not of_place:
            name += [place[0]] if len({surface for surface, _ in places}) > 1 else []
            name += [slope_label(place[1])] if len({slope for _, slope in places}) > 1 else []
        colour = of_place.get(place, colours[material])
        look = {
            "ls": "none",
            "color": colour,
            "marker": MARKERS[0 if scale and not of_place and len(places) == 1 else kind % len(MARKERS)],
            "mec": colour,
            "mfc": colour if adhesive else "white",
            "mew": 0.9,
            "label": ", ".join(name) or None,
            "zorder": 4 if adhesive else 3,
            # Open markers are larger, so that they show behind closed ones where the results agree.
            "ms": 3.8 if adhesive else 5.6,
        }
        if scale:
            look |= {"ls": "-", "lw": 0.6, "ms": 0.6 * look["ms"], "mew": 0.6}
        lines.append(Line(first, [path_steps(run) for run in runs], [ways_back(run) for run in runs], look))
    return Curves(lines, colours, scale)


def material_looks(dataset: xr.Dataset, materials: Sequence[str]) -> tuple[list[dict], Scale | None]:
    """Looks of the lines of a figure of one line for every material, and their scale where there are many."""
    adhesive = [float(dataset["surface_energy"].sel(material=name)) > 0 for name in materials]
    if len(materials) > MOST_COLOURS:
        scale = materials_scale(dataset, materials)
        return [{"color": colour, "ls": "-", "lw": 0.9, "marker": "o", "ms": 2} for colour in scale.colours], scale
    return [
        line_look(k, adhesive=adhesive[k]) | {"label": material_label(dataset, name)}
        for k, name in enumerate(materials)
    ], None


def say_which_snapshots(
    figure: Figure, panels: Sequence[Axes], dataset: xr.Dataset, lines: Sequence[Snapshots], scale: Scale | None
) -> None:
    """Letters and titles of the two panels of a figure of one snapshot, its scale, and what several seeds mean."""
    if scale:
        scale.draw(figure, list(panels))
    if any(len(line.members) > 1 for line in lines):
        panels[-1].add_line(band_handle(len(line.members) for line in lines))
    shown = lines[0].labels
    titles = (snapshot_label(*lines[-1].members[0]), name_of_place(dataset, shown.surface, shown.rms_slope))
    for axes, letter, title in zip(panels, "ab", titles, strict=True):
        axes.set_title(title, loc="right")
        panel_label(axes, letter)


def say_whose_theories(panels: Iterable[Axes], dataset: xr.Dataset) -> None:
    """Name in the legends the first surface of a study, which theories are drawn for, where it has several."""
    names = dataset["surface"].values.tolist()
    for axes in panels if len(names) > 1 else ():
        axes.plot([], [], ls="none", label=f"theories: {names[0]}")


# A mean has about so many markers.
_MEAN_MARKERS = 8


def draw_line(
    axes: Axes,
    line: Line,
    points: Callable[[xr.Dataset], tuple[np.ndarray, np.ndarray]],
    *,
    logarithmic: bool,
    lines: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Draw the points of a run by markers; of several seeds their mean at common loads by a line with its 95 % band.

    Parameters
    ----------
    points : load and value of the steps of a run.
    lines : number of lines in the panel.
    logarithmic : whether means are interpolated on the logarithm of the values, where runs have not the same loads.

    Returns
    -------
    What was drawn: loads and values.
    """
    from icha.analysis.common_loads import mean_curve

    members = [points(run) for run in line.runs]
    if len(members) > 1:
        load, over = mean_curve(members, logarithmic=logarithmic)
        if len(load):
            draw_mean(axes, load, over, line.look, lines)
            return load, over.mean
    # Runs without a common load have no mean.
    for k, (load, values) in enumerate(members):
        axes.plot(load, values, **line.look | ({} if k == 0 else {"label": None}))
    load, values = map(np.concatenate, zip(*members, strict=True))
    return load, values


def draw_mean(axes: Axes, x: np.ndarray, over: Ensemble, look: dict, lines: int = 1) -> None:
    """Draw the mean of an ensemble with its band, one of so many `lines` of a panel."""
    every = max(1, -(-len(x) // _MEAN_MARKERS))
    axes.plot(x, over.mean, **look | {"ls": "-", "lw": 0.9, "markevery": every})
    draw_band(axes, x, over, look["color"], lines)


def draw_members(axes: Axes, x: np.ndarray, members: np.ndarray, look: dict, lines: int, **alone: object) -> None:
    """Draw the values (members, k) of an ensemble: their mean with its band, or, with `alone` in its look, the one."""
    if len(members) == 1:
        axes.plot(x, members[0], **alone, **look)
    else:
        draw_mean(axes, x, ensemble(members), look, lines)


def draw_band(axes: Axes, x: np.ndarray, over: Ensemble, colour: str, lines: int = 1) -> None:
    """Shade the 95 % band of confidence of a mean, the paler the more there are; it does not widen the panel."""
    limits = axes.dataLim.frozen()
    look = {"alpha": _SHADE * min(1.0, _FEW_BANDS / lines), "lw": 0, "zorder": 1.5}
    axes.fill_between(x, over.mean - over.confidence, over.mean + over.confidence, color=colour, **look)
    axes.dataLim.set(limits)


_SHADE = 0.22
_FEW_BANDS = 3


def band_handle(counts: Iterable[int]) -> Line2D:
    """What the legend says of means and bands, of lines of so many seeds."""
    counts = sorted({count for count in counts if count > 1})
    words = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]}–{counts[-1]}"
    look = {"color": GREY, "alpha": 0.35, "lw": 6, "solid_capstyle": "butt"}
    return legend_handle(label=f"mean and 95 % band, n = {words} seeds", **look)


def bars_handle(counts: Iterable[int]) -> dict[str, Line2D]:
    """What the legend says of bars, of points of so many seeds; nothing where there are none."""
    counts = sorted({int(count) for count in counts if count > 1})
    if not counts:
        return {}
    words = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]}–{counts[-1]}"
    return {f"means of n = {words} seeds, bars 95 %": legend_handle(color=GREY, marker="|", ls="none", ms=8)}


def draw_ways_back(panels: Iterable[tuple[Axes, Callable]], line: Line) -> None:
    """Draw the ways back of a line's runs, or of several seeds their means at common separations.

    `panels` are axes, and load and value of a way as functions of its reduced pressure, contact area and reduced
    separation.
    """
    from icha.analysis.common_loads import mean_way

    ways = [
        (leg["reduced_pressure"].values, leg["contact_area_fraction"].values, leg["reduced_separation"].values)
        for leg in line.back[0]
    ]
    if len(line.runs) > 1 and len({len(back) for back in line.back}) == 1:
        ways = []
        for legs in zip(*line.back, strict=True):
            separation, over = mean_way(legs)
            ways.append((over["reduced_pressure"].mean, over["contact_area_fraction"].mean, separation))
    for axes, points in panels:
        for way in ways:
            draw_unloading(axes, *points(*way), line.look["mec"])


def draw_unloading(axes: Axes, load: np.ndarray, values: np.ndarray, colour: str) -> None:
    """Draw one way back of a run on logarithmic axes of load, where it is compressive; the axes keep their range."""
    # Just before separation loads are as small as can be.
    axes.add_artist(line_artist(np.where(load > 0, load, np.nan), values, color=colour, **UNLOADING))


# More runs than this are named below the panels, and all lines if a panel had more names than this.
_MOST_RUNS = 3
_MOST_NAMES = 6


def add_legends(figure: Figure, panels: dict, curves: Curves) -> None:
    """Add a legend to every panel of `panels` (axes and corner); what would crowd them is named once, below.

    The figure grows by the height of what stands below. Many lines have a scale of colours beside the panels.
    """
    if curves.scale:
        curves.scale.draw(figure, list(panels))
    if curves.several_seeds:
        next(iter(panels)).add_line(band_handle(len(line.runs) for line in curves.lines))
    runs = {line.look["label"] for line in curves.lines} - {None}
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
