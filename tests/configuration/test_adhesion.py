"""Works of adhesion by direction and place in a configuration."""

import pytest

import icha
from icha.configuration.cases import run_cases, run_settings

ENERGY = "materials.soft.surface_energy"
BY_CELLS = {"studies.one.models": ["boundary_elements"]}
PATCHES = {"mean": "30 mJ/m^2", "standard_deviation": "10 mJ/m^2", "correlation_length": "10 um", "seed": 3}
STRIPES = {"low": "10 mJ/m^2", "high": "50 mJ/m^2", "width": "5 um"}


def material_of(campaign):
    return icha.Material(**run_settings(campaign, run_cases(campaign)[0])["material"])


def test_works_of_adhesion_reach_the_material_of_a_run(load):
    two = material_of(load(BY_CELLS | {ENERGY: {"advancing": "30 mJ/m^2", "receding": "90 mJ/m^2"}}).campaign)
    assert two.surface_energy == pytest.approx(0.03) and two.receding_energy == pytest.approx(0.09)
    stripes = material_of(load(BY_CELLS | {ENERGY: {"stripes": STRIPES}}).campaign)
    assert stripes.surface_energy == pytest.approx(0.03) and stripes.adhesion_map == icha.Stripes(0.01, 0.05, 5e-6)
    both = {"advancing": {"patches": PATCHES}, "receding": "90 mJ/m^2"}
    patches = material_of(load(BY_CELLS | {ENERGY: both}).campaign)
    assert patches.adhesion_map == icha.Patches(0.03, 0.01, 1e-5, 3) and patches.receding_energy == pytest.approx(0.09)


@pytest.mark.parametrize(
    ("energy", "message"),
    [
        ({"advancing": "30 mJ/m^2"}, "surface_energy: has advancing; expected one value"),
        ({"advancing": "30 mJ/m^2", "receding": "20 mJ/m^2"}, "receding 0.02 J/m^2; expected 0 < advancing"),
        ({"advancing": "0 J/m^2", "receding": "20 mJ/m^2"}, "advancing 0 J/m^2"),
        ({"stripes": STRIPES | {"low": "60 mJ/m^2"}}, "low: 0.06 J/m^2, and high 0.05 J/m^2; expected 0 < low"),
        ({"stripes": STRIPES | {"width": "7 um"}}, "does not divide the period"),
        ({"patches": PATCHES | {"correlation_length": "1 mm"}}, "to a quarter of the side"),
    ],
)
def test_works_of_adhesion_that_do_not_fit_are_refused(refused, energy, message):
    refused("", BY_CELLS | {ENERGY: energy}, message)


def test_asperities_have_one_work_of_adhesion(refused):
    for energy in ({"advancing": "30 mJ/m^2", "receding": "90 mJ/m^2"}, {"stripes": STRIPES}):
        refused("", {ENERGY: energy}, "'asperities' have one work of adhesion, but 'soft' has several")
