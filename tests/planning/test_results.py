"""Paths of results: the same for whoever names them by their parts and for whoever takes those of a campaign."""

from pathlib import Path

import pytest
import yaml
from conftest import smoke_at_finite_ranges

from icha.configuration.load import load_configuration
from icha.datasets import results
from icha.datasets.labels import path_fields
from icha.planning.results import campaign_files

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    file = tmp_path_factory.mktemp("campaign") / "smoke.yaml"
    file.write_text(smoke_at_finite_ranges(), encoding="utf-8")
    return load_configuration(file).campaign


@pytest.mark.parametrize(
    ("kind", "pattern"),
    [
        ("runs", results.RUN),
        ("solutions", results.SOLUTION),
        ("loops", results.LOOP),
    ],
)
def test_every_path_is_its_pattern_with_the_parts_of_its_labels(campaign, kind, pattern):
    files = getattr(campaign_files(campaign), kind)
    assert files
    for path, labels in files.items():
        assert path == pattern.format(**path_fields(labels))
        assert path.endswith(f"/{labels.path}.nc")


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("runs/load/rough/seed1/slope0.5/soft.nc", "logs/runs/load/rough/seed1/slope0.5/soft.log"),
        ("references/rough.nc", "logs/references/rough.log"),
        ("references/loops/e/rough/seed1/slope0.5/soft.nc", "logs/loops/e/rough/seed1/slope0.5/soft.log"),
    ],
)
def test_logs_of_jobs_lie_apart_from_their_files(path, expected):
    assert results.job_file(path, "logs", ".log") == expected


def test_runs_of_both_models_at_given_loads_are_compared(tmp_path):
    content = yaml.safe_load((ROOT / "config/campaigns/smoke.yaml").read_text(encoding="utf-8"))
    del content["figures"]
    for study in ("challenge", "multi_slope"):  # at given loads, and at given areas
        content["studies"][study]["models"] = ["asperities", "boundary_elements"]
    (tmp_path / "both.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    files = campaign_files(load_configuration(tmp_path / "both.yaml").campaign)
    assert files.model_error == ["aggregated/model_error.nc"] and not files.solutions
    assert {case.study for case in files.compared.values()} == {"challenge"}
    assert set(files.compared) < set(files.runs) and all("/boundary_elements/" in file for file in files.compared)
