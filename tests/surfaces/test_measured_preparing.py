"""Every step of the preparation of measured topographies."""

import numpy as np
import pytest
from scans import centred, preparation, refused

from icha.datasets.files import read_dataset
from icha.datasets.surface_file import read_surface, write_surface
from icha.surfaces.measured.settings import UnfitTopography
from icha.surfaces.measured.topography import prepared_topography
from icha.surfaces.spectrum import SelfAffineSpectrum


@pytest.fixture
def prepared(tmp_path):
    def prepare(heights, **keys):
        np.save(tmp_path / "scan.npy", heights)
        keys = {"height_unit": 1.0, "size": tuple(0.5 * n for n in np.shape(heights)[::-1])} | keys
        return prepared_topography(tmp_path / "scan.npy", preparation(**keys))

    return prepare


def test_largest_square_in_the_middle(prepared):
    heights = np.random.default_rng(1).normal(size=(10, 17))
    for given, square in ((heights, heights[:, 3:13]), (heights.T, heights.T[3:13])):
        surface = prepared(given, boundary="free").surface
        np.testing.assert_allclose(surface.heights, centred(square), atol=1e-14)
        assert surface.period == 5.0


def test_crop(prepared):
    heights = np.random.default_rng(1).normal(size=(14, 20))
    result = prepared(heights, boundary="free", crop={"x": 3.5, "y": 1.0, "side": 4.5})
    np.testing.assert_allclose(result.surface.heights, centred(heights[2:11, 7:16]), atol=1e-14)
    assert result.surface.period == 4.5 and "cut to 9 x 9 points from (7, 2)" in result.description
    for crop in ({"x": 6.0, "y": 0.0, "side": 4.5}, {"x": 0.0, "y": 3.0, "side": 4.5}, {"x": 0, "y": 0, "side": 2.0}):
        with refused("crop"):
            prepared(heights, boundary="free", crop=crop)


@pytest.mark.parametrize("missing", ["refuse", "fill"])
def test_trends_are_removed_whatever_is_missing(prepared, missing):
    y, x = np.mgrid[:12, :12] * 0.5
    plane, bowl = 3.0 + 0.2 * x - 0.7 * y, 0.1 * x**2 - 0.3 * x * y + 0.05 * y**2
    rough = 1e-9 * np.random.default_rng(2).normal(size=(12, 12))
    keys = {"boundary": "free", "missing": missing}
    if missing == "fill":
        plane, bowl = plane.copy(), bowl.copy()
        plane[3, 4] = plane[7:9, 1:3] = np.nan
    flat = prepared(plane + rough, detrend="tilt", **keys)
    assert flat.surface.rms_height < 2e-9 and "tilt removed" in flat.description
    assert prepared(plane + bowl + rough, detrend="tilt", **keys).surface.rms_height > 0.1
    assert prepared(plane + bowl + rough, detrend="curvature", **keys).surface.rms_height < 2e-9
    kept = prepared(plane + bowl + rough, **keys).surface.heights
    if missing == "refuse":
        np.testing.assert_allclose(kept, centred(plane + bowl + rough), atol=1e-13)


def test_missing_points_are_refused_or_filled_harmonically(prepared):
    y, x = np.mgrid[:10, :10].astype(float)
    harmonic = x**2 - y**2 + 2 * x * y  # of the five-point Laplacian, too
    holey = harmonic.copy()
    holey[4:7, 3:6] = np.nan
    with refused("missing", r"9 of 100 points without a height; expected fill"):
        prepared(holey, boundary="free")
    result = prepared(holey, boundary="free", missing="fill")
    np.testing.assert_allclose(result.surface.heights, centred(harmonic), atol=1e-11)
    assert "9 missing points filled" in result.description
    # Those outside of the square that is used matter to nobody.
    assert prepared(np.pad(harmonic, ((0, 0), (2, 2)), constant_values=np.nan), boundary="free")
    holey[:, 2:9] = np.nan
    with pytest.raises(UnfitTopography, match="at most half"):
        prepared(holey, boundary="free", missing="fill")


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_filling_is_that_of_surface_topography(prepared, boundary):
    """Also at edges and corners, where a point has fewer neighbours, or those on the other side."""
    from SurfaceTopography import Topography

    rng = np.random.default_rng(9)
    heights, holes = rng.normal(size=(14, 14)), rng.random((14, 14)) < 0.3
    holes[0, :4] = holes[10:, 0] = holes[-1, -1] = True
    theirs = Topography(np.ma.masked_array(heights, holes), (7.0, 7.0), periodic=boundary == "periodic")
    ours = prepared(np.where(holes, np.nan, heights), boundary=boundary, missing="fill").surface.heights
    np.testing.assert_allclose(ours, centred(theirs.interpolate_undefined_data("harmonic").heights()), atol=1e-12)


