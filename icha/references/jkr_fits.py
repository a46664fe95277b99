"""Work of adhesion from the computed forces of a sphere on one branch, as experiments find it.

A fit compares the force with the contact radius or with the indentation. `icha.references.jkr_test` fits measured
points of both branches. On rough surfaces the fitted work of adhesion is an apparent one, smaller on loading than on
unloading (S. Dalvi et al., Proc. Natl. Acad. Sci. 116 (2019) 25484, doi:10.1073/pnas.1913126116).
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from icha.references.indentation import sphere_contact
from icha.support.rules import CONTACT_MODULUS, LENGTH

# First and last root of the work of adhesion at which fits start, in the unit of the largest force, and their number.
_STARTS = 0.1, 1.2, 24

# Sums of squares are equal up to this relative difference.
_ROUNDING = 1e-12


class JKRFit(NamedTuple):
    """Result of a fit.

    Attributes
    ----------
    work_of_adhesion : apparent work of adhesion, J/m^2; 0 if no law with adhesion fits better than Hertz's law.
    contact_modulus : E*, Pa, fitted or given.
    misfit : rms difference between data and fit, divided by the largest absolute value of the data.
    """

    work_of_adhesion: float
    contact_modulus: float
    misfit: float


def fit_work_of_adhesion(
    force, radius: float, *, contact_radius=None, indentation=None, contact_modulus=None
) -> JKRFit:
    """Fit the law of Johnson, Kendall & Roberts to forces of a sphere, by least squares.

    With `contact_radius`, the sum of the squared differences of a^3 is smallest; with `indentation`, that of the
    indentation. Both are functions of the force on the branch that is stable under load control. Therefore leave out
    states after the pull-off force, and states without contact. Forces below the pull-off force of the fit, -(3/2) pi w
    R, are compared with the continuation in which the square root in a^3(F) is zero.

    Parameters
    ----------
    force : (n,), N, negative in tension.
    radius : radius R of the sphere, m.
    contact_radius, indentation : (n,), m; one of the two.
    contact_modulus : E*, Pa; if None, E* is fitted too.

    Raises
    ------
    ValueError
        If not exactly one of the two quantities is given, or the arrays do not have the same length, contain numbers
        that are not finite, or have fewer values than unknowns.
    """
    radius = LENGTH.validate("radius", radius)
    if (contact_radius is None) == (indentation is None):
        raise ValueError("contact_radius, indentation: give one of the two")
    name, measured = ("contact_radius", contact_radius) if indentation is None else ("indentation", indentation)
    force, measured = _finite_array("force", force), _finite_array(name, measured)
    unknowns = 1 if contact_modulus is not None else 2
    if len(force) != len(measured) or len(force) < unknowns:
        raise ValueError(f"force, {name}: must be of the same length, and have at least {unknowns} values")
    data = measured**3 if indentation is None else measured
    scale, force_scale = np.max(np.abs(data)), np.max(np.abs(force))
    if not scale * force_scale:
        raise ValueError(f"force, {name}: must not all be zero")
    # Hertz's law at the largest value gives the unit of the modulus.
    hertz = 0.75 * force_scale * (radius / scale if indentation is None else scale**-1.5 / math.sqrt(radius))
    modulus = None if contact_modulus is None else CONTACT_MODULUS.validate("contact_modulus", contact_modulus)
    work_unit = force_scale / (1.5 * math.pi * radius)

    def parameters(unknown):
        # The law is smooth in the root of the work of adhesion and in the logarithm of the modulus.
        return float(work_unit * unknown[0] ** 2), hertz * math.exp(unknown[1]) if modulus is None else modulus

    def residuals(unknown):
        work, fitted_modulus = parameters(unknown)
        a = np.cbrt(_cubed_radius(force, radius, fitted_modulus, work))
        law = a**3 if indentation is None else sphere_contact(a, radius, fitted_modulus, work).indentation
        return (law - data) / scale

    # The sum has several minima: one may be where the tension of a state is the pull-off force of the law.
    starts = [[root, 0.0][:unknowns] for root in np.linspace(*_STARTS)]
    fits = [least_squares(residuals, start, x_scale=1.0, xtol=1e-14, ftol=1e-14, gtol=1e-14) for start in starts]
    # At the root 0 the derivative of the sum may be positive, and the search only comes near. Hertz's law is at 0.
    hertzian = least_squares(lambda unknown: residuals([0.0, *unknown[1:]]), [0.0] * unknowns)
    hertzian.x[0] = 0.0
    found = min(fits, key=lambda fit: fit.cost)
    found = hertzian if hertzian.cost <= found.cost * (1 + _ROUNDING) else found
    return JKRFit(*parameters(found.x), float(np.sqrt(np.mean(found.fun**2))))


def _cubed_radius(force, radius, contact_modulus, work_of_adhesion):
    """Return a^3 of `sphere_radius_at_force`, with the square root 0 and a >= 0 below the pull-off force."""
    unit = 3 * math.pi * work_of_adhesion * radius
    root = np.sqrt(np.maximum(2 * unit * force + unit**2, 0.0))
    return np.maximum(0.75 * radius / contact_modulus * (force + unit + root), 0.0)


def _finite_array(name, values):
    """Return values as a one-dimensional array of floats; raise ValueError if they are not finite numbers."""
    array = np.asarray(values, float)
    if array.ndim != 1 or not np.all(np.isfinite(array)):
        raise ValueError(f"{name}: must be a list of finite numbers")
    return array
