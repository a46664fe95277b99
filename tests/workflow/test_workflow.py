"""A whole campaign as users run it; refused calls and wrong configurations."""

import json
import os
import time
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
import xarray as xr
import yaml
from conftest import FIGURES, REPOSITORY, SMOKE, TRACES, snakemake
from digests import results_of
from traces import traces

from icha.configuration.cases import campaign_sha256
from icha.configuration.figures import Figures
from icha.configuration.load import load_configuration
from icha.datasets.results import FIGURE_ENDINGS
from icha.support.checksums import changed_files

# A campaign that confirms an unusual value.
RANGE = "config/campaigns/cmc_range.yaml"
PROMISED = """
SHA256SUMS
surfaces/challenge/seed1.nc surfaces/challenge/seed2.nc
runs/challenge/challenge/seed2/slope1/cmc_adhesionless.nc
runs/challenge/challenge/seed2/slope1/boundary_elements/cmc_adhesionless.nc
runs/multi_slope/mcghee/seed1/slope0.2/pdms_soft.nc
references/challenge.nc
dataset/smoke.csv aggregated/answers.nc
aggregated/model_error.nc aggregated/smoke.nc dataset/smoke.nc checks.json verdict.txt config.used.yaml report.html
publish/smoke-0.0.1/SHA256SUMS publish/smoke-0.0.1/dataset/smoke.nc publish/smoke-0.0.1.zip
"""


def test_all_promised_files_exist(smoke):
    files = results_of(smoke, "smoke")
    promised = {
        *PROMISED.split(),
        *(f"figures/{figure}.{ending}" for figure in FIGURES for ending in FIGURE_ENDINGS),
    }
    assert promised <= files.keys()
    results = smoke / "results/smoke"
    for batch in ("surfaces/surfaces_0", "runs/challenge_asperities_0", "references/theories_0"):
        assert (results / f"logs/{batch}.log").is_file()
        assert json.loads((results / f"benchmarks/{batch}.jsonl").read_text().splitlines()[0])["s"] > 0
    # Runs report their progress.
    log = (results / "logs/runs/challenge_asperities_0.log").read_text()
    assert "\n2 of " in log and log.count("stop 1 of") >= 2
    assert changed_files(results) == []
    checks = json.loads((results / "checks.json").read_text())
    assert len({check["subject"] for check in checks}) >= 7 and all(check["passed"] for check in checks)
    used = yaml.safe_load((results / "config.used.yaml").read_text())
    asked = yaml.safe_load((smoke / SMOKE).read_text())
    asked["figures"]["spots"]["script"] = "inputs/figures/spots/spots.py"
    assert used == asked


def test_the_dataset_states_its_origin(smoke):
    campaign = load_configuration(smoke / "results/smoke/config.used.yaml").campaign
    with xr.open_datatree(smoke / "results/smoke/dataset/smoke.nc") as tree:
        assert set(tree.children) == {"challenge", "multi_slope", "pull", "uncertain"}
        assert tree["challenge"]["model"].values.tolist() == ["asperities", "boundary_elements"]
        assert not tree["challenge"]["status"].values.any()
        attraction = tree["challenge"]["attraction"].isel(model=1, surface=0, seed=0, rms_slope=0)
        assert attraction.values.tolist() == ["short range", "none", "finite range"]
        assert tree.attrs["config_sha256"] == campaign_sha256(campaign)
        assert tree.attrs["license"] == "CC-BY-4.0"
        assert tree["multi_slope"]["rms_slope"].values.tolist() == [0.2, 0.5, 1.0]
    with xr.open_dataset(smoke / "results/smoke/runs/challenge/challenge/seed1/slope1/cmc.nc") as run:
        assert {"title", "summary", "Conventions", "source", "references"} <= set(run.attrs)
        assert run.attrs["campaign"] == "smoke" and run.attrs["study"] == "challenge"
        assert len(run.attrs["config_sha256"]) == len(run.attrs["program_sha256"]) == 64


