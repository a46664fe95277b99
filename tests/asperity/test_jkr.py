"""The law of one asperity against closed forms, published reference points, quadrature, and the equations of Maugis."""

import numpy as np
import pytest
import scipy.integrate
import scipy.optimize
from half_space import displacement_by_quadrature

from icha import Material
from icha.asperity.jkr import JKR
from icha.asperity.tabor import describe_short_range, sphere_pull_off_factor

MODULUS, ENERGY, RANGE = 25e6, 0.05, 2.071e-9
R = 60.1e-9


@pytest.fixture
def law():
    return JKR(Material(MODULUS, ENERGY, RANGE))


@pytest.fixture
def hertz():
    return JKR(Material(MODULUS, 0.0, RANGE))


@pytest.fixture(params=[0.0, ENERGY], ids=["hertz", "jkr"])
def both(request):
    return JKR(Material(MODULUS, request.param, RANGE))


def units(radius):
    """Units of contact radius, approach and force in which one JKR curve serves all spots."""
    length = ENERGY / MODULUS
    return np.cbrt(length * radius**2), np.cbrt(length**2 * radius), ENERGY * radius


# Written in closed form: with a = x^2, delta = x^4 - sqrt(2 pi) x and F = 4 x^6/3 - sqrt(8 pi) x^3 in these units.
REFERENCE_POINTS = {
    "jump-off": ((np.pi / 8) ** (1 / 3), -0.75 * np.pi ** (2 / 3), -5 * np.pi / 6, (0.732296, -1.608772)),
    "load-control pull-off": ((9 * np.pi / 8) ** (1 / 3), None, -3 * np.pi / 2, (1.523237, -0.773417)),
    "no approach": ((2 * np.pi) ** (1 / 3), 0.0, -4 * np.pi / 3, (1.845270, 0.0)),
    "no force": ((4.5 * np.pi) ** (1 / 3), None, 0.0, (2.417988, 1.948889)),
}


@pytest.mark.parametrize("point", REFERENCE_POINTS)
@pytest.mark.parametrize("radius", [R, 1e-3])
def test_reference_points(law, point, radius):
    a_unit, delta_unit, force_unit = units(radius)
    a, delta, force, printed = REFERENCE_POINTS[point]
    if delta is None:
        delta = a**2 - np.sqrt(2 * np.pi * a)
    assert (a, delta) == pytest.approx(printed, abs=6e-7)
    assert law.force(a * a_unit, radius) / force_unit == pytest.approx(force, rel=1e-12, abs=1e-12)
    assert law.approach(a * a_unit, radius) / delta_unit == pytest.approx(delta, rel=1e-12, abs=1e-12)
    # At jump-off the root is double: there a rounding error of the approach enters the radius under a square root.
    tolerance = 1e-7 if point == "jump-off" else 1e-12
    assert law.contact_radius(delta * delta_unit, radius) / a_unit == pytest.approx(a, rel=tolerance)


def test_jump_off_is_the_least_approach(law):
    a_unit, delta_unit, _ = units(R)
    found = scipy.optimize.minimize_scalar(
        lambda a: float(law.approach(a * a_unit, R)) / delta_unit, bounds=(0.3, 2), options={"xatol": 1e-10}
    )
    assert law.jump_off_radius(R) / a_unit == pytest.approx(found.x, rel=1e-6)
    assert law.jump_off_approach(R) / delta_unit == pytest.approx(found.fun, rel=1e-12)
    assert law.approach_derivative(law.jump_off_radius(R), R) == pytest.approx(0, abs=1e-12)
    assert law.contact_radius(1.5 * law.jump_off_approach(R), R) == pytest.approx(law.jump_off_radius(R), rel=1e-12)


def test_hertz(hertz):
    delta = np.array([1e-12, 3e-9, 2e-7])
    a = hertz.contact_radius(delta, R)
    np.testing.assert_allclose(a, np.sqrt(R * delta), rtol=1e-12)
    np.testing.assert_allclose(hertz.approach(a, R), delta, rtol=1e-12)
    np.testing.assert_allclose(hertz.force(a, R), 4 / 3 * MODULUS * np.sqrt(R * delta**3), rtol=1e-12)
    peak, neck = hertz.pressure_amplitudes(a, R)
    np.testing.assert_allclose(peak, 1.5 * hertz.force(a, R) / (np.pi * a**2), rtol=1e-12)
    np.testing.assert_array_equal(neck, 0)
    np.testing.assert_array_equal(hertz.contact_radius(np.array([-1e-9, 0.0]), R), 0)
    np.testing.assert_array_equal(hertz.jump_in_approach(np.array([R, 1.0])), 0)


