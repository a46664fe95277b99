"""Fig. 3: how gaps and contact pressures are distributed at one load, with and without adhesion."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.figures.select import first_line_runs, snapshot_label, study_errors
from icha.figures.style import BLACK, GREY, TWO_COLUMNS, line_look, material_label, new_figure, panel_label, styled
from icha.reference.persson import persson_pressure_density

CAPTION = (
    "Probability densities over the nominal area of the gap u (a, double logarithmic) and of the contact pressure p "
    "(b), at the load given in the figure; open markers are without adhesion. Gaps are in units of the rms height, "
    "pressures of E* h'rms. Only contact carries pressure in this model, so the integral of (b) is A/A0 and that of "
    "(a) is 1 - A/A0 less the overlap fraction; adhesion gives the tensile tail at negative pressures. Broad "
    "pale lines, where there are any: boundary elements, an independent code, on the same topography and with the same "
    "interaction range, in the colour of the material; gaps out of contact and pressures in contact. At the ranges "
    "that a grid resolves they show practically no hysteresis, so that with adhesion they bound the limit of short "
    "ranges (JKR), and do not prove it. Line: Persson's theory of adhesionless contact."
)

# Sampled gaps per plotted point: bins with less are joined with their neighbours.
_LEAST_CELLS = 100
# The same for the nodes in contact, which are few.
_LEAST_NODES = 25
_MOST_MARKERS = 40
_BROAD = {"ls": "-", "lw": 3.6, "alpha": 0.35, "solid_capstyle": "butt", "zorder": 2.5}


@styled
def figure(
    campaign: xr.DataTree,
    model_error: xr.DataTree | None = None,
    *,
    study: str,
    kind: str | None = None,
    target: float | None = None,
) -> Figure:
    """Draw the distributions of every material on the first surface, seed and slope of a study.

    Parameters
    ----------
    campaign : the campaign dataset.
    model_error : `icha.model_error.model_error` of the campaign, for the boundary elements of the same states, if any.
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
    left, right = fig.subplots(1, 2)
    lowest, highest, top, named = -0.3, 0.3, 0.0, False
    for k, (labels, run, at) in enumerate(runs):
        look = line_look(k, adhesive=float(run["surface_energy"]) > 0)
        look["label"] = material_label(dataset, labels.material)
        u, density = gap_points(run, at)
        left.loglog(u, density, markevery=1 + len(u) // _MOST_MARKERS, **look)
        p, density = pressure_points(run, at)
        right.semilogy(p, density, markevery=3, **look)
        if len(density):  # before first contact there is no pressure
            shown = density > 1e-3 * density.max()
            lowest, highest = min(lowest, p[shown].min()), max(highest, p[shown].max())
            top = max(top, density.max())
        step = int(run["snapshot_step"].values[at])
        load = float(run["reduced_pressure"].values[step])
        if (truth := _solution(study_errors(model_error, study), labels, load)) is not None:
            broad = _BROAD | {"color": look["color"]}
            left.loglog(*solution_gap_points(truth), **broad)
            right.semilogy(*solution_pressure_points(truth), **broad)
            named = True
    if named:
        for ax in (left, right):
            ax.plot([], [], **_BROAD | {"color": GREY}, label="boundary elements")
    if load > 0:
        line = np.linspace(0.002, highest, 300)
        right.semilogy(line, persson_pressure_density(line, load), "-", color=BLACK, lw=0.9, label="Persson", zorder=2)

    left.set_xlabel(r"gap  $u/h_{\mathrm{rms}}$")
    left.set_ylabel(r"$P(u)\; h_{\mathrm{rms}}$")
    right.set_xlabel(r"contact pressure  $p/(E^{\ast}h_{\mathrm{rms}}^{\prime})$")
    right.set_ylabel(r"$P(p)\; E^{\ast}h_{\mathrm{rms}}^{\prime}$")
    right.set_xlim(lowest * 1.05, highest * 1.05)
    if top > 0:
        right.set_ylim(top * 5e-5, top * 3)
    right.axvline(0, color="0.75", lw=0.6, zorder=0)
    left.set_title(snapshot_label(run, at), loc="right")
    left.legend(loc="lower left")
    right.legend(loc="lower center", frameon=True, framealpha=1, edgecolor="none", borderpad=0.2)
    for ax, letter in ((left, "a"), (right, "b")):
        panel_label(ax, letter)
    return fig


def gap_points(run: xr.Dataset, snapshot: int) -> tuple[np.ndarray, np.ndarray]:
    """u/h_rms and P(u) h_rms of one snapshot; thinly filled bins are joined until they hold enough grid cells."""
    height = float(run["rms_height"])
    density = run["gap_density"].values[snapshot] * height
    return _gap_points(run["gap_bin_edges"].values / height, density, int(run["grid"]))


def pressure_points(run: xr.Dataset, snapshot: int) -> tuple[np.ndarray, np.ndarray]:
    """p/(E* h'_rms) and P(p) E* h'_rms of the bins of one snapshot that hold anything."""
    unit = float(run["contact_modulus"]) * float(run["rms_slope"])
    edges = run["pressure_bin_edges"].values / unit
    density = run["pressure_density"].values[snapshot] * unit
    filled = density > 0
    return (0.5 * (edges[1:] + edges[:-1]))[filled], density[filled]


def solution_gap_points(truth: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """u/h_rms and P(u) h_rms of boundary elements, one state of the model error; bins joined as those of a run."""
    return _gap_points(truth["gap_bin_edges"].values, truth["gap_density"].values, int(truth["solution_grid"]))


def solution_pressure_points(truth: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """p/(E* h'_rms) and P(p) E* h'_rms of boundary elements; bins are joined until they hold enough nodes."""
    edges = truth["pressure_bin_edges"].values
    content = truth["pressure_density"].values * np.diff(edges)
    held = np.flatnonzero(content)
    inside = slice(held[0], held[-1] + 1)
    low, high, density = _joined(
        edges[held[0] : held[-1] + 2], content[inside], _LEAST_NODES / int(truth["solution_grid"]) ** 2
    )
    return 0.5 * (low + high), density


def _gap_points(edges, density, grid):
    """The distribution without its first bin: from zero, it has no place on a logarithmic axis."""
    low, high, density = _joined(edges[1:], density[1:] * np.diff(edges)[1:], _LEAST_CELLS / grid**2)
    if not len(density):
        raise ValueError("the gap distribution is empty")
    return np.sqrt(low * high), density


def _joined(edges, content, least):
    """Lower and upper edges, and densities, of bins joined with those after them until they hold at least so much."""
    points, start, gathered = [], 0, 0.0
    for k, part in enumerate(content):
        gathered += part
        if gathered >= least:
            points.append((edges[start], edges[k + 1], gathered / (edges[k + 1] - edges[start])))
            start, gathered = k + 1, 0.0
    return np.array(points).reshape(-1, 3).T


def _solution(entries, labels, load):
    """The first boundary-element solution of a run's state at a reduced pressure, or None."""
    for errors in entries.values():
        at = {"surface": labels.surface, "seed": labels.seed, "material": labels.material}
        if any(value not in errors[label].values for label, value in at.items()):
            continue
        close = {
            label: np.flatnonzero(np.isclose(errors[label].values, value, rtol=1e-6))
            for label, value in (("rms_slope", labels.rms_slope), ("reduced_pressure", load))
        }
        if all(map(len, close.values())):
            return errors.sel(at).isel({label: found[0] for label, found in close.items()})
    return None
