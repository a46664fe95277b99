"""The workflow as its users meet it: a whole campaign, interrupted ones, and wrong input."""

import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest
import xarray as xr
import yaml
from conftest import FIGURES, REPOSITORY, SMOKE, modules_of, snakemake, snakemake_command
from traces import traces

from icha.configuration.cases import campaign_sha256
from icha.configuration.load import load_configuration
from icha.planning.requirements import missing_software
from icha.planning.results import campaign_files

PROMISED = """
surfaces/challenge/seed1.nc surfaces/challenge/seed2.nc
runs/challenge/challenge/seed2/slope1/cmc_adhesionless.nc
runs/challenge/challenge/seed2/slope1/boundary_elements/cmc_adhesionless.nc
runs/multi_slope/mcghee/seed1/slope0.2/pdms_soft.nc
references/challenge.nc
references/boundary_elements/adhesionless/challenge/seed2/slope1/cmc_adhesionless/p0.0316.nc
references/boundary_elements/adhesive/challenge/seed1/slope1/cmc_300nm/p0.01.nc
references/loops/adhesive/challenge/seed1/slope1/cmc_300nm.nc
aggregated/model_error.nc aggregated/smoke.nc dataset/smoke.nc checks.json verdict.txt config.used.yaml report.html
publish/smoke-0.0.1/SHA256SUMS publish/smoke-0.0.1/dataset/smoke.nc publish/smoke-0.0.1.zip
"""


def results_of(project):
    """Checksums of all results but what is measured while they are made: logs, benchmarks, run times, time stamps."""
    folder = project / "results/smoke"
    return {
        str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file()
        and file.relative_to(folder).parts[0] not in ("logs", "benchmarks", "checksums", "run_times.tsv")
    }


def test_everything_that_was_promised_is_there(smoke):
    files = results_of(smoke)
    promised = {*PROMISED.split(), *(f"figures/{figure}.{ending}" for figure in FIGURES for ending in ("png", "pdf"))}
    assert promised <= files.keys()
    results = smoke / "results/smoke"
    for job in [file for file in files if file.startswith(("surfaces", "runs"))]:
        assert (results / "logs" / job).with_suffix(".log").is_file()
        benchmark = (results / "benchmarks" / job).with_suffix(".jsonl")
        assert json.loads(benchmark.read_text().splitlines()[0])["s"] > 0
    # A sweep reports its progress; boundary elements whether the grid resolves the attraction, before they start.
    assert len((results / "logs/runs/challenge/challenge/seed1/slope1/cmc.log").read_text().splitlines()) >= 4
    log = results / "logs/boundary_elements/adhesive/challenge/seed1/slope1/cmc_300nm/p0.01.log"
    assert "spacing 1.563e-06 m" in log.read_text().splitlines()[0]
    checks = json.loads((results / "checks.json").read_text())
    assert len({check["subject"] for check in checks}) >= 7 and all(check["passed"] for check in checks)
    used = yaml.safe_load((results / "config.used.yaml").read_text())
    assert used == yaml.safe_load((smoke / SMOKE).read_text())


def test_the_dataset_tells_where_it_comes_from(smoke):
    campaign = load_configuration(smoke / "results/smoke/config.used.yaml").campaign
    with xr.open_datatree(smoke / "results/smoke/dataset/smoke.nc") as tree:
        assert set(tree.children) == {"challenge", "multi_slope", "multi_slope_truth", "pull", "pull_far"}
        assert tree["multi_slope_truth"]["model"].values.tolist() == ["boundary_elements"]
        assert tree["challenge"]["model"].values.tolist() == ["asperities", "boundary_elements"]
        assert not tree["challenge"]["status"].values.any()
        assert tree.attrs["config_sha256"] == campaign_sha256(campaign)
        assert tree.attrs["license"] == "CC-BY-4.0"
        assert tree["multi_slope"]["rms_slope"].values.tolist() == [0.2, 0.5, 1.0]
    with xr.open_dataset(smoke / "results/smoke/runs/challenge/challenge/seed1/slope1/cmc.nc") as run:
        assert {"title", "summary", "Conventions", "source", "references"} <= set(run.attrs)
        assert run.attrs["campaign"] == "smoke" and run.attrs["study"] == "challenge"
        assert len(run.attrs["config_sha256"]) == 64


def test_the_deposit_is_what_its_checksums_say(smoke):
    deposit = smoke / "results/smoke/publish/smoke-0.0.1"
    subprocess.run(["sha256sum", "--quiet", "--check", "--strict", "SHA256SUMS"], cwd=deposit, check=True)
    listed = {line.split("  ")[1] for line in (deposit / "SHA256SUMS").read_text().splitlines()}
    there = {str(file.relative_to(deposit)) for file in deposit.rglob("*") if file.is_file()}
    assert there == listed | {"SHA256SUMS"}


