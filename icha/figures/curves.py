"""Curves of a study against load: the same look for the same contact in every figure, means over seeds, legends."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import MODELS
from icha.datasets.labels import RunLabels
from icha.datasets.variables.model_error import SHORT_RANGE
from icha.figures.ensembles import draw_members, lines_handles, mark_fewer
from icha.figures.looks import (
    ASPERITIES_NAME,
    BESIDE_LINE,
    FEW_LINES,
    MODEL_MARKERS,
    Looks,
    legend_below,
    model_handle,
    named_handles,
    words_handle,
)
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
from icha.figures.style import line_artist, logarithmic_axes

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
    """The lines of a study.

    Parameters
    ----------
    lines : the lines of the study's first model.
    beside : if those are asperities, the lines of the same contacts by boundary elements, crosses.
    looks : colours and markers of the lines.
    handles : what the legend names of them: materials, surfaces and slopes as far as there are several, and models.
    """

    lines: list[Line]
    beside: list[Line]
    looks: Looks
    handles: dict[str, Line2D]

    @property
    def unloaded(self) -> bool:
        """Whether there are ways back."""
        return any(way for line in self.lines for way in line.back)


def study_curves(campaign: xr.DataTree, study: str, boundary_elements: str | None = None) -> Curves:
    """All runs of a study, and beside asperities its runs by boundary elements, or those of the study of that name."""
    members = _by_contact(study_runs(campaign, study, ragged=False))
    dataset = campaign[study].to_dataset()
    looks = Looks(campaign, dataset, _in_order_of_materials(dataset, [contact for *contact, _ in members]))
    name, lines = model_name(dataset), []
    for (*contact, applicable), own in members.items():
        (first, *_), runs = zip(*own, strict=True)
        look = looks.look(tuple(contact), applicable=applicable) | {"ls": "-" if looks.scale else "none"}
        if name != ASPERITIES_NAME:
            look |= {"marker": MODEL_MARKERS[name], "ms": look["ms"] + 2}
        stops, back = [path_steps(run) for run in runs], [ways_back(run) for run in runs]
        lines.append(Line(first, stops, back, look, asked_seeds(dataset, first), applicable))
    others = boundary_elements or (study if name == ASPERITIES_NAME else None)
    beside = _crosses(campaign, others, looks) if others else []
    changed = {"ls": "-" if looks.scale or any(len(line.runs) > 1 for line in lines) else "none"}
    changed |= {} if looks.many_places else {"marker": MODEL_MARKERS[name]}
    handles = looks.handles(**changed) | {name: model_handle(name, mfc="white")}
    return Curves(lines, beside, looks, handles | ({SHORT_RANGE: model_handle(SHORT_RANGE)} if beside else {}))


def _in_order_of_materials(dataset, contacts):
    """Contacts in the order in which a study names their materials."""
    names = dataset["material"].values.tolist()
    return sorted(map(tuple, contacts), key=lambda contact: names.index(contact[0]))


def _by_contact(runs):
    """Labels and runs of the seeds of every material, surface and slope, apart where the model is not applicable."""
    members: dict[tuple, list] = {}
    for labels, run in runs:
        key = labels.material, labels.surface, labels.rms_slope, is_applicable(run)
        members.setdefault(key, []).append((labels, run))
    return members


def _crosses(campaign, study, looks):
    """The lines of a study by boundary elements, in the colours of others of the same contacts, or of the material."""
    dataset, found = campaign[study].to_dataset(), []
    energy = dataset["surface_energy"]
    for (*contact, applicable), own in _by_contact(runs_by_boundary_elements(campaign, study)).items():
        (first, *_), runs = zip(*own, strict=True)
        adhesive, colour = float(energy.sel(material=first.material)) > 0, looks.colour(tuple(contact))
        # The larger ones show behind the others where the results agree, as the markers of asperities do.
        size = (8 if adhesive else 11) * (1 if len(looks.contacts) <= FEW_LINES else 0.7)
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


def snapshot_looks(campaign: xr.DataTree, study: str, lines: Sequence[Snapshots]) -> tuple[list[dict], Looks]:
    """Looks of the lines of a figure of one line for every material."""
    dataset = campaign[study].to_dataset()
    contacts = [(line.labels.material, line.labels.surface, line.labels.rms_slope) for line in lines]
    looks = Looks(campaign, dataset, contacts)
    shape = {"ls": "-", "marker": MODEL_MARKERS[model_name(dataset)]}
    return [
        looks.look(contact, applicable=line.applicable) | shape for contact, line in zip(contacts, lines, strict=True)
    ], looks


def add_snapshot_legend(
    figure: Figure,
    panels: Sequence[Axes],
    dataset: xr.Dataset,
    lines: Sequence[Snapshots],
    looks: Looks,
    beside: Iterable[str],
) -> None:
    """Add titles and legend of a figure of one snapshot of a study; `beside` names the boundary elements in it."""
    shown, own = lines[0].labels, model_name(dataset)
    titles = (snapshot_label(*lines[-1].members[0]), name_of_place(dataset, shown.surface, shown.rms_slope))
    for axes, title in zip(panels, titles, strict=True):
        axes.set_title(title, loc="right")
    handles = looks.handles(ls="-", marker=MODEL_MARKERS[own]) | {own: model_handle(own, ls="-", lw=0.8, mfc="white")}
    handles |= {name: model_handle(name, **BESIDE_LINE) for name in beside}
    handles |= lines_handles(len(line.members) for line in lines) | named_handles(panels[1:])
    legend_below(figure, handles, scale=looks.scale, panels=panels)


def whose_theories(dataset: xr.Dataset) -> dict[str, Line2D]:
    """What the legend says of the surface that theories are drawn for, the first of a study where it has several."""
    names = dataset["surface"].values.tolist()
    return words_handle(f"theories: {names[0]}") if len(names) > 1 else {}


# Load and value of the steps of a run.
Points = Callable[["xr.Dataset"], tuple[np.ndarray, np.ndarray]]


def draw_curves(
    curves: Curves, panels: Mapping[Axes, Points], *, back: Mapping[Axes, Callable] = {}
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Draw the lines of a study, and boundary elements beside them, on double logarithmic axes.

    Parameters
    ----------
    curves : the lines.
    panels : the points that a panel shows.
    back : load and value of a way back in a panel, as `_draw_ways_back` has them.

    Returns
    -------
    Loads and values that were drawn in each of the panels.
    """
    drawn = {axes: [] for axes in panels}
    for line in curves.lines:
        for axes, points in panels.items():
            drawn[axes].append(_draw_line(axes, line, points, lines=len(curves.lines)))
        _draw_ways_back(back, line)
    for line in curves.beside:
        for axes, points in panels.items():
            drawn[axes].append(_draw_crosses(axes, line, points))
    for axes in panels:
        logarithmic_axes(axes)
    return [tuple(map(np.concatenate, zip(*own, strict=True))) for own in drawn.values()]


