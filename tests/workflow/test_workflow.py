"""The workflow as its users meet it: whole campaigns, interrupted ones, and wrong input."""

import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml
from conftest import FIGURES, REPOSITORY, SMOKE, copy_project, modules_of, snakemake, snakemake_command
from traces import traces

from icha.configuration.cases import campaign_sha256
from icha.configuration.load import load_configuration
from icha.support.checksums import made_as, write_checksum

CAMPAIGNS = ["config/config.yaml", *(f"config/campaigns/{p.name}" for p in (REPOSITORY / "config/campaigns").iterdir())]


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
    for name in (
        "surfaces/challenge/seed1.nc",
        "surfaces/challenge/seed2.nc",
        "runs/challenge/challenge/seed2/slope1/cmc_adhesionless.nc",
        "runs/challenge/challenge/seed2/slope1/boundary_elements/cmc_adhesionless.nc",
        "runs/multi_slope/mcghee/seed1/slope0.2/pdms_soft.nc",
        "references/challenge.nc",
        "references/boundary_elements/adhesionless/challenge/seed2/slope1/cmc_adhesionless/p0.0316.nc",
        "references/boundary_elements/adhesive/challenge/seed1/slope1/cmc_300nm/p0.01.nc",
        "references/loops/adhesive/challenge/seed1/slope1/cmc_300nm.nc",
        "aggregated/model_error.nc",
        "dataset/smoke.nc",
        "aggregated/smoke.nc",
        "checks.json",
        "verdict.txt",
        "config.used.yaml",
        "report.html",
        "publish/smoke-0.0.1/SHA256SUMS",
        "publish/smoke-0.0.1/dataset/smoke.nc",
        "publish/smoke-0.0.1.zip",
    ):
        assert name in files
    for figure in FIGURES:
        assert f"figures/{figure}.png" in files and f"figures/{figure}.pdf" in files
    jobs = [file for file in files if file.startswith(("surfaces", "runs"))]
    for job in jobs:
        assert (smoke / "results/smoke/logs" / job).with_suffix(".log").is_file()
        benchmark = (smoke / "results/smoke/benchmarks" / job).with_suffix(".jsonl")
        assert json.loads(benchmark.read_text().splitlines()[0])["s"] > 0


@pytest.mark.slow
def test_the_campaign_as_shipped_needs_no_tamaas_and_has_every_figure(tmp_path):
    project = copy_project(REPOSITORY, tmp_path / "project")
    (project / "sitecustomize.py").write_text("import sys\n\nsys.modules['tamaas'] = None\n")
    run = snakemake(project)
    assert run.returncode == 0, run.stdout
    figures = {file.stem for file in (REPOSITORY / "icha/figures").glob("fig*.py")}
    assert len(figures) == 15
    assert {file.stem for file in (project / "results/smoke/figures").iterdir()} == figures


@pytest.mark.slow
def test_three_measured_surfaces_go_through_both_models(tmp_path):
    project = copy_project(REPOSITORY, tmp_path / "project")
    run = snakemake(project, configuration="config/campaigns/measured.yaml")
    assert run.returncode == 0, run.stdout
    with xr.open_datatree(project / "results/measured/dataset/measured.nc") as tree:
        for study, surfaces in (("microscopes", 2), ("millimetres", 1)):
            runs = tree[study].to_dataset()
            assert runs["model"].values.tolist() == ["asperities", "boundary_elements"]
            assert runs.sizes["surface"] == surfaces
            area = runs["contact_area_fraction"]
            for surface in range(surfaces):
                own = area.isel(surface=surface).dropna("rms_slope", how="all")
                assert own.sizes["rms_slope"] == 1 and np.all(own > 0) and np.all(own.diff("step") > 0)
    assert len(list((project / "results/measured/figures").glob("*.png"))) == 3


def test_sweeps_report_progress(smoke):
    log = smoke / "results/smoke/logs/runs/challenge/challenge/seed1/slope1/cmc.log"
    assert len(log.read_text().splitlines()) >= 4


def test_boundary_elements_say_whether_the_grid_resolves_the_attraction_before_they_start(smoke):
    folder = smoke / "results/smoke/logs/boundary_elements/adhesive/challenge/seed1/slope1/cmc_300nm"
    first, *others = (folder / "p0.01.log").read_text().splitlines()
    assert "spacing 1.563e-06 m" in first and "sqrt(dgamma dx/E*)/range" in first
    assert others


