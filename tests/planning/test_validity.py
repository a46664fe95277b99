"""Expected validity before a run: curvatures, Tabor parameters and stickiness of the surfaces."""

import re

import numpy as np
import pytest
import small_campaign as small
from demo_configuration import measured_surface

from icha.asperity.material import Material
from icha.asperity.stickiness import stickiness
from icha.configuration.plausibility import rms_curvature
from icha.datasets.labels import RunLabels
from icha.half_space.layer import softness_of
from icha.planning.validity import expected_validity
from icha.surfaces.measured.topography import prepared_topography
from icha.surfaces.moments import spectral_moments

MATERIAL = {"contact_modulus": "25 MPa", "surface_energy": "50 mJ/m^2", "interaction_range": "2 nm"}
STUDY = {"rms_slopes": [1.0], "targets": {"reduced_pressures": [1e-2]}}
CHANGES = {
    "confirmed": ["surfaces.scan.grid"],
    "surfaces.rough.rolloff_wavelength": "40 um",
    "surfaces.rough.short_wavelength": "14.3 um",
    "surfaces.rough.grid": 32,
    "surfaces.scan": measured_surface(path="scan.npy", size="50 um", height_unit="um"),
    "materials.bare": MATERIAL | {"surface_energy": "0 mJ/m^2"},
    "materials.inside": MATERIAL | {"interaction_range": "8 nm"},
    "materials.below": MATERIAL | {"interaction_range": "40 nm"},
    "studies": {
        "load": STUDY | {"surfaces": ["rough"], "materials": ["bare", "inside", "below"]},
        "scanned": STUDY | {"surfaces": ["scan"], "materials": ["bare"]},
    },
}


def test_curvatures_are_those_of_the_surfaces(campaign):
    surface = small.surface()
    rough, scanned = (RunLabels("outside", "asperities", name, 0, 1.0, "bare") for name in ("rough", "scan"))
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


def test_surfaces_that_stick_are_named_before_the_run(read):
    soft = {"contact_modulus": "1 MPa", "surface_energy": "500 mJ/m^2", "interaction_range": "8 nm"}
    campaign = read(CHANGES | {"materials.inside": soft})
    (said,) = [each for each in expected_validity(campaign) if each.about == "sticky"]
    moments = spectral_moments(small.surface().scaled_to_rms_slope(1.0))
    exact = stickiness(moments, Material(1e6, 0.5, 8e-9))
    told = re.fullmatch(r"attraction outweighs repulsion: inside on rough \(stickiness (\S+)\); .*", said.text)
    assert exact > 1 and float(told.group(1)) == pytest.approx(exact, rel=0.1) and not said.good


FILM = {"contact_modulus": "2 MPa", "surface_energy": "5 mJ/m^2", "thickness": "10 um", "poisson_ratio": 0.4}
ON_LAYERS = {
    "confirmed": ["surfaces.scan.grid"],
    "surfaces.wave": {"kind": "file", "path": "wave.npy", "height_unit": "um", "period": "100 um"},
    "surfaces.scan": measured_surface(path="scan.npy", size="50 um", height_unit="um"),
    "materials.soft": FILM | {"interaction_range": "20 nm"},
    "studies.one": {
        "surfaces": ["wave"],
        "materials": ["soft"],
        "rms_slopes": ["measured"],
        "models": ["boundary_elements"],
        "targets": {"pressures": ["10 kPa"]},
    },
}


def test_a_wave_on_a_layer_has_its_pressures_and_energy_before_the_run(read, tmp_path):
    """q Delta^2 E*/(8 phi dgamma) = 15.4, E* q Delta/(2 phi) = 308.5 kPa; phi by K. L. Johnson (1985), sec. 13.5."""
    x = np.arange(96) / 96
    np.save(tmp_path / "wave.npy", np.cos(2 * np.pi * x)[None, :] + np.zeros((96, 1)))
    (adhesion,) = (each for each in expected_validity(read(ON_LAYERS)) if each.about == "adhesion")
    a, nu = 0.2 * np.pi, 0.4
    above = (3 - 4 * nu) * np.sinh(2 * a) - 2 * a
    pressure = 2e6 * np.pi / 100 * ((3 - 4 * nu) * np.cosh(2 * a) + 2 * a**2 + 5 - 12 * nu + 8 * nu**2) / above
    strength = 16 * 5e-3 / (9 * np.sqrt(3) * 20e-9)
    assert f"U_full/dgamma is about {pressure * 1e-6 / 4 / 5e-3:.3g} or more" in adhesion.text
    assert f"complete at about {round(pressure, -4) / 1e3:g} kPa" in adhesion.text
    assert f"opens at about {(pressure - strength) / 1e3:.2g} kPa" in adhesion.text
    assert adhesion.text.startswith("closes under load only") and adhesion.good


