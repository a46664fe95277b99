"""Fig. 4: contact spots, in their true size, over the topography."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.datasets import results
from icha.datasets.labels import SolutionLabels
from icha.datasets.variables.model_error import FINITE_RANGE, SHORT_RANGE
from icha.figures.declaration import Campaign, Declaration, Inputs, RunFigure, SnapshotFigure
from icha.figures.looks import NOT_APPLICABLE_ALONE
from icha.figures.maps import block_means, circles_in_cell, draw_spots, draw_whole
from icha.figures.select import is_applicable, run_on_topography
from icha.figures.style import material_label, new_panels, number, styled, unit_for

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class MapFigure(SnapshotFigure, RunFigure):
    """A figure of one snapshot of one run; what is left out is the study's first."""


def inputs(campaign: Campaign, options: MapFigure, files: results.ResultFiles) -> Inputs:
    """The runs, the topography of the one that is drawn, and boundary elements of its state, if there are any.

    Those in the limit of a short range are another run of the study, whose file has the maps; they come first.
    """
    run = options.run(campaign)
    found = {"campaign": files.path(results.DATASET), "surface": files.path(results.SURFACE, run)}
    if run.model == DEFAULT_MODEL and REFERENCE_MODEL in campaign.studies[options.study].models:
        return found | {"truth": files.path(results.RUN, run._replace(model=REFERENCE_MODEL))}
    solution = finest_solution(campaign, options)
    return found | ({"solution": files.path(results.SOLUTION, solution)} if solution else {})


def finest_solution(campaign: Campaign, options: MapFigure) -> SolutionLabels | None:
    """The finest solution by boundary elements at a finite range of the state that is drawn, if there is any."""
    snapshots = campaign.snapshots_of(options.study) or [campaign.studies[options.study].targets.last]
    if options.snapshot is not None:
        kind, value = options.snapshot.target
    elif {kind for kind, _ in snapshots} == {"reduced_pressure"}:
        kind, value = min(snapshots)  # the first one that is met
    else:
        return None
    _, _, *contact = options.run(campaign)
    finest_first = sorted(campaign.finite_range.items(), key=lambda each: -each[1].refinement)
    return next(
        (
            SolutionLabels(label, options.study, *contact, value)
            for label, entry in finest_first
            if kind == "reduced_pressure" and entry.study == options.study
            if value in entry.reduced_pressures and tuple(contact) in campaign.solved(entry)
        ),
        None,
    )


DECLARATION = Declaration(
    description="Contact spots over the topography.", options=MapFigure, inputs=inputs, holds_topography=True
)

# The enlarged view shows a quarter of the period, halved as often as it is wider than so many radii of the spots, and
# at least so many cells.
_ZOOM = 4
_WIDEST_IN_RADII = 40
_LEAST_CELLS = 64
# More spots than this are drawn as an image in PDF files as well.
_MANY_SPOTS = 2000
# Outline of a spot in the map, as part of its radius, so that it does not hide small ones, and at most, in points; and
# points to the side of the map, about.
_OUTLINE = 0.25
_WIDEST_OUTLINE = 0.35
_PANEL = 190
_RED = (0.9, 0.0, 0.05)
# What is in contact at a node: nothing, ICHA, boundary elements, both.
# As in the enlarged part, asperities are red and boundary elements black.
_STATES = (("", "white"), ("asperities only", _RED), ("boundary elements only", "black"), ("both", "0.72"))


@styled
def figure(
    campaign: xr.DataTree,
    surface: xr.Dataset,
    solution: xr.Dataset | None = None,
    truth: xr.Dataset | None = None,
    *,
    study: str,
    kind: str | None = None,
    target: float | None = None,
    **which: object,
) -> Figure:
    """Draw the spots of one snapshot of one run.

    Parameters
    ----------
    campaign : the campaign dataset.
    surface : the surface file's dataset; it must be the topography of the run that is drawn.
    solution : boundary elements at a finite range (`icha.references.finite_range`) of the state that is drawn, if any.
    truth : the same run by boundary elements in the limit of a short range, with its maps, if there is one.
    which : which run of the study (`icha.figures.select.run_on_topography`).
    """
    from icha.datasets.campaign import find_snapshot

    labels, run = run_on_topography(campaign, study, surface, **which)
    at = find_snapshot(run, kind, target)
    solved = None
    if solution is not None:
        solved = _of_solution(labels, run, at, solution)
    elif truth is not None:
        solved = _of_run(labels, run, at, truth)
    view = _view(run, at, surface)

    fig, panels = new_panels(*(3.35, 1) if solved is None else (6.9, 2))
    whole, enlarged = panels[0, 0], panels[0, 1] if solved is None else panels[1, 0]
    image = _draw_spots_over_topography(whole, enlarged, view)
    enlarged.set_title(f"enlarged ×{view.zoom}", loc="right")
    area = rf"$A/A_0$ = {float(_state(run, at)['contact_area_fraction']):.3f}"
    fig.suptitle(_title(campaign[study].to_dataset(), labels, run, at), fontsize="medium")
    if solved is None:
        whole.set_title(area, loc="right")
    else:
        _draw_solution(panels, view, run, at, solved)
        whole.set_title(f"asperities, {area}", loc="right")
    _frame(panels, enlarged, view)
    bar = fig.colorbar(image, ax=panels, shrink=0.92 if solved is None else 0.46, pad=0.015, aspect=28)
    bar.set_label(f"height ({view.height_unit})")
    return fig