def test_no_paths_users_hosts_or_times_in_results(smoke):
    words = [str(smoke), str(REPOSITORY), os.uname().nodename if len(os.uname().nodename) > 3 else str(smoke)]
    for name in results_of(smoke):
        content = (smoke / "results/smoke" / name).read_bytes()
        assert not [word for word in words if word.encode() in content], name
    deposit = smoke / "results/smoke/publish/smoke-0.0.1"
    files = [path for path in deposit.rglob("*") if path.is_file() and path.relative_to(deposit).parts[0] != "source"]
    now = time.time()
    assert traces(files, [f"{each}/".encode() for each in (smoke, REPOSITORY, Path.home())], (now - 86400, now)) == []


def test_a_second_call_does_nothing(smoke, tmp_path):
    def times():
        # Where a job has several outputs Snakemake touches them at its end, and their records get the new time.
        files = (smoke / "results").rglob("*")
        return {file: file.stat().st_mtime_ns for file in files if "checksums" not in file.parts}

    before = times()
    again = snakemake(smoke, "all", "references", "publish", "--snakefile", "workflow/Snakefile")
    assert "report_page" in snakemake(smoke, "-n", "-d", str(tmp_path), "--snakefile", "workflow/Snakefile").stdout
    assert again.returncode == 0 and "Nothing to be done" in again.stdout
    assert times() == before


@pytest.mark.parametrize("configuration", ["config/config.yaml", "config/campaigns/validation.yaml"])
def test_large_campaigns_can_be_planned(configuration, smoke, tmp_path):
    # That of the session has fewer figures.
    plan = snakemake(smoke, "all", "publish", "-n", "-d", str(tmp_path), configuration=REPOSITORY / configuration)
    assert plan.returncode == 0 and "campaign_dataset" in plan.stdout and "deposit" in plan.stdout, plan.stdout


def test_the_campaign_as_shipped_needs_no_tamaas_and_has_every_figure():
    campaign = load_configuration(REPOSITORY / SMOKE).campaign
    assert missing_software(campaign) is None and not campaign_files(campaign, "results/smoke").solutions
    assert set(campaign.figures.by_name()) == {file.stem for file in (REPOSITORY / "icha/figures").glob("fig*.py")}


@pytest.mark.slow
def test_killed_runs_are_finished_with_the_same_bytes(smoke, tmp_path):
    project = shutil.copytree(smoke, tmp_path / "project", ignore=shutil.ignore_patterns("results", ".snakemake"))
    pause = random.Random(1)
    command, environment = snakemake_command("all", "references", "publish")
    environment["PYTHONPATH"] = modules_of(project)
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
    for attempt in range(2):
        run = subprocess.Popen(command, cwd=project, env=environment, **silent)
        time.sleep(pause.uniform(3, 9))
        # Of two calls, one is killed alone: its jobs go on for a while, beside those of the next call.
        (os.kill if attempt % 2 else os.killpg)(run.pid, signal.SIGKILL)
        run.wait()
    finished = snakemake(project, "all", "references", "publish")
    assert finished.returncode == 0, finished.stdout
    assert results_of(project) == results_of(smoke)
    assert not [file for file in (project / "results").rglob("*.part")]


def test_a_call_removes_what_killed_ones_left_and_refuses_a_second_one(project, before_jobs, monkeypatch):
    (project / "results/smoke/verdict.txt").unlink()
    left = project / "results/smoke/publish/.smoke-1.0.0.zip.0a1b2c3d.part"
    left.write_bytes(b"a part")
    monkeypatch.chdir(project)
    assert before_jobs.hold_lock(".snakemake/smoke.lock") is None
    refused = snakemake(project)
    assert refused.returncode != 0 and "Traceback" not in refused.stdout
    assert f"Process {os.getpid()} is running this campaign" in refused.stdout
    assert not Path("results/smoke/verdict.txt").exists()
    before_jobs.locks.pop().close()
    assert snakemake(project).returncode == 0
    assert Path("results/smoke/verdict.txt").exists() and not left.exists()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("25 MPa", "25 mPa", "materials.cmc.contact_modulus: '25 mPa' is unusual"),
        ("grid: 64", "grid: 32", "Warning: surfaces.challenge.grid: 32"),
    ],
)
def test_a_wrong_configuration_is_a_message_and_an_unwise_one_a_warning(old, new, message, smoke, tmp_path):
    text = (REPOSITORY / SMOKE).read_text()
    assert old in text
    (tmp_path / "wrong.yaml").write_text(text.replace(old, new, 1))
    said = snakemake(smoke, "-n", "-d", str(tmp_path), configuration=tmp_path / "wrong.yaml")
    assert said.returncode == ("Warning" not in message)
    assert message in said.stdout and "Traceback" not in said.stdout and ".smk" not in said.stdout


def test_wrong_values_on_the_command_line_and_two_configurations_are_messages(smoke):
    refused = snakemake(smoke, "-n", "--config", "name=My Campaign", "studies={none: {}}")
    assert refused.returncode == 1 and "Traceback" not in refused.stdout
    assert "--config: name: 'My Campaign'" in refused.stdout
    assert "--config: studies.none.targets:" in refused.stdout
    refused = snakemake(smoke, "-n", "--configfile", "config/config.yaml", SMOKE, configuration=None)
    assert refused.returncode == 1 and "expected one file" in refused.stdout
