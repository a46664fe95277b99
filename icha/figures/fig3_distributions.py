"""Fig. 3: distributions of gap and contact pressure at one load, with and without adhesion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from icha.contact.attraction import FINITE_RANGE
from icha.figures.captions import attractions_of, theories_of_flat_surfaces
from icha.figures.curves import add_snapshot_legend, drop_rounding_errors, say_snapshot_models, snapshot_looks
from icha.figures.drawn import plot, say
from icha.figures.ensembles import draw_members, join_bins
from icha.figures.looks import MODEL_MARKERS, REFERENCE_NAME, TRUTH_LINE
from icha.figures.select import has_shape, select_snapshots
from icha.figures.style import BLACK, GREY, in_style, logarithmic_axes, new_panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


# Smallest number of grid cells in a bin of P(u). Bins with fewer cells are joined with their neighbours.
_LEAST_CELLS = 100
# Smallest number of nodes in a bin of P(p) of boundary elements. The number is small, since few nodes are in contact.
_LEAST_NODES = 25
# Approximate number of markers on a line of boundary elements.
_BESIDE_MARKERS = 14


@in_style
def figure(campaign: xr.DataTree, *, study: str, kind: str | None = None, target: float | None = None) -> Figure:
    """Draw distributions (means over the seeds) for every material on the first surface and slope of a study."""
    from icha.analysis.model_error import state_of

    lines = select_snapshots(campaign, study, kind, target)
    each_look, looks = snapshot_looks(campaign, study, lines)
    fig, [(left, right)] = new_panels(3.1)
    dataset = campaign[study].to_dataset()
    say(
        fig,
        """Probability density of the gap u (a), on logarithmic axes, and of the contact pressure p (b), both over the
        whole nominal area. Gaps are in units of the rms height, pressures in units of E* h'rms. The title of panel (a)
        gives the state.""",
    )
    say_snapshot_models(fig, lines, "Dashed lines with crosses")
    say(fig, "The density in panel (b) has the integral A/A0.")
    shown = [run for line in lines for run, _ in (*line.members, *line.truths)]
    if FINITE_RANGE in attractions_of(shown):
        say(fig, "That of boundary elements at a finite range also contains tension across gaps.")
    say(
        fig,
        """The density in panel (a) has the integral 1 - A/A0 - f, where f is the fraction of the nominal area with a
        negative computed gap outside the spots.""",
    )
    if any(line.runs.surface_energy for line in lines):
        say(fig, "Adhesion causes the tensile tail at negative pressures.")
    lowest, highest, top, floor = -0.3, 0.3, 0.0, 1.0
    tails = []
    for line, look in zip(lines, each_look, strict=True):
        u, densities = gap_densities(line.members)
        drawn = {"positive": True, "name": line.runs.drawn_name, "asked": line.runs.asked}
        draw_members(left, u, densities, look, **drawn)
        floor = drop_rounding_errors(densities.mean(axis=0)).min(initial=floor)
        p, densities = pressure_densities(line.members)
        draw_members(right, p, densities, look, **drawn)
        density = densities.mean(axis=0)
        shown = p[density > 1e-3 * density.max(initial=0)]
        lowest, highest = shown.min(initial=lowest), shown.max(initial=highest)
        top = density.max(initial=top)
        if not line.truths:
            continue
        beside = ((left, *gap_densities(line.truths)), (right, *pressure_densities(line.truths, joined=True)))
        for ax, at, densities in beside:
            dashed = TRUTH_LINE | {"color": look["color"], "marker": MODEL_MARKERS[REFERENCE_NAME]}
            every = 1 + len(at) // _BESIDE_MARKERS
            plot(ax, at, densities.mean(axis=0), line.truth_name, markevery=every, **dashed)
            top = densities.mean(axis=0).max(initial=top) if ax is right else top
        tails.append((line.truths, look["color"]))
    logarithmic_axes(left)
    logarithmic_axes(right, "y")
    left.set_ylim(floor / 2)
    for truths, colour in tails:
        p, density = singular_tail(truths, 1.05 * lowest)
        plot(right, p, density, "singular tension at the edge", ls=":", lw=1.1, color=colour, zorder=3)
        if p.size:
            say(
                right,
                """Boundary elements resolve only the mean tension in a grid cell, so their tensile tail ends in a peak.
                For tensions that the grid does not resolve, dotted lines show the density of the singular tension at
                the edge of contact, L K_c²/(π|p|³A0), where L is the length of this edge and K_c² = 2 E* Δγ.""",
            )
            right.plot([], [], ls=":", lw=1.1, color=GREY, label="singular tension at the edge")
    load = np.mean([float(state_of(run, at)["reduced_pressure"]) for run, at in lines[-1].members])
    _finish(left, right, (lowest, highest), top, 0.0 if has_shape(lines[-1].members[0][0]) else load)
    say(fig, theories_of_flat_surfaces(dataset))
    add_snapshot_legend(fig, [left, right], dataset, lines, looks)
    return fig


def _finish(left, right, pressures, highest, load):
    """Label both panels, draw Persson's theory at a reduced pressure `load` > 0, and set the limits of the axes."""
    from icha.references.persson import persson_pressure_density

    if load > 0:
        p = np.linspace(0.002, pressures[1], 300)
        say(right, "The black line is Persson's theory of contact without adhesion.")
        plot(right, p, persson_pressure_density(p, load), color=BLACK, lw=0.9, label="Persson", zorder=2)
    right.set_xlim(1.05 * np.array(pressures))
    if highest > 0:
        right.set_ylim(highest * 5e-5, highest * 3)
    right.axvline(0, color="0.75", lw=0.6, zorder=0)
    unit = r"E^{\ast}h′_{\mathrm{rms}}"
    left.set(xlabel=r"gap  $u/h_{\mathrm{rms}}$", ylabel=r"$P(u)\; h_{\mathrm{rms}}$")
    right.set(xlabel=f"contact pressure  $p/({unit})$", ylabel=rf"$P(p)\; {unit}$")


