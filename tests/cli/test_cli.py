"""The command line without Snakemake: what it prints, what it writes, what it refuses."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import small_campaign as small
import yaml
from conftest import REPOSITORY
from tiny_campaign import CAMPAIGN as TINY
from typer.testing import CliRunner

from icha.cli import app
from icha.cli.progress import Progress
from icha.cli.project import list_campaigns
from icha.configuration.cases import campaign_sha256
from icha.configuration.load import load_configuration
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import write_surface
from icha.planning.costs import Cost
from icha.planning.plan import DONE, FAILED, OUTDATED, TO_DO, Item, plan, time_on
from icha.planning.results import campaign_files, expected_stamps
from icha.surfaces.spectrum import SelfAffineSpectrum

HEAVY = ["scipy", "pandas", "xarray", "matplotlib", "netCDF4", "snakemake"]
CAMPAIGNS = Path("config/campaigns")
STARTED = 77  # exit status that stands for a started Snakemake


def output(*arguments, status=0, **options):
    """Output of a command that ends with the expected status; there must never be a traceback."""
    call = CliRunner().invoke(app, [str(each) for each in arguments], **options)
    assert call.exception is None or isinstance(call.exception, SystemExit), call.exception
    assert call.exit_code == status, call.output
    return call.output


def printed(*arguments, status=0):
    """The same in a single line."""
    return " ".join(output(*arguments, status=status).split())


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project without results, as the working directory."""
    for name in ("Snakefile", "config", "workflow/rules", "workflow/schemas", "profiles"):
        source, target = REPOSITORY / name, tmp_path / "project" / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(source, target) if source.is_dir() else shutil.copyfile(source, target)
    monkeypatch.chdir(tmp_path / "project")
    return tmp_path / "project"


@pytest.fixture
def tiny(project):
    """Campaign `tiny` and the folder of its results."""
    Path("tiny.yaml").write_text(TINY)
    return load_configuration("tiny.yaml").campaign, project / "results/tiny"


@pytest.fixture
def no_snakemake(monkeypatch):
    """A call of Snakemake ends with the status `STARTED` instead."""

    def start(*_):
        raise SystemExit(STARTED)

    # In the package, `run` is the command.
    monkeypatch.setattr(sys.modules["icha.cli.run"], "run_process", start)


@pytest.fixture
def empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("command", [[], *([each.name or each.callback.__name__] for each in app.registered_commands)])
def test_help_of_every_command_fits_a_narrow_terminal(command):
    lines = output(*command, "--help", env={"COLUMNS": "80"}).splitlines()
    assert len(lines) > 6 and "Usage:" in "".join(lines) and [line for line in lines if len(line) > 80] == []


def test_user_errors_are_messages_and_status_2(project):
    """All of tests/data/messages.yaml."""
    Path("loop").symlink_to("loop")
    for each in yaml.safe_load((REPOSITORY / "tests/data/messages.yaml").read_text(encoding="utf-8")):
        assert each["message"] in printed(*each["icha"], status=2), each
        assert not Path("run.nc").exists() and not Path("results").exists()
    output("nonsense", status=2)
    assert printed("--version").startswith("icha ")


@pytest.mark.parametrize(
    ("arguments", "without"),
    [
        (["--help"], ["numpy", "pydantic", "yaml", "rich", *HEAVY]),
        (["describe"], [*HEAVY, "icha.figures"]),
        (["show", "run.nc"], ["matplotlib", "scipy.special"]),
    ],
)
def test_commands_import_only_libraries_that_they_use(project, arguments, without):
    write_dataset(small.run(), project / "run.nc")
    script = f"from icha.cli import app\nimport sys\napp({arguments}, standalone_mode=False)\n"
    script += f"print([name for name in {without} if name in sys.modules])\n"
    call = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert call.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("options", [[], ["--pull-off"], ["--boundary-elements", "--pull-off"], ["--indenter"]])
def test_a_new_campaign_is_valid(project, options):
    assert "config/campaigns/mine.yaml written" in output("new", "mine", *options)
    file = project / CAMPAIGNS / "mine.yaml"
    configuration = load_configuration(file)
    campaign = configuration.campaign
    assert configuration.warnings == ()
    assert campaign.name == "mine" and ("pull" in campaign.studies) == ("--pull-off" in options)
    first = file.read_text().splitlines()[0]
    schema = file.parent / first.removeprefix("# yaml-language-server: $schema=")
    assert json.loads(schema.read_text())["$schema"]
    assert time_on(plan(campaign, project / "results/mine"), 2) < 60


