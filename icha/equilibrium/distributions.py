"""Distributions of gap and pressure over the nominal area, and the part of every cell that is in contact."""

from dataclasses import dataclass

import numpy as np

from icha.asperity.law import SpotLaw
from icha.contact.model import GAPS_PER_DECADE, PRESSURE_BINS, gap_bins
from icha.equilibrium.sites import ContactState, Spots
from icha.half_space.grid_displacement import DisplacementField, row_blocks, windows
from icha.support.parallel import on_cores
from icha.surfaces.square import cell_of
from icha.surfaces.surface import Surface


@dataclass(frozen=True, eq=False)
class GapDistribution:
    """P(u) over the nominal area: bin edges in m, density in 1/m; overlap is the area fraction of negative gaps.

    beyond_edges: part of the nominal area by which A/A0 exceeds what spots cover of it: where they reach over the edges
    of a free square, and where two that came apart overlap.
    """

    edges: np.ndarray
    density: np.ndarray
    overlap_fraction: float
    beyond_edges: float = 0.0


@dataclass(frozen=True, eq=False)
class PressureDistribution:
    """P(p) over the nominal area: bin edges in Pa, density in 1/Pa, area-weighted mean pressure of each bin in Pa."""

    edges: np.ndarray
    density: np.ndarray
    mean: np.ndarray


def contact_cover(surface: Surface, spots: Spots) -> np.ndarray:
    """Fraction of every node's cell that lies in contact, (n, n), exact for discs.

    Its mean is the contact area fraction to rounding, since spots are disjoint; for a free square, without what lies
    beyond its edges.
    """
    grid, centres, radii = surface.grid, spots.position, spots.contact_radius
    period, free = surface.period, surface.free
    parts = on_cores(lambda rows: _cover(period, grid, centres, radii, rows, free)[0], row_blocks(grid))
    return np.concatenate(parts)


def nodes_in_discs(period: float, grid: int, centres: np.ndarray, radii: np.ndarray, free: bool = False) -> np.ndarray:
    """Whether each node of a grid, (n, n) of bool, lies inside a disc: centres (m, 2) and radii (m,) in m.

    free: whether the discs are single, or repeat with the period.
    """
    parts = on_cores(lambda rows: _cover(period, grid, centres, radii, rows, free)[1], row_blocks(grid))
    return np.concatenate(parts)


def gap_distribution(law: SpotLaw, surface: Surface, state: ContactState) -> GapDistribution:
    """P(u) from the gap field; cells on the edge of a spot count with the part that lies outside.

    integral of P(u) + A/A0 + overlap = 1 + beyond_edges. Where the node of a cell lies inside a spot, the outer part of
    the cell has gap zero: it is the spot's edge. The last bin also counts what lies beyond it. The field is never held
    as a whole.
    """
    edges = gap_bins(surface)
    spots = state.spots
    field = DisplacementField(
        law,
        surface.period,
        surface.grid,
        spots.position,
        spots.contact_radius,
        spots.radius_of_curvature,
        surface.free,
    )

    def nodes_per_bin(rows, w):
        u = w + (state.separation - surface.heights[rows])
        cover, inside = _cover(surface.period, surface.grid, spots.position, spots.contact_radius, rows, surface.free)
        u[inside] = 0.0
        # The first place is for the overlap.
        place = np.where(u < 0, 0, _gap_bin(u, edges) + 1).ravel()
        cut = np.flatnonzero(cover)
        hidden = np.bincount(place[cut], weights=np.clip(cover.ravel()[cut], 0.0, 1.0), minlength=len(edges))
        return np.bincount(place, minlength=len(edges)) - hidden, np.sum(cover), np.sum(np.maximum(cover - 1.0, 0.0))

    content, covered, twice = zip(*field.in_blocks(nodes_per_bin), strict=True)
    content = np.sum(content, axis=0) / surface.grid**2
    beyond = float(sum(twice)) / surface.grid**2
    if surface.free:
        area = np.sum(np.pi * spots.contact_radius**2) / surface.period**2
        beyond += max(float(area - sum(covered) / surface.grid**2), 0.0)
    return GapDistribution(edges, content[1:] / np.diff(edges), float(content[0]), beyond)


