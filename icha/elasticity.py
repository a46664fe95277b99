"""Elastic interaction of contact spots on a periodic half-space of zero mean displacement.

A point force F displaces the half-space by F/(pi E* r); summed over all periodic images, with the uniform
counter-pressure that keeps the mean displacement zero, the sum is split as Ewald's: the smooth part
erf(alpha r)/r goes through its Fourier series, (2/(E* q)) erfc(q/(2 alpha)) per mode and cell area, by non-uniform
FFTs; the rest is short-ranged and pairwise. A spot is no point: its exact displacement takes the place of the
point's inside a window of several of its radii, and beyond it the spot is represented by its force and by the
second moment of its pressure (the Laplacian of the point's field), which leaves a remainder of order (a/r)^5.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import finufft
import numpy as np
import scipy.fft
import scipy.sparse
from scipy.spatial import cKDTree
from scipy.special import erf, erfc

from icha.jkr import JKR

# Cut of both halves of the Ewald sum: erfc(4.6) = 8e-11.
_CUT = 4.6
_NUFFT_TOLERANCE = 1e-11
# Radii of a spot after which force and second moment represent it: remainder below 1e-7 of the displacement
# at its edge.
_WINDOW = 16.0
# Spots within the near field of a small spot: many where the same pairs serve a whole Krylov solve, few where
# they are used once.
_NEIGHBOURS_OF_SPOTS = 100
_NEIGHBOURS_OF_TARGETS = 25


def _smooth(r, alpha):
    """erf(alpha r)/r and its plane Laplacian; r >= 0."""
    x = alpha * r
    tiny = x < 0.05
    safe = np.where(tiny, 1.0, r)
    value = erf(alpha * safe) / safe
    gauss = 2 * alpha / np.sqrt(np.pi) * np.exp(-((alpha * safe) ** 2))
    laplacian = value / safe**2 - gauss * (1 / safe**2 + 2 * alpha**2)
    x2 = np.where(tiny, x, 0.0) ** 2
    scale = 2 * alpha / np.sqrt(np.pi)
    value = np.where(tiny, scale * (1 - x2 / 3 + x2**2 / 10 - x2**3 / 42), value)
    # Laplacian of r^(2k) in the plane is 4 k^2 r^(2k-2).
    laplacian = np.where(tiny, scale * alpha**2 * (-4 / 3 + 16 / 10 * x2 - 36 / 42 * x2**2), laplacian)
    return value, laplacian


def _smooth_mode(q, alpha, contact_modulus, period):
    """Displacement of a mode of wave number q > 0 by a unit point force and its images, the smooth half."""
    return 2 / (contact_modulus * q * period**2) * erfc(q / (2 * alpha))


def _short_mean(alpha, contact_modulus, period):
    """Mean displacement by a unit point force and its images, the short-ranged half; the smooth half has none."""
    return 2 / (np.sqrt(np.pi) * contact_modulus * alpha * period**2)


def periodic_difference(first, second, period):
    """Shortest way first - second between coordinates in the periodic cell, of any shape, m."""
    difference = first - second
    return difference - period * np.rint(difference / period)


@dataclass(frozen=True, eq=False)
class _FarField:
    """The smooth half of the Ewald sum between given sources and targets, as a linear operator."""

    period: float
    alpha: float
    contact_modulus: float
    sources: np.ndarray
    targets: np.ndarray

    @cached_property
    def _modes(self):
        highest = int(np.ceil(_CUT * self.alpha * self.period / np.pi))
        k = np.arange(-highest, highest + 1) * (2 * np.pi / self.period)
        q2 = k[:, None] ** 2 + k[None, :] ** 2
        q2[highest, highest] = 1.0
        q = np.sqrt(q2)
        green = _smooth_mode(q, self.alpha, self.contact_modulus, self.period)
        green[highest, highest] = 0.0
        return green, -q2 * green

    @cached_property
    def _plans(self):
        green, _ = self._modes
        plans = []
        for kind, points, sign in ((1, self.sources, -1), (2, self.targets, 1)):
            # One thread: the order of summation, and with it every bit of the result, is then fixed.
            plan = finufft.Plan(
                kind,
                green.shape,
                eps=_NUFFT_TOLERANCE,
                isign=sign,
                nthreads=1,
                upsampfac=2.0,
                dtype="complex128",
            )
            angle = points * (2 * np.pi / self.period)
            plan.setpts(np.ascontiguousarray(angle[:, 1]), np.ascontiguousarray(angle[:, 0]))
            plans.append(plan)
        return plans

    def __call__(self, force, moment):
        """Displacement (m) at the targets, of forces (N) and second moments (N m^2) at the sources."""
        if not len(self.sources) or not len(self.targets):
            return np.zeros(len(self.targets))
        green, laplacian = self._modes
        collect, distribute = self._plans
        # Both real sets travel as one complex set: its spectrum c holds F as the part with c(-k) = conj c(k).
        largest = np.max(np.abs(moment), initial=0.0)
        scale = np.max(np.abs(force), initial=0.0) / largest if largest > 0 else 1.0
        c = collect.execute(force + 1j * (scale * moment))
        mirrored = np.conj(c[::-1, ::-1])
        field = green * (0.5 * (c + mirrored)) + (laplacian / scale) * (-0.5j * (c - mirrored))
        return np.ascontiguousarray(distribute.execute(np.ascontiguousarray(field)).real)


@dataclass(frozen=True, eq=False)
class Interaction:
    """Displacement of a periodic half-space at given points under given contact spots.

    Parameters
    ----------
    law : the law of one spot.
    period : side of the cell, m.
    sources : (m, 2) centres of the spots, m.
    largest_radius : (m,) contact radii up to which the windows reach; spots may be smaller, m.
    radii_of_curvature : (m,) R of the spots, m.
    targets : (n, 2) points, m; None: the spots' own centres, where a spot's own displacement (but not that of its
        images) is left out, as the law of the asperity already contains it.
    """

    law: JKR
    period: float
    sources: np.ndarray
    largest_radius: np.ndarray
    radii_of_curvature: np.ndarray
    targets: np.ndarray | None = None

    @cached_property
    def _alpha(self):
        return _CUT / self._reach

    @cached_property
    def _reach(self):
        """Radius of the near field of small spots; never more than half the cell (nearest images only)."""
        neighbours = _NEIGHBOURS_OF_SPOTS if self.targets is None else _NEIGHBOURS_OF_TARGETS
        return self.period * min(0.5, np.sqrt(neighbours / (np.pi * max(len(self.sources), 1))))

    @cached_property
    def _points(self):
        return self.sources if self.targets is None else self.targets

    @cached_property
    def _far(self):
        return _FarField(self.period, self._alpha, self.law.material.contact_modulus, self.sources, self._points)

    @cached_property
    def _pairs(self):
        """Near pairs as (target, source, distance, smooth part, its Laplacian)."""
        window = np.minimum(np.maximum(self._reach, _WINDOW * self.largest_radius), 0.5 * self.period)
        tree = cKDTree(np.mod(self._points, self.period), boxsize=self.period)
        wide = window > self._reach
        target, source = [np.empty(0, dtype=int)], [np.empty(0, dtype=int)]
        small = np.flatnonzero(~wide)
        if len(small):
            near = cKDTree(np.mod(self.sources[small], self.period), boxsize=self.period)
            found = tree.sparse_distance_matrix(near, self._reach, output_type="coo_matrix")
            target.append(found.row)
            source.append(small[found.col])
        for j in np.flatnonzero(wide):
            found = np.asarray(tree.query_ball_point(np.mod(self.sources[j], self.period), window[j]), dtype=int)
            target.append(found)
            source.append(np.full(len(found), j))
        target, source = np.concatenate(target).astype(int), np.concatenate(source).astype(int)
        if self.targets is None:
            other = target != source
            target, source = target[other], source[other]
        r = np.hypot(*periodic_difference(self._points[target], self.sources[source], self.period).T)
        return target, source, r, *_smooth(r, self._alpha)

    @cached_property
    def _own_smooth(self):
        """Smooth part and Laplacian at r = 0, which the far field holds for the spot's own site."""
        value, laplacian = _smooth(np.zeros(1), self._alpha)
        return value[0], laplacian[0]

    def _assemble(self, pair_values, force, moment):
        target, source, r, smooth, laplacian = self._pairs
        scale = 1 / (np.pi * self.law.material.contact_modulus)
        values = pair_values(r, source) - scale * (force[source] * smooth + moment[source] * laplacian)
        w = np.bincount(target, weights=values, minlength=len(self._points)).astype(float)
        w += self._far(force, moment)
        w -= np.sum(force) * _short_mean(self._alpha, self.law.material.contact_modulus, self.period)
        if self.targets is None:
            w -= scale * (force * self._own_smooth[0] + moment * self._own_smooth[1])
        return w

    def displacement(self, a):
        """Displacement w at the targets, m, for contact radii a (m,); eq. (4)'s sum, periodic and of zero mean."""
        law, R = self.law, self.radii_of_curvature
        return self._assemble(lambda r, j: law.displacement(r, a[j], R[j]), law.force(a, R), law.second_moment(a, R))

    def tangent(self, a) -> Tangent:
        """The linear map from changes of the contact radii to changes of `displacement`, at radii a > 0."""
        target, source, r, smooth, laplacian = self._pairs
        law, R = self.law, self.radii_of_curvature
        force, moment = law.force_derivative(a, R), law.second_moment_derivative(a, R)
        scale = 1 / (np.pi * law.material.contact_modulus)
        values = law.displacement_derivative(r, a[source], R[source])
        values = values - scale * (force[source] * smooth + moment[source] * laplacian)
        shape = (len(self._points), len(self.sources))
        near = scipy.sparse.csr_matrix((values, (target, source)), shape=shape)
        mean = _short_mean(self._alpha, law.material.contact_modulus, self.period)
        own = None
        if self.targets is None:
            own = scale * (force * self._own_smooth[0] + moment * self._own_smooth[1])
        return Tangent(near, self._far, force, moment, mean, own)


