"""Closed forms of indenters against independent integrals, textbook numbers, limits, and each other."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar
from scipy.special import ellipe, ellipk

from icha import Material
from icha.asperity.jkr import JKR
from icha.references import indentation as closed
from icha.surfaces.shapes import Cone, Sphere, Wave

MODULUS, WORK, RADIUS = 1e6, 0.05, 1e-3
RADII = np.geomspace(2e-6, 2e-4, 9)
CREST, TROUGH = Wave(RADIUS, 2e-7, 1e-5), Wave(RADIUS, -2e-7, 1e-5)


def test_sphere_contact_is_the_jkr_law_of_one_asperity():
    law, found = JKR(Material(MODULUS, WORK, 1e-9)), closed.sphere_contact(RADII, RADIUS, MODULUS, WORK)
    np.testing.assert_allclose(found.force, law.force(RADII, RADIUS), rtol=1e-12)
    np.testing.assert_allclose(found.indentation, law.approach(RADII, RADIUS), rtol=1e-12, atol=1e-20)


def test_hertz_follows_from_the_load():
    # Johnson, Contact Mechanics (1985), eqs. (4.22) and (4.23).
    force = np.array([1e-6, 1e-3])
    a = closed.sphere_radius_at_force(force, RADIUS, MODULUS)
    np.testing.assert_allclose(a, (3 * force * RADIUS / (4 * MODULUS)) ** (1 / 3), rtol=1e-14)
    depth = (9 * force**2 / (16 * RADIUS * MODULUS**2)) ** (1 / 3)
    np.testing.assert_allclose(closed.sphere_contact(a, RADIUS, MODULUS).indentation, depth, rtol=1e-14)
    np.testing.assert_allclose(closed.sphere_radius_at_indentation(depth, RADIUS, MODULUS), a, rtol=1e-14)


def test_radius_at_a_force_or_indentation_is_the_stable_one():
    pull_off, jump_off = (f(RADIUS, MODULUS, WORK) for f in (closed.sphere_pull_off, closed.sphere_jump_off))
    a = float(pull_off.contact_radius) * np.array([1.001, 1.2, 5.0])
    states = closed.sphere_contact(a, RADIUS, MODULUS, WORK)
    np.testing.assert_allclose(closed.sphere_radius_at_force(states.force, RADIUS, MODULUS, WORK), a, rtol=1e-9)
    a = float(jump_off.contact_radius) * np.array([1.001, 1.2, 5.0])
    depth = closed.sphere_contact(a, RADIUS, MODULUS, WORK).indentation
    np.testing.assert_allclose(closed.sphere_radius_at_indentation(depth, RADIUS, MODULUS, WORK), a, rtol=1e-9)
    assert np.isnan(closed.sphere_radius_at_force(1.001 * pull_off.force, RADIUS, MODULUS, WORK))
    assert np.isnan(closed.sphere_radius_at_indentation(1.001 * jump_off.indentation, RADIUS, MODULUS, WORK))
    assert closed.sphere_radius_at_indentation(-1e-9, RADIUS, MODULUS) == 0


CURVES = {
    "sphere": (
        lambda a: closed.sphere_contact(a, RADIUS, MODULUS, WORK),
        closed.sphere_pull_off(RADIUS, MODULUS, WORK),
        closed.sphere_jump_off(RADIUS, MODULUS, WORK),
    ),
    "cone": (
        lambda a: closed.cone_contact(a, 1.5, MODULUS, WORK),
        closed.cone_pull_off(1.5, MODULUS, WORK),
        closed.cone_jump_off(1.5, MODULUS, WORK),
    ),
}


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("quantity", ["force", "indentation"])
def test_contact_breaks_at_the_smallest_force_or_indentation(curve, quantity):
    contact, pull_off, jump_off = CURVES[curve]
    end = pull_off if quantity == "force" else jump_off
    a = float(end.contact_radius)
    lowest = minimize_scalar(
        lambda x: float(getattr(contact(x * a), quantity)), bounds=(0.5, 2), options={"xatol": 1e-10}
    )
    assert lowest.x == pytest.approx(1.0, abs=1e-6)
    np.testing.assert_allclose(end, contact(a), rtol=1e-12)


def test_cone_breaks_off_at_the_force_and_indentation_of_maugis_and_barquins():
    tangent = math.tan(1.5)
    pull_off, jump_off = closed.cone_pull_off(1.5, MODULUS, WORK), closed.cone_jump_off(1.5, MODULUS, WORK)
    assert pull_off.force == pytest.approx(-54 * WORK**2 * tangent**3 / (math.pi * MODULUS), rel=1e-12)
    assert jump_off.indentation == pytest.approx(-WORK * tangent / MODULUS, rel=1e-12)


def test_cone_without_adhesion_has_sneddons_force():
    # F = (2/pi) E* tan(half angle) delta^2.
    states = closed.cone_contact(RADII, 1.2, MODULUS)
    np.testing.assert_allclose(states.force, 2 / np.pi * MODULUS * math.tan(1.2) * states.indentation**2, rtol=1e-13)


@pytest.mark.parametrize(
    ("slope", "contact"),
    [
        (lambda r: r / RADIUS, lambda a: closed.sphere_contact(a, RADIUS, MODULUS, WORK)),
        (Cone(1.4).slope, lambda a: closed.cone_contact(a, 1.4, MODULUS, WORK)),
        (CREST.slope, lambda a: closed.wave_contact(a, CREST, MODULUS, WORK)),
        (TROUGH.slope, lambda a: closed.wave_contact(a, TROUGH, MODULUS, WORK)),
    ],
    ids=["sphere", "cone", "crest", "trough"],
)
def test_closed_forms_are_cases_of_the_general_solution(slope, contact):
    general, special = closed.axisymmetric_contact(RADII, slope, MODULUS, WORK), contact(RADII)
    np.testing.assert_allclose(general.force, special.force, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(general.indentation, special.indentation, rtol=1e-10, atol=1e-17)


def test_exact_sphere_has_the_force_of_sneddon():
    # Sneddon (1965): delta = a/2 ln((R + a)/(R - a)), F = E* ((R^2 + a^2)/2 ln((R + a)/(R - a)) - a R).
    a = RADIUS * np.array([0.05, 0.3, 0.8])
    logarithm = np.log((RADIUS + a) / (RADIUS - a))
    states = closed.axisymmetric_contact(a, Sphere(RADIUS).slope, MODULUS)
    np.testing.assert_allclose(states.indentation, a / 2 * logarithm, rtol=1e-12)
    np.testing.assert_allclose(states.force, MODULUS * ((RADIUS**2 + a**2) / 2 * logarithm - a * RADIUS), rtol=1e-11)


@pytest.mark.parametrize("wave", [CREST, TROUGH])
def test_work_on_wavy_spheres_creates_elastic_energy_and_releases_energy_of_adhesion(wave):
    # Elastic energy U at fixed indentation: load without adhesion up to the radius, then unload as a punch of this
    # radius. The energy U - pi a^2 w must be stationary, so dU/da = 2 pi a w.
    a, depth = 2.34e-5, float(closed.wave_contact(2.34e-5, wave, MODULUS, WORK).indentation)

    def energy(radius):
        def free(x):
            return closed.wave_contact(x, wave, MODULUS)

        def power(x):
            return free(x).force * (free(x * (1 + 1e-6)).indentation - free(x * (1 - 1e-6)).indentation) / (2e-6 * x)

        loaded = free(radius)
        lift = loaded.indentation - depth
        work = quad(power, 0, radius, epsabs=0, epsrel=1e-9, limit=500)[0]
        return work - loaded.force * lift + MODULUS * radius * lift**2

    step = 1e-3 * a
    assert (energy(a + step) - energy(a - step)) / (2 * step) == pytest.approx(2 * math.pi * a * WORK, rel=1e-4)


def test_flat_punch_has_the_stiffness_and_pull_off_force_of_boussinesq_and_kendall():
    assert closed.punch_force(2e-9, 1e-5, MODULUS) == pytest.approx(2 * 1e-5 * MODULUS * 2e-9, rel=1e-14)
    end = closed.punch_pull_off(1e-5, MODULUS, WORK)
    assert end.force == pytest.approx(-math.sqrt(8 * math.pi * MODULUS * WORK * 1e-15), rel=1e-13)
    # Stored energy F^2/(4 a E*) changes by the energy of adhesion: d/da of it at fixed depth, E* delta^2.
    assert MODULUS * end.indentation**2 == pytest.approx(2 * math.pi * 1e-5 * WORK, rel=1e-13)
    assert closed.punch_force(end.indentation, 1e-5, MODULUS) == pytest.approx(end.force, rel=1e-13)


def test_loading_of_a_sphere_starts_with_a_jump_and_unloading_ends_at_the_smallest_value():
    a = np.linspace(1e-8, 3e-4, 30001)
    states = closed.sphere_contact(a, RADIUS, MODULUS, WORK)
    touch = {
        "indentation": 2 * math.pi * WORK * RADIUS**2 / MODULUS,
        "force": 4.5 * math.pi * WORK * RADIUS**2 / MODULUS,
    }
    ends = {"indentation": closed.sphere_jump_off, "force": closed.sphere_pull_off}
    for control, cubed_radius in touch.items():
        loading, unloading = closed.stable_branches(states, control)
        assert a[loading][0] == pytest.approx(cubed_radius ** (1 / 3), abs=2e-8)
        assert a[unloading][0] == pytest.approx(float(ends[control](RADIUS, MODULUS, WORK).contact_radius), abs=2e-8)
        assert np.all(np.diff(np.flatnonzero(loading)) == 1) and np.all(np.diff(np.flatnonzero(unloading)) == 1)
        assert loading[-1] and unloading[-1]


def test_unknown_control_is_refused():
    with pytest.raises(ValueError, match="control: 'load' must be one of indentation, force"):
        closed.stable_branches(closed.sphere_contact(RADII, RADIUS, MODULUS), "load")


def test_waves_make_the_contact_jump_and_raise_the_pull_off_force():
    # Guduru (2007): the pull-off force exceeds that of a smooth sphere; contact advances and recedes in jumps.
    a = np.linspace(1e-7, 2e-4, 40001)
    states = closed.wave_contact(a, CREST, MODULUS, WORK)
    assert (
        states.force[closed.stable_branches(states)[1]].min()
        < 1.5 * closed.sphere_pull_off(RADIUS, MODULUS, WORK).force
    )
    for branch in closed.stable_branches(states):
        on_branch = np.flatnonzero(branch)
        before = np.flatnonzero(np.diff(on_branch) > 1)
        assert len(before) > 3 and np.all(np.diff(a[on_branch])[before] < 1.5 * CREST.wavelength)
        # The indentation rises with the radius and is the same on both sides of a jump.
        rise = np.diff(states.indentation[branch])
        assert np.all(rise > 0) and np.all(rise[before] <= np.max(np.abs(np.diff(states.indentation))))


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
        assert closed.front_response(amplitude, wavelength, MODULUS, angle) == pytest.approx(expected, rel=2e-3)
    integral, _ = quad(lambda y: 1 / (1 + y**2), 0, np.inf, weight="cos", wvar=0.6)
    assert 2 * integral == pytest.approx(math.pi * math.exp(-0.6), rel=1e-8)


def test_response_of_a_front_is_that_of_the_public_code_crackfront():
    # Its tests: E* = 0.75, wavelength 1, amplitude 0.1.
    assert abs(closed.front_response(0.1, 1.0, 0.75, 0.3)) == pytest.approx(0.1329, abs=5e-5)


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
    D, B, C = closed._ellipse_integrals(b / a)
    for x, y in ((0.0, 0.0), (0.7, 0.1), (-0.3, 0.35)):
        X, Y = (x / a) ** 2, (y / b) ** 2
        stated = (
            2 * (B + D) * c[0] - c[1] * (B + (2 * D - C) * X - (B - C) * Y) - c[2] * (D - (D - C) * X + (2 * B - C) * Y)
        )
        assert displacement(x, y, a, b, *c) == pytest.approx(b * stated, rel=1e-8)


def test_hertz_ellipse_of_equal_radii_is_the_circle_and_lies_along_the_larger_radius():
    force = np.array([1e-5, 1e-3])
    circle = closed.elliptic_hertz_contact(force, (RADIUS, RADIUS), MODULUS)
    a = closed.sphere_radius_at_force(force, RADIUS, MODULUS)
    np.testing.assert_allclose(circle.semi_axes, [a, a], rtol=1e-12)
    np.testing.assert_allclose(circle.indentation, a**2 / RADIUS, rtol=1e-12)
    ellipse = closed.elliptic_hertz_contact(force, (RADIUS, 3 * RADIUS), MODULUS)
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
    state = closed.elliptic_hertz_contact(1e-3, radii, MODULUS)
    c = elliptic_pressure(state, radii)
    # All three equal the largest pressure of Hertz, 3 F/(2 pi a b).
    np.testing.assert_allclose(c, 1.5e-3 / (math.pi * state.semi_axes[0] * state.semi_axes[1]), rtol=1e-6)


@pytest.mark.parametrize("g", [0.01, 0.3, 0.999])
def test_integrals_of_the_ellipse_are_complete_elliptic_integrals(g):
    # K = B + D and E = K - k^2 D.
    D, B, _ = closed._ellipse_integrals(g)
    assert B + D == pytest.approx(ellipk(1 - g**2), rel=1e-12)
    assert B + D - (1 - g**2) * D == pytest.approx(ellipe(1 - g**2), rel=1e-12)


@pytest.mark.parametrize("ratio", [1.2, 3.0])
def test_ellipse_of_johnson_and_greenwood_has_the_energy_release_rate_at_the_ends_of_its_axes(ratio):
    radii = (ratio * RADIUS, RADIUS)
    g = 0.4 * closed._hertz_axis_ratio(ratio) + 0.6
    state = closed.elliptic_jkr_contact(g, radii, MODULUS, WORK, "axes")
    (a, b), c = state.semi_axes, elliptic_pressure(state, radii)
    assert b / a == pytest.approx(g, rel=1e-12)
    tension = [(c[1] - c[0]) * math.sqrt(math.pi * a), (c[2] - c[0]) * math.sqrt(math.pi * b)]
    np.testing.assert_allclose(np.square(tension) / (2 * MODULUS), WORK, rtol=1e-6)
    assert min(tension) > 0
    assert float(state.force) == pytest.approx(math.pi * a * b * (2 * c[0] - (c[1] + c[2]) * 2 / 3), rel=1e-6)


@pytest.mark.parametrize("ratio", [1.2, 3.0])
def test_energy_of_the_ellipse_of_giudici_is_stationary(ratio):
    radii = (ratio * RADIUS, RADIUS)
    g = 0.4 * closed._hertz_axis_ratio(ratio) + 0.6
    state = closed.elliptic_jkr_contact(g, radii, MODULUS, WORK)

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
    pull_off = closed.elliptic_pull_off((1.002 * RADIUS, RADIUS), MODULUS, WORK, criterion)
    circle = closed.sphere_pull_off(1.001 * RADIUS, MODULUS, WORK)
    assert float(pull_off.force) == pytest.approx(circle.force, rel=1e-5)
    assert float(pull_off.indentation) == pytest.approx(circle.indentation, rel=1e-3)
    radii = (3 * RADIUS, RADIUS)
    hertz = closed._hertz_axis_ratio(3.0)
    loaded = closed.elliptic_jkr_contact(hertz + 1e-5, radii, MODULUS, WORK, criterion)
    bare = closed.elliptic_hertz_contact(loaded.force, radii, MODULUS)
    np.testing.assert_allclose(loaded.semi_axes, bare.semi_axes, rtol=1e-2)
    assert float(loaded.indentation) == pytest.approx(float(bare.indentation), rel=1e-2)


@pytest.mark.parametrize("criterion", ["energy", "axes"])
def test_pull_off_force_of_an_ellipse_decreases_with_the_ratio_of_its_radii(criterion):
    # Johnson & Greenwood (2005), abstract: it decreases from 3/2 pi w R of spheres, here with R = sqrt(Rx Ry).
    forces = [
        float(closed.elliptic_pull_off((RADIUS * s, RADIUS / s), MODULUS, WORK, criterion).force)
        / closed.sphere_pull_off(RADIUS, MODULUS, WORK).force
        for s in (1.05, 1.2, 1.5, 2.0, 3.0)
    ]
    assert forces[0] < 1 and np.all(np.diff(forces) < 0)


def test_unknown_criterion_of_an_ellipse_is_refused():
    with pytest.raises(ValueError, match="criterion: 'area' must be one of energy, axes"):
        closed.elliptic_jkr_contact(0.9, (2.0, 1.0), MODULUS, WORK, "area")


def test_radii_too_different_for_an_ellipse_are_refused():
    with pytest.raises(ValueError, match=r"radii: their ratio 1e\+06 is too large"):
        closed.elliptic_hertz_contact(1e-3, (1e6, 1.0), MODULUS)
