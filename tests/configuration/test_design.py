"""The runs of a study: lists, cases, varied parameters."""

import numpy as np
import pytest
from demo_configuration import file_surface, measured_surface

from icha.asperity.material import VAN_DER_WAALS_RANGE
from icha.configuration.cases import run_cases, run_settings, surface_cases, surface_settings
from icha.configuration.design import sampled_parameters, value_label
from icha.configuration.errors import ConfigurationError
from icha.surfaces.spectrum import SelfAffineSpectrum
from icha.surfaces.surface import Surface


def paths(campaign):
    return [case.path.removeprefix("one/") for case in run_cases(campaign)]


def test_random_surfaces_and_files_share_a_study(load, tmp_path):
    np.save(tmp_path / "own.npy", np.random.default_rng(1).random((16, 16)))
    changes = {"surfaces.own": file_surface("own.npy"), "studies.one.surfaces": ["rough", "own"]}
    campaign = load(changes | {"confirmed": ["surfaces.own.path"]}).campaign
    assert surface_cases(campaign) == [("rough", 1), ("rough", 2), ("own", 0)]
    assert len(paths(campaign)) == 2 * 2 + 2


def test_parameters_are_varied_each_with_each(load):
    vary = {"hurst": [0.6, 0.8], "surface_energy": ["5 mJ/m^2", "0.00001 kJ/m^2"], "grid": 96}
    campaign = load({"studies.one.vary": vary, "studies.one.rms_slopes": [0.2], "studies.one.seeds": [1]}).campaign
    assert paths(campaign) == [
        f"rough-hurst{hurst}-grid96/seed1/slope0.2/soft-surface_energy{energy}"
        for hurst in ("0.6", "0.8")
        for energy in ("5mJ", "10mJ")
    ]
    case = run_cases(campaign)[-1]
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


def test_figures_name_the_variants(load):
    figure = {"study": "one", "surface": "rough-hurst0.5", "seed": 2}
    changes = {"studies.one.vary": {"hurst": [0.5, 0.9]}, "figures": {"fig4_contact_map": figure}}
    load(changes)
    with pytest.raises(
        ConfigurationError, match=r"'rough' is not in study 'one'; expected one of rough-hurst0\.5, rough-"
    ):
        load({**changes, "figures": {"fig4_contact_map": figure | {"surface": "rough"}}})


@pytest.mark.parametrize(
    ("value", "label"), [(4e-8, "40nm"), (1.5625e-6, "1.5625um"), (0.1, "100mm"), (1e-4, "100um"), (12.0, "12m")]
)
def test_names_of_variants_are_read_by_people(value, label, load):
    assert value_label(load().campaign.surfaces["rough"].model_copy(update={"period": value}), "period") == label


def test_the_preparation_of_a_measured_surface_is_varied(load):
    changes = {
        "surfaces.rough": measured_surface(),
        "studies.one.rms_slopes": "measured",
        "studies.one.vary": {"detrend": ["tilt", "curvature"], "boundary": ["mirror", "free"]},
    }
    cases = run_cases(load(changes).campaign)
    assert [case.surface for case in cases] == [
        f"rough-detrend{detrend}-boundary{boundary}"
        for detrend in ("tilt", "curvature")
        for boundary in ("mirror", "free")
    ]
    # A mirror image has the slope of what it is of; a plane is part of a slope, and a paraboloid of another.
    assert len({case.rms_slope for case in cases}) > 1


def test_rms_heights_scale_surfaces_as_their_spectra_or_their_files_demand(load, tmp_path):
    np.save(tmp_path / "own.npy", heights := np.random.default_rng(1).random((32, 32)))
    changes = {
        "studies.one.seeds": [1],
        "studies.one.rms_slopes": None,
        "studies.one.rms_heights": ["100 nm"],
        "studies.one.vary": {"hurst": [0.5]},
        "materials.soft.surface_energy": "0 J/m^2",
    }
    ((_, slope),) = slopes_of(load(changes).campaign)
    surface = SelfAffineSpectrum(100e-6, 20e-6, 10e-6, 0.5, rms_slope=slope).realise(80, 7)
    assert np.std(surface.heights) == pytest.approx(100e-9, rel=1e-6)
    changes |= {"surfaces.own": file_surface("own.npy"), "studies.one.surfaces": ["own"]}
    changes["confirmed"] = ["surfaces.own.path"]
    del changes["studies.one.vary"]
    ((_, slope),) = slopes_of(load(changes).campaign)
    own = Surface((heights - heights.mean()) * 1e-6, 1e-3)
    assert slope / own.rms_slope * own.rms_height == pytest.approx(100e-9, rel=1e-6)


def slopes_of(campaign):
    return {(case.surface, case.rms_slope) for case in run_cases(campaign)}


