"""Configuration files: what they mean, and that every mistake is named before anything runs."""

import datetime
from pathlib import Path

import numpy as np
import pytest
import yaml

import icha
import icha.surfaces.measured.topography
from icha.configuration.cases import (
    asperity_cases,
    loop_cases,
    run_cases,
    solution_cases,
    source_cases,
    surface_cases,
)
from icha.configuration.design import value_label
from icha.configuration.errors import ConfigurationError
from icha.configuration.load import load_configuration
from icha.configuration.publication import needed
from icha.configuration.schema import json_schema, readme_with_tables
from icha.configuration.settings import (
    campaign_sha256,
    loop_settings,
    run_settings,
    run_sha256,
    solution_settings,
    source_settings,
    surface_settings,
)
from icha.configuration.yaml_files import read_yaml
from icha.datasets.labels import number_label
from icha.figures.fig4_contact_map import finest_solution
from icha.references.literature import literature
from icha.support.units import to_number, to_si
from icha.support.values import Section

REPOSITORY = Path(__file__).parents[2]
SHIPPED = sorted([REPOSITORY / "config/config.yaml", *(REPOSITORY / "config/campaigns").glob("*.yaml")])

GOOD = """
name: demo
title: A title
summary: A summary
license: CC-BY-4.0
surfaces:
  rough:
    kind: self_affine
    period: 100 um
    rolloff_wavelength: 20 um
    short_wavelength: 10 um
    hurst: 0.8
    grid: 80
materials:
  soft:
    contact_modulus: 25 MPa
    surface_energy: 50 mJ/m^2
    interaction_range: 2.071 nm
studies:
  one:
    surfaces: [rough]
    seeds: [1, 2]
    rms_slopes: [0.2, 1.0]
    materials: [soft]
    targets:
      reduced_pressures: [1e-3, 0.01]
    snapshots:
      - area_fraction: 0.02
"""


@pytest.fixture
def load(tmp_path):
    """Load GOOD with values changed at dotted keys (`None` as a value deletes the key)."""

    def loaded(changes=None, overrides=None, text=GOOD):
        content = yaml.safe_load(text)
        for key, value in (changes or {}).items():
            *path, last = key.split(".")
            inside = content
            for part in path:
                inside = inside[int(part) if isinstance(inside, list) else part]
            if value is None:
                del inside[last]
            else:
                inside[int(last) if isinstance(inside, list) else last] = value
        file = tmp_path / "campaign.yaml"
        file.write_text(yaml.safe_dump(content, sort_keys=False))
        return load_configuration(file, overrides)

    return loaded


def test_quantities_are_exact_si_values():
    assert to_si("100 um", "m") == 1e-4
    assert to_si("100 µm", "m") == 1e-4
    assert to_si("0.1 mm", "m") == 1e-4
    assert to_si("25MPa", "Pa") == 25e6
    assert to_si("1.0e6 Pa", "Pa") == 1e6
    assert to_si("50 mJ/m^2", "J/m^2") == to_si("50 mN/m", "J/m^2") == 0.05
    assert to_si("2.071 nm", "m") == 2.071e-9


def test_numbers_that_yaml_reads_as_text_are_numbers():
    assert yaml.safe_load("1e-3") == "1e-3"
    assert to_number("1e-3") == 1e-3
    assert to_number("1.0e6") == 1e6
    assert to_number(3) == 3.0


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_campaigns_are_valid(path):
    campaign = load_configuration(path).campaign
    assert run_cases(campaign)
    assert not campaign.warnings()
    assert path.name == "config.yaml" or campaign.name == path.stem


def test_the_papers_campaign():
    campaign = load_configuration(REPOSITORY / "config/config.yaml").campaign
    assert campaign.name == "paper"
    cases = run_cases(campaign)
    assert len(cases) == 3 + 9
    assert len({case.path for case in cases}) == 12
    assert surface_cases(campaign) == [("challenge", 1), ("mcghee", 1)]
    challenge, mcghee = campaign.surfaces["challenge"], campaign.surfaces["mcghee"]
    assert mcghee.period == 1000 * challenge.period == 0.1
    assert challenge.cells_per_short_wave == pytest.approx(8)
    ratios = [m.surface_energy / m.contact_modulus for m in campaign.materials.values()][3:]
    assert ratios == pytest.approx([8.333e-9, 4.0e-9, 1.905e-9], rel=1e-3)


def test_boundary_elements_stand_beside_the_papers_runs():
    campaign = load_configuration(REPOSITORY / "config/config.yaml").campaign
    cases = solution_cases(campaign)
    assert {case.run for case in cases} <= set(run_cases(campaign))
    assert len({case.path for case in cases}) == len(cases)
    energies = {campaign.materials[case.material].surface_energy for case in cases}
    assert energies == {0.0, 0.05}  # with and without adhesion
    for case in cases:
        assert ("reduced_pressure", case.reduced_pressure) in run_settings(campaign, case.run)["path"]["snapshots"]
    drawn = campaign.figures.fig4_contact_map
    assert finest_solution(campaign, drawn).material == drawn.material


def test_the_validation_varies_what_makes_a_surface():
    campaign = load_configuration(REPOSITORY / "config/campaigns/validation.yaml").campaign
    entries = [case for case in solution_cases(campaign) if case.entry in ("adhesionless", "adhesive")]
    surfaces = [campaign.surfaces[name] for name in dict.fromkeys(case.surface for case in entries)]
    assert {surface.hurst for surface in surfaces} == {0.3, 0.5, 0.8}
    assert len({surface.rolloff_wavelength for surface in surfaces}) >= 3
    assert len({surface.short_wavelength for surface in surfaces}) >= 3
    for name in {case.surface for case in entries}:
        for energy in (0.0, 0.05):
            seeds = {
                case.seed
                for case in entries
                if case.surface == name and campaign.materials[case.material].surface_energy == energy
            }
            assert len(seeds) >= 3


def test_the_whole_challenge():
    challenge = literature("contact_mechanics_challenge")
    campaign = load_configuration(REPOSITORY / "config/campaigns/cmc_full.yaml").campaign
    surface, study = campaign.surfaces["challenge"], campaign.studies["challenge"]
    for name in ("period", "rolloff_wavelength", "short_wavelength"):
        assert getattr(surface, name) == pytest.approx(challenge[f"{name}_m"])
    assert (surface.hurst, study.rms_slopes) == (challenge["hurst"], [challenge["rms_slope"]])
    assert surface.cells_per_short_wave >= 8
    cmc = campaign.materials["cmc"]
    assert cmc.contact_modulus == challenge["contact_modulus_Pa"]
    assert cmc.surface_energy == challenge["surface_energy_J_m2"]
    assert cmc.interaction_range == challenge["interaction_range_m"]
    assert campaign.materials["cmc_adhesionless"].surface_energy == 0
    areas = np.array(study.targets.area_fractions)
    assert len(areas) == 20 and areas[-1] == 0.1
    np.testing.assert_allclose(np.diff(np.log(areas)), np.log(areas[-1] / areas[0]) / 19, rtol=0.03)
    pressure = challenge["reference_pressure_Pa"] / challenge["contact_modulus_Pa"] / challenge["rms_slope"]
    assert [snapshot.target for snapshot in study.snapshots] == [("reduced_pressure", pytest.approx(pressure))]


