"""Locate the summits of a surface between its nodes, and check whether asperities represent its highest regions."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import scipy.ndimage
from numpy.lib.stride_tricks import sliding_window_view
from scipy.spatial import cKDTree

from icha.support.parallel import blocks, on_cores
from icha.surfaces.square import cell_of
from icha.surfaces.surface import Surface

# Degree of the spline. A quintic spline reproduces a parabola exactly; the influence of a node falls by a factor of
# 0.43 per cell. At eight cells per wavelength, the second derivatives of a sine have an error of 4e-4.
_DEGREE = 5

# Quintic B-splines of the six nodes around a point: polynomials of t, the distance from the third node to the point.
# Rows are nodes, columns are powers of t. SciPy's NdBSpline takes four times as long for the same values.
_BASIS = np.array(
    [
        [1.0, -5.0, 10.0, -10.0, 5.0, -1.0],
        [26.0, -50.0, 20.0, 20.0, -20.0, 5.0],
        [66.0, 0.0, -60.0, 0.0, 30.0, -10.0],
        [26.0, 50.0, 20.0, -20.0, -20.0, 10.0],
        [1.0, 5.0, 10.0, 10.0, 5.0, -5.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
    ]
)
_BASIS /= 120
_BASIS_SLOPE = _BASIS[:, 1:] * np.arange(1, 6)
_BASIS_CURVATURE = _BASIS_SLOPE[:, 1:] * np.arange(1, 5)
# Weights of the coefficients of five nodes in value, slope and curvature of the spline at the middle node, t = 0.
_VALUE, _SLOPE, _CURVATURE = (basis[:5, 0] for basis in (_BASIS, _BASIS_SLOPE, _BASIS_CURVATURE))

_MAX_NEWTON_STEPS = 30
# Lengths in cells. A search has converged if its last step is at most `_CONVERGED`. A summit lies at most `_FARTHEST`
# from its start node. Two summits count as one if their distance is at most `_SAME_SUMMIT`.
_CONVERGED = 1e-9
_FARTHEST = 1.5
_SAME_SUMMIT = 1e-3
# The nodes support a summit if the ratio of its rise above the nodes to the rise of a parabola with the same second
# differences is at most this value. On smooth random surfaces (H 0.8, six seeds of 128 x 128 nodes), 99.5 % of the
# ratios are below 0.91 with 12 nodes per shortest wave, 1.09 with 8, 1.16 with 6, 1.69 with 5; 98 % below 1.78 with 4.
_MAX_RISE = 1.8
# Rounding error of a rise, divided by the range of heights.
_ROUNDING = 1e-9
# A node counts as flat if its curvature, divided by the mean curvature of the surface, is below this value.
_FLAT = 1e-6
# Nodes added beyond each edge of a free square. Nodes farther away would have an influence of 0.43^32 = 2e-12.
_MARGIN = 32
# Number of rows or columns of the grid in one block. Number of start nodes or summits in one block.
_LINES = 16
_POINTS = 4096
# Asperities represent a surface if two shares are at most this value: the share of the load that acts on peaks without
# a summit, and the share of summits that the nodes do not support. On smooth random surfaces with at least 5 nodes per
# shortest wave, both shares are below 0.1 (`tests/surfaces`).
MAX_SHARE = 0.1


@dataclass(frozen=True, eq=False)
class Asperities:
    """Positions, heights and curvatures of the summits of a surface, which the asperity model uses as asperities.

    Attributes
    ----------
    position : (n, 2) array, positions (x, y) of the summits in [0, period), m.
    height : (n,) array, heights of the summits above the mean plane, m.
    radius_of_curvature : (n,) array, 1/sqrt(kappa1 kappa2), the geometric mean of the principal radii of curvature, m.
    period : side of the square, m.
    free : True for a single square on a half-space, False for one cell of a periodic surface.
    unsupported_height : (k,) array, heights (m) of spline maxima without support by the nodes; not used as asperities.
    """

    position: np.ndarray
    height: np.ndarray
    radius_of_curvature: np.ndarray
    period: float
    free: bool = False
    unsupported_height: np.ndarray = field(default_factory=lambda: np.empty(0))

    @property
    def cell(self) -> float:
        """Period of the positions in m: the side of a periodic surface, or twice the side of a single square."""
        return cell_of(self.period, self.free)

    def __len__(self) -> int:
        """Return the number of asperities."""
        return len(self.height)


def find_summits(surface: Surface) -> Asperities:
    """Find the summits of a surface with `locate_summits`; raise ValueError if there are none with support by nodes."""
    found = locate_summits(surface)
    if len(found):
        return found
    if unsupported := len(found.unsupported_height):
        raise ValueError(
            f"heights: the nodes support none of the {unsupported} summits, as on a surface with steps; "
            "expected smooth summits. Use a cutoff, or the model boundary_elements"
        )
    raise ValueError("heights: the surface has no summit with negative-definite curvature")


def locate_summits(surface: Surface) -> Asperities:
    """Locate the summits of a surface, the maxima of a quintic spline through its heights.

    A comparison of every node with its neighbours would miss or misplace elongated summits. On a crest oblique to the
    grid, the highest node can lie several cells away from the summit, or no node is a maximum. Missed and misplaced
    summits would change the contact area by some per cent from grid to grid. Therefore Newton's method starts from
    every node whose local parabola has its top at most one cell away. ICHA ignores a start node if Newton's method
    converges far from the node, because steps can be very long where a principal curvature is nearly zero.

    Maxima on the edges of a free square do not count, because a crest that crosses an edge has its top outside the
    square. Point reflection continues the heights at these edges, and only summits between the outermost nodes count.

    The spline rises above the surface near steps, pits, single pixels and plateaus. A maximum is a summit only if the
    nodes around it support its height (`_is_supported`). Asperities have the order of their start nodes.
    """
    spacing, margin = surface.spacing, _MARGIN if surface.free else 0
    heights = _finite_profile(surface)
    if surface.free:
        heights = np.pad(heights, margin, mode="reflect", reflect_type="odd")
    grid = len(heights)
    coefficients = _spline_coefficients(heights)
    node, flat = _nodes_near_summits(coefficients)
    climbs = on_cores(lambda block: _climb(coefficients, node[block], flat), blocks(len(node), _POINTS))
    summit = np.concatenate([np.empty((0, 2)), *climbs])
    # Newton's method may find one summit from several nodes; keep the first result.
    pairs = np.sort(cKDTree(summit, boxsize=grid).query_pairs(_SAME_SUMMIT, output_type="ndarray"), axis=1)
    summit = np.delete(summit, pairs[:, 1], axis=0)
    if surface.free:
        summit = summit[np.all((summit > margin) & (summit < margin + surface.grid - 1), axis=1)]
    values = on_cores(lambda block: _spline(coefficients, summit[block]), blocks(len(summit), _POINTS))
    height, _, _, hyy, hyx, hxx = np.concatenate([np.empty((6, 0)), *values], axis=1)
    supported = _is_supported(heights, summit, height)
    position = (summit[supported, ::-1] - margin) * spacing
    position[position >= surface.period] = 0.0
    return Asperities(
        position=position,
        height=height[supported],
        radius_of_curvature=spacing**2 / np.sqrt(hyy * hxx - hyx**2)[supported],
        period=surface.period,
        free=surface.free,
        unsupported_height=height[~supported],
    )


def _finite_profile(surface):
    """Return the heights with the shape, m; where a shape has no surface, its lowest height."""
    lowest = np.min(surface.profile, where=np.isfinite(surface.profile), initial=np.inf)
    return np.maximum(surface.profile, lowest)


def _is_supported(heights, summit, height):
    """Return whether the nodes around each of k summits support the height of the summit: (k,) bool array.

    Along each axis, a parabola through nodes with second difference -d rises at most d/8 above the higher of two
    neighbouring nodes. The function takes the smaller d of the two nodes beside the summit, because only one d is large
    at the edge of a plateau. Source: the limiter `minmod` of A. Suresh and H. T. Huynh, J. Comput. Phys. 136 (1997)
    83-99, doi:10.1006/jcph.1997.5745.
    """
    grid = len(heights)
    (row, column), (y, x) = np.floor(summit).astype(int).T, np.mod(np.rint(summit).astype(int), grid).T
    rows, columns = np.mod([row, row + 1], grid), np.mod([column, column + 1], grid)

    bend_x = 2 * heights[y, columns] - heights[y, columns - 1] - heights[y, (columns + 1) % grid]
    bend_y = 2 * heights[rows, x] - heights[rows - 1, x] - heights[(rows + 1) % grid, x]
    rise = (np.maximum(bend_x.min(axis=0), 0.0) + np.maximum(bend_y.min(axis=0), 0.0)) / 8
    corners = heights[rows[:, None], columns[None, :]].max(axis=(0, 1))
    return height - corners <= _MAX_RISE * rise + _ROUNDING * np.ptp(heights)


def _spline_coefficients(heights):
    """Compute the coefficients of the periodic quintic spline through the heights: array of shape (n, n)."""
    coefficients = np.empty_like(heights)
    transform = partial(scipy.ndimage.spline_filter1d, order=_DEGREE, axis=1, mode="grid-wrap")

    def along_x(rows):
        transform(heights[rows], output=coefficients[rows])

    def along_y(columns):
        coefficients[:, columns] = transform(np.ascontiguousarray(coefficients[:, columns].T)).T

    on_cores(along_x, blocks(len(heights), _LINES))
    on_cores(along_y, blocks(len(heights), _LINES))
    return coefficients


def _climb(coefficients, node, flat):
    """Return the positions in cells of the summits found by Newton's method from the start nodes: (k, 2) array."""
    grid = len(coefficients)
    at, converged = node.copy(), np.zeros(len(node), dtype=bool)
    moving = np.arange(len(node))
    for _ in range(_MAX_NEWTON_STEPS):
        _, *derivatives = _spline(coefficients, np.mod(at[moving], grid))
        concave, _, step = _newton_step(*derivatives, flat)
        at[moving] += np.clip(step, -0.5, 0.5)
        inside = concave & (np.max(np.abs(at[moving] - node[moving]), axis=1) <= _FARTHEST)
        small = np.max(np.abs(step), axis=1) <= _CONVERGED
        converged[moving] = inside & small
        moving = moving[inside & ~small]
        if not len(moving):
            break
    at = np.mod(at[converged], grid)
    at[at >= grid] = 0.0
    return at


