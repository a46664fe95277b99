"""The model against boundary elements on one paraboloid, where both must agree."""

import numpy as np
import pytest
from half_space import jkr_force

from icha.asperity.material import Material

pytest.importorskip("tamaas", reason="`make tamaas` installs Tamaas")
from validation.one_asperity import MAX_STRENGTH_NUMBER, hertz_asperity, one_asperity, resolving_grid

PERIOD = 10.0


@pytest.fixture(scope="module")
def hertzian():
    return hertz_asperity()


@pytest.mark.parametrize(
    "name", ["zero_gap_area_error", "force_error", "zero_gap_area_error_at_load", "approach_error_at_load"]
)
def test_hertzian_bump_agrees_within_one_percent(hertzian, name):
    np.testing.assert_allclose(hertzian[name], 0, atol=0.01)
    assert hertzian.sizes["given_load"] == 2


@pytest.fixture(scope="module", params=[2.0, pytest.param(3.5, marks=pytest.mark.slow)])
def adhesive(request):
    """A paraboloid with adhesion in compression, in tension and at pull-off, on the coarsest grid that resolves it.

    At the Tabor parameter 3.5 both agree within 3 %; the smaller one is faster and farther from JKR's limit. The area
    is compared with the energetic area, which tends to JKR's: the area of zero gap lacks the cohesive zone, a few per
    cent of the radius.
    """
    return one_asperity(request.param, approaches=[3.0, 1.5], period=PERIOD)


def near_jkr(adhesive):
    return 0.03 if adhesive.tabor_parameter > 3 else 0.08


@pytest.mark.parametrize(
    "name", ["energetic_area_error", "force_error", "energetic_area_error_at_load", "approach_error_at_load"]
)
def test_jkr_bump_agrees(adhesive, name):
    np.testing.assert_allclose(adhesive[name], 0, atol=near_jkr(adhesive))
    assert adhesive.given_load[0] > 0 > adhesive.given_load[1]


def test_jkr_pull_off_force_agrees(adhesive):
    """The largest tension agrees with JKR's 3/2 pi dgamma R."""
    assert max(-adhesive.force_boundary_elements) == pytest.approx(1.5 * np.pi, rel=near_jkr(adhesive))


@pytest.mark.slow
def test_area_of_zero_gap_agrees_within_three_percent_where_the_cohesive_zone_is_narrow():
    """This needs a larger Tabor parameter and a finer grid; the state is nearly free of load."""
    narrow = one_asperity(5.0, approaches=(2.0,), period=8.0, to_pull_off=False)
    for name in ("zero_gap_area_error", "zero_gap_area_error_at_load", "energetic_area_error", "force_error"):
        np.testing.assert_allclose(narrow[name], 0, atol=0.03)


def test_jkr_contact_lies_between_the_zero_gap_and_the_energetic_area(adhesive):
    """In tension, where the effect of the neighbouring cells is small."""
    tension = adhesive.isel(approach=slice(1, None))
    assert np.all(tension.force_boundary_elements < 0) and tension.sizes["approach"] == 2
    assert np.all(tension.zero_gap_area < tension.area_icha)
    assert np.all(tension.area_icha < tension.energetic_area)


def test_the_grid_is_the_coarsest_fast_one_that_resolves_the_range(adhesive):
    """The strength number falls as the root of the spacing; numbers of factors 2, 3 and 5 lie close."""
    assert 0.95 * MAX_STRENGTH_NUMBER < adhesive.strength_number < MAX_STRENGTH_NUMBER
    assert resolving_grid(Material(1.0, 1.0, 1 / 4), 12.0) == 800  # at 768 it is one half


def test_spots_obey_the_law_at_given_approach_and_at_given_load(adhesive, hertzian):
    """Force and area agree with the law, and at given load the force is that of the boundary elements."""
    for one, energy in ((adhesive, 1.0), (hertzian, 0.0)):
        for area, force in ((one.area_icha, one.force_icha), (one.area_icha_at_load, one.given_load)):
            np.testing.assert_allclose(jkr_force(np.sqrt(area / np.pi), 1, 1, energy), force, rtol=1e-6)