def test_tabor_parameters_of_the_tabor_campaign():
    challenge = literature("contact_mechanics_challenge")
    campaign = load_configuration(REPOSITORY / "config/campaigns/tabor.yaml").campaign
    whole = load_configuration(REPOSITORY / "config/campaigns/cmc_full.yaml").campaign
    assert campaign.surfaces == whole.surfaces
    found = []
    for name in campaign.studies["tabor"].materials:
        material = campaign.materials[name]
        length = material.surface_energy / material.contact_modulus
        mu = np.cbrt(length**2 * challenge["rms_curvature_radius_m"]) / material.interaction_range
        if name == "adhesionless":
            assert mu == 0
        else:
            assert float(name.removeprefix("mu_").replace("_", ".")) == pytest.approx(mu, rel=2e-3)
            found.append(mu)
    np.testing.assert_allclose(found, np.arange(1, 5.1, 0.5), rtol=2e-3)


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


def test_the_way_back_is_part_of_the_path(load):
    campaign = load(
        {
            "studies.one.unload": True,
            "studies.one.turning_points": [{"reduced_pressure": -1e-3}, {"area_fraction": 0.03}],
            "studies.one.united_until": "overlap",
        }
    ).campaign
    path = run_settings(campaign, run_cases(campaign)[0])["path"]
    assert path["unload"] is True and path["united_until"] == "overlap" and path["control"] == "separation"
    assert path["turning_points"] == [("reduced_pressure", -1e-3), ("area_fraction", 0.03)]
    assert icha.Path(**path).turning_points[1].value == 0.03


def test_boundary_elements_turn_where_their_study_does(load):
    loops = {"both": {"study": "one", "seeds": [2], "rms_slopes": [1.0], "separation_step": 0.1}}
    bare = {"materials.soft.surface_energy": "0 mJ/m^2"}
    campaign = load({"studies.one.unload": True, "boundary_element_loops": loops} | bare).campaign
    (case,) = loop_cases(campaign)
    assert case.path == "both/rough/seed2/slope1/soft"
    settings = loop_settings(campaign, case)
    assert settings["largest_reduced_pressure"] == 0.01 and settings["separation_step"] == 0.1


def test_settings_depend_on_values_not_on_how_they_are_written(load):
    def checksum(campaign):
        return run_sha256(campaign, run_cases(campaign)[0]), campaign_sha256(campaign)

    first = checksum(load().campaign)
    assert checksum(load({"materials.soft.contact_modulus": "25000 kPa", "title": "Other"}).campaign) == first
    assert checksum(load({"materials.soft.contact_modulus": "26 MPa"}).campaign) != first
    assert checksum(load({"studies.one.seeds": [1, 3]}).campaign)[0] == first[0]
    assert checksum(load({"studies.one.seeds": [1, 3]}).campaign)[1] != first[1]


@pytest.mark.parametrize("value", [0.1, 0.1 + 0.2, 1.0, 1e-5, 12.5, 100.0])
def test_slopes_in_paths_read_back(value):
    assert float(number_label(value)) == value
    assert "/" not in number_label(value) and " " not in number_label(value)


def test_campaigns_are_immutable(load):
    with pytest.raises(ValueError, match="frozen"):
        load().campaign.materials["soft"].contact_modulus = 1.0


