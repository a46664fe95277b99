"""Fits of one branch: exact curves return their parameters; misfits and refused arguments."""

import math

import numpy as np
import pytest

from icha.references import indentation as closed
from icha.references.jkr_fits import fit_work_of_adhesion

MODULUS, RADIUS = 1e6, 1e-3


def stable_states(work, smallest=1.0, largest=6.0):
    """Return states of a JKR sphere between multiples of the contact radius at pull-off."""
    unit = float(closed.sphere_pull_off(RADIUS, MODULUS, max(work, 1e-3)).contact_radius)
    return closed.sphere_contact(unit * np.linspace(smallest, largest, 30), RADIUS, MODULUS, work)


@pytest.mark.parametrize("quantity", ["contact_radius", "indentation"])
@pytest.mark.parametrize("modulus", [None, MODULUS])
@pytest.mark.parametrize("work", [0.05, 1e-4, 3.0])
def test_fit_to_an_exact_curve_returns_its_parameters(quantity, modulus, work):
    states = stable_states(work)
    fit = fit_work_of_adhesion(states.force, RADIUS, contact_modulus=modulus, **{quantity: getattr(states, quantity)})
    assert fit.work_of_adhesion == pytest.approx(work, rel=1e-5)
    assert fit.contact_modulus == pytest.approx(MODULUS, rel=1e-5)
    assert fit.misfit < 1e-8


@pytest.mark.parametrize("quantity", ["contact_radius", "indentation"])
def test_fit_to_hertz_finds_no_adhesion(quantity):
    states = stable_states(0.0)
    fit = fit_work_of_adhesion(states.force, RADIUS, **{quantity: getattr(states, quantity)})
    assert 1.5 * math.pi * RADIUS * fit.work_of_adhesion < 1e-6 * states.force.max()
    assert fit.contact_modulus == pytest.approx(MODULUS, rel=1e-4)


@pytest.mark.parametrize("modulus", [MODULUS, None])
def test_contact_smaller_than_by_hertz_has_no_work_of_adhesion(modulus):
    """Forces are larger than by Hertz's law, as on the first patches of a rough sphere."""
    states = stable_states(0.0)
    force = states.force + 0.3 * states.force.max()
    fit = fit_work_of_adhesion(force, RADIUS, contact_radius=states.contact_radius, contact_modulus=modulus)
    assert fit.work_of_adhesion == 0.0
    assert fit.contact_modulus == MODULUS if modulus else fit.contact_modulus > 0


def test_fit_is_a_minimum_of_the_squared_differences_of_cubed_radii():
    rng, states = np.random.default_rng(2), stable_states(0.05, smallest=1.5)
    a = np.asarray(states.contact_radius) * (1 + 0.02 * rng.standard_normal(30))
    fit = fit_work_of_adhesion(states.force, RADIUS, contact_radius=a)

    def misfit(work, modulus):
        law = closed.sphere_radius_at_force(states.force, RADIUS, modulus, work)
        return math.sqrt(np.mean((law**3 - a**3) ** 2)) / a.max() ** 3

    least = misfit(fit.work_of_adhesion, fit.contact_modulus)
    assert fit.misfit == pytest.approx(least, rel=1e-9)
    for factor, other in ((1.01, 1), (0.99, 1), (1, 1.01), (1, 0.99)):
        assert misfit(factor * fit.work_of_adhesion, other * fit.contact_modulus) > least


def test_fit_is_the_lowest_of_several_minima():
    """As on rough spheres, the contact is smaller in tension than that of a smooth sphere with the same pull-off."""
    part = np.linspace(1, 0, 40)
    force = -1.5 * math.pi * 0.05 * RADIUS * part

    def cubed_radius(work):
        unit = 3 * math.pi * work * RADIUS
        return 0.75 * RADIUS / MODULUS * (force + unit + np.sqrt(np.maximum(2 * unit * force + unit**2, 0.0)))

    data = cubed_radius(0.05) * (1 - 0.3 * part)
    fit = fit_work_of_adhesion(force, RADIUS, contact_radius=np.cbrt(data), contact_modulus=MODULUS)
    misfits = [
        math.sqrt(np.mean((cubed_radius(work) - data) ** 2)) / data.max() for work in np.linspace(0.005, 0.1, 3000)
    ]
    assert fit.misfit <= min(misfits) * (1 + 1e-6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"force": [1.0, 2.0]}, "contact_radius, indentation: give one of the two"),
        ({"force": [1.0, 2.0], "contact_radius": [1.0]}, "force, contact_radius: must be of the same length"),
        ({"force": [1.0, math.nan], "indentation": [1.0, 2.0]}, "force: must be a list of finite numbers"),
        ({"force": [1.0], "indentation": [1.0], "contact_modulus": 0.0}, "contact_modulus: 0.0 must be"),
    ],
)
def test_invalid_arguments_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        fit_work_of_adhesion(radius=RADIUS, **arguments)
