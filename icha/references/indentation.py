r"""Closed forms of one rigid indenter on an elastic half-space, with and without adhesion, in SI units.

The contact of an axisymmetric indenter is a circle of radius a. Let f'(r) be the slope of the indenter. Without
adhesion, indentation and force are (I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47, doi:10.1016/0020-7225(65)90019-4)

    delta_1 = a int_0^a f'(r)/sqrt(a^2 - r^2) dr,    F_1 = 2 E* int_0^a r^2 f'(r)/sqrt(a^2 - r^2) dr.

Adhesion of short range adds the tension of a flat punch, of the size at which the energy release rate at the edge
equals the work of adhesion w (D. Maugis, Contact, Adhesion and Rupture of Elastic Solids, Springer 2000, chapter 4):

    delta = delta_1 - sqrt(2 pi a w/E*),    F = F_1 - sqrt(8 pi E* w a^3).

All functions accept arrays that broadcast. `contact_modulus` is E*, Pa; `work_of_adhesion` is w, J/m^2. Forces are
positive in compression, indentations are positive towards the half-space.
"""

import math
import sys
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar
from scipy.special import struve

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.surfaces.shapes import Cone, CylinderPunch, FlatPunch, Shape, Wave

HERTZ = "H. Hertz, J. Reine Angew. Math. 92 (1882) 156; K. L. Johnson, Contact Mechanics, Cambridge 1985, chapter 4"
JOHNSON_KENDALL_ROBERTS = (
    "K. L. Johnson, K. Kendall and A. D. Roberts, Proc. R. Soc. Lond. A 324 (1971) 301, doi:10.1098/rspa.1971.0141"
)
KENDALL = "K. Kendall, J. Phys. D: Appl. Phys. 4 (1971) 1186, doi:10.1088/0022-3727/4/8/320"
MAUGIS_BARQUINS = "D. Maugis and M. Barquins, J. Phys. Lett. 42 (1981) L95"
GUDURU = "P. R. Guduru, J. Mech. Phys. Solids 55 (2007) 445, doi:10.1016/j.jmps.2006.09.004"
JOHNSON_GREENWOOD = (
    "K. L. Johnson and J. A. Greenwood, J. Phys. D: Appl. Phys. 38 (2005) 1042, doi:10.1088/0022-3727/38/7/012"
)
GIUDICI = (
    "A. Giudici, D. Vella and I. Griffiths, Mechanics of elliptical JKR-type adhesive contact, arXiv:2407.00378 (2024)"
)

# Gauss-Legendre quadrature of Sneddon's integrals over the angle arcsin(r/a) in [0, pi/2].
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(256)
_ANGLES, _ANGLE_WEIGHTS = math.pi / 4 * (_NODES + 1), math.pi / 4 * _WEIGHTS
# The midpoint rule over a quarter of an ellipse converges exponentially; the number suffices for axis ratios >= 0.01.
_QUARTER = (np.arange(2048) + 0.5) * (math.pi / 4096)
# Smallest ratio of the axes of an elliptic contact.
_SMALLEST_AXIS_RATIO = 0.01


class ContactState(NamedTuple):
    """Equilibrium of an indenter, or arrays of equilibria.

    Attributes
    ----------
    contact_radius : radius a of the contact, m.
    indentation : depth of the apex below the undeformed plane, m; negative above the plane.
    force : force on the indenter, N; negative in tension.
    """

    contact_radius: np.ndarray | float
    indentation: np.ndarray | float
    force: np.ndarray | float


def axisymmetric_contact(contact_radius, slope: Callable, contact_modulus, work_of_adhesion=0.0) -> ContactState:
    """Return the equilibria of an axisymmetric indenter by quadrature of Sneddon's integrals, see the module.

    Parameters
    ----------
    contact_radius : contact radii, m.
    slope : function of the radius r (m, array) that returns f'(r), such as `icha.surfaces.shapes.Cone(1.4).slope`.
        The quadrature is exact to rounding if the slope has fewer than about 30 waves inside the contact.
    """
    a = np.asarray(contact_radius, float)
    slopes = slope(a[..., None] * np.sin(_ANGLES))
    indentation = a * (slopes @ _ANGLE_WEIGHTS)
    force = 2 * contact_modulus * a**2 * (slopes @ (_ANGLE_WEIGHTS * np.sin(_ANGLES) ** 2))
    return _with_adhesion(a, indentation, force, contact_modulus, work_of_adhesion)


def _with_adhesion(a, indentation, force, contact_modulus, work_of_adhesion):
    """Add the tension of a flat punch to the equilibria without adhesion, see the module."""
    lift = np.sqrt(2 * np.pi * a * work_of_adhesion / contact_modulus)
    return ContactState(a, indentation - lift, force - 2 * contact_modulus * a * lift)