def test_mirror_is_periodic_and_twice_as_wide(prepared):
    heights = np.random.default_rng(4).normal(size=(9, 9))
    surface = prepared(heights, boundary="mirror").surface
    assert surface.boundary == "periodic" and surface.period == 9.0 and surface.grid == 18
    np.testing.assert_allclose(surface.heights[:9, :9], centred(heights), atol=1e-14)
    for again in (surface.heights[::-1], surface.heights[:, ::-1]):
        np.testing.assert_array_equal(again, surface.heights)


def test_window_leaves_the_middle_and_ends_flat(prepared):
    heights = np.random.default_rng(4).normal(size=(80, 80))
    result = prepared(heights, boundary="window", taper=0.25)
    surface = result.surface
    shift = surface.heights[40, 40] - centred(heights)[40, 40]
    np.testing.assert_allclose(surface.heights[20:60, 20:60], centred(heights)[20:60, 20:60] + shift, atol=1e-13)
    np.testing.assert_allclose(surface.heights[0], shift, atol=0.01)
    assert abs(surface.heights.mean()) < 1e-15 and surface.boundary == "periodic"
    assert "0.25 of the side" in result.description


@pytest.mark.parametrize("grid", [24, 48])
def test_resampling_of_a_periodic_scan_is_exact(prepared, grid):
    spectrum = SelfAffineSpectrum(1.0, 0.5, 0.2, 0.8)
    surface = prepared(spectrum.realise(32, 3).heights, boundary="periodic", size=(1.0, 1.0), grid=grid).surface
    np.testing.assert_allclose(surface.heights, spectrum.realise(grid, 3).heights, atol=1e-14)


@pytest.mark.parametrize("grid", [12, 40])
def test_resampling_of_a_free_square_keeps_cosines(prepared, grid):
    """Cells stay cells: the points lie in the middles of as many parts of the same square."""

    def cosines(n):
        x = (np.arange(n) + 0.5) / n
        return np.cos(3 * np.pi * x)[:, None] * np.cos(5 * np.pi * x) + np.cos(2 * np.pi * x)[:, None]

    surface = prepared(cosines(20), boundary="free", grid=grid).surface
    np.testing.assert_allclose(surface.heights, centred(cosines(grid)), atol=1e-13)
    assert surface.period == 10.0


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("boundary", "grid"), [("free", 16), ("free", None), ("mirror", None), ("periodic", 16)])
def test_pixels_that_are_not_square_are_resampled(prepared, boundary, grid, turned):
    """Whole cosines are what both series keep exactly: the cells are those of the shorter side of a pixel."""

    def waves(ny, nx):
        y, x = ((np.arange(n) + (0.5 if boundary != "periodic" else 0)) / n for n in (ny, nx))
        return np.cos(2 * np.pi * y)[:, None] + 0.5 * np.cos(4 * np.pi * x)

    heights = waves(10, 20)
    surface = prepared(heights.T if turned else heights, boundary=boundary, size=(10.0, 10.0), grid=grid).surface
    n = grid or 20
    wanted = waves(n, n).T if turned else waves(n, n)
    np.testing.assert_allclose(surface.heights[:n, :n], centred(wanted), atol=1e-12)
    assert surface.grid == (2 * n if boundary == "mirror" else n)


