"""Short versions of the trials of validation/faults.py: kills, damage, two calls at once, unusual folders."""

import os
import random
import shutil
import sys
import time

import pytest
from conftest import REPOSITORY, copy_project

from validation import faults

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")]
# The modulus of the reference is 25 MPa.
OTHER = "materials={bare: {contact_modulus: 20 MPa}, soft: {contact_modulus: 20 MPa}}"


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    scratch = tmp_path_factory.mktemp("faults")
    project = copy_project(REPOSITORY, scratch / "project")
    return faults.Reference(project, scratch, targets=("runs", "references"))


def test_killed_calls_leave_no_process_and_the_next_call_resumes(reference):
    place, chance = reference.empty(), random.Random(1)
    for victim in (faults.VICTIMS[1], faults.VICTIMS[0]):
        assert not faults.kill(place, reference, victim, 0.5 * reference.seconds, chance)
    before = place.times()
    assert reference.resume(place) == []
    assert faults.recomputed(before, place) == []


def test_one_of_two_calls_runs_and_finds_flipped_bits(reference):
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


@pytest.mark.parametrize("call", faults.CALLS)
def test_folders_may_have_any_name_without_a_backslash_and_contain_any_file(reference, call):
    place = reference.empty(reference.scratch / f"both' of \"them & ($HOME*; {call}")
    for name in ("icha", "json", "numpy", "socket", "snakemake"):
        (place.folder / f"{name}.py").write_text("raise SystemExit('imported from the working folder')\n")
    # This path is too long for a socket, so jobs cannot be forked.
    temporary = reference.scratch / ("temporary" * 12)
    temporary.mkdir(exist_ok=True)
    status, output = place.run(call, TMPDIR=str(temporary))
    assert status == 0 and ("the fork server cannot be started" in output or call == "icha run")
    assert reference.differences(place) == []
    refused = reference.empty(reference.scratch / f"back\\slash{call}")
    status, output = refused.run(call)
    assert status and "has a backslash" in output and "Traceback" not in output
    assert not list(refused.results.rglob("*.nc"))


def test_orphan_leaves_no_result_of_its_settings(reference):
    place = reference.empty()
    process = place.start("snakemake", "--config", OTHER)
    time.sleep(0.4 * reference.seconds)
    faults.kill_process(process.pid)
    assert reference.resume(place) == []
    place.end(process)
    assert [*place.end_remaining(), *reference.differences(place)] == []


@pytest.mark.skipif(os.getuid() != 0 or not shutil.which("mkfs.ext4"), reason="needs root and mkfs.ext4")
def test_full_disk_ends_with_a_message_and_leaves_no_incomplete_result(reference):
    trial = faults.disturb_by_full_disk(reference, reference.empty(), 2, random.Random(1))
    assert trial.violations == [] and trial.outcome == faults.REFUSED
