"""`icha run` for real, on a very small campaign: what fails, what is stopped, and what is said of it."""

import fcntl
import os
import signal
import subprocess
import sys
import time

import pytest
from conftest import REPOSITORY, copy_project, modules_of, snakemake

from icha.cli.run import _planned_jobs, _reason_in

CAMPAIGN = """
name: tiny
title: Tiny
summary: For tests.
license: CC0-1.0
confirmed: [studies.load.models]
surfaces:
  rough: {kind: self_affine, period: 100 um, rolloff_wavelength: 50 um, short_wavelength: 20 um, hurst: 0.8, grid: 32}
materials:
  bare: {contact_modulus: 25 MPa, surface_energy: 0 mJ/m^2, interaction_range: 2 nm}
  sticky: {contact_modulus: 10 kPa, surface_energy: 500 mJ/m^2, interaction_range: 2 nm}
studies:
  load:
    surfaces: [rough]
    seeds: [1]
    rms_slopes: [1.0]
    materials: [bare, sticky]
    targets: {reduced_pressures: [1.0e-3, 1.0e-2]}
"""
# At the start of `run_sweep`: a bug, as far as users can tell.
CRASH = '    if material["surface_energy"] == 0:\n        raise RuntimeError("a bug in the program")\n'


def command(project, *arguments):
    program = [sys.executable, "-c", "from icha.cli import main; main()", "run", "tiny", *arguments]
    environment = os.environ | {"PYTHONPATH": modules_of(project), "PYTHONDONTWRITEBYTECODE": "1"}
    return program, {"cwd": project, "env": environment, "stdout": subprocess.PIPE, "text": True}


def run(project, *arguments):
    program, how = command(project, *arguments)
    return subprocess.run(program, stderr=subprocess.STDOUT, **how)


def at_work(process):
    """Wait until a call has ended its first job."""
    said = []
    for line in process.stdout:
        said.append(line)
        if line.startswith("["):
            return
    raise AssertionError("".join(said))


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    folder = copy_project(REPOSITORY, tmp_path_factory.mktemp("cli") / "project")
    (folder / "config/campaigns/tiny.yaml").write_text(CAMPAIGN)
    return folder


@pytest.mark.slow
def test_a_job_that_crashes_is_named_with_its_log_and_stops_no_other(project):
    script = project / "workflow/scripts/run_sweep.py"
    whole = script.read_text()
    begin = "    contact = read_surface"
    assert whole.count(begin) == 1
    script.write_text(whole.replace(begin, CRASH + begin))
    try:
        done = run(project, "dataset")
    finally:
        script.write_text(whole)
    assert done.returncode == 1, done.stdout
    assert "1 job failed:\n  Sweep load: rough, seed 1, slope 1, bare" in done.stdout
    assert "RuntimeError('a bug in the program')" in done.stdout
    assert "log: results/tiny/logs/runs/load/rough/seed1/slope1/bare.log" in done.stdout
    assert "not run, since they need results of failed jobs" in done.stdout and "Traceback" not in done.stdout
    assert (project / "results/tiny/runs/load/rough/seed1/slope1/sticky.nc").is_file()
    assert not (project / "results/tiny/dataset/tiny.nc").exists()
    # All that Snakemake said is kept, and it is told where.
    log = project / done.stdout.splitlines()[-1].removeprefix("log:").strip()
    assert "Error in rule run" in log.read_text()


def test_a_run_that_fails_leaves_a_dataset_and_is_listed_with_its_reason(project):
    done = run(project, "dataset")
    assert done.returncode == 1, done.stdout
    assert "1 run without a result:\n  load/rough/seed1/slope1/sticky\n    the path ends" in done.stdout
    assert "Verdict on the checks" in done.stdout
    assert "dataset: results/tiny/dataset/tiny.nc" in done.stdout and "Traceback" not in done.stdout
    lines = [line for line in done.stdout.splitlines() if line.startswith("[")]
    assert len(lines) >= 4 and " left] " in lines[0]
    # A second call tries only the verdict again.
    again = run(project, "runs")
    assert again.returncode == 0 and "Nothing to do" in again.stdout


