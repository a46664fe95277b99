"""Draw curves of a study against load: means over the seeds, boundary elements, unloading, and a legend."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import MODELS, REFERENCE_MODEL
from icha.datasets.labels import slopes_of
from icha.datasets.quantities import label_of
from icha.figures import select
from icha.figures.captions import attractions_of, range_of_attraction
from icha.figures.drawn import plot, record, say
from icha.figures.ensembles import draw_members, lines_handles, mark_fewer
from icha.figures.looks import (
    ASPERITIES_NAME,
    BRANCH_DASHES,
    CROSSES,
    FEW_LINES,
    MODEL_MARKERS,
    REFERENCE_NAME,
    TRUTH_LINE,
    Contact,
    Looks,
    legend_below,
    model_handle,
    named_handles,
)
from icha.figures.style import GREY, legend_handle, logarithmic_axes, slope_label
from icha.support.formatting import choose_unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_UNLOADING = {"ls": BRANCH_DASHES["unloading"], "lw": 0.7, "zorder": 2.2}


def gap_name(data: xr.Dataset) -> str:
    """Return the name of the mean gap, or of the mean separation if all surfaces are periodic."""
    return "reduced_gap" if (data["boundary"] == "free").any() else "reduced_separation"


# Type of a function that returns the loads and the values of all steps of a run.
Points = Callable[["xr.Dataset"], tuple[np.ndarray, np.ndarray]]


class Curve(NamedTuple):
    """The runs of one material, surface and rms slope against load.

    Attributes
    ----------
    runs : the runs.
    stops : for each seed, the steps of the run at targets of the study.
    look : arguments of `Axes.plot` for the markers.
    """

    runs: select.ContactRuns
    stops: dict[int, xr.Dataset]
    look: dict


class Curves(NamedTuple):
    """The curves of a study.

    Attributes
    ----------
    lines : curves of the model that figures of the study show (`shown_model`).
    crosses : curves of boundary elements that are drawn in addition to `lines`; may be empty.
    looks : colours and markers of the lines.
    handles : legend entries by name: materials, surfaces, slopes and models.
    """

    lines: list[Curve]
    crosses: list[Curve]
    looks: Looks
    handles: dict[str, Line2D]


def study_curves(
    campaign: xr.DataTree,
    study: str,
    boundary_elements: str | None = None,
    *,
    points: Points | None = None,
    **changed: object,
) -> Curves:
    """Return the curves of a study, with boundary elements of the same study or of the study `boundary_elements`.

    Curves without `points` are left out, if this function is given. `changed` are arguments of `Axes.plot` that replace
    the usual arguments of all markers.
    """

    def has_points(group):
        return points is None or any(len(points(select.path_steps(run))[0]) for run in group.by_seed.values())

    groups = select.group_by_contact(campaign, select.select_runs(campaign, study, ragged=False))
    groups = list(filter(has_points, groups)) or groups
    dataset = campaign[study].to_dataset()
    name, lines = model_name(dataset), []
    other = boundary_elements or (study if name == ASPERITIES_NAME else None)
    truths = select.select_runs(campaign, other, ragged=False, model=REFERENCE_MODEL) if other else []
    grouped = list(filter(has_points, select.group_by_contact(campaign, truths)))
    materials = dataset["material"].values.tolist()
    contacts = sorted((group.contact for group in groups), key=lambda contact: materials.index(contact[0]))
    looks = Looks(campaign, dataset, contacts, crosses=bool(grouped) or name != ASPERITIES_NAME)
    for group in groups:
        look = looks.look(group.contact, applicable=group.applicable) | {"ls": "-" if looks.many else "none"} | changed
        if name != ASPERITIES_NAME:
            look |= {"marker": cross_look(looks, group.contact, group.model_name)["marker"], "ms": look["ms"] + 2}
        lines.append(_curve(group, look))
    crosses = [_curve(truth, cross_look(looks, truth.contact, truth.model_name)) for truth in grouped]
    changed |= {"ls": "-" if looks.many or any(len(group.by_seed) > 1 for group in groups) else "none"}
    if len(looks.materials if looks.by_place else looks.places) == 1:
        changed |= {} if looks.by_place else {"marker": MODEL_MARKERS[groups[0].model_name]}
        handles = looks.handles(**changed)
        handles |= {group.model_name: model_handle(group.model_name, **looks.fill()) for group in groups}
        handles |= {truth.model_name: model_handle(truth.model_name) for truth in grouped}
    else:
        # A shape shows the model and, for example, the slope. Colours therefore have legend entries without a shape.
        handles = looks.colour_handles()
        for curve in (*lines, *crosses):
            model = curve.runs.model_name
            words = f"{model}, {looks.shape_name(curve.runs.contact)}"
            filled = looks.by_place and curve.look.get("mfc") == curve.look["color"]
            look = {"mfc": GREY if filled else "white", "marker": curve.look["marker"]}
            handles.setdefault(words, model_handle(model, **look))
    return Curves(lines, crosses, looks, handles)


def _curve(runs, look):
    return Curve(runs, {seed: select.path_steps(run) for seed, run in runs.by_seed.items()}, look)


def cross_look(looks: Looks, contact: Contact, model: str = REFERENCE_NAME, shape: str | None = None) -> dict:
    """Return arguments of `Axes.plot` for boundary elements: crosses in the colour of the material or surface.

    `shape` is the marker of the first surface and slope, if it is not the usual one.
    """
    colour, adhesive = looks.colour(contact), looks.adhesive(contact[0])
    # Crosses without adhesion are larger than crosses with adhesion, so that both are visible if they coincide.
    size = (8 if adhesive else 11) * (1 if len(looks.contacts) <= FEW_LINES else 0.7)
    look = {"color": colour, "mec": colour, "ms": size, "zorder": 6 + adhesive}
    rank = looks.rank(contact) if model == REFERENCE_NAME else 0
    marker = CROSSES[rank % len(CROSSES)] if rank else shape or MODEL_MARKERS[model]
    return look | {"ls": "none", "marker": marker, "mew": 1.0}


def model_name(dataset: xr.Dataset) -> str:
    """Return the legend name of the model that figures of a study show (`shown_model`)."""
    return MODELS[select.shown_model(dataset)].words


def snapshot_looks(campaign: xr.DataTree, study: str, lines: Sequence[select.Snapshots]) -> tuple[list[dict], Looks]:
    """Return the arguments of `Axes.plot` for each line in a figure of one snapshot, and the `Looks` of the figure."""
    dataset = campaign[study].to_dataset()
    groups = [line.runs for line in lines]
    looks = Looks(campaign, dataset, [group.contact for group in groups])
    shape = {"ls": "-", "marker": MODEL_MARKERS[model_name(dataset)]}
    return [looks.look(group.contact, applicable=group.applicable) | shape for group in groups], looks


def _topographies(counts):
    """Return words for the topographies of boundary elements; `counts` has the seeds of both models, for each curve."""
    if fewer := sorted({truths for asperities, truths in counts if truths != asperities}):
        seeds = " or ".join(map(str, fewer))
        return f"on {seeds} of the topographies alone, so their means also differ by the seeds"
    return "on the same topographies"


def say_snapshot_models(figure: Figure, lines: Sequence[select.Snapshots], beside: str) -> None:
    """Explain the lines of the models in a figure of one snapshot; `beside` names the lines beside asperities."""
    model = lines[0].runs.model_name
    if model == ASPERITIES_NAME:
        bare = not all(line.runs.surface_energy for line in lines)
        say(figure, "Solid lines with circles are results of the asperity model.")
        say(figure, "Open circles are results without adhesion." if bare else "")
    else:
        say(figure, "Solid lines with crosses are results of boundary elements.")
    if any(line.truths for line in lines):
        counts = [(len(line.members), len(line.truths)) for line in lines if line.truths]
        say(figure, f"{beside} are boundary elements, {_topographies(counts)}.")
    runs = (run for line in lines for run, _ in (*line.members, *line.truths))
    say(figure, range_of_attraction(attractions_of(runs)))


def add_snapshot_legend(
    figure: Figure, panels: Sequence[Axes], dataset: xr.Dataset, lines: Sequence[select.Snapshots], looks: Looks
) -> None:
    """Add the titles and the legend to a figure of one snapshot of a study."""
    shown, model = lines[0].runs.labels, model_name(dataset)
    several = {shown.surface: dataset.sizes["surface"] > 1, slope_label(shown.rms_slope): len(slopes_of(dataset)) > 1}
    place = ", ".join(words for words, needed in several.items() if needed)
    panels[-1].set_title(place, loc="right")
    state = select.snapshot_label(*lines[-1].members[0])
    panels[0].set_title(state if len(panels) > 1 else ", ".join(filter(None, (place, state))), loc="right")
    handles = looks.handles(ls="-", marker=MODEL_MARKERS[model])
    handles |= {model: model_handle(model, ls="-", lw=0.8, **looks.fill())}
    if any(line.truths for line in lines):
        handles[REFERENCE_NAME] = model_handle(REFERENCE_NAME, **TRUTH_LINE)
    handles |= lines_handles(figure, [len(line.members) for line in lines]) | named_handles(panels[1:])
    legend_below(figure, handles)


def area_points(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return reduced pressures and contact area fractions of the steps of a run."""
    return run["reduced_pressure"].values, run["contact_area_fraction"].values


