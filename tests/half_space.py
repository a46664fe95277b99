"""Independent contact mechanics to which tests compare the package.

Lengths, loads and moduli in any consistent units; `adhesion` is surface energy over contact modulus.
"""

import functools
import itertools

import numpy as np
import scipy.integrate
import scipy.special

from icha import Material
from icha.asperity.jkr import JKR

# Three spots in a unit cell, without adhesion and with so much of it that all of them are in tension.
MODULUS, RANGE = 2.0, 1e-3
CENTRES = np.array([[0.2, 0.3], [0.6, 0.55], [0.9, 0.85]])
RADIUS = np.array([0.02, 0.03, 0.015])
CURVATURE = np.array([0.5, 0.8, 0.3])
ENERGIES = [0.0, 3e-4]


def law(energy):
    return JKR(Material(MODULUS, energy, RANGE))


def jkr_force(a, R, modulus, energy):
    return 4 * modulus * a**3 / (3 * R) - np.sqrt(8 * np.pi * modulus * energy * a**3)


def jkr_approach(a, R, modulus, energy):
    return a**2 / R - np.sqrt(2 * np.pi * a * energy / modulus)


def displacement_by_quadrature(r, a, R, modulus, energy):
    """Displacement at distance r from a spot: its pressure integrated ring by ring.

    A ring of radius s and unit line load displaces the half-space by 4 s K(m) / (pi E* (r + s)), m = 4 r s/(r + s)^2.
    With s = a sin(t) the edge of the pressure is regular; the logarithm at s = r is a break point.
    """
    peak = 2 * modulus * a / (np.pi * R)
    neck = np.sqrt(2 * modulus * energy / (np.pi * a))

    def ring(t):
        s = a * np.sin(t)
        missing = ((r - s) / (r + s)) ** 2  # 1 - m without cancellation
        load = (peak * np.cos(t) ** 2 - neck) * a  # p(s) ds
        return load * 4 * s / (r + s) * scipy.special.ellipkm1(missing)

    edges = [0.0, np.pi / 2] if r >= a else [0.0, np.arcsin(r / a), np.pi / 2]
    total = 0.0
    for low, high in itertools.pairwise(edges):
        if high > low:
            total += scipy.integrate.quad(ring, low, high, epsabs=0, epsrel=1e-11, limit=400)[0]
    return total / (np.pi * modulus)


def _square(x, y):
    """Integral of 1/r over the rectangle from the origin to (x, y), x and y positive."""
    r = np.hypot(x, y)
    return x * np.log((y + r) / x) + y * np.log((x + r) / y)


def _partial_sum(x, y, count):
    k = np.arange(-count, count + 1)
    r = np.hypot(x - k[:, None], y - k[None, :])
    if x == 0 and y == 0:
        r[count, count] = np.inf
    h = count + 0.5
    background = sum(_square(h + sx * x, h + sy * y) for sx in (-1, 1) for sy in (-1, 1))
    return np.sum(1 / r) - background


@functools.cache
def periodic_point_load(x, y, count=24):
    """Sum of 1/r over all images of a unit cell less the uniform background; at the origin without the own 1/r.

    Squares of images with their own squares of background leave an error that falls with odd powers of 1/(2n + 1);
    four squares remove three of them.
    """
    counts = np.array([count, 2 * count, 4 * count, 8 * count])
    sums = [_partial_sum(x, y, n) for n in counts]
    powers = (2.0 * counts[:, None] + 1) ** -np.array([0, 1, 3, 5])
    return np.linalg.solve(powers, sums)[0]


def periodic_displacement(x, y, a, R, modulus, energy, period, own=True):
    """Displacement by one spot and its images, with the uniform counter-pressure: the direct sum.

    The nearest spot acts with its whole pressure, the images by force and second moment; the next term is of order
    (a/L)^4 of theirs. `own` False leaves the nearest spot out.
    """
    x, y = x - period * np.rint(x / period), y - period * np.rint(y / period)
    r = np.hypot(x, y)
    repulsive, adhesive = jkr_force(a, R, modulus, 0.0), -jkr_force(a, np.inf, modulus, energy)
    force = repulsive - adhesive
    # Half the pressure's second moment about an axis: a^2/5 and a^2/3 are the mean squares of x.
    moment = 0.5 * (repulsive * a**2 / 5 - adhesive * a**2 / 3)
    psi = periodic_point_load(x / period, y / period) - (period / r if r > 0 else 0.0)
    # Laplacian of the images' field by finite differences of the smooth remainder.
    step = 0.02 * period

    def smooth(dx, dy):
        rr = np.hypot(x + dx, y + dy)
        value = periodic_point_load((x + dx) / period, (y + dy) / period, 12)
        return value - (period / rr if rr > 0 else 0.0)

    ring = sum(smooth(dx, dy) for dx, dy in ((step, 0), (-step, 0), (0, step), (0, -step)))
    laplacian = (ring - 4 * smooth(0.0, 0.0)) / step**2
    w = (force * psi + moment * laplacian) / (np.pi * modulus * period)
    return w + (displacement_by_quadrature(r, a, R, modulus, energy) if own else 0.0)


def spectral_displacement(centres, a, R, modulus, energy, period, grid):
    """Displacement (grid, grid) by spots, from the Fourier transforms of their pressures on a regular grid.

    The series is cut off smoothly by a filter without moments below the tenth, which leaves the displacement unchanged
    where it is smooth on the scale of some twenty cells: away from the spots' edges.
    """
    k = 2 * np.pi / period
    qy, qx = k * np.fft.fftfreq(grid, 1 / grid)[:, None], k * np.fft.rfftfreq(grid, 1 / grid)[None, :]
    q = np.hypot(qy, qx)
    q[0, 0] = 1.0
    pressure = np.zeros(q.shape, dtype=complex)
    for (x, y), a_j, R_j in zip(centres, a, R, strict=True):
        z = q * a_j
        hertz = 3 * scipy.special.spherical_jn(1, z) / z
        punch = scipy.special.spherical_jn(0, z)
        repulsive, adhesive = jkr_force(a_j, R_j, modulus, 0.0), -jkr_force(a_j, np.inf, modulus, energy)
        pressure += (repulsive * hertz - adhesive * punch) * np.exp(-1j * (qx * x + qy * y))
    half = (q * 8.5 / (np.pi * grid / period)) ** 2 / 2
    terms = [half**0, half, half**2 / 2, half**3 / 6, half**4 / 24]
    w = 2 * pressure / (modulus * q * period**2) * np.exp(-half) * sum(terms)
    w[0, 0] = 0.0
    return np.fft.irfft2(w, s=(grid, grid)) * grid**2


def spot_of_asperity(state):
    """Index of the spot to which each asperity belongs; -1 out of contact."""
    index = np.full(len(state.sites) + 1, -1)
    index[state.contact_index] = np.arange(len(state.spots))
    return index[state.site_of_asperity]


def all_pairs(position, period):
    """All ordered pairs of points and their distances in the periodic cell."""
    first, second = np.nonzero(~np.eye(len(position), dtype=bool))
    d = position[first] - position[second]
    return first, second, np.hypot(*(d - period * np.rint(d / period)).T)
