"""Deposits from unknown makers: problems are found, no other file is read or written, and limits hold."""

import os
import random
import stat
import zipfile

import pytest
from outside_validators import problems_with
from typer.testing import CliRunner

from icha.cli import app
from icha.deposit import verify
from icha.deposit.verify import DamagedDeposit, files_of, read_text, whole_deposit
from icha.support.formatting import printable

FILES = {"README.md": "# Tiny\n", "runs/load/soft.nc": bytes(range(256)) * 20, "inputs/Höhen (2).txt": "1 2\n"}


@pytest.fixture
def folder(pack):
    return pack(FILES)


def zipped(tmp_path, **names):
    """A zip with entries of these names and modes beside a list of checksums."""
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("tiny/SHA256SUMS", "")
        for name, mode in names.items():
            entry = zipfile.ZipInfo("placeholder")
            entry.filename = name  # ZipInfo corrects some of them
            entry.create_system, entry.external_attr = 3, mode << 16
            archive.writestr(entry, b"/etc/passwd")
    return path


@pytest.mark.parametrize("ending", ["", ".zip"])
def test_a_whole_deposit_is_whole(ending, folder):
    path = folder.with_name(folder.name + ending)
    assert problems_with(path) == []
    with whole_deposit(path) as found:
        assert files_of(found) == sorted([*FILES, "SHA256SUMS"])
    assert found == path or not found.exists()
    done = CliRunner().invoke(app, ["verify", str(path)])
    assert done.exit_code == 0 and "intact: 4 files" in done.output
    assert CliRunner().invoke(app, ["verify", f"{path}.none"]).exit_code == 2


@pytest.mark.parametrize(
    ("spoil", "problems"),
    [
        (lambda f: (f / "README.md").write_text("# tiny\n"), {"README.md": "was changed"}),
        (lambda f: (f / "README.md").unlink(), {"README.md": "is missing"}),
        (lambda f: (f / "README.md").rename(f / "readme.md"), {"README.md": "is missing", "readme.md": "was added"}),
        (lambda f: (f / "link").symlink_to("/etc"), {"link": "is a link"}),
        (lambda f: os.mkfifo(f / "pipe"), {"pipe": "is a link, a device"}),
        (lambda f: (f / "a\\b").touch(), {"a\\b": "has a backslash"}),
        (lambda f: (f / "b\ntiny: whole: 9 files").touch(), {"b\\ntiny: whole": "invisible"}),
        (lambda f: (f / "exe\u202etxt.nc").touch(), {"exe\\u202etxt.nc": "invisible"}),
        (lambda f: (f / "SHA256SUMS").unlink(), {"SHA256SUMS": "is missing"}),
    ],
)
def test_every_change_of_a_folder_is_found(spoil, problems, folder):
    spoil(folder)
    found = problems_with(folder)
    assert len(found) == len(problems) and all(printable(each) == each for each in found), found
    for line, (name, problem) in zip(sorted(found), sorted(problems.items()), strict=True):
        assert line.startswith(name) and problem in line
    assert CliRunner().invoke(app, ["verify", str(folder)]).exit_code == 1


@pytest.mark.parametrize("line", ["no checksum", "0" * 64 + "  ../outside", "0" * 64 + "  /dev/zero", "twice"])
def test_lists_name_files_of_the_deposit_once(line, folder):
    sums = folder / "SHA256SUMS"
    sums.write_text(sums.read_text() + (sums.read_text().splitlines()[0] if line == "twice" else line) + "\n")
    (problem,) = problems_with(folder)
    assert "line 4" in problem


def test_a_spoilt_zip_is_found_or_has_the_same_files(folder, tmp_path):
    content = folder.with_name("tiny.zip").read_bytes()
    chance, spoilt, found = random.Random(1), tmp_path / "spoilt.zip", 0
    listed_from = content.index(b"PK\x01\x02")
    for trial in range(120):
        # Half of them in the list of contents, where there is little else than names and sizes.
        changed = bytearray(content)
        changed[chance.randrange(listed_from if trial % 2 else 0, len(content))] ^= 1 << chance.randrange(8)
        spoilt.write_bytes(changed)
        try:
            with whole_deposit(spoilt) as other:
                assert {name: (other / name).read_bytes() for name in files_of(other)} == {
                    name: (folder / name).read_bytes() for name in files_of(folder)
                }
        except (DamagedDeposit, OSError):
            found += 1
    assert found > 60
    for _ in range(20):
        spoilt.write_bytes(content[: chance.randrange(len(content))])
        assert problems_with(spoilt)


@pytest.mark.parametrize(
    "name",
    ["../x", "../../x", "tiny/../../x", "/etc/x", "C:/x", "tiny/a\\b", "tiny/a\x1b[2J", "other/x", "x"],
)
def test_names_in_a_zip_lead_nowhere_else(name, tmp_path, monkeypatch):
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    path = zipped(tmp_path, **{name: stat.S_IFREG | 0o644})
    found = problems_with(path)
    assert found and all(printable(each) == each for each in found)
    assert sorted(each.name for each in tmp_path.rglob("*")) == ["a.zip", "temporary"]


def test_links_in_a_zip_become_files(tmp_path):
    (problem,) = problems_with(zipped(tmp_path, **{"tiny/link": stat.S_IFLNK | 0o777}))
    assert problem.startswith("link: was added")


def test_what_unpacks_to_far_more_is_not_unpacked(pack, monkeypatch):
    folder = pack({"zeros": bytes(10_000_000)})
    monkeypatch.setattr(verify, "ALLOWANCE", 1000)
    (problem,) = problems_with(folder.with_name("tiny.zip"))
    assert "to 10 MB; expected at most 50 times its size" in problem
    assert problems_with(folder) == []
    # Nor is a large text read as a whole.
    monkeypatch.setattr(verify, "LARGEST_TEXT", 3)
    with pytest.raises(ValueError, match="expected at most 3 B"):
        read_text(folder, "zeros")
