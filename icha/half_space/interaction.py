"""Elastic interaction of contact spots: the displacement at every one by all others and all images, eq. (4)'s sum.

A spot is not a point. Within eight of its radii its exact displacement is taken; farther away an axisymmetric pressure
acts by its moments, integral of p s^(2k) (k = 0, 1, 2) with the weights 1, 1/4, 9/64, whose fields fall as 1/r, 1/r^3
and 1/r^5. The third is only needed where the field is summed pairwise. Images farther than half the cell act by the
first two. What depends on the positions alone, nearly everything, is computed once (`icha.half_space.ewald`); only the
windows of exact displacement follow the radii.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from icha.asperity.law import SpotLaw
from icha.half_space.ewald import NEIGHBOURS_ONCE, Ewald, HalfSpace

# Radii of a spot within which its displacement is exact, and beyond which force and second moment suffice: in both
# cases the remainder is below 1e-6 of the spot's displacement at the place, and below 1e-7 of its own approach.
_WINDOW = 8.0
_WINDOW_OF_MOMENTS = 16.0


def _pairs_beyond(tree, position, radius, ewald):
    """Pairs (target, source, distance) beyond the near field at which large spots still act exactly.

    tree: of the targets.
    """
    reach = np.minimum(_WINDOW_OF_MOMENTS * radius, 0.5 * ewald.period)
    wide = np.flatnonzero(reach > ewald.reach)
    found = [np.empty(0, dtype=[("i", np.intp), ("j", np.intp), ("v", float)])]
    if len(wide):
        octave = np.floor(np.log2(reach[wide] / ewald.reach))
        for one in np.unique(octave):
            group = wide[octave == one]
            spots = cKDTree(position[group], boxsize=ewald.period)
            pairs = tree.sparse_distance_matrix(spots, np.max(reach[group]), output_type="ndarray")
            pairs["j"] = group[pairs["j"]]
            found.append(pairs[(pairs["v"] > ewald.reach) & (pairs["v"] <= reach[pairs["j"]])])
    found = np.concatenate(found)
    return found["i"], found["j"], found["v"]


@dataclass(frozen=True, eq=False)
class NearPairs:
    """The pairs at which a spot acts with its exact displacement, for spots up to given radii.

    target, source: (k,) indices of points; r: (k,) distances, m. largest_radius: (n,) up to which they suffice, m.
    replaced: the displacement by unit moments that is replaced there, three (k,).
    """

    target: np.ndarray
    source: np.ndarray
    r: np.ndarray
    largest_radius: np.ndarray
    replaced: tuple

    @classmethod
    def around(cls, half_space: HalfSpace, radius) -> NearPairs:
        """Pairs for spots of up to `radius` (n,) at the half-space's points; none where it is zero."""
        ewald = half_space.ewald
        later, earlier, r = half_space.pairs
        window = np.where(radius > 0, np.maximum(_WINDOW * radius, ewald.floor), -1.0)
        close = np.flatnonzero(r <= np.max(window, initial=0.0))
        later, earlier, r = later[close], earlier[close], r[close]
        by_earlier, by_later = r <= window[earlier], r <= window[later]
        far = _pairs_beyond(half_space.tree, half_space.points, radius, ewald)
        r = np.concatenate([r[by_earlier], r[by_later], far[2]])
        return cls(
            np.concatenate([later[by_earlier], earlier[by_later], far[0]]),
            np.concatenate([earlier[by_earlier], later[by_later], far[1]]),
            r,
            radius,
            ewald.replaced(r),
        )


