"""A campaign on a real Slurm of one node, which the test starts and ends: one batch is one submission.

Without Slurm the test is skipped, or fails with `ICHA_REQUIRE_SLURM=1`.
"""

import os
import subprocess

import pytest
import yaml
from conftest import REPOSITORY, copy_project, snakemake
from digests import results_of
from slurm.single_node import single_node, why_not
from tiny_campaign import CAMPAIGN

PYTHON = REPOSITORY / ".venv-slurm/bin/python"
CONFIGURATION = "config/campaigns/tiny.yaml"


def call_with_profile(node, project):
    """Call Snakemake with the shipped profile, with shorter intervals between checks of the submissions."""
    before = len(node.finished_jobs())
    done = subprocess.run(
        [PYTHON, "-m", "snakemake", "--workflow-profile", "slurm", "--configfile", CONFIGURATION,
         "--slurm-init-seconds-before-status-checks", "1"],
        cwd=project,
        env=node.environment | {"PYTHONPATH": str(project)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=900,
    )  # fmt: skip
    return done, node.finished_jobs()[before:]


@pytest.mark.slow
def test_a_campaign_on_slurm_has_the_bytes_of_a_local_one(tmp_path):
    reason = why_not()
    if reason is None and not PYTHON.exists():
        reason = "Snakemake's executor for Slurm is not installed (make slurm-environment)"
    if reason is not None:
        (pytest.fail if os.environ.get("ICHA_REQUIRE_SLURM") == "1" else pytest.skip)(reason)
    local, remote = (copy_project(REPOSITORY, tmp_path / name) for name in ("local", "remote"))
    for project in (local, remote):
        (project / CONFIGURATION).write_text(CAMPAIGN)
    done = snakemake(local, configuration=CONFIGURATION)
    assert done.returncode == 0, done.stdout
    with single_node() as node:
        whole, records = call_with_profile(node, remote)
        assert whole.returncode == 0, whole.stdout
        assert [record["JobState"] for record in records] == ["COMPLETED"] * 3  # surfaces, theories and runs
        assert all("mem=" in record["Tres"] and record["ProcCnt"] == "1" for record in records)
        (run,) = (remote / "results/tiny/runs").rglob("seed1/*/soft.nc")
        run.unlink()
        again, records = call_with_profile(node, remote)
        assert again.returncode == 0 and len(records) == 1, again.stdout
        (log,) = (remote / "results/tiny/logs/runs").iterdir()
        assert log.read_text().count(": tiny/runs/") == 1
    assert results_of(remote, "tiny") == results_of(local, "tiny")


def test_the_profile_has_the_options_of_the_default_profile():
    profile, default = (
        yaml.safe_load((REPOSITORY / f"profiles/{name}/config.yaml").read_text()) for name in ("slurm", "default")
    )
    for key in ("scheduler", "keep-going", "rerun-incomplete", "keep-incomplete", "show-failed-logs", "nolock"):
        assert profile[key] == default[key]
    assert profile["rerun-triggers"] == default["rerun-triggers"]
