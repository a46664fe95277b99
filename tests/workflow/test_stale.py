"""Results that are whole but are not those of what is asked for: they never pass for up to date."""

import json
import os
import shutil
from base64 import urlsafe_b64decode, urlsafe_b64encode
from pathlib import Path
from types import SimpleNamespace

import pytest
import xarray as xr
from bare_campaign import CAMPAIGN
from conftest import REPOSITORY, copy_project, snakemake

from icha.support.checksums import asked_of, damaged, sha256_as_written, write_checksum

CONFIGURATION = "config/campaigns/small.yaml"
RUNS = [f"runs/load/rough/seed{seed}/slope1/bare.nc" for seed in (1, 2)]
NOTHING = "Nothing to be done"


def campaign(project, modulus, *options):
    (project / CONFIGURATION).write_text(CAMPAIGN.replace("25 MPa", f"{modulus} MPa"))
    return snakemake(project, "dataset", *options, configuration=CONFIGURATION)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The campaign at 25 MPa, computed once; and the same after it was computed at 30 MPa."""
    soft = copy_project(REPOSITORY, tmp_path_factory.mktemp("stale") / "soft")
    done = campaign(soft, 25)
    assert done.returncode == 0, done.stdout
    hard = shutil.copytree(soft, soft.with_name("hard"))
    done = campaign(hard, 30)
    assert done.returncode == 0, done.stdout
    assert moduli(soft) == [25e6] * 3 and moduli(hard) == [30e6] * 3
    return soft, hard


def moduli(project):
    """What the runs and the dataset say they were computed with."""
    found = []
    for path in RUNS:
        with xr.open_dataset(project / "results/small" / path) as run:
            found.append(float(run.contact_modulus))
    with xr.open_datatree(project / "results/small/dataset/small.nc") as tree:
        found.append(float(tree["load"].to_dataset().contact_modulus.values.max()))
    return found


def records_lost(soft, here):
    shutil.rmtree(here / ".snakemake")


def restored_from_a_backup(soft, here):
    shutil.rmtree(here / "results")
    shutil.copytree(soft / "results", here / "results")


def restored_without_its_checksums(soft, here):
    restored_from_a_backup(soft, here)
    shutil.rmtree(here / "results/small/checksums")


def one_run_restored(soft, here):
    for path in (RUNS[0], f"checksums/{RUNS[0]}.json"):
        shutil.copy2(soft / "results/small" / path, here / "results/small" / path)


def one_run_restored_with_the_workflows_record(soft, here):
    one_run_restored(soft, here)
    name = urlsafe_b64encode(f"results/small/{RUNS[0]}".encode()).decode()
    shutil.copy2(soft / ".snakemake/metadata" / name, here / ".snakemake/metadata" / name)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("whose", "now", "what"),
    [
        (0, 30, records_lost),
        (1, 30, restored_from_a_backup),
        (1, 30, restored_without_its_checksums),
        (1, 30, one_run_restored),
        (1, 30, one_run_restored_with_the_workflows_record),
    ],
)
def test_results_of_other_settings_are_made_again(finished, tmp_path, whose, now, what):
    project = shutil.copytree(finished[whose], tmp_path / "project", symlinks=True)
    what(finished[0], project)
    assert damaged(project / "results/small") == []
    done = campaign(project, now)
    assert done.returncode == 0, done.stdout
    assert moduli(project) == [now * 1e6] * 3
    reference = finished[1] / "results/small"
    assert (project / "results/small/dataset/small.nc").read_bytes() == (reference / "dataset/small.nc").read_bytes()
    assert NOTHING in campaign(project, now).stdout


@pytest.mark.slow
def test_unchanged_results_without_the_workflows_records_are_left_alone(finished, tmp_path):
    project = shutil.copytree(finished[0], tmp_path / "project", symlinks=True)
    records_lost(finished[0], project)
    assert NOTHING in campaign(project, 25).stdout
    # As a deposit asks for where there are none: what made the results is recorded, and they stay as they are.
    records = project / ".snakemake/metadata"
    assert not any(records.iterdir())
    assert campaign(project, 25, "--touch", "--forceall").returncode == 0
    named = {urlsafe_b64decode(file.name).decode() for file in records.iterdir()}
    assert {f"results/small/{path}" for path in (*RUNS, "dataset/small.nc")} <= named
    assert damaged(project / "results/small", thorough=True) == []
    assert NOTHING in campaign(project, 25).stdout


class Rule(SimpleNamespace):
    """What of a rule is looked at, whose result is one file."""

    def __init__(self, path, *params):
        super().__init__(script="script.py", params=params, output=[SimpleNamespace(match=path.__eq__)])

    def get_wildcards(self, path):
        return {}


def test_what_was_made_from_another_input_is_made_again_whatever_the_records_and_times_say(tmp_path, monkeypatch):
    """A run with its sidecar from another machine: of the same settings, other bytes, an older time."""
    monkeypatch.syspath_prepend(str(REPOSITORY / "workflow"))
    import before_jobs

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(before_jobs, "hold_lock", lambda path: None)
    results, asked = Path("results/tiny"), {"run.nc": ["25e6"], "dataset.nc": ["a title"]}
    rules = [Rule(f"{results}/{path}", *values) for path, values in asked.items()]
    metadata, incomplete = Path(".snakemake/metadata"), Path(".snakemake/incomplete")
    for folder in (results, metadata):
        folder.mkdir(parents=True)

    def written(path, content, **made_from):
        (results / path).write_bytes(content)
        write_checksum(results, path, asked=asked_of(map(repr, asked[path])), inputs=made_from)
        record = metadata / urlsafe_b64encode(f"{results}/{path}".encode()).decode()
        record.write_text(json.dumps({"params": [repr(value) for value in asked[path]]}))

    def made_again():
        before_jobs.Campaign(str(results), dry_run=False).have_stale_made_again(
            [f"{results}/{path}" for path in asked], rules
        )
        return len(list(incomplete.iterdir())) if incomplete.is_dir() else 0

    written("run.nc", b"one run")
    written("dataset.nc", b"of one run", **{"run.nc": sha256_as_written(results, "run.nc")})
    assert made_again() == 0
    written("run.nc", b"another")
    os.utime(results / "run.nc", (1, 1))
    write_checksum(results, "run.nc", asked=asked_of(map(repr, asked["run.nc"])))
    assert damaged(results) == []
    assert made_again() == 1
