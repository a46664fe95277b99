"""Measured topographies: every reader on files that are written here, and every step of the preparation."""

import hashlib
import importlib.util
import json
from pathlib import Path

import h5py
import netCDF4
import numpy as np
import pytest

from icha.configuration.topography import MeasuredSurface
from icha.datasets.files import read_dataset, read_surface, write_surface
from icha.surfaces.measured.topography import (
    Preparation,
    UnfitTopography,
    prepared_topography,
    read_scan,
    topography_facts,
)
from icha.surfaces.moments import radial_power_spectrum
from icha.surfaces.spectrum import SelfAffineSpectrum
from icha.surfaces.surface import Surface

NM, UM = 1e-9, 1e-6
# 10 rows along y, 16 columns along x: neither square nor symmetric in any way.
ROWS, COLUMNS = 10, 16
HEIGHTS = np.round(np.random.default_rng(3).normal(size=(ROWS, COLUMNS)), 4)
SIZE = (COLUMNS * 0.25 * UM, ROWS * 0.25 * UM)
TOPOGRAPHIES = Path(__file__).parents[2] / "config" / "topographies"


def preparation(**keys):
    return {"format": "auto", "boundary": "mirror"} | keys


def scan(path, **keys):
    return read_scan(path, Preparation(**preparation(**keys)))


def assert_read(read, unit=NM):
    """The heights of this file, the right way round, and the size of the scan."""
    np.testing.assert_allclose(read.heights, HEIGHTS * unit, rtol=1e-6, atol=1e-9 * unit)
    np.testing.assert_allclose(read.size, SIZE, rtol=1e-6)


def write_xyz(path, order=slice(None), separator=" "):
    y, x = np.mgrid[:ROWS, :COLUMNS] * 250.0
    table = np.column_stack([x.ravel(), y.ravel(), HEIGHTS.ravel()])[order]
    path.write_text("\n".join(separator.join(f"{number:g}" for number in line) for line in table) + "\n")
    return path


# --- readers -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("first_axis", "stored"), [("y", HEIGHTS), ("x", HEIGHTS.T)])
def test_npy(tmp_path, first_axis, stored):
    np.save(tmp_path / "scan.npy", stored)
    assert_read(scan(tmp_path / "scan.npy", height_unit=NM, size=SIZE, first_axis=first_axis))


def test_integers_are_heights_too(tmp_path):
    np.save(tmp_path / "scan.npy", (HEIGHTS * 1e4).astype(np.int32))
    read = scan(tmp_path / "scan.npy", height_unit=1e-4 * NM, size=SIZE)
    np.testing.assert_allclose(read.heights, HEIGHTS * NM, atol=1.1e-4 * NM)


@pytest.mark.parametrize("separator", [" ", "\t", ",", ";", ", "])
@pytest.mark.parametrize(("first_axis", "stored"), [("y", HEIGHTS), ("x", HEIGHTS.T)])
def test_matrix_of_text(tmp_path, separator, first_axis, stored):
    lines = [separator.join(f"{height:.4f}" for height in row) for row in stored]
    (tmp_path / "scan.txt").write_text("# a remark\n\n" + "\n".join(lines) + "\n")
    assert_read(scan(tmp_path / "scan.txt", height_unit=NM, size=SIZE, first_axis=first_axis))


@pytest.mark.parametrize("text", ["0,1;0,2;0,3", "0,1 0,2 0,3"])
def test_decimal_commas_are_not_taken_for_columns(tmp_path, text):
    (tmp_path / "scan.txt").write_text("\n".join([text] * 9))
    with pytest.raises(UnfitTopography, match="decimal"):
        scan(tmp_path / "scan.txt", format="matrix", height_unit=NM, size=SIZE)


