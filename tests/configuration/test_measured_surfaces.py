"""The section of a measured surface."""

import pytest
from demo_configuration import measured_surface

from icha.configuration.cases import run_cases, surface_settings
from icha.configuration.surfaces import MeasuredSurface
from icha.surfaces.measured.settings import Preparation
from icha.surfaces.measured.topography import prepared_topography

SECTION = {"kind": "measured", "path": "scan.npy", "boundary": "mirror", "height_unit": "nm", "size": "90 um"}


def test_section_in_si_units():
    section = MeasuredSurface.model_validate(
        SECTION
        | {"height_unit": "0.1 mm", "size": ["90 um", "60 um"], "crop": {"x": "0 um", "y": "5 um", "side": "40 um"}}
    )
    how = section.preparation
    assert how["height_unit"] == 1e-4 and how["size"] == (9e-5, 6e-5)
    assert how["crop"] == {"x": 0.0, "y": 5e-6, "side": 4e-5}
    assert how["detrend"] == "tilt" and how["taper"] is None
    # Without a cut-off a surface has the checksum that it had before there was one.
    assert "cutoff" not in how
    assert Preparation(**how).missing == "refuse"
    assert MeasuredSurface.model_validate(SECTION | {"boundary": "periodic"}).preparation["detrend"] == "none"
    assert MeasuredSurface.model_validate(SECTION | {"boundary": "window"}).preparation["taper"] == 0.1


def test_a_measured_surface_at_its_own_slope(load):
    campaign = load({"surfaces.rough": measured_surface(), "studies.one.rms_slopes": "measured"}).campaign
    (case,) = run_cases(campaign)
    topography = campaign.topography("rough")
    assert (case.seed, case.rms_slope) == (0, topography.rms_slope)
    assert (topography.grid, topography.period) == (128, 64e-6)
    settings = {key: value for key, value in surface_settings(campaign, "rough").items() if key != "kind"}
    prepared = prepared_topography(campaign.surfaces["rough"].path, settings)
    assert prepared.surface.rms_slope == pytest.approx(case.rms_slope, rel=1e-5)


def test_slopes_that_no_surface_has_are_to_be_confirmed(load, refused):
    changes = {"surfaces.rough": measured_surface(height_unit="um"), "studies.one.rms_slopes": "measured"}
    key = "surfaces.rough.height_unit"
    refused(
        "",
        changes,
        f"{key}: 'rms slope 146' is unusual (the slope depends on units, size and numbers for missing points); ",
    )
    (warning,) = load(changes | {"confirmed": [key]}).warnings
    assert f"{key}: 'rms slope 146' is unusual" in warning and "but confirmed; expected 1e-4 to 5" in warning
