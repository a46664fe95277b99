"""Results that are whole but are not those of what is asked for: they never pass for up to date."""

import shutil
from base64 import urlsafe_b64encode

import pytest
import xarray as xr
from bare_campaign import CAMPAIGN
from conftest import REPOSITORY, copy_project, snakemake

from icha.support.checksums import damaged

CONFIGURATION = "config/campaigns/small.yaml"
RUNS = [f"runs/load/rough/seed{seed}/slope1/bare.nc" for seed in (1, 2)]
NOTHING = "Nothing to be done"


def campaign(project, modulus):
    (project / CONFIGURATION).write_text(CAMPAIGN.replace("25 MPa", f"{modulus} MPa"))
    return snakemake(project, "dataset", configuration=CONFIGURATION)


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
