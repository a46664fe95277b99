"""What is expected, before a run, of where the jump into contact lies outside what was verified."""

import numpy as np
import pytest
import small_campaign as small

from icha.configuration.load import load_configuration
from icha.datasets.campaign_file.write import write_campaign
from icha.planning.roughness import rms_curvature
from icha.planning.validity import expected_validity, found_validity
from icha.surfaces.measured.topography import prepared_topography

CAMPAIGN = """
name: outside
title: Outside
summary: For tests.
license: CC0-1.0
surfaces:
  rough: {kind: self_affine, period: 100 um, rolloff_wavelength: 40 um, short_wavelength: 14.3 um, hurst: 0.8, grid: 32}
  scan: {kind: measured, path: scan.npy, size: 50 um, height_unit: um, boundary: window}
materials:
  bare: {contact_modulus: 25 MPa, surface_energy: 0 mJ/m^2, interaction_range: 2 nm}
  inside: {contact_modulus: 25 MPa, surface_energy: 50 mJ/m^2, interaction_range: 8 nm}
  below: {contact_modulus: 25 MPa, surface_energy: 50 mJ/m^2, interaction_range: 40 nm}
studies:
  load:
    surfaces: [rough]
    rms_slopes: [1.0]
    materials: [bare, inside, below]
    targets: {reduced_pressures: [1.0e-2]}
  scanned:
    surfaces: [scan]
    rms_slopes: [1.0]
    materials: [bare]
    targets: {reduced_pressures: [1.0e-2]}
"""


@pytest.fixture
def campaign(tmp_path):
    np.save(tmp_path / "scan.npy", np.random.default_rng(1).normal(size=(40, 40)))
    (tmp_path / "outside.yaml").write_text(CAMPAIGN)
    return load_configuration(tmp_path / "outside.yaml").campaign


def test_curvatures_are_those_of_the_surfaces(campaign):
    surface = small.surface()
    assert rms_curvature(campaign, "rough") == pytest.approx(surface.rms_curvature / surface.rms_slope, rel=0.1)
    section = campaign.surfaces["scan"]
    scan = prepared_topography(section.path, section.preparation).surface
    assert rms_curvature(campaign, "scan") == pytest.approx(scan.rms_curvature / scan.rms_slope)


def test_materials_and_surfaces_outside_are_named_before_the_run(campaign):
    found = {each.about: each for each in expected_validity(campaign)}
    assert not found["jump-in"].good
    assert "expected outside: below on rough (about 0.63)" in found["jump-in"].text
    assert "bare" not in found["jump-in"].text and "inside on" not in found["jump-in"].text
    assert found["accuracy"].text.endswith("not of this kind: scan")


def test_afterwards_the_dataset_says_it(campaign, tmp_path):
    write_campaign(small.runs(), tmp_path / "c.nc")
    assert found_validity(campaign, tmp_path / "c.nc")[1].text.endswith("; all cases inside")
