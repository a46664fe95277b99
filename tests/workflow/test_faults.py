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
def test_killed_calls_leave_no_process_and_the_next_call_resumes(reference):
    place, chance = reference.empty(), random.Random(1)
    for victim in (faults.VICTIMS[1], faults.VICTIMS[0]):
        assert not faults.kill(place, reference, victim, 0.5 * reference.seconds, chance)
    before = place.times()
    assert reference.resume(place) == []
    assert faults.recomputed(before, place) == []


@pytest.mark.slow
def test_flipped_bits_are_found_by_the_one_of_two_calls_that_may_run(reference):
    place = reference.copy()
    spoilt = {}
    for kind, where in {"surface": "middle", "run": "start", "boundary elements": "end"}.items():
        file = place.results / faults.KINDS[kind]
        faults.flip(file, where)
        spoilt[file.with_name(f"{file.name}.damaged")] = file.read_bytes()
    assert len(reference.foreign_results(place)) == len(spoilt)
    ends = [place.end(call) for call in [place.start(), place.start()]]
    assert sorted(bool(status) for status, _ in ends) == [False, True], ends
    refusal = next(output for status, output in ends if status)
    assert "is running this campaign in this directory" in refusal and "Traceback" not in refusal
    assert reference.differences(place) == []
    assert {file: file.read_bytes() for file in spoilt} == spoilt


@pytest.mark.slow
@pytest.mark.parametrize("call", faults.CALLS)
def test_folders_may_have_any_name_but_for_a_backslash_and_hold_any_file(reference, call):
    place = reference.empty(reference.scratch / f"both' of \"them & ($HOME*; {call}")
    for name in ("icha", "json", "numpy", "socket", "snakemake"):
        (place.folder / f"{name}.py").write_text("raise SystemExit('imported from the working folder')\n")
    # Its path is too long for a socket.
    temporary = reference.scratch / ("temporary" * 12)
    temporary.mkdir(exist_ok=True)
    assert place.run(call, TMPDIR=str(temporary))[0] == 0
    assert reference.differences(place) == []
    refused = reference.empty(reference.scratch / f"back\\slash{call}")
    status, output = refused.run(call)
    assert status and "has a backslash" in output and "Traceback" not in output
    assert not list(refused.results.rglob("*.nc"))


@pytest.mark.slow
def test_orphan_leaves_no_result_of_its_settings(reference):
    place = reference.empty()
    process = place.start("snakemake", "--config", OTHER)
    time.sleep(0.4 * reference.seconds)
    faults.kill_process(process.pid)
    assert reference.resume(place) == []
    place.end(process)
    assert [*place.end_remaining(), *reference.differences(place)] == []


@pytest.mark.slow
@AS_ROOT
def test_full_disk_ends_with_a_message_and_leaves_no_incomplete_result(reference):
    trial = faults.disturb_by_full_disk(reference, reference.empty(), 2, random.Random(1))
    assert trial.violations == [] and trial.outcome == faults.REFUSED


@AS_ROOT
def test_complete_files_survive_a_power_cut(tmp_path):
    contents = {f"runs/{number}.nc": random.Random(number).randbytes(100_000) for number in range(5)}
    disk = tmp_path / "disk"
    try:
        with faults.disk_with_power(disk, tmp_path / "image") as (cut, mount):
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
