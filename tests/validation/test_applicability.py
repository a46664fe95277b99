"""The asperity model says where adhesion makes its areas or gaps wrong."""

import math

import pytest

from icha.checks.applicability import asperity_applicability
from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.path.targets import largest_area_fraction
from validation.applicability import COUNT, WRONG_FACTOR, case, largest_factor, press, reference, states

# Numbers of a random surface, a random surface with Gaussian amplitudes and two waves: U_full/dgamma is 1.5, 2.1, 1.4.
STICKY = (20, 31, 53)
# Two waves and an egg box with adhesion; bumps, a scan and ridges without.
RIGHT = (33, 12, 6, 39, 44)


@pytest.mark.parametrize("number", STICKY + RIGHT)
def test_wrong_areas_of_sticky_surfaces_are_marked_and_right_areas_are_not(number):
    _, surface, material = case(number)
    run = press(surface, material, DEFAULT_MODEL, 0.01)
    wrong = largest_factor(states(run), reference(number)) > WRONG_FACTOR
    assert wrong == (number in STICKY) and (not wrong or surface.full_contact_energy > material.adhesion_length)
    assert ("adhesion unites neighbouring spots" in run.attrs["applicability"]) == wrong
    assert wrong or run.attrs["applicability"] == ""


def test_wrong_gaps_without_adhesion_are_marked():
    _, surface, material = case(44)
    run = press(surface, material, DEFAULT_MODEL)
    assert largest_factor(states(run), reference(44)) > 2
    assert "the surfaces overlap beside the spots" in run.attrs["applicability"]


def test_saved_results_are_those_of_boundary_elements():
    _, surface, material = case(52)
    found = states(press(surface, material, REFERENCE_MODEL, 1e-3))
    assert found[1e-3] == pytest.approx(reference(52)[1e-3], rel=1e-5)
    assert all(reference(number) for number in range(COUNT))


def test_the_limit_of_the_area_grows_with_the_energy_of_full_contact():
    assert largest_area_fraction(2.0) == pytest.approx(0.04)
    assert asperity_applicability(2.0, contact_area_fraction=0.039) == ""
    assert "A/A0 = 0.041, more than 0.04: adhesion" in asperity_applicability(2.0, contact_area_fraction=0.041)
    assert asperity_applicability(math.inf, contact_area_fraction=0.3) == ""