@pytest.mark.parametrize("name", ["rough", "scan"])
def test_rough_surfaces_on_layers_have_the_energy_of_their_runs_before_the_run(name, read):
    slope = {"studies.one.surfaces": [name], "studies.one.rms_slopes": [0.05]}
    campaign = read(CHANGES | ON_LAYERS | slope)
    (adhesion,) = (each.text for each in expected_validity(campaign) if each.about == "adhesion")
    surface = small.surface()
    if name == "scan":
        section = campaign.surfaces["scan"]
        surface = prepared_topography(section.path, section.preparation).surface
    energy = surface.scaled_to_rms_slope(0.05).full_contact(softness_of(campaign.materials["soft"].material)).energy
    (ratio,) = re.findall(r"U_full/dgamma is about (\S+) or more", adhesion)
    assert float(ratio) == pytest.approx(energy * 2e6 / 5e-3, rel=0.01)
    assert "bearing area" not in adhesion, "its laws are those of a half-space"


def smooth(**shape):
    return {"kind": "smooth", "side": "400 um", "grid": 64, "shape": shape}


RUBBER = {"contact_modulus": "2.7 MPa", "surface_energy": "50 mJ/m^2"}
INDENTERS = {
    "surfaces": {"ball": smooth(sphere={"radius": "1 mm"}), "punch": smooth(cylinder_punch={"radius": "100 um"})},
    "materials.rubber": RUBBER | {"interaction_range": "2 nm"},
    "materials.film": RUBBER | {"thickness": "32 um", "poisson_ratio": 0.5},
    "studies.one": {
        "surfaces": ["ball", "punch"],
        "materials": ["rubber", "film"],
        "models": ["boundary_elements"],
        "targets": {"forces": ["0 mN", "0.2 mN"]},
    },
}
UNLOAD = {"studies.one.unload": True}


@pytest.mark.parametrize(
    ("pressure", "energy", "radius"), [("10 kPa", 50, "97.98"), ("100 kPa", 50, "178.2"), ("10 kPa", 0, "76.31")]
)
def test_pressures_on_indenters_are_compared_with_the_square(pressure, energy, radius, read):
    """By hand: JKR a^3 = 3 R/(4 E*) [F + 3 pi w R + sqrt(6 pi w R F + (3 pi w R)^2)], and Hertz with w = 0."""
    study = {"surfaces": ["ball"], "materials": ["rubber"], "targets": {"pressures": [pressure]}}
    changes = {f"studies.one.{key}": value for key, value in study.items()}
    said = expected_validity(read(INDENTERS | changes | {"materials.rubber.surface_energy": f"{energy} mJ/m^2"}))
    (ball,) = (each.text for each in said if each.about == "indenter")
    assert f"at most {radius} µm; half the side is 200 µm" in ball


def test_contacts_of_indenters_are_compared_with_the_square_and_the_layer(read):
    """JKR at zero load: a^3 = 9 pi w R^2/(2 E*); at the indentation 0: a^3 = 2 pi w R^2/E*. Kendall: 8 pi E* w a^3."""
    said = expected_validity(read(INDENTERS))
    ball, punch = (each.text for each in said if each.about == "indenter")
    at_rest, jumped = ((factor * np.pi * 0.05 * 1e-6 / 2.7e6) ** (1 / 3) * 1e6 for factor in (4.5, 2))
    assert f"pull-off force of 235.6 µN, and a contact radius of {jumped:.4g} µm after the jump-in, " in ball
    assert f"{at_rest:.4g} µm (10 cells) at zero load, at most 71.43 µm; half the side is 200 µm" in ball
    assert "theory of Kendall, rubber on punch without roughness has a pull-off force of 1.842 mN" in punch
    assert "computed force" not in punch
    (punch,) = (each for each in expected_validity(read(INDENTERS | UNLOAD)) if "Kendall" in each.text)
    few = "radius at pull-off has 16 cells: the computed force is about 12 % too small"
    assert few in punch.text and not punch.good


@pytest.mark.parametrize(
    ("energy", "targets", "radius"),
    [
        (0, {"forces": ["0.1 mN", "0.4 mN", "1 mN"]}, (0.75 * 1e-3 * 1e-3 / 2.7e6) ** (1 / 3)),
        (50, {"forces": ["0.1 mN", "0.4 mN", "1 mN"]}, None),
        (50, {"pressures": ["1 kPa", "6.25 kPa"]}, None),
        (0, {"indentations": ["1 um", "4 um"]}, (4e-6 * 1e-3) ** 0.5),
        (50, {"contact_radii": ["80 um", "90 um"]}, 90e-6),
    ],
)
def test_the_contact_radius_on_a_layer_is_that_of_a_half_space_at_the_largest_target(energy, targets, radius, read):
    """By hand: Hertz a^3 = 3 R F/(4 E*) and a^2 = R delta; JKR a^3 = 3 R/(4 E*) [F + W + sqrt(2 W F + W^2)]."""
    if radius is None:
        unit = 3 * np.pi * 0.05 * 1e-3
        radius = (0.75e-3 / 2.7e6 * (1e-3 + unit + np.sqrt(2 * unit * 1e-3 + unit**2))) ** (1 / 3)
    film = {"surface_energy": f"{energy} mJ/m^2", "thickness": "30 um", "poisson_ratio": 0.3}
    study = {"studies.one.surfaces": ["ball"], "studies.one.materials": ["film"], "studies.one.targets": targets}
    campaign = read(INDENTERS | {"materials.film": RUBBER | film} | study)
    (layer,) = (each for each in expected_validity(campaign) if each.about == "layer")
    assert f"is {radius / 30e-6:.2g} of the thickness for film on ball (as on a half-space)" in layer.text
    assert not layer.good
