"""A campaign that is killed, damaged, called twice, and run in odd places: validation/faults.py in short."""

import os
import random
import shutil
import subprocess
import sys
import time

import pytest
from conftest import REPOSITORY, copy_project

from icha.support.atomic_files import whole_file
from icha.support.checksums import damaged, with_sidecar, write_checksum
from validation import faults

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
AS_ROOT = pytest.mark.skipif(
    os.getuid() != 0 or not shutil.which("mkfs.ext4"), reason="only root may mount, and ext4 must be there"
)
# For what the reference has 25 MPa.
OTHER = "materials={bare: {contact_modulus: 20 MPa}, soft: {contact_modulus: 20 MPa}}"


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    scratch = tmp_path_factory.mktemp("faults")
    project = copy_project(REPOSITORY, scratch / "project")
    return faults.Reference(project, scratch, targets=("runs", "references"))


@pytest.mark.slow
def test_killed_calls_leave_nothing_behind_and_the_next_goes_on(reference):
    place, chance = reference.empty(), random.Random(1)
    for victim in (faults.VICTIMS[1], faults.VICTIMS[0]):
        assert not faults.kill(place, reference, victim, 0.5 * reference.seconds, chance)
    before = place.times()
    assert reference.goes_on(place) == []
    assert faults.computed_again(before, place) == []


@pytest.mark.slow
def test_flipped_bits_are_found_by_the_one_of_two_calls_that_may_run(reference):
    place = reference.copy()
    spoilt = {}
    for kind, where in {"surface": "middle", "run": "start", "boundary elements": "end"}.items():
        file = place.results / faults.KINDS[kind]
        faults.flip(file, where)
        spoilt[file.with_name(f"{file.name}.damaged")] = file.read_bytes()
    assert len(reference.half_written(place)) == len(spoilt)
    ends = [place.end(call) for call in [place.start(), place.start()]]
    assert sorted(bool(status) for status, _ in ends) == [False, True], ends
    refusal = next(said for status, said in ends if status)
    assert "is running this campaign in this directory" in refusal and "Traceback" not in refusal
    assert reference.unequal(place) == []
    assert {file: file.read_bytes() for file in spoilt} == spoilt


@pytest.mark.slow
@pytest.mark.parametrize("way", faults.WAYS)
def test_folders_may_have_any_name_but_for_a_backslash_and_hold_any_file(reference, way):
    place = reference.empty(reference.scratch / f"both' of \"them & ($HOME*; {way}")
    for name in ("icha", "json", "numpy", "socket", "snakemake"):
        (place.folder / f"{name}.py").write_text("raise SystemExit('imported from the working folder')\n")
    # Its path is too long for a socket.
    temporary = reference.scratch / ("temporary" * 12)
    temporary.mkdir(exist_ok=True)
    assert place.run(way, TMPDIR=str(temporary))[0] == 0
    assert reference.unequal(place) == []
    refused = reference.empty(reference.scratch / f"back\\slash{way}")
    status, said = refused.run(way)
    assert status and "has a backslash" in said and "Traceback" not in said
    assert not list(refused.results.rglob("*.nc"))


@pytest.mark.slow
def test_an_orphan_leaves_nothing_of_its_own_settings(reference):
    place = reference.empty()
    process = place.start("snakemake", "--config", OTHER)
    time.sleep(0.4 * reference.seconds)
    faults.kill_process(process.pid)
    assert reference.goes_on(place) == []
    place.end(process)
    assert [*place.left_behind(), *reference.unequal(place)] == []


@pytest.mark.slow
@AS_ROOT
def test_a_full_disk_is_told_and_leaves_nothing_half_written(reference):
    trial = faults.full_disks(reference, reference.empty(), 2, random.Random(1))
    assert trial.violations == [] and trial.ended == faults.REFUSED


@AS_ROOT
def test_what_is_complete_is_still_there_after_a_power_cut(tmp_path):
    contents = {f"runs/{number}.nc": random.Random(number).randbytes(100_000) for number in range(5)}
    disk = tmp_path / "disk"
    try:
        with faults.power(disk, tmp_path / "image") as (cut, mount):
            for path, content in contents.items():
                with whole_file(disk / path) as temporary:
                    temporary.write_bytes(content)
                write_checksum(disk, path, asked="a")
            # As programs write files as a rule: its name is there before its content.
            (disk / "runs/.other").write_bytes(contents["runs/0.nc"])
            os.replace(disk / "runs/.other", disk / "runs/other")
            cut()
            faults.unmount(disk)
            mount()
            assert {path: (disk / path).read_bytes() for path in contents} == contents
            assert damaged(disk, thorough=True) == []
            assert all((disk / path).exists() for path in with_sidecar(disk))
            other = disk / "runs/other"
            assert not other.exists() or other.read_bytes() == b""
    except subprocess.CalledProcessError as error:
        pytest.skip(f"no disk can be mounted: {error}")
