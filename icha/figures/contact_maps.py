"""Figures that are maps of one topography: contact spots (4, 6), jumps of spots (16), contact pressure (20)."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.collections import PatchCollection
from matplotlib.colors import LinearSegmentedColormap, TwoSlopeNorm, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle, Wedge
from matplotlib.ticker import MaxNLocator

from icha.analysis.model_error import contact_of_spots, jaccard, snapshot_if_any, state_of
from icha.contact.model import EVENT_KINDS
from icha.contact.models import REFERENCE_MODEL
from icha.datasets.campaign import find_snapshot, run_place, runs_with_labels, runs_with_snapshot
from icha.datasets.labels import RunLabels
from icha.datasets.quantities import label_of, plain
from icha.datasets.variables.campaign import LOADED_RUNS
from icha.figures import select
from icha.figures.captions import attractions_of, grid_of_loops, range_of_attraction
from icha.figures.drawn import Name, plot, record, say, show_runs
from icha.figures.looks import BRANCH_DASHES, REFERENCE_NAME, graded_colours, legend_below, run_label, some_of
from icha.figures.maps import (
    average_blocks,
    draw_map,
    draw_spots,
    record_spots,
    spot_circles,
    topography_of,
    without_images,
)
from icha.figures.style import (
    BLACK,
    BLUE,
    GREY,
    format_number,
    in_style,
    interfaces_of,
    legend_handle,
    material_labels,
    new_grid,
    new_panels,
    slope_label,
)
from icha.support.formatting import choose_unit, format_quantity

# Forces below this part of the largest one of a run are zero.
_NO_FORCE = 1e-6
# Colour of spots, and of events that break or separate spots.
_RED = (0.9, 0.0, 0.05)

# --- figure 4 ---

# The surface is _ZOOM times as wide as the enlarged window. A window that is wider than _WIDEST_IN_RADII times the mean
# radius of the spots is halved repeatedly, but not to fewer than _LEAST_CELLS cells along a side. The width is at
# least _LEAST_IN_RADII radii of the largest spot.
_ZOOM = 4
_LEAST_IN_RADII = 3
_WIDEST_IN_RADII = 40
_LEAST_CELLS = 64
# Largest number of spots that are drawn as vector graphics. More spots become an image, so that PDF files stay small.
_MANY_SPOTS = 2000
# Look of the cells in contact, black on a map.
_BLACK = {"cmap": LinearSegmentedColormap.from_list("contact", [(0, 0, 0, 0), (0, 0, 0, 1)]), "vmin": 0, "vmax": 1}
# Names and colours of nodes: in contact in no model, only with asperities, only with boundary elements, in both models.
_NODES = (("", "white"), ("asperities only", _RED), ("boundary elements only", "black"), ("both", "0.72"))

_SPOTS = """Contact spots of the asperity model (red, in true size and position) on a map of the topography. The title
gives surface, material and load."""
_CELLS = """Contact of boundary elements (black cells) on a map of the topography. The title gives surface, material and
load. The table of the figure has the position of each patch, and the radius of a circle of its area."""
_COMPARED = """Panel (b) shows the contact of boundary elements on the same topography at the same load (black). Panel
(c) enlarges the framed region around the largest spot of (a): edges of contact of the asperity model (red) and of
boundary elements (black), also of holes. Panel (d) shows where both models are in contact, and where only one is; the
overlap is the ratio of the areas in contact in both models and in at least one. These areas are counts of cells, which
are larger than the contact area, because this is corrected for the edges."""


@in_style
def contact_map(
    campaign: xr.DataTree,
    surface: xr.Dataset,
    truth: xr.Dataset | None = None,
    *,
    run: Sequence,
    kind: str | None = None,
    target: float | None = None,
) -> Figure:
    """Draw the spots of one snapshot of one run.

    `truth` is the same run with boundary elements, including contact maps; None without such a run. A run that is
    itself with boundary elements is drawn alone.
    """
    labels = RunLabels(*run)
    data, alone = select.select_complete_run(campaign, labels, LOADED_RUNS), labels.model == REFERENCE_MODEL
    at = find_snapshot(data, kind, target)
    state, beside = state_of(data, at), None
    kind, target = str(data["snapshot_kind"].values[at]), float(data["snapshot_target"].values[at])
    # The run with boundary elements may have ended before this snapshot.
    if truth is not None and (same := snapshot_if_any(truth, kind, target)) is not None:
        beside = state_of(truth, same)
    topography = topography_of(data, surface)
    circles = spot_circles(data, at, topography.length)
    corner, width = _view(circles, topography)
    compared = beside is not None and not alone
    fig, panels = new_panels(*(6.9, 2) if compared else (3.35, 1))
    say(fig, _CELLS if alone else _SPOTS, select.early_end(data))
    whole, enlarged = panels[0, 0], panels[1, 0] if compared else panels[0, 1]
    heights = {"cmap": "cividis", "vmin": topography.lowest, "vmax": topography.highest}
    image = topography.draw(whole, **heights)
    record_spots(whole, circles, topography.side, Name("spots", labels))
    window = topography.side, corner, width
    nodes, look = _window(topography.heights, *window)
    enlarged.imshow(nodes * topography.scale, interpolation="nearest", **look, **heights)
    if alone:
        fraction = beside["contact_map"].transpose("row", "column").values.astype(float)
        draw_map(whole, fraction, topography.side, **_BLACK)
        nodes, look = _window(fraction, *window)
        enlarged.imshow(nodes, interpolation="nearest", **look, **_BLACK)
    else:
        draw_spots(whole, circles, facecolor=(*_RED, 0.85), lw=0, rasterized=len(circles) > _MANY_SPOTS)
        draw_spots(enlarged, circles, facecolor="none" if compared else (*_RED, 0.4), edgecolor=_RED, lw=1.0)
    area = rf"$A/A_0$ = {float(state['contact_area_fraction']):.3f}"
    whole.set_title(f"asperities, {area}" if compared else area, loc="right")
    enlarged.set_title(f"enlarged ×{topography.side / width:.2g}", loc="right")
    say(fig, _COMPARED if compared else "Panel (b) enlarges the framed region around the largest spot.")
    say(fig, "" if beside is None else range_of_attraction(attractions_of([truth])))
    if compared:
        covered = contact_of_spots(data, at, len(beside["contact_map"]))
        _draw_boundary_elements(panels, topography, window, heights, beside, covered)
    if str(data["boundary"].values) == "periodic":
        say(fig, "The map is one period; spots continue across its borders. The mean height is zero.")
    elif select.has_shape(data):
        say(fig, "The heights are those of the shape with its roughness.")
    load = rf"$F/(E^{{\ast}}h′_{{\mathrm{{rms}}}}A_0)$ = {format_number(float(state['reduced_pressure']))}"
    title = f"{run_label(campaign, labels)}, {_name_force(data, at) or load}"
    fig.suptitle(f"{title}\n{select.doubt_about(data)}".rstrip(), fontsize="medium")
    for ax in panels.ravel():
        topography.label(ax)
        if ax is not enlarged:
            frame = "white" if ax.get_images()[0].get_array().ndim == 2 else BLUE
            ax.add_patch(Rectangle(corner, width, width, fill=False, ec=frame, lw=1.2))
    enlarged.set(xlim=corner[0] + np.array([0, width]), ylim=corner[1] + np.array([0, width]))
    bar = fig.colorbar(image, ax=panels, shrink=0.46 if compared else 0.92, pad=0.015, aspect=28)
    bar.set_label(f"height ({topography.height_unit})")
    return fig


def _view(circles, topography):
    """Return the lower left corner and the side of the enlarged window around the largest spot, in axis units."""
    side = topography.side
    x, y, radius = without_images(circles, side).T
    typical = float(np.sum(radius**3) / np.sum(radius**2)) if radius.any() else side
    zoom = _ZOOM
    while side / zoom > _WIDEST_IN_RADII * typical and len(topography.heights) / (2 * zoom) >= _LEAST_CELLS:
        zoom *= 2
    largest = np.argmax(radius) if len(radius) else None
    middle = np.array([side, side]) / 2 if largest is None else np.array([x[largest], y[largest]])
    width = min(max(side / zoom, _LEAST_IN_RADII * float(radius.max(initial=0))), side)
    return np.clip(middle - width / 2, 0, side - width), width


def _draw_boundary_elements(panels, topography, window, heights, beside, covered):
    """Draw the contact regions of boundary elements, the edges of these regions in the window, and the overlap."""
    (_, solution), (enlarged, compared) = panels
    fraction = beside["contact_map"].transpose("row", "column").values.astype(float)
    contact = fraction >= 0.5
    topography.draw(solution, **heights)
    draw_map(solution, fraction, topography.side, **_BLACK)
    nodes, look = _window(fraction, *window)
    enlarged.contour(nodes, [0.5], **look, colors="black", linewidths=0.9)
    below = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.17)}
    edges = {"asperities (edge)": {"color": _RED, "lw": 1.0}, "boundary elements (edge)": {"color": "black", "lw": 0.9}}
    enlarged.legend([legend_handle(**each) for each in edges.values()], edges, ncols=2, **below)
    palette = np.array([to_rgb(colour) for _, colour in _NODES])
    draw_map(compared, palette[1 * covered + 2 * contact], topography.side)
    keys = [Patch(fc=colour, label=name) for name, colour in _NODES if name]
    compared.legend(handles=keys, ncols=3, columnspacing=1.0, **below)
    solution.set_title(rf"{REFERENCE_NAME}, $A/A_0$ = {float(beside['contact_area_fraction']):.3f}", loc="right")
    compared.set_title(f"overlap (both / at least one) {jaccard(covered, contact):.2f}", loc="right")


def _window(nodes, side, corner, width):
    """Return the nodes of a periodic map that cover a window, and arguments of `Axes.imshow` for their place."""
    cell = side / len(nodes)
    columns, rows = (
        np.arange(start, start + int(np.ceil(width / cell)) + 2) for start in np.floor(corner / cell).astype(int)
    )
    borders = tuple(float(edge) * cell for at in (columns, rows) for edge in (at[0] - 0.5, at[-1] + 0.5))
    return nodes[np.ix_(rows % len(nodes), columns % len(nodes))], {"extent": borders, "origin": "lower"}


# --- figure 6 ---

# Quantities that all slopes have in common, in each panel.
_SAME = ("relative_load", "area_fraction")


@in_style
def spots_by_slope(
    campaign: xr.DataTree,
    *,
    study: str,
    surface: str | None = None,
    seed: int | None = None,
    material: str | None = None,
) -> Figure:
    """Draw the spots of all slopes for one surface, seed and material; the defaults are those of the first run."""
    runs = select.select_by_labels(select.select_runs(campaign, study), surface=surface, seed=seed, material=material)
    dataset, shown = campaign[study].to_dataset(), runs[0][0]
    reached = runs_with_snapshot(dataset, _SAME[0]) & runs_with_snapshot(dataset, _SAME[1])
    runs = [(labels, run) for labels, run in runs if reached[run_place(dataset, labels)]]
    if not runs:
        raise select.NothingToDraw(f"study {study}: no run reaches both a relative load and an area fraction")
    runs = sorted(runs, key=lambda each: -each[0].rms_slope)
    # Slopes have colours from dark to bright, because the other colours stand for materials.
    colours = graded_colours(len(runs))

    fig, [panels] = new_panels(3.8, sharey=True)
    say(
        fig,
        """Contact spots of the asperity model, in true size, on one topography that is scaled to several rms slopes.
        All slopes have the same load F/(E* A0) in panel (a), and the same contact area A/A0 in panel (b). At a given
        load, a steeper surface has less contact area. Its spots lie within the spots of flatter surfaces, and are drawn
        on top of them. At a given contact area, the spots of all slopes nearly coincide, so every slope fills one
        sector of each circle in panel (b).""",
    )
    if dataset.sizes["material"] > 1:
        label = material_labels(interfaces_of([dataset]))[shown.material]
        say(fig, f"The material has {plain(label).replace('$', '')}.")
    length, unit = choose_unit(float(runs[0][1]["period"]), "m")
    of_labels = runs_with_labels(dataset, surface=shown.surface, seed=shown.seed, material=shown.material)
    show_runs(fig, study, reached, of_labels & (dataset["model"] == shown.model))
    for ax, kind in zip(panels, _SAME, strict=True):
        _draw_slopes(ax, runs, kind, colours, length)
        ax.set(aspect="equal", xlabel=f"$x$ ({unit})")
    panels[0].set_ylabel(f"$y$ ({unit})")
    handles = {}
    for (labels, run), colour in zip(runs, colours, strict=True):
        name = slope_label(labels.rms_slope) + (f" ({doubt})" if (doubt := select.doubt_about(run)) else "")
        handles[name] = Patch(facecolor=colour)
    legend_below(fig, handles)
    return fig


def _draw_slopes(ax, runs, kind, colours, length):
    """Draw the spots of each slope at the first snapshot of a kind."""
    at = [find_snapshot(run, kind) for _, run in runs]
    areas = [float(state_of(run, k)["contact_area_fraction"]) for (_, run), k in zip(runs, at, strict=True)]
    # Slopes with less contact area are drawn on top of slopes with more contact area.
    for order, k in enumerate(np.argsort(np.negative(areas), kind="stable")):
        (labels, run), look = runs[k], {"facecolor": colours[k], "edgecolor": "black", "lw": 0.25}
        side, circles = float(run["period"]) * length, spot_circles(run, at[k], length)
        record_spots(ax, circles, side, Name("spots", labels))
        if kind == "relative_load":
            draw_spots(ax, circles, zorder=2 + order, **look)
        else:
            # The spots of all slopes nearly coincide. Each slope fills a sector of the circle, so that all slopes show.
            share = 360 / len(runs)
            start = 90 + share * k
            ax.add_collection(PatchCollection([Wedge((x, y), r, start, start + share) for x, y, r in circles], **look))
    ax.set(xlim=(0, side), ylim=(0, side))
    sectors = "" if kind == "relative_load" or len(runs) == 1 else ", a sector for each slope"
    ax.set_title(select.snapshot_label(run, at[k]) + sectors, loc="right")


# --- figure 16 ---

# For each kind of event: its name in the legend, the branch for which the map shows the events, the relative size of
# marks, the width of lines, and the look of marks. Marks are black if spots form or unite, and red if spots break or
# separate. Other colours stand for materials. Rings are larger than dots, and squares larger than crosses, so that both
# marks at one position are visible.
_KINDS = {
    "jump_in": ("spot formed", "loading", 1.0, 1.3, {"marker": "o", "mfc": BLACK, "mec": BLACK}),
    "jump_off": ("spot broken", "unloading", 1.6, 1.3, {"marker": "o", "mfc": "none", "mec": _RED}),
    "coalescence": ("union", "loading", 1.6, 0.6, {"marker": "D", "mfc": "none", "mec": BLACK}),
    "split": ("union undone", "unloading", 1.0, 0.6, {"marker": "+", "mec": _RED}),
}
# If every kind has at most _FEW events, marks have the size _SIZE, in points. Otherwise marks are smaller, so that the
# total area of the marks remains about the same. No mark is smaller than _LEAST_SIZE.
_FEW = 60
_SIZE = 5.0
_LEAST_SIZE = 1.6

_EVENTS = """Events of one run. Panel (a) shows where spots formed in the first loading and broke in the last unloading,
on a map of the topography with the highest parts white. Marks of unions are at the centre of the united spot. The
legend gives the number of marks of each kind. Panel (b) shows the number of events since the beginning of loading or
unloading against the mean separation, in the colours of panel (a); thin lines count unions."""


@in_style
def snap_map(campaign: xr.DataTree, surface: xr.Dataset, *, run: Sequence) -> Figure:
    """Draw the events of one run on a map of the topography, and the number of events against the mean separation."""
    labels = RunLabels(*run)
    data = select.select_complete_run(campaign, labels)
    events = _events(data)
    fig, [(where, when)] = new_panels(3.1, width_ratios=(1.3, 1))
    say(fig, _EVENTS, grid_of_loops(campaign, [labels.study]))
    handles = _draw_places(where, topography_of(data, surface), events)
    _draw_counts(when, events)
    fig.suptitle(run_label(campaign, labels), fontsize="medium")
    handles |= {name: legend_handle(color=GREY, ls=dashes, lw=1.1) for name, dashes in BRANCH_DASHES.items()}
    if doubt := select.doubt_about_loop(data):
        handles |= {doubt: legend_handle(ls="none")}
    legend_below(fig, handles)
    return fig


def _draw_places(ax, topography, events):
    """Draw events over the topography; return the legend entries by name."""
    # The map is light, so that the marks are visible.
    image = topography.draw(ax, cmap="gray", vmin=2.2 * topography.lowest, vmax=topography.highest)
    topography.label(ax)
    most = max(events[name, branch].sizes["event"] for name, (_, branch, *_) in _KINDS.items())
    size = max(_LEAST_SIZE, _SIZE * min(1.0, (_FEW / max(most, 1)) ** 0.5))
    handles = {}
    for name, (words, branch, relative, _, look) in _KINDS.items():
        x, y = (events[name, branch][f"event_{axis}"].values * topography.length for axis in "xy")
        points = plot(ax, x, y, words, **{"ls": "none", "ms": relative * size, "mew": 0.9} | look)
        if len(x):
            handles[f"{words} ({len(x)})"] = points
    bar = ax.figure.colorbar(image, ax=ax, shrink=0.9, pad=0.02, aspect=28)
    bar.set_label(f"height ({topography.height_unit})")
    bar.ax.set_ylim(topography.lowest, topography.highest)
    return handles


def _draw_counts(ax, events):
    """Draw the cumulative number of events against the mean separation, by kind of event and branch."""
    for name, (words, *_, width, look) in _KINDS.items():
        for branch, dashes in BRANCH_DASHES.items():
            separation = (events[name, branch]["event_separation"] / events[name, branch]["unit_height"]).values
            if len(separation):
                steps, counts = np.append(separation[0], separation), np.arange(len(separation) + 1)
                line = {"color": look["mec"], "ls": dashes, "lw": width, "drawstyle": "steps-post"}
                plot(ax, steps, counts, f"{words}, {branch}", **line)
    ax.set_ylim(bottom=0)
    ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set(xlabel=label_of("reduced_separation"), ylabel="events so far")


def _events(run):
    """Return the events in first loading and last unloading, by kind and branch."""
    of_event = run[["leg", "branch"]].sel(step=run["event_step"].astype(int))
    shown = of_event["leg"].isin([0, select.unloading_legs(run)[-1]["leg"].values[-1]]).values
    kinds = np.array(EVENT_KINDS)[run["event_kind"].values.astype(int)]
    events = run[["event_x", "event_y", "event_separation", "unit_height"]]
    return {
        (kind, branch): events.isel(event=shown & (kinds == kind) & (of_event["branch"].values == branch))
        for kind in _KINDS
        for branch in BRANCH_DASHES
    }


# --- figure 20 ---

_MOST_MAPS = 6
# Largest number of cells along a side in the table of a map; of larger maps, the table has every second cell, or fewer.
_TABLE_CELLS = 128
# Fraction of the pressures in contact that the colours cover on either side; larger magnitudes have the last colour.
_COVERED = 0.98
# Space around the largest contact, divided by its width.
_MARGIN = 0.15

_PRESSURES = """Maps of the contact pressure at snapshots of one run with boundary elements, in the order of the path.
Compression is red, tension is blue, each with its own scale, which ends at the 98 % quantile in contact in all maps.
Grey regions are out of contact. The title of a panel gives the force, or the reduced pressure p* = F/(E* h'rms A0) and
the contact area, to which cells at the edges contribute in part."""


@in_style
def pressure_maps(campaign: xr.DataTree, maps: xr.Dataset, *, run: Sequence) -> Figure:
    """Draw the pressure at the snapshots of a run; with more than six snapshots, at six of them."""
    labels = RunLabels(*run)
    data = select.select_complete_run(campaign, labels, LOADED_RUNS)
    touching = maps["contact_map"].transpose("snapshot", "row", "column").values > 0
    if not touching.any():
        raise select.NothingToDraw(f"{labels}: no snapshot has contact")
    shown = some_of(np.argsort(maps["snapshot_step"].values, kind="stable"), _MOST_MAPS)
    pressure = maps["contact_pressure"].transpose("snapshot", "row", "column").values
    inside = np.abs(pressure[touching])
    factor, unit = choose_unit(float(np.quantile(inside, _COVERED)), "Pa")
    # Tension has a scale of its own, because it is often smaller than the pressure.
    most, least = (
        factor * float(np.quantile(np.abs(part), _COVERED)) if part.size else factor * float(inside.max())
        for part in (pressure[touching & (pressure > 0)], pressure[touching & (pressure < 0)])
    )
    length, length_unit = choose_unit(float(maps["period"]), "m")
    side = float(maps["period"]) * length
    labels_of_axes = {f"{axis}label": f"${axis}$ ({length_unit})" for axis in "xy"}
    fig, panels = new_grid(len(shown), 3, 2.7, 2.15, room=(0.65, 0.1), **labels_of_axes, sharex=True, sharey=True)
    say(fig, _PRESSURES, select.early_end(data))
    window = (0.0, 1.0)
    if str(maps["boundary"].values) == "free":  # only the region of contact
        touched = touching.any(axis=0)
        places = np.flatnonzero(touched.any(axis=0) | touched.any(axis=1)) / len(touched)
        room = _MARGIN * (np.ptp(places) or 1.0)
        window = (max(places[0] - room, 0.0), min(places[-1] + room, 1.0))
    for ax, k in zip(panels, shown, strict=True):
        cells = np.where(touching[k], pressure[k] * factor, np.nan)
        half = side / len(cells) / 2
        image = ax.imshow(
            np.ma.masked_invalid(average_blocks(cells)),
            extent=(-half, side - half) * 2,
            origin="lower",
            interpolation="nearest",
            cmap="RdBu_r",
            norm=TwoSlopeNorm(0, -least, most),
        )
        ax.set_title(_name_state(maps, k), loc="right", fontsize=8)
        ax.set(xlim=np.multiply(window, side), ylim=np.multiply(window, side))
        ax.set_facecolor("0.8")
        _record_pressures(ax, cells / factor, side, Name(_branch(maps, k), labels))
    bar = fig.colorbar(image, ax=panels, shrink=0.9, pad=0.015, aspect=28, extend="both")
    bar.set_label(f"pressure ({unit})")
    ends = (-least, -least / 2, 0, most / 2, most)
    bar.set_ticks(ends, labels=[format_number(float(f"{value:.2g}")) for value in ends])
    fig.suptitle(run_label(campaign, labels), fontsize="medium")
    return fig


def _record_pressures(ax, cells, side, name):
    """Record the pressures (Pa) of cells in contact, at most `_TABLE_CELLS` along a side."""
    every = -(-len(cells) // _TABLE_CELLS)
    row, column = np.nonzero(np.isfinite(cells[::every, ::every]))
    x, y = (every * place * side / len(cells) for place in (column, row))
    record(ax, x, y, name, pressure=cells[::every, ::every][row, column])


def _branch(maps, snapshot):
    """Return the branch of a snapshot, or pull-off."""
    pull_off = str(maps["snapshot_kind"].values[snapshot]) == "pull_off"
    return "pull-off" if pull_off else str(maps["branch"].values[int(maps["snapshot_step"].values[snapshot])])


def _name_state(maps, snapshot):
    """Return load and area of a snapshot as text, with the branch if it is not loading; on a free square, the force."""
    step, name = int(maps["snapshot_step"].values[snapshot]), _branch(maps, snapshot)
    if force := _name_force(maps, snapshot):
        return f"{name}, {force}"
    load = format_number(float(f"{float(maps['reduced_pressure'][step]):.3g}"))
    area = format_number(float(f"{float(maps['contact_area_fraction'][step]):.2g}"))
    words = rf"$p^{{\ast}}$ = {load}" + f"\n$A/A_0$ = {area}"
    return words if name == "loading" else f"{name}, {words}"


def _name_force(run, snapshot):
    """Return the force at a snapshot on a free square as text; "" on a periodic surface, where a pressure is stated."""
    if "force" not in run:
        return ""
    forces = run["force"].values
    force = float(forces[int(run["snapshot_step"].values[snapshot])])
    # A target of no force is met to the tolerance of loads.
    force = force if abs(force) > _NO_FORCE * np.abs(forces).max() else 0.0
    return f"$F$ = {format_quantity(float(f'{force:.3g}'), 'N')}".replace("-", "−")
