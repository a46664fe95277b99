"""Work of adhesion from the computed forces of a sphere on one branch, as experiments find it.

`icha.references.jkr_loop` fits measured points, which have errors. On rough surfaces the fitted work of adhesion is an
apparent one, smaller on loading than on unloading (S. Dalvi et al., Proc. Natl. Acad. Sci. 116 (2019) 25484,
doi:10.1073/pnas.1913126116).
"""

import math

import numpy as np
from scipy.optimize import minimize_scalar

# Roots of the work of adhesion at which the sum of squares is computed first, in the unit of the largest force.
_ROOTS = np.linspace(0.0, math.sqrt(10), 2000) ** 2
# Sums of squares are equal up to this relative difference.
_ROUNDING = 1e-12


def fit_work_of_adhesion(force: np.ndarray, contact_radius: np.ndarray, radius: float, contact_modulus: float) -> float:
    """Fit the law of Johnson, Kendall & Roberts to forces of a sphere, by least squares; return the work, J/m^2.

    The sum of the squared differences of a^3 is smallest, with a^3 as function of the force on the branch that is
    stable under load control. Therefore leave out states after the pull-off force, and states without contact. Forces
    below the pull-off force of the fit, -(3/2) pi w R, are compared with the continuation in which the square root in
    a^3(F) is zero. The result is 0 if no law with adhesion fits better than Hertz's law.

    Parameters
    ----------
    force : (n,), N, negative in tension.
    contact_radius : (n,), m.
    radius : radius R of the sphere, m.
    contact_modulus : E*, Pa.
    """
    scale = np.max(np.abs(force)) / (1.5 * math.pi * radius)

    def misfit(root):
        work = scale * np.asarray(root)[..., None] ** 2
        unit = 3 * math.pi * work * radius
        cube = 0.75 * radius / contact_modulus * (force + unit + np.sqrt(np.maximum(2 * unit * force + unit**2, 0.0)))
        return np.sum((np.maximum(cube, 0.0) - contact_radius**3) ** 2, axis=-1)

    # The sum has several minima: one may be where the tension of a state is the pull-off force of the law.
    best = int(np.argmin(misfit(_ROOTS)))
    around = _ROOTS[max(best - 1, 0)], _ROOTS[min(best + 1, len(_ROOTS) - 1)]
    found = minimize_scalar(misfit, bounds=around, method="bounded", options={"xatol": 1e-12})
    return 0.0 if misfit(0.0) <= found.fun * (1 + _ROUNDING) else float(scale * found.x**2)
