"""Distributions of gap and pressure over the nominal area, and the fraction of every grid cell that spots cover."""

import numpy as np

from icha.asperity.jkr import JKR
from icha.contact.model import PRESSURE_BINS, gap_bins
from icha.equilibrium.sites import ContactState, Spots
from icha.half_space.grid_displacement import DisplacementField, row_blocks, windows
from icha.support.parallel import on_cores
from icha.surfaces.square import cell_of
from icha.surfaces.surface import Surface


def cover_grid(period: float, grid: int, centres, radii, free_square: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return the fraction of each grid cell that discs cover, and a mask of the nodes inside discs, both (n, n).

    A cell is the square around a grid node. If discs overlap, their fractions add up and may exceed 1.

    Parameters
    ----------
    period : side of the square, m.
    grid : number n of grid nodes along a side.
    centres, radii : (k, 2) and (k,) float, centres and radii of the discs, m.
    free_square : True if each disc exists once; False if the discs repeat periodically.
    """
    blocks = on_cores(lambda rows: _cover_rows(period, grid, centres, radii, rows, free_square), row_blocks(grid))
    cover, inside = zip(*blocks, strict=True)
    return np.concatenate(cover), np.concatenate(inside)


def edge_share(period: float, grid: int, centres: np.ndarray, radii: np.ndarray) -> float:
    """Return the share of the area of discs that is in the outermost cells of a free square, or outside the square.

    Parameters
    ----------
    period : side of the square, m.
    grid : number of grid nodes along a side; a cell is the square around a node.
    centres, radii : (k, 2) and (k,) float, centres and radii of the discs, m.
    """
    area = float(np.sum(np.pi * radii**2))
    if not area:
        return 0.0
    low, high = 0.5 * period / grid, (grid - 1.5) * period / grid
    x, y = np.transpose(centres)

    def below(right, top):
        return _disc_area_left_below(right - x, top - y, radii)

    inside = below(high, high) - below(low, high) - below(high, low) + below(low, low)
    return max(1 - float(np.sum(inside)) / area, 0.0)


def gap_distribution(law: JKR, surface: Surface, state: ContactState) -> dict:
    """Return the distribution P(u) of the gap u outside the spots, as a dictionary with the keys below.

    Here u is the gap at a point. In other modules of this package, u is the mean separation. If a spot covers part of a
    grid cell, only the uncovered fraction of the cell is counted, with the gap at the node of the cell. If the node is
    inside the spot, this gap counts as zero. The last bin includes all larger gaps.

    Returns
    -------
    gap_density : (bins,) float, P(u) in the bins of `icha.contact.model.gap_bins`, 1/m.
    overlap_fraction : area outside the spots where the gap is negative (the surfaces overlap), divided by A0.
    area_beyond_edges : part of A/A0 that the cells do not count: spot area outside a free square, and the excess
        over 1 in cells that spots cover more than once. A periodic surface has only this excess. The integral of P(u),
        A/A0 and overlap_fraction add up to 1 + area_beyond_edges.
    """
    edges = gap_bins(surface)
    spots, a = state.spots, state.spots.contact_radius
    period, grid, free_square = surface.period, surface.grid, surface.free
    field = DisplacementField(law, period, grid, spots.position, a, spots.radius_of_curvature, free_square)

    def count_cells(rows, w):
        """Return three areas, in cells: uncovered area in each gap bin, covered area, area covered more than once."""
        u = w + (state.separation - surface.profile[rows])
        cover, inside = _cover_rows(period, grid, spots.position, a, rows, free_square)
        u[inside] = 0.0
        # Bin 0 contains the negative gaps, and the last bin all gaps beyond its upper edge.
        index = np.minimum(np.searchsorted(edges, u.ravel(), side="right"), len(edges) - 1)
        touched = np.flatnonzero(cover)
        covered = np.bincount(index[touched], weights=np.clip(cover.ravel()[touched], 0.0, 1.0), minlength=len(edges))
        return np.bincount(index, minlength=len(edges)) - covered, np.sum(cover), np.sum(np.maximum(cover - 1.0, 0.0))

    content, covered, twice = zip(*field.map_blocks(count_cells), strict=True)
    content = np.sum(content, axis=0) / grid**2
    excess_area = float(sum(twice)) / grid**2
    if free_square:
        area = np.sum(np.pi * a**2) / period**2
        excess_area += max(float(area - sum(covered) / grid**2), 0.0)
    density = content[1:] / np.diff(edges)
    return {"gap_density": density, "overlap_fraction": float(content[0]), "area_beyond_edges": excess_area}


def pressure_distribution(law: JKR, surface: Surface, spots: Spots) -> dict:
    """Return the distribution P(p) of the pressure over the nominal area, as a dictionary with the keys below.

    P(p) is the sum of an exact formula over all spots and needs no grid. The integral of P(p) is A/A0. The integral of
    p P(p), computed with the mean pressure of each bin, is F/A0. The first bin includes all pressures below its lower
    edge, because the pressure at the edge of a JKR spot is minus infinity. The last bin includes all pressures above
    its upper edge, 500 E* h'_rms.

    Returns
    -------
    pressure_density : (bins,) float, P(p) in the bins of `icha.contact.model.PRESSURE_BINS`, 1/Pa.
    pressure_bin_mean : (bins,) float, area-weighted mean pressure of each bin, Pa; 0 for an empty bin.
    """
    edges = PRESSURE_BINS * (law.material.contact_modulus * surface.unit_slope)
    a, R = spots.contact_radius, spots.radius_of_curvature
    area, force = np.zeros(len(edges)), np.zeros(len(edges))
    if len(a):
        largest = np.max(law.pressure(0.0, a, R))
        for k, p in enumerate([*edges[:-1], max(edges[-1], largest)]):
            # For every spot, the area where the pressure is below p, and the force on this area.
            areas, forces = law.pressure_distribution(p, a, R)
            area[k], force[k] = np.sum(areas), np.sum(forces)
        area[0] = force[0] = 0.0  # the first bin includes all lower pressures
    content, load = np.diff(area), np.diff(force)
    mean = np.divide(load, content, out=np.zeros(len(content)), where=content > 0)
    return {"pressure_density": content / (surface.period**2 * np.diff(edges)), "pressure_bin_mean": mean}


def _cover_rows(period, grid, centres, radii, rows, free_square=False):
    """Return the two results of `cover_grid` for the rows of a slice, each (rows, n)."""
    if free_square:
        # On a square of twice the side, a disc that crosses an edge does not reappear at the opposite edge.
        parts = _cover_rows(cell_of(period, free_square), cell_of(grid, free_square), centres, radii, rows)
        return tuple(part[:, :grid] for part in parts)
    spacing = period / grid
    cover = np.zeros((rows.stop - rows.start) * grid)
    inside = np.zeros(len(cover), dtype=bool)
    # The window of a disc is 2^k cells wide. Discs with windows of the same width are computed together.
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
    """Return the area of the part of a disc that lies left of x and below y; radius a, centre at the origin."""
    x, y = np.clip(x, -a, a), np.clip(y, -a, a)
    left, below = _disc_area_left(x, a), _disc_area_left(y, a)
    # The lines at x and y divide the disc into four parts. The result is the area of the lower left part.
    corner = x**2 + y**2 < a**2
    quarter = 0.5 * (left + below) + x * y - 0.25 * np.pi * a**2
    # If the two lines cross outside the disc, at least one of the four parts is empty.
    cases = [(x < 0) & (y < 0), (x >= 0) & (y >= 0), x < 0]
    outside = np.select(cases, [0.0, left + below - np.pi * a**2, left], below)
    return np.where(corner, quarter, outside)


def _disc_area_left(x, a):
    """Return the area of the part of a disc that lies left of x, -a <= x <= a; radius a, centre at the origin."""
    return a**2 * (0.5 * np.pi + np.arcsin(x / a)) + x * np.sqrt(np.maximum(a**2 - x**2, 0.0))
