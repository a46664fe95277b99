"""`icha run` with a very small campaign: failures, stops, refusals, and what it prints about them."""

import fcntl
import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr
import yaml
from conftest import REPOSITORY, copy_project
from tiny_campaign import CAMPAIGN as TINY

# The material sticks so strongly that its runs fail.
STICKY = "sticky: {contact_modulus: 10 kPa, surface_energy: 500 mJ/m^2"
CAMPAIGN = TINY.replace("soft: {contact_modulus: 25 MPa, surface_energy: 50 mJ/m^2", STICKY)
CAMPAIGN = CAMPAIGN.replace("[bare, soft]", "[bare, sticky]").replace("[1, 2]", "[1]")
CAMPAIGN += "confirmed: [studies.load.models]\n"
# At the start of a run: a bug in the program.
CRASH = '    if material["surface_energy"] == 0:\n        raise RuntimeError("a bug in the program")\n'
# Enough runs that a call has not ended when it is stopped.
MANY = ("runs", "--", "--forceall", "--config", "studies={load: {seeds: 1..200}}")


def start(project, *arguments, campaign="tiny", **settings):
    program = [sys.executable, "-c", "from icha.cli import main; main()", "run", campaign, *arguments]
    environment = os.environ | {"PYTHONPATH": str(project)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.Popen(program, cwd=project, env=environment, **pipes, **settings)


def run(project, *arguments, status=0, **settings):
    """The output of a call that ends with the expected status, without a traceback."""
    process = start(project, *arguments, **settings)
    output = process.communicate()[0]
    assert process.returncode == status and "Traceback" not in output, output
    return output


def wait_for_first_job(process):
    lines = []
    for line in process.stdout:
        lines.append(line)
        if " files, " in line:
            return
    raise AssertionError("".join(lines))


def left_running(project):
    """Processes of a call that still run after five seconds."""
    for _ in range(50):
        left = subprocess.run(["pgrep", "-f", f"snakemake.*{project}"], capture_output=True, text=True).stdout
        if not left:
            break
        time.sleep(0.1)
    return left


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    folder = copy_project(REPOSITORY, tmp_path_factory.mktemp("cli") / "project")
    (folder / "config/campaigns/tiny.yaml").write_text(CAMPAIGN)
    return folder


@pytest.mark.slow
def test_a_job_that_crashes_is_named_with_its_log_and_stops_no_other(project):
    script = project / "icha/tasks/run.py"
    whole = script.read_text()
    begin = "    contact = read_scaled_surface"
    assert whole.count(begin) == 1
    script.write_text(whole.replace(begin, CRASH + begin))
    try:
        output = run(project, "dataset", "references", status=1)
    finally:
        script.write_text(whole)
    assert (
        "1 job failed:\n    unexpected RuntimeError('a bug in the program')\n        log: results/tiny/logs/runs/"
        in output
    )
    assert re.search(r"^\d+ files? computed in .*, \d+ missing or outdated$", output, re.MULTILINE)
    assert (project / "results/tiny/references/rough.nc").is_file()
    assert not (project / "results/tiny/dataset/tiny.nc").exists()
    # The last line names the log with the output of Snakemake.
    log = project / output.splitlines()[-1].removeprefix("log:").strip()
    assert "Error in rule run" in log.read_text()


@pytest.mark.slow
def test_a_run_that_fails_leaves_a_dataset_and_is_listed_with_its_reason(project):
    # The snapshot is far above the surface.
    far = yaml.safe_load(TINY) | {"name": "far"}
    far["studies"]["load"] |= {"materials": ["bare"], "snapshots": [{"mean_separation": "1 m"}]}
    (project / "config/campaigns/far.yaml").write_text(yaml.safe_dump(far))
    output = run(project, "dataset", campaign="far", status=1)
    assert "2 runs failed; all reasons: results/far/logs/failed_runs.txt" in output
    assert "not in the configuration" not in output
    assert "\n    load/rough/seed1/slope1/bare: nothing was computed: path: " in output and " (2 seeds)\n" in output
    assert "1 job failed:" in output and "logs/verdict.log" in output
    assert "dataset: results/far/dataset/far.nc" in output
    assert re.search(r"^far: 8 files to compute, about .* on 2 cores", output, re.MULTILINE)
    # A second call repeats the verdict only.
    (project / "results/far/figures").mkdir()
    (project / "results/far/figures/fig7_stiffness.png").touch()
    output = run(project, "runs", campaign="far")
    assert "Nothing to do" in output
    assert "not in the configuration, remove their files if they are not needed: figures fig7_stiffness" in output


@pytest.mark.slow
def test_a_stopped_call_can_be_continued(project):
    def heed():
        # In the background of a script, the signal is ignored.
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    process = start(project, *MANY, start_new_session=True, preexec_fn=heed)
    wait_for_first_job(process)
    process.send_signal(signal.SIGINT)
    output = process.communicate(timeout=200)[0]
    assert process.returncode == 1
    assert "Stopped before the end. Repeat the command to continue." in output and "Traceback" not in output
    assert "failed:" not in output and not left_running(project)
    run(project, "runs")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="processes end with another one on Linux only")
