"""Section `surfaces`: random ones, those of files, and measured ones."""

import numpy as np
import pytest
from demo_configuration import file_surface, measured_surface

from icha.configuration.cases import surface_cases, surface_settings
from icha.configuration.errors import ConfigurationError
from icha.configuration.surfaces import MeasuredSurface
from icha.datasets.labels import number_label
from icha.surfaces.measured.settings import Preparation
from icha.surfaces.spectrum import SelfAffineSpectrum
from icha.surfaces.tabulated_spectrum import SpectrumTable


def test_the_slope_that_a_topography_has(load, tmp_path):
    period, amplitude, size = 1e-3, 2e-6, 32
    x = np.arange(size) / size * period
    heights = amplitude * np.sin(2 * np.pi / period * x) * np.ones((size, 1))
    np.save(tmp_path / "own.npy", heights * 1e6)
    campaign = load({"surfaces.rough": file_surface("own.npy"), "studies.one.rms_slopes": "measured"}).campaign
    assert surface_cases(campaign) == [("rough", 0)]
    assert campaign.surfaces["rough"].path == str(tmp_path / "own.npy")
    assert surface_settings(campaign, "rough") == {"kind": "file", "period": 1e-3, "metres_per_unit": 1e-6}
    (case,) = campaign.all_runs
    assert case.rms_slope == pytest.approx(2 * np.pi / period * amplitude / np.sqrt(2), rel=1e-5)
    assert case.path == f"one/rough/seed0/slope{number_label(case.rms_slope)}/soft"


@pytest.mark.parametrize(
    ("heights", "message"),
    [
        (np.full((16, 16), np.nan), "256 of 256 heights that are not finite"),
        (np.ones((16, 15)), r"shape \(16, 15\)"),
        (np.ones((16, 16, 2)), r"shape \(16, 16, 2\)"),
        (np.ones((16, 16)), "all the same"),
        (np.full((16, 16), "a"), "not real numbers"),
    ],
)
def test_surface_files_are_read_before_anything_runs(heights, message, load, tmp_path):
    np.save(tmp_path / "heights.npy", heights)
    with pytest.raises(ConfigurationError, match=f"surfaces.rough.path: .*{message}"):
        load({"surfaces.rough": file_surface("heights.npy")})
    for ending in ("npy", "nc", "txt"):
        (tmp_path / f"damaged.{ending}").write_bytes(b"nothing of the kind")
        with pytest.raises(ConfigurationError, match="cannot be read"):
            load({"surfaces.rough": file_surface(f"damaged.{ending}")})


def test_surfaces_with_a_tabulated_spectrum_have_seeds_and_the_slope_of_their_table(load, refused, tmp_path):
    spectrum = SelfAffineSpectrum(100e-6, 25e-6, 10e-6, 0.8, rms_slope=0.3)
    q = np.geomspace(2 * np.pi / 100e-6, 2 * np.pi / 10.001e-6, 200)
    SpectrumTable(q, spectrum.psd(q)).save(tmp_path / "table.txt")
    section = {"kind": "spectrum", "path": "table.txt", "period": "100 um", "grid": 80}
    changes = {"surfaces.rough": section, "studies.one.rms_slopes": "measured"}
    campaign = load(changes).campaign
    assert surface_cases(campaign) == [("rough", 1), ("rough", 2)]
    (slope,) = {case.rms_slope for case in campaign.all_runs}
    assert slope == pytest.approx(0.3, rel=5e-3)
    assert surface_settings(campaign, "rough") == {
        "kind": "spectrum",
        "period": 100e-6,
        "grid": 80,
        "amplitudes": "fixed",
    }
    for missing in ("nowhere.txt", "."):
        refused("", changes | {"surfaces.rough": section | {"path": missing}}, "expected a text file with a table")
    (tmp_path / "titles.csv").write_text("q (1/um),C (um^4)\n1,2\n3,1\n", encoding="utf-8")
    refused("", changes | {"surfaces.rough": section | {"path": "titles.csv"}}, "surfaces.rough.convention: ")
    (tmp_path / "wrong.txt").write_text("1 2\nthree 4\n", encoding="utf-8")
    refused("", changes | {"surfaces.rough": section | {"path": "wrong.txt"}}, "surfaces.rough.path: '")
    refused("", changes | {"surfaces.rough": section | {"grid": 16}}, "cells per shortest wave; expected at least")


def test_maps_of_adhesion_and_layers_are_compared_with_the_grid_of_a_scan(load, refused):
    stripes = {"stripes": {"low": "10 mJ/m^2", "high": "50 mJ/m^2", "width": "8 um"}}
    layer = {"materials.soft.thickness": "1 mm", "materials.soft.poisson_ratio": 0.5}
    changes = {"surfaces.rough": measured_surface(boundary="free"), "studies.one.models": ["boundary_elements"]}
    changes |= {"studies.one.rms_slopes": [0.2], "confirmed": ["surfaces.rough.grid"]}
    for material in ({"materials.soft.surface_energy": stripes}, layer):
        assert load(changes | material).campaign
    refused("", changes | layer | {"materials.soft.thickness": "0.1 um"}, "thinner than a grid cell of 'rough'")
    stripes["stripes"]["width"] = "7 um"
    changes |= {"surfaces.rough": measured_surface(), "materials.soft.surface_energy": stripes}
    refused("", changes, "does not fit the surface 'rough'")


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