@pytest.mark.parametrize("energy", [0.0, 1e-12, 1e-3, 10.0])
def test_contact_radius_inverts_the_approach_on_the_stable_branch(energy):
    law = JKR(Material(MODULUS, energy, RANGE))
    radii = np.array([1e-9, 1e-6, 1e-2])[:, None]
    lowest = law.jump_off_approach(radii)
    delta = np.concatenate([lowest * f for f in (0.999, 0.5, 1e-6)] + [0.01 * radii * f for f in (1e-9, 1e-3, 1)], 1)
    if energy == 0:
        delta = delta[:, 3:]
    a = law.contact_radius(delta, radii)
    assert np.all(a >= law.jump_off_radius(radii))
    scale = np.maximum(np.abs(delta), np.maximum(-lowest, a**2 / radii))
    np.testing.assert_array_less(np.abs(law.approach(a, radii) - delta) / scale, 1e-13)
    assert np.all(law.approach_derivative(a, radii) > 0)


def test_jump_in_is_wus_formula_between_its_clamps():
    # 2.641 mu^(3/7) with mu = 3: an approach of -3.229 ranges, a gap.
    radius = 27 * RANGE**3 / (ENERGY / MODULUS) ** 2
    law = JKR(Material(MODULUS, ENERGY, RANGE))
    assert law.material.tabor_parameter(radius) == pytest.approx(3, rel=1e-12)
    assert law.jump_in_approach(radius) == pytest.approx((1 - 2.641 * 3 ** (3 / 7)) * RANGE, rel=1e-12)
    assert law.jump_in_approach(radius) / RANGE == pytest.approx(-3.229, abs=5e-4)
    # mu = 0.5: Wu's approach lies below jump-off, and for mu = 0.05 above zero.
    wu = lambda mu: (1 - 2.641 * mu ** (3 / 7)) * RANGE  # noqa: E731
    below, above = radius * (0.5 / 3) ** 3, radius * (0.05 / 3) ** 3
    assert wu(0.5) < law.jump_off_approach(below)
    assert law.jump_in_approach(below) == law.jump_off_approach(below)
    assert wu(0.05) > 0
    assert law.jump_in_approach(above) == 0
    # The two curves cross at mu = 1.065.
    crossing = scipy.optimize.brentq(lambda mu: wu(mu) + 0.75 * np.pi ** (2 / 3) * mu * RANGE, 0.6, 2)
    assert crossing == pytest.approx(1.065, abs=1e-3)


def test_derivatives_by_differences(law):
    a = units(R)[0] * np.array([0.75, 1.0, 3.0, 20.0])
    step = 1e-5 * a
    for function, derivative in (
        (law.force, law.force_derivative),
        (law.approach, law.approach_derivative),
        (law.second_moment, law.second_moment_derivative),
    ):
        difference = (function(a + step, R) - function(a - step, R)) / (2 * step)
        scale = np.abs(difference) + np.abs(function(a, R) / a)
        np.testing.assert_array_less(np.abs(derivative(a, R) - difference) / scale, 1e-8)


def test_force_and_second_moment_are_integrals_of_the_pressure(both):
    law = both
    a = 1.7 * units(R)[0]

    def moment(power):
        # r = a sin(t) makes the edge regular.
        return scipy.integrate.quad(
            lambda t: (
                2 * np.pi * a**2 * np.sin(t) * np.cos(t) * (a * np.sin(t)) ** power * law.pressure(a * np.sin(t), a, R)
            ),
            0,
            np.pi / 2 - 1e-9,
            epsrel=1e-10,
            epsabs=0,
        )[0]

    assert law.force(a, R) == pytest.approx(moment(0), rel=1e-7)
    assert law.second_moment(a, R) == pytest.approx(moment(2) / 4, rel=1e-7)


@pytest.mark.parametrize("relative", [0.3, 0.732296, 1.523237, 2.417988, 40.0])
def test_energy_is_the_work_that_makes_the_spot(both, relative):
    """The integral of the force over the approach from a = 0 includes the unstable branch."""
    law, energy = both, both.material.surface_energy
    a_unit, delta_unit, force_unit = units(R)

    def work(x):  # a = x^2 makes the lower end regular
        a = x**2 * a_unit
        # The derivative of the law itself is infinite at a = 0.
        slope = 4 * x**3 - np.sqrt(2 * np.pi) * (energy > 0)
        return float(law.force(a, R)) / force_unit * slope

    expected = scipy.integrate.quad(work, 0, np.sqrt(relative), epsabs=1e-12, epsrel=1e-12)[0]
    unit = force_unit * delta_unit
    assert law.energy(relative * a_unit, R) / unit == pytest.approx(expected, rel=1e-11, abs=1e-11)
    assert law.energy(0.0, R) == 0


