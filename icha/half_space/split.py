"""Ewald's split of 1/r: the smooth half, erf(alpha r)/r, has a short Fourier series; the rest is erfc(alpha r)/r."""

import math

import numpy as np
from scipy.special import erf, erfc

# Number of moments.
MOMENTS = 4
# If (alpha r)^2 is below the first value, a power series of `_SERIES_LENGTH` terms gives the smooth half.
_SERIES_BELOW = 0.25
_SERIES_LENGTH = 15


def smooth_mode(q, alpha, contact_modulus, period):
    """Return the Fourier mode of the displacement by a unit force at wave number q > 0: smooth half only, m/N."""
    return 2 / (contact_modulus * q * period**2) * erfc(q / (2 * alpha))


def short_mean(alpha, contact_modulus, period):
    """Return the mean over the cell of the displacement by a unit force: short-ranged half only, m/N."""
    return 2 / (np.sqrt(np.pi) * contact_modulus * alpha * period**2)


def smooth_half(y, moments):
    """Return the sum over k of moments[:, k] Lap^k (erf(x)/x) at y = x^2, where Lap is the plane Laplacian.

    y : (m, n) float, values of (alpha r)^2, or (n,) float for all rows of the moments; moments : (m, 4) float.
    """
    y = np.broadcast_to(y, (len(moments), np.shape(y)[-1]))
    coefficients = np.einsum("mk,kj->mj", moments, _SMOOTH_HALF)
    multipole, gauss, series = np.split(coefficients, [MOMENTS, 3 * MOMENTS - 2], axis=1)
    safe = np.maximum(y, _SERIES_BELOW)
    inverse = 1 / safe
    value = _horner(multipole[:, :, None], inverse)
    value *= erf(np.sqrt(safe))
    value *= np.sqrt(inverse)
    # The polynomial of the Gaussian has powers from -3 to 2.
    factor = _horner(gauss[:, MOMENTS - 1 :, None], safe)
    factor += _horner(gauss[:, MOMENTS - 2 :: -1, None], inverse) * inverse
    factor *= np.exp(-safe)
    value -= factor
    near = np.flatnonzero(y < _SERIES_BELOW)
    if len(near):
        value.ravel()[near] = _horner(series[near // y.shape[1]], y.ravel()[near])
    return value


def _horner(coefficients, x):
    """Return the values of polynomials at x; `coefficients` has the lowest power first along axis 1."""
    value = coefficients[:, -1] * x
    for k in range(coefficients.shape[1] - 2, 0, -1):
        value += coefficients[:, k]
        value *= x
    value += coefficients[:, 0]
    return value


def _smooth_half_table():
    """Return the coefficients of Lap^k (erf(x)/x), k = 0..3 (rows), in powers of y = x^2.

    The columns are the coefficients of (1) the factor of erf(x)/x, y^0 to y^-3, (2) the factor of exp(-y), y^-3 to y^2,
    and (3) the power series of the whole function, from y^0.

    Lap^k (erf(x)/x) = (d_k y^-k) erf(x)/x - exp(-y) g_k(y) with Laurent polynomials g_k. In the plane, Lap y^j is
    4 j^2 y^(j-1), so that d_(k+1) = (2k+1)^2 d_k. The derivative of erf, 2/sqrt(pi) exp(-y), gives the rule for g_k.
    """
    multipole = np.zeros((MOMENTS, MOMENTS))
    gauss = np.zeros((MOMENTS, 2 * MOMENTS - 2))
    zero = MOMENTS - 1
    multipole[0, 0] = 1.0
    for k in range(MOMENTS - 1):
        d, g = multipole[k, k], gauss[k]
        multipole[k + 1, k + 1] = (2 * k + 1) ** 2 * d
        new = gauss[k + 1]
        new[zero - k] += 2 * d * 2 / math.sqrt(math.pi)
        new[zero - k - 1] += (4 * k + 1) * d * 2 / math.sqrt(math.pi)
        for j in range(-k, k):
            new[zero + j - 1] += 4 * j**2 * g[zero + j]
            new[zero + j] -= 4 * (2 * j + 1) * g[zero + j]
            new[zero + j + 1] += 4 * g[zero + j]
    length = _SERIES_LENGTH + MOMENTS
    power = np.arange(length)
    series = [2 / math.sqrt(math.pi) * (-1.0) ** power / ([math.factorial(j) for j in power] * (2 * power + 1))]
    for _ in range(MOMENTS - 1):
        series.append(np.append((4 * power**2 * series[-1])[1:], 0.0))
    return np.hstack([multipole, gauss, np.array(series)[:, :_SERIES_LENGTH]])


_SMOOTH_HALF = _smooth_half_table()
