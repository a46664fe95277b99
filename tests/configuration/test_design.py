"""The runs of a study: lists, defaults, cases, models, varied and sampled parameters; checksums of their settings."""

import numpy as np
import pytest
from demo_configuration import file_surface, measured_surface
from scipy.stats import kstest, lognorm, norm, uniform

import icha
from icha.asperity.material import VAN_DER_WAALS_RANGE
from icha.configuration.cases import campaign_sha256, run_settings, run_sha256, surface_settings
from icha.configuration.design import sampled_parameters, varied_values
from icha.configuration.errors import ConfigurationError
from icha.datasets.labels import inputs_study
from icha.planning.batches import run_batches
from icha.planning.plan import RUNS, plan
from icha.planning.results import campaign_files


def paths(campaign):
    return [case.path.removeprefix("one/") for case in campaign.all_runs]


def test_parameters_are_varied_each_with_each(load):
    vary = {"hurst": [0.6, 0.8], "surface_energy": ["5 mJ/m^2", "0.00001 kJ/m^2"], "grid": 96}
    campaign = load({"studies.one.vary": vary, "studies.one.rms_slopes": [0.2], "studies.one.seeds": [1]}).campaign
    assert paths(campaign) == [
        f"rough-hurst{hurst}-grid96/seed1/slope0.2/soft-surface_energy{energy}"
        for hurst in ("0.6", "0.8")
        for energy in ("5mJ", "10mJ")
    ]
    case = campaign.all_runs[-1]
    assert surface_settings(campaign, case.surface)["hurst"] == 0.8
    assert surface_settings(campaign, case.surface)["grid"] == 96
    assert run_settings(campaign, case)["material"]["surface_energy"] == 0.01
    assert run_settings(campaign, case)["material"]["contact_modulus"] == 25e6


def test_an_explicit_list_of_runs(load):
    cases = [{"seed": 7, "rms_slope": 0.5, "interaction_range": "40 nm"}, {"rms_slope": 1.5}]
    assert paths(load({"studies.one.cases": cases}).campaign) == [
        "rough/seed7/slope0.5/soft-interaction_range40nm",
        "rough/seed1/slope1.5/soft",
        "rough/seed2/slope1.5/soft",
    ]
    whole = {"surface": "rough", "seed": 1, "rms_slope": 0.1, "material": "soft"}
    alone = {"surfaces": None, "seeds": None, "rms_slopes": None, "materials": None, "snapshots": None}
    changes = {f"studies.one.{key}": value for key, value in alone.items()} | {"studies.one.cases": [whole]}
    assert paths(load(changes).campaign) == ["rough/seed1/slope0.1/soft"]


def test_the_preparation_of_a_measured_surface_is_varied(load):
    changes = {
        "surfaces.rough": measured_surface(),
        "studies.one.rms_slopes": "measured",
        "studies.one.vary": {"detrend": ["tilt", "curvature"], "boundary": ["mirror", "free"]},
    }
    cases = load(changes).campaign.all_runs
    assert [case.surface for case in cases] == [
        f"rough-detrend{detrend}-boundary{boundary}"
        for detrend in ("tilt", "curvature")
        for boundary in ("mirror", "free")
    ]
    # A mirror image has the slope of what it is of; a plane is part of a slope, and a paraboloid of another.
    assert len({case.rms_slope for case in cases}) > 1


def test_bodies_give_the_contact_modulus_and_the_ratio_of_a_layer(load):
    rubber = {"youngs_modulus": "2 MPa", "poisson_ratio": 0.5}
    glass = {"youngs_modulus": "70 GPa", "poisson_ratio": 0.2}
    changes = {"materials.soft.contact_modulus": None, "studies.one.models": ["boundary_elements"]}

    def material(**keys):
        for key, value in keys.items():
            changes[f"materials.soft.{key}"] = value
        campaign = load(changes).campaign
        return run_settings(campaign, campaign.all_runs[0])["material"]

    both = material(bodies=[rubber, glass])
    assert both["contact_modulus"] == pytest.approx(1 / (0.75 / 2e6 + 0.96 / 70e9), rel=1e-14)
    assert "bodies" not in both and "poisson_ratio" not in both
    layer = material(bodies=["rigid", rubber], thickness="100 um")
    assert (layer["contact_modulus"], layer["poisson_ratio"]) == (pytest.approx(2e6 / 0.75, rel=1e-14), 0.5)
    assert material(interaction_range=None)["interaction_range"] == VAN_DER_WAALS_RANGE