GOOD_RUN = "one/rough/seed1/slope0.2/soft"
ORCID = "0000-0002-1825-0097"
CARBERRY = {"family_names": "Carberry", "given_names": "Josiah"}
BAD = {
    # key, value, what the message must say of it
    "unknown key": ("materials.soft.modulus", "25 MPa", "materials.soft.modulus: unknown key"),
    "unknown key at the top": ("titel", "x", "titel: unknown key (did you mean 'title'?)"),
    "unknown key of a surface": ("surfaces.rough.hrust", 0.8, "surfaces.rough.hrust: unknown key"),
    "missing key": ("materials.soft.surface_energy", None, "materials.soft.surface_energy: the key is missing"),
    "missing unit": ("materials.soft.contact_modulus", 25e6, "the unit is missing; allowed: pressure with its unit"),
    "missing unit in text": ("surfaces.rough.period", "100", "surfaces.rough.period: '100' the unit is missing"),
    "unknown unit": ("surfaces.rough.period", "100 umm", "'umm' is not a known unit"),
    "wrong dimension": ("materials.soft.surface_energy", "50 mJ/m^3", "is not a unit of energy per area"),
    "unit on a number": ("surfaces.rough.hurst", "0.8 m", "is a pure number and takes no unit"),
    "negative modulus": ("materials.soft.contact_modulus", "-25 MPa", "'-25 MPa' is too small"),
    "zero modulus": ("materials.soft.contact_modulus", "0 MPa", "greater than 0"),
    "negative surface energy": ("materials.soft.surface_energy", "-1 mJ/m^2", "0 or greater"),
    "zero range": ("materials.soft.interaction_range", "0 nm", "greater than 0"),
    "infinite length": ("surfaces.rough.period", "1e999 m", "is not finite"),
    "not a number of metres": ("surfaces.rough.period", "nan m", "is not a number with a unit"),
    "boolean quantity": ("surfaces.rough.period", True, "is not a number with a unit"),
    "Hurst exponent 0": ("surfaces.rough.hurst", 0, "(0, 1]"),
    "Hurst exponent above 1": ("surfaces.rough.hurst", 1.2, "surfaces.rough.hurst: 1.2 is out of range"),
    "boolean Hurst exponent": ("surfaces.rough.hurst", True, "surfaces.rough.hurst: True is not a number"),
    "NaN": ("surfaces.rough.hurst", float("nan"), "is not finite"),
    "cut-off below two cells": ("surfaces.rough.grid", 19, "1.9 grid cells per shortest wavelength"),
    "grid is no integer": ("surfaces.rough.grid", 80.0, "is not an integer"),
    "boolean grid": ("surfaces.rough.grid", True, "is not an integer"),
    "q0 below qL": ("surfaces.rough.rolloff_wavelength", "101 um", "longer than the period (q0 < qL)"),
    "q1 at q0": ("surfaces.rough.short_wavelength", "20 um", "not shorter than the roll-off wavelength (q1 <= q0)"),
    "unknown kind of surface": ("surfaces.rough.kind", "fractal", "allowed: self_affine, file"),
    "unknown amplitudes": ("surfaces.rough.amplitudes", "random", "'fixed' or 'gaussian'"),
    "no surfaces": ("surfaces", {}, "surfaces: {} is empty"),
    "surfaces no mapping": ("surfaces", [1], "is not a mapping"),
    "section no mapping": ("surfaces.rough", 3, "surfaces.rough"),
    "empty list of materials": ("studies.one.materials", [], "studies.one.materials: [] is empty"),
    "empty list of seeds": ("studies.one.seeds", [], "is empty"),
    "empty list of targets": ("studies.one.targets", {"area_fractions": []}, "is empty"),
    "name of the campaign": ("name", "My Campaign", "is not a name; allowed: lower-case letters, digits"),
    "name of a material": ("materials.Soft", {}, "materials.Soft: 'Soft' is not a name"),
    "number as a name": ("name", 7, "name: 7 is not text"),
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
    "negative separation": ("studies.one.targets", {"mean_separations": ["-1 um"]}, "greater than 0"),
    "pressure beyond the model": ("studies.one.targets.reduced_pressures", [0.3], "(0, 0.15], which the model covers"),
    "area beyond the model": ("studies.one.targets", {"area_fractions": [0.5]}, "(0, 0.25], which the model covers"),
    "zero target": ("studies.one.targets.reduced_pressures", [0, 0.1], "is out of range"),
    "unknown snapshot": ("studies.one.snapshots", [{"area": 0.1}], "studies.one.snapshots[0].area: unknown key"),
    "snapshot of two kinds": (
        "studies.one.snapshots",
        [{"area_fraction": 0.1, "relative_load": 0.1}],
        "exactly one of reduced_pressure, relative_load",
    ),
    "load beyond the model": ("studies.one.snapshots", [{"relative_load": 0.1}], "a reduced pressure of 0.5"),
    "unload that is no truth value": ("studies.one.unload", 1, "studies.one.unload: 1 is neither true nor false"),
    "unknown control": ("studies.one.control", "force", "'separation' or 'load'"),
    "load control with areas": (
        "studies.one.control",
        "load",
        "studies.one.control: 'load' with the stop area_fraction = 0.02; allowed: stops and turning points that are",
    ),
    "unknown end of unions": ("studies.one.united_until", "ever", "'detachment' or 'overlap'"),
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
    "loops of a study that does not come back": (
        "boundary_element_loops",
        {"both": {"study": "one"}},
        "boundary_element_loops.both.study: 'one' does not come straight back",
    ),
    "loops of no study": ("boundary_element_loops", {"both": {"study": "two"}}, "'two' is not defined; allowed: one"),
    "figure of a loss without a way back": (
        "figures",
        {"fig15_loss": {"studies": ["one"]}},
        "figures.fig15_loss.studies[0]: 'one' is not unloaded",
    ),
    "figure of loops without a way back": ("figures", {"fig13_loops": {"study": "one"}}, "is not unloaded"),
    "figure of pull-off of no study": (
        "figures",
        {"fig14_pull_off": {"study": "one", "load_studies": ["two"]}},
        "figures.fig14_pull_off.load_studies[0]: 'two' is not defined",
    ),
    "step too long": ("studies.one.max_step", 0.6, "(0, 0.5]"),
    "figure of no study": ("figures", {"fig2_area_and_gap": {"study": "two"}}, "'two' is not defined; allowed: one"),
    "unknown figure": ("figures", {"fig7": {}}, "figures.fig7: unknown key"),
    "figure without its snapshots": (
        "figures",
        {"fig6_spots_by_slope": {"study": "one"}},
        "has no snapshot of kind relative_load",
    ),
    "figure of another snapshot": (
        "figures",
        {"fig3_distributions": {"study": "one", "snapshot": {"area_fraction": 0.1}}},
        "'area_fraction 0.1' is no snapshot of study 'one'; allowed: area_fraction 0.02",
    ),
    "map of a seed that is not there": (
        "figures",
        {"fig4_contact_map": {"study": "one", "seed": 9}},
        "figures.fig4_contact_map.seed: 9 is not in study 'one'; allowed: 1, 2",
    ),
    "grid beyond any memory": ("surfaces.rough.grid", 10**9, "surfaces.rough.grid"),
    "missing surface file": (
        "surfaces.rough",
        {"kind": "file", "path": "none.npy", "height_unit": "um", "period": "1 mm"},
        "no such file",
    ),
    "height unit": (
        "surfaces.rough",
        {"kind": "file", "path": "none.npy", "height_unit": "kg", "period": "1 mm"},
        "allowed: a unit of length",
    ),
    "boundary elements of no study": (
        "boundary_elements",
        {"truth": {"study": "two", "reduced_pressures": [0.01]}},
        "boundary_elements.truth.study: 'two' is not defined; allowed: one",
    ),
    "boundary elements of another material": (
        "boundary_elements",
        {"truth": {"study": "one", "materials": ["hard"], "reduced_pressures": [0.01]}},
        "boundary_elements.truth.materials[0]: 'hard' is not in study 'one'; allowed: soft",
    ),
    "boundary elements of another seed": (
        "boundary_elements",
        {"truth": {"study": "one", "seeds": [3], "reduced_pressures": [0.01]}},
        "boundary_elements.truth.seeds[0]: 3 is not in study 'one'; allowed: 1, 2",
    ),
    "boundary elements without loads": (
        "boundary_elements",
        {"truth": {"study": "one"}},
        "boundary_elements.truth.reduced_pressures: the key is missing",
    ),
    "refinement beyond any memory": (
        "boundary_elements",
        {"truth": {"study": "one", "reduced_pressures": [0.01], "refinement": 100}},
        "boundary_elements.truth.refinement: 100 is not an integer from 1 to 16",
    ),
    "unknown key of boundary elements": (
        "boundary_elements",
        {"truth": {"study": "one", "reduced_pressures": [0.01], "refine": 2}},
        "boundary_elements.truth.refine: unknown key (did you mean 'refinement'?)",
    ),
    "range that the grid does not resolve": (
        "boundary_elements",
        {"truth": {"study": "one", "reduced_pressures": [0.01]}},
        "boundary_elements.truth.materials: 'soft' on surface 'rough': a range of 2.071e-09 m is not resolved",
    ),
    "error without boundary elements": (
        "figures",
        {"fig10_model_error": {"study": "one"}},
        "figures.fig10_model_error.study: 'one' has no boundary elements beside it",
    ),
    "odd refinement of error sources": (
        "error_sources",
        {"why": {"study": "one", "reduced_pressures": [0.01], "refinement": 3}},
        "error_sources.why.refinement: 3 is odd; allowed: 2, 4",
    ),
    "range that half the refinement does not resolve": (
        "error_sources",
        {"why": {"study": "one", "reduced_pressures": [0.01]}},
        "error_sources.why.materials: 'soft' on surface 'rough': a range of 2.071e-09 m is not resolved",
    ),
    "figure of unknown error sources": (
        "figures",
        {"fig12_error_sources": {"entry": "why"}},
        "figures.fig12_error_sources.entry: 'why' is not defined",
    ),
    "Tabor parameter that takes too fine a grid": (
        "one_asperity",
        {"tabor_parameters": [2, 8]},
        "one_asperity.tabor_parameters[1]: 8 is out of range; allowed: a number in [1.5, 6]",
    ),
    "unknown key of one asperity": ("one_asperity", {"mu": [2]}, "one_asperity.mu: unknown key"),
    "tolerance that cannot be reached": (
        "boundary_elements",
        {"truth": {"study": "one", "reduced_pressures": [0.01], "tolerance": 1e-20}},
        "boundary_elements.truth.tolerance: 1e-20 is out of range; allowed: a number in [1e-12, 1e-4]",
    ),
    "boundary elements beyond any memory": (
        "",
        {
            "surfaces.rough.grid": 8192,
            "boundary_elements": {"truth": {"study": "one", "reduced_pressures": [0.01], "refinement": 16}},
        },
        "boundary_elements.truth.refinement: 16 gives 131072 nodes a side on 'rough'; allowed: 32768 at most",
    ),
    "parameter that nobody has": ("studies.one.vary", {"hrust": [0.8]}, "studies.one.vary.hrust: unknown key (did you"),
    "varied value out of range": (
        "studies.one.vary",
        {"hurst": [0.5, 1.5]},
        "studies.one.vary.hurst[1]: 1.5 is out of range; allowed: a number in (0, 1]",
    ),
    "varied value twice": (
        "studies.one.vary",
        {"hurst": [0.6, 0.6]},
        "studies.one.vary.hurst: [0.6, 0.6] 0.6 is given",
    ),
    "varied value without its unit": (
        "studies.one.vary",
        {"surface_energy": [5]},
        "studies.one.vary.surface_energy[0]: 5 the unit is missing; allowed: energy per area",
    ),
    "varied grid too coarse for its surface": (
        "studies.one.vary",
        {"grid": [80, 16]},
        "studies.one.vary.grid[1]: 16 gives 1.6 grid cells per shortest wavelength",
    ),
    "varied cut-off too short for the grid": (
        "studies.one.vary",
        {"short_wavelength": ["10 um", "1 um"]},
        "studies.one.vary.short_wavelength[1]: '1 um' grid of 'rough': 80 gives 0.8 grid cells",
    ),
    "lists of different length together": (
        "",
        {"studies.one.vary": {"hurst": [0.5, 0.6, 0.7]}, "studies.one.zip": [["rms_slopes", "hurst"]]},
        "rms_slopes has 2, hurst has 3 entries; allowed: lists of the same length",
    ),
    "list that is not there together": (
        "studies.one.zip",
        [["rms_slopes", "hurst"]],
        "studies.one.zip[0][1]: 'hurst' is no list of this study; allowed: surfaces, seeds, rms_slopes, materials",
    ),
    "list together twice": (
        "studies.one.zip",
        [["rms_slopes", "seeds"], ["seeds", "materials"]],
        "studies.one.zip[1][0]: 'seeds' goes along with two other lists",
    ),
    "case of an unknown surface": (
        "studies.one.cases",
        [{"surface": "rouhg"}],
        "studies.one.cases[0].surface: 'rouhg' is not defined; allowed: rough",
    ),
    "case with an unknown key": (
        "studies.one.cases",
        [{"surfaces": ["rough"]}],
        "studies.one.cases[0].surfaces: unknown key (did you mean 'surface'?)",
    ),
    "case with a wrong value": (
        "studies.one.cases",
        [{"hurst": 0.7}, {"hurst": 7}],
        "studies.one.cases[1].hurst: 7 is out of range",
    ),
    "no slopes and cases without one": (
        "",
        {"studies.one.rms_slopes": None, "studies.one.cases": [{"rms_slope": 0.1}, {"seed": 2}]},
        "studies.one.rms_slopes: the key is missing; needed: Rms slopes",
    ),
    "range of seeds backwards": ("studies.one.seeds", "5..1", "studies.one.seeds: '5..1' ends before it begins"),
    "range that is none": ("studies.one.seeds", ["1-5"], "'1-5' is no range of seeds; allowed: integers from 0"),
    "seed in a range twice": ("studies.one.seeds", ["1..5", 3], "3 is given twice"),
    "measured slope of a random surface": (
        "studies.one.rms_slopes",
        "measured",
        "studies.one.rms_slopes[0]: 'measured' surface 'rough' is made at random and has no slope of its own",
    ),
    "more runs than anybody waits for": (
        "studies.one.seeds",
        "1..100000",
        "studies.one: asks for 200000 runs; allowed",
    ),
    "unknown default": (
        "defaults",
        {"materials": {"modulus": "1 MPa"}},
        "defaults.materials.modulus: unknown key",
    ),
    "default of no kind of surface": ("defaults", {"surfaces": {"hrust": 0.8}}, "defaults.surfaces.hrust: unknown key"),
    "unknown section of defaults": ("defaults", {"figures": {}}, "defaults.figures: unknown key; allowed: materials"),
    "braces in a path": (
        "surfaces.rough",
        {"kind": "measured", "path": "scans{1}/a.txt"},
        "surfaces.rough.path: 'scans{1}/a.txt' has braces; allowed: the path of a file without { and } in it",
    ),
    "no ORCID": (
        "publication",
        {"authors": [CARBERRY | {"orcid": "1"}]},
        "publication.authors[0].orcid: '1' is no ORCID",
    ),
    "check digit of an ORCID": (
        "publication",
        {"authors": [CARBERRY | {"orcid": "0000-0002-1825-0098"}]},
        "publication.authors[0].orcid: '0000-0002-1825-0098' is no ORCID: its check digit is wrong; allowed: four",
    ),
    "ORCID of an organisation": (
        "publication",
        {"authors": [{"name": "A", "orcid": "0000-0002-1825-0097"}]},
        "publication.authors[0]: an organisation has no ORCID; allowed: orcid beside family_names",
    ),
    "half an author": (
        "publication",
        {"authors": [{"family_names": "Carberry"}]},
        "publication.authors[0]: {'family_names': 'Carberry'} is neither a person nor an organisation; allowed: family",
    ),
    "ROR": ("publication", {"authors": [CARBERRY | {"ror": "x"}]}, "authors[0].ror: 'x' is no ROR identifier; allowed"),
    "version that YAML takes for a number": (
        "publication",
        {"version": 1.10},
        "publication.version: 1.1 is no version; allowed: letters, digits and . + - _ between them, in quotes",
    ),
    "version that is a path": (
        "publication",
        {"version": "../1"},
        "publication.version: '../1' is no version; allowed",
    ),
    "no day": ("publication", {"date": "2026-02-30"}, "publication.date: '2026-02-30' is no date; allowed: year"),
    "no identifier": (
        "publication",
        {"related_identifiers": [{"identifier": "the paper", "relation": "Cites"}]},
        "publication.related_identifiers[0].identifier: 'the paper' is no identifier; allowed: a DOI such as",
    ),
    "no relation": (
        "publication",
        {"related_identifiers": [{"identifier": "10.1007/s11249-017-0900-2", "relation": "Quotes"}]},
        "publication.related_identifiers[0].relation: 'Quotes' is not a choice; allowed: 'IsCitedBy'",
    ),
    "no DOI": ("publication", {"doi": "reserved"}, "publication.doi: 'reserved' is no DOI; allowed: a DOI such as"),
    "funding without a funder": ("publication", {"funding": [{}]}, "publication.funding[0].funder: the key is missing"),
    "unknown key of a publication": (
        "publication",
        {"keyword": ["x"]},
        "publication.keyword: unknown key (did you mean 'keywords'?)",
    ),
    "author with the same ORCID twice": (
        "publication",
        {"authors": [CARBERRY | {"orcid": ORCID}, {"family_names": "C.", "given_names": "J.", "orcid": ORCID}]},
        "'J. C.' is given twice; allowed: every author once",
    ),
    "author with the same name twice": (
        "publication",
        {"authors": [CARBERRY | {"orcid": ORCID}, {"family_names": "carberry", "given_names": "Josiah "}]},
        "'Josiah  carberry' is given twice; allowed: every author once",
    ),
    "organisation twice": (
        "publication",
        {"authors": [{"name": "The team"}, CARBERRY, {"name": "The team"}]},
        "'The team' is given twice; allowed: every author once",
    ),
    "related identifier twice": (
        "publication",
        {
            "related_identifiers": [
                {"identifier": "10.1000/ABC", "relation": "Cites", "resource": "Text"},
                {"identifier": "https://doi.org/10.1000/abc", "relation": "Cites"},
            ]
        },
        "'Cites 10.1000/abc' is given twice; allowed: every relation to an identifier once",
    ),
    "known failure twice": (
        "publication",
        {"known_failures": [{"run": GOOD_RUN, "reason": "why"}, {"run": GOOD_RUN, "reason": "because"}]},
        f"'{GOOD_RUN}' is given twice; allowed: every run once",
    ),
    "funding twice": (
        "publication",
        {"funding": [{"funder": "A", "award_number": "1"}, {"funder": "a", "award_number": "1", "award_title": "T"}]},
        "'a' is given twice; allowed: every award of a funder once",
    ),
    "funding without an award twice": (
        "publication",
        {
            "funding": [
                {"funder": "A", "funder_id": "https://ror.org/00k4n6c32"},
                {"funder": "B", "funder_id": "00K4N6C32"},
            ]
        },
        "'B' is given twice; allowed: every award of a funder once",
    ),
    "control character in a name": (
        "publication",
        {"authors": [CARBERRY | {"affiliation": "Brown\x07 University"}]},
        "authors[0].affiliation: 'Brown\\x07 University' holds the control character '\\x07'; allowed: text of",
    ),
    "tab in a summary": (
        "publication",
        {"summary": "One\n\ttwo"},
        "publication.summary: 'One\\n\\ttwo' holds the control character '\\t'; allowed: text, with or without",
    ),
    "line break in a title": (
        "publication",
        {"title": "A title\n"},
        "publication.title: 'A title\\n' holds a line break; allowed: text of one line; in YAML, >-",
    ),
    "half a character": ("publication", {"title": "A\ud800"}, "holds the control character '\\ud800'; allowed: text"),
    "blank title": ("publication", {"title": " "}, "publication.title: ' ' is blank; allowed: text of one line"),
    "blank reason": (
        "publication",
        {"known_failures": [{"run": GOOD_RUN, "reason": "\n"}]},
        "publication.known_failures[0].reason: '\\n' is blank; allowed: text, with or without line breaks",
    ),
    "keyword without anything visible": (
        "publication",
        {"keywords": ["a", "\u200b"]},
        "keywords[1]: '\\u200b' is blank",
    ),
    "empty funder": ("publication", {"funding": [{"funder": ""}]}, "publication.funding[0].funder: '' is blank"),
    "check digits of a ROR": (
        "publication",
        {"authors": [{"name": "A", "ror": "https://ror.org/03yrm5c27"}]},
        "authors[0].ror: 'https://ror.org/03yrm5c27' is no ROR identifier: its check digits are wrong; allowed: one of",
    ),
    "ROR of a person without an affiliation": (
        "publication",
        {"authors": [CARBERRY | {"ror": "https://ror.org/05gq02987"}]},
        "publication.authors[0]: a person has no ROR; allowed: ror beside affiliation",
    ),
    "funder without a registry": (
        "publication",
        {"funding": [{"funder": "A", "funder_id": "https://example.org"}]},
        "funding[0].funder_id: 'https://example.org' is neither a ROR identifier nor a DOI; allowed: one of them, such",
    ),
    "check digits of a funder": (
        "publication",
        {"funding": [{"funder": "A", "funder_id": "00k4n6c33"}]},
        "funding[0].funder_id: '00k4n6c33' is no ROR identifier: its check digits are wrong",
    ),
    "bracket in a DOI": (
        "publication",
        {"doi": "10.1000/<1"},
        "publication.doi: '10.1000/<1' holds '<', which no web address can; allowed: none, or '%3C' for it",
    ),
    "space in an address": (
        "publication",
        {"related_identifiers": [{"identifier": "https://a.org/b c", "relation": "Cites"}]},
        "identifier: 'https://a.org/b c' holds ' ', which no web address can; allowed: none, or '%20' for it",
    ),
    "invisible character in an address": (
        "publication",
        {"funding": [{"funder": "A", "award_url": "https://a.org/\u200b"}]},
        "award_url: 'https://a.org/\\u200b' holds '\\u200b', which no web address can; allowed: characters that are",
    ),
    "community by its title": (
        "publication",
        {"communities": ["Contact Mechanics"]},
        "publication.communities[0]: 'Contact Mechanics' is no community of Zenodo; allowed: what its address ends",
    ),
    "day of another age": (
        "publication",
        {"date": "0026-01-31"},
        "publication.date: '0026-01-31' is no day of a publication; allowed: from 1900-01-01 to 2199-12-31",
    ),
    "day too late": ("publication", {"date": "2200-01-01"}, "'2200-01-01' is no day of a publication; allowed: from"),
    "time of day": ("publication", {"date": "2026-01-31 12:00:00"}, "'2026-01-31 12:00:00' is no date; allowed: year"),
    "failure of no run": (
        "publication",
        {"known_failures": [{"run": "one", "reason": "why"}]},
        "publication.known_failures[0].run: 'one' is not a run; allowed: a run of the campaign, such as one/",
    ),
}


