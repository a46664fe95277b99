"""Readers of measured topographies, on files that are written here."""

import struct
import zipfile
import zlib
from functools import partial
from pathlib import Path

import h5py
import netCDF4
import numpy as np
import pytest
from scans import COLUMNS, HEIGHTS, NM, ROWS, SIZE, UM, assert_read, preparation, refused, scan, write_netcdf, write_xyz
from scipy.io import savemat
from SurfaceTopography.Exceptions import CorruptFile

from icha.surfaces.measured.settings import UnfitTopography
from icha.surfaces.measured.topography import prepared_topography


def test_first_axis_exchanges_rows_and_cells(tmp_path):
    lines = [" ".join(f"{height:.4f}" for height in row) for row in HEIGHTS.T]
    for heading in (["# Pixel: 0.25 um"], [f"Scan size: {SIZE[1] / UM} um x {SIZE[0] / UM} um"]):
        (tmp_path / "scan.txt").write_text("\n".join([*heading, "# Unit: nm", *lines]) + "\n")
        assert_read(scan(tmp_path / "scan.txt", first_axis="x"))


@pytest.mark.parametrize("separator", [" ", ","])
def test_xyz_in_any_order(tmp_path, separator):
    order = np.random.default_rng(8).permutation(HEIGHTS.size)
    path = write_xyz(tmp_path / "scan.xyz", order, separator)
    # Coordinates without a unit have no size.
    with refused("lateral_unit", "or the `size` of the scan"):
        scan(path, height_unit=NM)
    assert_read(scan(path.rename(tmp_path / "scan.txt"), height_unit=NM, lateral_unit=NM))
    # Coordinates in another unit than the heights; a size goes before both.
    wide = scan(tmp_path / "scan.txt", height_unit=NM, lateral_unit=UM)
    np.testing.assert_allclose(wide.size, np.multiply(SIZE, 1000))
    assert_read(scan(tmp_path / "scan.txt", height_unit=NM, lateral_unit=UM, size=SIZE))


def test_xyz_written_with_few_digits(tmp_path):
    y, x = np.mgrid[:40, :60] * 0.1953
    table = np.column_stack([x.ravel(), y.ravel(), np.arange(2400.0)])
    np.savetxt(tmp_path / "scan.xyz", table, fmt="%.2f")
    read = scan(tmp_path / "scan.xyz", height_unit=UM, lateral_unit=UM)
    assert read.heights.shape == (40, 60)
    np.testing.assert_array_equal(read.heights.ravel(), np.arange(2400.0) * UM)
    np.testing.assert_allclose(read.size, [60 * 0.1953 * UM, 40 * 0.1953 * UM], rtol=1e-3)


def test_xyz_with_a_point_twice_or_off_the_grid(tmp_path):
    path = write_xyz(tmp_path / "scan.xyz", [*range(160), 5])
    with pytest.raises(UnfitTopography, match="x = 1250, y = 0 twice"):
        scan(path, height_unit=NM)
    path.write_text(path.read_text().replace("\n1250 250 ", "\n1300 250 "))
    with pytest.raises(UnfitTopography, match="regular grid"):
        scan(path, height_unit=NM)


@pytest.mark.parametrize("keys", [{}, {"turned": True}, {"backwards": True}, {"turned": True, "backwards": True}])
def test_netcdf_says_its_axes_and_units(tmp_path, keys):
    assert_read(scan(write_netcdf(tmp_path / "scan.nc", **keys)))


def test_netcdf_whose_numbers_increase_downwards_is_asked_about(tmp_path):
    path = write_netcdf(tmp_path / "scan.nc")
    with netCDF4.Dataset(path, "a") as file:
        file["height"].positive = "down"
    with refused("touches_first", "positive: down"):
        scan(path)
    scan(path, touches_first="low")


