"""Fig. 4: contact spots, in their true size, over the topography."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.campaign import find_snapshot, spots_of
from icha.figures.select import pick, study_runs
from icha.figures.spots import draw_spots, periodic_circles
from icha.figures.style import TWO_COLUMNS, new_figure, number, panel_label, styled, unit_for

CAPTION = (
    "Contact spots (red circles, true size and position) over the topography of one period: the highest parts are "
    "yellow. The right-hand panel enlarges the framed part around the largest spot. The load is given above the map; "
    "circles that cross a border continue at the opposite one."
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


@styled
def figure(
    campaign: xr.DataTree,
    surface: xr.Dataset,
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
    study : name of the study.
    surface_name, seed, rms_slope, material : which run; what is left out is the study's first. For the material that
        is the first one with adhesion, if there is any.
    kind, target : which snapshot; the first one of this kind, or the first of all, if left out.

    Raises
    ------
    ValueError
        If there is no such run or snapshot, or the surface is another one.
    """
    runs = study_runs(campaign, study)
    runs = [(labels, run) for labels, run in runs if surface_name in (None, labels.surface)]
    runs = [(labels, run) for labels, run in runs if seed in (None, labels.seed)]
    runs = [(labels, run) for labels, run in runs if rms_slope is None or np.isclose(rms_slope, labels.rms_slope)]
    if not runs:
        raise ValueError(f"study {study}: no run of surface {surface_name}, seed {seed}, rms slope {rms_slope}")
    adhesive = [labels.material for labels, run in runs if float(run["surface_energy"]) > 0]
    materials = adhesive + [labels.material for labels, _ in runs]
    material = pick("material", material, materials)
    labels, run = next((labels, run) for labels, run in runs if labels.material == material)
    at = find_snapshot(run, kind, target)
    period = float(run["period"])
    if not np.isclose(float(surface["period"]), period, rtol=1e-9) or int(surface["grid"]) != int(run["grid"]):
        raise ValueError(f"{labels}: the surface given has another period or grid")
    if "seed" in surface and int(surface["seed"]) != labels.seed:
        raise ValueError(f"{labels}: the surface given has seed {int(surface['seed'])}")

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

    fig = new_figure(TWO_COLUMNS, 3.35)
    left, right = fig.subplots(1, 2)
    # Nodes are the centres of the picture's cells; the first row and column come again at the far border.
    cell = side / n
    look = {"origin": "lower", "cmap": "cividis", "vmin": -highest * height, "vmax": highest * height}
    whole = np.pad(_means(heights), (0, 1), mode="wrap") * (factor * height)
    reach = (-cell / 2, side - cell / 2 + side / (len(whole) - 1))
    image = left.imshow(whole, extent=reach * 2, interpolation="antialiased", **look)
    first = np.floor(corner / cell).astype(int)
    columns, rows = (np.arange(start, start + int(np.ceil(window / cell)) + 2) for start in first)
    part = _means(heights[np.ix_(rows % n, columns % n)]) * (factor * height)
    reach = [((nodes[0] - 0.5) * cell, (nodes[-1] + 0.5) * cell) for nodes in (columns, rows)]
    right.imshow(part, extent=(*reach[0], *reach[1]), interpolation="nearest", **look)
    for ax in (left, right):
        ax.set_xlabel(f"x ({length_unit})")
        ax.tick_params(direction="out", top=False, right=False)
    circles = periodic_circles(spots["spot_x"].values * length, spots["spot_y"].values * length, radius * length, side)
    outlines = np.minimum(_OUTLINE * _PANEL / side * circles[:, 2], _WIDEST_OUTLINE)
    many = len(circles) > _MANY_SPOTS
    draw_spots(left, circles, facecolor=(0.9, 0.0, 0.05, 0.85), edgecolor="black", lw=outlines, rasterized=many)
    near = np.all(np.abs(circles[:, :2] - (corner + window / 2)) < window / 2 + circles[:, 2:], axis=1)
    draw_spots(right, circles[near], facecolor=(0.9, 0.0, 0.05, 0.4), edgecolor=(0.75, 0, 0), lw=1.0)
    left.set_xlim(0, side)
    left.set_ylim(0, side)
    right.set_xlim(corner[0], corner[0] + window)
    right.set_ylim(corner[1], corner[1] + window)
    left.set_ylabel(f"y ({length_unit})")
    left.add_patch(_frame(corner, window))
    bar = fig.colorbar(image, ax=[left, right], shrink=0.92, pad=0.015, aspect=28)
    bar.set_label(f"height ({height_unit})")
    step = int(run["snapshot_step"].values[at])
    load = float(run["reduced_pressure"].values[step])
    area = float(run["contact_area_fraction"].values[step])
    panel_label(left, "a")
    panel_label(right, "b")
    left.set_title(
        rf"$F/(E^{{\ast}}h_{{\mathrm{{rms}}}}^{{\prime}}A_0)$ = {number(load)}, $A/A_0$ = {area:.3f}", loc="right"
    )
    right.set_title(f"enlarged ×{zoom}", loc="right")
    return fig


def _means(heights):
    """Means over blocks of nodes, as near to equal as can be, where there are too many to be drawn."""
    count = min(len(heights), _MOST_CELLS)
    if count == len(heights):
        return heights
    starts = np.arange(count) * len(heights) // count
    width = np.diff(starts, append=len(heights))
    return np.add.reduceat(np.add.reduceat(heights, starts, axis=1), starts, axis=0) / np.outer(width, width)


def _frame(corner, size):
    from matplotlib.patches import Rectangle

    return Rectangle(corner, size, size, fill=False, ec="white", lw=1.2)
