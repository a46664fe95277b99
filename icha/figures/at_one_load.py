"""Figures of one load, for every material of a study: distributions of gap and pressure (3), sizes of patches (8)."""

from collections.abc import Sequence
from operator import itemgetter

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from icha.analysis.model_error import state_of
from icha.contact.attraction import FINITE_RANGE
from icha.datasets.campaign import runs_with_labels, runs_with_snapshot, spots_of
from icha.datasets.labels import slopes_of
from icha.figures.captions import about_boundary_elements, theories_of_flat_surfaces
from icha.figures.curves import drop_rounding_errors
from icha.figures.drawn import plot, say, show_runs
from icha.figures.ensembles import draw_members, join_bins
from icha.figures.looks import MODEL_MARKERS, REFERENCE_NAME, TRUTH_LINE, Looks, legend_below, model_handle
from icha.figures.select import (
    Members,
    NothingToDraw,
    has_layer,
    has_shape,
    kind_and_target,
    select_snapshots,
    snapshot_label,
)
from icha.figures.style import BLACK, GREY, TWO_COLUMNS, in_style, logarithmic_axes, new_panels, slope_label
from icha.references.persson import persson_pressure_density
from icha.support.formatting import choose_unit
from icha.uncertainty.ensembles import ENOUGH


def _begin(campaign, study, lines):
    """Return the looks of a figure of some snapshots, and arguments of `Axes.plot` for the line of each snapshot."""
    groups = [line.runs for line in lines]
    looks = Looks(campaign, [study], [group.line for group in groups])
    shape = {"ls": "-", "marker": MODEL_MARKERS[groups[0].model_name]}
    return looks, [looks.look(group.line) | shape for group in groups]


def _draw(ax, lines, line, look, own, true, **truth_look):
    """Draw a line of one material, and of boundary elements beside it; `own` and `true` are x and members of each."""
    of_line = {"positive": True, "name": line.runs.drawn_name, "asked": line.runs.asked}
    draw_members(ax, *own, look, curves=len(lines), **of_line)
    if line.truths:
        say(ax, "Dashed lines are only means." if 1 < len(line.truths) < ENOUGH else "")
        truth_look = TRUTH_LINE | truth_look
        draw_members(ax, *true, truth_look, positive=True, name=line.truth_name, curves=None, ls=TRUTH_LINE["ls"])


def _finish(fig, panels, dataset, lines, looks, *, markers=True):
    """Add titles, legend and sentences on boundary elements."""
    shown, model = lines[0].runs.labels, lines[0].runs.model_name
    at_place = runs_with_labels(dataset, surface=shown.surface, rms_slope=shown.rms_slope)
    show_runs(fig, shown.study, runs_with_snapshot(dataset, *kind_and_target(*lines[0].members[0])), at_place)
    seeds = [(len(line.members), len(line.truths)) for line in lines if line.truths]
    say(fig, about_boundary_elements((run for line in lines for run, _ in (*line.members, *line.truths)), seeds))
    several = {shown.surface: dataset.sizes["surface"] > 1, slope_label(shown.rms_slope): len(slopes_of(dataset)) > 1}
    place = ", ".join(words for words, needed in several.items() if needed)
    panels[-1].set_title(place, loc="right")
    state = snapshot_label(*lines[-1].members[0])
    panels[0].set_title(state if len(panels) > 1 else ", ".join(filter(None, (place, state))), loc="right")
    bare = {} if markers else {"marker": "none"}
    handles = looks.handles(**{"ls": "-", "marker": MODEL_MARKERS[model]} | bare)
    handles |= {model: model_handle(model, **{"ls": "-", "lw": 0.8} | looks.fill() | bare)}
    if any(line.truths for line in lines):
        handles[REFERENCE_NAME] = model_handle(REFERENCE_NAME, **TRUTH_LINE | bare)
    legend_below(fig, handles)


# --- figure 3 ---

# Smallest number of grid cells in a bin of P(u). Bins with fewer cells are joined with their neighbours.
_LEAST_CELLS = 100
# Smallest number of nodes in a bin of P(p) of boundary elements. The number is small, since few nodes are in contact.
_LEAST_NODES = 25
# Approximate number of markers on a line of boundary elements.
_BESIDE_MARKERS = 14
# Reduced pressures count as equal up to this relative difference.
_SAME_LOAD = 0.01

