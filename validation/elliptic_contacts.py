"""Closed forms of paraboloids with two radii, and of the front of a small wave, in SI units.

Arguments and signs are those of `icha.references.indentation`. Adhesive contacts of ellipses: K. L. Johnson and J. A.
Greenwood, J. Phys. D: Appl. Phys. 38 (2005) 1042, doi:10.1088/0022-3727/38/7/012; A. Giudici, D. Vella and I.
Griffiths, Mechanics of elliptical JKR-type adhesive contact, arXiv:2407.00378 (2024).
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar

# The midpoint rule over a quarter of an ellipse converges exponentially; the number suffices for axis ratios >= 0.01.
_QUARTER = (np.arange(2048) + 0.5) * (math.pi / 4096)
# Smallest ratio of the axes of an elliptic contact.
_SMALLEST_AXIS_RATIO = 0.01


def front_response(amplitude, wavelength, contact_modulus, angle=0.0):
    """Return the complex stress intensity that a small wave of the heights adds at a straight front, Pa m^(1/2).

    Contact fills the half-plane x < 0. Let the wave be the real part of h exp(i q.r), with the wave vector q at the
    angle from the front; the angle is 0 along the front, and pi/2 if q points out of the contact. At y along the front,
    the stress intensity is the real part of K exp(i q_y y) with K = -E* h sqrt(pi/lambda) exp(i angle/2). K results
    from the pressure q E* h/2 of full contact, which is removed from the open half-plane with the weight function
    sqrt(2/(pi x)) exp(-|q_y| x) of J. R. Rice, J. Appl. Mech. 52 (1985) 571, doi:10.1115/1.3169103.
    """
    return -contact_modulus * amplitude * np.sqrt(np.pi / wavelength) * np.exp(0.5j * np.asarray(angle))


class EllipticState(NamedTuple):
    """Equilibrium of a paraboloid of two radii, or arrays of equilibria.

    Attributes
    ----------
    semi_axes : semi-axes of the contact ellipse along x and along y, m.
    indentation : depth of the apex below the undeformed plane, m.
    force : force on the indenter, N.
    """

    semi_axes: tuple[np.ndarray, np.ndarray]
    indentation: np.ndarray
    force: np.ndarray


def elliptic_hertz_contact(force, radii, contact_modulus) -> EllipticState:
    """Return the contact of a paraboloid of radii (Rx, Ry) without adhesion, for an array of forces.

    Hertz's pressure on an ellipse of semi-axes a >= b, with g = b/a and the integrals D, B, C of `_ellipse_integrals`:
    B/D = g^2 R_a/R_b, F = pi E* a^3/(3 R_a D), delta = a^2 (B + D)/(2 R_a D) (Johnson 1985, section 4.2).
    """
    larger, smaller = max(radii), min(radii)
    ratio = _hertz_axis_ratio(larger / smaller)
    D, B, _ = _ellipse_integrals(ratio)
    a = np.cbrt(3 * larger * D * np.asarray(force, float) / (np.pi * contact_modulus))
    return EllipticState(_along_axes(a, ratio * a, radii), a**2 * (B + D) / (2 * larger * D), np.asarray(force, float))


def elliptic_jkr_contact(
    axis_ratio, radii, contact_modulus, work_of_adhesion, criterion: str = "energy"
) -> EllipticState:
    """Return the adhesive contact of a paraboloid of radii (Rx, Ry), approximated by an ellipse of semi-axes a >= b.

    With X = x^2/a^2, Y = y^2/b^2, the pressure is (c_0 - c_1 X - c_2 Y)/sqrt(1 - X - Y). The shape of the paraboloid
    determines c_1 and c_2. At the angle theta of the ellipse, K = -m sqrt(pi b/s), with m = c_0 - c_1 cos^2 theta - c_2
    sin^2 theta and s^2 = g^2 cos^2 theta + sin^2 theta. No ellipse has the energy release rate w everywhere. Two
    published criteria remain; the formulas here are derived from these criteria.

    Parameters
    ----------
    axis_ratio : g = b/a, between the ratio of Hertz's contact (large loads) and 1 (small radii), both excluded.
    radii : radii of curvature along x and along y, m, different from each other.
    criterion : "energy" (Giudici et al. 2024) if the energy is stationary for both semi-axes at fixed indentation, or
        "axes" (Johnson & Greenwood 2005) if the energy release rate is w at the ends of both axes.
    """
    g, larger, smaller = np.asarray(axis_ratio, float), max(radii), min(radii)
    D, B, C = _ellipse_integrals(g)
    # Solve c_i = n_i E* a for the curvatures of the paraboloid.
    determinant = (2 * D - C) * (2 * B - C) - (D - C) * (B - C)
    n_1 = ((2 * B - C) / (2 * larger * g) + (D - C) * g / (2 * smaller)) / determinant
    n_2 = ((B - C) / (2 * larger * g) + (2 * D - C) * g / (2 * smaller)) / determinant
    if criterion == "axes":
        n_0 = (n_1 - np.sqrt(g) * n_2) / (1 - np.sqrt(g))
        rate = (n_0 - n_1) ** 2 * np.pi / 2
    elif criterion == "energy":
        n_0, rate = _stationary_ellipse(g, n_1, n_2)
    else:
        raise ValueError(f"criterion: {criterion!r} must be one of energy, axes")
    a = np.cbrt(work_of_adhesion / (contact_modulus * rate))
    b = g * a
    indentation = a * b * (2 * (B + D) * n_0 - B * n_1 - D * n_2)
    force = np.pi * contact_modulus * a**2 * b * (2 * n_0 - 2 / 3 * (n_1 + n_2))
    return EllipticState(_along_axes(a, b, radii), indentation, force)


def _stationary_ellipse(g, n_1, n_2):
    """Return n_0 = c_0/(E* a) and w/(E* a^3) for which the energy is stationary.

    Advance of the semi-axes by da and db releases the integrals over the front of K^2/(2 E*) b cos^2 theta da and
    K^2/(2 E*) a sin^2 theta db. Both must equal the energy of adhesion, pi w b da and pi w a db.
    """
    cosine2 = np.cos(_QUARTER) ** 2
    weight = 1 / np.sqrt(1 - (1 - g[..., None] ** 2) * cosine2)
    n = n_2[..., None] + (n_1 - n_2)[..., None] * cosine2
    # Equality of the two rates is a quadratic equation for n_0. The front is in tension, n_0 < n, for the smaller root.
    half, linear, constant = (np.sum(weight * (2 * cosine2 - 1) * n**power, axis=-1) for power in (0, 1, 2))
    n_0 = (linear - np.sqrt(linear**2 - half * constant)) / half
    step = _QUARTER[1] - _QUARTER[0]
    return n_0, 2 * g * step * np.sum(weight * cosine2 * (n_0[..., None] - n) ** 2, axis=-1)


def elliptic_pull_off(radii, contact_modulus, work_of_adhesion, criterion: str = "energy") -> EllipticState:
    """Return the state of the smallest force in `elliptic_jkr_contact`; the radii must differ by 0.1 % or more."""

    def state(axis_ratio):
        return elliptic_jkr_contact(axis_ratio, radii, contact_modulus, work_of_adhesion, criterion)

    hertz = _hertz_axis_ratio(max(radii) / min(radii))
    margin = 1e-6 * (1 - hertz)
    bounds = (hertz + margin, 1 - margin)
    return state(minimize_scalar(lambda g: float(state(g).force), bounds=bounds, options={"xatol": 1e-10}).x)


def _hertz_axis_ratio(radius_ratio):
    """Return b/a of Hertz's contact for the ratio R_a/R_b >= 1 of the radii of curvature."""

    def excess(g):
        D, B, _ = _ellipse_integrals(g)
        return g**2 * radius_ratio * D - B

    if excess(_SMALLEST_AXIS_RATIO) > 0:
        raise ValueError(f"radii: their ratio {radius_ratio:.4g} is too large for the contact of an ellipse")
    return 1.0 if radius_ratio == 1 else brentq(excess, _SMALLEST_AXIS_RATIO, 1.0, xtol=1e-14)