def test_the_examples_in_the_comments_of_a_new_campaign_are_valid(project):
    output("new", "mine")
    text = (CAMPAIGNS / "mine.yaml").read_text()
    for start, lines in (("# vary:", 1), ("# cases:", 3), ("# defaults:", 2), ("# publication:", 4)):
        before, after = text.split(start)
        example = [line.replace("# ", "", 1) for line in (start + after).splitlines()[:lines]]
        file = CAMPAIGNS / "example.yaml"
        file.write_text(before + "\n".join([*example, *after.splitlines()[lines:]]))
        assert load_configuration(file).campaign.all_runs, start


def test_a_measured_file_fills_in_what_it_contains(project):
    lines = [f"{x * 1e-6:.7e} {y * 1e-6:.7e} {np.sin(x * y) * 1e-7:.7e}" for y in range(12) for x in range(12)]
    Path("scan 1.xyz").write_text("\n".join(lines))
    written = output("new", "scan", "--measured", "scan 1.xyz")
    text = (CAMPAIGNS / "scan.yaml").read_text()
    section = yaml.safe_load(text)["surfaces"]["scan_1"]
    assert section["kind"] == "measured" and section["path"] == "../../scan 1.xyz"
    assert "# 12 x 12 points\n" in text and "runs without changes" not in text
    # No unit is invented, neither of coordinates nor of heights.
    for key in ("lateral_unit", "height_unit"):
        assert section[key] is None and f"to fill in: surfaces.scan_1.{key}" in written


def test_scans_that_cannot_be_used_get_no_campaign(project):
    for name, heights, reason in (
        ("small", rough_heights()[:6], "a square of 6 x 6 points"),
        ("flat", np.ones((20, 20)), "heights that are all the same"),
        ("profile", rough_heights()[:1].T, "is a line scan, one profile of 64 points"),
    ):
        np.savetxt(f"{name}.txt", heights)
        assert reason in printed("new", "other", "--measured", f"{name}.txt", status=2)
    for name, text in (("words", "no heights in here\n"), ("empty", "\n \n")):
        Path(f"{name}.txt").write_text(text)
        assert f"{name}.txt" in printed("new", "other", "--measured", f"{name}.txt", status=2)
    output("new", "other", "--measured", "none.xyz", status=2)
    output("new", "other", "--data", "z", status=2)
    assert not (CAMPAIGNS / "other.yaml").exists()


def test_a_text_is_shown_and_what_is_missing_is_asked(project):
    rows = [" ".join(f"{height:.4f}" for height in row) for row in rough_heights()[:24, :24] * 1e9]
    Path("scan.txt").write_text("\n".join(["Width: 20 um", "Lines: 24", "Unit: nm", *rows]))
    written = output("new", "one", "--measured", "scan.txt")
    assert "scan.txt begins with:\n  Width: 20 um\n  Lines: 24\n  Unit: nm\n" in written
    assert "read as matrix" in written and "to fill in: surfaces.scan.size (is missing" in written
    assert "depend on `size`" in written and "summits, about" not in written and "anisotropic" not in written
    Path("numbered.csv").write_text(
        "\n".join([",".join(map(str, range(24))), *(row.replace(" ", ",") for row in rows)])
    )
    assert "numbered.csv begins with:\n  0,1,2,3" in output("new", "two", "--measured", "numbered.csv", status=2)
    assert "first row of numbers, 1, 2, 3" in printed("new", "two", "--measured", "numbered.csv", status=2)
    # A heading that says that numbers increase downwards.
    Path("down.txt").write_text("\n".join(["Z axis: down", "Unit: nm", *rows]))
    assert "touches_first (" not in output("new", "down", "--measured", "down.txt")
    assert yaml.safe_load((CAMPAIGNS / "down.yaml").read_text())["surfaces"]["down"]["touches_first"] == "low"
    # Missing points of a grid, and points on no grid.
    y, x = np.mgrid[:24, :24] * 0.5
    table = np.column_stack([x.ravel(), y.ravel(), rough_heights()[:24, :24].ravel() * 1e9])
    table[[7, 90, 300]] = np.nan
    np.savetxt("points.xyz", table, fmt="%.4f")
    written = output("new", "three", "--measured", "points.xyz")
    assert "heights of 3 points interpolated" in written and "scattered" not in (CAMPAIGNS / "three.yaml").read_text()
    np.savetxt("cloud.xyz", table + 0.1 * np.random.default_rng(1).normal(size=table.shape), fmt="%.4f")
    assert "to fill in: surfaces.cloud.scattered" in output("new", "four", "--measured", "cloud.xyz")
    assert yaml.safe_load((CAMPAIGNS / "four.yaml").read_text())["surfaces"]["cloud"]["scattered"] is None


