"""Coalescence: overlapping spots become one equivalent spot (Violano & Afferrante, section II; Afferrante et al. 2012).

`icha.equilibrium.unions` computes the height of the equivalent spot.
"""

import numpy as np
from scipy.spatial import cKDTree

from icha.asperity.jkr import JKR
from icha.surfaces.square import periodic_difference


def overlapping_pairs(position, a, first, second, r):
    """Return pairs of overlapping spots (r_ij < a_i + a_j), sorted by depth of overlap: array of shape (k, 2).

    The pair with the deepest overlap a_i + a_j - r_ij comes first. Pairs of equal depth are sorted by their positions,
    so that the result does not depend on the order of the input.

    Parameters
    ----------
    position : (n, 2) float, centres of the spots, m.
    a : (n,) float, contact radii of the spots, m.
    first, second : (p,) int, indices of the two spots of p pairs; pairs are ignored if `first` is the smaller spot.
    r : (p,) float, distances between the two spots of the pairs, m.
    """
    depth = a[first] + a[second] - r
    larger = (a[second] < a[first]) | ((a[second] == a[first]) & (second > first))
    deep = np.flatnonzero((depth > 0) & larger)
    first, second, depth = first[deep], second[deep], depth[deep]
    involved = np.unique(np.concatenate([first, second]))
    rank = np.empty(len(position), dtype=int)
    rank[involved[np.lexsort((position[involved, 1], position[involved, 0]))]] = np.arange(len(involved))
    lower, upper = np.minimum(rank[first], rank[second]), np.maximum(rank[first], rank[second])
    order = np.lexsort((upper, lower, -depth))
    return np.stack([first[order], second[order]], axis=1)


def disjoint_pairs(pairs):
    """Select pairs in the given order; skip a pair if one of its spots is already in a selected pair."""
    taken, chosen = set(), []
    for i, j in pairs.tolist():
        if i not in taken and j not in taken:
            taken.update((i, j))
            chosen.append((i, j))
    return np.array(chosen, dtype=int).reshape(-1, 2)


def equivalent_spots(law: JKR, position_i, a_i, R_i, position_j, a_j, R_j, period):
    """Return the centres, contact radii and radii of curvature (m) of the spots that replace pairs of spots i, j."""
    a, R, fraction = law.union(a_i, R_i, a_j, R_j)
    offset = periodic_difference(position_j, position_i, period)
    centre = np.mod(position_i + fraction[:, None] * offset, period)
    centre[centre >= period] = 0.0
    return centre, a, R


def covering_spot(points, position, a, period, larger_than=None):
    """Return for each point the index of the spot that covers the point deepest; -1 if no spot covers the point.

    Parameters
    ----------
    points : (k, 2) float, positions of the points, m.
    position, a : (m, 2) and (m,) float, centres and contact radii of the spots, m.
    larger_than : (k,) float, contact radii of the points, m; given only if the points are the centres of the spots.
        In this case only larger spots can cover a point. If two spots are equal, the first spot covers the second.
    """
    covering = np.full(len(points), -1)
    if not len(points) or not len(position):
        return covering
    tree, spots = cKDTree(np.mod(points, period), boxsize=period), cKDTree(np.mod(position, period), boxsize=period)
    found = tree.sparse_distance_matrix(spots, min(np.max(a), 0.5 * period), output_type="ndarray")
    i, j = found["i"], found["j"]
    depth = a[j] - found["v"]
    inside = depth > 0
    if larger_than is not None:
        inside &= (a[j] > larger_than[i]) | ((a[j] == larger_than[i]) & (j < i))
    i, j, depth = i[inside], j[inside], depth[inside]
    order = np.lexsort((-j, depth))
    covering[i[order]] = j[order]  # the spot that covers a point deepest comes last and replaces the others
    return covering