@pytest.mark.parametrize("ror", ["03yrm5c26", "05gq02987", "00k4n6c32", "01bj3aw27", "02mhbdp94"])
def test_identifiers_of_real_institutions_have_their_check_digits(ror, load):
    written = (ror, f"http://ror.org/{ror}", f"https://ror.org/{ror.upper()}")
    authors = [{"name": str(number), "ror": each} for number, each in enumerate(written)]
    funding = [{"funder": str(number), "funder_id": each, "award_number": each} for number, each in enumerate(written)]
    publication = load({"publication": {"authors": authors, "funding": funding}}).campaign.publication
    found = {each.ror for each in publication.authors} | {each.funder_id for each in publication.funding}
    assert found == {f"https://ror.org/{ror}"}


def test_what_differs_may_stand_side_by_side(load):
    others = [{"funder": "A"}, {"funder": "A", "award_number": "1"}, {"funder": "A", "award_number": "2"}]
    paper = {"identifier": "10.1000/abc"}
    publication = {
        # Two of one name.
        "authors": [CARBERRY | {"orcid": ORCID}, CARBERRY | {"orcid": "0000-0001-5109-3700"}, {"name": "Carberry"}],
        "funding": [*others, {"funder": "B", "funder_id": "https://doi.org/10.13039/501100000780"}],
        "related_identifiers": [paper | {"relation": "Cites"}, paper | {"relation": "IsSupplementTo"}],
        "summary": "One\n\ntwo",
    }
    found = load({"publication": publication}).campaign.publication
    assert len(found.authors) == 3 and len(found.related_identifiers) == 2
    assert found.funding[-1].funder_id == "10.13039/501100000780"


