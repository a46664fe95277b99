"""Persson's theory of the adhesionless contact of a nominally flat rough surface.

Pressures are reduced, p* = p/(E* h'_rms). The constants in this file name the sources. The form of Persson's theory
with the rms slope is in M. H. Muser et al., Tribol. Lett. 65 (2017) 118, doi:10.1007/s11249-017-0900-2. The equation
and the gamma of Xu et al. are from the programs in the public data of Xu et al.,
https://github.com/xylcsi/PerssonModelFudgeFactor. The proportionality of stiffness to pressure is in B. N. J.
Persson, Phys. Rev. Lett. 99 (2007) 125502, doi:10.1103/PhysRevLett.99.125502.
"""

import numpy as np
from scipy.integrate import simpson
from scipy.special import erf

PERSSON = "B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840, doi:10.1063/1.1388626"
XU = "Y. Xu, L. Zhu, F. Xiao and Y. Zhou, Tribol. Lett. 72 (2024), doi:10.1007/s11249-024-01838-4, gamma = 0.45"
YANG_PERSSON = "C. Yang and B. N. J. Persson, J. Phys.: Condens. Matter 20 (2008) 215214, gamma = 0.45"
# The gamma of Yang & Persson is the elastic energy of a small contact divided by the energy of full contact on the same
# area. For the gamma of Xu et al., the variance of the pressure replaces the energy.
YANG_PERSSON_GAMMA, XU_GAMMA = 0.45, 0.45
# Number of iterations for the area of Xu et al. Each iteration reduces the error of the area to less than a quarter.
_AREA_ITERATIONS = 40
# Number of wave numbers of the quadrature on either side of the roll-off; odd for Simpson's rule.
_POINTS = 401


def persson_area(reduced_pressure):
    """Return the contact area fraction erf(sqrt(2) p*) at an array of reduced pressures p* (Persson 2001)."""
    return erf(np.sqrt(2) * np.asarray(reduced_pressure, float))


def corrected_persson_area(reduced_pressure):
    r"""Return the contact area fraction at an array of reduced pressures by Persson's theory, corrected by Xu et al.

    Partial contact has a smaller variance V of the pressure than full contact: V = (gamma + (1 - gamma) A/A0) V_full
    with V_full = (E* h'_rms)^2/4. The equation A/A0 = erf(p/sqrt(2 V)) then determines A/A0.
    """
    pressure = np.sqrt(2) * np.asarray(reduced_pressure, float)
    area = np.ones_like(pressure)
    for _ in range(_AREA_ITERATIONS):
        area = erf(pressure / np.sqrt(XU_GAMMA + (1 - XU_GAMMA) * area))
    return area


def persson_pressure_density(pressure, reduced_pressure):
    """Return the probability density P(p) of the pressure over the nominal area, by Persson (2001).

    Pressures are in units of E* h'_rms. P(p) is a Gaussian of standard deviation 1/2 around p*, minus the same Gaussian
    around -p*. The integral of P(p) over p > 0 is `persson_area`.
    """
    pressure = np.asarray(pressure, float)
    gauss = np.exp(-2 * (pressure - reduced_pressure) ** 2) - np.exp(-2 * (pressure + reduced_pressure) ** 2)
    return np.where(pressure > 0, np.sqrt(2 / np.pi) * gauss, 0.0)


def persson_mean_separation(reduced_pressure, spectrum):
    r"""Return the mean separation divided by h_rms at an array of reduced pressures, from the spectrum of the surface.

    Yang & Persson (2008): with w(q) = (pi int_{q_L}^q k^3 C(k) dk)^(-1/2) and P = erf(w p/E*),

        u(p) = sqrt(pi) int dq q^2 C(q) w(q) int_p^inf dp'/p' [gamma + 3 (1 - gamma) P^2] exp(-(w p'/E*)^2).

    The equation results from -p A0 du = dU_el, U_el = A0 E* (pi/2) int dq q^2 C P [gamma + (1 - gamma) P^2]. With the
    substitution t = w p'/E* the inner integral is the same function of t for all wave numbers.

    Parameters
    ----------
    reduced_pressure : p*, positive.
    spectrum : `icha.surfaces.spectrum.SelfAffineSpectrum`; the continuous spectrum is used, not the discrete modes.
    """
    return _over_wave_numbers(_stored_share, reduced_pressure, spectrum)