def _nodes_near_summits(coefficients):
    """Return the nodes whose Newton step to a maximum is at most one cell long, and the least curvature of a summit.

    The nodes are an array of shape (k, 2). A node counts as flat if its curvature is below the least curvature, in
    metres per squared cell.
    """
    grid = len(coefficients)

    def examine(rows):
        block = coefficients[np.arange(rows.start - 2, rows.stop + 2) % grid]
        five = sliding_window_view(block, 5, axis=0)
        value, slope, curvature = (np.einsum("ijk,k->ij", five, weights) for weights in (_VALUE, _SLOPE, _CURVATURE))

        def along_x(partial, weights):
            return scipy.ndimage.correlate1d(partial, weights, axis=1, mode="wrap").ravel()

        hyy, hyx, hxx = along_x(curvature, _VALUE), along_x(slope, _SLOPE), along_x(value, _CURVATURE)
        concave = np.flatnonzero((hyy * hxx > hyx**2) & (hyy < 0))
        gradient = along_x(slope, _VALUE)[concave], along_x(value, _SLOPE)[concave]
        _, determinant, step = _newton_step(*gradient, hyy[concave], hyx[concave], hxx[concave], 0.0)
        close = np.max(np.abs(step), axis=1) <= 1
        row, column = np.divmod(concave[close], grid)
        return np.column_stack([row + rows.start, column, determinant[close]]), np.sum(np.abs(hyy + hxx))

    found, traces = zip(*on_cores(examine, blocks(grid, _LINES)), strict=True)
    found = np.concatenate(found)
    flat = _FLAT * float(np.sum(traces)) / grid**2
    return found[found[:, 2] > flat**2, :2], flat