def ratio_points(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return reduced pressures of the steps with positive load, and contact area fractions divided by them."""
    pressure, area = area_points(run)
    pressed = pressure > 0
    return pressure[pressed], area[pressed] / pressure[pressed]


def gap_points(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return reduced pressures and reduced separations of the steps of a run."""
    return run["reduced_pressure"].values, run["reduced_separation"].values


def limit_ratios(axes: Axes, ratios: np.ndarray) -> None:
    """Set the limits of an axis of area over load; the axis is logarithmic if the ratios span more than `_SPAN`."""
    low, high = ratios.min(), ratios.max()
    if high > _SPAN * low:
        axes.set_ylim(0.7 * low, 1.4 * high)
    else:
        axes.set_yscale("linear")
        axes.set_ylim(low - 0.25 * (high - low), high + 0.15 * (high - low))


# Largest ratio of the ends of a linear axis of area over load.
_SPAN = 5.0


class Axis(NamedTuple):
    """Unit of an axis: the label, and the factor by which a figure multiplies the values of a run in SI units."""

    label: str
    factor: float


def physical_units(dataset: xr.Dataset, gap_name: str = "mean_gap") -> tuple[Axis, Axis]:
    """Return the axes of nominal pressure and mean gap, or mean separation, in units with prefixes, for a study."""
    (pressure, pressure_unit), (gap, gap_unit) = (
        choose_unit(float(np.abs(dataset[name]).max()), unit)
        for name, unit in (("nominal_pressure", "Pa"), (gap_name, "m"))
    )
    return Axis(label_of("nominal_pressure", pressure_unit), pressure), Axis(label_of(gap_name, gap_unit), gap)


def physical_points(name: str, pressure: Axis, factor: float = 1.0) -> Points:
    """Return the function that returns nominal pressures, in the unit of an axis, and a variable times a factor."""

    def points(run):
        return run["nominal_pressure"].values * pressure.factor, run[name].values * factor

    return points


def draw_curves(
    curves: Curves, panels: Mapping[Axes, Points], *, unloading: bool = False, count: int | None = None
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Draw the curves of a study on double logarithmic axes.

    Parameters
    ----------
    curves : the curves.
    panels : for each panel, the function that returns the points of a run.
    unloading : True to draw unloading as well.
    count : number of curves in the figure, if there are more than these.

    Returns
    -------
    For each panel, loads and values of all points of loading.
    """
    drawn = {axes: [] for axes in panels}
    for line in curves.lines:
        for axes, points in panels.items():
            drawn[axes].append(_draw_line(axes, line, points, count or len(curves.lines)))
        if unloading:
            _draw_unloading(panels, line)
    for line in curves.crosses:
        for axes, points in panels.items():
            drawn[axes].append(_draw_crosses(axes, line, points))
    for axes in panels:
        logarithmic_axes(axes)
    return [tuple(map(np.concatenate, zip(*points, strict=True))) for points in drawn.values()]


def _draw_line(axes, line, points, count):
    """Draw a single run with markers; for several seeds, draw the mean at common loads and the scatter."""
    from icha.analysis.common_loads import at_common_loads

    members, asked = [points(run) for run in line.stops.values()], line.runs.asked
    if len(members) > 1:
        load, values = at_common_loads(members, logarithmic=True)
        if len(load):
            name = line.runs.drawn_name
            drawn = draw_members(axes, load, values, line.look, positive=True, name=name, asked=asked, curves=count)
            return np.tile(load, len(drawn)), drawn.ravel()
    # A single run, or several runs without a mean, because these runs have no load in common.
    for (load, values), name in zip(members, line.runs.names_of_seeds.values(), strict=True):
        plot(axes, load, values, name, **line.look)
        if len(members) < asked:
            mark_fewer(axes, load, values, np.isfinite(values)[None], line.look, asked)
    return tuple(map(np.concatenate, zip(*members, strict=True)))


def _draw_crosses(axes, line, points):
    """Draw a curve of boundary elements as crosses; for several seeds, draw the mean over the seeds at common loads."""
    from icha.analysis.common_loads import at_common_loads

    load, values = at_common_loads([points(run) for run in line.stops.values()], logarithmic=True)
    mean = values.mean(axis=0)
    record(axes, load, mean, line.runs.drawn_name, seeds=len(values))
    axes.plot(load, mean, **line.look)
    mark_fewer(axes, load, mean, np.isfinite(values), line.look, line.runs.asked)
    return load, mean


def _draw_unloading(panels, line):
    """For every run of a line, draw the unloading at compressive loads; the limits of the axes do not change."""
    names = line.runs.names_of_seeds
    for name, leg in [(names[k], leg) for k, run in line.runs.by_seed.items() for leg in select.unloading_legs(run)]:
        for axes, points in panels.items():
            load, values = points(leg)
            record(axes, load, values, name._replace(curve=f"{name.curve}, unloading"))
            # Loads just before separation are arbitrarily small, so the line must not affect the limits of the axes.
            pressed = np.where(load > 0, load, np.nan)
            axes.add_artist(legend_handle(pressed, values, color=line.look["mec"], **_UNLOADING))
            axes.plot([], [], color=GREY, label="unloading", **_UNLOADING)
            say(axes, "Thin dashed lines show unloading at compressive loads, for every seed.")


def say_models(figure: Figure, curves: Curves, where: str = "", *, stars: str = "Crosses and stars") -> None:
    """Explain the symbols of the models in the caption, such as circles of the asperity model `where` in loading."""
    groups = [curve.runs for curve in (*curves.lines, *curves.crosses)]
    models = dict.fromkeys(group.model_name for group in groups)
    several = {model: any(name.startswith(f"{model}, ") for name in curves.handles) for model in models}
    if ASPERITIES_NAME in models:
        shapes = "Circles and other shapes" if several[ASPERITIES_NAME] else "Circles"
        say(figure, f"{shapes} are the asperity model{where}.")
    if REFERENCE_NAME in models:
        shapes = stars if several[REFERENCE_NAME] else "Crosses"
        of_asperities = {curve.runs.contact: len(curve.runs.by_seed) for curve in curves.lines}
        counts = [(of_asperities.get(curve.runs.contact, 0), len(curve.runs.by_seed)) for curve in curves.crosses]
        beside = f", {_topographies(counts)}" if counts else ""
        say(figure, f"{shapes} are boundary elements{where}{beside}.")
    if select.FINITE_RANGE_NAME in models:
        say(figure, f"Crosses with three arms are boundary elements at a finite range{where}.")
    runs = (run for group in groups for run in group.by_seed.values())
    say(figure, range_of_attraction(attractions_of(runs)))


def add_legend(figure: Figure, panels: Sequence[Axes], curves: Curves) -> None:
    """Add a legend of the curves, and of everything that has a label in the panels."""
    seeds = lines_handles(figure, [len(line.runs.by_seed) for line in curves.lines])
    handles = curves.handles | seeds | named_handles(panels)
    legend_below(figure, handles, rows=curves.looks.slopes_per_surface)


def drop_rounding_errors(values: np.ndarray) -> np.ndarray:
    """Return only the values that are larger than rounding errors, for a logarithmic axis."""
    return values[values > _ROUNDING * values.max(initial=0.0)]


# A value counts as a rounding error if it is at most this fraction of the largest value.
_ROUNDING = 1e-7
