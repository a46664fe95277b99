"""Closed forms of elliptic contacts and of fronts against independent integrals, limits and textbook numbers."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipe, ellipk

from icha.references import indentation as closed
from validation import elliptic_contacts as elliptic

MODULUS, WORK, RADIUS = 1e6, 0.05, 1e-3


def test_response_of_a_front_to_a_wave_is_the_weighted_pressure_of_full_contact():
    # The weight function of a point at distance (x, y), by Rice (1985): sqrt(2 x/pi^3)/(x^2 + y^2).
    amplitude, wavelength = 1e-8, 2e-6
    q = 2 * math.pi / wavelength
    for angle in (0.0, 0.7, -0.7, math.pi / 2):
        along, across = q * math.cos(angle), q * math.sin(angle)
        total = 0
        for part, factor in ((math.cos, 1), (math.sin, 1j)):
            # With x = t^2, and the integral over y done: pi/x exp(-along x) (tested below).
            # A small decay makes the integral across the front converge.
            decay = 1e-3 * q
            value, _ = quad(
                lambda t, part=part, decay=decay, along=along, across=across: (
                    2 * math.sqrt(2 / math.pi) * math.exp(-(along + decay) * t**2) * part(across * t**2)
                ),
                0,
                math.sqrt(40 / (along + decay)) if angle < 1.5 else math.sqrt(12 / decay),
                limit=20000,
                epsrel=1e-8,
            )
            total += factor * value
        expected = -q * MODULUS * amplitude / 2 * total
        assert elliptic.front_response(amplitude, wavelength, MODULUS, angle) == pytest.approx(expected, rel=2e-3)
    integral, _ = quad(lambda y: 1 / (1 + y**2), 0, np.inf, weight="cos", wvar=0.6)
    assert 2 * integral == pytest.approx(math.pi * math.exp(-0.6), rel=1e-8)


def displacement(x, y, a, b, c_0, c_1, c_2):
    """Integrate p/(pi E* r) over the ellipse along chords through (x, y), for E* = 1."""
    angles = (np.arange(400) + 0.5) * np.pi / 400
    cosine, sine = np.cos(angles), np.sin(angles)
    curvature = (cosine / a) ** 2 + (sine / b) ** 2
    middle = -(x * cosine / a**2 + y * sine / b**2) / curvature
    half = np.sqrt(middle**2 + (1 - (x / a) ** 2 - (y / b) ** 2) / curvature)
    s = middle[:, None] + half[:, None] * np.sin((np.arange(60) + 0.5) * np.pi / 60 - np.pi / 2)
    X, Y = ((x + s * cosine[:, None]) / a) ** 2, ((y + s * sine[:, None]) / b) ** 2
    return np.sum((c_0 - c_1 * X - c_2 * Y) / np.sqrt(curvature)[:, None]) * (np.pi / 60) * (np.pi / 400) / np.pi


@pytest.mark.parametrize("c", [(1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0), (1.0, 1.0, 1.0)])
def test_pressures_on_an_ellipse_displace_the_half_space_as_stated(c):
    a, b = 1.3, 0.5
    D, B, C = elliptic._ellipse_integrals(b / a)
    for x, y in ((0.0, 0.0), (0.7, 0.1), (-0.3, 0.35)):
        X, Y = (x / a) ** 2, (y / b) ** 2
        stated = (
            2 * (B + D) * c[0] - c[1] * (B + (2 * D - C) * X - (B - C) * Y) - c[2] * (D - (D - C) * X + (2 * B - C) * Y)
        )
        assert displacement(x, y, a, b, *c) == pytest.approx(b * stated, rel=1e-8)


def test_hertz_ellipse_of_equal_radii_is_the_circle_and_lies_along_the_larger_radius():
    force = np.array([1e-5, 1e-3])
    circle = elliptic.elliptic_hertz_contact(force, (RADIUS, RADIUS), MODULUS)
    a = closed.sphere_radius_at_force(force, RADIUS, MODULUS)
    np.testing.assert_allclose(circle.semi_axes, [a, a], rtol=1e-12)
    np.testing.assert_allclose(circle.indentation, a**2 / RADIUS, rtol=1e-12)
    ellipse = elliptic.elliptic_hertz_contact(force, (RADIUS, 3 * RADIUS), MODULUS)
    # Johnson (1985), eq. (4.28): b/a is close to (R_b/R_a)^(2/3).
    np.testing.assert_allclose(ellipse.semi_axes[0] / ellipse.semi_axes[1], 3 ** (-2 / 3), rtol=0.02)


def elliptic_pressure(state, radii):
    """Solve for c_0, c_1, c_2 so that the ellipse has the shape of the paraboloid at three points."""
    a, b = (float(axis) for axis in state.semi_axes)
    points = [(0.0, 0.0), (0.6 * a, 0.0), (0.0, 0.6 * b)]
    unit = np.array([[displacement(x, y, a, b, *row) for row in np.eye(3)] for x, y in points]) / MODULUS
    shape = [float(state.indentation) - x**2 / (2 * radii[0]) - y**2 / (2 * radii[1]) for x, y in points]
    return np.linalg.solve(unit, shape)


@pytest.mark.parametrize("ratio", [1.2, 8.0])
def test_hertz_ellipse_fits_its_paraboloid(ratio):
    radii = (ratio * RADIUS, RADIUS)
    state = elliptic.elliptic_hertz_contact(1e-3, radii, MODULUS)
    c = elliptic_pressure(state, radii)
    # All three equal the largest pressure of Hertz, 3 F/(2 pi a b).
    np.testing.assert_allclose(c, 1.5e-3 / (math.pi * state.semi_axes[0] * state.semi_axes[1]), rtol=1e-6)


@pytest.mark.parametrize("g", [0.01, 0.3, 0.999])
def test_integrals_of_the_ellipse_are_complete_elliptic_integrals(g):
    # K = B + D and E = K - k^2 D.
    D, B, _ = elliptic._ellipse_integrals(g)
    assert B + D == pytest.approx(ellipk(1 - g**2), rel=1e-12)
    assert B + D - (1 - g**2) * D == pytest.approx(ellipe(1 - g**2), rel=1e-12)


@pytest.mark.parametrize("ratio", [1.2, 3.0])
def test_ellipse_of_johnson_and_greenwood_has_the_energy_release_rate_at_the_ends_of_its_axes(ratio):
    radii = (ratio * RADIUS, RADIUS)
    g = 0.4 * elliptic._hertz_axis_ratio(ratio) + 0.6
    state = elliptic.elliptic_jkr_contact(g, radii, MODULUS, WORK, "axes")
    (a, b), c = state.semi_axes, elliptic_pressure(state, radii)
    assert b / a == pytest.approx(g, rel=1e-12)
    tension = [(c[1] - c[0]) * math.sqrt(math.pi * a), (c[2] - c[0]) * math.sqrt(math.pi * b)]
    np.testing.assert_allclose(np.square(tension) / (2 * MODULUS), WORK, rtol=1e-6)
    assert min(tension) > 0
    assert float(state.force) == pytest.approx(math.pi * a * b * (2 * c[0] - (c[1] + c[2]) * 2 / 3), rel=1e-6)


@pytest.mark.parametrize("ratio", [1.2, 3.0])
def test_energy_of_the_ellipse_of_giudici_is_stationary(ratio):
    radii = (ratio * RADIUS, RADIUS)
    g = 0.4 * elliptic._hertz_axis_ratio(ratio) + 0.6
    state = elliptic.elliptic_jkr_contact(g, radii, MODULUS, WORK)

    def energy(a, b):
        # Half the integral of pressure times displacement; means of X, X^2 and X Y over 1/sqrt(1 - X - Y).
        c = elliptic_pressure(state._replace(semi_axes=(a, b)), radii)
        x, y = a**2 / (2 * radii[0]), b**2 / (2 * radii[1])
        force = 2 * c[0] - 2 / 3 * (c[1] + c[2])
        along_x = 2 / 3 * c[0] - 2 / 5 * c[1] - 2 / 15 * c[2]
        along_y = 2 / 3 * c[0] - 2 / 15 * c[1] - 2 / 5 * c[2]
        elastic = math.pi * a * b / 2 * (float(state.indentation) * force - x * along_x - y * along_y)
        return elastic - WORK * math.pi * a * b

    a, b = state.semi_axes
    step = 1e-4
    for da, db in ((step * a, 0), (0, step * b)):
        change = (energy(a + da, b + db) - energy(a - da, b - db)) / (2 * step)
        assert abs(change) < 1e-5 * WORK * math.pi * a * b
    c = elliptic_pressure(state, radii)
    assert float(state.force) == pytest.approx(math.pi * a * b * (2 * c[0] - (c[1] + c[2]) * 2 / 3), rel=1e-6)
    assert c[0] < min(c[1:])


@pytest.mark.parametrize("criterion", ["energy", "axes"])
def test_elliptic_jkr_contact_tends_to_the_circle_and_to_hertz(criterion):
    pull_off = elliptic.elliptic_pull_off((1.002 * RADIUS, RADIUS), MODULUS, WORK, criterion)
    circle = closed.sphere_pull_off(1.001 * RADIUS, MODULUS, WORK)
    assert float(pull_off.force) == pytest.approx(circle.force, rel=1e-5)
    assert float(pull_off.indentation) == pytest.approx(circle.indentation, rel=1e-3)
    radii = (3 * RADIUS, RADIUS)
    hertz = elliptic._hertz_axis_ratio(3.0)
    loaded = elliptic.elliptic_jkr_contact(hertz + 1e-5, radii, MODULUS, WORK, criterion)
    bare = elliptic.elliptic_hertz_contact(loaded.force, radii, MODULUS)
    np.testing.assert_allclose(loaded.semi_axes, bare.semi_axes, rtol=1e-2)
    assert float(loaded.indentation) == pytest.approx(float(bare.indentation), rel=1e-2)
