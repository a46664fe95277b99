r"""Theories of separate summits: spheres at given heights, each in contact with a plane as if it were alone.

Pressures are reduced, p* = p/(E* h'_rms). Separations are distances between the plane and the mean plane of the rough
surface, divided by h_rms. Only the summits deform in these theories, so these distances are mean separations. The
constants in this file name the sources. Two further sources: P. R. Nayak, J. Lubr. Technol. 93 (1971) 398,
doi:10.1115/1.3451608, for the summits of a Gaussian surface; J. A. Greenwood, Tribol. Lett. 65 (2017) 159,
doi:10.1007/s11249-017-0938-1, for the theory of Fuller & Tabor on loading.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import gamma, pbdv

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.surfaces.moments import SpectralMoments, summit_density

BUSH_GIBSON_THOMAS = "A. W. Bush, R. D. Gibson and T. R. Thomas, Wear 35 (1975) 87, doi:10.1016/0043-1648(75)90145-3"
GREENWOOD_WILLIAMSON = (
    "J. A. Greenwood and J. B. P. Williamson, Proc. R. Soc. Lond. A 295 (1966) 300, doi:10.1098/rspa.1966.0242; "
    "J. I. McCool, Wear 107 (1986) 37, doi:10.1016/0043-1648(86)90045-1"
)
FULLER_TABOR = (
    "K. N. G. Fuller and D. Tabor, Proc. R. Soc. Lond. A 345 (1975) 327, doi:10.1098/rspa.1975.0138, on loading: "
    "summits are in contact from approach 0 on"
)
# Summits count as separate if the contact area fraction is at most this value.
SEPARATE_SUMMITS_AREA_LIMIT = 0.1

# McCool's 0.8968: the variance of the summit heights is (1 - 0.8968/alpha) times the variance of all heights.
_SUMMIT_VARIANCE = 1 - 3 * math.sqrt(3) + 16 / math.pi

# Largest distances of summits in the sum, and of the plane, from the mean summit height, in standard deviations.
_FARTHEST_SUMMIT = 12.0
_FARTHEST_PLANE = 10.0
# Gauss-Legendre quadrature of the sum, on [-1, 1].
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(400)


def bush_gibson_thomas_area(reduced_pressure):
    """Return A/A0 = sqrt(2 pi) p* at an array of reduced pressures: Bush, Gibson & Thomas for small areas."""
    return np.sqrt(2 * np.pi) * np.asarray(reduced_pressure, float)


class GaussianSummits(NamedTuple):
    """Summits that are spheres of the same radius with Gaussian heights.

    Attributes
    ----------
    density : number of summits per area, m^-2.
    mean_height : mean height above the mean plane of the surface, m.
    deviation : standard deviation of the heights, m.
    radius_of_curvature : radius of all spheres, m.
    """

    density: float
    mean_height: float
    deviation: float
    radius_of_curvature: float


def gaussian_summits(moments: SpectralMoments) -> GaussianSummits:
    """Return the mean properties of the summits of an isotropic Gaussian surface by Nayak, as used by McCool (1986).

    The density is m4/(6 pi sqrt(3) m2), the mean height 4 sqrt(m0/(pi alpha)), the variance of the heights
    (1 - 0.8968/alpha) m0, and the radius of the mean curvature 3 sqrt(pi)/(8 sqrt(m4)). Raise `ValueError` if Nayak's
    parameter alpha is less than 3/2, the smallest value of an isotropic surface.
    """
    alpha = moments.nayak_parameter
    if alpha < 1.5 * (1 - 1e-9):
        raise ValueError(
            f"spectral moments: Nayak's parameter is {alpha:.4g}; expected 1.5 or more for an isotropic surface"
        )
    return GaussianSummits(
        density=summit_density(moments.m2, moments.m4),
        mean_height=4 * math.sqrt(moments.m0 / (math.pi * alpha)),
        deviation=math.sqrt((1 - _SUMMIT_VARIANCE / alpha) * moments.m0),
        radius_of_curvature=3 * math.sqrt(math.pi) / (8 * math.sqrt(moments.m4)),
    )


def greenwood_williamson_area(reduced_separation, moments: SpectralMoments):
    """Return A/A0 = pi eta R sigma F_1(d/sigma) at an array of reduced separations (Greenwood & Williamson).

    eta is the density of the summits, R the radius of curvature of the summits, sigma the standard deviation of the
    summit heights, and d the height of the plane above the mean summit height.
    """
    summits = gaussian_summits(moments)
    scale = np.pi * summits.density * summits.radius_of_curvature * summits.deviation
    return scale * _mean_power_above(_height_above_summits(reduced_separation, moments, summits), 1)


def greenwood_williamson_pressure(reduced_separation, moments: SpectralMoments):
    """Return p* = 4/3 eta R^(1/2) sigma^(3/2) F_3/2(d/sigma)/h'_rms at an array of reduced separations."""
    summits = gaussian_summits(moments)
    scale = 4 / 3 * summits.density * math.sqrt(summits.radius_of_curvature * summits.deviation**3) / moments.rms_slope
    return scale * _mean_power_above(_height_above_summits(reduced_separation, moments, summits), 1.5)


