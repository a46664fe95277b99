"""A campaign on a real Slurm of one node, which the tests start and end.

Without Slurm the tests are skipped, or fail with `ICHA_REQUIRE_SLURM=1`.
"""

import hashlib
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml
from conftest import REPOSITORY, copy_project, modules_of, snakemake
from slurm.single_node import single_node, why_not
from tiny_campaign import CAMPAIGN as TINY

PYTHON = REPOSITORY / ".venv-slurm/bin/python"
CONFIGURATION = "config/campaigns/batches.yaml"
CAMPAIGN = yaml.safe_load(TINY) | {"name": "batches", "figures": {"fig2_area_and_gap": {"study": "load"}}}
CAMPAIGN["studies"]["load"]["rms_slopes"] = [0.2, 0.5, 1.0]
RUNS = {
    f"runs/load/rough/seed{seed}/slope{slope}/{material}.nc"
    for seed in (1, 2)
    for slope in ("0.2", "0.5", "1")
    for material in ("soft", "bare")
}
# The job of this run fails.
FAILING = "runs/load/rough/seed2/slope0.5/bare.nc"


def slurm_is_needed():
    """Skip the test if Slurm cannot be started; fail if it is required."""
    reason = why_not()
    if reason is None and not PYTHON.exists():
        reason = "Snakemake's executor for Slurm is not installed (make slurm-environment)"
    if reason is not None:
        (pytest.fail if os.environ.get("ICHA_REQUIRE_SLURM") == "1" else pytest.skip)(reason)


def project_with_campaign(folder):
    project = copy_project(REPOSITORY, folder)
    (project / CONFIGURATION).write_text(yaml.safe_dump(CAMPAIGN))
    return project


# Files with measured times.
MEASURED = ("logs", "benchmarks", "checksums", "run_times.tsv", "made_with.txt")


def results_of(project):
    """Return checksums of all results, without files that contain measured times."""
    folder = project / "results/batches"
    return {
        str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file() and file.relative_to(folder).parts[0] not in MEASURED
    }


@dataclass
class Call:
    """A call of Snakemake, and the records of Slurm about its submissions."""

    output: str
    returncode: int
    results: dict[str, str]
    records: list[dict[str, str]]
    comments: dict[str, str]


