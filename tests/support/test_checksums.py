"""Damaged results are found; touched and copied results count as whole."""

import hashlib
import json
import os
import pickle
import random
import shutil

import pytest

from icha.support.checksums import (
    LongText,
    begin,
    damaged,
    distrust,
    hash_parameters,
    is_whole,
    recorded_hash,
    set_aside,
    sha256_as_written,
    stale,
    with_sidecar,
    write_checksum,
)

PATH = "runs/load/seed1.nc"
CONTENT = random.Random(7).randbytes(5000)


@pytest.fixture
def results(tmp_path):
    """A campaign's folder with two results and their sidecars."""
    for path in (PATH, "checks.json"):
        file = tmp_path / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(CONTENT)
        write_checksum(tmp_path, path)
    return tmp_path


def flip(file, place, bit=0):
    content = bytearray(file.read_bytes())
    content[place] ^= 1 << bit
    file.write_bytes(content)


def keep_time(file, change):
    """Change a file as a failing disk does, without a change of its time."""
    status = file.stat()
    change(file)
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))


def test_a_checksum_is_the_sha256_and_size_of_its_file(results):
    written = json.loads((results / f"checksums/{PATH}.json").read_text())
    assert written["sha256"] == hashlib.sha256(CONTENT).hexdigest() and written["size"] == len(CONTENT)
    assert list(with_sidecar(results)) == ["checks.json", PATH]
    assert damaged(results) == damaged(results, thorough=True) == []


@pytest.mark.parametrize(("place", "bit"), [(0, 0), (2500, 7), (4999, 7)])
def test_one_flipped_bit_and_a_lost_end_are_found(results, place, bit):
    flip(results / PATH, place, bit)
    assert damaged(results) == [PATH]
    flip(results / PATH, place, bit)
    assert damaged(results) == []
    keep_time(results / PATH, lambda file: os.truncate(file, place))
    assert damaged(results) == [PATH]


def test_what_the_disk_has_spoilt_is_found_where_everything_is_hashed(results):
    keep_time(results / PATH, lambda file: flip(file, 100))
    assert is_whole(results, PATH) and not is_whole(results, PATH, thorough=True)
    assert damaged(results) == []
    # After `distrust`, later checks find the damage as well.
    distrust(results, PATH)
    assert damaged(results) == [PATH]


def test_files_that_were_touched_or_copied_are_whole_and_hashed_but_once(results, tmp_path_factory):
    elsewhere = shutil.copytree(results, tmp_path_factory.mktemp("copy") / "results", copy_function=shutil.copyfile)
    assert damaged(elsewhere) == []
    # Their sidecars have the new time, so a change of the content without a change of the time is not detected.
    keep_time(elsewhere / PATH, lambda file: flip(file, 3))
    assert is_whole(elsewhere, PATH)


def test_a_damaged_file_is_set_aside_and_nothing_is_lost(results):
    for number, name in enumerate(("seed1.nc.damaged", "seed1.nc.damaged2", "seed1.nc.damaged3")):
        (results / PATH).write_bytes(CONTENT + bytes([number]))
        write_checksum(results, PATH)
        flip(results / PATH, 0)
        wrong = (results / PATH).read_bytes()
        assert set_aside(results, PATH) == (results / PATH).with_name(name)
        assert (results / PATH).with_name(name).read_bytes() == wrong
        assert not (results / PATH).exists()
        assert damaged(results) == []


def test_results_without_sidecar_and_sidecars_without_result_are_no_damage(results):
    (results / "checks.json").unlink()
    (results / "verdict.txt").write_text("all well\n")
    assert is_whole(results, "verdict.txt", thorough=True) and is_whole(results, "checks.json", thorough=True)
    assert damaged(results, thorough=True) == []


def test_a_result_that_was_not_finished_is_neither_damaged_nor_forgotten(results):
    begin(results, PATH)
    (results / PATH).write_bytes(b"another one")  # and the job was killed before it wrote the checksum
    assert damaged(results, thorough=True) == []
    (results / PATH).write_bytes(CONTENT)
    write_checksum(results, PATH)
    flip(results / PATH, 0)
    assert damaged(results) == [PATH]


