"""Sections of boundary elements."""

import numpy as np
import pytest
from demo_configuration import LONG_RANGE, TRUTH, file_surface

from icha.configuration.cases import loop_cases, loop_settings, solution_cases, solution_settings
from icha.configuration.errors import ConfigurationError


def test_boundary_elements_turn_where_their_study_does(load):
    loops = {"both": {"study": "one", "seeds": [2], "rms_slopes": [1.0], "separation_step": 0.1}}
    bare = {"materials.soft.surface_energy": "0 mJ/m^2"}
    campaign = load({"studies.one.unload": True, "boundary_element_loops": loops} | bare).campaign
    (case,) = loop_cases(campaign)
    assert case.path == "both/rough/seed2/slope1/soft"
    settings = loop_settings(campaign, case)
    assert settings["largest_reduced_pressure"] == 0.01 and settings["separation_step"] == 0.1


def test_boundary_elements_are_a_product_of_the_studys_lists(load):
    campaign = load({**LONG_RANGE, "finite_range": {"truth": TRUTH | {"rms_slopes": [1.0]}}}).campaign
    cases = solution_cases(campaign)
    assert [case.path for case in cases] == [
        f"truth/rough/seed{seed}/slope1/soft/p{p}" for seed in (1, 2) for p in ("0.003", "0.01")
    ]
    assert solution_settings(campaign, cases[0]) == {
        "material": {"contact_modulus": 25e6, "surface_energy": 0.05, "interaction_range": pytest.approx(120e-9)},
        "rms_slope": 1.0,
        "seed": 1,
        "reduced_pressure": 0.003,
        "refinement": 1,
        "tolerance": 1e-8,
    }


def test_loads_of_boundary_elements_are_snapshots_of_the_runs(load):
    entries = {"coarse": TRUTH, "fine": TRUTH | {"refinement": 2, "reduced_pressures": [0.01, 0.05]}}
    own, loads = ("area_fraction", 0.02), [("reduced_pressure", p) for p in (0.003, 0.01, 0.05)]
    campaign = load({**LONG_RANGE, "finite_range": entries}).campaign
    assert campaign.snapshots_of("one") == [own, *loads]
    # A study that names no snapshot keeps its last state as well, and one that wants none keeps the loads only.
    campaign = load({**LONG_RANGE, "finite_range": entries, "studies.one.snapshots": None}).campaign
    assert campaign.snapshots_of("one") == [("reduced_pressure", 0.01), loads[0], loads[2]]
    campaign = load({**LONG_RANGE, "finite_range": entries, "studies.one.snapshots": []}).campaign
    assert campaign.snapshots_of("one") == loads
    assert load({"studies.one.snapshots": None}).campaign.snapshots_of("one") is None
    campaign = load({**LONG_RANGE, "finite_range": {"truth": TRUTH}, "studies.one.snapshots": "every_stop"}).campaign
    assert campaign.snapshots_of("one") == [("reduced_pressure", p) for p in (1e-3, 0.01, 0.003)]


def test_ranges_are_held_against_the_grid_of_a_surface_file(load, tmp_path):
    np.save(tmp_path / "heights.npy", np.random.default_rng(1).normal(size=(16, 16)))
    changes = {"surfaces.rough": file_surface("heights.npy"), "finite_range": {"truth": TRUTH}}
    changes["confirmed"] = ["surfaces.rough.path"]
    with pytest.raises(ConfigurationError, match=r"truth\.materials: 'soft' on .* spacing 6\.25e-05 m"):
        load(changes)
    assert len(solution_cases(load({**changes, "materials.soft.surface_energy": "0 J/m^2"}).campaign)) == 4
