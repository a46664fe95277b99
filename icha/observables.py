"""What a contact state shows: displacement and gap fields, and the distributions of gap and pressure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from icha.elasticity import displacement_field, nodes_around, periodic_difference
from icha.equilibrium import ContactState, Spots
from icha.jkr import JKR
from icha.surface import Surface

# Bins of the gap in units of h_rms: one from zero, then 20 per decade; and of the pressure in units of
# E* h'_rms: linear where the bulk is, 20 per decade in the tails. JKR pressures tend to minus infinity at the edge
# of a spot as |p|^-3, hence the long tail.
GAP_BINS = np.concatenate([[0.0], np.logspace(-4, 1.5, 111)])
PRESSURE_BINS = np.concatenate([-np.logspace(8, 0, 161)[:-1], np.linspace(-1, 5, 301), 5 * np.logspace(0, 2, 41)[1:]])


@dataclass(frozen=True, eq=False)
class GapDistribution:
    """P(u) over the nominal area: bin edges in m, density in 1/m; overlap is the area fraction of negative gaps."""

    edges: np.ndarray
    density: np.ndarray
    overlap_fraction: float


@dataclass(frozen=True, eq=False)
class PressureDistribution:
    """P(p) over the nominal area: bin edges in Pa, density in 1/Pa, area-weighted mean pressure of each bin in Pa."""

    edges: np.ndarray
    density: np.ndarray
    mean: np.ndarray


def displacement(law: JKR, surface: Surface, state: ContactState) -> np.ndarray:
    """Displacement w of the half-space at the surface's nodes, (n, n), m; zero mean (eq. 9, periodic)."""
    spots = state.spots
    return displacement_field(
        law, surface.period, surface.grid, spots.position, spots.contact_radius, spots.radius_of_curvature
    )


def gap(law: JKR, surface: Surface, state: ContactState) -> np.ndarray:
    """Gap u = mean separation + w - h at the nodes, (n, n), m; meaningful outside the spots, where the model's
    inexactness can make it negative."""
    return displacement(law, surface, state) + (state.separation - surface.heights)


def contact_cover(surface: Surface, spots: Spots) -> np.ndarray:
    """Fraction of every node's cell that lies in contact, (n, n), exact for discs.

    Its mean is the contact area fraction to rounding, spots being disjoint.
    """
    cover = np.zeros((surface.grid, surface.grid))
    spacing = surface.spacing
    for centre, a in zip(spots.position, spots.contact_radius, strict=True):
        rows, columns = _cells_around(centre, a, surface)
        dx = periodic_difference(columns * spacing, centre[0], surface.period)
        dy = periodic_difference(rows * spacing, centre[1], surface.period)
        half = 0.5 * spacing
        area = (
            _disc_below(dx + half, dy + half, a)
            - _disc_below(dx - half, dy + half, a)
            - _disc_below(dx + half, dy - half, a)
            + _disc_below(dx - half, dy - half, a)
        )
        cover[rows, columns] += area / spacing**2
    return cover


def gap_distribution(law: JKR, surface: Surface, state: ContactState) -> GapDistribution:
    """P(u) from the gap field; cells on the edge of a spot count with the part that lies outside.

    integral of P(u) + A/A0 + overlap = 1. The part outside of a cell whose node lies inside a spot has gap zero: it
    is the spot's edge.

    Raises
    ------
    ValueError
        If a gap exceeds the largest bin, 31.6 h_rms.
    """
    edges = GAP_BINS * surface.rms_height
    u = gap(law, surface, state)
    cover = contact_cover(surface, state.spots)
    inside = covered_nodes(surface, state.spots)
    u[inside] = 0.0
    weight = np.clip(1 - cover, 0.0, 1.0) / surface.grid**2
    if u.max() > edges[-1]:
        raise ValueError(f"gap: {u.max():.3e} m exceeds the largest bin, {edges[-1]:.3e} m")
    overlap = u < 0
    content, _ = np.histogram(u[~overlap], bins=edges, weights=weight[~overlap])
    return GapDistribution(edges, content / np.diff(edges), float(np.sum(weight[overlap])))


def pressure_distribution(law: JKR, surface: Surface, spots: Spots) -> PressureDistribution:
    """P(p) over the nominal area from the closed form for every spot (no grid).

    integral of P(p) = A/A0; the sum of density, width and mean over the bins = F/A0.

    Raises
    ------
    ValueError
        If a pressure lies beyond the bins, which reach 500 E* h'_rms.
    """
    edges = PRESSURE_BINS * (law.material.contact_modulus * surface.rms_slope)
    a, R = spots.contact_radius, spots.radius_of_curvature
    area, force = np.zeros(len(edges)), np.zeros(len(edges))
    if len(a):
        peak, neck = law.pressure_amplitudes(a, R)
        if np.max(peak - neck) > edges[-1]:
            raise ValueError(f"pressure: {np.max(peak - neck):.3e} Pa exceeds the largest bin, {edges[-1]:.3e} Pa")
        for k, p in enumerate(edges):
            areas, forces = law.pressure_distribution(p, a, R)
            area[k], force[k] = np.sum(areas), np.sum(forces)
        # The edge of a JKR spot reaches minus infinity; what lies below the first edge belongs to the first bin.
        area[0] = force[0] = 0.0
    content, load = np.diff(area), np.diff(force)
    mean = np.divide(load, content, out=np.zeros(len(content)), where=content > 0)
    return PressureDistribution(edges, content / (surface.period**2 * np.diff(edges)), mean)


def covered_nodes(surface: Surface, spots: Spots) -> np.ndarray:
    """Whether each node lies inside a spot, (n, n) of bool."""
    covered = np.zeros((surface.grid, surface.grid), dtype=bool)
    for centre, a in zip(spots.position, spots.contact_radius, strict=True):
        rows, columns, _ = nodes_around(centre, min(a, 0.5 * surface.period), surface.grid, surface.period)
        covered[rows, columns] = True
    return covered


def _cells_around(centre, a, surface):
    """Rows and columns of all cells that a disc can touch, flat."""
    n = surface.grid
    count = min(int(a / surface.spacing) + 2, n // 2 - 1)
    middle = np.rint(np.asarray(centre) / surface.spacing).astype(int)
    offset = np.arange(-count, count + 1)
    row, column = np.meshgrid((middle[1] + offset) % n, (middle[0] + offset) % n, indexing="ij")
    return row.ravel(), column.ravel()


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
