"""What a page for exploring shows of a contact: topography, curves, and spots or patches and distributions.

Arrays are kept as the text of their bytes, in base64: single precision but for heights, of which a byte each is kept.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from icha.contact.models import model_of
from icha.datasets.attributes import why_no_result
from icha.datasets.campaign import reduced_gap, spots_of
from icha.figures.fig3_distributions import gap_densities, joined_pressure_densities, pressure_densities
from icha.figures.fig8_patch_sizes import patch_areas, patch_density, patches_above
from icha.figures.maps import block_means
from icha.path.targets import BETWEEN

# Cells along an edge of a topography and of a map of contact, of which patches are finer than the topography.
MOST_HEIGHTS, MOST_CELLS = 256, 512
# Bins of the pressure with less than this part of the highest density are not shown: JKR's tail has no end.
LEAST_DENSITY = 1e-3
_LEVELS = 255


def floats(values: np.ndarray) -> str:
    """Numbers as the base64 text of their bytes, little-endian and in single precision."""
    return base64.b64encode(np.asarray(values, "<f4").tobytes()).decode("ascii")


def topography(surface: xr.Dataset) -> dict:
    """Heights of a surface file in units of its rms height: means over blocks of nodes, in 256 levels."""
    heights = surface["height"].transpose("y", "x").values / float(surface["rms_height"])
    shown = block_means(heights, MOST_HEIGHTS)
    low, high = float(shown.min()), float(shown.max())
    levels = np.rint((shown - low) / (high - low) * _LEVELS).astype(np.uint8)
    return {
        "grid": len(heights),
        "cells": len(shown),
        "low": low,
        "high": high,
        "levels": base64.b64encode(levels.tobytes()).decode("ascii"),
    }


def run_entry(run: xr.Dataset, maps: Sequence[str] | None) -> dict:
    """The curves of a run and its snapshots.

    Parameters
    ----------
    run : a run as in a campaign dataset, with at least one step.
    maps : of boundary elements, the `picture` of every snapshot; None of asperities, whose spots are in the run, and
        where the file with the maps is not there.
    """
    kinds, targets = run["step_kind"].values.astype(str), run["step_target"].values
    return {
        "failure": why_no_result(run.attrs),
        "period": float(run["period"]),
        "periodic": str(run["boundary"].values) == "periodic",
        "grid": int(run["grid"]),
        "rms_height": float(run["rms_height"]),
        "pressure": floats(run["reduced_pressure"]),
        "area": floats(run["contact_area_fraction"]),
        "gap": floats(reduced_gap(run)),
        "spots": run["spot_count"].values.tolist(),
        "leg": run["leg"].values.tolist(),
        "stops": [
            None if kind == BETWEEN else f"{kind} {target:.6g}" for kind, target in zip(kinds, targets, strict=True)
        ],
        "snapshots": [_snapshot(run, k, maps) for k in range(run.sizes["snapshot"])],
    }


def _snapshot(run, at, maps):
    """Spots or patches of a snapshot, and the distributions that figures 3 and 8 show."""
    step = int(run["snapshot_step"].values[at])
    cell = float(run["period"]) ** 2
    areas = [patch_areas(run, at)]
    found = {
        "step": step,
        "gap": _points(gap_densities([(run, at)])),
        "pressure": _pressures(run, at),
        "sizes": _points(patch_density(areas, cell)),
        "larger": _points(patches_above(areas, cell)),
    }
    if maps is not None:
        return found | {"map": maps[at]}
    if model_of(run.attrs).by_cells:
        return found
    spots = spots_of(run, at)
    return found | {"circles": [floats(spots[f"spot_{name}"]) for name in ("x", "y", "radius")]}


def _points(curve):
    """Points of the curve of a single run."""
    x, (y,) = curve
    return [floats(x), floats(y)]


def _pressures(run, at):
    """Points of the density of the pressure, without its thinnest tail; bins of few nodes are joined."""
    densities = joined_pressure_densities if model_of(run.attrs).by_cells else pressure_densities
    pressure, (density,) = densities([(run, at)])
    shown = density > LEAST_DENSITY * density.max(initial=0)
    return [floats(pressure[shown]), floats(density[shown])]


def picture(contact: np.ndarray) -> str:
    """A map of contact as a PNG in base64, its first row at the bottom: the part of a cell in contact as its opacity.

    contact : (n, n), from 0 to 1, along y and x.
    """
    from PIL import Image

    part = block_means(np.asarray(contact, float), MOST_CELLS)[::-1]
    levels = np.rint(part * _LEVELS).astype(np.uint8)
    image = Image.frombytes("P", levels.shape, levels.tobytes())
    image.putpalette(CONTACT_COLOUR * (_LEVELS + 1))
    file = io.BytesIO()
    image.save(file, "PNG", transparency=bytes(range(_LEVELS + 1)))
    return base64.b64encode(file.getvalue()).decode("ascii")


# Red, green and blue of contact, for spots and patches alike.
CONTACT_COLOUR = (230, 0, 13)


def partners(one: Mapping, other: Mapping) -> list[int]:
    """For every step of a run the step of another at the same state of the path, or -1 where it has none.

    A stop is the one on the same leg that was asked for; an equilibrium between stops has for its partner the one on
    the same leg at the nearest mean separation.

    Parameters
    ----------
    one, other : runs, of which `step_kind`, `step_target`, `leg` and `mean_separation` are used.
    """
    kinds, others = ([str(kind) for kind in run["step_kind"].values] for run in (one, other))
    asked = zip(other["leg"].values.tolist(), others, other["step_target"].values.tolist(), strict=True)
    stops = {stop: k for k, stop in enumerate(asked) if stop[1] != BETWEEN}
    legs, separations = other["leg"].values, other["mean_separation"].values
    found = []
    for k, (leg, kind, target) in enumerate(
        zip(one["leg"].values.tolist(), kinds, one["step_target"].values.tolist(), strict=True)
    ):
        same = np.flatnonzero(legs == leg)
        if kind != BETWEEN:
            found.append(stops.get((leg, kind, target), -1))
        elif len(same):
            distance = np.abs(separations[same] - float(one["mean_separation"].values[k]))
            found.append(int(same[np.argmin(distance)]))
        else:
            found.append(-1)
    return found
