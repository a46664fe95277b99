"""A square height map of the rigid rough surface that faces the elastic half-space.

Heights are in metres and positive towards the elastic body. The first axis of an array of heights is y, the second x;
node (iy, ix) lies at (x, y) = (ix, iy) * spacing.
"""

from __future__ import annotations

import math
import sys
import warnings
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.fft

from icha.support.parallel import blocks, on_cores
from icha.support.rules import LENGTH, SLOPE, FloatRange, IntegerRange
from icha.surfaces.square import problem_with_heights

# Values of `boundary`: a square that repeats, or a single square on a half-space.
PERIODIC, FREE = "periodic", "free"

# Bounds of the range of heights divided by the period.
_STEEPNESS = FloatRange(least=1e-24, most=1e9)
# Rows or columns that are transformed at a time.
_LINES = 64
# Largest number of lines inside a cell whose steps are compared with the step between cells.
_COMPARED_LINES = 256
# Smallest ratio of the misfit between cells to the largest misfit inside a cell at which edges do not fit. The misfit
# is a step less the mean of the two steps beside it, rms along a line. Measured on periodic surfaces: up to 1.3, and
# 2.4 on white noise of 8 x 8 nodes; on halves of them with 4 nodes per shortest wave: 3.2 and more.
_MISFIT = 3.0
# Smallest such ratio of the steps themselves, rms along a line. It is 1.03 between the halves of a symmetric dome,
# which meet in an edge without a step.
_STEP = 1.1
MISFIT_OF_EDGES = (
    f"boundary: {PERIODIC!r}, but opposite edges differ by much more than neighbouring nodes, so there is a step at "
    f"the edges; use boundary={FREE!r}, or icha.read_scan for a measured surface"
)


