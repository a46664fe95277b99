"""Spectral moments of rough surfaces, for statistical theories, and radial power spectra.

Moments are averages over profiles in all directions, as P. R. Nayak defined them for isotropic surfaces, J. Lubr.
Technol. 93 (1971) 398-407, doi:10.1115/1.3451608.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    # `icha.surfaces.surface` imports SciPy, which takes time. Commands that need only moments should not wait.
    from icha.surfaces.surface import Surface


# The smaller of two mean square slopes is a rounding error if it is at most this fraction of the larger one.
_NO_SLOPE = 1e-12
# Waves up to this wave number, in units of 2 pi/L, are summed. An integral replaces the sum over shorter waves.
_DENSE = 64
# Number of nodes of the quadrature on each side of the roll-off; for each power law, it is exact to rounding.
_QUADRATURE = 64


def summit_density(m2: float, m4: float) -> float:
    """Compute the number of summits per area (m^-2) of an isotropic Gaussian surface, m4/(6 sqrt(3) pi m2)."""
    return m4 / (6 * math.sqrt(3) * math.pi * m2)


def self_affine_integral(order: int, start: float, end: float, roll: float, hurst: float) -> float:
    """Integrate k^order C(k)/C0 from `start` to `end`; C = C0 below `roll`, and C ~ k^(-2 - 2 hurst) above `roll`."""

    def up_to(end):
        flat = min(end, roll) ** (order + 1) / (order + 1)
        if end <= roll:
            return flat
        power = order - 1 - 2 * hurst
        falling = math.log(end / roll) if power == 0 else math.expm1(power * math.log(end / roll)) / power
        return flat + roll ** (order + 1) * falling

    return up_to(end) - up_to(start)


class FullContact(NamedTuple):
    """Full contact of a surface with an elastic body at zero load; both values are divided by E*.

    Attributes
    ----------
    energy : elastic energy per nominal area, m.
    complete_pressure : largest tension; this nominal pressure makes contact without adhesion complete.
    """

    energy: float
    complete_pressure: float

    def scaled(self, factor: float) -> FullContact:
        """Return the values for heights that are multiplied by a factor."""
        return FullContact(self.energy * factor**2, self.complete_pressure * factor)


def largest_gaussian_value(waves: float) -> float:
    """Estimate the largest value of a Gaussian field of standard deviation 1 in a square.

    About the values u with N u exp(-u^2/2) = 1, N = sqrt(pi/2) waves^2, the largest value has Gumbel's distribution.
    The mean of this distribution is u + 0.577/u: R. J. Adler, The Geometry of Random Fields, 1981, chapter 6.

    waves : root mean square of the wave number |q|, divided by 2 pi/L; L is the side.
    """
    # For smaller numbers, the equation has no solution.
    number, u = max(math.sqrt(math.pi / 2) * waves**2, math.e), 2.0
    for _ in range(40):
        u = math.sqrt(2 * math.log(number * u))
    return u + float(np.euler_gamma) / u


@lru_cache
def self_affine_full_contact(
    period: float,
    rolloff_wavelength: float,
    short_wavelength: float,
    hurst: float,
    softness: Callable[[np.ndarray], np.ndarray] | None = None,
) -> FullContact:
    """Compute the full contact of a periodic self-affine surface with rms slope 1; the pressure is an estimate.

    Lengths are in m, and `softness` is that of `icha.surfaces.surface.full_contact_pressure`. The energy equals that of
    surfaces with the same `SelfAffineSpectrum`, but needs no heights: the function sums over the long waves and
    integrates the spectrum of the short waves. The pressure is the largest value that is expected of a Gaussian field.
    For five spectra it was within 6 % of the mean of six surfaces on half-spaces, and within 16 % on layers whose
    thickness was 1/4 to 1/200 of the period.
    """
    roll, last = period / rolloff_wavelength, period / short_wavelength
    # The wave at the cut-off does not belong to the spectrum, even if `last` is rounded up.
    dense = min(_DENSE, last * (1 - 1e-9))
    k = np.arange(-math.ceil(dense), math.ceil(dense) + 1)
    k = np.hypot(k[:, None], k).ravel()
    k = k[(k > 0) & (k < dense)]
    weight = np.ones(len(k))
    # Quadrature over log k on both sides of the roll-off.
    node, node_weight = np.polynomial.legendre.leggauss(_QUADRATURE)
    middle = min(max(roll, dense), last)
    for start, end in ((dense, middle), (middle, last)):
        half = math.log(end / start) / 2
        rings = start * np.exp(half * (node + 1))
        k, weight = np.append(k, rings), np.append(weight, 2 * math.pi * rings**2 * half * node_weight)
    weight *= np.maximum(k / roll, 1.0) ** (-2 * (1 + hurst))
    stiffness = k / softness(2 * math.pi / period * k) if softness else k
    slope, pressure, gradient = (float(np.sum(weight * each**2)) for each in (k, stiffness, k * stiffness))
    largest = largest_gaussian_value(math.sqrt(gradient / pressure)) * math.sqrt(pressure / slope) / 2
    return FullContact(period * float(np.sum(weight * stiffness)) / (8 * math.pi * slope), largest)


class SpectralMoments(NamedTuple):
    """Spectral moments of profiles: variance m0 of height in m^2, m2 of slope, and m4 of curvature in m^-2."""

    m0: float
    m2: float
    m4: float

    @property
    def nayak_parameter(self) -> float:
        """Nayak's parameter m0 m4/m2^2, the width of the spectrum; isotropic surfaces have at least 3/2."""
        return self.m0 * self.m4 / (self.m2**2 or 1.0)

    @property
    def rms_height(self) -> float:
        """Root mean square height, m."""
        return self.m0**0.5

    @property
    def rms_slope(self) -> float:
        """Root mean square of |grad h|, sqrt(2) times the rms slope of profiles."""
        return (2 * self.m2) ** 0.5

    @property
    def rms_laplacian(self) -> float:
        """Root mean square of the Laplacian of h, 1/m, sqrt(8/3) times the rms curvature of profiles."""
        return (8 / 3 * self.m4) ** 0.5

    def scaled_to_rms_slope(self, rms_slope: float) -> SpectralMoments:
        """Return the moments for heights that are scaled so that the rms slope is `rms_slope`."""
        factor = (rms_slope / self.rms_slope) ** 2
        return SpectralMoments(*(moment * factor for moment in self))


