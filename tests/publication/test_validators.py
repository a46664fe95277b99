"""The validators of others see what is wrong with a deposit's files; those that cannot fail would say nothing."""

import re
import subprocess
import zipfile

import netCDF4
import pytest
from outside_validators import validated

pytestmark = pytest.mark.slow

NAMES = ("sha256sum", "compliance-checker", "cf-units")


def deposit(folder, unit="Pa", where="study"):
    """A netCDF file with a variable in a group, whose axis is in the group above; and its checksum."""
    folder.mkdir()
    (folder / "ro-crate-metadata.json").write_text("{}")  # by which a deposit is known
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
    sums = subprocess.run(["sha256sum", "data.nc"], cwd=folder, capture_output=True, check=True).stdout
    (folder / "SHA256SUMS").write_bytes(sums)
    return folder


def failed(done):
    return re.findall(r"^([\w-]+): failed", done.stdout, re.MULTILINE)


@pytest.mark.parametrize("kind", ["folder", "zip"])
def test_a_good_file_passes_in_a_folder_and_in_an_archive(kind, tmp_path):
    folder = deposit(tmp_path / "mine-1.0")
    if kind == "zip":
        with zipfile.ZipFile(tmp_path / "mine-1.0.zip", "w") as archive:
            for file in folder.iterdir():
                archive.write(file, f"mine-1.0/{file.name}")
        folder = tmp_path / "mine-1.0.zip"
    done = validated(folder, *NAMES)
    assert done.returncode == 0, done.stdout + done.stderr
    assert not failed(done)
    assert re.search(r"compliance-checker: passed; (\d+) of \1 points, 2 groups of 1 files", done.stdout), done.stdout


def test_a_unit_that_is_none_and_a_file_that_was_changed_are_seen(tmp_path):
    folder = deposit(tmp_path / "mine", unit="pascalish")
    (folder / "SHA256SUMS").write_text(f"{'0' * 64}  data.nc\n")
    done = validated(folder, *NAMES)
    assert done.returncode == 1
    assert failed(done) == list(NAMES), done.stdout
    assert "data.nc:/study/load" in done.stdout


def test_what_is_no_deposit_is_refused(tmp_path):
    done = validated(tmp_path)
    assert done.returncode == 1 and "is no deposit" in done.stderr
    (tmp_path / "ro-crate-metadata.json").write_text("{}")
    done = validated(tmp_path, "cffconvert", "sha256sum")
    assert done.returncode == 1 and "CITATION.cff is missing" in done.stdout