def test_a_killed_call_leaves_no_lock(project):
    process = start(project, *MANY)
    wait_for_first_job(process)
    process.kill()
    process.communicate()
    run(project, "runs")


@pytest.mark.slow
def test_a_campaign_that_another_process_runs_is_refused_with_the_reason(project):
    lock = project / ".snakemake/tiny.lock"
    lock.parent.mkdir(exist_ok=True)
    with lock.open("w") as file:
        file.write("4242\n")
        file.flush()
        fcntl.flock(file, fcntl.LOCK_EX)
        output = run(project, "dataset", "--", "--forceall", status=1)
    assert "Snakemake could not start:\n" in output and "Process 4242 is running this campaign" in output
    assert "dataset:" not in output


def test_a_dry_run_prints_the_plan_and_the_number_of_jobs(project):
    (project / "config/campaigns/planned.yaml").write_text(CAMPAIGN.replace("name: tiny", "name: planned"))
    output = run(project, "surfaces", "-n", campaign="planned")
    assert "study load" in output and "2 runs, 2 to do: about" in output
    assert output.endswith("\n1 job would run.\n")
    assert not any(words in output for words in ("Job stats", "host:", "Building DAG", "reason:")), output
    assert not (project / "results/planned").exists()


@pytest.mark.slow
def test_an_accuracy_is_reached_with_seeds_that_stay(tmp_path):
    project = copy_project(REPOSITORY, tmp_path / "project")
    asked = TINY.replace("grid: 32", "grid: 40").replace("[bare, soft]", "[bare]")
    asked = asked.replace("seeds: [1, 2]", "accuracy: 30 %")
    (project / "config/campaigns/tiny.yaml").write_text(asked)
    output = run(project)
    assert "next: " in output and "checks of the solved equations passed" in output
    used = yaml.safe_load((project / "results/tiny/config.used.yaml").read_text())
    chosen = yaml.safe_load((project / "results/tiny/levels.yaml").read_text())["load"]
    assert used["studies"]["load"]["levels"] == chosen
    with xr.open_datatree(project / "results/tiny/aggregated/answers.nc") as answers:
        study = answers["load"].to_dataset()
        area = study.isel(answer=(study["quantity"] == "contact_area_fraction").values)
        ratio = area["estimate_high"] / area["estimate"]
        reached = float(np.where(area["geometric"], np.log(ratio), ratio - 1).max())
    assert f"contact area ± {100 * reached:.2g} % (30 % required)" in output.splitlines()[-1]
    assert reached <= 0.3 or "Not reached" in output.splitlines()[-1]
    assert "Nothing to do" in run(project)


# At the end of a run: one run of boundary elements fails a check.
FAIL = """    if seed == 2:
        dataset = dataset.assign_attrs(failed_checks="residual: 1.12e-08 (largest error); expected at most 1e-08")
"""
FIGURE = "figures: {fig2_area_and_gap: {study: load}}\n"


@pytest.mark.slow
def test_one_failed_run_leaves_figures_report_and_answers_which_count_it(tmp_path):
    project = copy_project(REPOSITORY, tmp_path / "project")
    script = project / "icha/tasks/run.py"
    end = "    write_dataset(dataset.assign_attrs(attributes), output)"
    assert script.read_text().count(end) == 1
    script.write_text(script.read_text().replace(end, FAIL + end))
    asked = TINY.replace("grid: 32", "grid: 40").replace("[bare, soft]", "[bare]")
    asked = asked.replace("seeds: [1, 2]", "seeds: [1, 2, 3]\n    models: [boundary_elements]")
    (project / "config/campaigns/tiny.yaml").write_text(asked + FIGURE)
    output = run(project, status=1)
    results = project / "results/tiny"
    assert "1 run failed; all reasons: results/tiny/logs/failed_runs.txt" in output
    assert "checks of the solved equations passed" in output
    for file in ("figures/fig2_area_and_gap.png", "dataset/tiny.nc", "report.html"):
        assert (results / file).is_file()
    with xr.open_datatree(results / "aggregated/answers.nc") as answers:
        words = answers["load"]["left_out"].values.tolist()
    assert all(" seeds of boundary elements; 1 failed a check" in each for each in words)
    assert "1 failed a check" in (results / "figures/fig2_area_and_gap.txt").read_text()
    assert "1 failed a check" in (results / "report.html").read_text()
