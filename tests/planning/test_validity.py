"""Expected validity before a run: curvatures, Tabor parameters and stickiness of the surfaces."""

import re

import numpy as np
import pytest
import small_campaign as small

from icha.asperity.material import Material
from icha.asperity.stickiness import stickiness
from icha.configuration.campaign import Contact
from icha.configuration.load import load_configuration
from icha.configuration.plausibility import rms_curvature
from icha.planning.validity import expected_validity
from icha.surfaces.measured.topography import prepared_topography
from icha.surfaces.moments import spectral_moments

CAMPAIGN = """
name: outside
title: Outside
summary: For tests.
license: CC0-1.0
confirmed: [surfaces.scan.grid]
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
    rough, scanned = (Contact(name, 0, 1.0, "bare") for name in ("rough", "scan"))
    assert rms_curvature(campaign, rough) == pytest.approx(surface.rms_curvature / surface.rms_slope, rel=0.1)
    section = campaign.surfaces["scan"]
    scan = prepared_topography(section.path, section.preparation).surface
    assert rms_curvature(campaign, scanned) == pytest.approx(scan.rms_curvature / scan.rms_slope)


def test_materials_and_surfaces_outside_are_named_before_the_run(campaign):
    found = {each.about: each for each in expected_validity(campaign)}
    assert not found["jump-in"].good
    assert "expected outside this range: below on rough (about 0.63)" in found["jump-in"].text
    assert "bare" not in found["jump-in"].text and "inside on" not in found["jump-in"].text
    assert "the accuracy of this campaign is unknown (rough: cells per shortest wave" in found["accuracy"].text
    assert ". scan: " in found["accuracy"].text
    assert "sticky" not in found


def test_surfaces_that_stick_are_named_before_the_run(tmp_path):
    stiff, soft = "{contact_modulus: 25 MPa, surface_energy: 50", "{contact_modulus: 1 MPa, surface_energy: 500"
    (tmp_path / "sticky.yaml").write_text(CAMPAIGN.replace(f"inside: {stiff}", f"inside: {soft}"))
    np.save(tmp_path / "scan.npy", np.random.default_rng(1).normal(size=(40, 40)))
    campaign = load_configuration(tmp_path / "sticky.yaml").campaign
    (said,) = [each for each in expected_validity(campaign) if each.about == "sticky"]
    moments = spectral_moments(small.surface().scaled_to_rms_slope(1.0))
    exact = stickiness(moments, Material(1e6, 0.5, 8e-9))
    told = re.fullmatch(r"attraction outweighs repulsion: inside on rough \(stickiness (\S+)\); .*", said.text)
    assert exact > 1 and float(told.group(1)) == pytest.approx(exact, rel=0.1) and not said.good