def test_the_dataset_tells_where_it_comes_from(smoke):
    campaign = load_configuration(smoke / "results/smoke/config.used.yaml").campaign
    with xr.open_datatree(smoke / "results/smoke/dataset/smoke.nc") as tree:
        assert set(tree.children) == {"challenge", "multi_slope", "multi_slope_truth", "pull", "pull_far"}
        assert tree["multi_slope"]["model"].values.tolist() == ["asperities"]
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


def test_the_configuration_as_used_is_the_campaign(smoke):
    used = yaml.safe_load((smoke / "results/smoke/config.used.yaml").read_text())
    assert used == yaml.safe_load((smoke / SMOKE).read_text())


def test_all_checks_passed(smoke):
    checks = json.loads((smoke / "results/smoke/checks.json").read_text())
    assert len({check["subject"] for check in checks}) >= 7
    assert all(check["passed"] for check in checks)


def test_the_deposit_can_be_verified(smoke):
    deposit = smoke / "results/smoke/publish/smoke-0.0.1"
    done = subprocess.run(
        ["sha256sum", "--check", "--strict", "SHA256SUMS"], cwd=deposit, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    listed = {line.split("  ")[1] for line in (deposit / "SHA256SUMS").read_text().splitlines()}
    there = {str(file.relative_to(deposit)) for file in deposit.rglob("*") if file.is_file()}
    assert there == listed | {"SHA256SUMS"}


def test_a_second_call_does_nothing(smoke):
    def times():
        # Where a job has several outputs Snakemake touches them at its end, and their records get the new time.
        files = (smoke / "results").rglob("*")
        return {file: file.stat().st_mtime_ns for file in files if "checksums" not in file.parts}

    before = times()
    again = snakemake(smoke, "all", "references", "publish")
    assert again.returncode == 0 and "Nothing to be done" in again.stdout
    assert times() == before


PLANS = """
import sys
from pathlib import Path
from snakemake.api import SnakemakeApi
from snakemake.settings.types import ConfigSettings, DAGSettings, OutputSettings, ResourceSettings
for file in sys.argv[2:]:
    with SnakemakeApi(OutputSettings(dryrun=True)) as api:
        configured = ConfigSettings(configfiles=[Path(file).resolve()])
        resources = ResourceSettings(cores=2)
        folder = Path(sys.argv[1])
        workflow = api.workflow(resources, configured, snakefile=Path("Snakefile").resolve(), workdir=folder)
        workflow.dag(DAGSettings(targets={"all", "publish"})).execute_workflow(executor="dryrun")
    print("planned", file, file=sys.stderr)
"""


def test_shipped_campaigns_can_be_planned(smoke, tmp_path):
    plan = subprocess.run(
        [sys.executable, "-c", PLANS, str(tmp_path), *CAMPAIGNS],
        cwd=smoke,
        env=os.environ | {"PYTHONPATH": modules_of(smoke)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert plan.returncode == 0, plan.stdout
    plans = plan.stdout.split("planned ")
    assert len(plans) == len(CAMPAIGNS) + 1
    assert all("campaign_dataset" in text and "deposit" in text for text in plans[:-1])


def test_another_configuration_replaces_the_default_one(smoke, tmp_path):
    plan = snakemake(smoke, "-n", "-d", str(tmp_path))
    assert "pdms_soft" in plan.stdout
    assert "pdms_stiff" not in plan.stdout and "results/paper" not in plan.stdout


def test_no_paths_users_or_hosts_in_results(smoke):
    words = [str(smoke), str(REPOSITORY), os.uname().nodename if len(os.uname().nodename) > 3 else str(smoke)]
    for name in results_of(smoke):
        content = (smoke / "results/smoke" / name).read_bytes()
        for word in words:
            assert word.encode() not in content, f"{word} in {name}"


def test_nothing_in_the_deposit_tells_where_or_when_it_was_made(smoke):
    deposit = smoke / "results/smoke/publish/smoke-0.0.1"
    files = [path for path in deposit.rglob("*") if path.is_file() and path.relative_to(deposit).parts[0] != "source"]
    words = [f"{folder}/".encode() for folder in (smoke, REPOSITORY, Path.home())]
    now = time.time()
    assert traces(files, words, (now - 86400, now)) == []


@pytest.mark.slow
def test_killed_runs_are_finished_with_the_same_bytes(smoke, tmp_path):
    project = shutil.copytree(smoke, tmp_path / "project", ignore=shutil.ignore_patterns("results", ".snakemake"))
    pause = random.Random(1)
    command, environment = snakemake_command("all", "references", "publish")
    environment["PYTHONPATH"] = modules_of(project)
    for attempt in range(4):
        run = subprocess.Popen(
            command,
            cwd=project,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        time.sleep(pause.uniform(3, 9))
        if attempt % 2:
            # Snakemake alone: its jobs go on for a while, beside those of the next call.
            os.kill(run.pid, signal.SIGKILL)
        else:
            os.killpg(run.pid, signal.SIGKILL)
        run.wait()
    finished = snakemake(project, "all", "references", "publish")
    assert finished.returncode == 0, finished.stdout
    assert results_of(project) == results_of(smoke)
    assert not [file for file in (project / "results").rglob("*.part")]


def test_what_a_killed_job_leaves_goes_with_the_call_that_goes_on_without_it(project):
    left = project / "results/smoke/publish/.smoke-1.0.0.zip.0a1b2c3d.part"
    left.parent.mkdir(exist_ok=True)
    (project / "results/smoke/verdict.txt").unlink()
    record = project / "results/smoke/checksums/verdict.txt.json"
    before = record.stat().st_mtime_ns
    command, environment = snakemake_command()
    environment["PYTHONPATH"] = modules_of(project)
    with subprocess.Popen(
        command, cwd=project, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as run:
        # The job that makes it has begun, so the call has looked for what others left.
        while record.stat().st_mtime_ns == before and run.poll() is None:
            time.sleep(0.002)
        left.write_bytes(b"a part")
        said, _ = run.communicate()
    assert run.returncode == 0, said
    assert not left.exists()


def test_two_calls_at_once_are_refused(project):
    (project / "results/smoke/verdict.txt").unlink()
    holds = "import campaign_lock, sys; print(campaign_lock.hold_lock('.snakemake/smoke.lock')); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-uc", holds],
        cwd=project,
        env=os.environ | {"PYTHONPATH": str(REPOSITORY / "workflow")},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as other:
        assert other.stdout.readline() == "None\n"
        refused = snakemake(project)
        other.communicate()
    assert refused.returncode != 0
    assert f"Process {other.pid} is running this campaign" in refused.stdout
    assert "Traceback" not in refused.stdout
    assert not (project / "results/smoke/verdict.txt").exists()


def test_a_failed_check_stops_the_campaign_and_is_named(smoke, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(REPOSITORY / "workflow/scripts"))
    from judge_results import judge_results

    checks = json.loads((smoke / "results/smoke/checks.json").read_text())
    checks[3].update(passed=False, value=0.5)
    spoilt, verdict = tmp_path / "checks.json", tmp_path / "verdict.txt"
    spoilt.write_text(json.dumps(checks))
    with pytest.raises(ValueError, match=f"1 of {len(checks)} checks failed\n.*{checks[3]['name']}: 0.5"):
        judge_results(spoilt, verdict, known={})
    assert not verdict.exists()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("25 MPa", "-25 MPa", "materials.cmc.contact_modulus: '-25 MPa' is out of range"),
        ("25 MPa", "25 mPa", "materials.cmc.contact_modulus: '25 mPa' is unusual; usual: 1 kPa to 2000 GPa"),
        ("25 MPa", "25", "the unit is missing"),
        ("hurst: 0.8", "hurst: 0.8\n    hurst: 0.9", "key 'hurst' is given twice"),
        ("materials: [pdms_soft]", "materials: [pdms]", "'pdms' is not defined"),
        ("grid: 64", "grid: 16", "grid cells per shortest wavelength"),
    ],
)
def test_a_wrong_configuration_is_a_message(old, new, message, smoke, tmp_path):
    text = (REPOSITORY / SMOKE).read_text()
    assert old in text
    (tmp_path / "wrong.yaml").write_text(text.replace(old, new, 1))
    refused = snakemake(smoke, "-n", configuration=tmp_path / "wrong.yaml")
    assert refused.returncode == 1
    assert message in refused.stdout and f"{tmp_path}/wrong.yaml" in refused.stdout
    assert "Traceback" not in refused.stdout and ".smk" not in refused.stdout


def test_wrong_values_on_the_command_line_are_a_message(smoke):
    refused = snakemake(smoke, "-n", "--config", "name=My Campaign", "studies={none: {}}")
    assert refused.returncode == 1
    assert "--config: name: 'My Campaign' is not a name" in refused.stdout
    assert "--config: studies.none.targets: the key is missing" in refused.stdout
    assert "Traceback" not in refused.stdout


def test_two_configurations_at_once_are_refused(smoke):
    refused = snakemake(smoke, "-n", "--configfile", "config/config.yaml", SMOKE, configuration=None)
    assert refused.returncode == 1
    assert "one file, for one campaign is one file" in refused.stdout


def test_a_surface_that_is_too_coarse_is_a_warning(smoke, tmp_path):
    (tmp_path / "coarse.yaml").write_text((REPOSITORY / SMOKE).read_text().replace("grid: 64", "grid: 32"))
    plan = snakemake(smoke, "-n", "-d", str(tmp_path), configuration=tmp_path / "coarse.yaml")
    assert plan.returncode == 0
    assert "Warning: surfaces.challenge.grid: 32 gives boundary elements 4 cells per shortest wavelength" in plan.stdout


def test_a_failing_job_says_why(project):
    surface = project / "results/smoke/surfaces/mcghee/seed1.nc"
    surface.write_bytes(b"damaged")
    # Or it would be made again.
    asked = made_as(project / "results/smoke", "surfaces/mcghee/seed1.nc")
    write_checksum(project / "results/smoke", "surfaces/mcghee/seed1.nc", asked=asked)
    run = "results/smoke/runs/multi_slope/mcghee/seed1/slope1/pdms_soft.nc"
    failed = snakemake(project, run)
    assert failed.returncode == 1
    assert "seed1.nc: not a readable netCDF file" in failed.stdout
    assert "Traceback" not in failed.stdout
    assert not (project / run).exists()


@pytest.mark.slow
def test_surface_files_and_measurements(smoke, tmp_path):
    rng = np.random.default_rng(3)
    x = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    waves = [(rng.integers(1, 4, 2), rng.uniform(0, 6, 2)) for _ in range(8)]
    heights = sum(np.cos(k[0] * x + a[0])[:, None] * np.cos(k[1] * x + a[1]) for k, a in waves)
    np.save(tmp_path / "heights.npy", heights)
    (tmp_path / "points.csv").write_text("p,a\n1,0.1\n100,2\n")
    content = yaml.safe_load((REPOSITORY / SMOKE).read_text())
    content["name"] = "own"
    content["surfaces"] = {
        "own": {"kind": "file", "path": "heights.npy", "height_unit": "um", "period": "1 mm"},
    }
    study = content["studies"]["multi_slope"] | {"surfaces": ["own"], "rms_slopes": [0.5]}
    study["targets"] = {"area_fractions": [0.002, 0.01]}
    study["snapshots"] = [{"area_fraction": 0.01}]
    study["materials"] = ["bare"]
    content["materials"] = {"bare": content["materials"]["pdms_soft"] | {"surface_energy": "0 J/m^2"}}
    content["finite_range"] = {
        "truth": {"study": "multi_slope", "materials": ["bare"], "reduced_pressures": [3e-3], "refinement": 2}
    }
    content["studies"] = {"multi_slope": study}
    content["figures"] = {"fig5_multi_slope": {"study": "multi_slope"}}
    content["measurements"] = {
        "lab": {
            "path": "points.csv",
            "label": "measured",
            "citation": "A. Nobody, private communication",
            "study": "multi_slope",
            "load": {"column": "p", "unit": "kPa"},
            "area": {"column": "a", "unit": "percent"},
            "material": "bare",
            "rms_slope": 0.5,
        }
    }
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(content))
    run = snakemake(smoke, "-d", str(tmp_path), configuration=tmp_path / "own.yaml")
    assert run.returncode == 0, run.stdout
    with xr.open_dataset(tmp_path / "results/own/surfaces/own/seed0.nc") as surface:
        ratio = surface["height"].values / (heights - heights.mean())
        assert float(surface["rms_slope"]) == pytest.approx(1)
        assert np.ptp(ratio[np.isfinite(ratio)]) == pytest.approx(0, abs=1e-9 * abs(ratio).max())
    with xr.open_datatree(tmp_path / "results/own/aggregated/model_error.nc") as errors:
        truth = errors["truth"].to_dataset()
        assert truth["area_error"].shape == (1, 1, 1, 1, 1) and truth["solution_grid"].item() == 64
    assert "A. Nobody, private communication" in (tmp_path / "results/own/report.html").read_text()
    again = snakemake(smoke, "-n", "-d", str(tmp_path), configuration=tmp_path / "own.yaml")
    assert "Nothing to be done" in again.stdout
    # Another table is another figure, even if it is an old one.
    (tmp_path / "points.csv").write_text("p,a\n1,0.1\n100,3\n")
    os.utime(tmp_path / "points.csv", (0, 0))
    planned = snakemake(smoke, "-n", "-d", str(tmp_path), configuration=tmp_path / "own.yaml").stdout
    assert "Figure fig5_multi_slope" in planned and "Sweep" not in planned
    # And it is copied anew.
    assert "Writing the configuration as used" in planned
