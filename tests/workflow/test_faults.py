"""A campaign that is killed, damaged and called twice: benchmarks/faults in short."""

import json
import os
import random
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import REPOSITORY, copy_project

from icha.support.atomic_files import whole_file
from icha.support.checksums import damaged, with_sidecar, write_checksum

sys.path.append(str(REPOSITORY))
from benchmarks.faults import damages, kills, odd_places, other_settings, power_cuts
from benchmarks.faults.page import page
from benchmarks.faults.places import WAYS, Reference

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    scratch = tmp_path_factory.mktemp("faults")
    project = copy_project(REPOSITORY, scratch / "project")
    return Reference(project, scratch, targets=("runs", "references"))


@pytest.mark.slow
def test_killed_calls_leave_nothing_behind_and_the_next_goes_on(reference):
    place, chance = reference.empty(), random.Random(1)
    for victim, moment in ((kills.VICTIMS[1], 0.5), (kills.VICTIMS[0], 0.5)):
        assert not kills.kill(place, reference, victim, moment * reference.seconds, chance)
    before = place.times()
    assert reference.goes_on(place) == []
    assert kills.computed_again(before, place) == []


@pytest.mark.slow
def test_flipped_bits_are_found_by_the_one_of_two_calls_that_may_run(reference):
    place = reference.copy()
    kinds = {"surface": "middle", "run": "start", "boundary elements": "end"}
    spoilt = {}
    for kind, where in kinds.items():
        file = place.folder / damages.KINDS[kind]
        damages.flip(file, where)
        spoilt[file.with_name(f"{file.name}.damaged")] = file.read_bytes()
    assert len(reference.half_written(place)) == len(kinds)
    calls = [place.start(), place.start()]
    ends = [place.end(call) for call in calls]
    assert sorted(bool(status) for status, _ in ends) == [False, True], ends
    refusal = next(said for status, said in ends if status)
    assert "is running this campaign in this directory" in refusal and "Traceback" not in refusal
    assert reference.unequal(place) == []
    assert {file: file.read_bytes() for file in spoilt} == spoilt


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_folders_may_have_any_name_but_for_a_backslash_and_hold_any_file(reference, way):
    odd = odd_places.odd_name(reference, "both' of \"them & ($HOME*;", way)
    modules = odd_places.odd_modules(reference, way)
    long = odd_places.long_temporary(reference, way)
    refused = odd_places.backslash(reference, way)
    assert [trial.violations for trial in (odd, modules, long, refused)] == [(), (), (), ()]


@pytest.mark.slow
def test_an_orphan_leaves_nothing_of_its_own_settings(reference):
    assert other_settings.orphan(reference, 0.4 * reference.seconds).violations == ()


@pytest.mark.skipif(
    os.getuid() != 0 or not shutil.which("mkfs.ext4"), reason="only root may mount, and ext4 must be there"
)
def test_what_is_complete_is_still_there_after_a_power_cut(tmp_path):
    contents = {f"runs/{number}.nc": random.Random(number).randbytes(100_000) for number in range(5)}
    disk = tmp_path / "disk"
    try:
        with power_cuts.power(disk, tmp_path / "image") as (cut, mount):
            for path, content in contents.items():
                with whole_file(disk / path) as temporary:
                    temporary.write_bytes(content)
                write_checksum(disk, path, asked="a")
            # As programs write files as a rule: its name is there before its content.
            (disk / "runs/.other").write_bytes(contents["runs/0.nc"])
            os.replace(disk / "runs/.other", disk / "runs/other")
            cut()
            power_cuts.unmount(disk)
            mount()
            assert {path: (disk / path).read_bytes() for path in contents} == contents
            assert damaged(disk, thorough=True) == []
            assert all((disk / path).exists() for path in with_sidecar(disk))
            other = disk / "runs/other"
            assert not other.exists() or other.read_bytes() == b""
    except subprocess.CalledProcessError as error:
        pytest.skip(f"no disk can be mounted: {error}")


def test_the_page_is_that_of_the_counts():
    kept = json.loads((REPOSITORY / "benchmarks/results/faults.json").read_text(encoding="utf-8"))
    assert page(kept) == Path(REPOSITORY, "docs/faults.md").read_text(encoding="utf-8")
    assert not [row for row in kept["rows"] if row["violations"]]
