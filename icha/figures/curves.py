"""Curves of a study against load: the same look for the same contact in every figure, means over seeds, legends."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.datasets.labels import RunLabels
from icha.datasets.variables.model_error import SHORT_RANGE
from icha.figures.ensembles import draw_members, lines_handles, mark_fewer
from icha.figures.legends import legend_below, named_handles, words_handle
from icha.figures.palette import (
    MODEL_MARKERS,
    PLACE_MARKERS,
    closed_look,
    material_colours,
    material_layers,
    model_handle,
    pale_look,
    place_markers,
)
from icha.figures.scale import MOST_COLOURS, Scale, materials_scale, places_scale
from icha.figures.select import (
    Snapshots,
    asked_seeds,
    is_applicable,
    name_of_place,
    path_steps,
    runs_by_boundary_elements,
    shown_model,
    snapshot_label,
    study_runs,
    ways_back,
)
from icha.figures.style import (
    BLACK,
    GREY,
    legend_handle,
    line_artist,
    material_label,
    panel_label,
)

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

    Runs to which the asperity model is not applicable are a pale line of their own.

    Parameters
    ----------
    labels : labels of the first run.
    runs : the runs, on their study's stops.
    back : the ways back of each run.
    look : arguments of `Axes.plot`.
    asked : number of seeds asked for.
    applicable : whether the asperity model is applicable to the runs.
    """

    labels: RunLabels
    runs: list[xr.Dataset]
    back: list[list[xr.Dataset]]
    look: dict
    asked: int
    applicable: bool


class Curves(NamedTuple):
    """The lines of a study, the colours of its materials, the scale of colours where there are many lines, and legend.

    `beside` are the lines of the same contacts by boundary elements, crosses, if lines are asperities. `handles` name
    materials, surfaces and slopes as far as the study has several of them, and the models.
    """

    lines: list[Line]
    beside: list[Line]
    colours: dict[str, str]
    scale: Scale | None
    handles: dict[str, Line2D]

    @property
    def unloaded(self) -> bool:
        """Whether there are ways back."""
        return any(way for line in self.lines for way in line.back)


# More lines than this are drawn thin.
_FEW_LINES = 6


def study_curves(campaign: xr.DataTree, study: str, boundary_elements: str | None = None) -> Curves:
    """All runs of a study: a colour for every material, a marker for every surface and slope; open without adhesion.

    Of many materials, or of many surfaces and slopes, those have colours of a scale instead. Beside asperities are the
    study's runs by boundary elements, or those of the study of that name.

    Raises
    ------
    ValueError
        If there is no such study or no run in it.
    """
    members = _by_contact(study_runs(campaign, study, ragged=False))
    dataset = campaign[study].to_dataset()
    materials = [name for name in dataset["material"].values.tolist() if name in {material for material, *_ in members}]
    places = list(dict.fromkeys((surface, slope) for _, surface, slope, _ in members))
    colours, of_place, scale = material_colours(campaign), {}, None
    if len(places) > MOST_COLOURS:
        scale = places_scale(places)
        of_place, colours = dict(zip(places, scale.colours, strict=True)), dict.fromkeys(materials, BLACK)
    elif len(materials) > MOST_COLOURS:
        scale = materials_scale(dataset, materials)
        colours = dict(zip(materials, scale.colours, strict=True))
    layers = material_layers(dataset, materials)
    markers = place_markers(places)
    by_elements = shown_model(dataset) != DEFAULT_MODEL
    lines = []
    for (material, *place, applicable), own in members.items():
        place = tuple(place)
        (first, *_), runs = zip(*own, strict=True)
        colour = of_place.get(place, colours[material])
        # Where surfaces and slopes have the colours of a scale, materials have the shapes.
        marker = PLACE_MARKERS[materials.index(material) % len(PLACE_MARKERS)] if of_place else markers[place]
        look = closed_look(colour, layers[material]) | {"ls": "none", "marker": marker}
        if by_elements:
            look |= {"marker": MODEL_MARKERS[SHORT_RANGE], "ms": look["ms"] + 2}
        if len(members) > _FEW_LINES:
            look |= {"lw": 0.6, "ms": 0.8 * look["ms"]}
        if scale:
            look |= {"ls": "-", "lw": 0.6, "ms": 0.6 * look["ms"], "mew": 0.6}
        look = look if applicable else pale_look(look)
        stops, back = [path_steps(run) for run in runs], [ways_back(run) for run in runs]
        lines.append(Line(first, stops, back, look, asked_seeds(dataset, first), applicable))
    others = boundary_elements or (None if by_elements else study)
    beside = _crosses(campaign, others, lines, colours) if others else []
    handles = _curve_handles(dataset, lines, scale, bool(of_place))
    return Curves(lines, beside, colours, scale, handles | ({SHORT_RANGE: model_handle(SHORT_RANGE)} if beside else {}))