def rough_heights(noise=0.0, grid=64, side=10e-6):
    heights = SelfAffineSpectrum(side, side, side / 8, 0.8, rms_slope=0.1).realise(grid, 1).heights
    return heights + noise * np.random.default_rng(1).normal(size=heights.shape)


def test_a_scan_is_analysed_before_anything_is_computed(project):
    # As Gwyddion exports it: with size and units.
    heading = "Channel: Z\nWidth: 10 um\nHeight: 10 um\nValue units: m"
    np.savetxt("scan.txt", rough_heights(noise=20e-9), "%.8e", header=heading)
    written = output("new", "mine", "--measured", "scan.txt", "--boundary-elements")
    assert "scan: read as matrix, all points have a height\n" in written
    assert re.search(r"^scan: \d+ rows x \d+ columns of points; pixels of \S+ \S+ x ", written, re.MULTILINE)
    rms, wavelength = re.search(r"noise floor of (\S+) nm rms; waves shorter than (\S+) um are", written).groups()
    assert float(rms) == pytest.approx(20, rel=0.1) and 0.5 < float(wavelength) < 2
    cutoff = re.search("recommended: `cutoff: ([^`]*)`", written)[1]
    file = CAMPAIGNS / "mine.yaml"
    assert f"# cutoff: {cutoff} " in file.read_text() and "# recommended: " in file.read_text()
    text = file.read_text().replace("boundary: ", "boundary: window")
    file.write_text(text)
    # The grid does not resolve the noise, so the scan must be filtered, or its grid confirmed.
    refused = output("describe", "mine", status=2)
    few = r"surfaces\.scan\.grid: \d+ is unusual \((\S+) cells per shortest wave, estimated from the spectrum\)"
    assert 1 < float(re.search(few, refused)[1]) < 4 and "or `cutoff: " in refused
    summits = int(re.search(r"(\d+) summits?, ", written)[1])
    file.write_text(text.replace("confirmed: [", "confirmed: [surfaces.scan.grid, "))
    confirmed = output("describe", "mine")
    assert f"recommended: `cutoff: {cutoff}`" in confirmed and "grid: few grid cells: scan has " in confirmed
    # Uncommenting the recommended key is enough; the noise of the scan remains, its summits do not.
    file.write_text(text.replace("# cutoff: ", "cutoff: "))
    filtered = output("describe", "mine")
    assert "noise floor of " + rms in filtered and "recommended: `" not in filtered
    assert int(re.search(r"(\d+) summits?, ", filtered)[1]) < summits / 2
    # A filter of sixteen pixels leaves almost nothing of waves shorter than twice its length.
    file.write_text(re.sub(r"# cutoff: \S+ um", "cutoff: 2.5 um", text))
    assert "few grid cells" not in output("describe", "mine")


@pytest.mark.parametrize(("licence", "accepted"), [("CC-BY", False), ("CC0-1.0", True)])
def test_a_licence_that_no_deposit_can_have_is_reported_before_anything_is_computed(licence, accepted, project):
    Path("tiny.yaml").write_text(TINY.replace("CC0-1.0", licence))
    described = printed("describe", "tiny.yaml")
    assert ("published" not in described) == accepted
    assert accepted or f"cannot be published: tiny.yaml: license: '{licence}' " in described