def test_units_and_missing_points_of_the_file(tmp_path):
    path = write_netcdf(tmp_path / "scan.nc", unit="um")
    assert_read(scan(path), UM)
    assert_read(scan(path, height_unit=NM), NM)
    with refused("height_unit"):
        scan(write_netcdf(tmp_path / "volts.nc", unit="V"))
    with netCDF4.Dataset(path, "a") as file:
        file["height"][3, 7] = -9999.0  # the fill value
    assert np.argwhere(np.isnan(scan(path).heights)).tolist() == [[3, 7]]


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
    with refused("data", "scans/first, scans/second"):
        scan(path, size=SIZE, first_axis=first_axis)
    assert_read(scan(path, size=SIZE, first_axis=first_axis, data="scans/first"))


@pytest.mark.parametrize("name", ["scale", "gain", "z_scale", "ScaleFactor"])
def test_attributes_that_may_be_factors_are_asked_about(tmp_path, name):
    with h5py.File(tmp_path / "scan.h5", "w") as file:
        file.create_dataset("z", data=HEIGHTS).attrs.update({name: 0.1, "unit": "nm"})
    with refused("height_unit", f"'{name}: 0.1', which may be a factor of the heights"):
        scan(tmp_path / "scan.h5", size=SIZE)
    assert_read(scan(tmp_path / "scan.h5", size=SIZE, height_unit=0.1 * NM), 0.1 * NM)


@pytest.mark.parametrize("fill", ["_FillValue", "missing_value", "fillvalue"])
@pytest.mark.parametrize("scale", [{}, {"scale_factor": 0.5, "add_offset": 3.0}])
def test_hdf5_packed_as_netcdf(tmp_path, fill, scale):
    factor, offset = scale.get("scale_factor", 1.0), scale.get("add_offset", 0.0)
    stored = np.rint(HEIGHTS * 1e4).astype("i4")
    stored[3, 7] = -99999
    with h5py.File(tmp_path / "scan.h5", "w") as file:
        data = file.create_dataset("z", data=stored, fillvalue=-99999 if fill == "fillvalue" else None)
        data.attrs.update(scale | {"units": "nm"} | ({} if fill == "fillvalue" else {fill: -99999}))
    heights = scan(tmp_path / "scan.h5", size=SIZE).heights
    assert np.argwhere(np.isnan(heights)).tolist() == [[3, 7]]
    known = np.isfinite(heights)
    np.testing.assert_allclose(heights[known], (stored[known] * factor + offset) * NM, rtol=1e-12)


def write_by_surface_topography(path):
    from SurfaceTopography import Topography

    # SurfaceTopography's arrays have x first.
    Topography(HEIGHTS.T * 1e-3, tuple(side / UM for side in SIZE), unit="µm").to_netcdf(path)


def test_instrument_files_are_read_by_surface_topography(tmp_path):
    write_by_surface_topography(tmp_path / "scan.nc")
    assert_read(scan(tmp_path / "scan.nc", format="instrument"))
    assert_read(scan(tmp_path / "scan.nc"))
    assert_read(scan(tmp_path / "scan.nc", format="instrument", height_unit=UM), UM * 1e-3)


X3P = (
    '<?xml version="1.0" encoding="UTF-8"?><p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2"><Record1>'
    "<Revision>{revision}</Revision><FeatureType>SUR</FeatureType><Axes>"
    "<CX><AxisType>I</AxisType><DataType>D</DataType><Increment>2.5e-07</Increment><Offset>0</Offset></CX>"
    "<CY><AxisType>I</AxisType><DataType>D</DataType><Increment>2.5e-07</Increment><Offset>0</Offset></CY>"
    "<CZ><AxisType>A</AxisType><DataType>D</DataType><Increment>1</Increment><Offset>0</Offset></CZ></Axes></Record1>"
    "<Record2><Date>2026-01-01T00:00:00</Date></Record2><Record3><MatrixDimension><SizeX>{nx}</SizeX><SizeY>{ny}</SizeY><SizeZ>1</SizeZ></MatrixDimension>"
    "<DataLink><PointDataLink>bindata/data.bin</PointDataLink></DataLink></Record3></p:ISO5436_2>"
)