def stable_branches(states: ContactState, control: str = "indentation") -> tuple[np.ndarray, np.ndarray]:
    """Return the masks of the states that loading and unloading pass through, for radii in ascending order.

    Between the states of a branch, the contact jumps. Loading starts at the first touch of the apex, at force 0 and
    indentation 0. The contact remains one circle.

    Parameters
    ----------
    states : equilibria at contact radii that increase from nearly 0.
    control : "indentation" or "force", the quantity that the experiment prescribes.
    """
    if control not in ("indentation", "force"):
        raise ValueError(f"control: {control!r} must be one of indentation, force")
    prescribed = np.asarray(getattr(states, control))
    largest = np.maximum.accumulate(np.concatenate([[0.0], prescribed[:-1]]))
    smallest = np.minimum.accumulate(np.concatenate([[np.inf], prescribed[:0:-1]]))[::-1]
    return prescribed > largest, prescribed < smallest


def sphere_contact(contact_radius, radius, contact_modulus, work_of_adhesion=0.0) -> ContactState:
    """Return the equilibria of a paraboloid of the given radius R by Johnson, Kendall & Roberts (1971).

    F = 4 E* a^3/(3 R) - sqrt(8 pi E* w a^3) and delta = a^2/R - sqrt(2 pi a w/E*). With w = 0, this is Hertz's contact.
    """
    a = np.asarray(contact_radius, float)
    return _with_adhesion(a, a**2 / radius, 4 / 3 * contact_modulus * a**3 / radius, contact_modulus, work_of_adhesion)


def sphere_radius_at_force(force, radius, contact_modulus, work_of_adhesion=0.0):
    """Return the contact radius that is stable at a force, m (JKR 1971; Hertz with w = 0).

    a^3 = 3 R/(4 E*) [F + 3 pi w R + sqrt(6 pi w R F + (3 pi w R)^2)]. Below the pull-off force -(3/2) pi w R no
    equilibrium exists, and the result is not a number.
    """
    unit = 3 * np.pi * np.asarray(work_of_adhesion, float) * radius
    with np.errstate(invalid="ignore"):
        return np.cbrt(0.75 * radius / contact_modulus * (force + unit + np.sqrt(2 * unit * force + unit**2)))


def sphere_radius_at_indentation(indentation, radius, contact_modulus, work_of_adhesion=0.0):
    """Return the contact radius that is stable at an indentation, m (JKR 1971; Hertz with w = 0).

    Below the indentation of `sphere_jump_off` no equilibrium exists, and the result is not a number. Without adhesion
    the radius is 0 at negative indentations.
    """
    law = JKR(Material(contact_modulus, work_of_adhesion, 1.0))
    a = law.contact_radius(indentation, radius)
    return np.where(indentation < law.jump_off_approach(radius), np.nan if work_of_adhesion else 0.0, a)


def sphere_pull_off(radius, contact_modulus, work_of_adhesion) -> ContactState:
    """Return the state of the smallest force, where contact breaks under load control (JKR 1971).

    F = -(3/2) pi w R, a^3 = 9 pi w R^2/(8 E*), delta = -a^2/(3 R).
    """
    a = np.cbrt(9 / 8 * np.pi * radius**2 * work_of_adhesion / contact_modulus)
    return ContactState(a, -(a**2) / (3 * radius), -1.5 * np.pi * radius * work_of_adhesion)


def sphere_jump_off(radius, contact_modulus, work_of_adhesion) -> ContactState:
    """Return the state of the smallest indentation, where contact breaks under displacement control (JKR 1971).

    F = -(5/6) pi w R, a^3 = pi w R^2/(8 E*), delta = -3 a^2/R.
    """
    a = np.cbrt(np.pi / 8 * radius**2 * work_of_adhesion / contact_modulus)
    return ContactState(a, -3 * a**2 / radius, -5 / 6 * np.pi * radius * work_of_adhesion)


def contact_radius_at(quantity: str, value: float, shape: Shape, contact_modulus, work_of_adhesion=0.0) -> float:
    """Return the radius (m) of the largest contact of a smooth shape at a force (N) or indentation (m).

    The result is not a number if theory has no such contact. For spheres, paraboloids and waves it is that of Hertz and
    JKR, for cones that of Sneddon, Maugis & Barquins, and for flat ends the radius or half side of the end.

    Parameters
    ----------
    quantity : "force" or "indentation".
    value : value of the quantity.
    """
    if isinstance(shape, (CylinderPunch, FlatPunch)):
        return shape.radius if isinstance(shape, CylinderPunch) else shape.side / 2
    material = contact_modulus, work_of_adhesion
    if not isinstance(shape, Cone):
        by_radius = {"force": sphere_radius_at_force, "indentation": sphere_radius_at_indentation}[quantity]
        return float(by_radius(value, shape.sphere_radius, *material))
    # Between the radius of the smallest value and infinity, the value grows with the radius.
    smallest = {"force": cone_pull_off, "indentation": cone_jump_off}[quantity](shape.half_angle, *material)
    lower = upper = float(smallest.contact_radius) or math.sqrt(sys.float_info.min)

    def excess(radius):
        return float(getattr(cone_contact(radius, shape.half_angle, *material), quantity)) - value

    if excess(lower) > 0:
        return math.nan
    while excess(upper) <= 0:
        upper *= 2
    return brentq(excess, lower, upper)