def persson_stiffness(reduced_pressure, spectrum):
    r"""Return the contact stiffness -dp/du times h_rms/(E* h'_rms) at reduced pressures (Yang & Persson 2008).

    The stiffness is computed from the derivative of `persson_mean_separation`:

        -p du/dp = sqrt(pi) int dq q^2 C(q) w(q) [gamma + 3 (1 - gamma) P^2] exp(-(w p/E*)^2).

    For small pressures -p du/dp is a constant length u0. Then p is proportional to exp(-u/u0), and the stiffness is
    p/u0 (Persson 2007). The parameters are the same as for `persson_mean_separation`.
    """
    decay_length = _over_wave_numbers(_share_density, reduced_pressure, spectrum)
    return np.asarray(reduced_pressure, float) / decay_length


def _over_wave_numbers(share, reduced_pressure, spectrum):
    """Return sqrt(pi) int dq q^2 C(q) w(q) share(w p/E*), divided by h_rms, at an array of reduced pressures."""
    pressure = np.asarray(reduced_pressure, float)
    if np.any(pressure <= 0):
        raise ValueError("reduced_pressure: must be greater than 0")
    # The unit of wave numbers is q_L, and the unit of C is its value below the roll-off. At q_L, w diverges and the
    # inner integral vanishes, so nodes are equally spaced along the logarithm of q - q_L.
    rolloff = max(spectrum.period / spectrum.rolloff_wavelength, 1.0)
    cutoff = spectrum.period / spectrum.short_wavelength
    falling = -2 * (1 + spectrum.hurst)
    above = np.geomspace(1e-14, cutoff - 1, _POINTS)
    if rolloff - 1 > 1e-9:
        above = np.concatenate(
            [np.geomspace(1e-14, rolloff - 1, _POINTS), np.geomspace(rolloff - 1, cutoff - 1, _POINTS)[1:]]
        )
    q = 1 + above
    shape = np.maximum(q / rolloff, 1.0) ** falling

    def moment(power, q):
        """Return 2 pi times the integral of k^power C from q_L to q, without rounding errors of q - 1."""
        flat = np.expm1((power + 1) * np.log1p(np.minimum(q - 1, rolloff - 1))) / (power + 1)
        steep = np.log(np.maximum(q / rolloff, 1.0)) if rolloff > 1 else np.log1p(q - 1)
        exponent = power + falling + 1
        growth = steep if abs(exponent) < 1e-12 else np.expm1(exponent * steep) / exponent
        return 2 * np.pi * (flat + rolloff ** (power + 1) * growth)

    slope2 = moment(3, q)
    w = np.sqrt(2 / slope2)
    # In these units the rms slope is the square root of the last slope2.
    t = np.multiply.outer(pressure * np.sqrt(slope2[-1]), w)
    integrand = q**2 * shape * w * share(t) * above
    separation = np.sqrt(np.pi) * simpson(integrand, x=np.log(above), axis=-1)
    return separation / np.sqrt(moment(1, q[-1]))


def _share_density(t):
    """Return [gamma + 3 (1 - gamma) erf(t)^2] exp(-t^2)."""
    return (YANG_PERSSON_GAMMA + 3 * (1 - YANG_PERSSON_GAMMA) * erf(t) ** 2) * np.exp(-(t**2))


def _stored_share(t):
    """Return the integral of `_share_density`(s)/s over s from t to infinity, interpolated in a table."""
    s = np.geomspace(1e-12, 12, 6001)
    integrand = _share_density(s)
    log_s = np.log(s)
    panels = 0.5 * (integrand[1:] + integrand[:-1]) * np.diff(log_s)
    tail = np.concatenate([np.cumsum(panels[::-1])[::-1], [0.0]])
    return np.interp(np.log(np.clip(t, s[0], s[-1])), log_s, tail)