def test_no_paths_users_hosts_or_times_in_results(smoke):
    words = [str(smoke), str(REPOSITORY), *TRACES.values()]
    words += [os.uname().nodename] if len(os.uname().nodename) > 3 else []
    for name in results_of(smoke, "smoke"):
        content = (smoke / "results/smoke" / name).read_bytes()
        assert not [word for word in words if word.encode() in content], name
    deposit = smoke / "results/smoke/publish/smoke-0.0.1"
    files = [path for path in deposit.rglob("*") if path.is_file() and path.relative_to(deposit).parts[0] != "source"]
    now = time.time()
    places = [f"{each}/" for each in (smoke, REPOSITORY, Path.home())]
    assert traces(files, [each.encode() for each in (*places, *TRACES.values())], (now - 86400, now)) == []


def test_a_second_call_does_nothing(smoke):
    def times():
        return {file: file.stat().st_mtime_ns for file in (smoke / "results").rglob("*")}

    before = times()
    again = snakemake(smoke, "all", "references", "publish", "--snakefile", "workflow/Snakefile")
    assert again.returncode == 0 and "Nothing to be done" in again.stdout
    assert times() == before


@pytest.mark.slow
def test_a_large_campaign_can_be_planned(smoke, tmp_path):
    configuration = REPOSITORY / "config/campaigns/validation.yaml"
    elsewhere = ("-n", "-d", str(tmp_path), "--snakefile", "workflow/Snakefile")
    plan = snakemake(smoke, "all", "publish", *elsewhere, configuration=configuration)
    assert plan.returncode == 0 and "analyse" in plan.stdout and "deposit" in plan.stdout, plan.stdout


def test_the_campaigns_of_the_tests_have_every_figure():
    campaign = load_configuration(REPOSITORY / SMOKE).campaign
    indenter = load_configuration(REPOSITORY / "config/campaigns/indenter.yaml").campaign
    drawn = {*campaign.figures.by_name(), *indenter.figures.by_name()}
    assert drawn == Figures.model_fields.keys()


def test_a_wrong_configuration_is_a_message_without_traceback(smoke, tmp_path):
    text = (REPOSITORY / SMOKE).read_text()
    (tmp_path / "wrong.yaml").write_text(text.replace("25 MPa", "25 mPa", 1))
    refused = snakemake(smoke, "-n", "-d", str(tmp_path), configuration=tmp_path / "wrong.yaml")
    assert refused.returncode == 1 and "materials.cmc.contact_modulus: '25 mPa' is unusual" in refused.stdout
    assert "Traceback" not in refused.stdout and ".smk" not in refused.stdout


@pytest.fixture
def configuration_of(monkeypatch):
    """Return the function that reads the configuration of a call, with the files and values of its command line."""
    monkeypatch.syspath_prepend(str(REPOSITORY / "workflow"))
    monkeypatch.chdir(REPOSITORY)
    import prepare

    monkeypatch.setattr(prepare.logger, "warning", warnings := Mock())

    def read(*files, **values):
        settings = SimpleNamespace(configfiles=files, config=values)
        prepare.read_configuration(SimpleNamespace(config_settings=settings), str(REPOSITORY))
        return warnings.call_args.args[0]

    return read


def test_wrong_values_on_the_command_line_are_messages_and_confirmed_ones_warnings(configuration_of):
    with pytest.raises(SystemExit, match=r"with --config: name: 'My Campaign'(.|\n)*studies.none.targets:"):
        configuration_of(SMOKE, name="My Campaign", studies={"none": {}})
    with pytest.raises(SystemExit, match="expected one file"):
        configuration_of("config/config.yaml", SMOKE)
    assert "materials.mu_1.interaction_range: '6.213 nm' is unusual" in configuration_of(RANGE)


@pytest.mark.slow
def test_the_report_of_snakemake_contains_every_figure_with_its_caption(smoke, tmp_path):
    done = snakemake(smoke, "--report", str(tmp_path / "report.html"))
    assert done.returncode == 0, done.stdout
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    for figure in (smoke / "results/smoke/figures").glob("*.png"):
        for kind in ("figure", "caption"):
            assert json.dumps({"figure": figure.stem, "file": kind}) in page
