"""Fig. 3: distributions of gap and contact pressure at one load, with and without adhesion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.datasets import results
from icha.datasets.variables.model_error import FINITE_RANGE, SHORT_RANGE
from icha.figures.curves import add_snapshot_legend, drop_rounding_errors, snapshot_looks
from icha.figures.declaration import Campaign, Declaration, Inputs, SnapshotFigure, finite_range_error
from icha.figures.ensembles import draw_members
from icha.figures.looks import MODEL_MARKERS, TRUTH_LINE
from icha.figures.select import errors_of_run, finite_range_errors, select_snapshots
from icha.figures.style import BLACK, in_style, logarithmic_axes, new_panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def inputs(campaign: Campaign, options: SnapshotFigure, files: results.ResultFiles) -> Inputs:
    """Return the runs, and boundary elements at a finite range beside them, if there are any."""
    return {"campaign": files.path(results.DATASET)} | finite_range_error(campaign, options.study, files)


DECLARATION = Declaration(
    description="Distributions of gap and pressure of every material, on the study's first surface.",
    options=SnapshotFigure,
    inputs=inputs,
)

# Least number of sampled gaps in a plotted point; bins with fewer are joined with their neighbours.
_LEAST_CELLS = 100
# The same for nodes in contact, which are few.
_LEAST_NODES = 25
_MOST_MARKERS, _BESIDE_MARKERS = 40, 14


@in_style
def figure(
    campaign: xr.DataTree,
    model_error: xr.DataTree | None = None,
    *,
    study: str,
    kind: str | None = None,
    target: float | None = None,
) -> Figure:
    """Draw the distributions of every material on the first surface and slope of a study, means over the seeds.

    Parameters
    ----------
    campaign : the campaign dataset.
    model_error : boundary elements at a finite range (`icha.analysis.model_error.model_error`), if any, of the states
        that those in the limit of a short range lack.
    """
    from icha.analysis.model_error import state_of

    lines = select_snapshots(campaign, study, kind, target)
    dataset = campaign[study].to_dataset()
    each_look, looks = snapshot_looks(campaign, study, lines)
    fig, [(left, right)] = new_panels(3.1)
    lowest, highest, top, names, floor = -0.3, 0.3, 0.0, [], []
    for line, look in zip(lines, each_look, strict=True):
        u, densities = gap_densities(line.members)
        drawn = {"positive": True, "lines": len(lines), "asked": line.runs.asked}
        draw_members(left, u, densities, look, **drawn, markevery=1 + len(u) // _MOST_MARKERS)
        floor.append(drop_rounding_errors(densities.mean(axis=0)).min())
        p, densities = pressure_densities(line.members)
        draw_members(right, p, densities, look, **drawn, markevery=3)
        density = densities.mean(axis=0)
        shown = p[density > 1e-3 * density.max(initial=0)]
        lowest, highest = shown.min(initial=lowest), shown.max(initial=highest)
        top = density.max(initial=top)
        loads = [float(state_of(run, at)["reduced_pressure"]) for run, at in line.members]
        load = float(np.mean(loads))
        solutions = _solutions(finite_range_errors(model_error, study), line.runs, loads)
        truth = _boundary_elements(line.truths, solutions)
        if truth:
            names.append(truth.name)
            top = max(top, truth.pressures[1].max(initial=0.0))
            dashed = TRUTH_LINE | {"color": look["color"], "marker": MODEL_MARKERS[truth.name]}
            for ax, (at, density) in ((left, truth.gaps), (right, truth.pressures)):
                ax.plot(at, density, markevery=1 + len(at) // _BESIDE_MARKERS, **dashed)
    logarithmic_axes(left)
    logarithmic_axes(right, "y")
    left.set_ylim(min(floor) / 2)
    _finish(left, right, (lowest, highest), top, load)
    add_snapshot_legend(fig, [left, right], dataset, lines, looks, dict.fromkeys(names))
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


class _Distributions(NamedTuple):
    """Distributions of boundary elements.

    Attributes
    ----------
    name : name of the boundary elements in legends.
    gaps : u/h_rms and P(u) h_rms.
    pressures : p/(E* h'_rms) and P(p) E* h'_rms.
    """

    name: str
    gaps: tuple[np.ndarray, np.ndarray]
    pressures: tuple[np.ndarray, np.ndarray]


def _boundary_elements(truths, solutions):
    """Return means over the seeds of runs in the limit of a short range, or else of solutions, if there are any."""
    if truths:
        name, distributions = SHORT_RANGE, (gap_densities(truths), joined_pressure_densities(truths))
    elif solutions:
        first, grid = solutions[0], int(solutions[0]["solution_grid"])
        name, distributions = (
            FINITE_RANGE,
            [
                join(
                    first[f"{quantity}_bin_edges"].values,
                    np.array([solution[f"{quantity}_density"].values for solution in solutions]),
                    grid,
                )
                for quantity, join in (("gap", _gap_densities), ("pressure", _pressure_densities))
            ],
        )
    else:
        return None
    return _Distributions(name, *((at, densities.mean(axis=0)) for at, densities in distributions))


def gap_densities(members: Sequence[tuple[xr.Dataset, int]]) -> tuple[np.ndarray, np.ndarray]:
    """Return u/h_rms (k,) and P(u) h_rms (members, k) of snapshots; bins with few cells are joined.

    Raises
    ------
    ValueError
        If the distributions are empty.
    """
    (first, _), *_ = members
    heights = [float(run["rms_height"]) for run, _ in members]
    densities = [run["gap_density"].values[at] * height for (run, at), height in zip(members, heights, strict=True)]
    return _gap_densities(first["gap_bin_edges"].values / heights[0], np.array(densities), int(first["grid"]))


def pressure_densities(members: Sequence[tuple[xr.Dataset, int]]) -> tuple[np.ndarray, np.ndarray]:
    """Return p/(E* h'_rms) (k,) and P(p) E* h'_rms (members, k) of the bins of snapshots that are not empty."""
    edges, densities = _reduced_pressure_densities(members)
    filled = densities.max(axis=0) > 0
    return (0.5 * (edges[1:] + edges[:-1]))[filled], densities[:, filled]


def joined_pressure_densities(members: Sequence[tuple[xr.Dataset, int]]) -> tuple[np.ndarray, np.ndarray]:
    """Return the same as `pressure_densities` with bins joined, for boundary elements with few nodes in contact."""
    return _pressure_densities(*_reduced_pressure_densities(members), int(members[0][0]["grid"]))


def _reduced_pressure_densities(members):
    """Return edges of the bins of p/(E* h'_rms), and P(p) E* h'_rms (members, bins)."""
    (first, _), *_ = members
    unit = float(first["contact_modulus"]) * float(first["rms_slope"])
    return first["pressure_bin_edges"].values / unit, np.array(
        [run["pressure_density"].values[at] * unit for run, at in members]
    )


def _pressure_densities(edges, densities, grid):
    """Return the distributions between their first and last nodes; bins with few nodes are joined."""
    content = densities * np.diff(edges)
    filled = np.flatnonzero(content.any(axis=0))
    if not len(filled):  # before first contact
        return np.empty(0), np.empty((len(densities), 0))
    inside = slice(filled[0], filled[-1] + 1)
    low, high, joined = _join_bins(edges[filled[0] : filled[-1] + 2], content[:, inside], _LEAST_NODES / grid**2)
    return 0.5 * (low + high), joined


def _gap_densities(edges, densities, grid):
    """Return the distributions without their first bin, which begins at zero, for a logarithmic axis."""
    low, high, densities = _join_bins(edges[1:], densities[:, 1:] * np.diff(edges)[1:], _LEAST_CELLS / grid**2)
    if not len(low):
        raise ValueError("the gap distribution is empty")
    return np.sqrt(low * high), densities


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


def _solutions(entries, runs, loads):
    """Return the first boundary-element solutions of the states at reduced pressures of some runs that have some."""
    found = []
    for seed, load in zip(runs.by_seed, loads, strict=True):
        labels = runs.labels._replace(seed=seed)
        for errors in errors_of_run(entries, labels, "surface", "seed", "rms_slope", "material"):
            at = np.isclose(errors["reduced_pressure"].values, load, rtol=1e-6)
            solution = errors.isel(reduced_pressure=at)
            if at.any() and np.isfinite(solution["gap_density"].values[:1]).all():
                found.append(solution.isel(reduced_pressure=0))
                break
    return found
