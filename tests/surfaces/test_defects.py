"""Defects of scans: outliers, offsets of scan lines, curvature, scattered points, and the share of noise."""

import numpy as np
import pytest
from scans import refused

from icha import SelfAffineSpectrum
from icha.cli.scans import describe_scan
from icha.surfaces.measured.defects import find_outliers, level_lines, line_offsets
from icha.surfaces.measured.resolution import examine_scan
from icha.surfaces.measured.settings import UnfitTopography
from icha.surfaces.measured.topography import prepared_topography

GRID, SIDE = 64, 32e-6
PLAIN = SelfAffineSpectrum(SIDE, 16e-6, 4e-6, 0.8, rms_slope=0.04).realise(GRID, 1).heights
RMS = float(np.std(PLAIN))
Y, X = np.mgrid[-1 : 1 : GRID * 1j, -1 : 1 : GRID * 1j]
RNG = np.random.default_rng(1)
OFFSETS = RNG.normal(0, 2 * RMS, (GRID, 1))
SPIKES = [(5, 7), (5, 8), (40, 33)]


def with_spikes(size=60):
    heights = PLAIN.copy()
    for place in SPIKES:
        heights[place] += size * RMS
    return heights


def bimodal():
    """Plateaus with steps of ten rms heights and little noise."""
    return np.where(PLAIN > 0, 10 * RMS, 0.0) + 0.01 * RMS * RNG.normal(size=PLAIN.shape)


SURFACES = {
    "plain": PLAIN,
    "bimodal": bimodal(),
    "quantised": np.round(PLAIN / (0.4 * RMS)) * 0.4 * RMS,
    "white noise": RNG.normal(size=PLAIN.shape),
    "cylinder": PLAIN + 20 * RMS * X**2,
    "grooves": np.cumsum(np.cumsum(RNG.normal(size=(GRID, 1)), axis=0), axis=0) + 0.01 * RNG.normal(size=PLAIN.shape),
}


@pytest.mark.parametrize("name", SURFACES)
def test_a_surface_without_defects_has_none(name):
    heights = SURFACES[name] - SURFACES[name].mean()
    assert not find_outliers(heights)[0].any() and not line_offsets(heights) and not line_offsets(heights.T)


@pytest.mark.parametrize("size", [60, -60, 8])
def test_outliers_are_found_where_they_are(size):
    outliers, largest = find_outliers(with_spikes(size))
    assert sorted(map(tuple, np.argwhere(outliers))) == SPIKES
    assert largest == pytest.approx(abs(size), rel=0.35)


@pytest.mark.parametrize("share", [0.02, 0.08, 0.19])
def test_single_outliers_are_found_at_any_share_that_can_be_replaced(examined, share):
    heights, places = PLAIN.copy(), RNG.random(PLAIN.shape) < share
    heights[places] += RNG.uniform(8, 60, np.count_nonzero(places)) * RMS
    found = examined(heights, outliers="remove").surface
    assert found.rms_slope == pytest.approx(examined(PLAIN).surface.rms_slope, rel=0.01)


@pytest.mark.parametrize("height", [1e30, -1e300, 3.4e38])
def test_heights_larger_than_all_digits_of_a_float_are_outliers(examined, height):
    """The trend and the limit for flat surfaces are those of the other heights."""
    heights = PLAIN + 3 * RMS * X
    heights[5, 7] = height
    found, plain = (examined(z, outliers="remove").surface for z in (heights, PLAIN + 3 * RMS * X))
    np.testing.assert_allclose(found.heights, plain.heights, atol=0.1 * RMS)
    assert found.rms_slope == pytest.approx(plain.rms_slope, rel=0.01)
    with refused("outliers", "keeps 1 points .* row 6, column 8 .*expected remove"):
        examined(heights)


@pytest.mark.parametrize("width", [4, 6, 9, 13])
def test_dust_of_any_width_is_found_and_replaced(examined, width):
    dust = np.hypot(Y - 0.2, X + 0.1) < width / GRID
    heights = np.where(dust, PLAIN + 40 * RMS, PLAIN)
    outliers, _ = find_outliers(heights)
    assert outliers[dust].all() and np.count_nonzero(outliers[~dust]) < 20
    found = examined(heights, outliers="remove").surface
    assert found.rms_slope == pytest.approx(examined(PLAIN).surface.rms_slope, rel=0.03)


def test_more_outliers_than_can_be_replaced_are_refused(examined):
    heights = np.where(RNG.random(PLAIN.shape) < 0.3, 40 * RMS, PLAIN)
    with pytest.raises(UnfitTopography, match=r"of 4096 points that stand out .* at most 20 %. Write keep") as raised:
        examined(heights, outliers="remove")
    assert raised.value.key == "outliers"


def test_offsets_of_lines_are_found_in_their_direction_and_removed():
    stepped = PLAIN + OFFSETS
    assert line_offsets(stepped) == {"lines": pytest.approx(2 * RMS * np.sqrt(2), rel=0.2)}
    assert list(line_offsets(stepped.T)) == ["columns"]
    levelled, tilted = level_lines(stepped)
    np.testing.assert_allclose(levelled, PLAIN - PLAIN.mean(axis=1, keepdims=True), atol=1e-9 * RMS)
    assert not tilted and not line_offsets(levelled)
    gaps = np.where(RNG.random(PLAIN.shape) < 0.1, np.nan, PLAIN)
    found, expected = level_lines(gaps + OFFSETS)[0], level_lines(gaps)[0]
    np.testing.assert_allclose(found, expected, atol=1e-9 * RMS)


