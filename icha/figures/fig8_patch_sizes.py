"""Fig. 8: how large the contact patches are at one load, with and without adhesion."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.campaign import spots_of
from icha.figures.select import first_line_runs, snapshot_label
from icha.figures.style import TWO_COLUMNS, line_look, material_label, new_figure, panel_label, styled, unit_for

CAPTION = (
    "Sizes of the contact patches, the areas A of the spots (united ones count as one), at the load given in the "
    "figure; open markers are without adhesion. Number density n(A) per area of a patch and nominal area (a), bins "
    "with few patches being joined; number of patches larger than A per nominal area (b), down to the largest one."
)

# Patches per plotted point of the density: bins with less are joined with their neighbours.
_LEAST_PATCHES = 10
_BINS_PER_DECADE = 8
# Points of a cumulative curve; more cannot be told apart.
_CURVE_POINTS = 300


@styled
def figure(
    campaign: xr.DataTree,
    *,
    study: str,
    kind: str | None = None,
    target: float | None = None,
) -> Figure:
    """Draw the patch sizes of every material on the first surface, seed and slope of a study.

    Parameters
    ----------
    campaign : the campaign dataset.
    study : name of the study.
    kind, target : which snapshot; the first one of this kind, or the first of all, if left out.

    Raises
    ------
    ValueError
        If there is no such study or snapshot.
    """
    runs = first_line_runs(campaign, study, kind, target)
    dataset = campaign[study].to_dataset()
    fig = new_figure(TWO_COLUMNS, 3.1)
    left, right = fig.subplots(1, 2, sharex=True)
    for k, (labels, run, at) in enumerate(runs):
        factor, unit = unit_for(float(run["period"]), "m")
        cell = (float(run["period"]) * factor) ** 2
        area = patch_areas(run, at) * factor**2
        look = line_look(k, adhesive=float(run["surface_energy"]) > 0)
        look["label"] = material_label(dataset, labels.material)
        left.loglog(*patch_density(area, cell), **look)
        right.loglog(*patches_above(area, cell), **look | {"marker": "none", "lw": 1.2})
        shown = snapshot_label(run, at)
    left.set_xlabel(f"patch area  $A$ ({unit}²)")
    right.set_xlabel(f"patch area  $A$ ({unit}²)")
    left.set_ylabel(f"number density  $n(A)$ ({unit}$^{{-4}}$)")
    right.set_ylabel(f"patches larger than $A$ ({unit}$^{{-2}}$)")
    left.set_title(shown, loc="right")
    left.legend(loc="best")
    right.legend(loc="lower left")
    for ax, letter in ((left, "a"), (right, "b")):
        panel_label(ax, letter)
    return fig


def patch_areas(run: xr.Dataset, snapshot: int) -> np.ndarray:
    """Areas of the contact patches of one snapshot, m², increasing; spots that just touch have none."""
    area = np.sort(np.pi * spots_of(run, snapshot)["spot_radius"].values ** 2)
    return area[area > 0]


def patch_density(area: np.ndarray, nominal_area: float) -> tuple[np.ndarray, np.ndarray]:
    """Areas, and number of patches per area of a patch and nominal area; thinly filled bins are joined.

    The sum of density times width times nominal area over the points is the number of patches.
    """
    if not len(area):
        return np.empty(0), np.empty(0)
    decades = np.log10([area[0], area[-1]])
    count = max(int(np.ceil((decades[1] - decades[0]) * _BINS_PER_DECADE)), 1)
    edges = np.logspace(*decades, count + 1) if count > 1 else np.array([area[0], area[-1] * (1 + 1e-9)])
    edges[0], edges[-1] = area[0], max(area[-1], np.nextafter(area[0], np.inf))
    number, _ = np.histogram(area, edges)
    # A bin ends where enough patches are gathered; what is left over at the end belongs to the last one.
    ends, gathered = [], 0
    for k, here in enumerate(number):
        gathered += here
        if gathered >= _LEAST_PATCHES:
            ends.append(k + 1)
            gathered = 0
    ends = [*ends[:-1], count] if ends else [count]
    limits = edges[[0, *ends]]
    number = np.add.reduceat(number, [0, *ends[:-1]])
    return np.sqrt(limits[1:] * limits[:-1]), number / (np.diff(limits) * nominal_area)


def patches_above(area: np.ndarray, nominal_area: float) -> tuple[np.ndarray, np.ndarray]:
    """Areas, and number of patches at least that large per nominal area, from all patches to the largest one."""
    above = np.arange(len(area), 0, -1)
    # Evenly spaced on the logarithmic axis of the number, so that the few largest patches are all there.
    kept = np.unique(np.rint(np.geomspace(1, len(area), _CURVE_POINTS)).astype(int)) if len(area) else []
    at = len(area) - np.asarray(kept, int)[::-1]
    return area[at], above[at] / nominal_area