@pytest.mark.parametrize("separator", [" ", ","])
def test_xyz_in_any_order(tmp_path, separator):
    order = np.random.default_rng(8).permutation(HEIGHTS.size)
    path = write_xyz(tmp_path / "scan.xyz", order, separator)
    assert_read(scan(path, height_unit=NM))
    assert_read(scan(path.rename(tmp_path / "scan.txt"), height_unit=NM, lateral_unit=NM))
    # Coordinates in another unit than the heights; a size goes before both.
    wide = scan(tmp_path / "scan.txt", height_unit=NM, lateral_unit=UM)
    np.testing.assert_allclose(wide.size, np.multiply(SIZE, 1000))
    assert_read(scan(tmp_path / "scan.txt", height_unit=NM, lateral_unit=UM, size=SIZE))


def test_text_files_of_the_challenge(tmp_path):
    """Remarks, numbers with commas and blanks between them, an empty line after every line of points."""
    x = np.arange(8) / 8
    heights = np.round(np.random.default_rng(2).normal(size=(8, 8)), 5)
    lines = ["# surface", "# x, y, h"]
    for row, y in zip(heights, x, strict=True):
        lines += [f"{x_k:.6f}, {y:.6f}, {h:.5f}" for x_k, h in zip(x, row, strict=True)] + [""]
    (tmp_path / "surface.0008x0008.ASCII.xyz.dat").write_text("\n".join(lines) + "\n")
    matrix = "\n".join(", ".join(f"{h:.5f}" for h in row) + "," for row in heights)
    (tmp_path / "surface.0008x0008.ASCII.dat").write_text(f"# surface\n{matrix}\n")
    for name, keys in (
        ("surface.0008x0008.ASCII.xyz.dat", {}),
        ("surface.0008x0008.ASCII.dat", {"size": (1e-4, 1e-4)}),
    ):
        how = preparation(boundary="periodic", height_unit=1e-4, touches_first="low", **keys)
        surface = prepared_topography(tmp_path / name, how).surface
        np.testing.assert_allclose(surface.heights, -1e-4 * centred(heights), atol=1e-18)
        assert surface.period == pytest.approx(1e-4, rel=1e-12)


def test_xyz_without_some_points(tmp_path):
    path = write_xyz(tmp_path / "scan.xyz", np.setdiff1d(np.arange(HEIGHTS.size), [0, 37]))
    heights = scan(path, height_unit=NM).heights
    assert np.isnan(heights[0, 0]) and np.isnan(heights[2, 5]) and np.count_nonzero(np.isnan(heights)) == 2


def test_xyz_written_with_few_digits(tmp_path):
    y, x = np.mgrid[:40, :60] * 0.1953
    table = np.column_stack([x.ravel(), y.ravel(), np.arange(2400.0)])
    np.savetxt(tmp_path / "scan.xyz", table, fmt="%.2f")
    read = scan(tmp_path / "scan.xyz", height_unit=UM)
    assert read.heights.shape == (40, 60)
    np.testing.assert_array_equal(read.heights.ravel(), np.arange(2400.0) * UM)
    np.testing.assert_allclose(read.size, [60 * 0.1953 * UM, 40 * 0.1953 * UM], rtol=1e-3)


def test_xyz_with_a_point_twice_or_off_the_grid(tmp_path):
    path = write_xyz(tmp_path / "scan.xyz", [*range(160), 5])
    with pytest.raises(UnfitTopography, match="x = 1250, y = 0 is given twice"):
        scan(path, height_unit=NM)
    path.write_text(path.read_text().replace("\n1250 250 ", "\n1300 250 "))
    with pytest.raises(UnfitTopography, match="regular grid"):
        scan(path, height_unit=NM)


def write_netcdf(path, turned=False, backwards=False, names=("y", "x"), unit="nm"):
    with netCDF4.Dataset(path, "w") as file:
        for name, count in zip(names, (ROWS, COLUMNS), strict=True):
            file.createDimension(name, count)
            axis = file.createVariable(name, "f8", (name,))
            axis.units = "um"
            axis[:] = np.arange(count) * 0.25
        height = file.createVariable("height", "f8", names[::-1] if turned else names, fill_value=-9999.0)
        height.units = unit
        stored = HEIGHTS[::-1] if backwards else HEIGHTS
        height[:] = stored.T if turned else stored
        if backwards:
            file[names[0]][:] = np.arange(ROWS)[::-1] * 0.25
        other = file.createVariable("phase", "f8", names)
        other[:] = 1.0
    return path


