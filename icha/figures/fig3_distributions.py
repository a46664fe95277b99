"""Fig. 3: distributions of gap and contact pressure at one load, with and without adhesion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.datasets.variables.model_error import SHORT_RANGE
from icha.figures.curves import add_snapshot_legend, drop_rounding_errors, snapshot_looks
from icha.figures.declaration import Declaration, SnapshotFigure
from icha.figures.ensembles import draw_members
from icha.figures.looks import MODEL_MARKERS, TRUTH_LINE
from icha.figures.select import select_snapshots
from icha.figures.style import BLACK, in_style, logarithmic_axes, new_panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


DECLARATION = Declaration(
    description="Distributions of gap and pressure of every material, on the study's first surface.",
    options=SnapshotFigure,
)

# Least number of sampled gaps in a plotted point; bins with fewer are joined with their neighbours.
_LEAST_CELLS = 100
# The same for nodes in contact, which are few.
_LEAST_NODES = 25
# Largest number of markers of boundary elements.
_BESIDE_MARKERS = 14


@in_style
def figure(campaign: xr.DataTree, *, study: str, kind: str | None = None, target: float | None = None) -> Figure:
    """Draw the distributions of every material on the first surface and slope of a study, means over the seeds."""
    from icha.analysis.model_error import state_of

    lines = select_snapshots(campaign, study, kind, target)
    each_look, looks = snapshot_looks(campaign, study, lines)
    fig, [(left, right)] = new_panels(3.1)
    lowest, highest, top, floor = -0.3, 0.3, 0.0, []
    for line, look in zip(lines, each_look, strict=True):
        u, densities = gap_densities(line.members)
        drawn = {"positive": True, "lines": len(lines), "asked": line.runs.asked}
        draw_members(left, u, densities, look, **drawn)
        floor.append(drop_rounding_errors(densities.mean(axis=0)).min())
        p, densities = pressure_densities(line.members)
        draw_members(right, p, densities, look, **drawn)
        density = densities.mean(axis=0)
        shown = p[density > 1e-3 * density.max(initial=0)]
        lowest, highest = shown.min(initial=lowest), shown.max(initial=highest)
        top = density.max(initial=top)
        for ax, densities_of in ((left, gap_densities), (right, joined_pressure_densities)) if line.truths else ():
            at, densities = densities_of(line.truths)
            dashed = TRUTH_LINE | {"color": look["color"], "marker": MODEL_MARKERS[SHORT_RANGE]}
            ax.plot(at, densities.mean(axis=0), markevery=1 + len(at) // _BESIDE_MARKERS, **dashed)
            top = densities.mean(axis=0).max(initial=top) if ax is right else top
    logarithmic_axes(left)
    logarithmic_axes(right, "y")
    left.set_ylim(min(floor) / 2)
    load = np.mean([float(state_of(run, at)["reduced_pressure"]) for run, at in lines[-1].members])
    _finish(left, right, (lowest, highest), top, load)
    add_snapshot_legend(fig, [left, right], campaign[study].to_dataset(), lines, looks)
    return fig


def _finish(left, right, pressures, highest, load):
    """Label both panels; draw Persson's theory at a reduced pressure and set the limits of the panel of pressures."""
    from icha.references.persson import persson_pressure_density

    if load > 0:
        p = np.linspace(0.002, pressures[1], 300)
        right.semilogy(p, persson_pressure_density(p, load), "-", color=BLACK, lw=0.9, label="Persson", zorder=2)
    right.set_xlim(1.05 * np.array(pressures))
    if highest > 0:
        right.set_ylim(highest * 5e-5, highest * 3)
    right.axvline(0, color="0.75", lw=0.6, zorder=0)
    unit = r"E^{\ast}h_{\mathrm{rms}}^{\prime}"
    left.set(xlabel=r"gap  $u/h_{\mathrm{rms}}$", ylabel=r"$P(u)\; h_{\mathrm{rms}}$")
    right.set(xlabel=f"contact pressure  $p/({unit})$", ylabel=rf"$P(p)\; {unit}$")


def gap_densities(members: Sequence[tuple[xr.Dataset, int]]) -> tuple[np.ndarray, np.ndarray]:
    """Return u/h_rms (k,) and P(u) h_rms (members, k) of snapshots; bins with few cells are joined.

    Raises
    ------
    ValueError
        If the distributions are empty.
    """
    (first, _), *_ = members
    heights = [float(run["rms_height"]) for run, _ in members]
    densities = np.array([run["gap_density"].values[at] * h for (run, at), h in zip(members, heights, strict=True)])
    # The first bin begins at zero, which a logarithmic axis does not show.
    edges = (first["gap_bin_edges"].values / heights[0])[1:]
    low, high, densities = _join_bins(edges, densities[:, 1:] * np.diff(edges), _LEAST_CELLS / int(first["grid"]) ** 2)
    if not len(low):
        raise ValueError("the gap distribution is empty")
    return np.sqrt(low * high), densities


def pressure_densities(members: Sequence[tuple[xr.Dataset, int]]) -> tuple[np.ndarray, np.ndarray]:
    """Return p/(E* h'_rms) (k,) and P(p) E* h'_rms (members, k) of the bins of snapshots that are not empty."""
    edges, densities = _reduced_pressure_densities(members)
    filled = densities.max(axis=0) > 0
    return (0.5 * (edges[1:] + edges[:-1]))[filled], densities[:, filled]


def joined_pressure_densities(members: Sequence[tuple[xr.Dataset, int]]) -> tuple[np.ndarray, np.ndarray]:
    """Return the same as `pressure_densities` with bins joined, for boundary elements with few nodes in contact."""
    edges, densities = _reduced_pressure_densities(members)
    content = densities * np.diff(edges)
    filled = np.flatnonzero(content.any(axis=0))
    if not len(filled):  # before first contact
        return np.empty(0), np.empty((len(densities), 0))
    inside, least = slice(filled[0], filled[-1] + 1), _LEAST_NODES / int(members[0][0]["grid"]) ** 2
    low, high, joined = _join_bins(edges[filled[0] : filled[-1] + 2], content[:, inside], least)
    return 0.5 * (low + high), joined


def _reduced_pressure_densities(members):
    """Return edges of the bins of p/(E* h'_rms), and P(p) E* h'_rms (members, bins)."""
    (first, _), *_ = members
    unit = float(first["contact_modulus"]) * float(first["rms_slope"])
    return first["pressure_bin_edges"].values / unit, np.array(
        [run["pressure_density"].values[at] * unit for run, at in members]
    )


def _join_bins(edges, contents, least):
    """Join bins until the members together have a content of `least` in each; return edges and densities."""
    bounds, gathered = [0], 0.0
    for k, content in enumerate(contents.sum(axis=0)):
        gathered += content
        if gathered >= least:
            bounds.append(k + 1)
            gathered = 0.0
    low, high = edges[bounds[:-1]], edges[bounds[1:]]
    cumulative = np.concatenate([np.zeros((len(contents), 1)), np.cumsum(contents, axis=1)], axis=1)
    return low, high, np.diff(cumulative[:, bounds], axis=1) / (high - low)
