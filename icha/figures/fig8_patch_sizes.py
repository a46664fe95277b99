"""Fig. 8: sizes of contact patches at one load, with and without adhesion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.figures.curves import add_snapshot_legend, say_snapshot_models, snapshot_looks
from icha.figures.drawn import plot, say
from icha.figures.ensembles import draw_members, join_bins
from icha.figures.looks import ASPERITIES_NAME, MODEL_MARKERS, REFERENCE_NAME, TRUTH_LINE
from icha.figures.select import select_snapshots
from icha.figures.style import TWO_COLUMNS, in_style, logarithmic_axes, new_panels
from icha.support.formatting import choose_unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


# Smallest number of patches in a bin of the density. Bins with fewer patches are joined with their neighbours.
_LEAST_PATCHES = 10
_BINS_PER_DECADE = 8
# Fewest bins for which a density is drawn.
_FEWEST_BINS = 3
# Width of the figure without the panel of the density, inches.
_ALONE = 4.5
# Largest number of points of a cumulative curve; more points would not be distinguishable.
_CURVE_POINTS = 300

_ABOVE = "number per nominal area of patches that are larger than A."


@in_style
def figure(campaign: xr.DataTree, *, study: str, kind: str | None = None, target: float | None = None) -> Figure:
    """Draw numbers of patches by size (means over seeds), for every material on a study's first surface and slope."""
    lines = select_snapshots(campaign, study, kind, target)
    each_look, looks = snapshot_looks(campaign, study, lines)
    factor, unit = choose_unit(float(lines[0].members[0][0]["period"]), "m")
    cell = (float(lines[0].members[0][0]["period"]) * factor) ** 2
    areas = [
        tuple([patch_areas(run, at) * factor**2 for run, at in members] for members in (line.members, line.truths))
        for line in lines
    ]
    # Without enough patches for a density, the figure has only the second panel.
    dense = max(len(patch_density(each, cell)[0]) for each, _ in areas) >= _FEWEST_BINS
    fig, [panels] = new_panels(3.1, columns=1 + dense, width=TWO_COLUMNS if dense else _ALONE, sharex=True)
    density = """number of patches per nominal area and per interval of the patch area A (a), where neighbouring
    intervals with few patches are joined, and """
    say(fig, "Sizes of the contact patches at the load given in the figure: " + (density if dense else "") + _ABOVE)
    say_snapshot_models(fig, lines, "Dashed lines")
    if any(line.truths for line in lines) or lines[0].runs.model_name != ASPERITIES_NAME:
        say(fig, "Patches of boundary elements are grid cells in contact that are connected by common edges.")
    if lines[0].runs.model_name == ASPERITIES_NAME:
        say(fig, "In the asperity model, united spots count as one patch.")
    for line, look, (own, true) in zip(lines, each_look, areas, strict=True):
        smooth = look | {"marker": "none", "lw": 1.4 * look["lw"]}
        drawn = [(patch_density, look, MODEL_MARKERS[REFERENCE_NAME]), (patches_above, smooth, "none")]
        for ax, (points, line_look, marker) in zip(panels, drawn[-len(panels) :], strict=True):
            name = line.runs.drawn_name
            draw_members(ax, *points(own, cell), line_look, positive=True, name=name, asked=line.runs.asked)
            if true:
                area, values = points(true, cell)
                plot(ax, area, values.mean(axis=0), line.truth_name, color=look["color"], marker=marker, **TRUTH_LINE)
    for ax in panels:
        logarithmic_axes(ax)
        ax.set_xlabel(f"patch area  $A$ ({unit}²)")
    panels[0].set_ylabel(f"number density  $n(A)$ ({unit}$^{{-4}}$)")
    panels[-1].set_ylabel(f"patches larger than $A$ ({unit}$^{{-2}}$)")
    add_snapshot_legend(fig, panels, campaign[study].to_dataset(), lines, looks)
    return fig


def patch_areas(run: xr.Dataset, snapshot: int) -> np.ndarray:
    """Return the areas in m² of the contact patches of one snapshot, in ascending order; zero areas are left out."""
    from icha.datasets.campaign import spots_of

    area = np.sort(np.pi * spots_of(run, snapshot)["spot_radius"].values ** 2)
    return area[area > 0]


def patch_density(areas: Sequence[np.ndarray], nominal_area: float) -> tuple[np.ndarray, np.ndarray]:
    """Return densities in bins of the patch area: number of patches, divided by nominal area and by bin width.

    Bins with few patches are joined.

    Parameters
    ----------
    areas : patch areas of every member of an ensemble, in ascending order.

    Returns
    -------
    The patch areas in the middle of k bins, and an array of shape (members, k): the densities of every member. The
    number of patches in a bin is density times bin width times nominal area.
    """
    pooled = np.sort(np.concatenate(areas))
    if not len(pooled):
        return np.empty(0), np.empty((len(areas), 0))
    highest = max(pooled[-1], np.nextafter(pooled[0], np.inf))
    count = max(int(np.ceil(np.log10(highest / pooled[0]) * _BINS_PER_DECADE)), 1)
    edges = np.geomspace(pooled[0], highest, count + 1)
    limits, densities = join_bins(edges, np.array([np.histogram(area, edges)[0] for area in areas]), _LEAST_PATCHES)
    return np.sqrt(limits[1:] * limits[:-1]), densities / nominal_area


def patches_above(areas: Sequence[np.ndarray], nominal_area: float) -> tuple[np.ndarray, np.ndarray]:
    """Return patch areas, and for each member the number of patches of at least each area, divided by the nominal area.

    The parameter `areas` has the same meaning as in `patch_density`.
    """
    pooled = np.sort(np.concatenate(areas))
    # The chosen numbers of patches are evenly spaced on a logarithmic axis, so that the largest patches are all shown.
    ranks = np.unique(np.rint(np.geomspace(1, len(pooled), _CURVE_POINTS)).astype(int)) if len(pooled) else []
    at = pooled[len(pooled) - np.asarray(ranks, int)[::-1]]
    return at, np.array([len(area) - np.searchsorted(area, at) for area in areas]) / nominal_area