@pytest.mark.parametrize("keys", [{}, {"turned": True}, {"backwards": True}, {"turned": True, "backwards": True}])
def test_netcdf_says_its_axes_and_units(tmp_path, keys):
    assert_read(scan(write_netcdf(tmp_path / "scan.nc", **keys)))


def test_netcdf_with_axes_of_other_names(tmp_path):
    path = write_netcdf(tmp_path / "scan.nc", names=("row", "column"), turned=True)
    assert_read(scan(path, first_axis="x"))
    with pytest.raises(UnfitTopography, match=r"phase, height|height, phase") as raised:
        scan(path, data="width")
    assert raised.value.key == "data"


def test_netcdf_fill_values_are_missing_points(tmp_path):
    path = write_netcdf(tmp_path / "scan.nc")
    with netCDF4.Dataset(path, "a") as file:
        file["height"][3, 7] = -9999.0
    assert np.argwhere(np.isnan(scan(path).heights)).tolist() == [[3, 7]]


def test_unit_of_the_file_and_unit_that_is_given(tmp_path):
    path = write_netcdf(tmp_path / "scan.nc", unit="um")
    assert_read(scan(path), UM)
    assert_read(scan(path, height_unit=NM), NM)
    with pytest.raises(UnfitTopography) as raised:
        scan(write_netcdf(tmp_path / "volts.nc", unit="V"))
    assert raised.value.key == "height_unit"


@pytest.mark.parametrize(("first_axis", "stored"), [("y", HEIGHTS), ("x", HEIGHTS.T)])
def test_hdf5(tmp_path, first_axis, stored):
    path = tmp_path / "scan.h5"
    with h5py.File(path, "w") as file:
        file["scans/first"] = stored
        file["scans/first"].attrs["units"] = "nm"
        file["time"] = np.arange(5.0)
    assert_read(scan(path, size=SIZE, first_axis=first_axis))
    with h5py.File(path, "a") as file:
        file["scans/second"] = stored + 1
    with pytest.raises(UnfitTopography, match="scans/first, scans/second") as raised:
        scan(path, size=SIZE, first_axis=first_axis)
    assert raised.value.key == "data"
    assert_read(scan(path, size=SIZE, first_axis=first_axis, data="scans/first"))


def waves():
    """Some waves (kx, ky, amplitude) of a real series, one of every pair of opposite ones."""
    rng = np.random.default_rng(5)
    k = np.array([(1, 0), (0, 2), (3, 1), (-2, 3), (5, -4)])
    return k, rng.normal(size=5) + 1j * rng.normal(size=5)


def summed(n):
    """The same waves added up one by one, node by node."""
    y, x = np.mgrid[:n, :n] / n
    k, h = waves()
    each = (2 * (h_k * np.exp(2j * np.pi * (kx * x + ky * y))).real for (kx, ky), h_k in zip(k, h, strict=True))
    return sum(each)


@pytest.mark.parametrize("opposite", [False, True])
@pytest.mark.parametrize("integers", [False, True])
def test_fourier_list_of_the_challenge(tmp_path, opposite, integers):
    """Wave vectors in rad per 0.1 mm (or as integers), heights in 0.1 mm, and the smaller numbers touch first."""
    k, h = waves()
    if opposite:
        k, h = np.concatenate([k, -k]), np.concatenate([h, np.conj(h)])
    q = k if integers else 2 * np.pi * k
    np.savetxt(
        tmp_path / "list.dat",
        np.column_stack([q, h.real, h.imag]),
        fmt=["%d"] * 2 + ["%.12e"] * 2 if integers else "%.12e",
    )
    keys = {"size": (1e-4, 1e-4)} if integers else {}
    how = preparation(boundary="periodic", height_unit=1e-4, grid=24, touches_first="low", **keys)
    surface = prepared_topography(tmp_path / "list.dat", how).surface
    np.testing.assert_allclose(surface.heights, -1e-4 * summed(24), atol=1e-14)
    assert surface.period == pytest.approx(1e-4, rel=1e-10)


