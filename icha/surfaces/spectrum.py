"""Spectra of isotropic surfaces, and random surfaces with such a spectrum.

Self-affine spectra with roll-off follow Violano & Afferrante, eq. PSD:

C(q) = C0 for q_L <= q < q_0, C0 (q/q_0)^(-2(1+H)) for q_0 <= q < q_1, and 0 elsewhere; q_L = 2 pi / L. By convention,
the integral of C over the plane of wave vectors is h_rms^2. So a mode of the cell has |h_q|^2 = C(q) (2 pi/L)^2.
"""

import math
import warnings
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.fft

from icha.support.parallel import blocks, on_cores
from icha.support.rules import GRID, HURST, LENGTH, SEED, SLOPE
from icha.support.usual import IchaWarning
from icha.surfaces.resolution import LEAST_CELLS, NYQUIST_CELLS, Resolution
from icha.surfaces.surface import Surface

# Relative rounding error of wave numbers. With this tolerance, a band that ends at L/lambda_s = 64 excludes |k| = 64.
_ROUNDING = 1e-9

# Rows or columns to transform at a time.
_LINES = 64


class IsotropicSpectrum:
    """Power spectral density of an isotropic surface in a periodic cell; base class of all spectra.

    Attributes
    ----------
    period : side of the periodic cell, m.
    short_wavelength : shortest wavelength, m.
    plateau : factor of `_shape`, m^4.
    """

    period: float
    short_wavelength: float
    plateau: float

    def _shape(self, k):
        """Compute the spectrum divided by `plateau`, for wave numbers in units of 2 pi / L."""
        raise NotImplementedError

    def psd(self, q: np.ndarray | float) -> np.ndarray:
        """Compute C(q) in m^4 for wave numbers `q` (any shape) in rad/m."""
        return self.plateau * self._shape(np.asarray(q, dtype=float) * self.period / (2 * np.pi))

    @cached_property
    def _band(self):
        """Wave vectors (kx, ky) and |k| of half the band, in units of 2 pi / L; and mask of the band.

        Wave vectors are sorted by max(|kx|, |ky|). Therefore each mode gets the same random number on every grid and
        with every short cut-off: with the same seed, a finer surface has the same long waves, and more short ones.
        """
        m = math.ceil(self.period / self.short_wavelength)
        kx, ky = np.meshgrid(np.arange(m + 1), np.arange(-m, m + 1))
        kx, ky = kx.ravel(), ky.ravel()
        half = (kx > 0) | (ky > 0)
        kx, ky = kx[half], ky[half]
        order = np.lexsort((ky, kx, np.maximum(kx, np.abs(ky))))
        kx, ky = kx[order], ky[order]
        k = np.hypot(kx, ky)
        inside = self._shape(k) > 0
        return kx[inside], ky[inside], k[inside], inside

    @property
    def rms_height(self) -> float:
        """Root mean square height of a periodic cell with this spectrum, m."""
        _, _, k, _ = self._band
        q = 2 * np.pi / self.period
        return math.sqrt(2 * self.plateau * float(np.sum(self._shape(k))) * q**2)

    def realise(self, grid: int, seed: int, amplitudes: str = "fixed") -> Surface:
        """Generate a random periodic surface of zero mean height by spectral synthesis with random phases.

        Parameters
        ----------
        grid : nodes along a side; fewer than 2 per shortest wavelength raise an error, fewer than 4 cause a warning.
        seed : seed of the random phases, a non-negative integer.
        amplitudes : "fixed": each seed has the rms height and slope of the spectrum; "gaussian": random amplitudes.

        Raises
        ------
        ValueError
            If a value is out of range; the message names the argument.
        """
        grid = GRID.validate("grid", grid)
        seed = SEED.validate("seed", seed)
        if amplitudes not in ("fixed", "gaussian"):
            raise ValueError(f"amplitudes: {amplitudes!r} must be one of fixed, gaussian")
        resolution = Resolution(grid * self.short_wavelength / self.period)
        if not resolution.representable:
            least = resolution.grid_of(grid, NYQUIST_CELLS)
            raise ValueError(f"grid: {grid} nodes give {resolution}; expected at least {least} nodes")
        if not resolution.reaches(LEAST_CELLS):
            text = f"grid: {grid} nodes give {resolution}; expected {resolution.grids(grid)}"
            warnings.warn(text, IchaWarning, stacklevel=2)
        kx, ky, k, inside = self._band
        random = np.random.Generator(np.random.PCG64(seed)).random((inside.size, 2))[inside]
        size = np.sqrt(self.plateau * self._shape(k)) * (2 * np.pi / self.period)
        if amplitudes == "gaussian":
            size = size * np.sqrt(-np.log1p(-random[:, 1]))
        modes = size * np.exp(2j * np.pi * random[:, 0])
        # Columns of waves shorter than the cut-off are zero and need no transform along y.
        half = np.zeros((grid, kx.max() + 1), dtype=complex)
        half[ky % grid, kx] = modes
        on_axis = kx == 0
        half[-ky[on_axis] % grid, 0] = np.conj(modes[on_axis])
        heights = np.empty((grid, grid))

        def along_y(columns):
            half[:, columns] = scipy.fft.ifft(half[:, columns], axis=0, norm="forward", workers=1)

        def along_x(rows):
            heights[rows] = scipy.fft.irfft(half[rows], n=grid, axis=1, norm="forward", workers=1)

        on_cores(along_y, blocks(half.shape[1], _LINES))
        on_cores(along_x, blocks(grid, _LINES))
        return Surface(heights, self.period, short_wavelength=self.short_wavelength)