def test_tilts_of_lines_are_removed_only_if_they_have_steps():
    levelled, tilted = level_lines(PLAIN + OFFSETS + RNG.normal(0, 5 * RMS, (GRID, 1)) * X)
    assert tilted
    np.testing.assert_allclose((levelled * X).sum(axis=1), 0, atol=1e-9 * RMS)


@pytest.fixture
def examined(tmp_path):
    def examine(heights, **keys):
        np.save(tmp_path / "scan.npy", heights)
        settings = {"format": "auto", "boundary": "free", "detrend": "tilt", "height_unit": 1.0, "size": (SIDE, SIDE)}
        return examine_scan(tmp_path / "scan.npy", settings | keys)

    return examine


def lines(scan):
    return "\n".join(describe_scan("scan", scan))


def test_outliers_are_said_and_replaced_on_request(examined):
    kept, removed = examined(with_spikes()), examined(with_spikes(), outliers="remove")
    assert "warning: 3 outliers, the largest " in lines(kept) and "write `outliers: remove`; then" in lines(kept)
    # With the defect, statements on noise and on a cut-off would be wrong.
    assert not any(word in lines(kept) for word in ("noise floor", "recommended", "summits"))
    assert "scan: 3 outliers replaced, the largest " in lines(removed) and "noise floor" in lines(removed)
    assert "3 outliers replaced, 0.073 % of the points" in removed.description
    elsewhere = np.ones(PLAIN.shape, bool)
    elsewhere[tuple(np.transpose(SPIKES))] = False
    plain = examined(PLAIN).surface.heights
    difference = removed.surface.heights - plain
    assert np.ptp(difference[elsewhere]) < 0.01 * RMS and np.ptp(difference) < 0.5 * RMS
    # A filled outlier is no reason for a cut-off, as noise is. Missing points beside outliers stay missing.
    assert "cutoff" not in removed.advice and "recommended: `cutoff" not in lines(removed)
    noisy = examined(PLAIN + 0.2 * RMS * np.random.default_rng(4).normal(size=PLAIN.shape))
    assert "cutoff" in noisy.advice
    heights = with_spikes()
    heights[20, 20] = np.nan
    with pytest.raises(UnfitTopography, match="1 of 4096 points without a height"):
        examined(heights, outliers="remove")
    assert examined(heights, outliers="remove", missing="fill").filled == 1


def test_other_defects_are_said(examined):
    stepped = examined(PLAIN + OFFSETS)
    assert "the lines along x have steps of" in lines(stepped) and "`levelling: lines` removes them" in lines(stepped)
    levelled = lines(examined(PLAIN + OFFSETS, levelling="lines"))
    assert "between the lines along x removed" in levelled and "warning" not in levelled
    round_ = examined(SURFACES["cylinder"])
    assert "a paraboloid takes 9" in lines(round_) and "`detrend: curvature`" in lines(round_)
    assert "of the variance and was removed" in lines(examined(SURFACES["cylinder"], detrend="curvature"))
    assert "anisotropic" in lines(examined(PLAIN + 3 * RMS * np.sin(40 * Y)))
    assert not any(word in lines(examined(PLAIN)) for word in ("outlier", "steps from", "paraboloid", "anisotropic"))
    holey = PLAIN.copy()
    holey[20:45, 10:40] = np.nan
    assert "warning: more than 5 % of the heights are interpolated" in lines(examined(holey, missing="fill"))
    for heights, fits in ((PLAIN, True), (PLAIN + 5 * RMS * X, False)):
        said = lines(examined(heights, boundary="periodic", detrend="none"))
        assert ("`boundary: periodic`, but opposite edges differ" in said) != fits


def test_the_share_of_noise_after_the_filter_is_that_of_filtered_noise(examined):
    noise = 0.05 * RMS * np.random.default_rng(3).normal(size=PLAIN.shape)
    scan = examined(PLAIN + noise, cutoff=3e-6)
    parts = [examined(each, cutoff=3e-6).surface.rms_slope for each in (noise, PLAIN + noise)]
    assert scan.noise_share_after_filter == pytest.approx((parts[0] / parts[1]) ** 2, rel=0.25)
    assert "with `cutoff: 3 um`, noise contributes" in lines(scan)


def test_scattered_points_are_interpolated_on_request(tmp_path):
    x, y = RNG.random((2, 2000)) * [[20.0], [10.0]]
    plane = 1.0 + 0.2 * x - 0.1 * y
    np.savetxt(tmp_path / "cloud.xyz", np.column_stack([x, y, plane]))
    settings = {"format": "auto", "boundary": "free", "height_unit": 1e-9, "lateral_unit": 1e-6}
    with pytest.raises(
        UnfitTopography, match=r"coordinates x that are not on a regular grid .* expected interpolate"
    ) as e:
        prepared_topography(tmp_path / "cloud.xyz", settings)
    assert e.value.key == "scattered"
    found = prepared_topography(tmp_path / "cloud.xyz", settings | {"scattered": "interpolate", "missing": "fill"})
    assert "2000 scattered points interpolated onto 64 x 32 nodes" in found.description
    inside, spacing = found.surface.heights[4:-4, 4:-4] / 1e-9, found.surface.spacing / 1e-6
    np.testing.assert_allclose(np.diff(inside, axis=1), 0.2 * spacing, rtol=1e-4)
    np.testing.assert_allclose(np.diff(inside, axis=0), -0.1 * spacing, rtol=1e-4)
