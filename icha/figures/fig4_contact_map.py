"""Fig. 4: contact spots, in their true size, over the topography."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.colors import LinearSegmentedColormap, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from icha.analysis.model_error import check_same_contact, contact_of_spots, jaccard, state_of
from icha.datasets.campaign import find_snapshot, spots_of
from icha.figures.select import check_topography, pick_run
from icha.figures.spots import circles_in_cell, draw_spots
from icha.figures.style import BLUE, TWO_COLUMNS, VERMILLION, new_figure, number, panel_label, styled, unit_for

CAPTION = (
    "Contact spots (red circles, true size and position) over the topography, of which the highest parts are "
    "yellow: one period of a periodic surface, where circles that cross a border continue at the opposite one, or the "
    "whole of a free square, where they end beyond its edges. The load is given above the map. The framed part around "
    "the largest spot is enlarged. Where there is a boundary-element solution of the same topography, load "
    "and interaction range, by an independent code, its contact stands beside that of ICHA (b), its edge (black) "
    "beside the enlarged circles (c), and the map (d) shows where both are in contact and where only one of them is; "
    "the overlap is the area in contact in both over that in either. The areas given are corrected by the perimeter of "
    "the contact for boundary elements. At the ranges that a grid resolves these show practically no hysteresis, so "
    "that with adhesion they bound the limit of short ranges (JKR), and do not prove it."
)

# The enlarged view shows a quarter of the period, halved as often as it is wider than so many radii of the spots, and
# at least so many cells.
_ZOOM = 4
_WIDEST_IN_RADII = 40
_LEAST_CELLS = 64
# More cells a side than this cannot be told apart in a panel.
_MOST_CELLS = 1024
# More spots than this are drawn as an image in PDF files as well.
_MANY_SPOTS = 2000
# Outline of a spot in the map, as part of its radius, so that it does not hide small ones, and at most, in points; and
# points to the side of the map, about.
_OUTLINE = 0.25
_WIDEST_OUTLINE = 0.35
_PANEL = 190
_RED = (0.9, 0.0, 0.05)
_TRANSPARENT_TO_RED = LinearSegmentedColormap.from_list("contact", [(*_RED, 0.0), (*_RED, 0.9)])
# What is in contact at a node: nothing, ICHA, boundary elements, both.
_STATES = (("", "0.94"), ("ICHA only", VERMILLION), ("boundary elements only", BLUE), ("both", "0.35"))


@styled
def figure(
    campaign: xr.DataTree,
    surface: xr.Dataset,
    solution: xr.Dataset | None = None,
    *,
    study: str,
    surface_name: str | None = None,
    seed: int | None = None,
    rms_slope: float | None = None,
    material: str | None = None,
    kind: str | None = None,
    target: float | None = None,
) -> Figure:
    """Draw the spots of one snapshot of one run.

    Parameters
    ----------
    campaign : the campaign dataset.
    surface : the surface file's dataset; it must be the topography of the run that is drawn.
    solution : boundary elements (`icha.references.boundary_elements`) of the state that is drawn, if there are any.
    study : name of the study.
    surface_name, seed, rms_slope, material : which run; what is left out is the study's first. For the material that
        is the first one with adhesion, if there is any.
    kind, target : which snapshot; the first one of this kind, or the first of all, if left out.

    Raises
    ------
    ValueError
        If there is no such run or snapshot, or the surface or the solution is another one's.
    """
    asked = {"surface": surface_name, "seed": seed, "rms_slope": rms_slope, "material": material}
    labels, run = pick_run(campaign, study, **asked)
    at = find_snapshot(run, kind, target)
    period = float(run["period"])
    check_topography(labels, run, surface)

    if solution is not None:
        try:
            check_same_contact(run, solution)
        except ValueError as error:
            raise ValueError(f"{labels}: the boundary elements given are of another contact: {error}") from None
        shown, solved = float(state_of(run, at)["reduced_pressure"]), float(solution["target_reduced_pressure"])
        if not np.isclose(shown, solved, rtol=1e-6):
            raise ValueError(f"{labels}: boundary elements of reduced pressure {solved:g} for a snapshot at {shown:g}")

    heights = surface["height"].transpose("y", "x").values
    factor = float(run["rms_height"]) / float(surface["rms_height"])
    spots = spots_of(run, at)
    radius = spots["spot_radius"].values
    length, length_unit = unit_for(period, "m")
    highest = max(float(heights.max()), -float(heights.min())) * factor
    height, height_unit = unit_for(highest, "m")
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
        middle = np.array([spots["spot_x"].values[largest], spots["spot_y"].values[largest]]) * length
    corner = np.clip(middle - window / 2, 0, side - window)

    cell = side / n
    look = {"origin": "lower", "cmap": "cividis", "vmin": -highest * height, "vmax": highest * height}
    x, y = spots["spot_x"].values * length, spots["spot_y"].values * length
    circles = circles_in_cell(x, y, radius * length, side, str(run["boundary"].values))
    near = circles[np.all(np.abs(circles[:, :2] - (corner + window / 2)) < window / 2 + circles[:, 2:], axis=1)]

    fig = new_figure(TWO_COLUMNS, 3.35 if solution is None else 6.9)
    panels = fig.subplots(1 if solution is None else 2, 2, squeeze=False)
    whole, enlarged = panels[0, 0], panels[0, 1] if solution is None else panels[1, 0]
    topography = _means(heights) * (factor * height)
    image = _show_whole(whole, topography, n, side, **look)
    outlines = np.minimum(_OUTLINE * _PANEL / side * circles[:, 2], _WIDEST_OUTLINE)
    many = len(circles) > _MANY_SPOTS
    draw_spots(whole, circles, facecolor=(*_RED, 0.85), edgecolor="black", lw=outlines, rasterized=many)
    part, borders = _window(heights, cell, corner, window)
    enlarged.imshow(_means(part) * (factor * height), extent=borders, interpolation="nearest", **look)
    draw_spots(enlarged, near, facecolor=(*_RED, 0.4), edgecolor=(0.75, 0, 0), lw=1.0)

    step = int(run["snapshot_step"].values[at])
    load = number(float(run["reduced_pressure"].values[step]))
    area = float(run["contact_area_fraction"].values[step])
    load = rf"$F/(E^{{\ast}}h_{{\mathrm{{rms}}}}^{{\prime}}A_0)$ = {load}"
    area = rf"$A/A_0$ = {area:.3f}"
    enlarged.set_title(f"enlarged ×{zoom}", loc="right")
    if solution is None:
        whole.set_title(f"{load}, {area}", loc="right")
    else:
        beside, compared = panels[0, 1], panels[1, 1]
        contact = solution["contact"].transpose("y", "x").values == 1
        spots_cover = contact_of_spots(run, at, len(contact))
        fine = len(contact)
        _show_whole(beside, topography, n, side, **look)
        red = {"origin": "lower", "cmap": _TRANSPARENT_TO_RED, "vmin": 0, "vmax": 1}
        _show_whole(beside, _means(contact.astype(float)), fine, side, **red)
        own, borders = _window(contact, side / fine, corner, window)
        enlarged.contour(own, [0.5], extent=borders, origin="lower", colors="black", linewidths=0.9)
        palette = np.array([to_rgb(colour) for _, colour in _STATES])
        _show_whole(compared, _means(palette[1 * spots_cover + 2 * contact]), fine, side, origin="lower")
        keys = [Patch(fc=colour, label=name) for name, colour in _STATES if name]
        compared.legend(handles=keys, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=3, columnspacing=1.0)
        fig.suptitle(load, fontsize="medium")
        whole.set_title(f"ICHA, {area}", loc="right")
        truth = float(solution["contact_area_fraction"])
        beside.set_title(rf"boundary elements, $A/A_0$ = {truth:.3f}", loc="right")
        compared.set_title(f"overlap {jaccard(spots_cover, contact):.2f}", loc="right")

    for ax, letter in zip(panels.ravel(), "abcd", strict=False):
        panel_label(ax, letter)
        ax.tick_params(direction="out", top=False, right=False)
        start, width = (corner, window) if ax is enlarged else (np.zeros(2), side)
        ax.set_xlim(start[0], start[0] + width)
        ax.set_ylim(start[1], start[1] + width)
        if ax is not enlarged:
            frame = "white" if ax.get_images()[0].get_array().ndim == 2 else "black"
            ax.add_patch(Rectangle(corner, window, window, fill=False, ec=frame, lw=1.2))
    for ax in panels[:, 0]:
        ax.set_ylabel(f"y ({length_unit})")
    for ax in panels[-1]:
        ax.set_xlabel(f"x ({length_unit})")
    bar = fig.colorbar(image, ax=panels, shrink=0.92 if solution is None else 0.46, pad=0.015, aspect=28)
    bar.set_label(f"height ({height_unit})")
    return fig


def _show_whole(axes, means, n, side, **look):
    """Show a periodic map of n nodes a side, or `_means` of it; the first row and column come again at the far border.

    Nodes are the centres of the picture's cells.
    """
    drawn = np.pad(means, [(0, 1), (0, 1), (0, 0)][: means.ndim], mode="wrap")
    half = side / n / 2
    borders = (-half, side - half + side / (len(drawn) - 1))
    return axes.imshow(drawn, extent=borders * 2, interpolation="antialiased", **look)


def _window(nodes, cell, corner, window):
    """The nodes of a periodic map that lie in a square window, and where their cells begin and end in x and in y."""
    first = np.floor(corner / cell).astype(int)
    columns, rows = (np.arange(start, start + int(np.ceil(window / cell)) + 2) for start in first)
    borders = tuple(float(edge) * cell for at in (columns, rows) for edge in (at[0] - 0.5, at[-1] + 0.5))
    return nodes[np.ix_(rows % len(nodes), columns % len(nodes))], borders


def _means(nodes):
    """Means over blocks of nodes, as near to equal as can be, where there are too many to be drawn."""
    count = min(len(nodes), _MOST_CELLS)
    if count == len(nodes):
        return nodes
    starts = np.arange(count) * len(nodes) // count
    width = np.diff(starts, append=len(nodes))
    sums = np.add.reduceat(np.add.reduceat(nodes, starts, axis=1), starts, axis=0)
    return (sums.T / np.outer(width, width)).T