class _Solved(NamedTuple):
    """Contact of boundary elements: the part in contact of every node along y and x, A/A0, and which they are."""

    contact: xr.DataArray
    area: float
    name: str


def _state(run, at):
    from icha.analysis.model_error import state_of

    return state_of(run, at)


def _title(dataset, labels, run, at):
    """Surface, material and load of a snapshot, and whether the model is not applicable."""
    load = number(float(_state(run, at)["reduced_pressure"]))
    load = rf"$F/(E^{{\ast}}h_{{\mathrm{{rms}}}}^{{\prime}}A_0)$ = {load}"
    warning = "" if is_applicable(run) else f"\n{NOT_APPLICABLE_ALONE}"
    return f"{labels.surface}, {material_label(dataset, labels.material)}, {load}{warning}"


def _of_run(labels, run, at, truth):
    """The state of a run by boundary elements that a run keeps as its snapshot `at`; None if it failed before."""
    from icha.datasets.campaign import find_snapshot

    _check_contact(labels, run, truth)
    asked = str(run["snapshot_kind"].values[at]), float(run["snapshot_target"].values[at])
    try:
        state = _state(truth, find_snapshot(truth, *asked))
    except ValueError:
        return None
    contact = state["contact_map"].rename(row="y", column="x")
    return _Solved(contact, float(state["contact_area_fraction"]), SHORT_RANGE)


def _of_solution(labels, run, at, solution):
    """The state that a solution by boundary elements is of, which must be the one that is drawn."""
    _check_contact(labels, run, solution)
    shown, solved = float(_state(run, at)["reduced_pressure"]), float(solution["target_reduced_pressure"])
    if not np.isclose(shown, solved, rtol=1e-6):
        raise ValueError(f"{labels}: boundary elements of reduced pressure {solved:g} for a snapshot at {shown:g}")
    return _Solved(solution["contact"], float(solution["contact_area_fraction"]), FINITE_RANGE)


def _check_contact(labels, run, truth):
    """Raise ValueError unless boundary elements are of the contact that is drawn."""
    from icha.analysis.model_error import check_same_contact

    try:
        check_same_contact(run, truth)
    except ValueError as error:
        raise ValueError(f"{labels}: the boundary elements given are of another contact: {error}") from None


class _View(NamedTuple):
    """Topography and spots in the units of the axes, and the window that is enlarged.

    `heights` (n, n) are those of the surface's file, `scale` times them those of the run in its unit, of which `look`
    has the limits; `circles` are rows of x, y and radius; `corner` is the window's lower left one.
    """

    heights: np.ndarray
    scale: float
    height_unit: str
    look: dict
    side: float
    length_unit: str
    circles: np.ndarray
    zoom: int
    corner: np.ndarray
    window: float


def _view(run, at, surface):
    from icha.datasets.campaign import spots_of

    period = float(run["period"])
    heights = surface["height"].transpose("y", "x").values
    factor = float(run["rms_height"]) / float(surface["rms_height"])
    highest = max(float(heights.max()), -float(heights.min())) * factor
    length, length_unit = unit_for(period, "m")
    height, height_unit = unit_for(highest, "m")
    spots = spots_of(run, at)
    radius = spots["spot_radius"].values
    x, y = spots["spot_x"].values * length, spots["spot_y"].values * length
    side, n = period * length, len(heights)
    # The mean radius over the area of contact.
    typical = float(np.sum(radius**3) / np.sum(radius**2)) if radius.any() else period
    zoom = _ZOOM
    while period / zoom > _WIDEST_IN_RADII * typical and n / (2 * zoom) >= _LEAST_CELLS:
        zoom *= 2
    window = side / zoom
    middle = np.array([side, side]) / 2
    if len(radius):
        largest = int(np.argmax(radius))
        middle = np.array([x[largest], y[largest]])
    return _View(
        heights,
        factor * height,
        height_unit,
        {"origin": "lower", "cmap": "cividis", "vmin": -highest * height, "vmax": highest * height},
        side,
        length_unit,
        circles_in_cell(x, y, radius * length, side, str(run["boundary"].values)),
        zoom,
        np.clip(middle - window / 2, 0, side - window),
        window,
    )