def test_days_of_the_command_line(load):
    day = datetime.date(2026, 1, 31)
    assert load(overrides={"publication": {"date": day}}).campaign.publication.date == "2026-01-31"
    with pytest.raises(ConfigurationError, match=r"publication\.date: '2026-01-31T12:00:00' is no date; allowed: "):
        load(overrides={"publication": {"date": datetime.datetime(2026, 1, 31, 12)}})


def test_texts_of_the_campaign_that_no_deposit_can_have(load):
    title, summary = needed(load({"title": "A\nB", "summary": " "}).campaign.published())[-2:]
    assert title.startswith("title: 'A\\nB' holds a line break; allowed: ")
    assert summary.startswith("summary: ' ' is blank; allowed: ")


def test_figures_of_snapshots_need_one(load):
    figures = {"fig3_distributions": {"study": "one"}}
    load({"figures": figures})
    with pytest.raises(ConfigurationError, match=r"fig3_distributions\.study: 'one' keeps no snapshot to draw"):
        load({"figures": figures, "studies.one.snapshots": []})


def test_the_figure_of_tabor_parameters_needs_adhesion(load):
    figures = {"fig9_tabor": {"study": "one"}}
    load({"figures": figures})
    with pytest.raises(ConfigurationError, match=r"fig9_tabor\.study: 'one' has no material with adhesion"):
        load({"figures": figures, "materials.soft.surface_energy": "0 J/m^2"})