@pytest.mark.slow
def test_damaged_files_are_made_again(project):
    run(project, "dataset")  # so that they are there, whatever tests ran before
    results = project / "results/tiny"
    paths = [
        "surfaces/rough/seed1.nc",
        "runs/load/rough/seed1/slope1/bare.nc",
        "dataset/tiny.nc",
        "aggregated/tiny.nc",
    ]
    before = {path: (results / path).read_bytes() for path in paths}
    for path in paths[:2]:
        (results / path).write_bytes(b"")
    for path in paths[2:]:
        (results / path).write_bytes(before[path][:-1000])
    told = run(project, "--dry-run").stdout
    assert all(f"damaged: {path}: will be computed again" in told for path in paths)
    done = run(project, "dataset")
    for path in paths:
        aside = (results / path).with_name((results / path).name + ".damaged")
        assert f"damaged, to be made again: results/tiny/{path} (the old file is {aside.name})\n" in done.stdout
        assert len(aside.read_bytes()) < len(before[path])
        assert (results / path).read_bytes() == before[path]
    # No job fails but the verdict on the run that cannot be completed.
    assert "1 job failed:\n  Verdict" in done.stdout


@pytest.mark.slow
def test_it_goes_on_after_it_was_stopped(project):
    # So many that it is still at it when it is stopped.
    program, how = command(project, "runs", "--", "--forceall", "--config", "studies={load: {seeds: 1..60}}")

    def heed():
        # The tests may themselves run where it is ignored: in the background of a script, say.
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    process = subprocess.Popen(program, stderr=subprocess.STDOUT, start_new_session=True, preexec_fn=heed, **how)
    at_work(process)
    process.send_signal(signal.SIGINT)
    rest = process.communicate(timeout=200)[0]
    assert process.returncode == 1
    assert "Stopped before the end. Repeat the command to continue." in rest and "Traceback" not in rest
    assert "failed:" not in rest
    assert not left_running(project)
    done = run(project, "runs")
    assert done.returncode == 0, done.stdout


def left_running(project):
    """What of a call is still running after five seconds."""
    for _ in range(50):
        left = subprocess.run(["pgrep", "-f", f"snakemake.*{project}"], capture_output=True, text=True).stdout
        if not left:
            break
        time.sleep(0.1)
    return left


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="processes end with another one on Linux only")
def test_nothing_goes_on_after_it_was_killed(project):
    program, how = command(project, "runs", "--", "--forceall", "--config", "studies={load: {seeds: 1..60}}")
    process = subprocess.Popen(program, stderr=subprocess.STDOUT, **how)
    at_work(process)
    process.kill()
    process.communicate()
    assert not left_running(project)
    # And nothing is in the way of the next call.
    done = run(project, "runs")
    assert done.returncode == 0, done.stdout


@pytest.mark.slow
def test_a_campaign_that_another_process_runs_is_refused_with_the_reason(project):
    lock = project / ".snakemake/tiny.lock"
    lock.parent.mkdir(exist_ok=True)
    with lock.open("w") as file:
        file.write("4242\n")
        file.flush()
        fcntl.flock(file, fcntl.LOCK_EX)
        refused = run(project, "dataset", "--", "--forceall")
    assert refused.returncode == 1
    assert "Snakemake could not start:\n    Process 4242 is running this campaign" in refused.stdout
    for wrong in ("for want of", "jobs done", "dataset:", "Job stats"):
        assert wrong not in refused.stdout, refused.stdout