def test_fourier_lists_that_are_none(tmp_path):
    k, h = waves()
    path = tmp_path / "list.dat"
    np.savetxt(path, np.column_stack([k, h.real, h.imag]))
    how = preparation(boundary="periodic", height_unit=1e-4)
    with pytest.raises(UnfitTopography) as raised:
        prepared_topography(path, how)
    assert raised.value.key == "size"
    how["size"] = (1e-4, 1e-4)
    assert prepared_topography(path, how).surface.grid == 32  # the next power of two with four cells per wave
    with pytest.raises(UnfitTopography, match="at least 12") as raised:
        prepared_topography(path, how | {"grid": 10})
    assert raised.value.key == "grid"
    both = np.concatenate([k, -k]), np.concatenate([h, h])
    np.savetxt(path, np.column_stack([both[0], both[1].real, both[1].imag]))
    with pytest.raises(UnfitTopography, match="conjugate"):
        prepared_topography(path, how)


def write_by_surface_topography(path):
    from SurfaceTopography import Topography

    # SurfaceTopography's arrays have x first.
    Topography(HEIGHTS.T * 1e-3, tuple(side / UM for side in SIZE), unit="µm").to_netcdf(path)


def test_instrument_files_are_read_by_surface_topography(tmp_path):
    write_by_surface_topography(tmp_path / "scan.nc")
    assert_read(scan(tmp_path / "scan.nc", format="instrument"))
    assert_read(scan(tmp_path / "scan.nc"))
    assert_read(scan(tmp_path / "scan.nc", format="instrument", height_unit=UM), UM * 1e-3)


def test_instrument_file_by_its_content(tmp_path):
    """ISO 25178-71 in text, the format of many instruments, under a name that says nothing."""
    heading = {
        "ManufacID": "ICHA", "CreateDate": "010120260000", "ModDate": "010120260000", "NumPoints": COLUMNS,
        "NumProfiles": ROWS, "Xscale": "2.5E-7", "Yscale": "2.5E-7", "Zscale": "1E-9", "Zresolution": -1,
        "Compression": 0, "DataType": 7, "CheckType": 0,
    }  # fmt: skip
    lines = ["aISO-1.0", *(f"{name} = {value}" for name, value in heading.items()), "*"]
    lines += [" ".join(f"{height:.4f}" for height in row) for row in HEIGHTS] + ["*"]
    (tmp_path / "scan.sdf").write_text("\n".join(lines) + "\n")
    assert_read(scan(tmp_path / "scan.sdf"))


@pytest.mark.parametrize("name", ["scan.npy", "scan.nc", "scan.h5", "scan.xyz", "scan.txt", "scan.gwy"])
def test_damaged_files_are_refused_with_a_remedy(tmp_path, name):
    (tmp_path / name).write_bytes(bytes(range(256)) * 4)
    with pytest.raises(UnfitTopography, match=r"cannot be read as .*allowed") as raised:
        scan(tmp_path / name, height_unit=NM, size=SIZE)
    assert raised.value.key == "path"
    assert str(tmp_path) not in str(raised.value)