@dataclass(frozen=True, eq=False)
class Tangent:
    """Derivative of the interaction with respect to the contact radii, as a linear operator."""

    near: scipy.sparse.csr_matrix
    far: _FarField
    force: np.ndarray
    moment: np.ndarray
    mean: float
    own: np.ndarray | None

    def __call__(self, da):
        """Change of displacement (m) for changes `da` (m,) of the contact radii."""
        w = self.near @ da + self.far(self.force * da, self.moment * da) - self.mean * np.sum(self.force * da)
        if self.own is not None:
            w -= self.own * da
        return w


def displacement_field(law: JKR, period: float, grid: int, centres, a, R) -> np.ndarray:
    """Displacement w (grid, grid) in m at the nodes of a regular grid, eq. (9)'s sum, periodic and of zero mean.

    centres: (m, 2), a and R: (m,), all m. Inside a spot its own part is the displacement under its contact.
    """
    spacing = period / grid
    # Eight cells per 1/alpha: the grid's own FFT then carries the smooth half.
    reach = min(0.5 * period, max(2 * _CUT**2 / np.pi * spacing, 2 * spacing))
    alpha = _CUT / reach
    w = np.zeros((grid, grid))
    if not len(a):
        return w
    force, moment = law.force(a, R), law.second_moment(a, R)
    highest = grid // 2 - 1 if grid % 2 == 0 else grid // 2
    k = np.arange(-highest, highest + 1) * (2 * np.pi / period)
    angle = centres * (2 * np.pi / period)
    y, x = np.ascontiguousarray(angle[:, 1]), np.ascontiguousarray(angle[:, 0])
    size = (2 * highest + 1,) * 2
    sums = [
        finufft.nufft2d1(y, x, strength.astype(complex), size, eps=_NUFFT_TOLERANCE, isign=-1, nthreads=1)[:, highest:]
        for strength in (force, moment)
    ]
    q = np.sqrt(k[:, None] ** 2 + k[None, highest:] ** 2)
    q[highest, 0] = 1.0
    green = _smooth_mode(q, alpha, law.material.contact_modulus, period)
    green[highest, 0] = 0.0
    half = np.zeros((grid, grid // 2 + 1), dtype=complex)
    rows = np.arange(-highest, highest + 1) % grid
    half[rows, : highest + 1] = green * (sums[0] - q**2 * sums[1])
    w += scipy.fft.irfft2(half, s=(grid, grid), norm="forward", overwrite_x=True, workers=1)

    scale = 1 / (np.pi * law.material.contact_modulus)
    w -= np.sum(force) * _short_mean(alpha, law.material.contact_modulus, period)
    window = np.minimum(np.maximum(reach, _WINDOW * a), 0.5 * period)
    for j in range(len(a)):
        rows, columns, r = nodes_around(centres[j], window[j], grid, period)
        smooth, laplacian = _smooth(r, alpha)
        w[rows, columns] += law.displacement(r, a[j], R[j]) - scale * (force[j] * smooth + moment[j] * laplacian)
    return w


def nodes_around(centre, radius, grid, period):
    """Rows, columns and distances (k,) of the grid nodes within `radius` (at most half the period) of a point."""
    spacing = period / grid
    count = min(int(radius / spacing) + 1, grid // 2)
    middle = np.rint(np.asarray(centre) / spacing).astype(int)
    offset = np.arange(-count, count + 1) if 2 * count + 1 <= grid else np.arange(-count, grid - count)
    dx = (middle[0] + offset) * spacing - centre[0]
    dy = (middle[1] + offset) * spacing - centre[1]
    r = np.hypot(dy[:, None], dx[None, :])
    inside = r <= radius
    row, column = np.nonzero(inside)
    return (middle[1] + offset[row]) % grid, (middle[0] + offset[column]) % grid, r[inside]
