"""The elastic half-space on a periodic grid: displacement under pressures, and its approximate inverse.

In units of the grid: lengths in cells, pressures in E*. A pressure of wave vector q displaces by 2/q (K. L. Johnson,
Contact Mechanics, 1985, sec. 13.2); its mean displaces nothing, for separations are those of the mean planes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft

# The inverse of the kernel for the mean, in parts of that of the longest wave.
_MEAN = 0.3


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """Fourier kernel of a periodic half-space on an n x n grid, for fields in double or single precision.

    Arrays are (n, n//2 + 1), in a dict by precision. compliance: of the half-space. stiffness: its approximate inverse.
    """

    grid: int
    compliance: dict[np.dtype, np.ndarray]
    stiffness: dict[np.dtype, np.ndarray]

    @classmethod
    def of(cls, grid: int) -> HalfSpace:
        """The half-space under a grid of so many cells a side."""
        qx = 2 * np.pi * scipy.fft.rfftfreq(grid)
        qy = 2 * np.pi * scipy.fft.fftfreq(grid)
        q = np.hypot(qy[:, None], qx)
        stiffness = q / 2
        stiffness[0, 0] = _MEAN * np.pi / grid
        with np.errstate(divide="ignore"):
            compliance = 2 / q
        compliance[0, 0] = 0.0
        return cls(grid, _by_precision(compliance), _by_precision(stiffness))

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """Displacement away from the load, in cells, of zero mean, under pressures (n, n) in E*."""
        return filtered(pressure, self.compliance[pressure.dtype])

    def pressure(self, displacement: np.ndarray) -> np.ndarray:
        """The pressure, (n, n) in E*, that makes a displacement; its mean is made up, for conditioning alone."""
        return filtered(displacement, self.stiffness[displacement.dtype])


def filtered(field: np.ndarray, factor: np.ndarray) -> np.ndarray:
    """A periodic field, (n, n), with its Fourier modes times factors (n, n//2 + 1), in the precision of both."""
    modes = scipy.fft.rfft2(field, workers=1)
    modes *= factor
    return scipy.fft.irfft2(modes, s=field.shape, overwrite_x=True, workers=1)


def _by_precision(factor):
    return {np.dtype(kind): factor.astype(kind) for kind in (np.float64, np.float32)}
