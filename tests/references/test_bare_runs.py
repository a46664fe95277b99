"""Ciavarella's estimate of adhesive contact from contact without adhesion."""

import numpy as np
import pytest

from icha.references.bare_runs import ciavarella_states

RADIUS, LENGTH, AREA = 1e-3, 2e-8, 1e-6


@pytest.mark.parametrize("power", [0.5, 0.8])
def test_for_a_sphere_the_estimate_is_jkr(power):
    """Hertz in, JKR out, for two spacings of the states: force, area and indentation."""
    indentation = 1e-6 * np.linspace(0.3, 1, 60) ** power
    radius = np.sqrt(RADIUS * indentation)
    load = 4 / 3 * radius**3 / RADIUS / AREA
    area = np.pi * radius**2 / AREA
    states = ciavarella_states(load, area, -indentation, LENGTH)
    a = np.sqrt(states.area_fraction * AREA / np.pi)
    jkr = (4 / 3 * a**3 / RADIUS - np.sqrt(8 * np.pi * LENGTH * a**3)) / AREA
    inside = slice(3, -3)  # derivatives at the ends of a fit are inaccurate
    np.testing.assert_allclose(states.relative_load[inside], jkr[inside], atol=2e-3 * load.max())
    delta = a**2 / RADIUS - np.sqrt(2 * np.pi * LENGTH * a)
    np.testing.assert_allclose(-states.separation[inside], delta[inside], atol=2e-3 * indentation.max())


def test_without_adhesion_nothing_changes_and_few_states_are_too_few():
    separation = np.linspace(1e-6, 1e-7, 20)
    load = 1e-3 * np.exp(-separation / 3e-7)
    states = ciavarella_states(load, 0.5 * load, separation, 0.0)
    np.testing.assert_allclose(states.relative_load, load, rtol=1e-12)
    np.testing.assert_allclose(states.separation, separation, rtol=1e-12)
    assert ciavarella_states(load[:9], load[:9], separation[:9], 1e-9) is None