class EdgeWarning(UserWarning):
    """Opposite edges of a periodic surface differ by a step."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A rough surface of zero mean height: one cell of a periodic surface, or a single square.

    Parameters
    ----------
    heights : (n, n) array, metres. Its mean is removed; the array is copied and made read-only.
    period : side of the square, which is the period of a periodic surface, metres, in [1e-24, 1e9].
    boundary : "periodic" in both directions, or "free": one square on a half-space that extends beyond it.

    Raises
    ------
    ValueError
        If the heights are not a square array of at least 8 x 8 finite numbers, or are all the same; if their range
        divided by the period is not in [1e-24, 1e9]; or if the period or the boundary is not one of those above.
    """

    heights: np.ndarray
    period: float
    boundary: str = PERIODIC

    def __post_init__(self):
        """Check the values and freeze them."""
        try:
            given = np.asarray(self.heights)
            if given.dtype.kind not in "fiu":
                raise TypeError(f"they are of type {given.dtype.name}")
            if np.ma.is_masked(self.heights):
                raise ValueError("some are masked; fill or crop them first")
            heights = np.array(given, dtype=np.float64, order="C")
        except (TypeError, ValueError) as error:
            raise ValueError(f"heights: must be an array of real numbers in metres ({error})") from None
        if problem := problem_with_heights(heights):
            raise ValueError(f"heights: {problem}")
        object.__setattr__(self, "period", LENGTH.validate("period", self.period))
        with np.errstate(over="ignore"):
            _STEEPNESS.validate("heights: their range over the period", np.ptp(heights) / self.period)
        heights -= heights.mean()
        heights.flags.writeable = False
        object.__setattr__(self, "heights", heights)
        if self.boundary not in (PERIODIC, FREE):
            raise ValueError(f"boundary: {self.boundary!r} must be one of {PERIODIC}, {FREE}")
        # For surfaces that this package makes, `icha describe` reports the step.
        caller = sys._getframe(2).f_globals.get("__name__", "")
        if not self.free and not caller.startswith(("icha.", "dataclasses")) and not edges_fit(heights):
            warnings.warn(MISFIT_OF_EDGES, EdgeWarning, stacklevel=3)

    @property
    def grid(self) -> int:
        """Number of nodes along a side."""
        return self.heights.shape[0]

    @property
    def spacing(self) -> float:
        """Distance between neighbouring nodes, metres."""
        return self.period / self.grid

    @property
    def free(self) -> bool:
        """True if the surface is a single square."""
        return self.boundary == FREE

    def require_periodic(self, purpose: str) -> None:
        """Raise ValueError if the surface is a free square; the message names the purpose."""
        if self.free:
            raise ValueError(f"boundary: {FREE!r}; {purpose} needs a surface of boundary {PERIODIC!r}")

    def by_wave_vector(self, function) -> list:
        """Return results of `function(k2, count, power)` for blocks of all wave vectors 2 pi/L (kx, ky) but zero.

        k2 = kx^2 + ky^2; power: |h_q|^2, m^2, both (n, m); count (m,): 2 where the power is that of two opposite wave
        vectors together, else 1. The heights count as one period of a periodic surface, even for a free square.
        """
        n = self.grid
        half = np.empty((n, n // 2 + 1), dtype=complex)

        def along_x(rows):
            half[rows] = scipy.fft.rfft(self.heights[rows], axis=1, norm="forward", workers=1)

        ky2 = scipy.fft.fftfreq(n, 1 / n) ** 2

        def along_y(columns):
            modes = scipy.fft.fft(half[:, columns], axis=0, norm="forward", workers=1)
            power = modes.real**2 + modes.imag**2
            # The half spectrum omits the opposites of all columns but the first (and, on even grids, the last).
            kx = np.arange(columns.start, columns.stop)
            count = np.where((kx > 0) & (2 * kx < n), 2.0, 1.0)
            power *= count
            if columns.start == 0:
                power[0, 0] = 0.0
            return function(ky2[:, None] + kx**2, count, power)

        on_cores(along_x, blocks(n, _LINES))
        return on_cores(along_y, blocks(n // 2 + 1, _LINES))

    @cached_property
    def spectral_moments(self) -> tuple[float, float, float]:
        """Sums of |h_q|^2, q^2 |h_q|^2 and q^4 |h_q|^2 over all wave vectors: m^2, 1, m^-2.

        They are the variance of height, the squared rms slope |grad h| and the squared rms of the Laplacian. A free
        square has no spectrum; its moments are means over the nodes, of derivatives of a quintic spline.
        """
        if self.free:
            return _mean_squares(self.heights, self.spacing)

        sums = self.by_wave_vector(lambda k2, _, power: [np.sum(power), np.sum(power * k2), np.sum(power * k2**2)])
        moments = np.sum(sums, axis=0)
        q2 = (2 * np.pi / self.period) ** 2
        return float(moments[0]), float(moments[1] * q2), float(moments[2] * q2**2)

    @property
    def rms_height(self) -> float:
        """Root mean square height, metres."""
        return self.spectral_moments[0] ** 0.5

    @property
    def rms_slope(self) -> float:
        """Root mean square of |grad h|, by the spectral moments (not by finite differences)."""
        return self.spectral_moments[1] ** 0.5

    @property
    def rms_curvature(self) -> float:
        """Root mean square curvature of a profile, sqrt(3/8 sum q^4 |h_q|^2) for an isotropic surface, 1/m.

        Its inverse is the radius R_c in the Tabor parameter of the Contact Mechanics Challenge (60.1 nm there).
        """
        return (3 / 8 * self.spectral_moments[2]) ** 0.5

    @property
    def full_contact_energy(self) -> float:
        """Elastic energy of full contact per nominal area over E*, U_full/E* = 1/4 sum q |h_q|^2, m.

        In full contact the pressure q E* h_q/2 flattens a wave of amplitude h_q. A free square counts as a quarter of
        the periodic surface that it forms with its mirror images, which has no steps at the edges.
        """
        if not self.free:
            sums = self.by_wave_vector(lambda k2, _, power: float(np.sum(np.sqrt(k2) * power)))
            return math.pi / (2 * self.period) * sum(sums)
        # The cosine series of period 2 L; with orthonormal coefficients the mean square height is their sum of squares
        # over the number of nodes (Parseval).
        power = scipy.fft.dctn(self.heights, norm="ortho", workers=1) ** 2
        k2 = np.arange(self.grid) ** 2.0
        return math.pi / (4 * self.period) * float(np.sum(np.sqrt(k2[:, None] + k2) * power)) / power.size

    @property
    def complete_contact_pressure(self) -> float:
        """Nominal pressure over E* at which contact is complete without adhesion.

        It is the largest tension in full contact at zero load. A free square is part of the periodic surface that it
        forms with its mirror images.
        """
        return -float(full_contact_pressure(self.heights, self.period, free=self.free).min())

    def scaled_to_rms_slope(self, rms_slope: float) -> Surface:
        """Return the same topography with its heights multiplied so that the spectral rms slope is `rms_slope`."""
        rms_slope = SLOPE.validate("rms_slope", rms_slope)
        factor = rms_slope / self.rms_slope
        scaled = replace(self, heights=self.heights * factor)
        # `cached_property` keeps its values in `vars`.
        vars(scaled)["spectral_moments"] = tuple(moment * factor**2 for moment in self.spectral_moments)
        return scaled

    def refined(self, factor: int) -> Surface:
        """Return the trigonometric interpolant on a grid `factor` times as fine; old nodes keep their heights.

        Raises ValueError if the factor is not an integer of at least 1, or the surface is a free square.
        """
        self.require_periodic("a trigonometric interpolant")
        if IntegerRange(1).validate("factor", factor) == 1:
            return self
        # Slow to import, and rarely needed.
        from scipy.signal import resample

        heights = self.heights
        for axis in (0, 1):
            heights = resample(heights, factor * self.grid, axis=axis)
        return Surface(heights, self.period)


def full_contact_pressure(heights: np.ndarray, period: float, *, free: bool = False) -> np.ndarray:
    """Return the pressure over E* of full contact at zero load, (n, n): p(q) = q E* h(q)/2.

    Parameters
    ----------
    heights : (n, n), m.
    period : side of the square, m.
    free : whether the heights continue by their mirror images instead of periodically.
    """
    n = len(heights)
    if free:
        modes, k = scipy.fft.dctn(heights, workers=1), np.arange(n)
        modes *= np.pi / (2 * period) * np.hypot(k[:, None], k)
        return scipy.fft.idctn(modes, workers=1, overwrite_x=True)
    modes, each = scipy.fft.rfft2(heights, workers=1), np.fft.fftfreq(n, 1 / n)
    modes *= np.pi / period * np.hypot(each[:, None], each[: modes.shape[1]])
    return scipy.fft.irfft2(modes, s=heights.shape, workers=1, overwrite_x=True)


def edges_fit(heights: np.ndarray) -> bool:
    """Return whether heights (n, n) are one cell of a periodic surface without a step between cells."""
    n = len(heights)
    compared = np.unique(np.linspace(1, n - 3, min(n, _COMPARED_LINES)).astype(int))
    for lines in (heights, heights.T):
        before, first, second, after = (lines[(np.append(compared, n - 1) + shift) % n] for shift in (-1, 0, 1, 2))
        misfit = np.sqrt(np.mean((1.5 * (second - first) - 0.5 * (after - before)) ** 2, axis=1))
        step = np.sqrt(np.mean((second - first) ** 2, axis=1))
        if step[-1] > _STEP * np.max(step[:-1]) and misfit[-1] > _MISFIT * np.max(misfit[:-1]) + 1e-9 * np.ptp(heights):
            return False
    return True


def _mean_squares(heights, spacing):
    """Compute the mean squares of height, slope and Laplacian over the nodes, with quintic splines along both axes."""
    # Slow to import, and rarely needed.
    from scipy.interpolate import make_interp_spline

    n = len(heights)
    nodes = np.arange(n) * spacing
    laplacian = np.empty_like(heights)

    def along_x(rows):
        spline = make_interp_spline(nodes, heights[rows], k=5, axis=1)
        laplacian[rows] = spline(nodes, 2)
        return np.sum(spline(nodes, 1) ** 2)

    def along_y(columns):
        spline = make_interp_spline(nodes, heights[:, columns], k=5, axis=0)
        laplacian[:, columns] += spline(nodes, 2)
        return np.sum(spline(nodes, 1) ** 2)

    slope2 = sum(sum(on_cores(along, blocks(n, _LINES))) for along in (along_x, along_y))
    return float(np.mean(heights**2)), float(slope2 / n**2), float(np.mean(laplacian**2))