def test_outside_a_clone_the_installed_workflow_is_used(empty_folder):
    shipped = {path.stem for path in (REPOSITORY / CAMPAIGNS).glob("*.yaml")}
    assert {*list_campaigns()} == {*shipped, "paper"}
    refused = output("run", status=2)
    assert "no config/config.yaml" in refused and "cmc_full, " in refused
    for name in ("paper", "smoke"):
        assert f"\n{name}: " in f"\n{output('describe', name)}"
    assert "smoke is the campaign of " in output("new", "smoke", status=2)
    assert [*empty_folder.iterdir()] == []
    output("new", "mine")
    file = empty_folder / CAMPAIGNS / "mine.yaml"
    schema = file.parent / file.read_text().splitlines()[0].partition("$schema=")[2]
    assert schema.read_bytes() == (REPOSITORY / "workflow/schemas/config.schema.json").read_bytes()
    assert Path("config/README.md").read_bytes() == (REPOSITORY / "config/README.md").read_bytes()
    assert "configuration: config/campaigns/mine.yaml" in output("describe", "mine")
    # Files of the folder precede installed ones.
    shutil.copyfile(file, "config/config.yaml")
    assert "configuration: config/config.yaml" in output("describe")


def write_results(campaign, results, paths, **attrs):
    """Write a run with the expected stamp, changed by `attrs`, to each path."""
    stamps = expected_stamps(campaign)
    for path in paths:
        (results / path).parent.mkdir(parents=True, exist_ok=True)
        write_dataset(small.run().assign_attrs(stamps[path] | attrs), results / path)


def states(campaign, results):
    return {item.path: item.state for item in plan(campaign, results)}


def test_the_states_of_runs_are_distinguished(tiny):
    campaign, results = tiny
    paths = done, changed, edited, failed = list(campaign_files(campaign).runs)
    write_results(campaign, results, [done])
    write_results(campaign, results, [changed], config_sha256="0" * 64)
    write_results(campaign, results, [edited], program_sha256="0" * 64)
    write_results(campaign, results, [failed], incomplete="the path ends early")
    found = states(campaign, results)
    assert [found[path] for path in paths] == [DONE, OUTDATED, OUTDATED, FAILED]
    assert found["surfaces/rough/seed1.nc"] == TO_DO
    described = printed("describe", "tiny.yaml", "--runs")
    assert "4 runs, 2 to do" in described and f"failed: {failed}: the path ends early" in described
    for reason in ("with other settings", "by another version of the program"):
        assert f"outdated: 1 file, because it was computed {reason}: will be computed again" in described


def test_runs_that_failed_or_ended_early_are_listed_with_their_reasons(tiny, monkeypatch):
    campaign, results = tiny
    first, second, third, _ = campaign_files(campaign).runs

    def compute(command, folder, log, progress, name):
        write_results(campaign, results, [first, second], beyond_model="the path ends at 0.2 of the area")
        write_results(campaign, results, [third], incomplete="no equilibrium")
        (results / "logs/verdict.log").write_text("Error: 1 of 9 checks failed\n")
        progress.count()
        return 1, False

    monkeypatch.setattr(sys.modules["icha.cli.run"], "run_process", compute)
    said = output("run", "tiny.yaml", "runs", status=1)
    ended, failed = (f"results/tiny/logs/{name}_runs.txt" for name in ("ended", "failed"))
    assert f"2 runs ended before the last target, as physics decides; all reasons: {ended}" in said
    assert f"\n    {first[5:-3]}: the path ends at 0.2 of the area (1 seed)\n" in said
    assert f"1 run failed; all reasons: {failed}\n    {third[5:-3]}: no equilibrium (1 seed)\n" in said
    assert "1 job failed:\n    1 of 9 checks failed\n        log: results/tiny/logs/verdict.log\n" in said
    assert Path(ended).read_text().splitlines() == [
        f"{run[5:-3]}: the path ends at 0.2 of the area" for run in (first, second)
    ]


def test_a_dataset_with_runs_that_are_no_longer_in_the_campaign_is_computed_again(tiny):
    campaign, results = tiny
    files = campaign_files(campaign)
    write_results(campaign, results, [*files.surfaces, *files.runs])
    for sha256, state in ((campaign_sha256(campaign), DONE), ("0" * 64, TO_DO)):
        write_dataset(campaign_tree(small.runs(), attrs={"config_sha256": sha256}), results / files.dataset)
        assert states(campaign, results)[files.dataset] == state
    assert states(campaign, results)[files.checks] == TO_DO