_DENSITIES = """Probability density of the gap u (a), and of the contact pressure p (b), both over the whole nominal
area. Gaps are in units of the rms height, pressures in units of E* h'rms; negative pressures are tension. The title of
panel (a) gives the state. The density in panel (a) has the integral 1 - A/A0 - f, where f is the fraction of the
nominal area with a negative computed gap outside the spots. That in panel (b) has the integral A/A0; at a finite range
of attraction, it also contains tension across gaps."""
_PERSSON = """Persson's theory, of contact without adhesion, is at the reduced pressures of the runs; runs at the same
pressure share a line."""
_TAIL = """Boundary elements resolve only the mean tension in a grid cell, so their tensile tail ends in a peak. Dotted
lines are the density of the singular tension at the edge of contact, L K_c²/(π|p|³A0), where L is the length of this
edge and K_c² = 2 E* Δγ."""


@in_style
def distributions(campaign: xr.DataTree, *, study: str, kind: str | None = None, target: float | None = None) -> Figure:
    """Draw distributions (means over the seeds) for every material on the first surface and slope of a study."""
    lines = select_snapshots(campaign, study, kind, target)
    looks, each_look = _begin(campaign, study, lines)
    fig, [(left, right)] = new_panels(3.1)
    dataset = campaign[study].to_dataset()
    say(fig, _DENSITIES)
    lowest, highest, top, floor = -0.3, 0.3, 0.0, 1.0
    for line, look in zip(lines, each_look, strict=True):
        gaps, pressures = gap_densities(line.members), pressure_densities(line.members)
        true_gaps, true_pressures = (
            (gap_densities(line.truths), pressure_densities(line.truths, joined=True)) if line.truths else (None, None)
        )
        for ax, own, true in ((left, gaps, true_gaps), (right, pressures, true_pressures)):
            every = 1 + len(true[0]) // _BESIDE_MARKERS if true else 1
            beside = {"color": looks.colour(line.runs.line), "marker": MODEL_MARKERS[REFERENCE_NAME]}
            _draw(ax, lines, line, look, own, true, markevery=every, **beside)
        floor = drop_rounding_errors(gaps[1].mean(axis=0)).min(initial=floor)
        density = pressures[1].mean(axis=0)
        inside = pressures[0][density > 1e-3 * density.max(initial=0)]
        lowest, highest = inside.min(initial=lowest), inside.max(initial=highest)
        top = max(each.mean(axis=0).max(initial=top) for _, each in filter(None, (pressures, true_pressures)))
    logarithmic_axes(left)
    logarithmic_axes(right, "y")
    left.set_ylim(floor / 2)
    for line, look in zip(lines, each_look, strict=True):
        _draw_singular_tail(right, line, 1.05 * lowest, look["color"])
    drawn = _draw_persson(right, highest, lines, each_look)
    right.set_xlim(1.05 * np.array((lowest, highest)))
    if top > 0:
        right.set_ylim(top * 5e-5, top * 3)
    right.axvline(0, color="0.75", lw=0.6, zorder=0)
    unit = r"E^{\ast}h′_{\mathrm{rms}}"
    left.set(xlabel=r"gap  $u/h_{\mathrm{rms}}$", ylabel=r"$P(u)\; h_{\mathrm{rms}}$")
    right.set(xlabel=f"contact pressure  $p/({unit})$", ylabel=rf"$P(p)\; {unit}$")
    say(fig, theories_of_flat_surfaces(dataset, drawn=drawn))
    _finish(fig, [left, right], dataset, lines, looks)
    return fig


def _draw_persson(ax, highest, lines, each_look):
    """Draw Persson's theory up to the pressure `highest`, once for each load of the runs on a flat half-space.

    Return whether there is such a load.
    """
    drawn, p = [], np.linspace(0.002, highest, 300)
    flat = [not (has_shape(line.members[0][0]) or has_layer(line.members[0][0])) for line in lines]
    for line, look, _ in filter(itemgetter(2), zip(lines, each_look, flat, strict=True)):
        load = float(np.mean([state_of(run, at)["reduced_pressure"] for run, at in line.members]))
        if load > 0 and not np.isclose(load, [each for each, *_ in drawn], rtol=_SAME_LOAD, atol=0).any():
            drawn.append((load, look["color"], line.runs.drawn_name._replace(curve="Persson")))
    several, look = len(drawn) > 1, {"lw": 0.9, "zorder": 2}
    for load, colour, name in drawn:
        density = persson_pressure_density(p, load)
        plot(ax, p, density, name if several else "Persson", color=colour if several else BLACK, **look)
    if drawn:
        ax.plot([], [], color=GREY if several else BLACK, label="Persson", **look)
        say(ax, _PERSSON)
    return bool(drawn)


def _draw_singular_tail(ax, line, lowest, colour):
    """Draw the tail of the tension of boundary elements down to the pressure `lowest`, if there is any."""
    p, density = singular_tail(line.truths, lowest) if line.truths else (np.empty(0), np.empty(0))
    if p.size:
        look = {"ls": ":", "lw": 1.1, "zorder": 3}
        plot(ax, p, density, line.truth_name._replace(curve="singular tension at the edge"), color=colour, **look)
        say(ax, _TAIL)
        ax.plot([], [], color=GREY, label="singular tension at the edge", **look)


