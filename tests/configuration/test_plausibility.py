"""Values that are almost surely slips: refused unless confirmed, and warned of then."""

import re

import pytest
from demo_configuration import measured_surface

from icha.configuration.errors import ConfigurationError

UNUSUAL = {
    "materials.soft.contact_modulus": ["2 mPa", "999 Pa", "2.1 TPa"],
    "materials.soft.surface_energy": ["5 kJ/m^2", "1e-7 J/m^2"],
    "materials.soft.interaction_range": ["2 km", "2 um", "1e-12 m"],
    "studies.one.rms_slopes.0": [500, "6", 1e-5],
    "studies.one.rms_slopes.1": [500],
}
# Models to which it does not matter how sticky a contact is, and a confirmed Tabor parameter.
RANGE = "materials.soft.interaction_range"
ANY_STICKINESS = {"studies.one.models": ["boundary_elements"], "confirmed": [RANGE]}
USUAL = {
    "materials.soft.contact_modulus": ["1 kPa", "1 TPa"],
    "materials.soft.surface_energy": ["0 J/m^2", "1e-6 J/m^2", "2 J/m^2"],
    "materials.soft.interaction_range": ["0.05 nm", "1 um"],
    "studies.one.rms_slopes": [[1e-4, 5]],
}


@pytest.mark.parametrize(("place", "value"), [(place, value) for place, values in UNUSUAL.items() for value in values])
def test_unusual_values_are_refused_until_they_are_confirmed(place, value, load, refused, tmp_path):
    key = place.rstrip(".01")
    refused(place, value, f": {value!r} is unusual; expected ")
    refused(place, value, f"Correct the value, or add `confirmed: [{key}]` at the top level if you intend this value")
    configuration = load({**ANY_STICKINESS, place: value, "confirmed": list({key, RANGE})})
    (warning,) = (each for each in configuration.warnings if "Tabor parameter" not in each)
    assert re.match(rf"{tmp_path}/campaign\.yaml, line \d+: {key}", warning)
    assert f"{value!r} is unusual, but confirmed" in warning


@pytest.mark.parametrize(("place", "value"), [(place, value) for place, all_ in USUAL.items() for value in all_])
def test_what_is_usual_needs_no_confirmation(place, value, load):
    assert not [each for each in load({**ANY_STICKINESS, place: value}).warnings if "Tabor parameter" not in each]


def test_unusual_values_are_found_wherever_values_are_written(load, refused, tmp_path):
    refused(
        "studies.one.vary", {"surface_energy": ["1 mJ/m^2", "1 kJ/m^2"]}, "studies.one.vary.surface_energy[1]: '1 kJ"
    )
    refused("studies.one.cases", [{"rms_slope": 80}], "[studies.one.cases.rms_slope]")
    refused("surfaces.rough", measured_surface(size=["72 um", "64 m"]), "surfaces.rough.size[1]: '64 m' is unusual")
    refused("surfaces.rough.period", "100 m", "surfaces.rough.period: '100 m' is unusual; expected 1 nm to 1 m (")
    moved = {"materials.soft.interaction_range": None, "defaults": {"materials": {"interaction_range": "2 mm"}}}
    refused("", moved, "defaults.materials.interaction_range: '2 mm' is unusual")
    with pytest.raises(ConfigurationError, match=r" with --config: materials\.soft\.contact_modulus: '25 mPa' is "):
        load(overrides={"materials": {"soft": {"contact_modulus": "25 mPa"}}})


STICKY = {"materials.soft.contact_modulus": "50 kPa"}


def test_sticky_runs_of_asperities_are_refused_until_they_are_confirmed(load, refused):
    message = (
        "studies.one.models: 'asperities with U_full/dgamma = 0.0275' is unusual for soft on rough at rms slope 0.2; "
        "expected 1 to inf (for smaller values full contact has a lower energy than separated surfaces, and the "
        "asperity model does not apply; "
    )
    refused("", STICKY, message)
    refused("", STICKY, "or add `confirmed: [studies.one.models]` at the top level")
    (warning,) = load({**STICKY, "confirmed": ["studies.one.models"]}).warnings
    assert message.replace("; expected", ", but confirmed; expected") in warning
    assert load({**STICKY, **ANY_STICKINESS}).warnings == ()
    assert load({**STICKY, "materials.soft.surface_energy": "0 J/m^2"}).warnings == ()


def test_on_sticky_surfaces_boundary_elements_alone_reach_an_accuracy(load, refused):
    sticky = {**STICKY, "surfaces.rough.grid": 96, "studies.one.seeds": None}
    configuration = load(sticky | {"studies.one.accuracy": "5 %"})
    study = configuration.campaign.studies["one"]
    assert study.levels.asperities is None and len(study.levels.coarse) == 6 and len(study.levels.fine) == 4
    assert {case.model for case in configuration.campaign.all_runs} == {"boundary_elements"}
    (note,) = (each for each in configuration.warnings if "studies.one.accuracy" in each)
    assert "U_full/dgamma" in note and "boundary elements alone give the estimate" in note
    levels = {"asperities": "1..8", "coarse": "1..6", "fine": "1..4"}
    refused("", sticky | {"studies.one.levels": levels}, "or `levels` without `asperities`")


def test_a_force_on_a_mirrored_scan_is_refused(load, refused):
    """The cell contains four copies of the scan of 64 um x 64 um, so the pressure would be a quarter."""
    changes = {
        "surfaces.rough": measured_surface(boundary="mirror"),
        "studies.one.targets": {"forces": ["1 mN"]},
        "studies.one.rms_slopes": "measured",
        "studies.one.seeds": None,
    }
    refused("", changes, "studies.one.targets.forces[0]: '1 mN' is unusual on rough")
    refused("", changes, "expected a pressure, such as 244.1 kPa for this force on one scan")
    (warning,) = load(changes | {"confirmed": ["studies.one.targets.forces"]}).warnings
    assert "four copies of the scan" in warning


def test_an_unusual_slope_of_a_topography_names_its_unit_of_length(load, refused, tmp_path):
    (tmp_path / "table.txt").write_text("1e5 1e-10\n1e6 1e-13\n")
    spectrum = {"kind": "spectrum", "path": "table.txt", "period": "100 um", "grid": 128}
    changes = {"surfaces.rough": spectrum, "studies.one.rms_slopes": "measured"}
    refused("", changes, "add `confirmed: [surfaces.rough.length_unit]`")
    changes["surfaces.rough"] = measured_surface(height_unit="um")
    key = "surfaces.rough.height_unit"
    refused(
        "", changes, f"{key}: 'rms slope 146' is unusual (the slope depends on units, size and numbers for missing po"
    )
    (warning,) = load(changes | {"confirmed": [key]}).warnings
    assert f"{key}: 'rms slope 146' is unusual" in warning and "but confirmed; expected 1e-4 to 5" in warning