def test_results_of_another_file_of_the_same_name_are_not_changed(tiny, no_snakemake):
    Path("copy.yaml").write_text(TINY)
    record = tiny[1] / "belongs_to.txt"
    record.parent.mkdir(parents=True)
    record.write_text("tiny.yaml\n")
    for command, status in (("describe", 0), ("run", 2)):
        refused = printed(command, "copy.yaml", status=status)
        for words in ("results/tiny belongs to tiny.yaml", "copy.yaml has the same `name: tiny`"):
            assert words in refused
        assert "Give copy.yaml another `name:`" in refused and "remove results/tiny/belongs_to.txt" in refused
    assert "belongs to" not in output("describe", "tiny.yaml")
    assert "belongs to" not in output("run", "tiny.yaml", status=STARTED)
    output("run", "copy.yaml", "--dry-run", status=2)
    output("run", "copy.yaml", "--directory", "elsewhere", status=STARTED)
    assert record.read_text() == "tiny.yaml\n"
    record.unlink()
    output("run", "copy.yaml", status=STARTED)


def test_a_campaign_too_large_for_the_machine_causes_a_warning(tiny, no_snakemake, monkeypatch):
    monkeypatch.setattr("icha.planning.plan.memory_of_machine", lambda: 2**20)
    assert "Warning: jobs on 2 cores need about" in printed("run", "tiny.yaml", status=STARTED)
    described = output("describe", "tiny.yaml")
    assert "too small: jobs on 2 cores need about" in described and "this machine has 1.05 MB" in described
    # A cluster does not use the memory of this machine.
    assert "Warning" not in output("run", "tiny.yaml", "--profile", "slurm", status=STARTED)


def test_files_are_checked_and_shown(empty_folder):
    run = small.run()
    write_dataset(run, "run.nc")
    write_dataset(run.assign_attrs(incomplete="the path ends early"), "failed.nc")
    Path("bad.npy").write_bytes(b"")
    assert "run dataset, no problems" in output("check", "run.nc")
    assert "reduced pressure p*" in output("show", "run.nc")
    write_surface("surface.nc", small.surface(), name="rough", seed=1, spectrum=small.SPECTRUM)
    write_dataset(small.tree(), "campaign.nc")
    assert re.search(r"hurst +0.8 +Hurst exponent H", output("show", "surface.nc"))
    assert "slopes: 1 model, 1 surface, 1 seed, 2 rms_slope, 2 material" in output("show", "campaign.nc")
    assert "failed: the path ends early" in output("show", "failed.nc")
    assert "failed.nc: run dataset, 1 problem" in output("check", "run.nc", "failed.nc", status=1)
    checked = output("check", "bad.npy", "none.nc", "failed.nc", "run.nc", status=2)
    for words in ("bad.npy: the file is empty", "none.nc: no such file", "failed: the path", "run.nc: run dataset, no"):
        assert words in checked


# A figure and a finished run, which exist.
KEPT = {"0": "figures", "kept": "runs"}


@pytest.fixture
def clock(monkeypatch):
    clock = SimpleNamespace(now=0.0, time=lambda: clock.now)
    monkeypatch.setattr("icha.cli.progress.time", clock)
    return clock


@pytest.fixture
def progress(tmp_path, clock):
    """Progress of three runs and a figure of 10 s on two cores, and of a finished run."""
    items = [Item("runs", "study", f"{k}.nc", TO_DO if k else DONE, "", Cost(10.0, 0, 0)) for k in range(1, 4)]
    items += [Item(part, part, f"{name}.nc", DONE, "", Cost(10.0, 0, 0)) for name, part in KEPT.items()]
    for name in KEPT:
        (tmp_path / f"{name}.nc").touch()
    return Progress(items, tmp_path, 2)


def test_finished_files_are_counted(progress, tmp_path):
    assert progress.count() == (0, 3)
    (tmp_path / "1.nc").touch()
    (tmp_path / "0.nc").write_text("made again, because a figure has changed")
    for name in KEPT:  # Snakemake sets the times of all outputs of a job, also of a run that the job has kept
        os.utime(tmp_path / f"{name}.nc", (1, 1))
    assert progress.count() == (2, 4)


def test_time_left_follows_the_times_of_files(progress, tmp_path, clock):
    def left():
        return float(re.fullmatch(r"about (\S+) s left", progress.time_left())[1])

    start = left()
    assert start >= 3 * 10 / 2
    for k in (1, 2):
        clock.now += 30.0
        (tmp_path / f"{k}.nc").touch()
        progress.count()
    # A file of 10 s took 30 s on two cores: the last one is expected to take about as long.
    assert start / 3 < left() < 60
    before = left()
    clock.now += 5
    assert left() == pytest.approx(before - 5, abs=1)
    clock.now += 1000
    assert progress.time_left() == "longer than expected"