def _gap_bin(u, edges):
    """Index of the bin edges[i] <= u < edges[i + 1] of every gap; the last bin holds what is larger."""
    last = len(edges) - 2
    decade = np.log10(np.maximum(u / edges[1], 1.0))
    index = np.minimum(decade * GAPS_PER_DECADE + 1, last).astype(np.intp)
    # Next to an edge the logarithm may round to the wrong side.
    index -= u < edges[index]
    index += (u >= edges[index + 1]) & (index < last)
    return index


def pressure_distribution(law: SpotLaw, surface: Surface, spots: Spots) -> PressureDistribution:
    """P(p) over the nominal area from the closed form for every spot (no grid).

    integral of P(p) = A/A0; the sum of density, width and mean over the bins = F/A0. The last bin, which ends at 500 E*
    h'_rms, also counts what lies beyond it.
    """
    edges = PRESSURE_BINS * (law.material.contact_modulus * surface.rms_slope)
    a, R = spots.contact_radius, spots.radius_of_curvature
    area, force = np.zeros(len(edges)), np.zeros(len(edges))
    if len(a):
        largest = np.max(law.largest_pressure(a, R))
        for k, p in enumerate([*edges[:-1], max(edges[-1], largest)]):
            areas, forces = law.pressure_distribution(p, a, R)
            area[k], force[k] = np.sum(areas), np.sum(forces)
        # The edge of a JKR spot reaches minus infinity; what lies below the first edge belongs to the first bin.
        area[0] = force[0] = 0.0
    content, load = np.diff(area), np.diff(force)
    mean = np.divide(load, content, out=np.zeros(len(content)), where=content > 0)
    return PressureDistribution(edges, content / (surface.period**2 * np.diff(edges)), mean)


def _cover(period, grid, centres, radii, rows, free=False):
    """Of a range of rows: the fraction of every cell in contact, and whether the node lies inside a spot."""
    if free:
        # In a grid of twice the side nothing comes back from beyond the edges.
        parts = _cover(cell_of(period, free), cell_of(grid, free), centres, radii, rows)
        return tuple(part[:, :grid] for part in parts)
    spacing = period / grid
    cover = np.zeros((rows.stop - rows.start) * grid)
    inside = np.zeros(len(cover), dtype=bool)
    # Discs of like size share the width of their windows, a power of two of cells.
    width = 2 ** np.ceil(np.log2(radii / spacing + 2)).astype(int)
    for cells in np.unique(width):
        same = np.flatnonzero((width == cells) & (radii > 0))
        own = radii[same]
        for window in windows(centres[same], (cells - 1) * spacing, grid, period, rows):
            a = own[window.spot][:, None]
            left = np.concatenate([window.dx - 0.5 * spacing, window.dx[:, -1:] + 0.5 * spacing], axis=1)
            below = [_disc_below(left, (window.dy + side * spacing)[:, None], a) for side in (-0.5, 0.5)]
            np.add.at(cover, window.node.ravel(), np.diff(below[1] - below[0], axis=1).ravel() / spacing**2)
            inside[window.node[np.hypot(window.dx, window.dy[:, None]) <= a]] = True
    return cover.reshape(-1, grid), inside.reshape(-1, grid)


def _disc_below(x, y, a):
    """Area of the disc of radius a around the origin that lies left of x and below y."""
    x, y = np.clip(x, -a, a), np.clip(y, -a, a)
    left = _disc_left(x, a)
    below = _disc_left(y, a)
    # The four parts into which the lines at x and y cut the disc: Q is left and below.
    corner = x**2 + y**2 < a**2
    quarter = 0.5 * (left + below) + x * y - 0.25 * np.pi * a**2
    # A corner outside the disc leaves one of the four parts empty.
    outside = np.where(
        (x < 0) & (y < 0),
        0.0,
        np.where((x >= 0) & (y >= 0), left + below - np.pi * a**2, np.where(x < 0, left, below)),
    )
    return np.where(corner, quarter, outside)


def _disc_left(x, a):
    """Area of the disc left of x, -a <= x <= a."""
    return a**2 * (0.5 * np.pi + np.arcsin(x / a)) + x * np.sqrt(np.maximum(a**2 - x**2, 0.0))