def _ellipse_integrals(axis_ratio):
    """Return D, B, C: integrals of sin^2/s, cos^2/s, g^2 sin^4/s^3 over [0, pi/2], s^2 = cos^2 + g^2 sin^2.

    With X = x^2/a^2, Y = y^2/b^2 and S^2 = 1 - X - Y, the pressures S, X/S, Y/S on an ellipse displace the half-space
    inside by b/E* times (B + D) - D X - B Y, B + (2 D - C) X - (B - C) Y, and D - (D - C) X + (2 B - C) Y. The first is
    in section 3.5 of Johnson (1985); the others are its derivatives a d/da and b d/db at fixed b and a.
    """
    g = np.asarray(axis_ratio, float)[..., None]
    sine, cosine = np.sin(_QUARTER), np.cos(_QUARTER)
    s = np.sqrt(cosine**2 + (g * sine) ** 2)
    step = _QUARTER[1] - _QUARTER[0]
    return tuple(step * np.sum(f, axis=-1) for f in (sine**2 / s, cosine**2 / s, g**2 * sine**4 / s**3))


def _along_axes(a, b, radii):
    """Return the semi-axes along x and along y: the larger semi-axis a lies along the larger radius of curvature."""
    return (a, b) if radii[0] >= radii[1] else (b, a)