def _draw_spots_over_topography(whole, enlarged, view):
    """Draw the whole map and the enlarged part of it; returns the image of the heights."""
    n, circles, corner, window = len(view.heights), view.circles, view.corner, view.window
    near = circles[np.all(np.abs(circles[:, :2] - (corner + window / 2)) < window / 2 + circles[:, 2:], axis=1)]
    image = draw_whole(whole, block_means(view.heights) * view.scale, n, view.side, **view.look)
    outlines = np.minimum(_OUTLINE * _PANEL / view.side * circles[:, 2], _WIDEST_OUTLINE)
    many = len(circles) > _MANY_SPOTS
    draw_spots(whole, circles, facecolor=(*_RED, 0.85), edgecolor="black", lw=outlines, rasterized=many)
    part, borders = _window(view.heights, view.side / n, corner, window)
    enlarged.imshow(block_means(part) * view.scale, extent=borders, interpolation="nearest", **view.look)
    draw_spots(enlarged, near, facecolor=(*_RED, 0.4), edgecolor=(0.75, 0, 0), lw=1.0)
    return image


def _draw_solution(panels, view, run, at, solved):
    """Draw the contact of boundary elements: over the topography, around the enlarged spots, and beside the model's."""
    from matplotlib.colors import LinearSegmentedColormap, to_rgb
    from matplotlib.patches import Patch

    from icha.analysis.model_error import contact_of_spots, jaccard

    (_, beside), (enlarged, compared) = panels
    part = solved.contact.transpose("y", "x").values.astype(float)
    contact, fine = part >= 0.5, len(part)
    spots_cover = contact_of_spots(run, at, fine)
    draw_whole(beside, block_means(view.heights) * view.scale, len(view.heights), view.side, **view.look)
    red = LinearSegmentedColormap.from_list("contact", [(*_RED, 0.0), (*_RED, 0.9)])
    look = {"origin": "lower", "cmap": red, "vmin": 0, "vmax": 1}
    draw_whole(beside, block_means(part), fine, view.side, **look)
    own, borders = _window(part, view.side / fine, view.corner, view.window)
    enlarged.contour(own, [0.5], extent=borders, origin="lower", colors="black", linewidths=0.9)
    palette = np.array([to_rgb(colour) for _, colour in _STATES])
    draw_whole(compared, block_means(palette[1 * spots_cover + 2 * contact]), fine, view.side, origin="lower")
    keys = [Patch(fc=colour, label=name) for name, colour in _STATES if name]
    compared.legend(handles=keys, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=3, columnspacing=1.0)
    beside.set_title(rf"{solved.name}, $A/A_0$ = {solved.area:.3f}", loc="right")
    compared.set_title(f"overlap (both / at least one) {jaccard(spots_cover, contact):.2f}", loc="right")


def _frame(panels, enlarged, view):
    """Limits and labels of all panels, and where the enlarged part lies in the others."""
    from matplotlib.patches import Rectangle

    for ax in panels.ravel():
        ax.tick_params(direction="out", top=False, right=False)
        start, width = (view.corner, view.window) if ax is enlarged else (np.zeros(2), view.side)
        ax.set_xlim(start[0], start[0] + width)
        ax.set_ylim(start[1], start[1] + width)
        if ax is not enlarged:
            frame = "white" if ax.get_images()[0].get_array().ndim == 2 else "black"
            ax.add_patch(Rectangle(view.corner, view.window, view.window, fill=False, ec=frame, lw=1.2))
    for ax in panels[:, 0]:
        ax.set_ylabel(f"y ({view.length_unit})")
    for ax in panels[-1]:
        ax.set_xlabel(f"x ({view.length_unit})")


def _window(nodes, cell, corner, window):
    """The nodes of a periodic map that lie in a square window, and where their cells begin and end in x and in y."""
    first = np.floor(corner / cell).astype(int)
    columns, rows = (np.arange(start, start + int(np.ceil(window / cell)) + 2) for start in first)
    borders = tuple(float(edge) * cell for at in (columns, rows) for edge in (at[0] - 0.5, at[-1] + 0.5))
    return nodes[np.ix_(rows % len(nodes), columns % len(nodes))], borders