def test_what_is_missing_is_named(tmp_path):
    np.save(tmp_path / "scan.npy", HEIGHTS)
    for keys, key in (({"size": SIZE}, "height_unit"), ({"height_unit": NM}, "size")):
        with pytest.raises(UnfitTopography, match="is missing") as raised:
            scan(tmp_path / "scan.npy", **keys)
        assert raised.value.key == key
    np.save(tmp_path / "scan.npy", HEIGHTS[None])
    with pytest.raises(UnfitTopography, match=r"shape \(1, 10, 16\)"):
        scan(tmp_path / "scan.npy", height_unit=NM, size=SIZE)
    np.save(tmp_path / "scan.npy", HEIGHTS + 0j)
    with pytest.raises(UnfitTopography, match="complex128"):
        scan(tmp_path / "scan.npy", height_unit=NM, size=SIZE)
    with pytest.raises(UnfitTopography, match="no such file"):
        topography_facts(tmp_path / "nothing.npy", preparation())


# --- preparing -----------------------------------------------------------------------------------------------


@pytest.fixture
def prepared(tmp_path):
    def prepare(heights, **keys):
        np.save(tmp_path / "scan.npy", heights)
        keys = {"height_unit": 1.0, "size": tuple(0.5 * n for n in np.shape(heights)[::-1])} | keys
        return prepared_topography(tmp_path / "scan.npy", preparation(**keys))

    return prepare


def centred(heights):
    return heights - np.mean(heights)


def test_largest_square_in_the_middle(prepared):
    heights = np.random.default_rng(1).normal(size=(10, 17))
    surface = prepared(heights, boundary="free").surface
    np.testing.assert_allclose(surface.heights, centred(heights[:, 3:13]), atol=1e-14)
    assert surface.period == 5.0
    surface = prepared(heights.T, boundary="free").surface
    np.testing.assert_allclose(surface.heights, centred(heights.T[3:13]), atol=1e-14)


def test_crop(prepared):
    heights = np.random.default_rng(1).normal(size=(14, 20))
    result = prepared(heights, boundary="free", crop={"x": 3.5, "y": 1.0, "side": 4.5})
    np.testing.assert_allclose(result.surface.heights, centred(heights[2:11, 7:16]), atol=1e-14)
    assert result.surface.period == 4.5 and "cut to 9 x 9 points from (7, 2)" in result.description
    for crop in ({"x": 6.0, "y": 0.0, "side": 4.5}, {"x": 0.0, "y": 3.0, "side": 4.5}, {"x": 0, "y": 0, "side": 2.0}):
        with pytest.raises(UnfitTopography) as raised:
            prepared(heights, boundary="free", crop=crop)
        assert raised.value.key == "crop"


def test_low_numbers_touch_first(prepared):
    heights = np.random.default_rng(1).normal(size=(9, 9))
    np.testing.assert_allclose(
        prepared(heights, boundary="free", touches_first="low").surface.heights, -centred(heights), atol=1e-14
    )


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
    with pytest.raises(UnfitTopography, match=r"9 among 100; allowed: fill") as raised:
        prepared(holey, boundary="free")
    assert raised.value.key == "missing"
    result = prepared(holey, boundary="free", missing="fill")
    np.testing.assert_allclose(result.surface.heights, centred(harmonic), atol=1e-11)
    assert "9 missing points filled" in result.description
    # Those outside of the square that is used matter to nobody.
    assert prepared(np.pad(harmonic, ((0, 0), (2, 2)), constant_values=np.nan), boundary="free")
    holey[:, 2:9] = np.nan
    with pytest.raises(UnfitTopography, match="up to half"):
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
    assert result.rms_slope == pytest.approx(surface.rms_slope) and "0.25 of the side" in result.description


def test_periodic_scans_are_taken_as_they_are(prepared):
    surface = SelfAffineSpectrum(1.0, 0.5, 0.2, 0.8).realise(32, 3)
    taken = prepared(surface.heights, boundary="periodic", size=(1.0, 1.0))
    np.testing.assert_allclose(taken.surface.heights, surface.heights, atol=1e-16)
    assert taken.rms_slope == pytest.approx(1.0, rel=1e-12)
    with pytest.raises(UnfitTopography, match="needs a square") as raised:
        prepared(surface.heights[:20], boundary="periodic", size=(1.0, 0.625))
    assert raised.value.key == "boundary"


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


