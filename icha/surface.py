"""A periodic height map: the rigid rough surface, looking towards the half-space.

Heights are in metres and positive towards the elastic body. The first axis of an array of heights is y,
the second x; node (iy, ix) lies at (x, y) = (ix, iy) * spacing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.fft

from icha.cores import blocks, on_cores
from icha.validation import flaw_of_heights, integer, positive

# Rows or columns that are transformed at a time.
_LINES = 64


@dataclass(frozen=True, eq=False)
class Surface:
    """A rough surface, periodic in both directions and of zero mean height.

    Parameters
    ----------
    heights : (n, n) array, metres. Its mean is removed; the array is copied and made read-only.
    period : side of the periodic cell in metres.

    Raises
    ------
    ValueError
        If the heights are not a square array of at least 8 x 8 finite numbers, or all the same, or the period
        is not a positive number.
    """

    heights: np.ndarray
    period: float

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
        if flaw := flaw_of_heights(heights):
            raise ValueError(f"heights: {flaw}")
        heights -= heights.mean()
        heights.flags.writeable = False
        object.__setattr__(self, "heights", heights)
        object.__setattr__(self, "period", positive("period", self.period, "metres"))

    @property
    def grid(self) -> int:
        """Number of nodes along a side."""
        return self.heights.shape[0]

    @property
    def spacing(self) -> float:
        """Distance between neighbouring nodes, metres."""
        return self.period / self.grid

    @cached_property
    def spectral_moments(self) -> tuple[float, float, float]:
        """Sums of |h_q|^2, q^2 |h_q|^2 and q^4 |h_q|^2 over all wave vectors: m^2, 1, m^-2.

        They are the variance of height, the squared rms slope |grad h| and the squared rms of the Laplacian.
        """
        n = self.grid
        half = np.empty((n, n // 2 + 1), dtype=complex)

        def along_x(rows):
            half[rows] = scipy.fft.rfft(self.heights[rows], axis=1, norm="forward", workers=1)

        k2 = scipy.fft.fftfreq(n, 1 / n) ** 2

        def along_y(columns):
            modes = scipy.fft.fft(half[:, columns], axis=0, norm="forward", workers=1)
            power = modes.real**2 + modes.imag**2
            # The half spectrum holds every column but the first (and, on even grids, the last) only once.
            kx = np.arange(columns.start, columns.stop)
            power[:, (kx > 0) & (2 * kx < n)] *= 2
            if columns.start == 0:
                power[0, 0] = 0.0
            weight = k2[:, None] + kx**2
            moments = []
            for _ in range(3):
                moments.append(np.sum(power))
                power *= weight
            return moments

        on_cores(along_x, blocks(n, _LINES))
        moments = np.sum(on_cores(along_y, blocks(n // 2 + 1, _LINES)), axis=0)
        q2 = (2 * np.pi / self.period) ** 2
        return float(moments[0]), float(moments[1] * q2), float(moments[2] * q2**2)

    @property
    def rms_height(self) -> float:
        """Root mean square height, metres."""
        return self.spectral_moments[0] ** 0.5

    @property
    def rms_slope(self) -> float:
        """Root mean square of |grad h|, from the spectrum (not by finite differences)."""
        return self.spectral_moments[1] ** 0.5

    @property
    def rms_curvature(self) -> float:
        """Root mean square curvature of a profile, sqrt(3/8 sum q^4 |h_q|^2) for an isotropic surface, 1/m.

        Its inverse is the radius R_c in the Tabor parameter of the Contact Mechanics Challenge (60.1 nm there).
        """
        return (3 / 8 * self.spectral_moments[2]) ** 0.5

    def scaled_to_rms_slope(self, rms_slope: float) -> Surface:
        """The same topography with its heights multiplied so that the spectral rms slope is `rms_slope`."""
        rms_slope = positive("rms_slope", rms_slope, "1")
        factor = rms_slope / self.rms_slope
        scaled = Surface(self.heights * factor, self.period)
        # Known already; `cached_property` keeps its values there.
        vars(scaled)["spectral_moments"] = tuple(moment * factor**2 for moment in self.spectral_moments)
        return scaled

    def refined(self, factor: int) -> Surface:
        """The same topography on a grid `factor` times as fine, by its trigonometric interpolant; old nodes keep their
        heights."""
        if integer("factor", factor, 1) == 1:
            return self
        # Slow to import, and seldom needed.
        from scipy.signal import resample

        heights = self.heights
        for axis in (0, 1):
            heights = resample(heights, factor * self.grid, axis=axis)
        return Surface(heights, self.period)
