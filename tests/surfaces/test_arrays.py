"""Arrays and channels of a file: none is taken without a word, and MATLAB's are the right way round."""

import h5py
import netCDF4
import numpy as np
import pytest
from scans import COLUMNS, HEIGHTS, NM, ROWS, SIZE, assert_read, preparation, refused, scan
from scipy.io import savemat

from icha.surfaces.measured.resolution import scan_resolution
from icha.surfaces.measured.settings import UnfitTopography
from icha.surfaces.measured.topography import prepared_topography

LINES = {"height_unit": NM, "size": SIZE}


def write_mat(path, **arrays):
    """MATLAB's rows run along x, as SurfaceTopography reads them."""
    savemat(path, {name: array.T for name, array in arrays.items()})


def write_npz(path, **arrays):
    np.savez(path, **{name: array.T for name, array in arrays.items()})


@pytest.mark.parametrize(("name", "write"), [("scan.mat", write_mat), ("scan.npz", write_npz)])
def test_of_several_arrays_one_must_be_named(tmp_path, name, write):
    path = tmp_path / name
    write(path, Intensity=np.abs(HEIGHTS), Z=HEIGHTS, pixel=np.ones((1, 1)))
    with refused("data", "the file has 2; allowed: Intensity, Z"):
        scan(path, **LINES)
    read = scan(path, data="Z", **LINES)
    assert_read(read)
    assert read.data == "Z" and "data Z of several" in read.steps[0]
    # Of a single map among numbers nothing is asked.
    write(path, Z=HEIGHTS, a=np.ones((1, 1)))
    read = scan(path, **LINES)
    assert_read(read)
    assert read.data == ""


@pytest.mark.parametrize("attribute", [True, False])
@pytest.mark.parametrize("block", [0, 512])
def test_new_files_of_matlab_are_the_right_way_round(tmp_path, attribute, block):
    path = tmp_path / "scan.mat"
    with h5py.File(path, "w", userblock_size=block) as file:
        for name, array in (("Z", HEIGHTS), ("step", np.ones((1, 1)))):
            file[name] = array.T
            if attribute:
                file[name].attrs["MATLAB_class"] = np.bytes_("double")
        file["title"] = np.frombuffer(b"a scan of mine", "u1").astype("u2").reshape(7, 2)
        file["title"].attrs["MATLAB_class"] = np.bytes_("char")
    if block:
        with path.open("r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file")
    read = scan(path, **LINES)
    assert_read(read)
    assert read.format == "hdf5"


@pytest.mark.parametrize("name", ["scan.dat", "scan", "scan.hdf"])
def test_hdf5_is_known_by_its_signature(tmp_path, name):
    with h5py.File(tmp_path / name, "w") as file:
        file["height"] = HEIGHTS[None, None]
    assert_read(scan(tmp_path / name, **LINES))


def write_netcdf(path, unit="um", several=False):
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("time", 1)
        for axis, count in (("y", ROWS), ("x", COLUMNS)):
            file.createDimension(axis, count)
            file.createVariable(axis, "f8", (axis,))[:] = np.arange(count) * 0.25
            file[axis].units = unit
        for name in ("height", "phase")[: 1 + several]:
            file.createVariable(name, "f8", ("time", "y", "x"))[:] = HEIGHTS
            file[name].units = "nm"
    return path


@pytest.mark.parametrize("name", ["scan.nc", "scan.cdf"])
def test_leading_dimensions_of_one_entry_are_passed_over(tmp_path, name):
    assert_read(scan(write_netcdf(tmp_path / name)))


@pytest.mark.parametrize("unit", ["px", "pixels", "pica", "point", "hand", "pt", "au", "pc", "li"])
def test_units_that_no_microscope_writes_are_no_lengths(tmp_path, unit):
    with refused("size", "is missing"):
        scan(write_netcdf(tmp_path / "scan.nc", unit))


@pytest.mark.parametrize("share", [0.02, 0.3])
def test_share_of_filled_points_is_said(tmp_path, share):
    heights = np.random.default_rng(4).normal(size=(20, 20))
    count = round(share * 400)
    heights.ravel()[np.random.default_rng(5).choice(400, count, replace=False)] = np.nan
    np.save(tmp_path / "scan.npy", heights)
    how = preparation(boundary="free", missing="fill", height_unit=NM, size=(5e-6, 5e-6))
    said = prepared_topography(tmp_path / "scan.npy", how).description
    assert f"{count} missing points filled, {share:.2g}".split(", ")[0] in said
    assert f"{100 * share:.0f} % of the points" in said
    resolution = scan_resolution(tmp_path / "scan.npy", how)
    assert (resolution.filled, resolution.points) == (count, 400)


@pytest.mark.parametrize("name", ["scan.npy", "scan.npz", "scan.mat", "scan.nc", "scan.h5", "scan.gwy", "scan.datx"])
def test_messages_have_no_words_of_libraries(tmp_path, name):
    signature = {"npy": b"\x93NUMPY", "npz": b"PK\x03\x04", "mat": b"MATLAB 5.0 MAT-file", "gwy": b"GWYP"}
    start = signature.get(name.partition(".")[2], b"\x89HDF\r\n\x1a\n")
    (tmp_path / name).write_bytes(start + bytes(range(256)) * 4)
    with pytest.raises(UnfitTopography, match=r"cannot be read as \w+: the file is .*; allowed: ") as raised:
        scan(tmp_path / name, **LINES)
    assert len(str(raised.value)) < 220
