"""Closed forms of indenters against independent integrals, textbook numbers, limits, and each other."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

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
    # Without adhesion, Sneddon: F = (2/pi) E* tan(half angle) delta^2.
    states = closed.cone_contact(RADII, 1.2, MODULUS)
    np.testing.assert_allclose(states.force, 2 / np.pi * MODULUS * math.tan(1.2) * states.indentation**2, rtol=1e-13)


@pytest.mark.parametrize(
    ("slope", "contact"),
    [
        (lambda r: r / RADIUS, lambda a: closed.sphere_contact(a, RADIUS, MODULUS, WORK)),
        (Cone(1.4).slope, lambda a: closed.cone_contact(a, 1.4, MODULUS, WORK)),
    ],
    ids=["sphere", "cone"],
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
    a, depth = 2.34e-5, float(closed.axisymmetric_contact(2.34e-5, wave.slope, MODULUS, WORK).indentation)

    def energy(radius):
        def free(x):
            return closed.axisymmetric_contact(x, wave.slope, MODULUS)

        def power(x):
            return free(x).force * (free(x * (1 + 1e-6)).indentation - free(x * (1 - 1e-6)).indentation) / (2e-6 * x)

        loaded = free(radius)
        lift = loaded.indentation - depth
        work = quad(power, 0, radius, epsabs=0, epsrel=1e-9, limit=500)[0]
        return work - loaded.force * lift + MODULUS * radius * lift**2

    step = 1e-3 * a
    assert (energy(a + step) - energy(a - step)) / (2 * step) == pytest.approx(2 * math.pi * a * WORK, rel=1e-4)


def test_flat_punch_has_the_stiffness_and_pull_off_force_of_boussinesq_and_kendall():
    end = closed.punch_pull_off(1e-5, MODULUS, WORK)
    assert end.force == pytest.approx(-math.sqrt(8 * math.pi * MODULUS * WORK * 1e-15), rel=1e-13)
    # Stored energy F^2/(4 a E*) changes by the energy of adhesion: d/da of it at fixed depth, E* delta^2.
    assert MODULUS * end.indentation**2 == pytest.approx(2 * math.pi * 1e-5 * WORK, rel=1e-13)
    assert 2 * 1e-5 * MODULUS * end.indentation == pytest.approx(end.force, rel=1e-13)