@lru_cache
def self_affine_moments(
    period: float, rolloff_wavelength: float, short_wavelength: float, hurst: float
) -> SpectralMoments:
    """Return the spectral moments of a self-affine surface with roll-off, up to a common factor; lengths in m.

    The moments are integrals over the plane of wave vectors: m0 = int C, m2 = 1/2 int q^2 C, m4 = 3/8 int q^4 C.
    """
    q_l, q_0, q_1 = (2 * math.pi / length for length in (period, rolloff_wavelength, short_wavelength))
    m0, m2, m4 = (self_affine_integral(order, q_l, q_1, q_0, hurst) for order in (1, 3, 5))
    return SpectralMoments(m0, m2 / 2, 3 / 8 * m4)


def spectral_moments(surface: Surface) -> SpectralMoments:
    """Compute the spectral moments of the profiles of a surface, averaged over all directions."""
    height, slope, laplacian = surface.spectral_moments
    return SpectralMoments(height, slope / 2, 3 / 8 * laplacian)


def height_statistics(surface: Surface) -> tuple[float, float]:
    """Compute skewness and kurtosis of the heights; a Gaussian surface has 0 and 3."""
    z = surface.heights
    variance = np.mean(z**2) or 1.0
    return float(np.mean(z**3) / variance**1.5), float(np.mean(z**4) / variance**2)


def slope_anisotropy(surface: Surface) -> float:
    """Compute the ratio of the largest to the smallest rms slope of profiles, among all directions.

    The ratio is 1 for isotropic surfaces and infinite for straight grooves. Both rms slopes come from the principal
    values of the slope tensor. This tensor is a mean over the cells between four nodes, with one gradient per cell.
    """
    z = surface.heights if surface.free else np.pad(surface.heights, ((0, 1), (0, 1)), mode="wrap")
    # Slopes between opposite corners are along axes at 45 degrees; the principal values are the same.
    one, other = z[1:, 1:] - z[:-1, :-1], z[1:, :-1] - z[:-1, 1:]
    tensor = [[np.mean(one**2), np.mean(one * other)], [np.mean(one * other), np.mean(other**2)]]
    least, most = np.linalg.eigvalsh(tensor)
    if not most:
        return 1.0
    return math.sqrt(most / least) if least > _NO_SLOPE * most else math.inf


def radial_power_spectrum(surface: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the radial power spectrum: the mean power C of the wave vectors in each ring around the origin.

    The integral of C over the plane of wave vectors is the mean square height. The first ten rings are 2 pi/L wide; the
    width of each later ring is a tenth of its wave number. The last ring ends at the largest circle in the grid of wave
    vectors. The heights of a free square are first multiplied by Hann's window, because a step between opposite edges
    would add waves. C is then divided by the mean square of the window. Return the mean wave numbers q of the rings
    (rad/m), C(q) (m^4), and wave numbers at the edges of the rings (rad/m).
    """
    last, edges = (surface.grid - 1) // 2, [0.5]
    while edges[-1] < last:
        edges.append(min(max(edges[-1] + 1, math.floor(1.1 * edges[-1]) + 0.5), last + 0.5))
    windowed, scale = surface, 1.0
    if surface.free:
        hann = np.sin(np.pi * (np.arange(surface.grid) + 0.5) / surface.grid) ** 2
        windowed = replace(surface, heights=surface.heights * (hann[:, None] * hann))
        scale = 1 / np.mean(hann**2) ** 2

    def rings(k2, count, power):
        k = np.sqrt(k2)
        ring = np.searchsorted(edges, k.ravel(), side="right")
        count = np.broadcast_to(count, k.shape)
        sums = (count, count * k, power)
        return [np.bincount(ring, weights=each.ravel(), minlength=len(edges) + 1) for each in sums]

    count, wave_number, power = np.sum(windowed.by_wave_vector(rings), axis=0)[:, 1:-1]
    unit = 2 * np.pi / surface.period
    return unit * wave_number / count, scale * power / count / unit**2, unit * np.array(edges)