def test_the_youngs_modulus_of_a_body_can_be_given_alone_and_varied(load):
    def materials(changes):
        campaign = load({"materials.soft.contact_modulus": None} | changes).campaign
        return [run_settings(campaign, case)["material"] for case in campaign.all_runs]

    alone = {"materials.soft.youngs_modulus": "2 MPa", "materials.soft.poisson_ratio": 0.4}
    assert materials(alone)[0]["contact_modulus"] == pytest.approx(2e6 / 0.84, rel=1e-14)
    bodies = {"materials.soft.bodies": ["rigid", {"youngs_modulus": "2 MPa", "poisson_ratio": 0.5}]}
    single = bodies | {"studies.one.seeds": [1], "studies.one.rms_slopes": [0.5]}
    varied = materials(single | {"studies.one.vary": {"youngs_modulus": ["3 MPa", "4 MPa"]}})
    assert [each["contact_modulus"] for each in varied] == pytest.approx([3e6 / 0.75, 4e6 / 0.75], rel=1e-14)
    varied = materials(single | {"studies.one.vary": {"poisson_ratio": [0.3, 0.5]}})
    assert [each["contact_modulus"] for each in varied] == pytest.approx([2e6 / 0.91, 2e6 / 0.75], rel=1e-14)


LEVELS = {"asperities": "1..4", "coarse": [1, 2, 3], "fine": [1, 2]}
ON_LEVELS = {"studies.one.seeds": None, "studies.one.rms_slopes": [0.5], "studies.one.levels": LEVELS}


def test_levels_are_runs_of_both_models_and_a_study_on_half_the_grid(load):
    configuration = load(ON_LEVELS)
    campaign = configuration.campaign
    assert configuration.warnings == ()
    assert [(case.study, case.model, case.surface, case.seed) for case in campaign.all_runs] == [
        *(("one", "asperities", "rough", seed) for seed in (1, 2, 3, 4)),
        *(("one", "boundary_elements", "rough", seed) for seed in (1, 2)),
        *(("one-coarse", "boundary_elements", "rough-grid40", seed) for seed in (1, 2, 3)),
    ]
    assert campaign.period("rough-grid40") == campaign.period("rough")


def test_an_error_check_adds_boundary_elements_for_the_first_seed_of_each_contact(load):
    campaign = load({"studies.one.error_check": True, "studies.one.seeds": [3, 1, 2]}).campaign
    found = [(case.model, case.seed, case.rms_slope) for case in campaign.all_runs]
    assert len(found) == 6 + 2 and found[6:] == [("boundary_elements", 3, 0.2), ("boundary_elements", 3, 1.0)]
    assert campaign.compares_models("one")


def test_defaults_serve_entries_that_do_not_give_their_own(load, tmp_path):
    np.save(tmp_path / "own.npy", np.random.default_rng(1).random((16, 16)))
    changes = {
        "defaults": {
            "surfaces": {"period": "100 um", "hurst": 0.3, "grid": 80},
            "materials": {"surface_energy": "1 mJ/m^2", "interaction_range": "2 nm"},
            "studies": {"seeds": "1..3", "materials": ["soft", "hard"]},
        },
        "surfaces.rough.period": None,
        "surfaces.rough.grid": None,
        # Of another kind, which has no Hurst exponent.
        "surfaces.own": {"kind": "file", "path": "own.npy", "height_unit": "um"},
        "materials.hard": {"contact_modulus": "1 GPa"},
        "studies.one.seeds": None,
        "studies.one.materials": None,
    }
    campaign = load(changes).campaign
    assert campaign.surfaces["rough"].hurst == 0.8 and campaign.surfaces["rough"].grid == 80
    assert campaign.surfaces["own"].period == 1e-4
    assert campaign.materials["hard"].surface_energy == 1e-3
    assert campaign.materials["soft"].surface_energy == 0.05
    assert len(campaign.all_runs) == 3 * 2 * 2
    with pytest.raises(ConfigurationError, match=r"defaults\.materials\.interaction_range: '2 m\^2'"):
        load({**changes, "defaults": {"materials": {"interaction_range": "2 m^2", "surface_energy": "1 mJ/m^2"}}})