TRUTH = {"study": "one", "reduced_pressures": [0.003, 0.01]}
LONG_RANGE = {"materials.soft.interaction_range": "120 nm"}


def test_boundary_elements_are_a_product_of_the_studys_lists(load):
    campaign = load({**LONG_RANGE, "boundary_elements": {"truth": TRUTH | {"rms_slopes": [1.0]}}}).campaign
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
    campaign = load({**LONG_RANGE, "boundary_elements": entries}).campaign
    assert campaign.snapshots_of("one") == [own, *loads]
    # A study that names no snapshot keeps its last state as well, and one that wants none keeps the loads only.
    campaign = load({**LONG_RANGE, "boundary_elements": entries, "studies.one.snapshots": None}).campaign
    assert campaign.snapshots_of("one") == [("reduced_pressure", 0.01), loads[0], loads[2]]
    campaign = load({**LONG_RANGE, "boundary_elements": entries, "studies.one.snapshots": []}).campaign
    assert campaign.snapshots_of("one") == loads
    assert load({"studies.one.snapshots": None}).campaign.snapshots_of("one") is None


def test_the_map_is_compared_with_the_finest_solution_of_its_state(load):
    entries = {"coarse": TRUTH, "fine": TRUTH | {"refinement": 2, "seeds": [2]}}
    changes = {**LONG_RANGE, "boundary_elements": entries}

    def solution(**figure):
        campaign = load({**changes, "figures": {"fig4_contact_map": {"study": "one", **figure}}}).campaign
        return finest_solution(campaign, campaign.figures.fig4_contact_map)

    at_load = {"snapshot": {"reduced_pressure": 0.01}}
    assert solution(**at_load).path == "coarse/rough/seed1/slope0.2/soft/p0.01"
    assert solution(**at_load, seed=2, rms_slope=1.0).path == "fine/rough/seed2/slope1/soft/p0.01"
    assert solution(snapshot={"area_fraction": 0.02}) is None


def test_the_sources_of_the_error_are_drawn_without_adhesion(load):
    changes = {
        **LONG_RANGE,
        "error_sources": {"why": TRUTH | {"seeds": [2]}},
        "figures": {"fig12_error_sources": {"entry": "why"}},
    }
    with pytest.raises(ConfigurationError, match=r"fig12_error_sources\.entry: 'why' has not one material"):
        load(changes)
    bare = changes | {"materials.soft.surface_energy": "0 J/m^2"}
    # Its mean over the seeds is that of one surface at one slope.
    with pytest.raises(ConfigurationError, match=r"entry: 'why' has not one rms slope but 2 \(0\.2, 1\.0\)"):
        load(bare)
    del bare["figures"]
    campaign = load(bare).campaign
    cases = source_cases(campaign)
    assert [case.path for case in cases] == [f"why/rough/seed2/slope{slope}/soft" for slope in ("0.2", "1")]
    assert source_settings(campaign, cases[1]) == {
        "material": {"contact_modulus": 25e6, "surface_energy": 0.0, "interaction_range": pytest.approx(120e-9)},
        "rms_slope": 1.0,
        "seed": 2,
        "reduced_pressures": [0.003, 0.01],
        "refinement": 2,
        "tolerance": 1e-8,
    }
    assert campaign.snapshots_of("one") == [("area_fraction", 0.02)]  # the runs are none of their concern


def test_one_asperity_is_hertzs_and_one_for_every_tabor_parameter(load):
    assert asperity_cases(load().campaign) == {}
    campaign = load({"one_asperity": {"tabor_parameters": [2, 2.8]}}).campaign
    assert asperity_cases(campaign) == {"hertz": None, "mu2": 2.0, "mu2.8": 2.8}


def paths(campaign):
    return [case.path.removeprefix("one/") for case in run_cases(campaign)]


def test_random_surfaces_and_files_share_a_study(load, tmp_path):
    np.save(tmp_path / "own.npy", np.random.default_rng(1).random((16, 16)))
    campaign = load({"surfaces.own": _file_surface("own.npy"), "studies.one.surfaces": ["rough", "own"]}).campaign
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


def test_lists_that_go_along_together(load):
    changes = {
        "studies.one.vary": {"hurst": [0.5, 0.9]},
        "studies.one.zip": [["rms_slopes", "hurst"]],
        "studies.one.seeds": "3..5",
    }
    expected = {(f"rough-hurst{hurst}", seed, slope) for hurst, slope in ((0.5, 0.2), (0.9, 1.0)) for seed in (3, 4, 5)}
    cases = run_cases(load(changes).campaign)
    assert {(case.surface, case.seed, case.rms_slope) for case in cases} == expected
    assert len(cases) == len(expected)


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
    assert len(run_cases(campaign)) == 3 * 2 * 2
    with pytest.raises(ConfigurationError, match=r"defaults\.materials\.interaction_range: '2 m\^2'"):
        load({**changes, "defaults": {"materials": {"interaction_range": "2 m^2", "surface_energy": "1 mJ/m^2"}}})


def test_the_slope_that_a_topography_has(load, tmp_path):
    period, amplitude, size = 1e-3, 2e-6, 32
    x = np.arange(size) / size * period
    heights = amplitude * np.sin(2 * np.pi / period * x) * np.ones((size, 1))
    np.save(tmp_path / "own.npy", heights * 1e6)
    campaign = load({"surfaces.rough": _file_surface("own.npy"), "studies.one.rms_slopes": "measured"}).campaign
    (case,) = run_cases(campaign)
    assert case.rms_slope == pytest.approx(2 * np.pi / period * amplitude / np.sqrt(2), rel=1e-5)
    assert case.path == f"one/rough/seed0/slope{number_label(case.rms_slope)}/soft"