def test_pixels_that_are_not_square_need_a_grid(prepared):
    y, x = (np.arange(n) + 0.5 for n in (10, 20))
    heights = np.cos(2 * np.pi * y / 10)[:, None] + 0.5 * np.cos(4 * np.pi * x / 20)
    with pytest.raises(UnfitTopography, match="20 x 10 points") as raised:
        prepared(heights, boundary="free", size=(10.0, 10.0))
    assert raised.value.key == "grid"
    surface = prepared(heights, boundary="free", size=(10.0, 10.0), grid=16).surface
    z = np.arange(16) + 0.5
    wanted = np.cos(2 * np.pi * z / 16)[:, None] + 0.5 * np.cos(4 * np.pi * z / 16)
    np.testing.assert_allclose(surface.heights, wanted, atol=1e-13)
    with pytest.raises(UnfitTopography, match="no square"):
        prepared(heights, boundary="free", size=(10.0, 7.3), grid=16)


@pytest.mark.parametrize("boundary", ["free", "mirror", "window"])
@pytest.mark.parametrize(("detrend", "degree"), [("none", 0), ("tilt", 0), ("tilt", 1), ("curvature", 2)])
def test_a_flat_file_is_refused(prepared, boundary, detrend, degree):
    """Also where rounding is all that is left when the trend is removed: it would be scaled to any slope."""
    y, x = np.mgrid[:12, :12]
    with pytest.raises(UnfitTopography, match="all the same") as raised:
        prepared(0.1 + degree * 0.3 * x - (degree == 2) * 0.07 * y**2, boundary=boundary, detrend=detrend, taper=0.1)
    assert raised.value.key == "path"


def test_fine_roughness_on_a_high_step_is_none_of_rounding(prepared):
    """Nanometres on an offset of a metre."""
    rough = 1e-9 * np.random.default_rng(2).normal(size=(12, 12))
    surface = prepared(1.0 + rough, boundary="free").surface
    np.testing.assert_allclose(surface.heights, centred(rough), atol=3e-16)


@pytest.mark.parametrize(
    ("heights", "key", "words"),
    [
        (np.empty((0, 0)), "path", "no heights"),
        (np.empty((0, 12)), "path", "no heights"),
        (np.empty((12, 0)), "path", "no heights"),
        (np.ones((1, 1)), "path", "leaves 1 x 1 points"),
        (np.arange(12.0)[None], "path", "leaves 12 x 1 points"),
        (np.arange(12.0)[:, None], "path", "leaves 1 x 12 points"),
        (np.full((12, 12), np.nan), "path", "no height at all"),
        (np.where(np.eye(12) > 0, np.arange(12.0), np.nan), "missing", "would make up 132 of 144"),
        (np.where(np.eye(12) > 0, np.inf, np.arange(12.0)), "missing", "12 among 144"),
    ],
)
@pytest.mark.parametrize("detrend", ["none", "tilt"])
def test_too_little_for_a_surface(prepared, heights, key, words, detrend):
    missing = "fill" if "make up" in words else "refuse"
    with pytest.raises(UnfitTopography, match=words) as raised:
        prepared(heights, boundary="free", detrend=detrend, missing=missing, size=(6.0, 6.0))
    assert raised.value.key == key


@pytest.mark.parametrize("name", ["scan.txt", "scan.xyz", "scan.npy", "scan.nc", "scan.h5", "scan.dat"])
def test_an_empty_file_is_refused(tmp_path, name):
    (tmp_path / name).touch()
    with pytest.raises(UnfitTopography, match="is empty") as raised:
        scan(tmp_path / name, height_unit=NM, size=SIZE)
    assert raised.value.key == "path"