@pytest.mark.parametrize("boundary", ["periodic", "free", "mirror"])
def test_the_cutoff_is_that_of_iso_16610(prepared, boundary):
    """A wave of the length of the nesting index is halved, one of twice it keeps 2^(-1/4), one of half it 2^-4."""
    n = 96
    x = (np.arange(n) + (0.5 if boundary != "periodic" else 0)) / n
    for length, left in ((1 / 12, 0.5), (1 / 6, 2**-0.25), (1 / 24, 2**-4)):
        heights = np.cos(2 * np.pi * x / length) * np.ones((n, 1))
        result = prepared(heights, boundary=boundary, size=(1.0, 1.0), cutoff=1 / 12)
        assert np.ptp(result.surface.heights) / np.ptp(heights) == pytest.approx(left, rel=2e-3)
    assert "Gaussian S-filter (ISO 16610-61) with a nesting index of 0.0833333 m" in result.description


@pytest.mark.parametrize("cutoff", [3.9, 65.1])
def test_a_cutoff_that_the_scan_does_not_hold_is_refused(prepared, cutoff):
    heights = np.random.default_rng(1).normal(size=(65, 65))
    with refused("cutoff", r"expected at least 4 pixels \(4 m\), at most the side of the square \(65 m\)"):
        prepared(heights, boundary="window", taper=0.1, size=(65.0, 65.0), cutoff=cutoff)


@pytest.mark.parametrize("boundary", ["free", "mirror", "window"])
@pytest.mark.parametrize(("detrend", "degree"), [("none", 0), ("tilt", 0), ("tilt", 1), ("curvature", 2)])
def test_a_flat_file_is_refused(prepared, boundary, detrend, degree):
    """Also where rounding is all that is left when the trend is removed: it would be scaled to any slope."""
    y, x = np.mgrid[:12, :12]
    with refused("path", "all the same"):
        prepared(0.1 + degree * 0.3 * x - (degree == 2) * 0.07 * y**2, boundary=boundary, detrend=detrend, taper=0.1)


@pytest.mark.parametrize(
    ("heights", "key", "words"),
    [
        (np.empty((0, 0)), "path", "of shape"),
        (np.arange(12.0)[None], "path", "is a line scan, one profile of 12 points"),
        (np.arange(24.0).reshape(12, 2), "path", "is a line scan"),
        (np.full((12, 12), np.nan), "path", "no height"),
        (np.where(np.eye(12) > 0, np.arange(12.0), np.nan), "missing", "cannot fill 132 of 144"),
        (np.where(np.eye(12) > 0, np.inf, np.arange(12.0)), "missing", "12 of 144"),
    ],
)
@pytest.mark.parametrize("detrend", ["none", "tilt"])
def test_too_little_for_a_surface(prepared, heights, key, words, detrend):
    missing = "fill" if "cannot fill" in words else "refuse"
    with refused(key, words):
        prepared(heights, boundary="free", detrend=detrend, missing=missing, size=(6.0, 6.0))


def test_surface_file_says_where_a_measurement_comes_from(tmp_path, prepared):
    result = prepared(np.random.default_rng(6).normal(size=(24, 24)), boundary="free")
    unit = result.surface.scaled_to_rms_slope(1.0)
    for name in ("one.nc", "two.nc"):
        write_surface(tmp_path / name, unit, name="scan", seed=0, measured=result)
    assert (tmp_path / "one.nc").read_bytes() == (tmp_path / "two.nc").read_bytes()
    file = read_dataset(tmp_path / "one.nc")
    assert file.attrs["boundary"] == "free" and file.attrs["source_file"] == "scan.npy"
    assert file.attrs["source_sha256"] == result.source_sha256
    assert file.attrs["preparation"] == result.description
    assert float(file["measured_rms_slope"]) == result.surface.rms_slope and float(file["rms_slope"]) == pytest.approx(
        1.0
    )
    # Heights times the measured slope are those of the measurement.
    again = read_surface(tmp_path / "one.nc")
    assert again.free
    np.testing.assert_allclose(
        again.scaled_to_rms_slope(result.surface.rms_slope).heights, result.surface.heights, atol=1e-13
    )
