"""Section `studies`."""

import numpy as np
from demo_configuration import file_surface

import icha
from icha.configuration.cases import campaign_sha256, run_cases, run_settings, run_sha256


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


def test_settings_depend_on_values_not_on_how_they_are_written(load):
    def checksum(campaign):
        return run_sha256(campaign, run_cases(campaign)[0]), campaign_sha256(campaign)

    first = checksum(load().campaign)
    assert checksum(load({"materials.soft.contact_modulus": "25000 kPa", "title": "Other"}).campaign) == first
    assert checksum(load({"materials.soft.contact_modulus": "26 MPa"}).campaign) != first
    assert checksum(load({"studies.one.seeds": [1, 3]}).campaign)[0] == first[0]
    assert checksum(load({"studies.one.seeds": [1, 3]}).campaign)[1] != first[1]


def test_another_file_of_the_same_name_is_another_run(load, tmp_path):
    def checksum():
        campaign = load({"surfaces.rough": file_surface("own.npy"), "confirmed": ["surfaces.rough.path"]}).campaign
        return run_sha256(campaign, run_cases(campaign)[0])

    heights = np.random.default_rng(1).random((16, 16))
    np.save(tmp_path / "own.npy", heights)
    first = checksum()
    np.save(tmp_path / "own.npy", heights)
    assert checksum() == first
    np.save(tmp_path / "own.npy", heights + 1)
    assert checksum() != first


def test_a_map_shows_the_first_run_with_the_requested_labels(load):
    campaign = load({"figures": {"fig4_contact_map": {"study": "one", "seed": 2, "snapshot": {"area_fraction": 0.02}}}})
    arguments = campaign.campaign.figures.fig4_contact_map.arguments(campaign.campaign)
    assert arguments["run"] == ("one", "asperities", "rough", 2, 0.2, "soft")
    assert arguments["kind"] == "area_fraction" and set(arguments) == {"run", "kind", "target"}


def test_snapshots_on_unloading_are_part_of_the_path(load):
    snapshots = [{"area_fraction": 0.01}, {"area_fraction": 0.01, "branch": "unloading"}]
    study = {"studies.one.unload": True, "studies.one.snapshots": snapshots}
    figure = {"figures": {"fig4_contact_map": {"study": "one", "snapshot": snapshots[1]}}}
    campaign = load(study | figure).campaign
    path = run_settings(campaign, run_cases(campaign)[0])["path"]
    assert path["snapshots"] == [("area_fraction", 0.01), ("unloading_area_fraction", 0.01)]
    arguments = campaign.figures.fig4_contact_map.arguments(campaign)
    assert (arguments["kind"], arguments["target"]) == ("unloading_area_fraction", 0.01)
