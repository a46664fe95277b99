"""Curves of a study against load: means over the seeds, boundary elements, unloading, theories, and a legend."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from icha.analysis.common_loads import at_common_loads
from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.datasets.labels import has_contact
from icha.datasets.quantities import label_of, quantity
from icha.figures import select
from icha.figures.captions import about_boundary_elements
from icha.figures.drawn import Name, plot, record, say
from icha.figures.ensembles import draw_members, draw_points, mark_fewer
from icha.figures.looks import BRANCH_DASHES, MODEL_MARKERS, Looks, model_handle
from icha.figures.style import GREY, legend_handle, logarithmic_axes
from icha.support.formatting import choose_unit

_COMMON = """Means are at common loads. Between the targets of each seed, monotone cubic polynomials of the
logarithm of the load interpolate; states between the targets are not drawn on loading."""
_UNLOADING = {"ls": BRANCH_DASHES["unloading"], "lw": 0.7, "zorder": 2.2}
# A value counts as a rounding error if it is at most this fraction of the largest value.
_ROUNDING = 1e-7
# Loads below this part of the largest one of a leg count as separation.
_LEAST_LOAD = 1e-6
# Theories are drawn beyond the limits of the load axis by this factor.
_BEYOND = 1.5


class Panel(NamedTuple):
    """What a panel shows.

    Attributes
    ----------
    x, y : names of quantities of `quantity_of`.
    factors : factors that convert the values along x and y to the units of the axes.
    units : units of the axes; "" for numbers.
    """

    x: str
    y: str
    factors: tuple[float, float] = (1.0, 1.0)
    units: tuple[str, str] = ("", "")

    def points(self, states: xr.Dataset | Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Return x and y of the steps of a run, or of the states of a theory; states without a value are left out."""
        x, y = (factor * quantity_of(states, name) for name, factor in zip(self[:2], self.factors, strict=True))
        known = np.isfinite(x) & np.isfinite(y)
        return x[known], y[known]

    def label(self, axes: Axes, *, lowest: bool = True) -> None:
        """Label both axes; the x axis only of the `lowest` of several panels."""
        axes.set_ylabel(label_of(self.y, self.units[1]))
        if lowest:
            axes.set_xlabel(label_of(self.x, self.units[0]))


def panel_in_units(x: str, y: str, *data: xr.Dataset) -> Panel:
    """Return a panel in units with prefixes that fit the largest magnitudes in some datasets."""

    def scale(name):
        unit = quantity(name).unit
        most = max(float(np.abs(each[name]).max()) for each in data)
        return (1.0, "") if unit == "1" else choose_unit(most or 1.0, unit)

    factors, units = zip(scale(x), scale(y), strict=True)
    return Panel(x, y, factors, units)


def quantity_of(states: xr.Dataset | Mapping[str, np.ndarray], name: str) -> np.ndarray:
    """Return a quantity of all steps of a run; ratios are NaN unless load and stiffness are positive."""
    if name in states:
        return np.asarray(states[name], float)
    if name == "reduced_gap":  # theories are for periodic surfaces, whose gap is the separation
        return quantity_of(states, "reduced_separation")
    if name == "relative_load":
        return quantity_of(states, "reduced_pressure") * float(states["unit_slope"])
    if name == "reduced_stiffness":
        unit = float(states["contact_modulus"] * states["unit_slope"] / states["unit_height"])
        stiffness = quantity_of(states, "contact_stiffness") / unit
        return np.where((stiffness > 0) & (quantity_of(states, "reduced_pressure") > 0), stiffness, np.nan)
    above, below = {
        "area_over_load": ("contact_area_fraction", "reduced_pressure"),
        "area_over_relative_load": ("contact_area_fraction", "relative_load"),
        "stiffness_over_pressure": ("reduced_stiffness", "reduced_pressure"),
    }[name]
    load = quantity_of(states, below)
    return quantity_of(states, above) / np.where(load > 0, load, np.nan)


def gap_name(data: xr.Dataset) -> str:
    """Return the name of the mean gap, or of the mean separation if all surfaces are periodic."""
    return "reduced_gap" if (data["boundary"] == "free").any() else "reduced_separation"


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
    panel: Panel | None = None,
    open_markers: bool = False,
) -> Curves:
    """Return the curves of a study, with boundary elements of the same study or of the study `boundary_elements`.

    Boundary elements on other surfaces, slopes or materials than those of the study are left out, and so are curves
    without points in the `panel`, if it is given. `open_markers` do not hide each other where curves coincide; if
    colours distinguish surfaces and slopes, markers are closed for materials with adhesion.
    """

    def has_points(group):
        return panel is None or any(len(panel.points(select.path_steps(run))[0]) for run in group.by_seed.values())

    groups = select.group_by_contact(campaign, select.select_runs(campaign, study, ragged=False))
    groups = list(filter(has_points, groups)) or groups
    dataset = campaign[study].to_dataset()
    by_asperities, lines = groups[0].labels.model == DEFAULT_MODEL, []
    other = boundary_elements or (study if by_asperities else None)
    truths = select.select_runs(campaign, other, ragged=False, model=REFERENCE_MODEL) if other else []
    truths = [(labels, run) for labels, run in truths if has_contact(dataset, labels)]
    grouped = list(filter(has_points, select.group_by_contact(campaign, truths)))
    materials = dataset["material"].values.tolist()
    drawn = sorted((group.line for group in groups), key=lambda line: materials.index(line.material))
    looks = Looks(campaign, [study], drawn, crosses=bool(grouped) or not by_asperities)
    changed: dict[str, object] = {"mfc": "none"} if open_markers and not looks.by_place else {}
    for group in groups:
        look = looks.look(group.line) | {"ls": "-" if looks.many else "none"} | changed
        if not by_asperities:
            look |= {"marker": looks.cross(group.line, group.model_name)["marker"], "ms": look["ms"] + 2}
        lines.append(_curve(group, look))
    crosses = [_curve(truth, looks.cross(truth.line._replace(doubt=""), truth.model_name)) for truth in grouped]
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
            words = f"{model}, {looks.shape_name(curve.runs.line)}"
            filled = looks.by_place and curve.look.get("mfc") == curve.look["color"]
            look = {"mfc": GREY if filled else "white", "marker": curve.look["marker"]}
            handles.setdefault(words, model_handle(model, **look))
    return Curves(lines, crosses, looks, handles)


