r"""Closed forms of one rigid indenter on an elastic half-space, with and without adhesion, in SI units.

The contact of an axisymmetric indenter is a circle of radius a. Let f'(r) be the slope of the indenter. Without
adhesion, indentation and force are (I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47, doi:10.1016/0020-7225(65)90019-4)

    delta_1 = a int_0^a f'(r)/sqrt(a^2 - r^2) dr,    F_1 = 2 E* int_0^a r^2 f'(r)/sqrt(a^2 - r^2) dr.

Adhesion of short range adds the tension of a flat punch, of the size at which the energy release rate at the edge
equals the work of adhesion w (D. Maugis, Contact, Adhesion and Rupture of Elastic Solids, Springer 2000, chapter 4):

    delta = delta_1 - sqrt(2 pi a w/E*),    F = F_1 - sqrt(8 pi E* w a^3).

Further sources: H. Hertz, J. Reine Angew. Math. 92 (1882) 156; K. L. Johnson, Contact Mechanics, Cambridge 1985; K. L.
Johnson, K. Kendall and A. D. Roberts, Proc. R. Soc. Lond. A 324 (1971) 301, doi:10.1098/rspa.1971.0141; K. Kendall, J.
Phys. D: Appl. Phys. 4 (1971) 1186, doi:10.1088/0022-3727/4/8/320; D. Maugis and M. Barquins, J. Phys. Lett. 42 (1981)
L95.

All functions accept arrays that broadcast. `contact_modulus` is E*, Pa; `work_of_adhesion` is w, J/m^2. Forces are
positive in compression, indentations are positive towards the half-space.
"""

import math
import sys
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.support.formatting import format_quantity
from icha.surfaces.shapes import Cone, CylinderPunch, FlatPunch, Paraboloid, Shape

# Gauss-Legendre quadrature of Sneddon's integrals over the angle arcsin(r/a) in [0, pi/2].
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(256)
_ANGLES, _ANGLE_WEIGHTS = math.pi / 4 * (_NODES + 1), math.pi / 4 * _WEIGHTS


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


def sphere_contact(contact_radius, radius, contact_modulus, work_of_adhesion=0.0) -> ContactState:
    """Return the equilibria of a paraboloid of the given radius R by Johnson, Kendall & Roberts (1971).

    F = 4 E* a^3/(3 R) - sqrt(8 pi E* w a^3) and delta = a^2/R - sqrt(2 pi a w/E*). With w = 0, this is Hertz's contact.
    """
    a = np.asarray(contact_radius, float)
    return _with_adhesion(a, a**2 / radius, 4 / 3 * contact_modulus * a**3 / radius, contact_modulus, work_of_adhesion)


def sphere_energy_release_rate(force, contact_radius, radius, contact_modulus):
    """Return the energy release rate at the edge of a contact of a paraboloid, J/m^2, from `sphere_contact`.

    G = (4 E* a^3/(3 R) - F)^2/(8 pi E* a^3); in equilibrium it is the work of adhesion.
    """
    hertz = sphere_contact(contact_radius, radius, contact_modulus).force
    return (hertz - force) ** 2 / (8 * np.pi * contact_modulus * contact_radius**3)


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
    """Return the theory by which `contact_radius_at` describes a shape: its authors, and what the shape counts as."""
    if isinstance(shape, (CylinderPunch, FlatPunch)):
        counts_as = " (as a round end whose radius is half the side)" if isinstance(shape, FlatPunch) else ""
        return ("Kendall" if adhesive else "Boussinesq") + counts_as
    if isinstance(shape, Cone):
        return "Maugis and Barquins" if adhesive else "Sneddon"
    counts_as = ""
    if isinstance(shape, Paraboloid) and shape.radii[0] != shape.radii[1]:
        counts_as = f" (as a sphere of radius {format_quantity(shape.sphere_radius, 'm')})"
    return ("JKR" if adhesive else "Hertz") + counts_as


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