def _by_contact(runs):
    """Labels and runs of the seeds of every material, surface and slope, apart where the model is not applicable."""
    members: dict[tuple, list] = {}
    for labels, run in runs:
        key = labels.material, labels.surface, labels.rms_slope, is_applicable(run)
        members.setdefault(key, []).append((labels, run))
    return members


def _crosses(campaign, study, lines, colours):
    """The lines of a study by boundary elements, in the colours of others of the same contacts, or of the material."""
    of_contact = {contact_of(line): line.look["color"] for line in lines if line.applicable}
    dataset, found = campaign[study].to_dataset(), []
    energy = dataset["surface_energy"]
    for (*contact, applicable), own in _by_contact(runs_by_boundary_elements(campaign, study)).items():
        (first, *_), runs = zip(*own, strict=True)
        adhesive = float(energy.sel(material=first.material)) > 0
        colour = of_contact.get(tuple(contact), colours.get(first.material, GREY))
        # The larger ones show behind the others where the results agree, as the markers of asperities do.
        size = (8 if adhesive else 11) * (1 if len(lines) <= _FEW_LINES else 0.7)
        look = {"color": colour, "mec": colour, "ms": size, "zorder": 6 + adhesive}
        stops = [path_steps(run) for run in runs]
        found.append(Line(first, stops, [], look | _CROSS, asked_seeds(dataset, first), applicable))
    return found


_CROSS = {"ls": "none", "marker": MODEL_MARKERS[SHORT_RANGE], "mew": 1.0}


def contact_of(line: Line) -> tuple[str, str, float]:
    """Material, surface and rms slope of the runs of a line."""
    return line.labels.material, line.labels.surface, line.labels.rms_slope


def model_name(dataset: xr.Dataset) -> str:
    """By what legends call the `shown_model` of a study."""
    return MODELS[shown_model(dataset)].words


def _curve_handles(dataset, lines, scale, many_places):
    """What the legend names of the lines of a study, but for what the scale tells."""
    name = model_name(dataset)
    lines = sorted(lines, key=lambda line: line.applicable)  # of two lines of one contact the last one is named
    several = any(len(line.runs) > 1 for line in lines)
    shape = {"ls": "-" if several or scale else "none"} | ({} if many_places else {"marker": MODEL_MARKERS[name]})
    materials = {line.labels.material: line.look for line in lines}
    places = {(line.labels.surface, line.labels.rms_slope): line.look for line in lines}
    handles = {}
    if not scale or (many_places and len(materials) > 1):
        for material, look in materials.items():
            grey = {"color": GREY, "mec": GREY} if many_places else {}
            handles[material_label(dataset, material)] = legend_handle(**look | shape | grey)
    if len(places) > 1 and not many_places:
        grey = {"ls": "none", "color": GREY, "mec": GREY, "mfc": "white", "ms": 5}
        for surface, slope in place_markers(places):
            handles[name_of_place(dataset, surface, slope)] = legend_handle(**places[surface, slope] | grey)
    return handles | {name: model_handle(name, mfc="white")}


def material_looks(campaign: xr.DataTree, study: str, lines: Sequence[Snapshots]) -> tuple[list[dict], Scale | None]:
    """Looks of the lines of a figure of one line for every material, and their scale where there are many."""
    dataset, scale = campaign[study].to_dataset(), None
    marker = MODEL_MARKERS[model_name(dataset)]
    materials = list(dict.fromkeys(line.labels.material for line in lines))
    if len(materials) > MOST_COLOURS:
        scale = materials_scale(dataset, materials)
        of_material = {
            name: {"color": colour, "ls": "-", "lw": 0.9, "marker": marker, "ms": 2}
            for name, colour in zip(materials, scale.colours, strict=True)
        }
    else:
        colours, layers = material_colours(campaign), material_layers(dataset, materials)
        shape = {"ls": "-", "marker": marker}
        of_material = {
            name: closed_look(colours[name], layers[name]) | shape | {"label": material_label(dataset, name)}
            for name in materials
        }
    looks = [of_material[line.labels.material] for line in lines]
    return [look if line.applicable else pale_look(look) for line, look in zip(lines, looks, strict=True)], scale


