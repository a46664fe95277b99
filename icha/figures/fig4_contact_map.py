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
from icha.figures.maps import average_blocks, draw_spots, draw_whole, wrap_circles
from icha.figures.select import is_applicable, run_on_topography
from icha.figures.style import format_number, in_style, material_label, new_panels
from icha.support.formatting import choose_unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class MapFigure(SnapshotFigure, RunFigure):
    """A figure of one snapshot of one run; options that are left out take the study's first value."""


def inputs(campaign: Campaign, options: MapFigure, files: results.ResultFiles) -> Inputs:
    """Return the runs, the topography, and boundary elements of the same state, if there are any.

    Boundary elements in the limit of a short range are preferred; their maps are in the file of another run of the
    study.
    """
    run = options.run(campaign)
    found = {"campaign": files.path(results.DATASET), "surface": files.path(results.SURFACE, run)}
    if run.model == DEFAULT_MODEL and REFERENCE_MODEL in campaign.studies[options.study].models:
        return found | {"truth": files.path(results.RUN, run._replace(model=REFERENCE_MODEL))}
    solution = finest_solution(campaign, options)
    return found | ({"solution": files.path(results.SOLUTION, solution)} if solution else {})


def finest_solution(campaign: Campaign, options: MapFigure) -> SolutionLabels | None:
    """Return the finest solution at a finite range of attraction of the state that is drawn, if any."""
    targets = campaign.snapshots_of(options.study) or [campaign.studies[options.study].targets.last]
    if options.snapshot is not None:
        targets = [options.snapshot.kind_and_value]
    if {kind for kind, _ in targets} != {"reduced_pressure"}:
        return None
    _, value = min(targets)  # the first one on the path
    _, _, *contact = options.run(campaign)
    for label, entry in sorted(campaign.finite_range.items(), key=lambda each: -each[1].refinement):
        solved = entry.study == options.study and value in entry.reduced_pressures
        if solved and tuple(contact) in campaign.contacts_beside(entry):
            return SolutionLabels(label, options.study, *contact, value)
    return None


DECLARATION = Declaration(
    description="Contact spots over the topography.", options=MapFigure, inputs=inputs, holds_topography=True
)

# The enlarged view shows a quarter of the period. It is halved while it is wider than this number of mean radii of the
# spots and has more than twice this number of cells.
_ZOOM = 4
_WIDEST_IN_RADII = 40
_LEAST_CELLS = 64
# More spots than this are drawn as an image in PDF files as well.
_MANY_SPOTS = 2000
# Outlines in the map, as fractions of the radius, so that they do not hide small spots, and at most, in points; and
# about the width of the map, in points.
_OUTLINE = 0.25
_WIDEST_OUTLINE = 0.35
_PANEL = 190
_RED = (0.9, 0.0, 0.05)
# Names and colours of nodes in contact with no model, asperities, boundary elements, and both.
_STATES = (("", "white"), ("asperities only", _RED), ("boundary elements only", "black"), ("both", "0.72"))