def _curve(runs, look):
    return Curve(runs, {seed: select.path_steps(run) for seed, run in runs.by_seed.items()}, look)


def drop_rounding_errors(values: np.ndarray) -> np.ndarray:
    """Return only the values that are larger than rounding errors, for a logarithmic axis."""
    return values[values > _ROUNDING * values.max(initial=0.0)]


def limit_ratios(axes: Axes, ratios: np.ndarray) -> None:
    """Set the limits of an axis of area over load; the axis is logarithmic if the ratios span more than `_SPAN`."""
    low, high = ratios.min(), ratios.max()
    if high > _SPAN * low:
        axes.set_ylim(0.7 * low, 1.4 * high)
    else:
        axes.set_yscale("linear")
        room = high - low or high
        axes.set_ylim(low - 0.25 * room, high + 0.15 * room)


# Largest ratio of the ends of a linear axis of area over load.
_SPAN = 5.0


def draw_curves(
    curves: Curves, panels: Mapping[Axes, Panel], *, unloading: bool = False
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Draw the curves of a study on double logarithmic axes; return loads and values of all points of loading."""
    drawn = []
    pairs = [(line.runs, cross.runs) for cross in curves.crosses for line in curves.lines]
    seeds = [[len(each.by_seed) for each in pair] for pair in pairs if pair[0].line.contact == pair[1].line.contact]
    runs = [run for curve in (*curves.lines, *curves.crosses) for run in curve.runs.by_seed.values()]
    say(
        next(iter(panels)),
        *(
            f"{axes.get_title('left')} {quantity(panel.y).name.capitalize()} against the {quantity(panel.x).name}."
            for axes, panel in panels.items()
        ),
        about_boundary_elements(runs, seeds),
    )
    for axes, panel in panels.items():
        points = [_draw_line(axes, line, panel, len(curves.lines)) for line in curves.lines]
        points += [_draw_crosses(axes, line, panel) for line in curves.crosses]
        drawn.append(tuple(map(np.concatenate, zip(*points, strict=True))))
        for line in curves.lines if unloading else ():
            _draw_unloading(axes, line, panel)
        logarithmic_axes(axes)
    return drawn


def _draw_line(axes, line, panel, count):
    """Draw a single run with markers; for several seeds, draw the mean at common loads and the scatter."""
    members, asked = [panel.points(run) for run in line.stops.values()], line.runs.asked
    if len(members) > 1:
        load, values = at_common_loads(members, logarithmic=True)
        if len(load):
            of_curve = {"name": line.runs.drawn_name, "asked": asked, "curves": count}
            drawn = draw_members(axes, load, values, line.look, positive=True, **of_curve)
            say(axes, _COMMON)
            return np.tile(load, len(drawn)), drawn.ravel()
    # A single run, or several runs without a mean, because these runs have no load in common.
    for (load, values), (labels, _) in zip(members, line.runs.members, strict=True):
        plot(axes, load, values, Name(line.runs.model_name, labels), **line.look)
        mark_fewer(axes, load, values, len(members), asked, line.look)
    return tuple(map(np.concatenate, zip(*members, strict=True)))


def _draw_crosses(axes, line, panel):
    """Draw a curve of boundary elements as crosses; for several seeds, draw the mean and bars at common loads."""
    load, values = at_common_loads([panel.points(run) for run in line.stops.values()], logarithmic=True)
    draw_points(axes, load, values, line.look, positive=True, name=line.runs.drawn_name, asked=line.runs.asked)
    say(axes, _COMMON if len(values) > 1 else "")
    return np.tile(load, len(values)), values.ravel()


def _draw_unloading(axes, line, panel):
    """For every run of a line, draw the unloading at compressive loads; the limits of the axes do not change."""
    for labels, leg in [(labels, leg) for labels, run in line.runs.members for leg in select.unloading_legs(run)]:
        load, values = panel.points(leg)
        pressed = load > _LEAST_LOAD * np.max(load, initial=0.0)
        load, values = load[pressed], values[pressed]
        record(axes, load, values, Name(f"{line.runs.model_name}, unloading", labels))
        # Loads just before separation are arbitrarily small, so the line must not affect the limits of the axes.
        axes.add_artist(legend_handle(load, values, color=line.look["mec"], **_UNLOADING))
        axes.plot([], [], color=GREY, label="unloading", **_UNLOADING)
        say(axes, "Thin dashed lines show unloading at compressive loads, for every seed that reaches it.")


def draw_theory(
    axes: Axes,
    panel: Panel,
    states: Mapping[str, np.ndarray],
    limits: Sequence[float],
    name: Name | str = "",
    **look: object,
) -> np.ndarray:
    """Draw the states of a theory near the `limits` of the load axis; return the values along y."""
    x, y = panel.points(states)
    inside = (x >= limits[0] / _BEYOND) & (x <= limits[1] * _BEYOND)
    plot(axes, x[inside], y[inside], name, **look)
    return y[inside]
