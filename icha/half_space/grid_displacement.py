"""Displacement of the half-space at all nodes of a grid, and the nodes around every spot.

The sum over spots and images is split as in `icha.half_space.ewald`. A Fourier series gives the smooth half. The
short-ranged half is computed in a window around every spot. The computing time depends on the area of all windows.
At more than five radii from a spot, four moments of the pressure represent the spot. So small spots have small windows.
The smooth half of a large spot must be smooth on the scale of this spot. Therefore spots of similar size form groups,
and every group has a Fourier series with a different number of modes.

The moments of a spot are M_k = integral of p r^(2k) / (4^k k!^2). Far from the spot, the displacement is the sum over k
of M_k Lap^k (1/(pi E* r)), with the plane Laplacian Lap. In Fourier space, this sum is the displacement by a point
force that depends on q: the sum of M_k (-q^2)^k.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import finufft
import numpy as np
import scipy.fft

from icha.asperity.jkr import JKR
from icha.half_space.free_square import basis, image_field
from icha.half_space.split import MOMENTS, short_mean, smooth_half, smooth_mode
from icha.support.parallel import blocks, on_cores
from icha.surfaces.square import cell_of

# The short-ranged half ends at this value of alpha r, the smooth half at this value of q/(2 alpha); erfc(4.6) = 8e-11.
_CUT = 4.6
_NUFFT_TOLERANCE = 1e-12
# Farther from a spot than this distance, in contact radii, four moments represent the spot. The error is then 1e-8 of
# the displacement at the edge of the spot.
_WINDOW = 5.0
# Ratio of the window widths of two successive groups of spots.
_LADDER = math.sqrt(2)
# Number of nodes in a block of rows. Number of nodes in windows that are evaluated together. Both fit into the cache.
_BLOCK = 2**19
_BATCH = 2**15


def row_blocks(grid: int) -> list[slice]:
    """Divide the rows of a grid into slices; the size of the slices does not depend on the number of cores."""
    return blocks(grid, max(_BLOCK // grid, 1))


@dataclass(frozen=True, eq=False)
class DisplacementField:
    """Displacement w of the half-space at the nodes of a regular grid by m spots: the sum of eq. (9).

    The displacement is periodic and has zero mean. On a free half-space there are no images, and the mean is not zero.
    At a node under a spot, the displacement by this spot is included.

    Attributes
    ----------
    law : law of the spots in their states.
    period : side of the square, m.
    grid : number of nodes along a side; this grid may be coarser than the grid of the surface.
    centres : (m, 2) float, centres of the spots, m.
    contact_radius, radius_of_curvature : (m,) float, one value for each spot, m.
    free : whether the square is on a free half-space, without periodic images.
    """

    law: JKR
    period: float
    grid: int
    centres: np.ndarray
    contact_radius: np.ndarray
    radius_of_curvature: np.ndarray
    free: bool = False

    @property
    def _cell(self):
        """Period of the sum, m; on a free half-space twice the side of the square."""
        return cell_of(self.period, self.free)

    @property
    def _nodes(self):
        """Number of nodes along the period of the sum."""
        return cell_of(self.grid, self.free)

    def map_blocks(self, function) -> list:
        """Call `function(rows, w)` with the displacement of every block of rows, in threads; return the results.

        rows : slice, the rows of a block; w : (rows.stop - rows.start, grid) float, displacement of these rows, m.
        """
        if len(self.contact_radius):
            # Compute these properties once, before several threads need them.
            _ = self._smooth_half, self.free and self._images
        return on_cores(lambda rows: function(rows, self.rows(rows)), row_blocks(self.grid))

    def rows(self, rows: slice) -> np.ndarray:
        """Return the displacement (m) at the nodes of a range of rows: array of shape (number of rows, grid)."""
        if not len(self.contact_radius):
            return np.zeros((rows.stop - rows.start, self.grid))
        # If the grid is too coarse for the Fourier series, use a finer grid that contains all nodes of the grid.
        finer, half = self._smooth_half
        nodes = np.arange(rows.start, rows.stop) * finer
        w = scipy.fft.irfft(half[nodes], n=finer * self._nodes, axis=1, norm="forward", workers=1)[:, ::finer]
        modulus = self.law.material.contact_modulus
        mean = sum(np.sum(g.moments[:, 0]) * short_mean(g.alpha, modulus, self._cell) for g in self._groups)
        w = np.ascontiguousarray(w) - mean
        for group in self._groups:
            for spot, dy, dx, node in windows(self.centres[group.spots], group.reach, self._nodes, self._cell, rows):
                np.add.at(w.reshape(-1), node.ravel(), self._evaluate_short_half(group, spot, dy, dx).ravel())
        if self.free:
            w = w[:, : self.grid]
            by, bx, field = self._images
            w = w - (by[rows] @ field) @ bx.T
        return w

    @cached_property
    def _images(self):
        """Displacement by images on a free half-space: `basis` of the rows and of the columns, and `image_field`."""
        nodes = basis(np.arange(self.grid) * (self.period / self.grid), self._cell)
        field = 0.0
        for group in self._groups:
            bases = (basis(self.centres[group.spots, axis], self._cell) for axis in (1, 0))
            moments = group.moments.T / group.alpha ** (2 * np.arange(MOMENTS)[:, None])
            field = field + image_field(*bases, moments, self._cell, self.law.material.contact_modulus)
        return nodes, nodes, field

    @cached_property
    def _groups(self):
        """List of groups (`_Group`): spots of similar radius, which have windows of the same width."""
        count, widest = len(self.contact_radius), 0.5 * self._cell
        # This number of modes makes the Fourier series and the windows about equally costly.
        modes = min((2.0 * count * self._nodes**2) ** 0.25, (self._nodes - 1) // 2)
        narrowest = min(_CUT**2 / np.pi * self._cell / modes, widest)
        needed = np.clip(_WINDOW * self.contact_radius, narrowest, widest)
        rung = np.ceil(np.log(needed / narrowest) / math.log(_LADDER) - 1e-9).astype(int)
        return [
            self._make_group(np.flatnonzero(rung == k), min(narrowest * _LADDER**k, widest)) for k in np.unique(rung)
        ]

    def _make_group(self, spots, reach):
        """Make the group of the spots with these indices, with windows of half width `reach`, m."""
        a, R, alpha = self.contact_radius[spots], self.radius_of_curvature[spots], _CUT / reach
        order = np.arange(MOMENTS)
        factorial = np.cumprod(np.maximum(order, 1))
        moments = self.law.select(spots).moments(a, R, MOMENTS)
        moments *= (0.25 * (alpha * a[:, None]) ** 2) ** order / factorial**2
        return _Group(spots, reach, alpha, moments)

    @cached_property
    def _smooth_half(self):
        """Smooth half of all groups: refinement factor of the grid, and Fourier series along x of each refined row."""
        modes = on_cores(self._compute_modes, self._groups)
        highest = [each.shape[1] - 1 for each in modes]
        finer = -(-(2 * max(highest) + 1) // self._nodes)
        half = np.zeros((finer * self._nodes, max(highest) + 1), dtype=complex)
        for k, each in zip(highest, modes, strict=True):
            half[np.arange(-k, k + 1) % len(half), : k + 1] += each

        def transform_along_y(columns):
            """Transform some columns along y: each row of `half` becomes the Fourier series along x of a grid row."""
            half[:, columns] = scipy.fft.ifft(half[:, columns], axis=0, norm="forward", workers=1)

        on_cores(transform_along_y, blocks(half.shape[1], 64))
        return finer, half

    def _compute_modes(self, group):
        """Return the Fourier coefficients (m) of the smooth half of one group: array of shape (2k + 1, k + 1)."""
        highest = math.ceil(_CUT * group.alpha * self._cell / np.pi - 1e-9)
        y, x = (np.ascontiguousarray(self.centres[group.spots, axis]) * (2 * np.pi / self._cell) for axis in (1, 0))
        k = np.arange(-highest, highest + 1) * (2 * np.pi / self._cell)
        q2 = k[:, None] ** 2 + k[None, highest:] ** 2
        strength, factor = np.zeros(q2.shape, dtype=complex), np.ones(q2.shape)
        for even, odd in group.moments.T.reshape(-1, 2, len(group.spots)):
            # Two moments are transformed together, as real and imaginary parts. In the spectrum c, the part with
            # c(-k) = conj c(k) belongs to the first moment. One thread fixes every bit of the result.
            c = finufft.nufft2d1(y, x, even + 1j * odd, (len(k), len(k)), eps=_NUFFT_TOLERANCE, isign=-1, nthreads=1)
            mirrored = np.conj(c[::-1, ::-1])[:, highest:]
            c = c[:, highest:]
            strength += factor * (0.5 * (c + mirrored))
            factor *= -q2 / group.alpha**2
            strength += factor * (-0.5j * (c - mirrored))
            factor *= -q2 / group.alpha**2
        q2[highest, 0] = 1.0
        strength *= smooth_mode(np.sqrt(q2), group.alpha, self.law.material.contact_modulus, self._cell)
        strength[highest, 0] = 0.0
        return strength

    def _evaluate_short_half(self, group, of_group, dy, dx):
        """Return the exact displacement minus the smooth half in windows of a group; `windows` yields the arguments."""
        spot, r2 = group.spots[of_group][:, None], dy[:, None] ** 2 + dx**2
        a, R = self.contact_radius[spot], self.radius_of_curvature[spot]
        w = self.law.select(spot).displacement(np.sqrt(r2), a, R)
        r2 *= group.alpha**2
        smooth = smooth_half(r2, group.moments[of_group])
        smooth *= group.alpha / (np.pi * self.law.material.contact_modulus)
        w -= smooth
        return w


@dataclass(frozen=True, eq=False)
class _Group:
    """Group of m spots of similar size.

    Attributes
    ----------
    spots : (m,) int, indices of the spots.
    reach : half the width of the windows around the spots, m.
    alpha : parameter of the split, 1/m.
    moments : (m, 4) float, M_k alpha^(2k), N.
    """

    spots: np.ndarray
    reach: float
    alpha: float
    moments: np.ndarray


def windows(centres, reach: float, grid: int, period: float, rows: slice):
    """Yield those nodes of some rows that lie in squares around the positions `centres`, an (m, 2) array in metres.

    The half width of a square is `reach`, m; some nodes lie a little outside. No node occurs twice for the same centre.

    Yields
    ------
    Four arrays for k parts of rows with n nodes each: indices of the centres (k,); distances of the nodes from the
    centre along y (k,) and along x (k, n), m; and indices of the nodes (k, n) in the flattened block of rows.
    """
    spacing = period / grid
    ahead = int(reach / spacing) + 1
    width = min(2 * ahead + 1, grid)
    ahead = min(ahead, grid // 2)
    count = rows.stop - rows.start
    # First row and column of every window, before periodic wrapping.
    first = np.rint(centres / spacing).astype(int) - ahead
    lag = np.mod(rows.start - first[:, 1], grid)
    meeting = np.flatnonzero((lag < width) | (lag + count > grid))
    step = np.mod(lag[meeting, None] + np.arange(count), grid)
    which, row = np.nonzero(step < width)
    spot = meeting[which]
    line = first[spot, 1] + step[which, row]
    for some in blocks(len(spot), max(_BATCH // width, 1)):
        at = spot[some]
        column = first[at, 0][:, None] + np.arange(width)
        dy = line[some] * spacing - centres[at, 1]
        dx = column * spacing - centres[at, 0][:, None]
        yield at, dy, dx, row[some][:, None] * grid + np.mod(column, grid)