def _spline(coefficients, at):
    """Return the spline h and its derivatives h_y, h_x, h_yy, h_yx, h_xx at k points: six (k,) arrays."""
    grid = len(coefficients)
    floor = np.floor(at).astype(int).T
    (ty, tx), nodes = at.T - floor, np.arange(-2, 4)[:, None]
    row, column = np.mod(floor[0] + nodes, grid), np.mod(floor[1] + nodes, grid)
    around = coefficients[row[:, None], column[None, :]]
    # Sum along y first; then only the six nodes of a row remain.
    by = [np.einsum("ik,ijk->jk", basis, around) for basis in _basis(ty)]
    bx = _basis(tx)
    return [np.einsum("jk,jk->k", by[i], bx[j]) for i, j in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))]


def _basis(t):
    """Return value, slope and curvature of six quintic B-splines at k points in [0, 1): arrays of shape (6, k)."""
    powers = np.vander(t, _DEGREE + 1, increasing=True).T
    return [np.einsum("ij,jk->ik", each, powers[: each.shape[1]]) for each in (_BASIS, _BASIS_SLOPE, _BASIS_CURVATURE)]


def _newton_step(gy, gx, hyy, hyx, hxx, flat):
    """Return whether the Hessian is negative definite, its determinant, and Newton's step (zero if not definite)."""
    determinant = hyy * hxx - hyx**2
    concave = (determinant > flat**2) & (hyy + hxx < 0)
    safe = np.where(concave, -determinant, 1.0)
    step = np.stack([(hxx * gy - hyx * gx) / safe, (hyy * gx - hyx * gy) / safe], axis=-1)
    step[~concave] = 0.0
    return concave, determinant, step