@pytest.mark.parametrize("revision", ["ISO5436 - 2000", "ISO5436 – 2000", "ISO5436-2000"])
@pytest.mark.parametrize("folder", ["", "scan/", "scan\\"])
def test_x3p_as_other_programs_write_it(tmp_path, revision, folder):
    data = HEIGHTS.copy() * NM
    data[3, 7] = np.nan
    separator = "\\" if "\\" in folder else "/"
    with zipfile.ZipFile(tmp_path / "scan.x3p", "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("__MACOSX/scan/._main.xml", "rubbish")
        file.writestr(f"{folder}main.xml", X3P.format(revision=revision, nx=COLUMNS, ny=ROWS))
        file.writestr(f"{folder}bindata{separator}data.bin", data.astype("<f8").tobytes())
    read = scan(tmp_path / "scan.x3p")
    assert np.argwhere(np.isnan(read.heights)).tolist() == [[3, 7]]
    np.testing.assert_allclose(np.nan_to_num(read.heights), np.nan_to_num(data), rtol=1e-12)
    np.testing.assert_allclose(read.size, SIZE)


@pytest.mark.parametrize("streams", [0, 1, 3])
def test_sur_of_digital_surf_with_and_without_compression(tmp_path, streams):
    raw = np.rint(HEIGHTS * 1e4).astype("<i4").tobytes()
    comment, private = b"a comment", b"private"
    head = struct.pack("<12s4H", b"DSCOMPRESSED" if streams else b"DIGITAL SURF", 0, 1, 1, 2).ljust(98, b"\0")
    head += struct.pack("<H2i2iI3f", 32, -(10**6), 10**6, COLUMNS, ROWS, HEIGHTS.size, 0.25, 0.25, 1e-4)
    units = [b"\xb5m", b"\xb5m", b"nm"]
    head += b"".join(text.ljust(16, b"\0") for text in (b"X", b"Y", b"Z", *units, *units))
    head += struct.pack("<3f3H", 1, 1, 1, 0, 0, 0).ljust(18 + 12, b"\0")
    head = (head + struct.pack("<7H", 0, 0, 0, 1, 1, 2026, 1)).ljust(334, b"\0")
    head = (head + struct.pack("<2H", len(comment), len(private))).ljust(512, b"\0") + comment + private
    if streams:
        parts = [raw[k::1][: len(raw) // streams] for k in range(0, len(raw), len(raw) // streams)]
        packed = [zlib.compress(part) for part in parts]
        lengths = [number for pair in zip(map(len, parts), map(len, packed), strict=True) for number in pair]
        raw = struct.pack(f"<{1 + len(lengths)}I", len(parts), *lengths) + b"".join(packed)
    (tmp_path / "scan.sur").write_bytes(head + raw)
    read = scan(tmp_path / "scan.sur")
    # The file has the digits of single precision.
    np.testing.assert_allclose(read.heights, HEIGHTS * NM, rtol=1e-6)
    np.testing.assert_allclose(read.size, SIZE, rtol=1e-6)


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


def test_a_damaged_text_of_an_instrument_is_refused_as_one(tmp_path, monkeypatch):
    """The heading of WSxM above rows of numbers that are not its own; and a file that its reader cannot even open."""
    heading = (Path(__file__).parents[1] / "data/topographies/top-1.top").read_bytes()[:2245]
    (tmp_path / "scan.txt").write_bytes(heading + b"1 2 3 4 5 6 7 8\n" * 8)

    def corrupt(*_):
        raise CorruptFile("words of a library")

    for _ in range(2):
        with pytest.raises(UnfitTopography, match="cannot be read as instrument") as raised:
            scan(tmp_path / "scan.txt", height_unit=NM, size=SIZE)
        assert raised.value.key == "path" and "library" not in str(raised.value)
        monkeypatch.setattr("SurfaceTopography.open_topography", corrupt)


LINE_SCAN = "is a line scan, one profile of 50 points"
WITHOUT_A_MAP = [
    ("profile.txt", "\n".join(f"{k * 0.1} {k % 7}" for k in range(50)), LINE_SCAN),
    ("profile.txt", "\n".join(f"{k % 7}" for k in range(50)), LINE_SCAN),
    ("profile.xyz", "\n".join(f"{k * 0.1} 2.5 {k % 7}" for k in range(50)), LINE_SCAN),
    *((f"scan.{ending}", "", "is empty") for ending in ("txt", "xyz", "npy", "nc", "h5", "dat")),
    ("heading.xyz", "# width 90 um\n\n  # heights\n", "has no numbers"),
]
PROFILE = "X;Y;valid\n[mm];[mm];[1/0]\n" + "\n".join(f"{k * 0.1};{k % 7};1" for k in range(50))


@pytest.mark.parametrize(("name", "content", "words"), WITHOUT_A_MAP, ids=[name for name, *_ in WITHOUT_A_MAP])
def test_a_file_without_a_map_of_heights_is_refused(tmp_path, name, content, words):
    (tmp_path / name).write_text(content)
    with refused("path", words):
        scan(tmp_path / name, height_unit=NM, size=SIZE)


def test_the_columns_of_a_profile_are_asked_for(tmp_path):
    (tmp_path / "profile.csv").write_text(PROFILE)
    with refused("columns", r"the columns are \[mm\], \[mm\], \[1/0\]; expected the columns x, y and z"):
        scan(tmp_path / "profile.csv", height_unit=NM, size=SIZE)


def test_what_is_missing_is_named(tmp_path):
    np.save(tmp_path / "scan.npy", HEIGHTS)
    for keys, key in (({"size": SIZE}, "height_unit"), ({"height_unit": NM}, "size")):
        with refused(key, "is missing"):
            scan(tmp_path / "scan.npy", **keys)
    np.save(tmp_path / "scan.npy", HEIGHTS + 0j)
    with pytest.raises(UnfitTopography, match="complex128"):
        scan(tmp_path / "scan.npy", height_unit=NM, size=SIZE)
    (tmp_path / "scan.txt").write_text("# width 90 um\n\n  # heights\n")
    with refused("path", "has no numbers"):
        scan(tmp_path / "scan.txt", format="matrix", height_unit=NM, size=SIZE)
    with pytest.raises(UnfitTopography, match="no such file"):
        prepared_topography(tmp_path / "nothing.npy", preparation())


# --- arrays and channels: the chosen one is reported, and those of MATLAB have the right orientation ---

LINES = {"height_unit": NM, "size": SIZE}


def write_mat(path, **arrays):
    savemat(path, arrays)


def write_npz(path, **arrays):
    np.savez(path, **arrays)


def write_new_mat(path, attribute=False, block=0, **arrays):
    """MATLAB 7.3 stores the transpose of each array in HDF5, with attributes and a heading if it did so itself."""
    with h5py.File(path, "w", userblock_size=block) as file:
        for name, array in arrays.items():
            file[name] = array.T
            if attribute:
                file[name].attrs["MATLAB_class"] = np.bytes_("double")
        file["title"] = np.frombuffer(b"a scan of mine", "u1").astype("u2").reshape(7, 2)
        file["title"].attrs["MATLAB_class"] = np.bytes_("char")
        file["mask"] = (HEIGHTS.T > 0).astype("u1")
        file["mask"].attrs["MATLAB_class"] = np.bytes_("logical")
        file["#refs#/a"] = HEIGHTS.T
    if block:
        with path.open("r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file")


MAT = [partial(write_new_mat, attribute=attribute, block=block) for attribute in (False, True) for block in (0, 512)]
WRITERS = [("scan.mat", write_mat), ("scan.npz", write_npz), *(("scan.mat", write) for write in MAT)]


@pytest.mark.parametrize(("name", "write"), WRITERS)
def test_of_several_arrays_one_must_be_named(tmp_path, name, write):
    path = tmp_path / name
    write(path, Intensity=np.abs(HEIGHTS), Z=HEIGHTS, pixel=np.ones((1, 1)), phase=1j * HEIGHTS)
    with refused("data", r"the file has 2 real \w+s; expected one of: Intensity, Z"):
        scan(path, **LINES)
    read = scan(path, data="Z", **LINES)
    assert_read(read)
    assert read.data == "Z" and "data Z of several" in read.steps[0]
    # A single map among numbers needs no name.
    write(path, Z=HEIGHTS, a=np.ones((1, 1)))
    for keys in ({}, {"data": "Z"}):
        read = scan(path, **keys, **LINES)
        assert_read(read)
        assert read.data == ""


@pytest.mark.parametrize(("name", "write"), [*WRITERS, ("scan.npy", lambda path, Z: np.save(path, Z))])
def test_rows_run_along_x_unless_first_axis_says_otherwise(tmp_path, name, write):
    """The same rule for all arrays whose axes have no names."""
    write(tmp_path / name, Z=HEIGHTS)
    read = scan(tmp_path / name, **LINES)
    assert_read(read)
    assert (read.format == "matlab") == name.endswith(".mat")
    write(tmp_path / name, Z=HEIGHTS.T)
    assert_read(scan(tmp_path / name, first_axis="x", **LINES))


def test_first_axis_against_the_file_is_refused(tmp_path):
    assert_read(scan(write_netcdf(tmp_path / "turned.nc", turned=True), first_axis="x"))
    write_by_surface_topography(tmp_path / "other.nc")
    for path, keys in (
        (write_netcdf(tmp_path / "scan.nc"), {}),
        (tmp_path / "other.nc", {"format": "instrument"}),
        (write_xyz(tmp_path / "scan.xyz"), {"height_unit": NM, "lateral_unit": NM}),
    ):
        with refused("first_axis", "the file states which of its axes is x"):
            scan(path, first_axis="x", **keys)


@pytest.mark.parametrize(
    ("values", "size"),
    [
        (np.array([f"c{k}" for k in range(COLUMNS)], object), None),
        (np.arange(COLUMNS), None),
        (np.arange(COLUMNS) ** 2.0, "unequal steps"),
        (np.r_[0, 2, 1, 3:COLUMNS], "unequal steps"),
    ],
)
def test_netcdf_coordinates_of_other_kinds(tmp_path, values, size):
    """Text, indices and empty coordinates give no size; coordinates that are no grid are refused."""
    with netCDF4.Dataset(tmp_path / "scan.nc", "w") as file:
        file.createDimension("y", ROWS)
        file.createDimension("x", COLUMNS)
        file.createDimension("two", 2)
        kind = str if values.dtype == object else values.dtype
        file.createVariable("x", kind, ("x",))[:] = values
        file.createVariable("y", "f8", ("y",))[:] = np.arange(ROWS)
        file["y"].units = "seconds since 2026-01-01"
        file.createVariable("x_bounds", "f8", ("x", "two"))[:] = 0.0
        file.createVariable("z_of_text", str, ("y", "x"))
        file.createVariable("surface", "f8", ("y", "x"))[:] = HEIGHTS
    if size:
        with refused("path", size):
            scan(tmp_path / "scan.nc", **LINES)
        return
    assert_read(scan(tmp_path / "scan.nc", **LINES))
    with refused("size", "is missing"):
        scan(tmp_path / "scan.nc", height_unit=NM)


@pytest.mark.parametrize("unit", ["px", "pixels", "pica", "point", "hand", "pt", "au", "pc", "li", "ly", "furlong"])
def test_units_that_no_microscope_writes_are_no_lengths(tmp_path, unit):
    with refused("size", "is missing"):
        scan(write_netcdf(tmp_path / "scan.nc", lateral=unit))


@pytest.mark.parametrize("name", ["scan.npy", "scan.npz", "scan.mat", "scan.nc", "scan.h5", "scan.gwy", "scan.datx"])
def test_messages_have_no_words_of_libraries(tmp_path, name):
    signature = {"npy": b"\x93NUMPY", "npz": b"PK\x03\x04", "mat": b"MATLAB 5.0 MAT-file", "gwy": b"GWYP"}
    start = signature.get(name.partition(".")[2], b"\x89HDF\r\n\x1a\n")
    (tmp_path / name).write_bytes(start + bytes(range(256)) * 4)
    with pytest.raises(UnfitTopography, match=r"cannot be read( as \w+)?: the file is .*; expected ") as raised:
        scan(tmp_path / name, **LINES)
    assert len(str(raised.value)) < 220