def say_which_snapshots(
    figure: Figure, panels: Sequence[Axes], dataset: xr.Dataset, lines: Sequence[Snapshots], scale: Scale | None
) -> None:
    """Letters and titles of the two panels of a figure of one snapshot, and its scale."""
    if scale:
        scale.draw(figure, list(panels))
    shown = lines[0].labels
    titles = (snapshot_label(*lines[-1].members[0]), name_of_place(dataset, shown.surface, shown.rms_slope))
    for axes, letter, title in zip(panels, "ab", titles, strict=True):
        axes.set_title(title, loc="right")
        panel_label(axes, letter)


def whose_theories(dataset: xr.Dataset) -> dict[str, Line2D]:
    """What the legend says of the surface that theories are drawn for, the first of a study where it has several."""
    names = dataset["surface"].values.tolist()
    return words_handle(f"theories: {names[0]}") if len(names) > 1 else {}


def draw_line(
    axes: Axes,
    line: Line,
    points: Callable[[xr.Dataset], tuple[np.ndarray, np.ndarray]],
    *,
    logarithmic: bool,
    lines: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Draw the points of a run by markers; of several seeds their mean at common loads by a line, and their scatter.

    Parameters
    ----------
    points : load and value of the steps of a run.
    lines : number of lines in the panel.
    logarithmic : whether values are positive on a logarithmic axis.

    Returns
    -------
    What was drawn: loads and values.
    """
    from icha.analysis.common_loads import at_common_loads

    members = [points(run) for run in line.runs]
    if len(members) > 1:
        load, values = at_common_loads(members, logarithmic=logarithmic)
        if len(load):
            draw_members(axes, load, values, line.look, positive=logarithmic, lines=lines, asked=line.asked)
            return np.tile(load, len(values)), values.ravel()
    # Runs without a common load have no mean.
    for load, values in members:
        axes.plot(load, values, **line.look)
        if len(members) < line.asked:
            mark_fewer(axes, load, values, np.isfinite(values)[None], line.look, line.asked)
    load, values = map(np.concatenate, zip(*members, strict=True))
    return load, values


def draw_crosses(
    axes: Axes, line: Line, points: Callable[[xr.Dataset], tuple[np.ndarray, np.ndarray]], *, logarithmic: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Draw the points of a line by boundary elements, of several seeds their means at common loads; returns these.

    `points` and `logarithmic` as for `draw_line`.
    """
    from icha.analysis.common_loads import at_common_loads

    load, values = at_common_loads([points(run) for run in line.runs], logarithmic=logarithmic)
    mean = values.mean(axis=0)
    axes.plot(load, mean, **line.look)
    mark_fewer(axes, load, mean, np.isfinite(values), line.look, line.asked)
    return load, mean


def draw_ways_back(panels: Iterable[tuple[Axes, Callable]], line: Line) -> None:
    """Draw the ways back of a line's runs, or of several seeds their means at common separations.

    `panels` are axes, and load and value of a way as functions of its reduced pressure, contact area and reduced
    separation.
    """
    from icha.analysis.common_loads import at_common_displacements

    ways = [
        (leg["reduced_pressure"].values, leg["contact_area_fraction"].values, leg["reduced_separation"].values)
        for leg in line.back[0]
    ]
    if len(line.runs) > 1 and len({len(back) for back in line.back}) == 1:
        ways = []
        for legs in zip(*line.back, strict=True):
            separation, found = at_common_displacements(legs)
            pressure, area = (found[name].mean(axis=0) for name in ("reduced_pressure", "contact_area_fraction"))
            ways.append((pressure, area, separation))
    for axes, points in panels:
        for way in ways:
            draw_unloading(axes, *points(*way), line.look["mec"])


def draw_unloading(axes: Axes, load: np.ndarray, values: np.ndarray, colour: str) -> None:
    """Draw one way back of a run on logarithmic axes of load, where it is compressive; the axes keep their range."""
    # Just before separation loads are as small as can be.
    axes.add_artist(line_artist(np.where(load > 0, load, np.nan), values, color=colour, **UNLOADING))


def add_legend(figure: Figure, panels: Sequence[Axes], curves: Curves, further: Mapping[str, Line2D] = {}) -> None:
    """Add the legend of the curves and of what else is named in the panels, and their scale of colours, if any."""
    if curves.scale:
        curves.scale.draw(figure, list(panels))
    seeds = lines_handles(len(line.runs) for line in curves.lines)
    legend_below(figure, curves.handles | seeds | named_handles(panels) | dict(further))


def plausible(values: np.ndarray) -> np.ndarray:
    """The positive ones of some values that are no rounding errors beside the largest, for logarithmic axes."""
    return values[values > _ROUNDING * values.max(initial=0.0)]


_ROUNDING = 1e-7