def singular_tail(members: Sequence[tuple[xr.Dataset, int]], lowest: float) -> tuple[np.ndarray, np.ndarray]:
    """Return pressures p/(E* h'_rms) and mean densities P(p) E* h'_rms for tensions that the grid does not resolve.

    At a distance x from the edge of contact, the tension is K_c/sqrt(2 pi x), with K_c^2 = 2 E* dgamma. With the
    length L of the edge, the density is P(p) = L K_c^2/(pi |p|^3 A0). The tail begins at the largest tension that the
    grid resolves, and ends at the pressure `lowest`. The tail is empty without adhesion and at a finite range.
    """
    (run, _), *_ = members
    unit = float(run["contact_modulus"]) * float(run["unit_slope"])
    first = -float(run["resolved_tension"]) / unit
    if not lowest < first < 0 or run.attrs.get("attraction") == FINITE_RANGE:
        return np.empty(0), np.empty(0)
    edge = np.mean([float(run["spot_perimeter"][run["spot_snapshot"] == at].sum()) for run, at in members])
    intensity = 2 * float(run["contact_modulus"]) * float(run["surface_energy"]) / (np.pi * float(run["period"]) ** 2)
    p = np.linspace(first, lowest, 100)
    return p, edge * intensity / (np.abs(p) ** 3 * unit**2)


def gap_densities(members: Sequence[tuple[xr.Dataset, int]]) -> tuple[np.ndarray, np.ndarray]:
    """Return reduced gaps u/h_rms, and for each snapshot the densities P(u) h_rms; bins with few cells are joined."""
    (first, _), *_ = members
    edges = first["gap_bin_edges"].values / float(first["unit_height"])
    contents = np.array([run["gap_density"].values[at] * float(run["unit_height"]) for run, at in members])
    contents *= np.diff(edges)
    # The first bin begins at zero, which a logarithmic axis does not show.
    edges, densities = join_bins(edges[1:], contents[:, 1:], _LEAST_CELLS / int(first["grid"]) ** 2)
    return np.sqrt(edges[:-1] * edges[1:]), densities


def pressure_densities(
    members: Sequence[tuple[xr.Dataset, int]], *, joined: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return reduced pressures p/(E* h'_rms), and for each snapshot the densities P(p) E* h'_rms.

    Empty bins are left out. If `joined` is True (for boundary elements), bins with few nodes are joined.
    """
    (first, _), *_ = members
    unit = float(first["contact_modulus"]) * float(first["unit_slope"])
    edges = first["pressure_bin_edges"].values / unit
    densities = np.array([run["pressure_density"].values[at] * unit for run, at in members])
    if joined:
        edges, densities = join_bins(edges, densities * np.diff(edges), _LEAST_NODES / int(first["grid"]) ** 2)
    filled = densities.any(axis=0)
    return (0.5 * (edges[1:] + edges[:-1]))[filled], densities[:, filled]