def test_a_study_is_a_product_of_its_lists(load):
    campaign = load().campaign
    assert [case.path for case in campaign.all_runs] == [
        "one/rough/seed1/slope0.2/soft",
        "one/rough/seed1/slope1/soft",
        "one/rough/seed2/slope0.2/soft",
        "one/rough/seed2/slope1/soft",
    ]
    settings = run_settings(campaign, campaign.all_runs[0])
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
    assert run_settings(one, one.all_runs[0])["path"]["snapshots"] == [("area_fraction", area) for area in areas]
    assert campaign_sha256(one) == campaign_sha256(other)


def test_settings_depend_on_values_not_on_how_they_are_written(load):
    def checksum(campaign):
        return run_sha256(campaign, campaign.all_runs[0]), campaign_sha256(campaign)

    first = checksum(load().campaign)
    assert checksum(load({"materials.soft.contact_modulus": "25000 kPa", "title": "Other"}).campaign) == first
    assert checksum(load({"materials.soft.contact_modulus": "26 MPa"}).campaign) != first
    assert checksum(load({"studies.one.seeds": [1, 3]}).campaign)[0] == first[0]
    assert checksum(load({"studies.one.seeds": [1, 3]}).campaign)[1] != first[1]


def test_another_file_of_the_same_name_is_another_run(load, tmp_path):
    def checksum():
        campaign = load({"surfaces.rough": file_surface("own.npy"), "confirmed": ["surfaces.rough.path"]}).campaign
        return run_sha256(campaign, campaign.all_runs[0])

    heights = np.random.default_rng(1).random((16, 16))
    np.save(tmp_path / "own.npy", heights)
    first = checksum()
    np.save(tmp_path / "own.npy", heights)
    assert checksum() == first
    np.save(tmp_path / "own.npy", heights + 1)
    assert checksum() != first


def test_unloading_its_turning_points_and_snapshots_are_part_of_the_path(load):
    snapshots = [{"area_fraction": 0.01}, {"area_fraction": 0.01, "branch": "unloading"}]
    turns = [{"reduced_pressure": -1e-3}, {"area_fraction": 0.03}]
    study = {"studies.one.unload": True, "studies.one.snapshots": snapshots, "studies.one.turning_points": turns}
    figure = {"figures": {"fig4_contact_map": {"study": "one", "snapshot": snapshots[1]}}}
    campaign = load(study | figure).campaign
    path = run_settings(campaign, campaign.all_runs[0])["path"]
    assert path["snapshots"] == [("area_fraction", 0.01), ("unloading_area_fraction", 0.01)]
    assert path["unload"] is True and path["control"] == "separation"
    assert path["turning_points"] == [("reduced_pressure", -1e-3), ("area_fraction", 0.03)]
    assert icha.Path(**path).turning_points[1].value == 0.03
    arguments = campaign.figures.fig4_contact_map.arguments(campaign)
    assert (arguments["kind"], arguments["target"]) == ("unloading_area_fraction", 0.01)


PARAMETERS = {
    "hurst": [0.5, 0.9],
    "surface_energy": {"lognormal": ["20 mJ/m^2", 1.3]},
    "contact_modulus": {"normal": ["25 MPa", "1 MPa"]},
}
SAMPLE = {"count": 64, "parameters": PARAMETERS}
ONE = {"studies.one.seeds": [1, 2], "studies.one.rms_slopes": [0.5], "studies.one.sample": SAMPLE}


def drawn(campaign, label="one"):
    cases, parameters = sampled_parameters(campaign)[label]
    return cases, {name: np.array(each[4]) for name, each in parameters.items()}


def test_each_case_is_a_contact_with_the_values_drawn(load):
    campaign = load(ONE).campaign
    cases, values = drawn(campaign)
    runs = campaign.all_runs
    assert len(cases) == 64 and len(runs) == 128
    assert runs[0].path == "one/rough-one-case0/seed1/slope0.5/soft-one-case0"
    for k in (0, 17, 63):
        run = next(run for run in runs if (run.surface, run.rms_slope, run.material) == cases[k])
        assert surface_settings(campaign, run.surface)["hurst"] == values["hurst"][k]
        material = run_settings(campaign, run)["material"]
        assert material["surface_energy"] == pytest.approx(values["surface_energy"][k], rel=1e-15)
        assert material["contact_modulus"] == pytest.approx(values["contact_modulus"][k], rel=1e-15)
    assert varied_values(campaign)["one"]["hurst"][2]["rough-one-case17"] == values["hurst"][17]


