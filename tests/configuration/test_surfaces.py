"""Section `surfaces`: random ones, and those of files."""

import numpy as np
import pytest
from demo_configuration import file_surface

from icha.configuration.cases import run_cases, surface_cases, surface_settings
from icha.configuration.errors import ConfigurationError
from icha.datasets.labels import number_label


def test_the_slope_that_a_topography_has(load, tmp_path):
    period, amplitude, size = 1e-3, 2e-6, 32
    x = np.arange(size) / size * period
    heights = amplitude * np.sin(2 * np.pi / period * x) * np.ones((size, 1))
    np.save(tmp_path / "own.npy", heights * 1e6)
    campaign = load({"surfaces.rough": file_surface("own.npy"), "studies.one.rms_slopes": "measured"}).campaign
    (case,) = run_cases(campaign)
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


def test_damaged_surface_files(load, tmp_path):
    for name in ("heights.npy", "heights.nc", "heights.txt"):
        (tmp_path / name).write_bytes(b"nothing of the kind")
        with pytest.raises(ConfigurationError, match="cannot be read"):
            load({"surfaces.rough": file_surface(name)})


def test_a_surface_file_is_one_realisation_beside_the_configuration(load, tmp_path):
    np.save(tmp_path / "heights.npy", np.random.default_rng(1).normal(size=(16, 16)))
    campaign = load({"surfaces.rough": file_surface("heights.npy")}).campaign
    assert surface_cases(campaign) == [("rough", 0)]
    assert campaign.surfaces["rough"].path == str(tmp_path / "heights.npy")
    assert surface_settings(campaign, "rough") == {"kind": "file", "period": 1e-3, "metres_per_unit": 1e-6}
