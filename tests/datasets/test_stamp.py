"""A file is valid if its stamp states the expected settings and program."""

import pytest
import small_campaign as small

from icha.datasets.files import read_run, write_dataset
from icha.datasets.stamp import (
    DAMAGED,
    OTHER_LICENCE,
    OTHER_PROGRAM,
    OTHER_SETTINGS,
    outdated,
    read_stamp,
    refuse_outdated,
    state_licence,
)

STAMP = {"id": "c/runs/é", "license": "CC0-1.0", "config_sha256": "a" * 64, "program_sha256": "b" * 64}


@pytest.fixture
def file(tmp_path):
    (_, run), *_ = small.runs()
    write_dataset(run.assign_attrs(STAMP), tmp_path / "run.nc")
    return str(tmp_path / "run.nc")


def cut_off(file):
    with open(file, "r+b") as content:
        content.truncate(3000)


def replace_by_text(file):
    with open(file, "w") as content:
        content.write("not a netCDF file")


@pytest.mark.parametrize(
    ("expected", "damage", "reason"),
    [
        ({}, None, None),
        ({"config_sha256": "0" * 64}, None, OTHER_SETTINGS),
        ({"config_sha256": "0" * 64, "program_sha256": "0" * 64}, None, OTHER_SETTINGS),
        ({"id": "other/runs/e"}, None, OTHER_SETTINGS),
        ({"license": "CC-BY-4.0"}, None, OTHER_LICENCE),
        ({"license": "CC-BY-4.0", "program_sha256": "0" * 64}, None, OTHER_SETTINGS),
        ({"program_sha256": "0" * 64}, None, OTHER_PROGRAM),
        ({}, cut_off, DAMAGED),
        ({}, replace_by_text, DAMAGED),
    ],
)
def test_a_file_with_another_stamp_is_outdated(file, expected, damage, reason):
    if damage:
        damage(file)
    stamps = {file: STAMP | expected, f"{file}.missing": STAMP}
    assert list(outdated(stamps)) == ([(file, reason)] if reason else [])
    if reason:
        with pytest.raises(ValueError, match=f"run.nc: {reason}"):
            refuse_outdated(stamps)
    else:
        refuse_outdated(stamps)


def test_a_file_without_stamp_is_outdated(tmp_path):
    (_, run), *_ = small.runs()
    write_dataset(run, tmp_path / "run.nc")
    assert not any(read_stamp(tmp_path / "run.nc").values())
    assert dict(outdated({str(tmp_path / "run.nc"): STAMP})) == {str(tmp_path / "run.nc"): OTHER_SETTINGS}


def test_a_file_states_another_licence_with_the_same_values(file):
    before = read_run(file).load()
    state_licence(file, "CC-BY-4.0")
    refuse_outdated({file: STAMP | {"license": "CC-BY-4.0"}})
    after = read_run(file).load()
    assert after.attrs == before.attrs | {"license": "CC-BY-4.0"} and after.equals(before)


def test_a_missing_file_has_no_stamp(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_stamp(tmp_path / "none.nc")
