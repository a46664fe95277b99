"""A periodic height map: the rigid rough surface, looking towards the half-space.

Heights are in metres and positive towards the elastic body. The first axis of an array of heights is y,
the second x; node (iy, ix) lies at (x, y) = (ix, iy) * spacing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.fft

from icha.validation import flaw_of_heights, positive


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
            heights = np.array(self.heights)
            if heights.dtype.kind not in "fiu":
                raise TypeError(f"they are of type {heights.dtype.name}")
            if np.ma.is_masked(self.heights):
                raise ValueError("some are masked; fill or crop them first")
            heights = heights.astype(np.float64)
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
        power = np.abs(scipy.fft.rfft2(self.heights, norm="forward", workers=1)) ** 2
        # The half spectrum holds every column but the first (and, on even grids, the last) only once.
        power[:, 1 : (n + 1) // 2] *= 2
        q = 2 * np.pi / self.period
        q2 = (q * scipy.fft.fftfreq(n, 1 / n))[:, None] ** 2 + (q * scipy.fft.rfftfreq(n, 1 / n))[None, :] ** 2
        power[0, 0] = 0.0
        zeroth = float(np.sum(power))
        power *= q2
        second = float(np.sum(power))
        power *= q2
        return zeroth, second, float(np.sum(power))

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
        return Surface(self.heights * (rms_slope / self.rms_slope), self.period)
