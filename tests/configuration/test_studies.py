"""Section `studies`."""

from demo_configuration import LONG_RANGE, TRUTH

import icha
from icha.configuration.cases import campaign_sha256, run_cases, run_settings


def test_a_study_is_a_product_of_its_lists(load):
    campaign = load().campaign
    assert [case.path for case in run_cases(campaign)] == [
        "one/rough/seed1/slope0.2/soft",
        "one/rough/seed1/slope1/soft",
        "one/rough/seed2/slope0.2/soft",
        "one/rough/seed2/slope1/soft",
    ]
    settings = run_settings(campaign, run_cases(campaign)[0])
    assert settings["material"] == {"contact_modulus": 25e6, "surface_energy": 0.05, "interaction_range": 2.071e-9}
    assert settings["path"] == {
        "reduced_pressures": [1e-3, 0.01],
        "snapshots": [("area_fraction", 0.02)],
        "max_step": 0.15,
    }


def test_every_stop_is_the_same_as_all_of_them_one_by_one(load):
    areas = [0.01, 0.02, 0.03]
    listed = [{"area_fraction": area} for area in areas]
    one, other = (
        load({"studies.one.targets": {"area_fractions": areas}, "studies.one.snapshots": snapshots}).campaign
        for snapshots in ("every_stop", listed)
    )
    assert run_settings(one, run_cases(one)[0])["path"]["snapshots"] == [("area_fraction", area) for area in areas]
    assert campaign_sha256(one) == campaign_sha256(other)


def test_loads_of_boundary_elements_are_added_to_every_stop(load):
    entry = {"truth": TRUTH}
    campaign = load({**LONG_RANGE, "finite_range": entry, "studies.one.snapshots": "every_stop"}).campaign
    assert campaign.snapshots_of("one") == [("reduced_pressure", p) for p in (1e-3, 0.01, 0.003)]


def test_the_way_back_is_part_of_the_path(load):
    campaign = load(
        {
            "studies.one.unload": True,
            "studies.one.turning_points": [{"reduced_pressure": -1e-3}, {"area_fraction": 0.03}],
        }
    ).campaign
    path = run_settings(campaign, run_cases(campaign)[0])["path"]
    assert path["unload"] is True and path["control"] == "separation"
    assert path["turning_points"] == [("reduced_pressure", -1e-3), ("area_fraction", 0.03)]
    assert icha.Path(**path).turning_points[1].value == 0.03