def _draw_line(axes, line, points, *, lines):
    """Draw a run by markers; of several seeds their mean at common loads by a line, and their scatter."""
    from icha.analysis.common_loads import at_common_loads

    members = [points(run) for run in line.runs]
    if len(members) > 1:
        load, values = at_common_loads(members, logarithmic=True)
        if len(load):
            draw_members(axes, load, values, line.look, positive=True, lines=lines, asked=line.asked)
            return np.tile(load, len(values)), values.ravel()
    # Runs without a common load have no mean.
    for load, values in members:
        axes.plot(load, values, **line.look)
        if len(members) < line.asked:
            mark_fewer(axes, load, values, np.isfinite(values)[None], line.look, line.asked)
    return tuple(map(np.concatenate, zip(*members, strict=True)))


def _draw_crosses(axes, line, points):
    """Draw a line by boundary elements; of several seeds their means at common loads."""
    from icha.analysis.common_loads import at_common_loads

    load, values = at_common_loads([points(run) for run in line.runs], logarithmic=True)
    mean = values.mean(axis=0)
    axes.plot(load, mean, **line.look)
    mark_fewer(axes, load, mean, np.isfinite(values), line.look, line.asked)
    return load, mean


def _draw_ways_back(panels, line):
    """Draw the ways back of a line's runs, or of several seeds their means at common separations.

    `panels` give of axes load and value of a way, functions of its reduced pressure, contact area and reduced
    separation, and of the rms slope. Loads are shown where they are compressive; the axes keep their range.
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
    slope = float(line.runs[0]["rms_slope"])
    for axes, points in panels.items():
        for way in ways:
            load, values = points(*way, slope)
            # Just before separation loads are as small as can be.
            pressed = np.where(load > 0, load, np.nan)
            axes.add_artist(line_artist(pressed, values, color=line.look["mec"], **UNLOADING))


def add_legend(figure: Figure, panels: Sequence[Axes], curves: Curves, further: Mapping[str, object] = {}) -> None:
    """Add the legend of the curves and of what else is named in the panels, and their scale of colours, if any."""
    seeds = lines_handles(len(line.runs) for line in curves.lines)
    handles = curves.handles | dict(further) | seeds | named_handles(panels)
    legend_below(figure, handles, scale=curves.looks.scale, panels=panels)


def plausible(values: np.ndarray) -> np.ndarray:
    """The positive ones of some values that are no rounding errors beside the largest, for logarithmic axes."""
    return values[values > _ROUNDING * values.max(initial=0.0)]


_ROUNDING = 1e-7
