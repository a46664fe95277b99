"""Curves of a study against load: means over the seeds, boundary elements beside them, unloading, legends."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import MODELS
from icha.datasets.labels import RunLabels
from icha.datasets.variables.model_error import SHORT_RANGE
from icha.figures.ensembles import draw_members, lines_handles, mark_fewer
from icha.figures.hysteresis import mean_legs
from icha.figures.legends import legend_below, model_handle, named_handles, words_handle
from icha.figures.looks import (
    ASPERITIES_NAME,
    BESIDE_LINE,
    BRANCH_DASHES,
    FEW_LINES,
    MODEL_MARKERS,
    Contact,
    Looks,
)
from icha.figures.select import (
    Snapshots,
    group_by_contact,
    name_of_place,
    path_steps,
    runs_by_boundary_elements,
    shown_model,
    snapshot_label,
    study_runs,
    unloading_legs,
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

UNLOADING = {"ls": BRANCH_DASHES["unloading"], "lw": 0.7, "zorder": 2.2}


def gap_label(data: xr.Dataset) -> str:
    """What the mean gap of runs is called: of periodic surfaces the mean separation, of free squares not."""
    return GAP_LABEL if (data["boundary"] == "free").any() else SEPARATION_LABEL


class Curve(NamedTuple):
    """A line of the runs of one contact.

    Attributes
    ----------
    labels : labels of the first run.
    runs : the steps of each run at the targets of its study, by seed.
    unloading : the legs of each run that unload.
    look : arguments of `Axes.plot` for its markers.
    asked : number of seeds asked for.
    """

    labels: RunLabels
    runs: dict[int, xr.Dataset]
    unloading: list[list[xr.Dataset]]
    look: dict
    asked: int

    @property
    def contact(self) -> Contact:
        """Material, surface and rms slope."""
        return self.labels.material, self.labels.surface, self.labels.rms_slope


class Curves(NamedTuple):
    """The lines of a study.

    Attributes
    ----------
    lines : the lines of the study's `shown_model`.
    beside : if those are asperities, the lines of the same contacts by boundary elements, crosses.
    looks : colours and markers of the lines.
    handles : what the legend names of them: materials, surfaces and slopes as far as there are several, and models.
    """

    lines: list[Curve]
    beside: list[Curve]
    looks: Looks
    handles: dict[str, Line2D]

    @property
    def unloaded(self) -> bool:
        """Whether any run is unloaded."""
        return any(leg for line in self.lines for leg in line.unloading)


def study_curves(campaign: xr.DataTree, study: str, boundary_elements: str | None = None) -> Curves:
    """Return all runs of a study, and beside asperities the runs by boundary elements of this or another study."""
    groups = group_by_contact(campaign, study_runs(campaign, study, ragged=False))
    dataset = campaign[study].to_dataset()
    materials = dataset["material"].values.tolist()
    looks = Looks(
        campaign, dataset, sorted((each.contact for each in groups), key=lambda contact: materials.index(contact[0]))
    )
    name, lines = model_name(dataset), []
    for group in groups:
        look = looks.look(group.contact, applicable=group.applicable) | {"ls": "-" if looks.scale else "none"}
        if name != ASPERITIES_NAME:
            look |= {"marker": MODEL_MARKERS[name], "ms": look["ms"] + 2}
        lines.append(_curve(group, look, [unloading_legs(run) for run in group.runs.values()]))
    others = boundary_elements or (study if name == ASPERITIES_NAME else None)
    truths = group_by_contact(campaign, runs_by_boundary_elements(campaign, others)) if others else []
    beside = [_curve(truth, cross_look(looks, truth.contact), []) for truth in truths]
    changed = {"ls": "-" if looks.scale or any(len(line.runs) > 1 for line in lines) else "none"}
    changed |= {} if looks.many_places else {"marker": MODEL_MARKERS[name]}
    handles = looks.handles(**changed) | {name: model_handle(name, mfc="white")}
    return Curves(lines, beside, looks, handles | ({SHORT_RANGE: model_handle(SHORT_RANGE)} if beside else {}))


def _curve(group, look, unloading):
    stops = {seed: path_steps(run) for seed, run in group.runs.items()}
    return Curve(group.labels, stops, unloading, look, group.asked)


def cross_look(looks: Looks, contact: Contact, model: str = SHORT_RANGE) -> dict:
    """Return the look of boundary elements among curves: crosses in the colour of the contact or of its material."""
    colour, adhesive = looks.colour(contact), looks.adhesive(contact[0])
    # The larger ones show behind the others if the results agree, as the markers of asperities do.
    size = (8 if adhesive else 11) * (1 if len(looks.contacts) <= FEW_LINES else 0.7)
    look = {"color": colour, "mec": colour, "ms": size, "zorder": 6 + adhesive}
    return look | {"ls": "none", "marker": MODEL_MARKERS[model], "mew": 1.0}


def model_name(dataset: xr.Dataset) -> str:
    """Return the name in legends of the `shown_model` of a study."""
    return MODELS[shown_model(dataset)].words


def snapshot_looks(campaign: xr.DataTree, study: str, lines: Sequence[Snapshots]) -> tuple[list[dict], Looks]:
    """Return the looks of the lines of a figure of one line for every material."""
    dataset = campaign[study].to_dataset()
    groups = [line.runs for line in lines]
    looks = Looks(campaign, dataset, [group.contact for group in groups])
    shape = {"ls": "-", "marker": MODEL_MARKERS[model_name(dataset)]}
    return [looks.look(group.contact, applicable=group.applicable) | shape for group in groups], looks


def add_snapshot_legend(
    figure: Figure,
    panels: Sequence[Axes],
    dataset: xr.Dataset,
    lines: Sequence[Snapshots],
    looks: Looks,
    beside: Iterable[str],
) -> None:
    """Add titles and legend of a figure of one snapshot of a study; `beside` names the boundary elements in it."""
    shown, model = lines[0].runs.labels, model_name(dataset)
    titles = (snapshot_label(*lines[-1].members[0]), name_of_place(dataset, shown.surface, shown.rms_slope))
    for axes, title in zip(panels, titles, strict=True):
        axes.set_title(title, loc="right")
    handles = looks.handles(ls="-", marker=MODEL_MARKERS[model])
    handles |= {model: model_handle(model, ls="-", lw=0.8, mfc="white")}
    handles |= {name: model_handle(name, **BESIDE_LINE) for name in beside}
    handles |= lines_handles(len(line.members) for line in lines) | named_handles(panels[1:])
    legend_below(figure, handles, scale=looks.scale, panels=panels)


def whose_theories(dataset: xr.Dataset) -> dict[str, Line2D]:
    """What the legend says of the surface that theories are drawn for, the first of a study where it has several."""
    names = dataset["surface"].values.tolist()
    return words_handle(f"theories: {names[0]}") if len(names) > 1 else {}


# Load and value of the steps of a run.
Points = Callable[["xr.Dataset"], tuple[np.ndarray, np.ndarray]]


def area_points(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return reduced pressures and contact area fractions of the steps of a run."""
    return run["reduced_pressure"].values, run["contact_area_fraction"].values