@dataclass(frozen=True, eq=False)
class Interaction:
    """Displacement of the half-space at contact spots by all other spots and all images: eq. (4)'s sum.

    Parameters
    ----------
    law : the law of one spot.
    half_space : with a point at every spot.
    radius_of_curvature : (n,) R of the spots, m.
    pairs : at which a spot acts with its exact displacement.
    """

    law: SpotLaw
    half_space: HalfSpace
    radius_of_curvature: np.ndarray
    pairs: NearPairs

    @classmethod
    def between(cls, law: SpotLaw, half_space: HalfSpace, radius_of_curvature, largest_radius) -> Interaction:
        """With pairs for contact radii up to `largest_radius` (n,), m; none where it is zero."""
        return cls(law, half_space, radius_of_curvature, NearPairs.around(half_space, largest_radius))

    def displacement(self, a):
        """Displacement w at the spots, m, for contact radii a (n,), each without its own (but with its images')."""
        law, R, pairs = self.law, self.radius_of_curvature, self.pairs
        moments = law.force(a, R), law.second_moment(a, R), law.fourth_moment(a, R)
        j, r = pairs.source, pairs.r
        exact = law.displacement(r, a[j], R[j])
        for moment, replaced in zip(moments, pairs.replaced, strict=True):
            exact -= moment[j] * replaced
        return self.half_space.displacement(*moments) + np.bincount(pairs.target, exact, len(a))

    def tangent(self, a) -> Tangent:
        """The linear map from changes of the contact radii a (n,), m, to changes of `displacement`.

        Spots of zero radius have none: their change does not count.
        """
        law, R, pairs = self.law, self.radius_of_curvature, self.pairs
        there = a > 0
        safe = np.where(there, a, 1.0)
        moments = [
            np.where(there, derivative(safe, R), 0.0)
            for derivative in (law.force_derivative, law.second_moment_derivative, law.fourth_moment_derivative)
        ]
        counts = np.flatnonzero(there[pairs.source])
        j, r, target = pairs.source[counts], pairs.r[counts], pairs.target[counts]
        exact = law.displacement_derivative(r, a[j], R[j])
        fields = [moment[j] * replaced[counts] for moment, replaced in zip(moments, pairs.replaced, strict=True)]
        nearly = exact - fields[0]
        near = nearly - fields[1] - fields[2]
        return Tangent(self.half_space, tuple(moments), target, j, near, nearly)


@dataclass(frozen=True, eq=False)
class Tangent:
    """Derivative of the interaction with respect to the contact radii, as a linear operator."""

    half_space: HalfSpace
    moments: tuple
    target: np.ndarray
    source: np.ndarray
    near: np.ndarray
    near_of_forces: np.ndarray

    def __call__(self, da):
        """Change of displacement (n,) in m for changes `da` (n,) of the contact radii."""
        w = self.half_space.displacement(*(m * da for m in self.moments))
        return w + np.bincount(self.target, self.near * da[self.source], len(da))

    def nearly(self, da):
        """The same to a thousandth, several times faster."""
        w = self.half_space.nearly(self.moments[0] * da)
        return w + np.bincount(self.target, self.near_of_forces * da[self.source], len(da))


def displacement_at(
    law: SpotLaw, period: float, points, position, a, R, ewald: Ewald | None = None, *, free: bool = False
) -> np.ndarray:
    """Displacement w (n,) in m at any points (n, 2) by spots, eq. (9)'s sum.

    It is periodic and of zero mean; or, on a free half-space, the plain sum at points of the same square as the spots.

    position (m, 2), a and R (m,): centres, contact radii and radii of curvature of the spots, m. Inside a spot its own
    part is the displacement under its contact. ewald: how to split the sum (then period and free are its own); None: as
    suits the number of spots.
    """
    w = np.zeros(len(points))
    if not len(points) or not len(a):
        return w
    ewald = ewald or Ewald.of(period, law.material.contact_modulus, len(a), NEIGHBOURS_ONCE, free)
    period = ewald.period
    points, position = np.mod(points, period), np.mod(position, period)
    moments = law.force(a, R), law.second_moment(a, R), law.fourth_moment(a, R)
    tree, spots = cKDTree(points, boxsize=period), cKDTree(position, boxsize=period)
    pairs = tree.sparse_distance_matrix(spots, ewald.reach, output_type="ndarray")
    target, source, r = pairs["i"], pairs["j"], pairs["v"]
    near = sum(kernel * moment[source] for kernel, moment in zip(ewald.kernels(r), moments, strict=True))
    w = np.bincount(target, near, len(points)).astype(float)
    window = np.where(a > 0, np.maximum(_WINDOW * a, ewald.floor), -1.0)
    close = np.flatnonzero(r <= window[source])
    far = _pairs_beyond(tree, position, a, ewald)
    target, source, r = (np.append(one[close], other) for one, other in zip((target, source, r), far, strict=True))
    exact = law.displacement(r, a[source], R[source])
    for moment, replaced in zip(moments, ewald.replaced(r), strict=True):
        exact -= moment[source] * replaced
    w += np.bincount(target, exact, len(points))
    w += ewald.smooth(position, points, *moments[:2])
    w -= ewald.mean * np.sum(moments[0])
    if ewald.free:
        w -= ewald.by_images(ewald.bases(position), ewald.bases(points), moments[:2])
    return w
