"""Ewald sums for the displacement of a half-space by forces at points and by their periodic images.

A point force F displaces the half-space by F/(pi E* r). The sum includes all periodic images, and a uniform
counter-pressure that keeps the mean displacement zero. The smooth half of the sum (`icha.half_space.split`) is a
Fourier series, computed with non-uniform FFTs. The short-ranged half is summed over pairs of close points. A point may
also have moments of a pressure (`icha.half_space.grid_displacement`).

A single square on a free half-space has no images. The square is placed in a periodic cell of twice its side. In
this cell, two points of the square are closer to each other than to any image. `icha.half_space.free_square` subtracts
the displacement by images and counter-pressure. What remains is the sum of F/(pi E* r) over the points of the square.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import finufft
import numpy as np
import scipy.sparse
from scipy.spatial import cKDTree
from scipy.special import erfc

from icha.half_space.free_square import basis, image_field
from icha.half_space.split import MOMENTS, short_mean, smooth_half, smooth_mode
from icha.surfaces.square import cell_of, periodic_difference

# The short-ranged half ends at this value of alpha r, the smooth half at this value of q/(2 alpha); erfc(4.3) = 1.2e-9.
_CUT = 4.3
_NUFFT_TOLERANCE = 1e-9
# Cut-off, and tolerance of the FFTs, for the approximate sum that linear solves use; erfc(2.75) = 1e-4.
_LOOSE_CUT = 2.75
_LOOSE_NUFFT_TOLERANCE = 1e-4
# Mean number of points in the near field of a point: for pairs that are used in many sums, and for pairs used once.
NEIGHBOURS = 60
NEIGHBOURS_ONCE = 20
# Within this distance, in mean spacings of the points, the fields of the moments are constant, because the true fields
# are singular at r = 0. Exact displacements replace the constant values.
_FLOOR = 0.05


class _SmoothSum:
    """Function that sums the smooth half of the displacement with non-uniform FFTs.

    FFT plans take long to make, but depend only on the number of modes. Points are set again only when they change.
    """

    def __init__(self, period, alpha, contact_modulus, cut, tolerance, dtype=np.complex128):
        """Make the FFT plans; `cut` is the largest q/(2 alpha), `dtype` the complex type of the sums."""
        self._period, self._dtype, self._real = period, np.dtype(dtype), np.empty(0, dtype).real.dtype
        highest = int(np.ceil(cut * alpha * period / np.pi))
        k = np.arange(-highest, highest + 1) * (2 * np.pi / period)
        q2 = k[:, None] ** 2 + k[None, :] ** 2
        q2[highest, highest] = 1.0
        green = smooth_mode(np.sqrt(q2), alpha, contact_modulus, period)
        green[highest, highest] = 0.0
        self._unit = float(green.max())
        self._green = (green / self._unit).astype(self._real)
        self._laplacian = -q2 * self._green
        # One thread fixes the order of summation, and therefore every bit of the result.
        options = {"eps": tolerance, "nthreads": 1, "upsampfac": 1.25, "dtype": self._dtype.name}
        self._plans = [finufft.Plan(kind, q2.shape, isign=sign, **options) for kind, sign in ((1, -1), (2, 1))]
        self._points = [None, None]

    def _set_points(self, which, points):
        """Set the points of plan 0 (sources) or 1 (targets), an (n, 2) array in m, unless they are already set."""
        if self._points[which] is not points:
            angle = (points * (2 * np.pi / self._period)).astype(self._real)
            self._plans[which].setpts(np.ascontiguousarray(angle[:, 1]), np.ascontiguousarray(angle[:, 0]))
            self._points[which] = points

    def __call__(self, sources, targets, force, moment=None):
        """Return the displacement (m) at the targets by forces (N) and second moments (N m^2) at the sources."""
        largest, second = (0.0 if m is None else np.max(np.abs(m), initial=0.0) for m in (force, moment))
        if not len(targets) or not (largest or second):
            return np.zeros(len(targets))
        self._set_points(0, sources)
        self._set_points(1, targets)
        collect, distribute = self._plans
        if not second:
            modes = collect.execute((force / largest).astype(self._dtype)) * self._green
            return self._unit * largest * distribute.execute(modes).real
        # Forces and moments are transformed together, as real and imaginary parts. In the spectrum c the part with
        # c(-k) = conj c(k) belongs to the forces.
        scale = largest / second or 1.0
        c = collect.execute(force + 1j * (scale * moment))
        mirrored = np.conj(c[::-1, ::-1])
        modes = (0.5 * self._green) * (c + mirrored) + (-0.5j / scale * self._laplacian) * (c - mirrored)
        return self._unit * distribute.execute(modes).real


@dataclass(frozen=True, eq=False)
class Ewald:
    """Split of the sum over all images into a smooth half and a short-ranged half.

    Attributes
    ----------
    period : period of the sum, m; on a free half-space twice the side of the square.
    contact_modulus : E*, Pa.
    reach : radius of the near field, in which the short-ranged half is summed, m.
    floor : within this distance, m, the fields of the moments are constant.
    free : True for a free half-space; its points lie in the quarter [0, period/2]^2 of the cell.
    """

    period: float
    contact_modulus: float
    reach: float
    floor: float
    free: bool = False

    @classmethod
    def choose(cls, period, contact_modulus, count, neighbours, free=False):
        """Return the split for `count` points, with `neighbours` points on average in the near field of a point.

        period : side of the square, m; free : whether the square has no periodic images.
        """
        spacing = period / np.sqrt(max(count, 1))
        cell = cell_of(period, free)
        reach = min(0.5 * cell, np.sqrt(neighbours / np.pi) * spacing)
        return cls(cell, contact_modulus, reach, _FLOOR * min(spacing, 0.1 * period), free)

    @property
    def side(self):
        """Side of the square, m."""
        return 0.5 * self.period if self.free else self.period

    def bases(self, points):
        """Return `free_square.basis` of the y and the x coordinates of points, (n, 2) array in m; None if periodic."""
        return (basis(points[:, 1], self.period), basis(points[:, 0], self.period)) if self.free else None

    def image_displacement(self, sources, targets, moments):
        """Return the displacement (m) at targets by images of sources; both arguments are `bases` of points."""
        field = image_field(*sources, moments, self.period, self.contact_modulus)
        by, bx = targets
        return np.einsum("ia,ia->i", by @ field, bx)

    @cached_property
    def alpha(self):
        """Parameter alpha of the split, 1/m."""
        return _CUT / self.reach

    @cached_property
    def smooth(self):
        """Function that sums the smooth half accurately."""
        return _SmoothSum(self.period, self.alpha, self.contact_modulus, _CUT, _NUFFT_TOLERANCE)

    @cached_property
    def loose(self):
        """Function that sums the smooth half fast, with a relative error of about 1e-3."""
        return _SmoothSum(
            self.period, self.alpha, self.contact_modulus, _LOOSE_CUT, _LOOSE_NUFFT_TOLERANCE, np.complex64
        )

    @cached_property
    def for_one_sum(self):
        """Split with a smaller near field, for pairs of points that are used in only one sum."""
        return replace(self, reach=self.reach * np.sqrt(NEIGHBOURS_ONCE / NEIGHBOURS))

    @cached_property
    def mean(self):
        """Mean over the cell of the displacement by a unit force: short-ranged half only, m/N."""
        return short_mean(self.alpha, self.contact_modulus, self.period)

    @cached_property
    def self_displacement(self):
        """Smooth half of the displacement of a point by its unit force, m/N, and by its unit second moment, 1/(N m)."""
        scale, value = 1 / (np.pi * self.contact_modulus), 2 * self.alpha / np.sqrt(np.pi)
        return scale * value, scale * (value * self.alpha**2 * (-4 / 3))

    def kernels(self, r):
        """Return three arrays: short-ranged displacement at distances r by unit moments k = 0, 1, 2.

        The arrays are erfc(alpha r)/r, the plane Laplacian of erfc(alpha r)/r, and 1/r^5, all divided by pi E*.
        """
        r, alpha, scale = np.maximum(r, self.floor), self.alpha, 1 / (np.pi * self.contact_modulus)
        inverse, x2 = 1 / r, (alpha * r) ** 2
        gauss = 2 * alpha / np.sqrt(np.pi) * scale * np.exp(-x2)
        force = erfc(alpha * r)
        force *= scale * inverse
        inverse *= inverse
        moment = (force + gauss) * inverse
        moment += 2 * alpha**2 * gauss
        return force, moment, scale * inverse**2 / r

    def point_displacement(self, r):
        """Return three arrays: displacement in this Ewald sum at distances r by unit moments k = 0, 1, 2."""
        raised = np.maximum(r, self.floor)
        force, moment = 1 / raised, 1 / raised**3
        fourth = np.where(r <= self.reach, 1 / raised**5, 0.0)
        low = np.flatnonzero(r < self.floor)
        if len(low):
            # Below the floor only the short-ranged half is constant.
            at, at_floor = (smooth_half((self.alpha * x[low]) ** 2, np.eye(2, MOMENTS)) for x in (r, raised))
            force[low] += self.alpha * (at - at_floor)[0]
            moment[low] += self.alpha**3 * (at - at_floor)[1]
        scale = 1 / (np.pi * self.contact_modulus)
        return scale * force, scale * moment, scale * fourth


@dataclass(frozen=True, eq=False)
class PointHalfSpace:
    """Half-space with forces and moments at n points, and its displacement at the same points.

    The displacement at a point includes the displacement by the images of the point, but not by the point itself.

    Attributes
    ----------
    ewald : split of the sum.
    points : (n, 2) float, positions, m.
    pairs : three arrays for all pairs of near points: index of the later point, of the earlier point, and distance, m.
    near : matrices of the short-ranged displacement by unit moments k = 0, 1, 2: for each k an (n, n) lower triangular
        matrix and its transpose.
    near_loose : as `near`, but only the two matrices for unit forces (k = 0), with a relative error of 1e-3.
    bases : `Ewald.bases` of the points; None on a periodic surface.
    """

    ewald: Ewald
    points: np.ndarray
    pairs: tuple
    near: tuple
    near_loose: tuple
    bases: tuple | None = None

    @cached_property
    def tree(self):
        """Search tree of the points."""
        return cKDTree(self.points, boxsize=self.ewald.period)

    @classmethod
    def at(cls, points, period, contact_modulus, free=False) -> PointHalfSpace:
        """Return the half-space with these points, (n, 2) array in m; `period` is the side of the square, m."""
        ewald = Ewald.choose(period, contact_modulus, len(points), NEIGHBOURS, free)
        points = np.mod(points, ewald.period)
        found = cKDTree(points, boxsize=ewald.period).query_pairs(ewald.reach, output_type="ndarray")
        return cls._assemble(ewald, points, None, found.max(axis=1), found.min(axis=1))

    def extended(self, points) -> PointHalfSpace:
        """Return a half-space with the present points, followed by additional `points`, a (k, 2) array in m."""
        known, period = len(self.points), self.ewald.period
        points = np.mod(points, period)
        tree = cKDTree(points, boxsize=period)
        across = tree.sparse_distance_matrix(self.tree, self.ewald.reach, output_type="ndarray")
        among = tree.query_pairs(self.ewald.reach, output_type="ndarray")
        later = np.concatenate([across["i"], among.max(axis=1)]) + known
        earlier = np.concatenate([across["j"], among.min(axis=1) + known])
        return self._assemble(self.ewald, np.concatenate([self.points, points]), self, later, earlier)

    @classmethod
    def _assemble(cls, ewald, points, before, later, earlier):
        """Build the half-space from new pairs of points, and from the pairs of `before` (a half-space or None)."""
        n, known = len(points), 0 if before is None else len(before.points)
        difference = periodic_difference(points[later], points[earlier], ewald.period)
        r = np.sqrt(difference[:, 0] ** 2 + difference[:, 1] ** 2)
        rows = scipy.sparse.coo_matrix((r, (later - known, earlier)), shape=(n - known, n)).tocsr()
        later, earlier, r = np.repeat(np.arange(known, n), np.diff(rows.indptr)), rows.indices, rows.data
        start, kernels = rows.indptr, ewald.kernels(r)
        if before is not None:
            old = before.near[0][0]
            start = np.concatenate([old.indptr, old.nnz + start[1:]])
            kernels = [np.concatenate([m.data, k]) for (m, _), k in zip(before.near, kernels, strict=True)]
            later, earlier, r = (np.concatenate(p) for p in zip(before.pairs, (later, earlier, r), strict=True))
        near = [scipy.sparse.csr_matrix((kernel, earlier, start), shape=(n, n)) for kernel in kernels]
        counts = r <= ewald.reach * _LOOSE_CUT / _CUT
        ends = np.append(0, np.cumsum(counts))[start]
        loose = scipy.sparse.csr_matrix((kernels[0][counts], earlier[counts], ends), shape=(n, n))
        pairs, near = (later, earlier, r), tuple((matrix, matrix.T) for matrix in near)
        return cls(ewald, points, pairs, near, (loose, loose.T), ewald.bases(points))

    def displacement(self, force, moment, fourth):
        """Return the displacement (m) by forces (N), second moments (N m^2) and fourth moments (N m^4), all (n,)."""
        w = self.ewald.smooth(self.points, self.points, force, moment)
        for halves, strength in zip(self.near, (force, moment, fourth), strict=True):
            for half in halves:
                w += half @ strength
        by_force, by_moment = self.ewald.self_displacement
        w -= by_force * force + by_moment * moment
        return self._subtract_mean_and_images(w, force, moment)

    def approximate_displacement(self, force):
        """Return the displacement (m) by forces alone, (n,), with a relative error of about 1e-3."""
        w = self.ewald.loose(self.points, self.points, force)
        for half in self.near_loose:
            w += half @ force
        w -= self.ewald.self_displacement[0] * force
        return self._subtract_mean_and_images(w, force)

    def _subtract_mean_and_images(self, w, *moments):
        """Subtract from w the mean of the short-ranged half and, on a free half-space, the displacement by images."""
        w -= self.ewald.mean * np.sum(moments[0])
        if self.bases is not None:
            w -= self.ewald.image_displacement(self.bases, self.bases, moments)
        return w