# Asperities represent a surface if `paraboloid_departure` is at most this value. Random surfaces of 5 to 12 nodes per
# shortest wave stay below 0.25 at p* = 1e-3 to 0.1, and their contact areas differ from those of boundary elements by
# less than 25 %. Worn, conical and pyramidal tops have values of 0.31 to 0.9 and areas up to 3 times too small.
LARGEST_DEPARTURE = 0.3
# Directions around a summit in which the surface is compared with its paraboloid: x + iy on the unit circle.
_DIRECTIONS = np.exp(2j * np.pi * np.arange(16) / 16)
# Within this distance from a summit, in cells, the surface equals the paraboloid. Smaller spots are ignored.
_SMALLEST_SPOT = 0.25
# Smallest ratio of the depth around a summit to the depth of its paraboloid; it replaces all smaller ratios.
_LEAST_DROP = 1e-2


def paraboloid_departure(
    surface: Surface, position: np.ndarray, contact_radius: np.ndarray, radius_of_curvature: np.ndarray
) -> float:
    """Measure how much the surface differs from the paraboloids of its summits at the edges of the contact spots.

    With the mean depth d of the surface, a cubic spline, below the summit on the circle of radius a, the result is the
    mean of abs(ln(d / (a^2 / 2R))) over the spots, weighted by their areas; 0 if the radius of every spot is below a
    quarter of a cell. Near the top of an elongated summit, the depth is a^2/2 times the arithmetic mean of the
    principal curvatures, while 1/R is their geometric mean. The function computes the result with both means, and
    returns the smaller result.

    Parameters
    ----------
    position : (k, 2) float, centres of the spots (x, y), m.
    contact_radius : (k,) float, radius a of each spot, m.
    radius_of_curvature : (k,) float, radius of curvature R of each summit, m.
    """
    large = contact_radius >= _SMALLEST_SPOT * surface.spacing
    if not large.any():
        return 0.0
    contact_radius, radius_of_curvature = contact_radius[large], radius_of_curvature[large]
    radii = np.stack([contact_radius, np.full_like(contact_radius, _SMALLEST_SPOT * surface.spacing)])
    depth, close = _depth_on_circles(surface, position[large], radii)
    ratio = np.maximum(depth.mean(axis=0) / (contact_radius**2 / (2 * radius_of_curvature)), _LEAST_DROP)
    departures = [np.abs(np.log(ratio / factor)) for factor in (1.0, _elongation(close))]
    return min(float(np.average(each, weights=contact_radius**2)) for each in departures)