@in_style
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
    truth : the same run with boundary elements in the limit of a short range, with its maps, if there is one.
    which : which run of the study (`icha.figures.select.run_on_topography`).
    """
    from icha.analysis.model_error import state_of
    from icha.datasets.campaign import find_snapshot

    labels, run = run_on_topography(campaign, study, surface, **which)
    at = find_snapshot(run, kind, target)
    state = state_of(run, at)
    pressure, area = (float(state[name]) for name in ("reduced_pressure", "contact_area_fraction"))
    solved = None
    if truth is not None or solution is not None:
        solved = _solved(labels, run, at, pressure, truth, solution)
    view = _view(run, at, surface)

    fig, panels = new_panels(*(3.35, 1) if solved is None else (6.9, 2))
    whole, enlarged = panels[0, 0], panels[0, 1] if solved is None else panels[1, 0]
    image = _draw_spots_over_topography(whole, enlarged, view)
    enlarged.set_title(f"enlarged ×{view.zoom}", loc="right")
    area = rf"$A/A_0$ = {area:.3f}"
    whole.set_title(area if solved is None else f"asperities, {area}", loc="right")
    if solved is not None:
        _draw_solution(panels, view, run, at, solved)
    load = rf"$F/(E^{{\ast}}h_{{\mathrm{{rms}}}}^{{\prime}}A_0)$ = {format_number(pressure)}"
    title = f"{labels.surface}, {material_label(campaign[study].to_dataset(), labels.material)}, {load}"
    fig.suptitle(title if is_applicable(run) else f"{title}\n{NOT_APPLICABLE_ALONE}", fontsize="medium")
    _frame(panels, enlarged, view)
    bar = fig.colorbar(image, ax=panels, shrink=0.92 if solved is None else 0.46, pad=0.015, aspect=28)
    bar.set_label(f"height ({view.height_unit})")
    return fig


class _Solved(NamedTuple):
    """Contact area of boundary elements.

    Attributes
    ----------
    contact : (n, n) float along y and x, fraction of every node in contact.
    area : contact area over nominal area.
    name : name of the boundary elements in legends.
    """

    contact: np.ndarray
    area: float
    name: str


def _solved(labels, run, at, pressure, truth, solution):
    """Return the state of boundary elements at the snapshot `at` of a run; None if their path ended before it."""
    from icha.analysis.model_error import check_same_contact, state_of
    from icha.datasets.campaign import find_snapshot

    try:
        check_same_contact(run, truth if solution is None else solution)
    except ValueError as error:
        raise ValueError(f"{labels}: the boundary elements are of another contact: {error}") from None
    if solution is None:
        kind, target = (run[name].values[at] for name in ("snapshot_kind", "snapshot_target"))
        try:
            state = state_of(truth, find_snapshot(truth, str(kind), float(target)))
        except ValueError:
            return None
        contact, name = state["contact_map"].transpose("row", "column"), SHORT_RANGE
    else:
        solved = float(solution["target_reduced_pressure"])
        if not np.isclose(pressure, solved, rtol=1e-6):
            raise ValueError(f"{labels}: boundary elements of reduced pressure {solved:g}; expected {pressure:g}")
        state, contact, name = solution, solution["contact"].transpose("y", "x"), FINITE_RANGE
    return _Solved(contact.values.astype(float), float(state["contact_area_fraction"]), name)


class _View(NamedTuple):
    """Topography and spots in the units of the axes, and the window that is enlarged.

    Attributes
    ----------
    heights : (n, n) float along y and x, those of the surface's file.
    scale : factor from them to the heights of the run in `height_unit`.
    height_unit : unit of heights.
    look : arguments of `Axes.imshow` for heights.
    side : side of the surface in `length_unit`.
    length_unit : unit of the axes.
    circles : (m, 3) float, x, y and radius of the spots.
    zoom : side over that of the window.
    corner : (2,) float, lower left corner of the window.
    window : side of the window.
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
    length, length_unit = choose_unit(period, "m")
    height, height_unit = choose_unit(highest, "m")
    spots = spots_of(run, at)
    radius = spots["spot_radius"].values
    x, y = spots["spot_x"].values * length, spots["spot_y"].values * length
    side, n = period * length, len(heights)
    typical = float(np.sum(radius**3) / np.sum(radius**2)) if radius.any() else period
    zoom = _ZOOM
    while period / zoom > _WIDEST_IN_RADII * typical and n / (2 * zoom) >= _LEAST_CELLS:
        zoom *= 2
    window = side / zoom
    largest = int(np.argmax(radius)) if len(radius) else None
    middle = np.array([side, side]) / 2 if largest is None else np.array([x[largest], y[largest]])
    return _View(
        heights,
        factor * height,
        height_unit,
        {"origin": "lower", "cmap": "cividis", "vmin": -highest * height, "vmax": highest * height},
        side,
        length_unit,
        wrap_circles(x, y, radius * length, side, str(run["boundary"].values)),
        zoom,
        np.clip(middle - window / 2, 0, side - window),
        window,
    )


