"""Works of adhesion by direction and place in a configuration."""

import numpy as np
import pytest

import icha
from icha.configuration.cases import run_settings

ENERGY = "materials.soft.surface_energy"
BY_CELLS = {"studies.one.models": ["boundary_elements"]}
PATCHES = {"mean": "30 mJ/m^2", "standard_deviation": "10 mJ/m^2", "correlation_length": "10 um", "seed": 3}
STRIPES = {"low": "10 mJ/m^2", "high": "50 mJ/m^2", "width": "5 um"}
FILE = {"file": "map.npy", "unit": "mJ/m^2"}
MAP = np.random.default_rng(1).uniform(10, 50, (80, 80))


def material_of(campaign):
    return icha.Material(**run_settings(campaign, campaign.all_runs[0])["material"])


def test_works_of_adhesion_reach_the_material_of_a_run(load):
    for models in (BY_CELLS, {}):
        two = material_of(load(models | {ENERGY: {"advancing": "30 mJ/m^2", "receding": "90 mJ/m^2"}}).campaign)
        assert two.surface_energy == pytest.approx(0.03) and two.receding_energy == pytest.approx(0.09)
        assert two.directed
    stripes = material_of(load(BY_CELLS | {ENERGY: {"stripes": STRIPES}}).campaign)
    assert stripes.surface_energy == pytest.approx(0.03) and stripes.adhesion_map == icha.Stripes(0.01, 0.05, 5e-6)
    both = {"advancing": {"patches": PATCHES}, "receding": "90 mJ/m^2"}
    patches = material_of(load(BY_CELLS | {ENERGY: both}).campaign)
    assert patches.adhesion_map == icha.Patches(0.03, 0.01, 1e-5, 3) and patches.receding_energy == pytest.approx(0.09)


@pytest.mark.parametrize("direction", [False, True])
def test_a_map_in_a_file_is_the_array_in_python(load, tmp_path, direction):
    np.save(tmp_path / "map.npy", MAP)
    energy = {"advancing": FILE, "receding": "90 mJ/m^2"} if direction else FILE
    found = material_of(load(BY_CELLS | {ENERGY: energy}).campaign)
    array = MAP * 1e-3
    assert found == icha.Material(25e6, (array, 0.09) if direction else array, 2.071e-9)


@pytest.mark.parametrize(
    ("energy", "values", "message"),
    [
        (FILE, MAP[:40, :40], "(40, 40) values; expected (80, 80), a value for each node"),
        (FILE, MAP[:40], "the shape (40, 80); expected (n, n)"),
        (FILE, np.where(MAP < 11, np.nan, MAP), "= nan J/m^2; expected positive numbers. Replace"),
        (FILE, MAP - 30, "J/m^2; expected positive numbers. Replace"),
        (FILE, MAP * 1j, "the file is no NumPy array of numbers; expected a file `.npy`"),
        (FILE, np.full(3, None), "the file is no NumPy array of numbers; expected a file `.npy`"),
        (FILE, None, "map.npy' no such file; expected a NumPy file"),
        (FILE | {"unit": "J/m^2"}, MAP, ", the mean of the map; expected 0 or 0.001 mJ/m^2 to 3 J/m^2"),
        (FILE | {"unit": "mN"}, MAP, "expected a unit of a work of adhesion, such as 'mJ/m^2'"),
        ({"file": "map.npy"}, MAP, "has file; expected one of the keys stripes, patches, or the keys file and unit"),
        (FILE | {"stripes": STRIPES}, MAP, "has file, stripes, unit; expected one of the keys"),
        ({"unit": "mJ/m^2"}, MAP, "surface_energy: has unit; expected one value"),
        (FILE | {"file": "a\0b"}, MAP, "contains the control character"),
    ],
)
def test_maps_that_do_not_fit_are_refused(refused, tmp_path, energy, values, message):
    if values is not None:
        np.save(tmp_path / "map.npy", values)
    refused("", BY_CELLS | {ENERGY: energy}, message)