def test_what_names_a_varied_surface_means_its_variants(load):
    changes = {
        **LONG_RANGE,
        "studies.one.vary": {"hurst": [0.5, 0.9]},
        "boundary_elements": {"truth": TRUTH | {"surfaces": ["rough"], "rms_slopes": [1.0]}},
        "figures": {"fig4_contact_map": {"study": "one", "surface": "rough", "seed": 2}},
    }
    campaign = load(changes).campaign
    assert {case.surface for case in solution_cases(campaign)} == {"rough-hurst0.5", "rough-hurst0.9"}
    assert len(solution_cases(campaign)) == 2 * 2 * 2
    assert campaign.figures.fig4_contact_map.surface == "rough-hurst0.5"
    used = load({**changes, "boundary_elements": {"truth": TRUTH | {"surfaces": ["rough-hurst0.9"]}}}).campaign
    assert {case.surface for case in solution_cases(used)} == {"rough-hurst0.9"}


@pytest.mark.parametrize(
    ("value", "label"), [(4e-8, "40nm"), (1.5625e-6, "1.5625um"), (0.1, "100mm"), (1e-4, "100um"), (12.0, "12m")]
)
def test_names_of_variants_are_read_by_people(value, label, load):
    assert value_label(load().campaign.surfaces["rough"].model_copy(update={"period": value}), "period") == label


def _measured_surface(**changes):
    scan = REPOSITORY / "config/topographies/synthetic_scan.txt"
    section = {"kind": "measured", "path": str(scan), "height_unit": "nm", "size": ["72 um", "64 um"]}
    return section | {"missing": "fill", "boundary": "window"} | changes


def test_a_measured_surface_at_its_own_slope(load):
    campaign = load({"surfaces.rough": _measured_surface(), "studies.one.rms_slopes": "measured"}).campaign
    (case,) = run_cases(campaign)
    topography = campaign.topography("rough")
    assert (case.seed, case.rms_slope) == (0, topography.rms_slope)
    assert (topography.grid, topography.period, topography.boundary) == (128, 64e-6, "periodic")
    assert icha.surfaces.measured.topography.prepared_topography(
        campaign.surfaces["rough"].path, surface_settings_of_file(campaign, "rough")
    ).rms_slope == pytest.approx(case.rms_slope, rel=1e-5)


def surface_settings_of_file(campaign, name):
    return {key: value for key, value in surface_settings(campaign, name).items() if key != "kind"}


def test_the_preparation_of_a_measured_surface_is_varied(load):
    changes = {
        "surfaces.rough": _measured_surface(),
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


def test_another_file_of_the_same_name_is_another_run(load, tmp_path):
    def checksum():
        campaign = load({"surfaces.rough": _file_surface("own.npy")}).campaign
        return run_sha256(campaign, run_cases(campaign)[0])

    heights = np.random.default_rng(1).random((16, 16))
    np.save(tmp_path / "own.npy", heights)
    first = checksum()
    np.save(tmp_path / "own.npy", heights)
    assert checksum() == first
    np.save(tmp_path / "own.npy", heights + 1)
    assert checksum() != first


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"path": "none.txt"}, "surfaces.rough.path: "),
        ({"boundary": "reflecting"}, "surfaces.rough.boundary: 'reflecting' is not a choice; allowed: 'periodic'"),
        ({"boundary": None}, "surfaces.rough.boundary: the key is missing; needed: What lies beyond the edges"),
        ({"missing": "refuse"}, "surfaces.rough.missing: 'refuse'"),
        ({"height_unit": None}, "surfaces.rough.height_unit: "),
        ({"height_unit": "kg"}, "surfaces.rough.height_unit: 'kg'"),
        ({"size": ["1 mm"]}, "surfaces.rough.size: ['1 mm'] has 1 entries; allowed: one length"),
        ({"crop": {"x": "0 um", "y": "0 um", "side": "1 mm"}}, "surfaces.rough.crop: "),
        ({"crop": {"x": "0 um", "z": "0 um"}}, "surfaces.rough.crop.z: unknown key"),
        ({"taper": 0.7}, "surfaces.rough.taper: 0.7 is out of range; allowed: a number in (0, 0.5]"),
        ({"boundary": "mirror", "taper": 0.2}, "taper: is for boundary window, this one is mirror; allowed"),
        ({"boundary": "periodic", "detrend": "tilt"}, "detrend: 'tilt' would break the periodicity; allowed"),
        ({"format": "xyz"}, "surfaces.rough.path: "),
        ({"hurst": 0.8}, "surfaces.rough.hurst: unknown key"),
    ],
)
def test_mistakes_about_measured_surfaces(changes, message, load, tmp_path):
    section = {key: value for key, value in _measured_surface(**changes).items() if value is not None}
    with pytest.raises(ConfigurationError) as error:
        load({"surfaces.rough": section})
    lines = str(error.value).splitlines()
    assert any(message in line and line.startswith(f"{tmp_path}/campaign.yaml: ") for line in lines), lines
    assert all("allowed: " in line or "needed: " in line for line in lines), lines


def test_boundary_elements_are_periodic(load):
    changes = {"surfaces.rough": _measured_surface(boundary="free"), "boundary_elements": {"truth": TRUTH}}
    with pytest.raises(
        ConfigurationError, match=r"boundary_elements\.truth\.study: 'one' has a surface without periods"
    ):
        load({**changes, "materials.soft.surface_energy": "0 J/m^2"})


@pytest.mark.parametrize("case", BAD, ids=lambda case: case.replace(" ", "_"))
def test_mistakes_are_named(case, load, tmp_path):
    key, value, message = BAD[case]
    with pytest.raises(ConfigurationError) as error:
        load({key: value} if key else value)
    lines = str(error.value).splitlines()
    assert any(message in line and line.startswith(f"{tmp_path}/campaign.yaml: ") for line in lines), lines
    assert all("allowed: " in line or "needed: " in line or case == "ORCID" for line in lines), lines


def test_all_mistakes_are_named_at_once(load):
    with pytest.raises(ConfigurationError) as error:
        load({"name": "A B", "surfaces.rough.hurst": 2, "materials.soft.surface_energy": "1 m", "extra": 1})
    assert len(str(error.value).splitlines()) == 4


def test_overrides_are_checked_and_named(load, tmp_path):
    assert load(overrides={"surfaces": {"rough": {"hurst": 0.5}}}).campaign.surfaces["rough"].hurst == 0.5
    with pytest.raises(ConfigurationError) as error:
        load({"title": 1}, overrides={"surfaces": {"rough": {"hurst": 5}}})
    assert sorted(line.split(": ")[0] for line in str(error.value).splitlines()) == [
        "--config",
        f"{tmp_path}/campaign.yaml",
    ]


