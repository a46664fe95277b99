"""Fig. 4: contact spots, in their true size, on a map of the topography."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.datasets.labels import RunLabels
from icha.figures.captions import attractions_of, range_of_attraction
from icha.figures.drawn import Name, say
from icha.figures.looks import NOT_APPLICABLE_ALONE, REFERENCE_NAME, run_label
from icha.figures.maps import draw_map, draw_spots, record_spots, topography_of, wrap_circles
from icha.figures.select import is_applicable, select_complete_run
from icha.figures.style import BLUE, format_number, in_style, legend_handle, new_panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


# The surface is _ZOOM times as wide as the enlarged window. A window that is wider than _WIDEST_IN_RADII times the mean
# radius of the spots is halved repeatedly, but not to fewer than _LEAST_CELLS cells along a side.
_ZOOM = 4
_WIDEST_IN_RADII = 40
_LEAST_CELLS = 64
# Largest number of spots that are drawn as vector graphics. More spots become an image, so that PDF files stay small.
_MANY_SPOTS = 2000
_RED = (0.9, 0.0, 0.05)
# Names and colours of nodes: in contact in no model, only with asperities, only with boundary elements, in both models.
_STATES = (("", "white"), ("asperities only", _RED), ("boundary elements only", "black"), ("both", "0.72"))

_CAPTION = """Contact spots of the asperity model (red, in true size and position) on a map of the topography, whose
mean height is zero. The title gives surface, material and load."""
_COMPARED = """Panel (b) shows the contact of boundary elements on the same topography at the same load (black). Panel
(c) enlarges the framed region around the largest spot of (a): edges of contact of the asperity model (red) and of
boundary elements (black), also of holes. Panel (d) shows where both models are in contact, and where only one is; the
overlap is the ratio of the areas in contact in both models and in at least one."""


@in_style
def figure(
    campaign: xr.DataTree,
    surface: xr.Dataset,
    truth: xr.Dataset | None = None,
    *,
    run: Sequence,
    kind: str | None = None,
    target: float | None = None,
) -> Figure:
    """Draw the spots of one snapshot of one run.

    Parameters
    ----------
    campaign : the campaign dataset.
    surface : dataset of the surface file, with the topography of the run.
    truth : dataset of the same run with boundary elements, including contact maps; None without such a run.
    run : labels of the run.
    kind, target : kind and target of the snapshot; None for the first snapshot.
    """
    from matplotlib.patches import Rectangle

    from icha.analysis.model_error import contact_of_spots, snapshot_if_any, state_of
    from icha.datasets.campaign import find_snapshot

    labels = RunLabels(*run)
    data = select_complete_run(campaign, labels)
    at = find_snapshot(data, kind, target)
    state, beside = state_of(data, at), None
    kind, target = str(data["snapshot_kind"].values[at]), float(data["snapshot_target"].values[at])
    # The run with boundary elements may have ended before this snapshot.
    if truth is not None and (same := snapshot_if_any(truth, kind, target)) is not None:
        beside = state_of(truth, same)
    topography = topography_of(data, surface)
    circles, corner, width = _view(data, at, topography)
    fig, panels = new_panels(*(3.35, 1) if beside is None else (6.9, 2))
    say(fig, _CAPTION)
    whole, enlarged = panels[0, 0], panels[0, 1] if beside is None else panels[1, 0]
    heights = {"cmap": "cividis", "vmin": -topography.highest, "vmax": topography.highest}
    image = topography.draw(whole, **heights)
    draw_spots(whole, circles, facecolor=(*_RED, 0.85), lw=0, rasterized=len(circles) > _MANY_SPOTS)
    record_spots(whole, circles, topography.side, Name("spots", labels))
    nodes, borders = _window(topography.heights, topography.side, corner, width)
    enlarged.imshow(nodes * topography.scale, extent=borders, origin="lower", interpolation="nearest", **heights)
    colour = (*_RED, 0.4) if beside is None else "none"
    draw_spots(enlarged, circles, facecolor=colour, edgecolor=_RED, lw=1.0)
    area = rf"$A/A_0$ = {float(state['contact_area_fraction']):.3f}"
    whole.set_title(area if beside is None else f"asperities, {area}", loc="right")
    enlarged.set_title(f"enlarged ×{topography.side / width:.0f}", loc="right")
    if beside is None:
        say(fig, "Panel (b) enlarges the framed region around the largest spot.")
    else:
        say(fig, _COMPARED, range_of_attraction(attractions_of([truth])))
        covered = contact_of_spots(data, at, len(beside["contact_map"]))
        _draw_boundary_elements(panels, topography, (corner, width), heights, beside, covered)
    if str(data["boundary"].values) == "periodic":
        say(fig, "The map is one period; circles continue across its borders.")
    load = rf"$F/(E^{{\ast}}h′_{{\mathrm{{rms}}}}A_0)$ = {format_number(float(state['reduced_pressure']))}"
    title = f"{run_label(campaign, labels)}, {load}"
    fig.suptitle(title if is_applicable(data) else f"{title}\n{NOT_APPLICABLE_ALONE}", fontsize="medium")
    for ax in panels.ravel():
        topography.label(ax)
        if ax is not enlarged:
            frame = "white" if ax.get_images()[0].get_array().ndim == 2 else BLUE
            ax.add_patch(Rectangle(corner, width, width, fill=False, ec=frame, lw=1.2))
    enlarged.set(xlim=corner[0] + np.array([0, width]), ylim=corner[1] + np.array([0, width]))
    bar = fig.colorbar(image, ax=panels, shrink=0.92 if beside is None else 0.46, pad=0.015, aspect=28)
    bar.set_label(f"height ({topography.height_unit})")
    return fig


def _view(run, at, topography):
    """Return the spots as circles (`wrap_circles`), and the lower left corner and the side of the enlarged window.

    The window is around the largest spot. All lengths are in the unit of the axes.
    """
    from icha.datasets.campaign import spots_of

    spots, side = spots_of(run, at), topography.side
    x, y, radius = (spots[f"spot_{name}"].values * topography.length for name in ("x", "y", "radius"))
    typical = float(np.sum(radius**3) / np.sum(radius**2)) if radius.any() else side
    zoom = _ZOOM
    while side / zoom > _WIDEST_IN_RADII * typical and len(topography.heights) / (2 * zoom) >= _LEAST_CELLS:
        zoom *= 2
    largest = np.argmax(radius) if len(radius) else None
    middle = np.array([side, side]) / 2 if largest is None else np.array([x[largest], y[largest]])
    corner = np.clip(middle - side / zoom / 2, 0, side - side / zoom)
    return wrap_circles(x, y, radius, side, str(run["boundary"].values)), corner, side / zoom


def _draw_boundary_elements(panels, topography, window, heights, beside, covered):
    """Draw the contact regions of boundary elements, the edges of these regions in the window, and the overlap."""
    from matplotlib.colors import LinearSegmentedColormap, to_rgb
    from matplotlib.patches import Patch

    from icha.analysis.model_error import jaccard

    (_, solution), (enlarged, compared) = panels
    fraction = beside["contact_map"].transpose("row", "column").values.astype(float)
    contact = fraction >= 0.5
    topography.draw(solution, **heights)
    black = LinearSegmentedColormap.from_list("contact", [(0, 0, 0, 0), (0, 0, 0, 1)])
    draw_map(solution, fraction, topography.side, cmap=black, vmin=0, vmax=1)
    nodes, borders = _window(fraction, topography.side, *window)
    enlarged.contour(nodes, [0.5], extent=borders, origin="lower", colors="black", linewidths=0.9)
    enlarged.legend(
        handles=[
            legend_handle(color=_RED, lw=1.0, label="asperities (edge)"),
            legend_handle(color="black", lw=0.9, label="boundary elements (edge)"),
        ],
        loc="upper center",
        bbox_to_anchor=(0.5, -0.17),
        ncols=2,
    )
    palette = np.array([to_rgb(colour) for _, colour in _STATES])
    draw_map(compared, palette[1 * covered + 2 * contact], topography.side)
    keys = [Patch(fc=colour, label=name) for name, colour in _STATES if name]
    compared.legend(handles=keys, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=3, columnspacing=1.0)
    solution.set_title(rf"{REFERENCE_NAME}, $A/A_0$ = {float(beside['contact_area_fraction']):.3f}", loc="right")
    compared.set_title(f"overlap (both / at least one) {jaccard(covered, contact):.2f}", loc="right")


def _window(nodes, side, corner, width):
    """Return the nodes of a periodic map that cover a window, and the coordinates of the four sides of this region."""
    cell = side / len(nodes)
    columns, rows = (
        np.arange(start, start + int(np.ceil(width / cell)) + 2) for start in np.floor(corner / cell).astype(int)
    )
    borders = tuple(float(edge) * cell for at in (columns, rows) for edge in (at[0] - 0.5, at[-1] + 0.5))
    return nodes[np.ix_(rows % len(nodes), columns % len(nodes))], borders