def test_bodies_give_the_contact_modulus_and_the_ratio_of_a_layer(load):
    rubber = {"youngs_modulus": "2 MPa", "poisson_ratio": 0.5}
    glass = {"youngs_modulus": "70 GPa", "poisson_ratio": 0.2}
    changes = {"materials.soft.contact_modulus": None, "studies.one.models": ["boundary_elements"]}

    def material(**keys):
        for key, value in keys.items():
            changes[f"materials.soft.{key}"] = value
        campaign = load(changes).campaign
        return run_settings(campaign, run_cases(campaign)[0])["material"]

    both = material(bodies=[rubber, glass])
    assert both["contact_modulus"] == pytest.approx(1 / (0.75 / 2e6 + 0.96 / 70e9), rel=1e-14)
    assert "bodies" not in both and "poisson_ratio" not in both
    layer = material(bodies=["rigid", rubber], thickness="100 um")
    assert (layer["contact_modulus"], layer["poisson_ratio"]) == (pytest.approx(2e6 / 0.75, rel=1e-14), 0.5)
    assert material(interaction_range=None)["interaction_range"] == VAN_DER_WAALS_RANGE


def test_the_youngs_modulus_of_a_body_can_be_given_alone_varied_and_sampled(load):
    def materials(changes):
        campaign = load({"materials.soft.contact_modulus": None} | changes).campaign
        return [run_settings(campaign, case)["material"] for case in run_cases(campaign)]

    alone = {"materials.soft.youngs_modulus": "2 MPa", "materials.soft.poisson_ratio": 0.4}
    assert materials(alone)[0]["contact_modulus"] == pytest.approx(2e6 / 0.84, rel=1e-14)
    bodies = {"materials.soft.bodies": ["rigid", {"youngs_modulus": "2 MPa", "poisson_ratio": 0.5}]}
    single = bodies | {"studies.one.seeds": [1], "studies.one.rms_slopes": [0.5]}
    varied = materials(single | {"studies.one.vary": {"youngs_modulus": ["3 MPa", "4 MPa"]}})
    assert [each["contact_modulus"] for each in varied] == pytest.approx([3e6 / 0.75, 4e6 / 0.75], rel=1e-14)
    varied = materials(single | {"studies.one.vary": {"poisson_ratio": [0.3, 0.5]}})
    assert [each["contact_modulus"] for each in varied] == pytest.approx([2e6 / 0.91, 2e6 / 0.75], rel=1e-14)
    sample = {"studies.one.sample": {"count": 4, "parameters": {"youngs_modulus": ["1 MPa", "3 MPa"]}}}
    campaign = load({"materials.soft.contact_modulus": None} | single | sample).campaign
    (unit, *_, drawn) = sampled_parameters(campaign)["one"][1]["youngs_modulus"]
    found = [run_settings(campaign, case)["material"]["contact_modulus"] for case in run_cases(campaign)]
    assert unit == "Pa" and found == pytest.approx([each / 0.75 for each in drawn], rel=1e-14)
    two = single["materials.soft.bodies"][1]
    for wrong, message in (
        (bodies | {"materials.soft.bodies": [two, two]}, "needs `bodies` with one elastic body"),
        ({"materials.soft.contact_modulus": "25 MPa"}, "is given beside `contact_modulus`"),
    ):
        with pytest.raises(ConfigurationError, match=message):
            load({"materials.soft.contact_modulus": None} | single | sample | wrong)


def test_a_poisson_ratio_without_effect_is_not_varied(refused):
    for changes in (
        {"studies.one.vary": {"poisson_ratio": [0.3, 0.5]}},
        {"studies.one.cases": [{"poisson_ratio": 0.3}]},
    ):
        refused(None, changes, "0.3 has no effect, because 'soft' is a half-space with a given contact modulus")


LEVELS = {"asperities": "1..4", "coarse": [1, 2, 3], "fine": [1, 2]}
ON_LEVELS = {"studies.one.seeds": None, "studies.one.rms_slopes": [0.5], "studies.one.levels": LEVELS}


def test_levels_are_runs_of_both_models_and_a_study_on_half_the_grid(load):
    configuration = load(ON_LEVELS)
    campaign = configuration.campaign
    assert configuration.warnings == ()
    assert [(case.study, case.model, case.surface, case.seed) for case in run_cases(campaign)] == [
        *(("one", "asperities", "rough", seed) for seed in (1, 2, 3, 4)),
        *(("one", "boundary_elements", "rough", seed) for seed in (1, 2)),
        *(("one-coarse", "boundary_elements", "rough-grid40", seed) for seed in (1, 2, 3)),
    ]
    assert campaign.period("rough-grid40") == campaign.period("rough")


def test_levels_of_variants_halve_the_grid_of_each_variant(load):
    vary = {"grid": [80, 96], "hurst": [0.5]}
    campaign = load({**ON_LEVELS, "studies.one.vary": vary, "materials.soft.surface_energy": "0 J/m^2"}).campaign
    names = {case.study: [] for case in run_cases(campaign)}
    for case in run_cases(campaign):
        if case.surface not in names[case.study]:
            names[case.study].append(case.surface)
    assert names == {
        "one": ["rough-hurst0.5-grid80", "rough-hurst0.5-grid96"],
        "one-coarse": ["rough-hurst0.5-grid40", "rough-hurst0.5-grid48"],
    }


def test_an_error_check_adds_boundary_elements_for_the_first_seed_of_each_contact(load):
    campaign = load({"studies.one.error_check": True, "studies.one.seeds": [3, 1, 2]}).campaign
    found = [(case.model, case.seed, case.rms_slope) for case in run_cases(campaign)]
    assert len(found) == 6 + 2 and found[6:] == [("boundary_elements", 3, 0.2), ("boundary_elements", 3, 1.0)]
    assert campaign.compares_models("one")