def _draw_spots_over_topography(whole, enlarged, view):
    """Draw the whole map and the enlarged window; return the image of the heights."""
    n, circles, corner, window = len(view.heights), view.circles, view.corner, view.window
    inside = circles[np.all(np.abs(circles[:, :2] - (corner + window / 2)) < window / 2 + circles[:, 2:], axis=1)]
    image = draw_whole(whole, average_blocks(view.heights) * view.scale, n, view.side, **view.look)
    outlines = np.minimum(_OUTLINE * _PANEL / view.side * circles[:, 2], _WIDEST_OUTLINE)
    many = len(circles) > _MANY_SPOTS
    draw_spots(whole, circles, facecolor=(*_RED, 0.85), edgecolor="black", lw=outlines, rasterized=many)
    heights, borders = _window(view.heights, view.side / n, corner, window)
    enlarged.imshow(average_blocks(heights) * view.scale, extent=borders, interpolation="nearest", **view.look)
    draw_spots(enlarged, inside, facecolor=(*_RED, 0.4), edgecolor=(0.75, 0, 0), lw=1.0)
    return image


def _draw_solution(panels, view, run, at, solved):
    """Draw the contact of boundary elements: over the topography, around the enlarged spots, and with asperities."""
    from matplotlib.colors import LinearSegmentedColormap, to_rgb
    from matplotlib.patches import Patch

    from icha.analysis.model_error import contact_of_spots, jaccard

    (_, solution), (enlarged, compared) = panels
    contact, fine = solved.contact >= 0.5, len(solved.contact)
    spots_cover = contact_of_spots(run, at, fine)
    draw_whole(solution, average_blocks(view.heights) * view.scale, len(view.heights), view.side, **view.look)
    red = LinearSegmentedColormap.from_list("contact", [(*_RED, 0.0), (*_RED, 0.9)])
    look = {"origin": "lower", "cmap": red, "vmin": 0, "vmax": 1}
    draw_whole(solution, average_blocks(solved.contact), fine, view.side, **look)
    contour, borders = _window(solved.contact, view.side / fine, view.corner, view.window)
    enlarged.contour(contour, [0.5], extent=borders, origin="lower", colors="black", linewidths=0.9)
    palette = np.array([to_rgb(colour) for _, colour in _STATES])
    draw_whole(compared, average_blocks(palette[1 * spots_cover + 2 * contact]), fine, view.side, origin="lower")
    keys = [Patch(fc=colour, label=name) for name, colour in _STATES if name]
    compared.legend(handles=keys, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=3, columnspacing=1.0)
    solution.set_title(rf"{solved.name}, $A/A_0$ = {solved.area:.3f}", loc="right")
    compared.set_title(f"overlap (both / at least one) {jaccard(spots_cover, contact):.2f}", loc="right")


def _frame(panels, enlarged, view):
    """Set limits and labels of all panels, and draw the frame of the enlarged window in the others."""
    from matplotlib.patches import Rectangle

    for ax in panels.ravel():
        ax.tick_params(direction="out", top=False, right=False)
        (x, y), width = (view.corner, view.window) if ax is enlarged else ((0, 0), view.side)
        ax.set(xlim=(x, x + width), ylim=(y, y + width))
        if ax is not enlarged:
            frame = "white" if ax.get_images()[0].get_array().ndim == 2 else "black"
            ax.add_patch(Rectangle(view.corner, view.window, view.window, fill=False, ec=frame, lw=1.2))
    for ax in panels[:, 0]:
        ax.set_ylabel(f"y ({view.length_unit})")
    for ax in panels[-1]:
        ax.set_xlabel(f"x ({view.length_unit})")


def _window(nodes, cell, corner, window):
    """Return the nodes of a periodic map in a square window, and where their cells begin and end in x and in y."""
    first = np.floor(corner / cell).astype(int)
    columns, rows = (np.arange(start, start + int(np.ceil(window / cell)) + 2) for start in first)
    borders = tuple(float(edge) * cell for at in (columns, rows) for edge in (at[0] - 0.5, at[-1] + 0.5))
    return nodes[np.ix_(rows % len(nodes), columns % len(nodes))], borders
