"""The list of checksums of a folder of results shows damaged files; a long parameter is shown by its checksum."""

import pickle
import random
import subprocess
import sys

import pytest

from icha.support.checksums import CHECKSUMS, LongList, changed_files, refuse_changed, sha256_of, write_checksums

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


def test_a_long_list_shows_its_checksum_also_in_another_process():
    values = LongList(["a text", {"number": 1}])
    assert pickle.loads(pickle.dumps(values)) == values == ["a text", {"number": 1}]
    code = "from icha.support.checksums import LongList; print(repr(LongList(['a text', {'number': 1}])))"
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
    assert repr(values) == other and other.startswith("sha256:")
    assert repr(LongList(["a text", {"number": 2}])) != other