def call_with_profile(node, project, *arguments):
    """Call Snakemake with the shipped profile, with shorter intervals between checks of the submissions."""
    before = len(node.finished_jobs())
    done = subprocess.run(
        [PYTHON, "-m", "snakemake", "--workflow-profile", "slurm", "--configfile", CONFIGURATION,
         "--slurm-batches-init-seconds-before-status-checks", "1", *arguments],
        cwd=project,
        env=node.environment | {"PYTHONPATH": modules_of(project), "PYTHONDONTWRITEBYTECODE": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=900,
    )  # fmt: skip
    records = node.finished_jobs()[before:]
    known = dict(
        line.split("|") for line in node.command("squeue", "--states=all", "--noheader", "--format=%i|%k").splitlines()
    )
    comments = {record["JobId"]: known[record["JobId"]] for record in records}
    return Call(done.stdout, done.returncode, results_of(project), records, comments)


@pytest.fixture(scope="module")
def calls(tmp_path_factory):
    """Run the campaign with one run that cannot be written, then without this obstacle, then after an edit."""
    slurm_is_needed()
    project = project_with_campaign(tmp_path_factory.mktemp("slurm") / "project")
    obstacle = project / "results/batches/checksums" / f"{FAILING}.json"
    obstacle.mkdir(parents=True)
    batches = ("--group-components", "surfaces=10", "references=10", "runs=6")
    with single_node() as node:
        failing = call_with_profile(node, project, *batches)
        obstacle.rmdir()
        whole = call_with_profile(node, project, *batches)
        # All runs with `soft` are outdated, and none of them can be submitted.
        configuration = project / CONFIGURATION
        configuration.write_text(configuration.read_text().replace("50 mJ", "60 mJ"))
        refused = call_with_profile(node, project, "--default-resources", "slurm_partition=nowhere")
        plan = snakemake(project, "--dry-run", configuration=CONFIGURATION)
    return {"failing": failing, "whole": whole, "refused": refused, "plan": plan}


@pytest.mark.slow
def test_batches_request_the_cores_and_the_memory_of_their_parallel_runs(calls):
    call = calls["failing"]
    submitted = sorted(call.comments.values())
    assert submitted == ["rule_references_reference", "rule_runs_run", "rule_runs_run", "rule_surfaces_surface"]
    # Slurm has a record of every submission that Snakemake reports, and no other record.
    assert all(f"SLURM jobid {record['JobId']} " in call.output for record in call.records)
    assert call.output.count("SLURM jobid") == len(call.records) == 4
    for record in call.records:
        if call.comments[record["JobId"]] == "rule_runs_run":
            # Six runs on four cores make layers of four and two runs: four times the memory of a run, twice its time.
            assert record["ProcCnt"] == "4" and "mem=2400M" in record["Tres"] and record["TimeLimit"] == "60"


@pytest.mark.slow
def test_a_failed_run_is_reported_and_stops_no_other(calls):
    call = calls["failing"]
    assert call.returncode != 0
    assert {name for name in call.results if name.startswith("runs/")} == RUNS - {FAILING}
    assert "references/rough.nc" in call.results and "config.used.yaml" in call.results
    states = [record["JobState"] for record in call.records]
    assert sorted(states) == ["COMPLETED", "COMPLETED", "COMPLETED", "FAILED"]
    failed = next(record["JobId"] for record in call.records if record["JobState"] == "FAILED")
    assert call.comments[failed] == "rule_runs_run"
    # The last message reports this run alone, with its log and the error; a message before names the log of the batch.
    *_, reported = call.output.split(f"SLURM-job '{failed}' failed")
    assert reported.count("Error in rule") == 1
    assert f"logs/{Path(FAILING).with_suffix('.log')}" in reported
    assert "Error: [Errno 21] Is a directory" in reported and f"{FAILING}.json" in reported
    assert f"/{failed}.log" in call.output


@pytest.mark.slow
def test_the_next_call_computes_only_missing_results(calls):
    before, call = calls["failing"], calls["whole"]
    assert call.returncode == 0, call.output
    assert list(call.comments.values()) == ["rule_runs_run"]
    assert call.records[0]["ProcCnt"] == "1"
    assert before.results.items() <= call.results.items()


@pytest.mark.slow
def test_results_are_those_of_a_local_run_byte_for_byte(calls, tmp_path):
    project = project_with_campaign(tmp_path / "project")
    local = snakemake(project, configuration=CONFIGURATION)
    assert local.returncode == 0, local.stdout
    expected = results_of(project)
    assert RUNS | {"dataset/batches.nc", "report.html", "verdict.txt"} <= expected.keys()
    assert calls["whole"].results == expected


@pytest.mark.slow
def test_outdated_results_are_removed_even_if_their_jobs_never_ran(calls):
    refused, plan = calls["refused"], calls["plan"]
    assert refused.returncode != 0 and not refused.records
    assert "nowhere" in refused.output
    outdated = {name for name in RUNS if name.endswith("soft.nc")}
    assert {name for name in refused.results if name.startswith("runs/")} == RUNS - outdated
    assert plan.returncode == 0 and f"run {len(outdated)}" in " ".join(plan.stdout.split())


def test_the_profile_names_existing_rules():
    profile = yaml.safe_load((REPOSITORY / "profiles/slurm/config.yaml").read_text())
    rules = " ".join(file.read_text() for file in (REPOSITORY / "workflow/rules").glob("*.smk"))
    assert all(f"rule {name}:" in rules for name in profile["groups"])
    assert set(profile["group-components"]) == set(profile["groups"].values())
    default = yaml.safe_load((REPOSITORY / "profiles/default/config.yaml").read_text())
    for key in ("scheduler", "keep-going", "rerun-incomplete", "show-failed-logs", "rerun-triggers", "nolock"):
        assert profile[key] == default[key]