def pull_off_state(shape: Shape, contact_modulus, work_of_adhesion) -> ContactState | None:
    """Return the pull-off of a smooth shape by the theories of `contact_radius_at`; None for a square end."""
    material = contact_modulus, work_of_adhesion
    if isinstance(shape, FlatPunch):
        return None
    if isinstance(shape, CylinderPunch):
        return punch_pull_off(shape.radius, *material)
    if isinstance(shape, Cone):
        return cone_pull_off(shape.half_angle, *material)
    return sphere_pull_off(shape.sphere_radius, *material)


def theory_of(shape: Shape, *, adhesive: bool) -> str:
    """Return the authors of the theory by which `contact_radius_at` describes a shape."""
    if isinstance(shape, (CylinderPunch, FlatPunch)):
        return "Kendall" if adhesive else "Boussinesq"
    if isinstance(shape, Cone):
        return "Maugis and Barquins" if adhesive else "Sneddon"
    return "JKR" if adhesive else "Hertz"


def punch_force(indentation, punch_radius, contact_modulus):
    """Return the force on a cylinder with a flat end, F = 2 a E* delta, N (Boussinesq; Johnson 1985, section 3.8)."""
    return 2 * punch_radius * contact_modulus * np.asarray(indentation, float)


def punch_pull_off(punch_radius, contact_modulus, work_of_adhesion) -> ContactState:
    """Return the state at which a flat-ended cylinder breaks off, F = -sqrt(8 pi E* w a^3), by Kendall (1971)."""
    return _with_adhesion(np.asarray(punch_radius, float), 0.0, 0.0, contact_modulus, work_of_adhesion)


def cone_contact(contact_radius, half_angle, contact_modulus, work_of_adhesion=0.0) -> ContactState:
    """Return the equilibria of a cone by Sneddon (1965), with adhesion by Maugis & Barquins (1981).

    With t = 1/tan(half_angle), delta = pi t a/2 - sqrt(2 pi a w/E*) and F = pi E* t a^2/2 - sqrt(8 pi E* w a^3).
    """
    a, slope = np.asarray(contact_radius, float), 1 / np.tan(half_angle)
    indentation, force = np.pi / 2 * slope * a, np.pi / 2 * contact_modulus * slope * a**2
    return _with_adhesion(a, indentation, force, contact_modulus, work_of_adhesion)


def cone_pull_off(half_angle, contact_modulus, work_of_adhesion) -> ContactState:
    """Return the state of the smallest force of a cone, F = -54 w^2 tan^3(half_angle)/(pi E*), from `cone_contact`."""
    a = 18 / np.pi * work_of_adhesion / contact_modulus * np.tan(half_angle) ** 2
    return cone_contact(a, half_angle, contact_modulus, work_of_adhesion)


def cone_jump_off(half_angle, contact_modulus, work_of_adhesion) -> ContactState:
    """Return the state of the smallest indentation of a cone, delta = -w tan(half_angle)/E*, from `cone_contact`."""
    a = 2 / np.pi * work_of_adhesion / contact_modulus * np.tan(half_angle) ** 2
    return cone_contact(a, half_angle, contact_modulus, work_of_adhesion)


def wave_contact(contact_radius, wave: Wave, contact_modulus, work_of_adhesion=0.0) -> ContactState:
    """Return the equilibria of a paraboloid with concentric waves, the problem of Guduru (2007), in closed form.

    With Struve's functions H_0 and H_1, q = 2 pi/lambda and z = q a, Sneddon's integrals of f' = r/R + A q sin(q r)
    are delta_1 = a^2/R + (pi/2) A z H_0(z) and F_1 = E* [4 a^3/(3 R) + pi A a z (H_0(z) - H_1(z)/z)]. The contact is
    assumed to be one circle. This holds on unloading from a complete contact; on loading it holds for waves whose
    slopes are nowhere negative, f' >= 0.
    """
    a, z = np.asarray(contact_radius, float), 2 * np.pi * np.asarray(contact_radius, float) / wave.wavelength
    indentation = a**2 / wave.radius + np.pi / 2 * wave.amplitude * z * struve(0, z)
    waves = np.pi * wave.amplitude * a * (z * struve(0, z) - struve(1, z))
    force = contact_modulus * (4 / 3 * a**3 / wave.radius + waves)
    return _with_adhesion(a, indentation, force, contact_modulus, work_of_adhesion)


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
