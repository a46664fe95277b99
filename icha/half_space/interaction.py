"""Elastic interaction of contact spots: the displacement at each by all others and all images, the sum of eq. (4).

A spot is not a point. Within eight of its radii its exact displacement is used. Farther away its axisymmetric pressure
acts by its moments, the integrals of p s^(2k) (k = 0, 1, 2) with the weights 1, 1/4 and 9/64, whose fields fall as 1/r,
1/r^3 and 1/r^5. The third one matters only where the field is summed pairwise. Images farther than half the cell act by
the first two. What depends on the positions alone is computed once (`icha.half_space.ewald`); this is nearly
everything. Only the pairs with exact displacement follow the radii.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from icha.asperity.jkr import JKR
from icha.half_space.ewald import NEIGHBOURS_ONCE, Ewald, PointHalfSpace

# Distances, in radii of a spot, within which its displacement is exact, and beyond which force and second moment
# suffice. In both cases the remainder is below 1e-6 of the spot's displacement there, and below 1e-7 of its approach.
_WINDOW = 8.0
_WINDOW_OF_MOMENTS = 16.0


def _find_distant_pairs(tree, position, radius, ewald):
    """Return (target, source, distance) of the pairs beyond the near field at which large spots act exactly.

    tree : of the targets; position (m, 2), radius (m,): centres and contact radii of the sources, m.
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
    """Return the distance within which the displacement of each spot is exact, m; -1 for spots of radius zero."""
    return np.where(a > 0, np.maximum(_WINDOW * a, ewald.floor), -1.0)


@dataclass(frozen=True, eq=False)
class Interaction:
    """Displacement of the half-space at n contact spots by all other spots and all images.

    Attributes
    ----------
    law : law of one spot.
    half_space : half-space with a point at every spot.
    radius_of_curvature : (n,) float, m.
    largest_radius : (n,) float, contact radii up to which the exact pairs suffice, m.
    target, source : (k,) int, pairs of spots at which the source acts by its exact displacement.
    r : (k,) float, distances of these pairs, m.
    replaced : three (k,) arrays, displacement by unit moments, which the exact displacement replaces there.
    """

    law: JKR
    half_space: PointHalfSpace
    radius_of_curvature: np.ndarray
    largest_radius: np.ndarray
    target: np.ndarray
    source: np.ndarray
    r: np.ndarray
    replaced: tuple

    @classmethod
    def between(cls, law: JKR, half_space: PointHalfSpace, radius_of_curvature, largest_radius) -> Interaction:
        """Find the exact pairs for contact radii up to `largest_radius` (n,), m; zero for spots without any."""
        ewald = half_space.ewald
        later, earlier, r = half_space.pairs
        window = _exact_window(largest_radius, ewald)
        close = np.flatnonzero(r <= np.max(window, initial=0.0))
        later, earlier, r = later[close], earlier[close], r[close]
        by_earlier, by_later = r <= window[earlier], r <= window[later]
        distant = _find_distant_pairs(half_space.tree, half_space.points, largest_radius, ewald)
        r = np.concatenate([r[by_earlier], r[by_later], distant[2]])
        return cls(
            law,
            half_space,
            radius_of_curvature,
            largest_radius,
            np.concatenate([later[by_earlier], earlier[by_later], distant[0]]),
            np.concatenate([earlier[by_earlier], later[by_later], distant[1]]),
            r,
            ewald.replaced(r),
        )

    def displacement(self, a):
        """Return the displacement w (n,) at the spots for contact radii a (n,), m.

        A spot's own displacement is left out, that of its images is included.
        """
        law, R, j = self.law, self.radius_of_curvature, self.source
        moments = law.force(a, R), law.second_moment(a, R), law.fourth_moment(a, R)
        exact = law.displacement(self.r, a[j], R[j])
        for moment, replaced in zip(moments, self.replaced, strict=True):
            exact -= moment[j] * replaced
        return self.half_space.displacement(*moments) + np.bincount(self.target, exact, len(a))

    def tangent(self, a) -> tuple[Callable, Callable]:
        """Linearise the displacement at contact radii a (n,), m; a change of a spot of radius zero does not count.

        Returns
        -------
        Two functions from changes of the radii to changes of the displacement, both (n,), m. The second one is accurate
        to a thousandth and several times faster.
        """
        law, R, half_space = self.law, self.radius_of_curvature, self.half_space
        present = a > 0
        safe = np.where(present, a, 1.0)
        moments = [
            np.where(present, derivative(safe, R), 0.0)
            for derivative in (law.force_derivative, law.second_moment_derivative, law.fourth_moment_derivative)
        ]
        counts = np.flatnonzero(present[self.source])
        j, r, target = self.source[counts], self.r[counts], self.target[counts]
        fields = [moment[j] * replaced[counts] for moment, replaced in zip(moments, self.replaced, strict=True)]
        # Exact derivatives at the pairs, less those of the fields that the half-space has there.
        less_forces = law.displacement_derivative(r, a[j], R[j]) - fields[0]
        less_moments = less_forces - fields[1] - fields[2]

        def exact(da):
            w = half_space.displacement(*(moment * da for moment in moments))
            return w + np.bincount(target, less_moments * da[j], len(da))

        def approximate(da):
            w = half_space.approximate_displacement(moments[0] * da)
            return w + np.bincount(target, less_forces * da[j], len(da))

        return exact, approximate


def displacement_at(
    law: JKR, period: float, points, position, a, R, ewald: Ewald | None = None, *, free: bool = False
) -> np.ndarray:
    """Return the displacement w (n,) at any points by spots, the sum of eq. (9), m.

    It is periodic and has zero mean; on a free half-space it is the plain sum at points of the same square. Inside a
    spot its own part is the displacement under its contact.

    Parameters
    ----------
    period : side of the square, m.
    points : (n, 2) float, m.
    position : (m, 2) float, centres of the spots, m.
    a, R : (m,) float, contact radii and radii of curvature, m.
    ewald : split of the sum, which then defines period and free; None chooses one for the number of spots.
    free : whether the square is single.
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
    exact = law.displacement(r, a[source], R[source])
    for moment, replaced in zip(moments, ewald.replaced(r), strict=True):
        exact -= moment[source] * replaced
    w += np.bincount(target, exact, len(points))
    w += ewald.smooth(position, points, *moments[:2])
    w -= ewald.mean * np.sum(moments[0])
    if ewald.free:
        w -= ewald.image_displacement(ewald.bases(position), ewald.bases(points), moments[:2])
    return w
