"""Sections of boundary elements."""

import numpy as np
import pytest
from demo_configuration import LONG_RANGE, TRUTH, file_surface, measured_surface

from icha.configuration.cases import loop_cases, loop_settings, solution_cases, solution_settings
from icha.configuration.errors import ConfigurationError

BAD = {
    # key, value, what the message must say of it
    "loops of a study that does not come back": (
        "boundary_element_loops",
        {"both": {"study": "one"}},
        "boundary_element_loops.both.study: 'one' does not unload after its targets",
    ),
    "loops of no study": ("boundary_element_loops", {"both": {"study": "two"}}, "'two' is not defined; allowed: one"),
    "boundary elements of no study": (
        "finite_range",
        {"truth": {"study": "two", "reduced_pressures": [0.01]}},
        "finite_range.truth.study: 'two' is not defined; allowed: one",
    ),
    "boundary elements of another material": (
        "finite_range",
        {"truth": {"study": "one", "materials": ["hard"], "reduced_pressures": [0.01]}},
        "finite_range.truth.materials[0]: 'hard' is not in study 'one'; allowed: soft",
    ),
    "boundary elements of another seed": (
        "finite_range",
        {"truth": {"study": "one", "seeds": [3], "reduced_pressures": [0.01]}},
        "finite_range.truth.seeds[0]: 3 is not in study 'one'; allowed: 1, 2",
    ),
    "former name of the section": ("boundary_elements", {"truth": TRUTH}, "boundary_elements: is now `finite_range`"),
    "boundary elements without loads": (
        "finite_range",
        {"truth": {"study": "one"}},
        "finite_range.truth.reduced_pressures: the key is missing",
    ),
    "refinement beyond any memory": (
        "finite_range",
        {"truth": {"study": "one", "reduced_pressures": [0.01], "refinement": 100}},
        "finite_range.truth.refinement: 100 is not an integer from 1 to 16",
    ),
    "unknown key of boundary elements": (
        "finite_range",
        {"truth": {"study": "one", "reduced_pressures": [0.01], "refine": 2}},
        "finite_range.truth.refine: unknown key (did you mean 'refinement'?)",
    ),
    "range that the grid does not resolve": (
        "finite_range",
        {"truth": {"study": "one", "reduced_pressures": [0.01]}},
        "finite_range.truth.materials: 'soft' on surface 'rough': a range of 2.071e-09 m is not resolved",
    ),
    "sources of the error": ("error_sources", {"why": {"study": "one"}}, "error_sources: is no longer a section"),
    "one asperity": ("one_asperity", {"tabor_parameters": [2]}, "one_asperity: is no longer a section"),
    "tolerance that cannot be reached": (
        "finite_range",
        {"truth": {"study": "one", "reduced_pressures": [0.01], "tolerance": 1e-20}},
        "finite_range.truth.tolerance: 1e-20 is out of range; allowed: a number in [1e-12, 1e-4]",
    ),
    "boundary elements beyond any memory": (
        "",
        {
            "surfaces.rough.grid": 8192,
            "finite_range": {"truth": {"study": "one", "reduced_pressures": [0.01], "refinement": 16}},
        },
        "finite_range.truth.refinement: 16 gives 131072 nodes a side on 'rough'; allowed: 32768 at most",
    ),
}


@pytest.mark.parametrize("case", BAD, ids=lambda case: case.replace(" ", "_"))
def test_mistakes_are_named(case, refused):
    refused(*BAD[case])


def test_boundary_elements_turn_where_their_study_does(load):
    loops = {"both": {"study": "one", "seeds": [2], "rms_slopes": [1.0], "separation_step": 0.1}}
    bare = {"materials.soft.surface_energy": "0 mJ/m^2"}
    campaign = load({"studies.one.unload": True, "boundary_element_loops": loops} | bare).campaign
    (case,) = loop_cases(campaign)
    assert case.path == "both/rough/seed2/slope1/soft"
    settings = loop_settings(campaign, case)
    assert settings["largest_reduced_pressure"] == 0.01 and settings["separation_step"] == 0.1


def test_entries_and_compared_studies_have_names_of_their_own(load):
    changes = {**LONG_RANGE, "finite_range": {"one": TRUTH}}
    assert load(changes).campaign.finite_range
    with pytest.raises(ConfigurationError, match=r"finite_range\.one: 'one' is the name of a study that has"):
        load({**changes, "studies.one.models": ["asperities", "boundary_elements"]})


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


def test_boundary_elements_are_periodic(load):
    changes = {"surfaces.rough": measured_surface(boundary="free"), "finite_range": {"truth": TRUTH}}
    with pytest.raises(ConfigurationError, match=r"finite_range\.truth\.study: 'one' has a surface without periods"):
        load({**changes, "materials.soft.surface_energy": "0 J/m^2"})


def test_ranges_are_held_against_the_grid_of_a_surface_file(load, tmp_path):
    np.save(tmp_path / "heights.npy", np.random.default_rng(1).normal(size=(16, 16)))
    changes = {"surfaces.rough": file_surface("heights.npy"), "finite_range": {"truth": TRUTH}}
    with pytest.raises(ConfigurationError, match=r"truth\.materials: 'soft' on .* spacing 6\.25e-05 m"):
        load(changes)
    assert len(solution_cases(load({**changes, "materials.soft.surface_energy": "0 J/m^2"}).campaign)) == 4
