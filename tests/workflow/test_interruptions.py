"""An interrupted call loses at most the results that were being computed; the next call goes on."""

import os
import signal
import subprocess
import sys

import pytest
import yaml
from conftest import REPOSITORY, copy_project, snakemake, snakemake_command, wait_for
from tiny_campaign import CAMPAIGN

CONFIGURATION = "config/campaigns/tiny.yaml"
MANY = yaml.safe_load(CAMPAIGN)
MANY["studies"]["load"]["seeds"] = list(range(1, 31))


def start(project):
    """Start a call in a new process group."""
    command, environment = snakemake_command("runs", configuration=CONFIGURATION)
    environment["PYTHONPATH"] = str(project)
    return subprocess.Popen(
        command,
        cwd=project,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        process_group=0,
    )


def runs(project):
    """Return content and number (inode) of each run."""
    files = (project / "results/tiny/runs").rglob("*.nc")
    return {str(file.relative_to(project)): (file.read_bytes(), file.stat().st_ino) for file in files}


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="process groups")
@pytest.mark.parametrize("whole_group", [True, False], ids=["all_processes", "snakemake_alone"])
def test_a_killed_call_loses_only_what_was_being_computed(whole_group, tmp_path):
    project = copy_project(REPOSITORY, tmp_path / "project")
    (project / CONFIGURATION).write_text(yaml.safe_dump(MANY))
    call = start(project)
    wait_for(lambda: len(runs(project)) >= 5)
    os.killpg(call.pid, signal.SIGKILL) if whole_group else call.kill()
    call.wait()
    before = runs(project)
    assert 5 <= len(before) < 60
    again = snakemake(project, "runs", configuration=CONFIGURATION)
    assert again.returncode == 0, again.stdout
    after = runs(project)
    assert len(after) == 60
    # The files are the same, not only their contents. A batch that outlives its call may finish one run more.
    assert sum(after[name] == file for name, file in before.items()) >= len(before) - (not whole_group)
    assert not list((project / "results").rglob(".*.part"))
    assert "Nothing to be done" in snakemake(project, "runs", configuration=CONFIGURATION).stdout