def gap_points(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return reduced pressures and reduced separations of the steps of a run."""
    return run["reduced_pressure"].values, run["reduced_separation"].values


def draw_curves(
    curves: Curves, panels: Mapping[Axes, Points], *, unloading: bool = False
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Draw the lines of a study, and boundary elements beside them, on double logarithmic axes.

    Parameters
    ----------
    curves : the lines.
    panels : the points that a panel shows.
    unloading : whether unloading is drawn as well.

    Returns
    -------
    Loads and values that were drawn in each of the panels.
    """
    drawn = {axes: [] for axes in panels}
    for line in curves.lines:
        for axes, points in panels.items():
            drawn[axes].append(_draw_line(axes, line, points, lines=len(curves.lines)))
        if unloading:
            _draw_unloading(panels, line)
    for line in curves.beside:
        for axes, points in panels.items():
            drawn[axes].append(_draw_crosses(axes, line, points))
    for axes in panels:
        logarithmic_axes(axes)
    return [tuple(map(np.concatenate, zip(*own, strict=True))) for own in drawn.values()]


def _draw_line(axes, line, points, *, lines):
    """Draw a run by markers; of several seeds their mean at common loads by a line, and their scatter."""
    from icha.analysis.common_loads import at_common_loads

    members = [points(run) for run in line.runs.values()]
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

    load, values = at_common_loads([points(run) for run in line.runs.values()], logarithmic=True)
    mean = values.mean(axis=0)
    axes.plot(load, mean, **line.look)
    mark_fewer(axes, load, mean, np.isfinite(values), line.look, line.asked)
    return load, mean


def _draw_unloading(panels, line):
    """Draw the unloading of a line's runs, or of several seeds its mean, while the load is compressive.

    The axes keep their range.
    """
    import xarray as xr

    slope = next(iter(line.runs.values()))["rms_slope"]
    for leg in mean_legs([[("unloading", leg) for leg in legs] for legs in line.unloading]):
        states = xr.Dataset({name: ("step", values) for name, values in leg.values.items()}).assign(rms_slope=slope)
        for axes, points in panels.items():
            load, values = points(states)
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
