"""`icha.read_scan` prepares a measured surface as a campaign does."""

import warnings

import numpy as np
import pytest

import icha
from icha.configuration.surfaces import MeasuredSurface
from icha.surfaces.measured.topography import prepared_topography

PERIOD = 1e-5
KEYS = {"size": "10 um", "height_unit": "nm"}


def rough(grid=64, roll_off=PERIOD, cells=8, hurst=0.8, seed=1):
    spectrum = icha.SelfAffineSpectrum(PERIOD, roll_off, PERIOD * cells / grid, hurst, rms_slope=0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of few nodes for each wave
        return spectrum.realise(grid, seed).heights


@pytest.fixture
def file(tmp_path):
    slope = 0.3 * PERIOD * np.arange(64) / 64
    np.savetxt(tmp_path / "scan.csv", (rough() + slope) * 1e9, delimiter=",")
    return tmp_path / "scan.csv"


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("boundary", ["window", "mirror", "free"])
def test_prepared_as_in_a_campaign(file, boundary):
    keys = {**KEYS, "boundary": boundary, "cutoff": "1 um"}
    section = MeasuredSurface.model_validate({"kind": "measured", "path": str(file), **keys})
    expected = prepared_topography(file, section.preparation).surface
    surface = icha.read_scan(file, **keys)
    np.testing.assert_array_equal(surface.heights, expected.heights)
    assert (surface.period, surface.boundary) == (expected.period, expected.boundary)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({}, "boundary: the key is missing"),
        ({"boundary": "free", "height_unit": "nm"}, "size: is missing"),
        ({"boundary": "free", "hight_unit": "nm"}, r"hight_unit: unknown key \(did you mean 'height_unit'\?\)"),
        ({"boundary": "free", "size": "10 UM"}, r"size: '10 UM' 'UM' is not a unit of length"),
        ({"boundary": "periodic", "detrend": "tilt"}, "would break the periodicity"),
    ],
)
def test_wrong_keys_are_named(file, keys, words):
    with pytest.raises(ValueError, match=words):
        icha.read_scan(file, **keys)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("keys", "key"), [({"size": "16 m"}, "size"), ({"height_unit": "um"}, "height_unit")])
def test_implausible_scans_need_to_be_confirmed(file, keys, key):
    with pytest.raises(ValueError, match=rf"read_scan: {key}: .* is unusual.*`confirmed=\['{key}'\]`"):
        icha.read_scan(file, **KEYS | keys, boundary="window")
    if key == "height_unit":
        assert icha.read_scan(file, **KEYS | keys, boundary="window", confirmed=[key]).rms_slope > 5


@pytest.mark.filterwarnings("error")
def test_outliers_are_warned_about(tmp_path):
    heights = rough(cells=16) * 1e9
    heights[20, 30] = 32767
    np.save(tmp_path / "scan.npy", heights)
    with pytest.raises(ValueError, match=r"1 outlier, the largest .*; try `outliers: remove` first"):
        icha.read_scan(tmp_path / "scan.npy", **KEYS, boundary="window")
    heights[20, 30] = -9999
    np.save(tmp_path / "scan.npy", heights)
    with pytest.warns(icha.IchaWarning, match="^1 outlier, the largest .* `outliers: remove` replaces outliers"):
        icha.read_scan(tmp_path / "scan.npy", **KEYS, boundary="window")
    icha.read_scan(tmp_path / "scan.npy", **KEYS, boundary="window", outliers="remove")


@pytest.mark.filterwarnings("error")
def test_one_length_is_the_size_of_a_square(tmp_path):
    np.save(tmp_path / "scan.npy", rough()[:48] * 1e9)
    keys = {"height_unit": "nm", "boundary": "free"}
    for size, pixel in (("10 um", "156.25 nm x 208.333 nm"), (["7.5 um", "10 um"], "117.188 nm x 208.333 nm")):
        with pytest.raises(ValueError, match=rf"size: .* makes pixels of {pixel}; .*\[10 um, 7.5 um\].*`first_axis`"):
            icha.read_scan(tmp_path / "scan.npy", size=size, **keys)
    assert icha.read_scan(tmp_path / "scan.npy", size=["7.5 um", "10 um"], first_axis="x", **keys).grid == 48
    for size in (["10 um", "7.5 um"], ["10 um", "10 um"]):
        icha.read_scan(tmp_path / "scan.npy", size=size, **keys)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("hurst", [0.2, 0.8])
@pytest.mark.parametrize(("grid", "cells", "roll_off"), [(16, 2, 1), (64, 2, 4), (64, 8, 1), (64, 32, 1), (256, 4, 8)])
def test_periodic_surfaces_give_no_warning(grid, cells, roll_off, hurst):
    for seed in range(4):
        icha.Surface(rough(grid, PERIOD / roll_off, cells, hurst, seed), PERIOD)


@pytest.mark.parametrize("cells", [4, 8])
def test_tilted_and_cropped_scans_give_a_warning(cells):
    tilt = 0.05 * PERIOD * np.arange(64) / 64
    with pytest.warns(icha.IchaWarning, match=r"boundary: 'periodic'.*icha\.read_scan") as raised:
        icha.Surface(rough(cells=cells) + tilt, PERIOD)
    assert raised[0].filename == __file__
    for seed in range(4):
        part = rough(256, cells=cells, seed=seed)[:128, :128]
        with pytest.warns(icha.IchaWarning, match="step at the edges"):
            icha.Surface(part, PERIOD)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            icha.Surface(part, PERIOD, "free")


@pytest.mark.parametrize(("share", "asked"), [(0.0015, ""), (0.01, "0.98 %"), (0.3, "30 %")])
def test_a_number_at_many_points_may_mark_missing_points(tmp_path, share, asked):
    """A hundredth of the points at zero changes the rms slope by a tenth."""
    heights = rough() * 1e9 + 2000
    heights.ravel()[np.random.default_rng(1).permutation(heights.size)[: int(share * heights.size)]] = 0
    np.save(tmp_path / "scan.npy", heights)
    np.save(tmp_path / "levels.npy", np.where(np.indices((64, 64))[0] % 16 < 8, 0, 1000))
    keys = {**KEYS, "boundary": "free", "confirmed": ["height_unit"]}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of outliers and steps
        assert icha.read_scan(tmp_path / "levels.npy", **keys).grid == 64
        if not asked:
            assert icha.read_scan(tmp_path / "scan.npy", **keys).grid == 64
            return
        with pytest.raises(ValueError, match=f"missing: '{asked} of the points at exactly 0 m' is unusual"):
            icha.read_scan(tmp_path / "scan.npy", **keys)
        assert icha.read_scan(tmp_path / "scan.npy", **keys | {"confirmed": ["height_unit", "missing"]}).grid == 64
