"""Elastic interaction of contact spots: the displacement at each spot by all other spots, the sum in eq. (4).

Within eight radii of a spot, the exact displacement is used. Farther away, the force, second moment and fourth moment
of the axisymmetric pressure represent the spot. Their fields fall as 1/r, 1/r^3 and 1/r^5. The fourth moment acts only
in the near field of the Ewald sum. Most of the sum depends only on the positions of the spots, and
`icha.half_space.ewald` computes this part once. Only the exact displacements depend on the contact radii.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from icha.asperity.jkr import JKR
from icha.half_space.ewald import NEIGHBOURS_ONCE, Ewald, PointHalfSpace

# Distances from a spot, in contact radii. Up to the first distance, the exact displacement is used. Beyond the second
# distance, force and second moment are enough: the error is below 1e-6 of the displacement and 1e-7 of the approach.
_WINDOW = 8.0
_WINDOW_OF_MOMENTS = 16.0


def _find_distant_pairs(tree, position, radius, ewald):
    """Return targets, sources and distances of those pairs outside the near field that need an exact displacement.

    tree : search tree of the targets; position, radius : (m, 2) and (m,), centres and contact radii of the sources, m.
    """
    reach = np.minimum(_WINDOW_OF_MOMENTS * radius, 0.5 * ewald.period)
    wide = np.flatnonzero(reach > ewald.reach)
    found = [np.empty(0, dtype=[("i", np.intp), ("j", np.intp), ("v", float)])]
    octave = np.floor(np.log2(reach[wide] / ewald.reach))
    for each in np.unique(octave):
        group = wide[octave == each]
        spots = cKDTree(position[group], boxsize=ewald.period)
        pairs = tree.sparse_distance_matrix(spots, np.max(reach[group]), output_type="ndarray")
        pairs["j"] = group[pairs["j"]]
        found.append(pairs[(pairs["v"] > ewald.reach) & (pairs["v"] <= reach[pairs["j"]])])
    found = np.concatenate(found)
    return found["i"], found["j"], found["v"]


def _exact_window(a, ewald):
    """Return the distance within which the displacement by each spot is exact, m; -1 for spots of radius zero."""
    return np.where(a > 0, np.maximum(_WINDOW * a, ewald.floor), -1.0)


@dataclass(frozen=True, eq=False)
class Interaction:
    """Displacement of the half-space at n contact spots by all other spots and all images.

    Attributes
    ----------
    half_space : half-space with a point at every spot.
    radius_of_curvature : (n,) float, radii of curvature of the spots, m.
    largest_radius : (n,) float, m: the list of exact pairs is complete for contact radii up to these values.
    target, source : (k,) int, exact pairs: at the spot `target`, the displacement by the spot `source` is exact.
    r : (k,) float, distances between the two spots of the exact pairs, m.
    by_moments : three (k,) arrays, displacements by unit moments of the source; the exact displacements replace them.
    """

    half_space: PointHalfSpace
    radius_of_curvature: np.ndarray
    largest_radius: np.ndarray
    target: np.ndarray
    source: np.ndarray
    r: np.ndarray
    by_moments: tuple

    @classmethod
    def between(cls, half_space: PointHalfSpace, radius_of_curvature, largest_radius) -> Interaction:
        """Return the interaction and its exact pairs for contact radii up to `largest_radius`, (n,) array in m."""
        ewald = half_space.ewald
        later, earlier, r = half_space.pairs
        window = _exact_window(largest_radius, ewald)
        close = np.flatnonzero(r <= np.max(window, initial=0.0))
        later, earlier, r = later[close], earlier[close], r[close]
        by_earlier, by_later = r <= window[earlier], r <= window[later]
        distant = _find_distant_pairs(half_space.tree, half_space.points, largest_radius, ewald)
        r = np.concatenate([r[by_earlier], r[by_later], distant[2]])
        target = np.concatenate([later[by_earlier], earlier[by_later], distant[0]])
        source = np.concatenate([earlier[by_earlier], later[by_later], distant[1]])
        by_moments = ewald.point_displacement(r)
        return cls(half_space, radius_of_curvature, largest_radius, target, source, r, by_moments)

    def displacement(self, law: JKR, a):
        """Return the displacement w (m) at each spot by all other spots and images.

        law : law of the n spots in their states; a : (n,) float, contact radii, m.
        """
        R, j = self.radius_of_curvature, self.source
        moments = law.force(a, R), law.second_moment(a, R), law.fourth_moment(a, R)
        exact = law.select(j).displacement(self.r, a[j], R[j])
        for moment, displacement in zip(moments, self.by_moments, strict=True):
            exact -= moment[j] * displacement
        return self.half_space.displacement(*moments) + np.bincount(self.target, exact, len(a))

    def tangent(self, law: JKR, a) -> tuple[Callable, Callable]:
        """Linearise the displacement around contact radii a, (n,) array in m; spots of radius zero do not change.

        Return two functions that compute changes of the displacement from changes of the radii, both (n,) arrays in m.
        The first function is exact. The second function has a relative error of about 1e-3 and is several times faster.
        """
        R, half_space = self.radius_of_curvature, self.half_space
        present = a > 0
        safe = np.where(present, a, 1.0)
        moments = [
            np.where(present, derivative(safe, R), 0.0)
            for derivative in (law.force_derivative, law.second_moment_derivative, law.fourth_moment_derivative)
        ]
        counts = np.flatnonzero(present[self.source])
        j, r, target = self.source[counts], self.r[counts], self.target[counts]
        fields = [moment[j] * field[counts] for moment, field in zip(moments, self.by_moments, strict=True)]
        # Exact derivatives at the pairs, minus the fields of the forces (first array) or of all moments (second array).
        beyond_forces = law.select(j).displacement_derivative(r, a[j], R[j]) - fields[0]
        beyond_moments = beyond_forces - fields[1] - fields[2]

        def exact(da):
            w = half_space.displacement(*(moment * da for moment in moments))
            return w + np.bincount(target, beyond_moments * da[j], len(da))

        def approximate(da):
            w = half_space.approximate_displacement(moments[0] * da)
            return w + np.bincount(target, beyond_forces * da[j], len(da))

        return exact, approximate


def displacement_at(
    law: JKR, period: float, points, position, a, R, ewald: Ewald | None = None, *, free: bool = False
) -> np.ndarray:
    """Return the displacement w of the half-space at n points by m spots, eq. (9): array of shape (n,) in m.

    The displacement is periodic and has zero mean. On a free half-space there are no images, and the mean is not zero.
    At a point under a spot, the displacement by this spot is included.

    Parameters
    ----------
    period : side of the square, m.
    points : (n, 2) float, positions of the points, m.
    position : (m, 2) float, centres of the spots, m.
    a, R : (m,) float, contact radii and radii of curvature of the spots, m.
    ewald : split of the sum; its `period` and `free` replace the arguments. None: choose a suitable split.
    free : whether the square is on a free half-space, without periodic images.
    """
    if not len(points) or not len(a):
        return np.zeros(len(points))
    ewald = ewald or Ewald.choose(period, law.material.contact_modulus, len(a), NEIGHBOURS_ONCE, free)
    period = ewald.period
    points, position = np.mod(points, period), np.mod(position, period)
    moments = law.force(a, R), law.second_moment(a, R), law.fourth_moment(a, R)
    tree, spots = cKDTree(points, boxsize=period), cKDTree(position, boxsize=period)
    pairs = tree.sparse_distance_matrix(spots, ewald.reach, output_type="ndarray")
    target, source, r = pairs["i"], pairs["j"], pairs["v"]
    near = sum(kernel * moment[source] for kernel, moment in zip(ewald.kernels(r), moments, strict=True))
    w = np.bincount(target, near, len(points)).astype(float)
    close = np.flatnonzero(r <= _exact_window(a, ewald)[source])
    distant = _find_distant_pairs(tree, position, a, ewald)
    target, source, r = (np.append(x[close], y) for x, y in zip((target, source, r), distant, strict=True))
    exact = law.select(source).displacement(r, a[source], R[source])
    for moment, displacement in zip(moments, ewald.point_displacement(r), strict=True):
        exact -= moment[source] * displacement
    w += np.bincount(target, exact, len(points))
    w += ewald.smooth(position, points, *moments[:2])
    w -= ewald.mean * np.sum(moments[0])
    if ewald.free:
        w -= ewald.image_displacement(ewald.bases(position), ewald.bases(points), moments[:2])
    return w
