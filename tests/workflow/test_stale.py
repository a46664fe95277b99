"""Results that are whole but are not those of what is asked for: they never pass for up to date."""

import json
import os
import shutil
from base64 import urlsafe_b64decode, urlsafe_b64encode
from pathlib import Path
from types import SimpleNamespace

import pytest
from conftest import REPOSITORY, copy_project, snakemake
from tiny_campaign import CAMPAIGN

from icha.support.checksums import damaged, hash_parameters, sha256_as_written, write_checksum

CONFIGURATION = "config/campaigns/tiny.yaml"
RESULTS = Path("results/tiny")
METADATA, INCOMPLETE = Path(".snakemake/metadata"), Path(".snakemake/incomplete")


class Rule(SimpleNamespace):
    """What of a rule is looked at, whose result is one file."""

    def __init__(self, path, *params):
        super().__init__(script="script.py", params=params, output=[SimpleNamespace(match=path.__eq__)])

    def get_wildcards(self, path):
        return {}


def written(path, content, modulus, **made_from):
    """Write a result, its sidecar and the record of Snakemake, as the job for a modulus does."""
    (RESULTS / path).write_bytes(content)
    write_checksum(RESULTS, path, asked=hash_parameters([repr(modulus)]), inputs=made_from)
    record = METADATA / urlsafe_b64encode(f"{RESULTS}/{path}".encode()).decode()
    record.write_text(json.dumps({"params": [repr(modulus)]}))
    return record


def dataset_of_run():
    return written("dataset.nc", b"of one run", 25, **{"run.nc": sha256_as_written(RESULTS, "run.nc")})


def records_lost():
    shutil.rmtree(METADATA)


def one_run_restored():
    """From a backup of results of other settings, of which Snakemake keeps the record of what was there since."""
    record = (METADATA / urlsafe_b64encode(f"{RESULTS}/run.nc".encode()).decode()).read_bytes()
    written("run.nc", b"a harder run", 30).write_bytes(record)


def one_run_of_other_bytes():
    """From another machine: of the same settings, and older than the dataset."""
    written("run.nc", b"another", 25)
    os.utime(RESULTS / "run.nc", (1, 1))
    write_checksum(RESULTS, "run.nc", asked=hash_parameters(["25"]))


def checksums_lost():
    shutil.rmtree(RESULTS / "checksums")


@pytest.mark.parametrize(
    ("what", "now", "again"),
    [
        (lambda: None, 25, set()),
        (lambda: None, 30, set()),  # Snakemake sees it by its records
        (records_lost, 25, set()),
        (records_lost, 30, {"run.nc", "dataset.nc"}),
        (one_run_restored, 25, {"run.nc", "dataset.nc"}),
        (one_run_of_other_bytes, 25, {"dataset.nc"}),
        (checksums_lost, 25, {"run.nc", "dataset.nc"}),
    ],
)
def test_what_snakemake_does_not_see_is_made_again(what, now, again, tmp_path, monkeypatch, before_jobs):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(before_jobs, "hold_lock", lambda path: None)
    for folder in (RESULTS, METADATA):
        folder.mkdir(parents=True)
    written("run.nc", b"one run", 25)
    dataset_of_run()
    what()
    assert damaged(RESULTS) == []
    METADATA.mkdir(exist_ok=True)
    campaign = before_jobs.CampaignResults(str(RESULTS), "tiny", "tiny.yaml", "clone", dry_run=False)
    paths = [f"{RESULTS}/run.nc", f"{RESULTS}/dataset.nc"]
    campaign.have_stale_made_again(paths, [Rule(path, now) for path in paths])
    marked = {urlsafe_b64decode(file.name).decode() for file in INCOMPLETE.iterdir()} if INCOMPLETE.is_dir() else set()
    assert marked == {f"{RESULTS}/{path}" for path in again}


@pytest.mark.slow
def test_unchanged_results_without_the_workflows_records_are_left_alone(tmp_path):
    project = copy_project(REPOSITORY, tmp_path / "project")
    (project / CONFIGURATION).write_text(CAMPAIGN)

    def dataset(*options):
        done = snakemake(project, "dataset", *options, configuration=CONFIGURATION)
        assert done.returncode == 0, done.stdout
        return done.stdout

    dataset()
    shutil.rmtree(project / ".snakemake")
    assert "Nothing to be done" in dataset()
    # As a deposit asks for where there are none: what made the results is recorded, and they stay as they are.
    records = project / METADATA
    assert not any(records.iterdir())
    dataset("--touch", "--forceall")
    named = {urlsafe_b64decode(file.name).decode() for file in records.iterdir()}
    assert {f"results/tiny/{path}" for path in ("runs/load/rough/seed1/slope1/bare.nc", "dataset/tiny.nc")} <= named
    assert damaged(project / "results/tiny", thorough=True) == []
    assert "Nothing to be done" in dataset()
