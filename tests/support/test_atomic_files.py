"""A file is complete on the disk or does not exist; checksums show damaged files."""

import os
import random
import subprocess
import sys
from pathlib import Path

import pytest

from icha.support.atomic_files import is_left_over, probe_folder, whole_file
from icha.support.checksums import CHECKSUMS, changed_files, refuse_changed, sha256_of, write_checksums


def test_files_of_a_killed_program_are_recognised_by_their_names(tmp_path, monkeypatch):
    with pytest.raises(KeyboardInterrupt), monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", lambda *_, **__: None)  # a killed program removes nothing
        assert probe_folder(tmp_path) is None
        with whole_file(tmp_path / "a.txt") as temporary:
            temporary.write_text("half")
            raise KeyboardInterrupt
    left = [file.name for file in tmp_path.iterdir()]
    assert len(left) == 2 and all(map(is_left_over, left))
    assert not is_left_over("a.txt") and not is_left_over(".snakemake_timestamp")


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")
def test_content_and_name_of_a_file_reach_the_disk_in_this_order(tmp_path, monkeypatch):
    done = []
    sync, replace = os.fsync, os.replace

    def synchronise(file):
        path = Path(os.readlink(f"/proc/self/fd/{file}"))
        done.append("folder" if path.is_dir() else "content")
        sync(file)

    monkeypatch.setattr(os, "fsync", synchronise)
    monkeypatch.setattr(os, "replace", lambda old, new: done.append("name") or replace(old, new))
    with whole_file(tmp_path / "a.nc") as temporary:
        temporary.write_text("a result")
    assert done == ["content", "name", "folder"]


CONTENT = random.Random(7).randbytes(5000)


@pytest.fixture
def results(tmp_path):
    """A campaign's folder with two results and their checksums."""
    files = [tmp_path / name for name in ("runs/load/é seed1.nc", "checks.json")]
    for file in files:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(CONTENT)
    write_checksums(tmp_path, map(str, files), tmp_path / CHECKSUMS)
    return tmp_path


@pytest.mark.parametrize(("place", "bit"), [(0, 0), (2500, 3), (4999, 7)])
def test_a_flipped_bit_and_a_missing_file_are_found(place, bit, results):
    assert changed_files(results) == []
    subprocess.run(["sha256sum", "--quiet", "--check", "--strict", CHECKSUMS], cwd=results, check=True)
    content = bytearray(CONTENT)
    content[place] ^= 1 << bit
    (results / "runs/load/é seed1.nc").write_bytes(content)
    assert changed_files(results) == ["runs/load/é seed1.nc"]
    (results / "checks.json").unlink()
    assert changed_files(results) == ["checks.json", "runs/load/é seed1.nc"]


def test_a_changed_file_is_refused_by_its_name(results):
    file = results / "checks.json"
    before = sha256_of(file)
    refuse_changed(file, before)
    file.write_bytes(b"other")
    with pytest.raises(ValueError, match=r"^scan\.csv has changed since the campaign started; repeat the command$"):
        refuse_changed(file, before, "scan.csv")
