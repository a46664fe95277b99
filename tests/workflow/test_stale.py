"""Complete results of other settings or inputs never count as up to date."""

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
    """A rule of one result, with the attributes that `have_stale_made_again` reads."""

    def __init__(self, path, *params):
        super().__init__(script="script.py", params=params, output=[SimpleNamespace(match=path.__eq__)])

    def get_wildcards(self, path):
        return {}


def write(path, content, modulus, **made_from):
    """Write a result, its checksum file and Snakemake's record, as a job with this modulus does."""
    (RESULTS / path).write_bytes(content)
    write_checksum(RESULTS, path, asked=hash_parameters([repr(modulus)]), inputs=made_from)
    record = METADATA / urlsafe_b64encode(f"{RESULTS}/{path}".encode()).decode()
    record.write_text(json.dumps({"params": [repr(modulus)]}))
    return record


def write_dataset_of_run():
    return write("dataset.nc", b"of one run", 25, **{"run.nc": sha256_as_written(RESULTS, "run.nc")})


def lose_records():
    shutil.rmtree(METADATA)


def restore_run():
    """Replace the run by one of other settings, as from a backup; Snakemake's record remains."""
    record = (METADATA / urlsafe_b64encode(f"{RESULTS}/run.nc".encode()).decode()).read_bytes()
    write("run.nc", b"a harder run", 30).write_bytes(record)


def replace_run():
    """Replace the run by one of the same settings from another machine, older than the dataset."""
    write("run.nc", b"another", 25)
    os.utime(RESULTS / "run.nc", (1, 1))
    write_checksum(RESULTS, "run.nc", asked=hash_parameters(["25"]))


def lose_checksums():
    shutil.rmtree(RESULTS / "checksums")


@pytest.mark.parametrize(
    ("change", "modulus", "expected"),
    [
        (lambda: None, 25, set()),
        (lambda: None, 30, set()),  # Snakemake detects this itself
        (lose_records, 25, set()),
        (lose_records, 30, {"run.nc", "dataset.nc"}),
        (restore_run, 25, {"run.nc", "dataset.nc"}),
        (replace_run, 25, {"dataset.nc"}),
        (lose_checksums, 25, {"run.nc", "dataset.nc"}),
    ],
)
def test_stale_results_that_snakemake_does_not_detect_are_computed_again(
    change, modulus, expected, tmp_path, monkeypatch, before_jobs
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(before_jobs, "hold_lock", lambda path: None)
    for folder in (RESULTS, METADATA):
        folder.mkdir(parents=True)
    write("run.nc", b"one run", 25)
    write_dataset_of_run()
    change()
    assert damaged(RESULTS) == []
    METADATA.mkdir(exist_ok=True)
    campaign = before_jobs.CampaignResults(str(RESULTS), "tiny", "tiny.yaml", "clone", dry_run=False)
    paths = [f"{RESULTS}/run.nc", f"{RESULTS}/dataset.nc"]
    campaign.have_stale_made_again(paths, [Rule(path, modulus) for path in paths])
    marked = {urlsafe_b64decode(file.name).decode() for file in INCOMPLETE.iterdir()} if INCOMPLETE.is_dir() else set()
    assert marked == {f"{RESULTS}/{path}" for path in expected}


@pytest.mark.slow
def test_unchanged_results_without_records_of_snakemake_are_kept(tmp_path):
    project = copy_project(REPOSITORY, tmp_path / "project")
    (project / CONFIGURATION).write_text(CAMPAIGN)

    def dataset(*options):
        done = snakemake(project, "dataset", *options, configuration=CONFIGURATION)
        assert done.returncode == 0, done.stdout
        return done.stdout

    dataset()
    shutil.rmtree(project / ".snakemake")
    assert "Nothing to be done" in dataset()
    # A deposit requires records. This call, which its message recommends, writes them and computes nothing.
    records = project / METADATA
    assert not any(records.iterdir())
    dataset("--touch", "--forceall")
    named = {urlsafe_b64decode(file.name).decode() for file in records.iterdir()}
    assert {f"results/tiny/{path}" for path in ("runs/load/rough/seed1/slope1/bare.nc", "dataset/tiny.nc")} <= named
    assert damaged(project / "results/tiny", thorough=True) == []
    assert "Nothing to be done" in dataset()
