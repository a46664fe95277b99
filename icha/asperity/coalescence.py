"""Coalescence: overlapping spots become one equivalent spot (Violano & Afferrante, section II; Afferrante et al. 2012).

The height follows from the equilibrium at hand (`icha.equilibrium.unions`).
"""

import numpy as np
from scipy.spatial import cKDTree

from icha.asperity.law import SpotLaw
from icha.surfaces.square import periodic_difference


def overlapping_pairs(position, a, first, second, r):
    """Of near pairs, those with r_ij < a_i + a_j.

    Parameters
    ----------
    position : (n, 2) centres in m.
    a : (n,) contact radii in m.
    first, second, r : (p,) near pairs, in both directions (those from the larger spot count), and distances in m.

    Returns
    -------
    (k, 2) array of indices, the deepest overlap a_i + a_j - r_ij first; equal depths by position, so that the order
    of the input does not matter.
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
    """From pairs in order of precedence, those that can merge at once: every spot at most in one pair."""
    taken, chosen = set(), []
    for i, j in pairs.tolist():
        if i not in taken and j not in taken:
            taken.update((i, j))
            chosen.append((i, j))
    return np.array(chosen, dtype=int).reshape(-1, 2)


def united_paraboloids(a_i, R_i, a_j, R_j):
    """Contact radius, radius of curvature (m), and the centre's way from the first to the second, as part of it.

    a_eq^2 = a_i^2 + a_j^2, R_eq^2 = R_i^2 + R_j^2, centre in the centroid of the caps' volumes pi a^4/(4 R).
    """
    volume_i, volume_j = a_i**4 / R_i, a_j**4 / R_j
    return np.hypot(a_i, a_j), np.hypot(R_i, R_j), volume_j / (volume_i + volume_j)


def equivalent_spots(law: SpotLaw, position_i, a_i, R_i, position_j, a_j, R_j, period):
    """Centre (k, 2), contact radius and radius of curvature (k,) of the spots that replace pairs i, j, all in m."""
    a, R, share = law.union(a_i, R_i, a_j, R_j)
    offset = periodic_difference(position_j, position_i, period)
    centre = np.mod(position_i + share[:, None] * offset, period)
    centre[centre >= period] = 0.0
    return centre, a, R


def covering_spot(points, position, a, period, larger_than=None):
    """For every point (k, 2) the spot (m,) whose contact covers it deepest, -1 where none does: (k,) of int.

    larger_than (k,): for points that are spots themselves, at the same indices: only larger ones count, and of
    equal ones the first.
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
    covering[i[order]] = j[order]  # the deepest comes last and stays
    return covering
