"""The section of a measured surface."""

import pytest

from icha.configuration.measured_surfaces import MeasuredSurface
from icha.surfaces.measured.settings import Preparation

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
    assert Preparation(**how).missing == "refuse"
    assert MeasuredSurface.model_validate(SECTION | {"boundary": "periodic"}).preparation["detrend"] == "none"
    assert MeasuredSurface.model_validate(SECTION | {"boundary": "window"}).preparation["taper"] == 0.1


def test_a_crop_is_called_by_its_lengths():
    section = MeasuredSurface.model_validate(SECTION | {"crop": {"x": "7 um", "y": "0 um", "side": "2.5 um"}})
    assert repr(section.crop) == "a square of 2.5 um at x = 7 um, y = 0 m"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"height_unit": "volt"}, ["'volt' is not a unit of length", "allowed", "0.1 mm"]),
        ({"height_unit": 3}, ["is not a unit"]),
        ({"height_unit": "0 mm"}, ["greater than 0"]),
        ({"size": "90"}, ["the unit is missing", "allowed"]),
        ({"size": ["90 um"] * 3}, ["3 entries", "allowed"]),
        ({"size": "-1 um"}, ["greater than 0"]),
        ({"crop": {"x": "0 um", "y": "0 um", "side": "0 um"}}, ["too small"]),
        ({"boundary": "periodic", "detrend": "tilt"}, ["detrend", "periodicity", "allowed"]),
        ({"boundary": "periodic", "crop": {"x": "0 um", "y": "0 um", "side": "9 um"}}, ["crop", "not periodic"]),
        ({"taper": 0.2}, ["taper", "window", "allowed"]),
        ({"boundary": "window", "taper": 0.6}, ["(0, 0.5]"]),
        ({"format": "fourier"}, ["boundary", "Fourier", "allowed: periodic"]),
        ({"grid": 4}, ["from 8"]),
    ],
)
def test_wrong_sections_are_refused_in_words(change, words):
    with pytest.raises(ValueError) as raised:
        MeasuredSurface.model_validate(SECTION | change)
    for word in words:
        assert word in str(raised.value)
