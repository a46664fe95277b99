"""Distributions of gap and pressure over the nominal area, and the part of every grid cell that spots cover."""

import numpy as np

from icha.asperity.jkr import JKR
from icha.contact.model import GAPS_PER_DECADE, PRESSURE_BINS, gap_bins
from icha.equilibrium.sites import ContactState, Spots
from icha.half_space.grid_displacement import DisplacementField, row_blocks, windows
from icha.support.parallel import on_cores
from icha.surfaces.square import cell_of
from icha.surfaces.surface import Surface


def cover_grid(period: float, grid: int, centres, radii, free_square: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return the fraction of the cell around each node that discs cover, and whether the node is in a disc, (n, n).

    Where discs overlap, their fractions add up and may exceed 1.

    Parameters
    ----------
    period : side of the square, m.
    grid : nodes along a side, n.
    centres, radii : (m, 2) and (m,) float, m.
    free_square : whether each disc exists once; otherwise it repeats with the period.
    """
    blocks = on_cores(lambda rows: _cover_rows(period, grid, centres, radii, rows, free_square), row_blocks(grid))
    cover, inside = zip(*blocks, strict=True)
    return np.concatenate(cover), np.concatenate(inside)


def gap_distribution(law: JKR, surface: Surface, state: ContactState) -> dict:
    """Return the distribution P(u) of the gap over the nominal area, as a dictionary with the keys below.

    A cell on the edge of a spot counts with its fraction outside the spot. If its node lies inside the spot, this
    fraction has gap zero. The last bin includes larger gaps. The gaps are evaluated by blocks of rows to save memory.

    Returns
    -------
    gap_density : (bins,) float, P(u) in the bins of `icha.contact.model.gap_bins`, 1/m.
    overlap_fraction : area fraction of negative gaps, where the surfaces overlap in the model.
    area_beyond_edges : A/A0 minus the area fraction that spots cover. Spots may reach over the edges of a free square,
        and two spots that have split may overlap. The sum of the integral of P(u), A/A0 and overlap_fraction is
        1 + area_beyond_edges.
    """
    edges = gap_bins(surface)
    spots, a = state.spots, state.spots.contact_radius
    period, grid, free_square = surface.period, surface.grid, surface.free
    field = DisplacementField(law, period, grid, spots.position, a, spots.radius_of_curvature, free_square)

    def count_cells(rows, w):
        """Count the cells of a range of rows by their gaps; sum the covered and the doubly covered fractions."""
        u = w + (state.separation - surface.heights[rows])
        cover, inside = _cover_rows(period, grid, spots.position, a, rows, free_square)
        u[inside] = 0.0
        # Bin 0 is the overlap.
        index = np.where(u < 0, 0, _gap_bin(u, edges) + 1).ravel()
        cut = np.flatnonzero(cover)
        hidden = np.bincount(index[cut], weights=np.clip(cover.ravel()[cut], 0.0, 1.0), minlength=len(edges))
        return np.bincount(index, minlength=len(edges)) - hidden, np.sum(cover), np.sum(np.maximum(cover - 1.0, 0.0))

    content, covered, twice = zip(*field.map_blocks(count_cells), strict=True)
    content = np.sum(content, axis=0) / grid**2
    excess_area = float(sum(twice)) / grid**2
    if free_square:
        area = np.sum(np.pi * a**2) / period**2
        excess_area += max(float(area - sum(covered) / grid**2), 0.0)
    density = content[1:] / np.diff(edges)
    return {"gap_density": density, "overlap_fraction": float(content[0]), "area_beyond_edges": excess_area}


def _gap_bin(u, edges):
    """Return the index i of the bin edges[i] <= u < edges[i + 1] of every gap u; the last bin has larger gaps too."""
    last = len(edges) - 2
    decade = np.log10(np.maximum(u / edges[1], 1.0))
    index = np.minimum(decade * GAPS_PER_DECADE + 1, last).astype(np.intp)
    # Close to an edge the logarithm may round to the wrong side.
    index -= u < edges[index]
    index += (u >= edges[index + 1]) & (index < last)
    return index


def pressure_distribution(law: JKR, surface: Surface, spots: Spots) -> dict:
    """Return the distribution P(p) of the pressure over the nominal area, as a dictionary with the keys below.

    P(p) follows from a closed form for every spot, without a grid. The integral of P(p) is A/A0. The sum of density
    times width times mean over the bins is F/A0. The last bin, which ends at 500 E* h'_rms, includes larger pressures.

    Returns
    -------
    pressure_density : (bins,) float, P(p) in the bins of `icha.contact.model.PRESSURE_BINS`, 1/Pa.
    pressure_bin_mean : (bins,) float, area-weighted mean pressure of each bin, Pa.
    """
    edges = PRESSURE_BINS * (law.material.contact_modulus * surface.rms_slope)
    a, R = spots.contact_radius, spots.radius_of_curvature
    area, force = np.zeros(len(edges)), np.zeros(len(edges))
    if len(a):
        largest = np.max(law.pressure(0.0, a, R))
        for k, p in enumerate([*edges[:-1], max(edges[-1], largest)]):
            # Area and force at pressures below p, of every spot.
            areas, forces = law.pressure_distribution(p, a, R)
            area[k], force[k] = np.sum(areas), np.sum(forces)
        # The pressure at the edge of a JKR spot is minus infinity: the first bin includes all lower pressures.
        area[0] = force[0] = 0.0
    content, load = np.diff(area), np.diff(force)
    mean = np.divide(load, content, out=np.zeros(len(content)), where=content > 0)
    return {"pressure_density": content / (surface.period**2 * np.diff(edges)), "pressure_bin_mean": mean}


def _cover_rows(period, grid, centres, radii, rows, free_square=False):
    """Return the results of `cover_grid` for a range of rows, given as a slice."""
    if free_square:
        # In a cell of twice the side no disc returns at the opposite edge.
        parts = _cover_rows(cell_of(period, free_square), cell_of(grid, free_square), centres, radii, rows)
        return tuple(part[:, :grid] for part in parts)
    spacing = period / grid
    cover = np.zeros((rows.stop - rows.start) * grid)
    inside = np.zeros(len(cover), dtype=bool)
    # Discs of similar size share the width of their windows, a power of two of cells.
    width = 2 ** np.ceil(np.log2(radii / spacing + 2)).astype(int)
    for cells in np.unique(width):
        same = np.flatnonzero((width == cells) & (radii > 0))
        for spot, dy, dx, node in windows(centres[same], (cells - 1) * spacing, grid, period, rows):
            a = radii[same][spot][:, None]
            left = np.concatenate([dx - 0.5 * spacing, dx[:, -1:] + 0.5 * spacing], axis=1)
            below = [_disc_area_left_below(left, (dy + side * spacing)[:, None], a) for side in (-0.5, 0.5)]
            np.add.at(cover, node.ravel(), np.diff(below[1] - below[0], axis=1).ravel() / spacing**2)
            inside[node[np.hypot(dx, dy[:, None]) <= a]] = True
    return cover.reshape(-1, grid), inside.reshape(-1, grid)


def _disc_area_left_below(x, y, a):
    """Return the area of the disc of radius a around the origin that lies left of x and below y."""
    x, y = np.clip(x, -a, a), np.clip(y, -a, a)
    left, below = _disc_area_left(x, a), _disc_area_left(y, a)
    # The lines at x and y cut the disc into four parts; this one is left and below.
    corner = x**2 + y**2 < a**2
    quarter = 0.5 * (left + below) + x * y - 0.25 * np.pi * a**2
    # A corner outside the disc leaves one of the four parts empty.
    outside = np.where(
        (x < 0) & (y < 0),
        0.0,
        np.where((x >= 0) & (y >= 0), left + below - np.pi * a**2, np.where(x < 0, left, below)),
    )
    return np.where(corner, quarter, outside)


def _disc_area_left(x, a):
    """Return the area of the disc of radius a around the origin that lies left of x, -a <= x <= a."""
    return a**2 * (0.5 * np.pi + np.arcsin(x / a)) + x * np.sqrt(np.maximum(a**2 - x**2, 0.0))