@pytest.mark.parametrize("kind", ["auto", "matrix", "xyz", "fourier"])
def test_a_heading_alone_is_refused(tmp_path, kind):
    (tmp_path / "scan.txt").write_text("# width 90 um\n\n  # heights\n")
    with pytest.raises(UnfitTopography, match="holds no numbers") as raised:
        scan(tmp_path / "scan.txt", format=kind, height_unit=NM, size=SIZE)
    assert raised.value.key == "path"


def test_messages_are_short_and_in_units_of_people(tmp_path, prepared):
    (tmp_path / "words.txt").write_text("no heights in here\n")
    with pytest.raises(UnfitTopography, match="none of the formats that SurfaceTopography knows") as raised:
        scan(tmp_path / "words.txt", height_unit=NM, size=SIZE)
    assert len(str(raised.value)) < 200
    crop = {"x": "7 um", "y": "0 um", "side": "2.5 um"}
    section = MeasuredSurface.model_validate(SECTION | {"crop": crop})
    assert repr(section.crop) == "a square of 2.5 um at x = 7 um, y = 0 m"
    with pytest.raises(UnfitTopography, match=r"ends at x = 9.5 um, y = 2.5 um, .* up to x = 4 um, y = 3 um"):
        prepared(np.eye(12, 16), size=(4e-6, 3e-6), crop=section.preparation["crop"])
    with pytest.raises(UnfitTopography, match=r"needs a square, and the scan is 4 um x 3 um"):
        prepared(np.eye(12, 16), size=(4e-6, 3e-6), boundary="periodic")


def test_where_coordinates_tell_the_size_their_unit_is_doubted(tmp_path):
    """Coordinates in micrometres, taken for nanometres as the heights are."""
    path = write_xyz(tmp_path / "scan.xyz")
    crop = {"x": 0.0, "y": 0.0, "side": 2000 * UM}
    with pytest.raises(UnfitTopography, match="units of 1 nm, see `lateral_unit`") as raised:
        prepared_topography(path, preparation(height_unit=NM, crop=crop))
    assert raised.value.key == "crop"
    assert (
        prepared_topography(path, preparation(height_unit=NM, lateral_unit=UM, crop=crop)).surface.period == 4000 * UM
    )
    # Not where the size was given.
    with pytest.raises(UnfitTopography) as raised:
        prepared_topography(path, preparation(height_unit=NM, size=SIZE, crop=crop))
    assert "lateral_unit" not in str(raised.value)


def test_provenance_and_facts(prepared, tmp_path):
    heights = np.random.default_rng(4).normal(size=(10, 10))
    result = prepared(heights, boundary="free", detrend="tilt")
    assert result.source_file == "scan.npy"
    assert result.source_sha256 == hashlib.sha256((tmp_path / "scan.npy").read_bytes()).hexdigest()
    assert str(tmp_path) not in result.description
    how = preparation(height_unit=1.0, size=(5.0, 5.0), boundary="free", detrend="tilt")
    facts = topography_facts(tmp_path / "scan.npy", how)
    assert (facts.grid, facts.period, facts.boundary) == (10, 5.0, "free")
    assert facts.rms_slope == result.rms_slope
    # A file that changes is read again.
    np.save(tmp_path / "scan.npy", np.pad(heights, 1))
    assert topography_facts(tmp_path / "scan.npy", how).grid == 12