def test_a_dry_run_shows_the_plan_and_counts_the_jobs(project):
    (project / "config/campaigns/planned.yaml").write_text(CAMPAIGN.replace("name: tiny", "name: planned"))
    program, how = command(project, "surfaces", "-n")
    program[program.index("tiny")] = "planned"
    told = subprocess.run(program, stderr=subprocess.STDOUT, **how)
    assert told.returncode == 0, told.stdout
    assert "study load" in told.stdout and "2 runs, 2 to do: about" in told.stdout
    assert "1 job would run, including jobs for outdated results: 1 surface" in told.stdout
    for words in ("Job stats", "host:", "Building DAG", "reason:"):
        assert words not in told.stdout
    assert not (project / "results/planned").exists()


def test_the_table_of_jobs_of_snakemake_is_read():
    table = "Job stats:\njob         count\n--------  -------\nall             1\nfigure          2\n"
    assert _planned_jobs(f"{table}report_page     1\ntotal           4\n\nrun  7\n").endswith(
        "outdated results: 2 figure, 1 report page"
    )
    assert _planned_jobs("Building DAG\nNothing to be done\n").startswith("Nothing would run")
    again = "to be made again: results/tiny/b.nc (it was made with other settings)"
    assert _planned_jobs(f"{again}\nBuilding DAG\nNothing to be done\n").splitlines()[0] == again
    assert "Nothing would run" not in _planned_jobs(f"damaged, {again}\nNothing to be done\n")


@pytest.mark.parametrize(
    ("target", "options"),
    [
        ("nosuchtarget", ["--dry-run"]),
        pytest.param("results/tiny/runs/load/rough/seed9/slope1/bare.nc", [], marks=pytest.mark.slow),
    ],
)
def test_targets_that_there_are_not_are_mistakes(project, target, options):
    refused = run(project, target, *options)
    assert refused.returncode == 2
    # That the campaign presses a sticky surface is confirmed, and said every time.
    warning, error = refused.stdout.splitlines()
    assert warning.startswith("Warning: ") and "full contact has the lower energy" in warning
    assert error.startswith(f"Error: {target}: not a target, and not a file of campaign tiny; expected all,")


def contents(folder):
    return {file: (file.read_bytes(), file.stat().st_mtime_ns) for file in folder.rglob("*") if file.is_file()}


@pytest.mark.slow
def test_a_copy_that_kept_its_name_is_refused_by_snakemake_too(project, tmp_path):
    original = tmp_path / "asked/small.yaml"
    original.parent.mkdir()
    original.write_text(CAMPAIGN.replace("name: tiny", "name: small"))
    assert snakemake(project, "surfaces", configuration=original).returncode == 0
    results = project / "results/small"
    record = (results / "belongs_to.txt").read_text().strip()
    assert (project / record).resolve() == original.resolve() and not record.startswith("/")
    before = contents(results)
    copy = project / "config/campaigns/copy.yaml"
    copy.write_text(original.read_text().replace("grid: 32", "grid: 64"))
    for arguments in ([], ["--dry-run"]):
        refused = snakemake(project, "surfaces", *arguments, configuration=copy)
        assert refused.returncode == 1 and "Traceback" not in refused.stdout
        assert "config/campaigns/copy.yaml has the same `name: small`" in refused.stdout
    assert contents(results) == before


def test_the_last_words_of_snakemake_are_its_reason_without_traceback():
    said = "Host: here\nBuilding DAG of jobs...\nJob stats:\nall  1\ntotal  10\n\nReason 1\n"
    assert _reason_in(said) == ["Reason 1"]
    trace = (
        'Traceback (most recent call last):\n\n  File "a.py", line 3, in f\n    open(x)\n\nPermissionError: results\n'
    )
    assert _reason_in(said + trace) == ["Reason 1", "PermissionError: results"]


@pytest.mark.slow
def test_wrong_options_of_snakemake_are_its_own_words(project):
    refused = run(project, "--", "--no-such-option")
    assert refused.returncode == 1
    assert "Snakemake could not start:" in refused.stdout and "--no-such-option" in refused.stdout