def fuller_tabor_area(reduced_separation, moments: SpectralMoments, material: Material):
    """Return A/A0 on loading of Gaussian summits that follow the JKR law (Fuller & Tabor 1975).

    This theory has no attraction at a distance. A summit makes contact at approach 0, where the contact jumps to the
    radius (2 pi dgamma R^2/E*)^(1/3) and is in tension. `moments` are the spectral moments of the surface at its actual
    rms slope. The range of attraction of the material is not used.
    """
    law = JKR(material)
    return _sum_over_summits(lambda a, R: np.pi * a**2, law, reduced_separation, moments)


def fuller_tabor_pressure(reduced_separation, moments: SpectralMoments, material: Material):
    """Return p* during loading if the summit heights are Gaussian; negative in tension. See `fuller_tabor_area`."""
    law = JKR(material)
    pressure = _sum_over_summits(law.force, law, reduced_separation, moments)
    return pressure / (material.contact_modulus * moments.rms_slope)


def separation_at(quantity: Callable, value, moments: SpectralMoments, *arguments):
    """Return the reduced separations at which quantity(separation, moments, *arguments) has the values `value`.

    The quantity must be positive and decrease with the separation. Raise `ValueError` if the plane would be farther
    than 10 standard deviations from the mean summit height.
    """
    summits = gaussian_summits(moments)
    middle, reach = summits.mean_height / moments.rms_height, _FARTHEST_PLANE * summits.deviation / moments.rms_height
    value = np.asarray(value, float)

    def root(wanted):
        ends = middle - reach, middle + reach
        return brentq(lambda u: math.log(quantity(u, moments, *arguments) / wanted), *ends, xtol=1e-13)

    return np.array([root(wanted) for wanted in value.ravel()]).reshape(value.shape)


def _height_above_summits(reduced_separation, moments, summits):
    """Return the height of the plane above the mean summit height, in standard deviations of the summit heights."""
    return (np.asarray(reduced_separation, float) * moments.rms_height - summits.mean_height) / summits.deviation


def _mean_power_above(t, n):
    """Return F_n(t): the integral of (s - t)^n over s > t, with the standard normal distribution of s."""
    return gamma(n + 1) / math.sqrt(2 * np.pi) * np.exp(-(t**2) / 4) * pbdv(-n - 1, t)[0]


def _sum_over_summits(of_summit, law, reduced_separation, moments):
    """Return the sum over the summits in contact, per area, of a function of contact radius and radius of curvature.

    The variable of integration is the contact radius. Each contact radius corresponds to one approach, and so to one
    height of the summit.
    """
    summits = gaussian_summits(moments)
    plane = np.asarray(reduced_separation, float)[..., None] * moments.rms_height
    above, reach = summits.mean_height - plane, _FARTHEST_SUMMIT * summits.deviation
    limits = (np.maximum(0.0, above - reach), np.maximum(0.0, above + reach))
    start, end = (law.contact_radius(approach, summits.radius_of_curvature) for approach in limits)
    a = start + (end - start) * (_NODES + 1) / 2
    heights = (plane + law.approach(a, summits.radius_of_curvature) - summits.mean_height) / summits.deviation
    density = np.exp(-(heights**2) / 2) / (math.sqrt(2 * np.pi) * summits.deviation)
    per_radius = density * law.approach_derivative(a, summits.radius_of_curvature)
    values = of_summit(a, summits.radius_of_curvature) * per_radius
    return summits.density * np.sum(values * (end - start) / 2 * _WEIGHTS, axis=-1)