@pytest.mark.parametrize("relative", [0.7, 2.0, 40.0])
def test_displacement_against_quadrature_of_the_pressure(both, relative):
    law, energy = both, both.material.surface_energy
    a = relative * units(R)[0]
    s = np.array([0.0, 0.2, 0.9, 0.999, 1.001, 1.1, 2, 7, 19.9, 20.1, 60])
    expected = np.array([displacement_by_quadrature(r, a, R, MODULUS, energy) for r in s * a])
    np.testing.assert_allclose(law.displacement(s * a, a, R), expected, rtol=1e-10)
    # Under the centre the displacement is the approach; far away that of the force at a point.
    assert law.displacement(0.0, a, R) == pytest.approx(law.approach(a, R), rel=1e-12)
    far = 3e3 * a
    assert law.displacement(far, a, R) == pytest.approx(law.force(a, R) / (np.pi * MODULUS * far), rel=1e-5)


def test_displacement_derivative_by_differences(both):
    law = both
    a = 2 * units(R)[0]
    r = a * np.array([0.1, 0.8, 1.2, 3, 15, 50])
    step = 1e-5 * a
    difference = (law.displacement(r, a + step, R) - law.displacement(r, a - step, R)) / (2 * step)
    np.testing.assert_allclose(law.displacement_derivative(r, np.full(6, a), R), difference, rtol=1e-6)


def test_pressure_distribution_by_counting(both):
    law = both
    a = 1.6 * units(R)[0]
    # Rings of equal area, midpoints: the pressure is monotone in r, so the area below p is off by at most one ring.
    rings = 400_000
    t = (np.arange(rings) + 0.5) / rings
    p = law.pressure(a * np.sqrt(t), a, R)
    top = law.pressure(0.0, a, R)
    for limit in top * np.array([-2.0, -0.3, 0.0, 0.5, 0.97, 1.0, 3.0]):
        area, force = law.pressure_distribution(limit, a, R)
        inside = p <= limit
        assert area == pytest.approx(np.pi * a**2 * np.mean(inside), abs=2 * np.pi * a**2 / rings)
        if limit >= top:
            assert area == pytest.approx(np.pi * a**2, rel=1e-14)
            assert force == pytest.approx(law.force(a, R), rel=1e-12)
        elif law.material.surface_energy == 0:
            expected = np.sum(p[inside]) * np.pi * a**2 / rings
            assert force == pytest.approx(expected, abs=1e-5 * abs(law.force(a, R)))


def exact_pull_off_factor(tabor_parameter):
    """Solve Maugis's equations for the contact radius a at ratios m = c/a of both radii; return the largest tension."""
    parameter = 1.157 * tabor_parameter
    m = 1 + np.geomspace(1e-5, 1e4, 200_001)
    root, angle = np.sqrt(m**2 - 1), np.arctan(np.sqrt(m**2 - 1))
    square = parameter / 2 * (root + (m**2 - 2) * angle)
    linear = 4 / 3 * parameter**2 * (root * angle - m + 1)
    a = (np.sqrt(linear**2 + 4 * square) - linear) / (2 * square)
    return -np.min(a**3 - parameter * a**2 * (root + m**2 * angle))


@pytest.mark.parametrize("tabor_parameter", [0.03, 0.1, 0.344, 1.0, 3.0, 10.0])
def test_pull_off_forces_are_those_of_maugis(tabor_parameter):
    assert sphere_pull_off_factor(tabor_parameter) == pytest.approx(exact_pull_off_factor(tabor_parameter), rel=2e-4)


def test_limits_are_rigid_and_soft_spheres():
    assert sphere_pull_off_factor(1e-6) == pytest.approx(2.0) and sphere_pull_off_factor(1e6) == pytest.approx(1.5)
    assert describe_short_range(3.0) == ""
    # A glass bead of 10 um with 50 mJ/m^2 and a range of 0.5 nm.
    assert "is 1.76 pi dgamma R by the theory of Maugis, 18 % more than for a short range" in describe_short_range(
        0.344
    )
