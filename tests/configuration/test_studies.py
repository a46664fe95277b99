"""Section `studies`."""

import pytest
from demo_configuration import LONG_RANGE, TRUTH

import icha
from icha.configuration.cases import campaign_sha256, run_cases, run_settings

BAD = {
    # key, value, what the message must say of it
    "empty list of materials": ("studies.one.materials", [], "studies.one.materials: [] is empty"),
    "empty list of seeds": ("studies.one.seeds", [], "is empty"),
    "empty list of targets": ("studies.one.targets", {"area_fractions": []}, "is empty"),
    "material twice": ("studies.one.materials", ["soft", "soft"], "'soft' is given twice"),
    "seed twice": ("studies.one.seeds", [1, 1], "1 is given twice"),
    "slope twice": ("studies.one.rms_slopes", [1.0, "1e0"], "1.0 is given twice"),
    "snapshot twice": ("studies.one.snapshots", [{"area_fraction": 0.02}, {"area_fraction": "2e-2"}], "given twice"),
    "unknown surface": ("studies.one.surfaces", ["rouhg"], "'rouhg' is not defined; allowed: rough"),
    "unknown material": ("studies.one.materials", ["hard"], "'hard' is not defined; allowed: soft"),
    "negative seed": ("studies.one.seeds", [-1], "studies.one.seeds[0]: -1 is not an integer from 0"),
    "zero slope": ("studies.one.rms_slopes", [0], "studies.one.rms_slopes[0]: 0 is out of range"),
    "infinite slope": ("studies.one.rms_slopes", [float("inf")], "is not finite"),
    "list that is none": ("studies.one.seeds", 1, "is not a list"),
    "no targets": ("studies.one.targets", {}, "nothing is given; allowed: exactly one"),
    "two lists of targets": (
        "studies.one.targets",
        {"area_fractions": [0.1], "reduced_pressures": [0.1]},
        "area_fractions and reduced_pressures is given; allowed: exactly one",
    ),
    "pressures not increasing": ("studies.one.targets.reduced_pressures", [0.01, 0.01], "in increasing order"),
    "areas not increasing": ("studies.one.targets", {"area_fractions": [0.1, 0.05]}, "0.05 comes after 0.1"),
    "separations not decreasing": (
        "studies.one.targets",
        {"mean_separations": ["1 um", "2 um"]},
        "in decreasing order",
    ),
    "separation without unit": ("studies.one.targets", {"mean_separations": [1e-6]}, "the unit is missing"),
    "negative separation": ("studies.one.targets", {"mean_separations": ["-1 um"]}, "in [1e-24, 1e9] m"),
    "pressure beyond the model": (
        "studies.one.targets.reduced_pressures",
        [0.3],
        "[1e-12, 0.15], where the asperity model holds",
    ),
    "area beyond the model": (
        "studies.one.targets",
        {"area_fractions": [0.5]},
        "[1e-9, 0.25], where the asperity model holds",
    ),
    "zero target": ("studies.one.targets.reduced_pressures", [0, 0.1], "is out of range"),
    "unknown snapshot": ("studies.one.snapshots", [{"area": 0.1}], "studies.one.snapshots[0].area: unknown key"),
    "snapshot of two kinds": (
        "studies.one.snapshots",
        [{"area_fraction": 0.1, "relative_load": 0.1}],
        "exactly one of reduced_pressure, relative_load",
    ),
    "snapshots by another word": (
        "studies.one.snapshots",
        "every",
        "studies.one.snapshots: 'every' is not a choice; allowed: a list of snapshots, or 'every_stop'",
    ),
    "snapshots that are no list": ("studies.one.snapshots", 1, "studies.one.snapshots: 1 is not a list"),
    "load beyond the model": ("studies.one.snapshots", [{"relative_load": 0.1}], "a reduced pressure of 0.5"),
    "unload that is no truth value": ("studies.one.unload", 1, "studies.one.unload: 1 is neither true nor false"),
    "unknown control": ("studies.one.control", "force", "'separation' or 'load'"),
    "load control with areas": (
        "studies.one.control",
        "load",
        "studies.one.control: 'load' with the stop area_fraction = 0.02; allowed: stops and turning points that are",
    ),
    "end of unions": ("studies.one.united_until", "overlap", "united_until: is no longer a choice"),
    "turning point of two kinds": (
        "studies.one.turning_points",
        [{"area_fraction": 0.1, "relative_load": 0.1}],
        "studies.one.turning_points[0]",
    ),
    "unknown turning point": ("studies.one.turning_points", [{"area": 0.1}], "turning_points[0].area: unknown key"),
    "turning point behind": (
        "studies.one.turning_points",
        [{"reduced_pressure": 0.02}],
        "studies.one.turning_points[0].reduced_pressure: 0.02 cannot end unloading that begins at 0.01; allowed: less",
    ),
    "turning point beyond the model": (
        "studies.one.turning_points",
        [{"reduced_pressure": 0}, {"relative_load": 0.1}],
        "studies.one.turning_points[1].relative_load: 0.1 at rms slope 0.2 is a reduced pressure of 0.5",
    ),
    "step too long": ("studies.one.max_step", 0.6, "[1e-4, 0.5]"),
    "range of seeds backwards": ("studies.one.seeds", "5..1", "studies.one.seeds: '5..1' ends before it begins"),
    "range that is none": ("studies.one.seeds", ["1-5"], "'1-5' is no range of seeds; allowed: integers from 0"),
    "seed in a range twice": ("studies.one.seeds", ["1..5", 3], "3 is given twice"),
}


@pytest.mark.parametrize("case", BAD, ids=lambda case: case.replace(" ", "_"))
def test_mistakes_are_named(case, refused):
    refused(*BAD[case])


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