def _depth_on_circles(surface, position, radii):
    """Return the depths of the surface below the centres of circles, m: (circles, directions, k) for (circles, k)."""
    mode = "mirror" if surface.free else "grid-wrap"
    spline = scipy.ndimage.spline_filter(_finite_profile(surface), order=3, mode=mode)
    steps = radii[:, None] * _DIRECTIONS[:, None]
    top, around = (
        scipy.ndimage.map_coordinates(spline, np.array([y, x]) / surface.spacing, order=3, mode=mode, prefilter=False)
        for x, y in (position.T, (position[:, 0] + steps.real, position[:, 1] + steps.imag))
    )
    return top - around


def _elongation(depth):
    """Return the arithmetic mean of the principal curvatures of each summit divided by their geometric mean."""
    mean, difference = depth.mean(axis=0), 2 * np.abs(_DIRECTIONS**2 @ depth) / len(_DIRECTIONS)
    return 1 / np.sqrt(np.maximum(1 - (difference / mean) ** 2, _LEAST_DROP**2))


@dataclass(frozen=True, eq=False)
class SummitCoverage:
    """The peaks of a surface (locally highest nodes), and the summits that may represent these peaks.

    Attributes
    ----------
    peak_height : (k,) array, heights (m) of the peaks: nodes that are not lower than any of their eight neighbours.
        Every node of a plateau is a peak.
    covered : (k,) bool, True if a summit lies at most two rows and two columns from the peak.
    summit_height : (n,) array, heights of the summits, m.
    unsupported_height : (m,) array, heights of the unsupported maxima of the spline, m.
    """

    peak_height: np.ndarray
    covered: np.ndarray
    summit_height: np.ndarray
    unsupported_height: np.ndarray

    @classmethod
    def of(cls, surface: Surface, asperities: Asperities) -> SummitCoverage:
        """Find the peaks of a surface and the summits near the peaks; edge nodes of a free square do not count."""
        heights, grid = surface.profile, surface.grid

        def examine(rows):
            block = heights[np.arange(rows.start - 1, rows.stop + 1) % grid]
            row, column = np.nonzero(block[1:-1] >= scipy.ndimage.maximum_filter(block, 3, mode="wrap")[1:-1])
            return np.array([row + rows.start, column])

        row, column = np.concatenate(on_cores(examine, blocks(grid, _LINES)), axis=1)
        if surface.free:
            inside = (np.minimum(row, column) > 0) & (np.maximum(row, column) < grid - 1)
            row, column = row[inside], column[inside]
        x, y = np.mod(np.rint(asperities.position / surface.spacing).astype(int), grid).T
        occupied = np.zeros((grid, grid), dtype=bool)
        # On a crest oblique to the grid, two nodes near the same summit can be peaks.
        for down, across in np.ndindex(5, 5):
            occupied[(y + down - 2) % grid, (x + across - 2) % grid] = True
        return cls(heights[row, column], occupied[row, column], asperities.height, asperities.unsupported_height)

    def reasons_against(self, separations: Iterable[float]) -> list[str]:
        """Return reasons (sentences) why asperities do not represent the surface at these mean separations (m).

        The load on a peak is estimated with Hertz's law: it is proportional to (peak height - separation)^(3/2). If no
        peak is higher than the separation, only the highest peak counts.
        """
        uncovered = unsupported = 0.0
        for separation in np.unique(list(separations)):
            load = np.maximum(self.peak_height - separation, 0.0) ** 1.5
            if not load.any():
                load[np.argmax(self.peak_height)] = 1.0
            uncovered = max(uncovered, float(np.sum(load[~self.covered]) / np.sum(load)))
            excluded, used = (int(np.sum(h > separation)) for h in (self.unsupported_height, self.summit_height))
            unsupported = max(unsupported, excluded / max(excluded + used, 1))
        shares = {
            "{:.0f} % of the load would be on peaks of the surface that have no summit": uncovered,
            "the nodes do not support {:.0f} % of the summits that would touch": unsupported,
        }
        return [reason.format(100 * share) for reason, share in shares.items() if share > MAX_SHARE]