def test_synthetic_scan_is_what_its_script_makes(tmp_path):
    spec = importlib.util.spec_from_file_location("make_scan", TOPOGRAPHIES / "make_synthetic_scan.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    script.write(tmp_path / "again.txt")
    assert (tmp_path / "again.txt").read_bytes() == (TOPOGRAPHIES / "synthetic_scan.txt").read_bytes()
    section = MeasuredSurface.model_validate(
        {
            "kind": "measured", "path": "synthetic_scan.txt", "height_unit": "nm", "size": ["72 um", "64 um"],
            "missing": "fill", "detrend": "curvature", "boundary": "mirror",
        }
    )  # fmt: skip
    result = prepared_topography(TOPOGRAPHIES / "synthetic_scan.txt", json.loads(json.dumps(section.preparation)))
    assert result.surface.grid == 256 and result.surface.period == pytest.approx(128e-6)
    # What was put in: slopes of 0.15 of the roughness; the scratch and the filled points add a little.
    assert 0.12 < result.rms_slope < 0.2


# --- the spectrum --------------------------------------------------------------------------------------------


def test_power_spectrum_is_that_of_the_synthesis():
    """C(q) of every ring: integral over the plane is h_rms^2, and the spectrum that was asked for comes back."""
    spectrum = SelfAffineSpectrum(1.0, 0.25, 0.02, 0.7)
    surface = spectrum.realise(256, 9)
    q, power = radial_power_spectrum(surface)
    assert np.all(np.diff(q) > 0)
    inside = (q > 1.05 * 2 * np.pi / 0.25) & (q < 0.95 * 2 * np.pi / 0.02)
    np.testing.assert_allclose(power[inside], spectrum.psd(q[inside]), rtol=0.03)
    assert np.all(power[q > 1.1 * 2 * np.pi / 0.02] < 1e-20 * power.max())


def test_power_spectrum_of_one_wave_is_where_it_belongs():
    y, x = np.mgrid[:64, :64] / 64
    surface = Surface(2.0 * np.cos(2 * np.pi * (6 * x + 8 * y)), 3.0)
    q, power = radial_power_spectrum(surface)
    assert q[np.argmax(power)] == pytest.approx(10 * 2 * np.pi / 3.0, rel=0.05)


def test_power_spectrum_of_a_free_square_does_not_see_its_edges():
    """A window keeps the jump at the edges of a cut-out part from drowning the short waves."""
    spectrum = SelfAffineSpectrum(4.0, 0.5, 0.1, 0.8)
    whole = spectrum.realise(512, 2)
    part = Surface(whole.heights[:256, :256], 2.0, boundary="free")
    q, power = radial_power_spectrum(part)
    inside = (q > 2 * 2 * np.pi / 0.5) & (q < 0.9 * 2 * np.pi / 0.1)
    np.testing.assert_allclose(power[inside], spectrum.psd(q[inside]), rtol=0.6)
    beyond = q > 1.5 * 2 * np.pi / 0.1
    assert np.max(power[beyond]) < 1e-2 * spectrum.psd(0.95 * 2 * np.pi / 0.1)


# --- the section of the configuration ------------------------------------------------------------------------

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


# --- the surface file ----------------------------------------------------------------------------------------


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
    assert float(file["measured_rms_slope"]) == result.rms_slope and float(file["rms_slope"]) == pytest.approx(1.0)
    # Heights times the measured slope are those of the measurement.
    again = read_surface(tmp_path / "one.nc")
    assert again.free
    np.testing.assert_allclose(again.scaled_to_rms_slope(result.rms_slope).heights, result.surface.heights, atol=1e-13)


def test_surface_files_of_all_kinds_have_their_power_spectrum(tmp_path):
    spectrum = SelfAffineSpectrum(1.0, 0.5, 0.1, 0.8)
    write_surface(tmp_path / "s.nc", spectrum.realise(64, 1), name="rough", seed=1, spectrum=spectrum)
    file = read_dataset(tmp_path / "s.nc")
    assert file.attrs["boundary"] == "periodic" and "source_file" not in file.attrs
    q, power = file["psd_wavevector"].values, file["power_spectrum"].values
    assert file["power_spectrum"].attrs["units"] == "m^4" and file["psd_wavevector"].attrs["units"] == "rad m^-1"
    # The integral over the plane of wave vectors, ring by ring, is the mean square height.
    low, high = file["psd_wavevector_bounds"].values.T
    assert np.all((low < q) & (q < high)) and file["psd_wavevector"].attrs["bounds"] == "psd_wavevector_bounds"
    variance = np.sum(np.pi * (high**2 - low**2) * power)
    assert variance == pytest.approx(float(file["rms_height"]) ** 2, rel=0.1)