@pytest.mark.parametrize("content", [b"", b'{"sha256": "', b"[1]", b'{"sha256": "a"}', b"\xff\xfe", b"null"])
def test_a_sidecar_that_cannot_be_read_vouches_for_nothing(results, content):
    (results / f"checksums/{PATH}.json").write_bytes(content)
    assert damaged(results) == [PATH]
    set_aside(results, PATH)
    assert damaged(results) == []


def test_a_folder_is_one_result(results):
    folder = results / "publish/tiny-1.0"
    (folder / "data").mkdir(parents=True)
    (folder / "data/a.nc").write_bytes(CONTENT)
    (folder / "README.md").write_text("What this is.\n")
    write_checksum(results, "publish/tiny-1.0")
    (folder / ".snakemake_timestamp").touch()
    assert damaged(results, thorough=True) == []
    (folder / "data/b.nc").write_bytes(b"")
    assert damaged(results) == ["publish/tiny-1.0"]
    (folder / "data/b.nc").unlink()
    assert damaged(results) == []
    flip(folder / "data/a.nc", 4000)
    assert damaged(results) == ["publish/tiny-1.0"]
    assert set_aside(results, "publish/tiny-1.0").name == "tiny-1.0.damaged"
    assert not folder.exists()


def test_results_that_are_not_of_what_is_asked_for_or_of_what_is_there_are_stale(results):
    asked = {path: hash_parameters([repr({"modulus": 25e6}), repr(path)]) for path in (PATH, "checks.json")}

    def found(now=asked.get):
        return dict(stale(results, asked, now))

    assert set(found()) == {PATH, "checks.json"}  # their sidecars do not contain the settings
    write_checksum(results, PATH, asked=asked[PATH])
    inputs = {PATH: sha256_as_written(results, PATH)}
    write_checksum(results, "checks.json", asked=asked["checks.json"], inputs=inputs)
    assert found() == found(None) == {} and recorded_hash(results, PATH) == asked[PATH]
    assert "other settings" in found(lambda path: hash_parameters(["30e6"]) if path == PATH else asked[path])[PATH]
    # Another run with the same settings replaces the run: the result made from the former run is stale.
    (results / PATH).write_bytes(CONTENT[::-1])
    write_checksum(results, PATH, asked=asked[PATH])
    assert damaged(results) == [] and found() == {"checks.json": f"it was made from another version of {PATH}"}
    # A result that was begun is stale; a missing one is not.
    begin(results, PATH)
    assert PATH in found()
    (results / PATH).unlink()
    assert set(found()) == {"checks.json"}


def test_what_was_made_from_a_file_that_no_job_wrote_is_stale_once_that_is_another(results):
    table = results / "inputs/measurements/lab/points.csv"
    table.parent.mkdir(parents=True)
    table.write_text("p,a\n")
    path = str(table.relative_to(results))
    write_checksum(results, PATH, asked="a", inputs={path: sha256_as_written(results, path)})
    assert dict(stale(results, [PATH])) == {}
    table.write_text("p,b\n")
    assert dict(stale(results, [PATH])) == {PATH: f"it was made from another version of {path}"}
    table.unlink()
    assert set(dict(stale(results, [PATH]))) == {PATH}


def test_sidecars_of_results_that_are_read_only_need_not_be_written(results, monkeypatch):
    os.utime(results / PATH, (1, 1))

    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("os.replace", refuse)
    assert is_whole(results, PATH)
    flip(results / PATH, 0)
    assert not is_whole(results, PATH)


def test_a_long_text_shows_its_checksum_also_in_another_process():
    text = LongText("title: A\n" * 1000)
    again = pickle.loads(pickle.dumps(text))
    assert again == "title: A\n" * 1000 and repr(again) == repr(text)
    assert repr(text) == f"sha256:{hashlib.sha256(text.encode()).hexdigest()}" and repr(LongText("b")) != repr(text)
