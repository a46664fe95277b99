"""Fig. 4: contact spots, in their true size, over the topography."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.figures.select import find_snapshot, pick, spots_of, study_runs
from icha.figures.spots import draw_spots, periodic_circles
from icha.figures.style import TWO_COLUMNS, new_figure, number, panel_label, styled, unit_for

CAPTION = (
    "Contact spots (red circles, true size and position) over the topography of one period: the highest parts are "
    "yellow. The right-hand panel enlarges the framed part around the largest spot. The load is given above the map; "
    "circles that cross a border continue at the opposite one."
)

# Part of the period that the enlarged view shows.
_ZOOM = 0.25


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

    heights = surface["height"].transpose("y", "x").values * (float(run["rms_height"]) / float(surface["rms_height"]))
    spots = spots_of(run, at)
    length, length_unit = unit_for(period, "m")
    height, height_unit = unit_for(float(np.abs(heights).max()), "m")
    side = period * length

    fig = new_figure(TWO_COLUMNS, 3.35)
    left, right = fig.subplots(1, 2)
    scale = float(np.abs(heights).max()) * height
    # Nodes are the centres of the picture's cells; the first row and column come again at the far border.
    half = 0.5 * side / heights.shape[0]
    heights = np.pad(heights, (0, 1), mode="wrap")
    for ax in (left, right):
        image = ax.imshow(
            heights * height,
            origin="lower",
            extent=(-half, side + half, -half, side + half),
            cmap="cividis",
            vmin=-scale,
            vmax=scale,
            interpolation="nearest" if ax is right else "antialiased",
        )
        ax.set_xlabel(f"x ({length_unit})")
        ax.tick_params(direction="out", top=False, right=False)
    circles = list(
        periodic_circles(
            spots["spot_x"].values * length, spots["spot_y"].values * length, spots["spot_radius"].values * length, side
        )
    )
    draw_spots(left, circles, facecolor=(0.9, 0.0, 0.05, 0.85), edgecolor="black", lw=0.35)
    draw_spots(right, circles, facecolor=(0.9, 0.0, 0.05, 0.4), edgecolor=(0.75, 0, 0), lw=1.0)
    left.set_xlim(0, side)
    left.set_ylim(0, side)
    if len(spots["spot_radius"]):
        largest = int(np.argmax(spots["spot_radius"].values))
        middle = np.array([spots["spot_x"].values[largest], spots["spot_y"].values[largest]]) * length
    else:
        middle = np.array([side, side]) / 2
    window = _ZOOM * side
    corner = np.clip(middle - window / 2, 0, side - window)
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
    right.set_title(f"enlarged ×{1 / _ZOOM:g}", loc="right")
    return fig


def _frame(corner, size):
    from matplotlib.patches import Rectangle

    return Rectangle(corner, size, size, fill=False, ec="white", lw=1.2)
