"""Shapes, smooth surfaces, free squares and layers in a configuration."""

import math

import pytest

from icha.configuration.cases import adhesive_contacts, run_settings, surface_cases, surface_settings
from icha.surfaces.shapes import Cone, CylinderPunch, FlatPunch, Paraboloid, Sphere, Wave

BALL = {"kind": "smooth", "side": "200 um", "grid": 64, "shape": {"sphere": {"radius": "1 mm"}}}
# A study of boundary elements, because the asperity model does not accept shapes and layers.
BY_CELLS = {"studies.one.models": ["boundary_elements"]}


def paths(campaign):
    return [case.path for case in campaign.all_runs]


def test_a_smooth_surface_has_neither_seeds_nor_slopes(load):
    ball = BY_CELLS | {"surfaces.ball": BALL}
    alone = ball | {"studies.one.surfaces": ["ball"], "studies.one.rms_slopes": None}
    assert paths(load(alone).campaign) == ["one/ball/seed0/slope0/boundary_elements/soft"]
    campaign = load(ball | {"studies.one.surfaces": ["ball", "rough"]}).campaign
    assert surface_cases(campaign) == [("ball", 0), ("rough", 1), ("rough", 2)]
    assert len(paths(campaign)) == 1 + 2 * 2
    assert campaign.is_free("ball") and campaign.period("ball") == 200e-6


@pytest.mark.parametrize(
    ("section", "shape"),
    [
        ({"sphere": {"radius": "1 mm"}}, Sphere(1e-3)),
        ({"paraboloid": {"radii": ["1 mm", "2 mm"]}}, Paraboloid((1e-3, 2e-3))),
        ({"cylinder_punch": {"radius": "30 um"}}, CylinderPunch(30e-6)),
        ({"flat_punch": {"side": "50 um"}}, FlatPunch(50e-6)),
        ({"cone": {"half_angle": "80 deg"}}, Cone(math.radians(80))),
        ({"wave": {"radius": "1 mm", "amplitude": "-1 um", "wavelength": "20 um"}}, Wave(1e-3, -1e-6, 20e-6)),
    ],
    ids=lambda each: next(iter(each)) if isinstance(each, dict) else "",
)
def test_a_shape_is_read_with_its_units_and_makes_the_surface_free(section, shape, load):
    campaign = load(BY_CELLS | {"surfaces.rough.shape": section}).campaign
    found = campaign.surfaces["rough"].shape.shape
    assert type(found) is type(shape)
    for name, value in vars(shape).items():
        assert getattr(found, name) == pytest.approx(value, rel=1e-12)
    assert campaign.is_free("rough")
    assert surface_settings(campaign, "rough")["boundary"] == "free"


def test_defaults_are_not_among_the_settings_on_which_checksums_depend(load):
    """Results of campaigns without the keys of indenters stay valid, also if a default is written out."""
    plain, written = load().campaign, load({"surfaces.rough.boundary": "periodic"}).campaign
    assert surface_settings(plain, "rough") == surface_settings(written, "rough")
    assert not {"boundary", "shape"} & set(surface_settings(plain, "rough"))
    material = run_settings(plain, plain.all_runs[0])["material"]
    assert not {"thickness", "poisson_ratio"} & set(material)
    assert surface_settings(load({"surfaces.rough.boundary": "free"}).campaign, "rough")["boundary"] == "free"


def test_the_thickness_of_a_layer_is_varied(load):
    changes = BY_CELLS | {"materials.soft.poisson_ratio": 0.5, "studies.one.vary": {"thickness": ["1 mm", "2 mm"]}}
    campaign = load(changes).campaign
    layers = {case.material: campaign.materials[case.material].thickness for case in campaign.all_runs}
    assert sorted(layers.values()) == [1e-3, 2e-3]
    # Fuller & Tabor and other theories are for half-spaces.
    assert adhesive_contacts(load(BY_CELLS).campaign, "rough") and not adhesive_contacts(campaign, "rough")


@pytest.mark.parametrize(
    ("shape", "energy", "targets", "key", "radius"),
    [
        # Radius of JKR at the indentation 0: a^3 = 2 pi w R^2/E*, with 50 mJ/m^2, 10 mm and 25 MPa.
        ({"sphere": {"radius": "10 mm"}}, 50, {"forces": ["0.1 mN"]}, "surfaces: ['ball']", "108 um after the jump-in"),
        # Sneddon's cone: a^2 = 2 F tan(80 deg)/(pi E*).
        ({"cone": {"half_angle": "80 deg"}}, 0, {"forces": ["1 mN", "0.1 N"]}, "targets.forces[1]: '0.1 N'", "120 um"),
        # 10 MPa on (200 um)^2 are 0.4 N: 229 um by Hertz, with 1 mm and 25 MPa; JKR adds 4 um.
        (BALL["shape"], 50, {"pressures": ["10 kPa", "10 MPa"]}, "targets.pressures[1]: '10 MPa'", "233 um"),
    ],
)
def test_contacts_that_reach_the_edges_are_refused(shape, energy, targets, key, radius, refused):
    alone = {"surfaces.ball": BALL | {"shape": shape}, "materials.soft.surface_energy": f"{energy} mJ/m^2"}
    study = {"surfaces": ["ball"], "rms_slopes": None, "snapshots": None, "targets": targets}
    changes = {f"studies.one.{name}": value for name, value in study.items()}
    message = f"studies.one.{key} gives 'soft' on 'ball' a contact radius of about {radius}"
    refused("", alone | BY_CELLS | changes, message)


def test_a_contact_smaller_than_that_of_pull_off_is_refused(refused, load):
    """A smooth sphere jumps from no contact to a larger one: it pulls off from 110 um."""
    ball = {**BALL, "side": "500 um", "shape": {"sphere": {"radius": "5 mm"}}}
    sticky = {"contact_modulus": "2.667 MPa", "surface_energy": "40 mJ/m^2", "interaction_range": "1 nm"}
    changes = BY_CELLS | {
        "surfaces.ball": ball,
        "materials.sticky": sticky,
        "studies.one.surfaces": ["ball"],
        "studies.one.materials": ["sticky"],
        "studies.one.rms_slopes": None,
    }
    small = changes | {"studies.one.targets": {"contact_radii": ["60 um", "140 um"]}}
    refused("", small, "of 'sticky' on 'ball', which pulls off from a contact radius of 110 um")
    load(changes | {"studies.one.targets": {"contact_radii": ["120 um", "140 um"]}})
