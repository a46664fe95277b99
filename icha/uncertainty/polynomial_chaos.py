"""Shares of the variance of a result that uncertain parameters cause, from a polynomial fitted to a sample of cases.

The polynomial is a sum of products of orthonormal polynomials of one parameter each: Hermite polynomials for normal
distributions, Legendre polynomials for uniform ones. Then the variance of the result is the sum of the squared
coefficients. The terms of one parameter alone give its first-order index, and all terms with this parameter give its
total index.

Sources: D. Xiu & G. E. Karniadakis, The Wiener-Askey polynomial chaos, SIAM J. Sci. Comput. 24 (2002) 619-644.
B. Sudret, Global sensitivity analysis using polynomial chaos expansions, Reliab. Eng. Syst. Saf. 93 (2008) 964-979.
G. Blatman & B. Sudret, Adaptive sparse polynomial chaos expansion, J. Comput. Phys. 230 (2011) 2345-2367, which selects
the degree by the leave-one-out error.
"""

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial import hermite_e, legendre

# Largest degree of the polynomial.
MOST_DEGREE = 3
# Smallest number of cases for each term of the polynomial.
_CASES_PER_TERM = 2
# The interval of an index contains the index of infinitely many cases with the probability 0.9.
_INTERVAL = 1.645


class Expansion(NamedTuple):
    """A fitted polynomial.

    Attributes
    ----------
    powers : degree of the polynomial of each parameter in each term, shape (terms, parameters); the first term is
        constant.
    coefficients : coefficient of each term.
    error : leave-one-out error: mean square of the differences between each value and the polynomial that is fitted to
        all other values, divided by the variance of the values.
    without : coefficients of the polynomials that are fitted without one case, shape (cases, terms).
    """

    powers: np.ndarray
    coefficients: np.ndarray
    error: float
    without: np.ndarray

    @property
    def degree(self) -> int:
        """Degree of the polynomial."""
        return int(self.powers.sum(axis=1).max())

    def indices(self, coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return first-order and total index of each parameter (last axis), for coefficients along the last axis."""
        squares = coefficients[..., 1:] ** 2
        present = self.powers[1:] > 0
        alone = present & (present.sum(axis=1) == 1)[:, None]
        return squares @ alone / squares.sum(axis=-1)[..., None], squares @ present / squares.sum(axis=-1)[..., None]

    def half_widths(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the half-widths of the intervals of first-order and total indices, from the jackknife."""
        count = len(self.without)
        return tuple(_INTERVAL * np.sqrt((count - 1) * np.var(each, axis=0)) for each in self.indices(self.without))

    def main_effect(self, parameter: int, points: np.ndarray, *, normal: bool) -> np.ndarray:
        """Return the mean over all other parameters at given values of a standardised parameter."""
        alone = (np.delete(self.powers, parameter, axis=1) == 0).all(axis=1)
        basis = _basis(points, normal, MOST_DEGREE)
        return basis[:, self.powers[alone, parameter]] @ self.coefficients[alone]


def expand(points: np.ndarray, normal: Sequence[bool], values: np.ndarray) -> Expansion | None:
    """Fit the polynomial of the degree with the least leave-one-out error.

    Parameters
    ----------
    points : standardised parameters of each case, shape (cases, parameters).
    normal : for each parameter, whether it has the standard normal distribution. Otherwise it is uniform in [-1, 1].
    values : value of each case.

    Returns
    -------
    The polynomial; None if there are too few cases, or if the values do not vary.
    """
    if not len(values) or np.ptp(values) <= 1e-12 * np.abs(values).max():
        return None
    fits = (_fit(points, normal, values, degree) for degree in range(1, MOST_DEGREE + 1))
    return min((each for each in fits if each is not None), key=lambda each: each.error, default=None)


def _fit(points, normal, values, degree):
    """Return the polynomial of a degree; None if there are too few cases."""
    parameters = points.shape[1]
    factors = (itertools.combinations_with_replacement(range(parameters), k) for k in range(degree + 1))
    terms = (np.array(each, int) for each in itertools.chain(*factors))
    powers = np.array([np.bincount(each, minlength=parameters) for each in terms])
    if len(values) < _CASES_PER_TERM * len(powers):
        return None
    bases = [_basis(points[:, k], normal[k], degree) for k in range(parameters)]
    matrix = np.prod([bases[k][:, powers[:, k]] for k in range(parameters)], axis=0)
    pseudoinverse = np.linalg.pinv(matrix)
    coefficients = pseudoinverse @ values
    # Without one case, the coefficients change by a known multiple of the case's column (Cook, 1977).
    leverage = np.einsum("ij,ji->i", matrix, pseudoinverse)
    residuals = (values - matrix @ coefficients) / np.maximum(1 - leverage, 1e-12)
    error = float(np.mean(residuals**2) / np.var(values, ddof=1))
    return Expansion(powers, coefficients, error, coefficients - (pseudoinverse * residuals).T)


def _basis(points, normal, degree):
    """Return the orthonormal polynomials of degrees 0 to `degree` at some points, shape (points, degree + 1)."""
    degrees = np.arange(degree + 1)
    if normal:
        return hermite_e.hermevander(points, degree) / np.sqrt([math.factorial(k) for k in degrees])
    return legendre.legvander(points, degree) * np.sqrt(2 * degrees + 1)