@dataclass(frozen=True)
class SelfAffineSpectrum(IsotropicSpectrum):
    """Power spectral density of a self-affine surface with a given rms slope.

    Parameters
    ----------
    period : L, side of the periodic cell, m; all lengths of a spectrum must be in [1e-24, 1e9] m.
    rolloff_wavelength : 2 pi / q_0, m; at most the period.
    short_wavelength : 2 pi / q_1, the short cut-off, m; less than the roll-off wavelength.
    hurst : H, in (0, 1].
    rms_slope : h'_rms, in [1e-9, 1e6]; h'_rms^2 is exactly the sum of q^2 |h_q|^2 over the wave vectors of the cell.

    Raises
    ------
    ValueError
        If a value is out of range; the message names the parameter.
    """

    period: float
    rolloff_wavelength: float
    short_wavelength: float
    hurst: float
    rms_slope: float = 1.0

    def __post_init__(self):
        """Check the values."""
        for name in ("period", "rolloff_wavelength", "short_wavelength"):
            object.__setattr__(self, name, LENGTH.validate(name, getattr(self, name)))
        object.__setattr__(self, "rms_slope", SLOPE.validate("rms_slope", self.rms_slope))
        object.__setattr__(self, "hurst", HURST.validate("hurst", self.hurst))
        if self.rolloff_wavelength > self.period * (1 + _ROUNDING):
            raise ValueError(
                f"rolloff_wavelength: {self.rolloff_wavelength!r} m must not exceed the period {self.period!r} m"
            )
        if self.short_wavelength >= self.rolloff_wavelength:
            raise ValueError(
                f"short_wavelength: {self.short_wavelength!r} m must be less than the roll-off wavelength "
                f"{self.rolloff_wavelength!r} m"
            )
        if not len(self._band[0]):
            raise ValueError(
                f"short_wavelength: no wave longer than {self.short_wavelength!r} m fits the period {self.period!r} m"
            )

    def _shape(self, k):
        """Compute C/C0 for wave numbers in units of 2 pi / L."""
        k0 = self.period / self.rolloff_wavelength
        k1 = self.period / self.short_wavelength
        falling = np.maximum(k / k0, 1.0) ** (-2 * (1 + self.hurst))
        return np.where((k >= 1 - _ROUNDING) & (k < k1 * (1 - _ROUNDING)), falling, 0.0)

    @cached_property
    def plateau(self) -> float:  # type: ignore[override]
        """Plateau C0 of the spectrum in m^4, for which the modes of the cell have exactly the given rms slope."""
        _, _, k, _ = self._band
        q = 2 * np.pi / self.period
        slope2 = 2 * float(np.sum(self._shape(k) * k**2)) * q**4
        return self.rms_slope**2 / slope2
