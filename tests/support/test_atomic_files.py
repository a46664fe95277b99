"""Temporary files of killed programs are recognised by their names; an owner writes from any folder."""

from pathlib import Path

import pytest

from icha.support.atomic_files import is_left_over, probe_folder, take_over, whole_file


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


def test_an_owner_writes_other_files_from_wherever_it_is(tmp_path, monkeypatch):
    """The program may end in another folder than that of the campaign."""
    monkeypatch.setenv("ICHA_OWNER", "")
    monkeypatch.chdir(tmp_path)
    take_over(".snakemake/tiny.owner")
    monkeypatch.chdir("/")
    with whole_file(tmp_path / "kept.json") as temporary:
        temporary.write_text("{}")
    assert (tmp_path / "kept.json").read_text() == "{}"
