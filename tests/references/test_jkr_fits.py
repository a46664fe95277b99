"""Fits of one branch: exact curves return their work of adhesion; the fit is the lowest minimum."""

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


@pytest.mark.parametrize("work", [0.05, 1e-4, 3.0])
def test_fit_to_an_exact_curve_returns_its_work(work):
    states = stable_states(work)
    fit = fit_work_of_adhesion(states.force, states.contact_radius, RADIUS, MODULUS)
    assert fit == pytest.approx(work, rel=1e-6)
    # Contact of Hertz, and smaller contact as on the first patches of a rough sphere, have no work of adhesion.
    states = stable_states(0.0)
    for excess in (0.0, 0.3):
        force = states.force + excess * states.force.max()
        assert fit_work_of_adhesion(force, states.contact_radius, RADIUS, MODULUS) == 0.0


def cubed_radius(work, force):
    unit = 3 * math.pi * work * RADIUS
    return 0.75 * RADIUS / MODULUS * (force + unit + np.sqrt(np.maximum(2 * unit * force + unit**2, 0.0)))


def misfit(work, force, data):
    return np.mean((cubed_radius(work, force) - data) ** 2)


def test_fit_is_a_minimum_of_the_squared_differences_of_cubed_radii():
    rng, states = np.random.default_rng(2), stable_states(0.05, smallest=1.5)
    a = np.asarray(states.contact_radius) * (1 + 0.02 * rng.standard_normal(30))
    fit = fit_work_of_adhesion(states.force, a, RADIUS, MODULUS)
    least = misfit(fit, states.force, a**3)
    assert misfit(1.001 * fit, states.force, a**3) > least < misfit(0.999 * fit, states.force, a**3)


def test_fit_is_the_lowest_of_several_minima():
    """As on rough spheres, the contact is smaller in tension than that of a smooth sphere with the same pull-off."""
    part = np.linspace(1, 0, 40)
    force = -1.5 * math.pi * 0.05 * RADIUS * part
    data = cubed_radius(0.05, force) * (1 - 0.3 * part)
    fit = fit_work_of_adhesion(force, np.cbrt(data), RADIUS, MODULUS)
    misfits = [misfit(work, force, data) for work in np.linspace(0.005, 0.1, 3000)]
    assert misfit(fit, force, data) <= min(misfits) * (1 + 1e-6)
