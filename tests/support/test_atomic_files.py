"""A file is complete on the disk or does not exist."""

import os
import sys
from pathlib import Path

import pytest

from icha.support.atomic_files import is_left_over, probe_folder, whole_file


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