def test_overrides_are_part_of_the_configuration_as_used(load, tmp_path):
    configuration = load(overrides={"surfaces": {"rough": {"hurst": 0.5}}})
    again = tmp_path / "used.yaml"
    again.write_text(configuration.text)
    assert load_configuration(again) == configuration


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"- 1\n", "the file is a list"),
        (b"a: [1\n", "allowed: a YAML mapping"),
        (b"a: 1\nb: 1\na: 2\n", "line 3: key 'a' is given twice"),
        (b"m:\n  x: {k: 1, k: 2}\n", "line 2: key 'k' is given twice"),
        (b"\xff\xfe\x00", "not a text file"),
        (b"a: !!python/object:os.system {}\n", "allowed: a YAML mapping"),
    ],
)
def test_files_that_are_no_configuration(content, message, tmp_path):
    file = tmp_path / "campaign.yaml"
    file.write_bytes(content)
    with pytest.raises(ConfigurationError, match=message) as error:
        load_configuration(file)
    assert str(error.value).startswith(str(file))


def test_missing_file(tmp_path):
    with pytest.raises(ConfigurationError, match="No such file"):
        load_configuration(tmp_path / "none.yaml")


def test_few_cells_are_a_warning(load):
    assert not load().campaign.warnings()
    (warning,) = load({"surfaces.rough.grid": 30}).campaign.warnings()
    assert "surfaces.rough.grid: 30 gives 3 grid cells" in warning
    assert load({"surfaces.rough.grid": 20}).campaign.warnings()


def test_slopes_that_no_surface_has_are_a_warning(load):
    changes = {"surfaces.rough": _measured_surface(height_unit="um"), "studies.one.rms_slopes": "measured"}
    (warning,) = load(changes).campaign.warnings()
    assert "surfaces.rough: the topography has an rms slope of 145" in warning and "units" in warning


def _file_surface(path):
    return {"kind": "file", "path": str(path), "height_unit": "um", "period": "1 mm"}


@pytest.mark.parametrize(
    ("heights", "message"),
    [
        (np.full((16, 16), np.nan), "256 of 256 heights that are not finite"),
        (np.where(np.eye(16) > 0, np.inf, 1.0), "16 of 256 heights that are not finite"),
        (np.ones((16, 15)), r"shape \(16, 15\)"),
        (np.ones((16, 16, 2)), r"shape \(16, 16, 2\)"),
        (np.ones((4, 4)), r"shape \(4, 4\)"),
        (np.ones((16, 16)), "all the same"),
        (np.full((16, 16), "a"), "not real numbers"),
    ],
)
def test_surface_files_are_read_before_anything_runs(heights, message, load, tmp_path):
    np.save(tmp_path / "heights.npy", heights)
    with pytest.raises(ConfigurationError, match=f"surfaces.rough.path: .*{message}"):
        load({"surfaces.rough": _file_surface("heights.npy")})


def test_damaged_surface_files(load, tmp_path):
    for name in ("heights.npy", "heights.nc", "heights.txt"):
        (tmp_path / name).write_bytes(b"nothing of the kind")
        with pytest.raises(ConfigurationError, match="cannot be read"):
            load({"surfaces.rough": _file_surface(name)})


def test_a_surface_file_is_one_realisation_beside_the_configuration(load, tmp_path):
    np.save(tmp_path / "heights.npy", np.random.default_rng(1).normal(size=(16, 16)))
    campaign = load({"surfaces.rough": _file_surface("heights.npy")}).campaign
    assert surface_cases(campaign) == [("rough", 0)]
    assert campaign.surfaces["rough"].path == str(tmp_path / "heights.npy")
    assert surface_settings(campaign, "rough") == {"kind": "file", "period": 1e-3, "metres_per_unit": 1e-6}


def test_ranges_are_held_against_the_grid_of_a_surface_file(load, tmp_path):
    np.save(tmp_path / "heights.npy", np.random.default_rng(1).normal(size=(16, 16)))
    changes = {"surfaces.rough": _file_surface("heights.npy"), "boundary_elements": {"truth": TRUTH}}
    with pytest.raises(ConfigurationError, match=r"truth\.materials: 'soft' on .* spacing 6\.25e-05 m"):
        load(changes)
    assert len(solution_cases(load({**changes, "materials.soft.surface_energy": "0 J/m^2"}).campaign)) == 4


def _measurement(**changes):
    return {
        "path": "points.csv",
        "label": "measured",
        "citation": "someone",
        "study": "one",
        "load": {"column": "p", "unit": "kPa"},
        "area": {"column": "a", "unit": "percent"},
        "material": "soft",
        "rms_slope": 0.5,
    } | changes


def test_measurements(load, tmp_path):
    (tmp_path / "points.csv").write_text("p, a\n10, 1\n20, 2.5\n")
    changes = {"measurements": {"lab": _measurement()}, "figures": {"fig5_multi_slope": {"study": "one"}}}
    campaign = load(changes).campaign
    (settings,) = campaign.figures.arguments("fig5_multi_slope", campaign)["measurements"]
    assert settings["columns"] == {"p": 1e3, "a": 0.01}
    assert settings["load_unit"] == 25e6 * 0.5


@pytest.mark.parametrize(
    ("table", "changes", "message"),
    [
        ("p,a\n", {}, "holds no values"),
        ("p,b\n1,2\n", {}, "has no column 'a'; allowed: p, b"),
        ("p,a\n1,2\n3,x\n", {}, "column 'a', row 2: 'x'"),
        ("p,a\n1,nan\n", {}, "numbers greater than 0"),
        ("p,a\n1,-2\n", {}, "numbers greater than 0"),
        ("p,a\n1,2\n", {"path": "none.csv"}, "cannot be read"),
        ("p,a\n1,2\n", {"study": "two"}, "'two' is not defined"),
        ("p,a\n1,2\n", {"material": "hard"}, "'hard' is not defined"),
        ("p,a\n1,2\n", {"rms_slope": None}, "without material and rms_slope"),
        ("p,a\n1,2\n", {"load": {"column": "p", "unit": "kg"}}, "a unit of pressure"),
        ("p,a\n1,2\n", {"area": {"column": "a", "unit": "m"}}, "allowed: '1' or 'percent'"),
        ("p,a\n1,2\n", {"area": {"column": "p", "unit": "1"}}, "allowed: another one"),
    ],
)
def test_measurements_that_cannot_be_drawn(table, changes, message, load, tmp_path):
    (tmp_path / "points.csv").write_text(table)
    with pytest.raises(ConfigurationError, match=r"measurements\.lab") as error:
        load({"measurements": {"lab": _measurement(**changes)}})
    assert message in str(error.value)


def test_days_that_no_calendar_has_are_text_until_they_are_checked(tmp_path):
    (tmp_path / "one.yaml").write_text("publication: {date: 2026-02-30}")
    assert read_yaml(tmp_path / "one.yaml") == {"publication": {"date": "2026-02-30"}}


def test_schema_and_tables_are_those_of_the_model():
    advice = "out of date: run `make schema`"
    assert (REPOSITORY / "workflow/schemas/config.schema.json").read_text(encoding="utf-8") == json_schema(), advice
    readme = (REPOSITORY / "config/README.md").read_text(encoding="utf-8")
    assert readme == readme_with_tables(readme), advice


def test_every_key_is_described():
    def sections(kind):
        yield kind
        for child in kind.__subclasses__():
            yield from sections(child)

    for section in sections(Section):
        for key, field in section.model_fields.items():
            assert field.description, f"{section.__name__}.{key}"
