"""The validators of other projects find problems in the files of a deposit."""

import re
import socket

import h5py
import netCDF4
import pytest
from outside_validators import sealed, validated

pytestmark = pytest.mark.slow

NAMES = ("compliance-checker",)


def deposit(folder, unit="Pa", where="study"):
    """A netCDF file with a variable in a group, whose axis is in the group above; and its checksum."""
    folder.mkdir()
    (folder / "ro-crate-metadata.json").write_text("{}")  # which every deposit has
    with netCDF4.Dataset(folder / "data.nc", "w") as data:
        data.setncatts({"Conventions": "CF-1.11", "title": "Loads", "history": "made up"})
        data.createDimension("step", 3)
        step = data.createVariable("step", "i4", ("step",))
        step.setncatts({"long_name": "step", "units": "1"})
        step[:] = range(3)
        load = data.createGroup("study").createVariable("load", "f8", ("step",))
        load.setncatts({"long_name": "load", "units": unit, "coordinates": where})
        load[:] = [1.0, 2.0, 3.0]
        data["study"].createVariable("study", "f8", ()).setncatts({"long_name": "number of the study", "units": "1"})
    return sealed(folder)


def failed(done):
    return re.findall(r"^([\w-]+): failed", done.stdout, re.MULTILINE)


def test_files_ask_for_nothing_beyond_themselves(tmp_path, monkeypatch):
    """No network, whatever an attribute names, and no data in other files."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "kept"))
    folder = deposit(tmp_path / "mine")
    with netCDF4.Dataset(folder / "data.nc", "a") as data:
        data.standard_name_vocabulary = "CF Standard Name Table v50"
    with socket.create_server(("127.0.0.1", 0)) as server:
        monkeypatch.setenv("HTTPS_PROXY", f"http://127.0.0.1:{server.getsockname()[1]}")
        server.settimeout(0)
        done = validated(sealed(folder), *NAMES)
        with pytest.raises(BlockingIOError):  # nobody has come
            server.accept()
    assert done.returncode == 0, done.stdout + done.stderr
    with h5py.File(folder / "data.nc", "a") as file:
        file["elsewhere"] = h5py.ExternalLink(str(tmp_path / "other.nc"), "/step")
    done = validated(sealed(folder), *NAMES)
    assert done.returncode == 1 and "data.nc: 'elsewhere' is a link to another file" in done.stderr
    assert "passed" not in done.stdout


def test_a_unit_that_is_none_is_seen(tmp_path):
    done = validated(deposit(tmp_path / "mine", unit="pascalish"), *NAMES)
    assert done.returncode == 1
    assert failed(done) == ["compliance-checker"] and "data.nc/study" in done.stdout, done.stdout