def singular_tail(members: Members, lowest: float) -> tuple[np.ndarray, np.ndarray]:
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


def gap_densities(members: Members) -> tuple[np.ndarray, np.ndarray]:
    """Return reduced gaps u/h_rms, and for each snapshot the densities P(u) h_rms; bins with few cells are joined."""
    (first, _), *_ = members
    edges = first["gap_bin_edges"].values / float(first["unit_height"])
    contents = np.array([run["gap_density"].values[at] * float(run["unit_height"]) for run, at in members])
    contents *= np.diff(edges)
    # The first bin begins at zero, which a logarithmic axis does not show.
    edges, densities = join_bins(edges[1:], contents[:, 1:], _LEAST_CELLS / int(first["grid"]) ** 2)
    return np.sqrt(edges[:-1] * edges[1:]), densities


def pressure_densities(members: Members, *, joined: bool = False) -> tuple[np.ndarray, np.ndarray]:
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


# --- figure 8 ---

# Smallest number of patches in a bin of the density. Bins with fewer patches are joined with their neighbours.
_LEAST_PATCHES = 10
_BINS_PER_DECADE = 8
# Fewest bins for which a density is drawn.
_FEWEST_BINS = 3
# Width of the figure without the panel of the density, inches.
_ALONE = 4.5
# Largest number of points of a cumulative curve; more points would not be distinguishable.
_CURVE_POINTS = 300

_ABOVE = """number per nominal area of patches that are larger than A. Patches of the asperity model are united spots;
those of boundary elements are grid cells in contact that are connected by common edges."""


@in_style
def patch_sizes(campaign: xr.DataTree, *, study: str, kind: str | None = None, target: float | None = None) -> Figure:
    """Draw numbers of patches by size (means over seeds), for every material on a study's first surface and slope."""
    lines = select_snapshots(campaign, study, kind, target)
    looks, each_look = _begin(campaign, study, lines)
    factor, unit = choose_unit(float(lines[0].members[0][0]["period"]), "m")
    cell = (float(lines[0].members[0][0]["period"]) * factor) ** 2
    areas = [
        tuple([patch_areas(run, at) * factor**2 for run, at in members] for members in (line.members, line.truths))
        for line in lines
    ]
    if max(area.size for each, _ in areas for area in each) < 2:
        raise NothingToDraw(f"study {study}: every snapshot has at most one contact patch; the figure needs several")
    # Without enough patches for a density, the figure has only the second panel, whose lines have no markers.
    dense = max(len(patch_density(each, cell)[0]) for each, _ in areas) >= _FEWEST_BINS
    fig, [panels] = new_panels(3.1, columns=1 + dense, width=TWO_COLUMNS if dense else _ALONE, sharex=True)
    density = """number of patches per nominal area and per interval of the patch area A (a), where neighbouring
    intervals with few patches are joined, and """
    say(fig, "Sizes of the contact patches at the load given in the figure: " + (density if dense else "") + _ABOVE)
    for line, look, (own, true) in zip(lines, each_look, areas, strict=True):
        smooth = look | {"marker": "none", "lw": 1.4 * look["lw"]}
        drawn = [(patch_density, look, MODEL_MARKERS[REFERENCE_NAME]), (patches_above, smooth, "none")]
        for ax, (points, line_look, marker) in zip(panels, drawn[-len(panels) :], strict=True):
            beside = {"color": looks.colour(line.runs.line), "marker": marker}
            _draw(ax, lines, line, line_look, points(own, cell), true and points(true, cell), **beside)
    for ax in panels:
        logarithmic_axes(ax)
        ax.set_xlabel(f"patch area  $A$ ({unit}²)")
    panels[0].set_ylabel(f"number density  $n(A)$ ({unit}$^{{-4}}$)")
    panels[-1].set_ylabel(f"patches larger than $A$ ({unit}$^{{-2}}$)")
    _finish(fig, panels, campaign[study].to_dataset(), lines, looks, markers=dense)
    return fig


def patch_areas(run: xr.Dataset, snapshot: int) -> np.ndarray:
    """Return the areas in m² of the contact patches of one snapshot, in ascending order; zero areas are left out."""
    area = np.sort(np.pi * spots_of(run, snapshot)["spot_radius"].values ** 2)
    return area[area > 0]


def patch_density(areas: Sequence[np.ndarray], nominal_area: float) -> tuple[np.ndarray, np.ndarray]:
    """Return densities in bins of the patch area: number of patches, divided by nominal area and by bin width.

    `areas` are the patch areas of every member of an ensemble, in ascending order. Bins with few patches are joined.
    Return the patch areas in the middle of k bins, and the densities of every member, (members, k).
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
