"""Untrusted data files: their declared and unpacked sizes and their links are bounded, with messages."""

import os
import re
import shutil
import socket
import subprocess
import sys
import zlib
from pathlib import Path

import h5py
import netCDF4
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scans import HEIGHTS, NM, SIZE, preparation, refused, scan, write_netcdf, write_xyz

from icha.datasets.format import UnknownFile, identify_file
from icha.surfaces.measured.scan import read_height_map
from icha.surfaces.measured.settings import UnfitTopography
from icha.surfaces.measured.topography import prepared_topography

HUGE = 200_000  # nodes a side: 320 GB as floats
LINES = {"height_unit": NM, "size": SIZE}


def declare_npy(path):
    with path.open("wb") as file:
        np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": (HUGE, HUGE)})
        file.write(bytes(8))
    with path.open("r+b") as file:  # as long as declared, though nothing is on the disk
        file.truncate(8 * HUGE**2 + 128)


def declare_netcdf(path):
    with netCDF4.Dataset(path, "w") as file:
        for axis in "yx":
            file.createDimension(axis, HUGE)
        file.createVariable("height", "f8", ("y", "x"), chunksizes=(100, 100), compression="zlib")


def declare_hdf5(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("height", (HUGE, HUGE), "f8", chunks=(100, 100), compression="gzip")


def declare_points(path):
    """Four points in the corners of a scan, and their neighbours."""
    ends = (0, 1, 30_000, 30_001)
    path.write_text("".join(f"{x} {y} {x % 7}\n" for y in ends for x in ends))


DECLARED = {"npy": declare_npy, "nc": declare_netcdf, "h5": declare_hdf5, "xyz": declare_points}


@pytest.mark.parametrize("ending", DECLARED)
def test_declared_sizes_are_bounded_before_anything_is_read(ending, tmp_path):
    path = tmp_path / f"scan.{ending}"
    DECLARED[ending](path)
    with refused("path", r"needs about .*B of memory; expected at most 2 GB"):
        scan(path, **LINES)
    if ending in ("nc", "npy"):
        with pytest.raises(ValueError, match=r"needs about .* at most 2 GB\. To allow more, .* ICHA_INPUT_MB"):
            read_height_map(path, 1.0)


def test_the_limit_can_be_raised_and_must_be_a_number(tmp_path, monkeypatch):
    np.save(tmp_path / "scan.npy", np.random.default_rng(1).normal(size=(300, 300)))
    monkeypatch.setenv("ICHA_INPUT_MB", "1")
    with pytest.raises(UnfitTopography, match=r"needs about 2\.16 MB of memory; expected at most 1 MB"):
        scan(tmp_path / "scan.npy", **LINES)
    monkeypatch.setenv("ICHA_INPUT_MB", "3")
    assert scan(tmp_path / "scan.npy", **LINES).heights.shape == (300, 300)
    monkeypatch.setenv("ICHA_INPUT_MB", "much")
    with pytest.raises(UnfitTopography, match="ICHA_INPUT_MB: 'much' is not a number of MB"):
        scan(tmp_path / "scan.npy", **LINES)


def packed(megabytes):
    """Compress megabytes of zeros to a thousandth (RFC 1950): one block, repeated."""
    packer = zlib.compressobj(wbits=-15)
    block = packer.compress(bytes(10**6)) + packer.flush(zlib.Z_FULL_FLUSH)
    adler32 = (megabytes * 10**6 % 65521 << 16) + 1
    return b"\x78\x01" + block * megabytes + b"\x03\x00" + adler32.to_bytes(4, "big")


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux can bound the memory of a process")
def test_files_that_unpack_to_more_than_they_declare_are_refused(tmp_path):
    """Read in a separate process with 20 MB; the chunk of the first two files has 2 GB."""
    names = ("scan.h5", "scan.nc", "scan.npz")
    for name in names[:2]:
        with h5py.File(tmp_path / name, "w") as file:
            heights = file.create_dataset("height", (64, 64), "f8", chunks=(64, 64), compression="gzip")
            heights.id.write_direct_chunk((0, 0), packed(2000))
    np.savez_compressed(tmp_path / names[2], heights=np.zeros((2000, 2000)))
    script = (
        "import sys, resource; from pathlib import Path\n"
        "import h5py, netCDF4, SurfaceTopography\n"
        "from icha.surfaces.measured.scan import load_scan\n"
        "from icha.surfaces.measured.settings import Preparation\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "for name in sys.argv[1:]:\n"
        "    try: load_scan(Path(name), Preparation('auto', 'free', height_unit=1.0, size=(1.0, 1.0)))\n"
        "    except ValueError as error: print(type(error).__name__, error)\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)\n"
    )
    command = [sys.executable, "-c", script, *(str(tmp_path / name) for name in names)]
    environment = os.environ | {"ICHA_INPUT_MB": "20", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    *messages, more = done.stdout.splitlines()
    assert len(messages) == 3 and all(line.startswith("UnfitTopography") for line in messages), messages
    assert int(more) < 40_000  # kB


def test_what_is_left_in_a_campaign_dataset_until_it_is_used_is_bounded_as_well(tmp_path):
    with netCDF4.Dataset(tmp_path / "campaign.nc", "w") as file:
        study = file.createGroup("one")
        study.createDimension("run", HUGE)
        study.createDimension("step", HUGE)
        study.createVariable("status", "i4", ())[...] = 0
        study.createVariable("residual", "f8", ("run", "step"), chunksizes=(100, 100), compression="zlib")
    with pytest.raises(UnknownFile, match="needs about 320 GB of memory; expected at most 2 GB"):
        identify_file(tmp_path / "campaign.nc")


def write_external_storage(path, secret):
    with h5py.File(path, "w") as file:
        file.create_dataset("height", (16, 16), "f8", external=[(str(secret), 0, 2048)])


def write_external_link(path, secret):
    with h5py.File(secret, "w") as file:
        file["height"] = HEIGHTS
    with h5py.File(path, "w") as file:
        file["height"] = h5py.ExternalLink(str(secret), "/height")


def write_virtual(path, secret):
    with h5py.File(secret, "w") as file:
        file["height"] = np.ones((16, 16))
    layout = h5py.VirtualLayout((16, 16), "f8")
    layout[:] = h5py.VirtualSource(str(secret), "height", (16, 16))
    with h5py.File(path, "w") as file:
        file.create_virtual_dataset("height", layout)


def write_linked_after_a_block(path, secret):
    """Write a link behind a block of the user's own, which hides nothing."""
    with h5py.File(path, "w", userblock_size=4096) as file:
        file["height"] = h5py.ExternalLink(str(secret), "/height")


def write_deep(path, secret):
    with h5py.File(path, "w") as file:
        group = file
        for _ in range(2000):
            group = group.create_group("g")
        group["height"] = HEIGHTS


def circle(link):
    """Return a writer of a group with two names, some of which crash the netCDF library and the program."""

    def write(path, secret):
        with h5py.File(path, "w") as file:
            file["height"] = HEIGHTS
            link(file, file.create_group("group"))

    return write


ELSEWHERE = r"'height' (is a link to another file|has its data in another file)"
SECOND_NAME = "is a group with a second name; expected one name for each"
LINKED = {
    "external storage": (write_external_storage, ELSEWHERE),
    "external link": (write_external_link, ELSEWHERE),
    "virtual": (write_virtual, ELSEWHERE),
    "after a block": (write_linked_after_a_block, ELSEWHERE),
    "root by another name": (circle(lambda file, group: file.__setitem__("loop", file["/"])), SECOND_NAME),
    "link to the root": (circle(lambda file, group: file.__setitem__("loop", h5py.SoftLink("/"))), SECOND_NAME),
    "root in a group": (circle(lambda file, group: group.__setitem__("loop", file["/"])), SECOND_NAME),
    "link upwards": (circle(lambda file, group: group.__setitem__("loop", h5py.SoftLink("/group"))), SECOND_NAME),
    "two names": (circle(lambda file, group: file.__setitem__("other", group)), SECOND_NAME),
    "deep": (write_deep, "more than 100,000 names, or 50 nested groups; expected fewer"),
}


@pytest.mark.parametrize("name", ["scan.h5", "scan.nc", "scan.dat"])
@pytest.mark.parametrize("case", LINKED)
def test_links_to_other_files_and_in_circles_are_not_followed(case, name, tmp_path):
    (write, words), secret, path = LINKED[case], tmp_path / "secret", tmp_path / name
    secret.write_bytes(bytes(4096))
    write(path, secret)
    for read in (lambda: scan(path, **LINES), lambda: identify_file(path), lambda: read_height_map(path, 1.0)):
        with pytest.raises(ValueError, match=words):
            read()


def test_paths_that_are_no_files_are_not_opened(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe.npy")
    settings = {"format": "auto", "boundary": "free"}
    with socket.socket(socket.AF_UNIX) as own:
        monkeypatch.chdir(tmp_path)
        own.bind("socket.npy")
        for path, flaw in (
            (tmp_path / "pipe.npy", "is not a file"),
            (tmp_path / "socket.npy", "is not a file"),
            ("/dev/zero", "is not a file"),
            (tmp_path, "is a folder"),
            (tmp_path / "none.npy", "no such file"),
            ("a\0b", "no such file"),
            ("x" * 5000, "cannot be read"),
        ):
            with refused("path", f"{flaw}.*; expected a file of heights"):
                prepared_topography(path, settings)


@pytest.mark.parametrize("size", [2, 8, 128, 8192, 100_000])
def test_random_bytes_are_the_file_of_no_instrument(size, tmp_path):
    """In formats without a signature any bytes of the right number are heights."""
    (tmp_path / "scan.dat").write_bytes(np.random.default_rng(size).bytes(size))
    with pytest.raises(UnfitTopography, match="cannot be read as instrument"):
        scan(tmp_path / "scan.dat", **LINES)


def test_the_name_tells_where_the_content_cannot(tmp_path):
    heights = np.random.default_rng(1).integers(0, 1000, (64, 64)).astype(">i2")
    (tmp_path / "N47E007.hgt").write_bytes(heights.tobytes())
    assert scan(tmp_path / "N47E007.hgt", **LINES).format == "instrument (NASA SRTM)"


NAMES = ("scan.npy", "scan.txt", "scan.xyz", "scan.h5", "scan.nc", "old.nc")
INSTRUMENTS = ("frt-2.frt", "top-1.top", "x3p-2_part.x3p")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Sound files of all formats, by their names, and a folder for others."""
    folder = tmp_path_factory.mktemp("whole")
    np.save(folder / "scan.npy", HEIGHTS)
    np.savetxt(folder / "scan.txt", HEIGHTS)
    write_xyz(folder / "scan.xyz")
    with h5py.File(folder / "scan.h5", "w") as file:
        file.create_dataset("height", data=HEIGHTS, chunks=(5, 8), compression="gzip")
        file["height"].attrs["units"] = "nm"
    write_netcdf(folder / "scan.nc")
    write_netcdf(folder / "old.nc", kind="NETCDF3_CLASSIC")
    for name in INSTRUMENTS:
        shutil.copyfile(Path(__file__).parents[1] / "data/topographies" / name, folder / name)
    return folder, {each.name: each.read_bytes() for each in folder.iterdir()}


@given(name=st.sampled_from([*NAMES, *INSTRUMENTS]), data=st.data())
@pytest.mark.filterwarnings("ignore")
def test_damaged_and_changed_files_are_read_or_refused(whole, name, data):
    """Change, remove or insert bytes, mostly at the beginning, where headers are."""
    folder, contents = whole
    content = bytearray(contents[name])
    for _ in range(data.draw(st.integers(1, 4))):
        most = data.draw(st.sampled_from([64, 1024, len(content)]))
        at = data.draw(st.integers(0, max(min(most, len(content)) - 1, 0)))
        change = data.draw(st.sampled_from(["byte", "number", "gone", "more", "end"]))
        if change == "byte":
            content[at : at + 1] = bytes([data.draw(st.integers(0, 255))])
        elif change == "number":
            content[at : at + 4] = data.draw(
                st.sampled_from([b"\xff\xff\xff\x7f", bytes(4), b"\xff" * 4, b"nan ", b"1e99"])
            )
        elif change == "gone":
            del content[at : at + data.draw(st.integers(1, 100))]
        elif change == "more":
            content[at:at] = data.draw(st.binary(min_size=1, max_size=20))
        else:
            del content[at:]
    path = folder / f"changed_{name}"
    path.write_bytes(content)
    settings = preparation(missing="fill", detrend="tilt") | LINES
    try:
        surface = prepared_topography(path, settings).surface
    except UnfitTopography as error:
        assert re.search("expected|Remove", str(error))
    else:
        assert np.all(np.isfinite(surface.heights))