@pytest.mark.parametrize("method", ["sobol", "latin_hypercube"])
def test_values_have_their_distributions_and_depend_on_the_seed_alone(load, method):
    sample = SAMPLE | {"method": method}
    _, values = drawn(load(ONE | {"studies.one.sample": sample}).campaign)
    for name, expected in (
        ("hurst", uniform(0.5, 0.4)),
        ("surface_energy", lognorm(np.log(1.3), scale=0.02)),
        ("contact_modulus", norm(25e6, 1e6)),
    ):
        # A sample of independent values would differ by 0.1.
        assert kstest(values[name], expected.cdf).statistic < 0.04
    turned = sample | {"parameters": dict(reversed(PARAMETERS.items()))}
    assert drawn(load(ONE | {"studies.one.sample": turned}).campaign)[1]["hurst"].tolist() == values["hurst"].tolist()
    other = drawn(load(ONE | {"studies.one.sample": sample | {"seed": 2}}).campaign)[1]
    assert other["hurst"].tolist() != values["hurst"].tolist()


def test_rms_slopes_can_be_sampled(load):
    sample = {"count": 4, "parameters": {"rms_slope": [0.2, 0.4]}}
    campaign = load(ONE | {"studies.one.rms_slopes": None, "studies.one.sample": sample}).campaign
    cases, values = drawn(campaign)
    assert [slope for _, slope, _ in cases] == values["rms_slope"].tolist()
    assert {surface for surface, _, _ in cases} == {"rough"} and len(campaign.all_runs) == 8


def test_beside_levels_the_sample_is_a_study_of_its_own(load):
    changes = ONE | {"studies.one.seeds": None, "surfaces.rough.grid": 96}
    changes |= {"studies.one.levels": {"asperities": "1..4", "coarse": "1..3", "fine": "1..2"}}
    campaign = load(changes).campaign
    runs = campaign.all_runs
    own = [run for run in runs if run.study == "one"]
    assert {(run.surface, run.material) for run in own} == {("rough", "soft")} and len(own) == 6
    inputs = [run for run in runs if run.study == inputs_study("one")]
    assert len(inputs) == 64 and {(run.model, run.seed) for run in inputs} == {("asperities", 1)}
    assert list(sampled_parameters(campaign)) == ["one-inputs"]


def test_a_draw_that_is_impossible_is_named(load):
    sample = {"count": 64, "parameters": {"hurst": {"normal": [0.8, 0.2]}}}
    with pytest.raises(ConfigurationError) as error:
        load(ONE | {"studies.one.sample": sample})
    assert "studies.one.sample.parameters.hurst: 1." in str(error.value)
    assert "is out of range in case" in str(error.value)


BOTH = {"studies.one.models": ["asperities", "boundary_elements"]}
ALONE = {"studies.one.models": ["boundary_elements"]}


def test_beside_boundary_elements_targets_may_lie_beyond_asperities(load):
    """Asperities end loading at the limit of their range, but they must begin it."""
    beyond = {"studies.one.targets.reduced_pressures": [0.1, 0.5]}
    assert load(BOTH | beyond) and load(ALONE | beyond)


def test_boundary_elements_are_planned_as_a_part_of_their_own_at_their_own_cost(load, tmp_path):
    campaign = load(BOTH | {"surfaces.rough.grid": 512}).campaign
    runs = [item for item in plan(campaign, tmp_path) if item.part == RUNS]
    assert [item.group for item in runs] == 4 * ["study one"] + 4 * ["study one, boundary elements"]
    quick, slow = runs[:4], runs[4:]
    assert min(item.cost.seconds for item in slow) > 2 * max(item.cost.seconds for item in quick)
    quick_batch, *_, slow_batch = run_batches(campaign, campaign_files(campaign).runs)
    assert slow_batch.memory > quick_batch.memory and slow_batch.memory * 1e6 > slow[0].cost.memory
    assert slow_batch.minutes > quick_batch.minutes
