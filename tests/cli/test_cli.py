"""The command line without Snakemake: what it says, what it writes, how it refuses."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import netCDF4
import numpy as np
import pytest
import small_campaign as small
import xarray as xr
import yaml
from conftest import REPOSITORY
from typer.testing import CliRunner

from icha.analysis.checks import check_campaign, write_checks
from icha.cli import app
from icha.cli.live import LiveView, Watch, last_line, reason_of
from icha.cli.project import campaigns
from icha.configuration.cases import run_cases, run_sha256
from icha.configuration.errors import ConfigurationError
from icha.configuration.load import load_configuration
from icha.datasets.campaign_file import write_campaign
from icha.datasets.files import read_dataset, write_dataset
from icha.datasets.surface_file import write_surface
from icha.figures.style import quantity
from icha.planning.belonging import belongs_to_another, claim
from icha.planning.plan import CHANGED, DAMAGED, DONE, FAILED, TO_DO, failed_runs, plan, time_on, total
from icha.references.theories import reference_dataset
from icha.support.checksums import damaged, write_checksum
from icha.surfaces.spectrum import SelfAffineSpectrum

HEAVY = ["scipy", "pandas", "xarray", "matplotlib", "netCDF4", "snakemake"]


def icha(*arguments):
    """Call the program in this process; whatever users do, there must be no traceback."""
    called = CliRunner().invoke(app, [str(each) for each in arguments])
    assert called.exception is None or isinstance(called.exception, SystemExit), called.exception
    return called


def told(*arguments, status=0):
    """What a command says, in one line; it ends with the status that is expected."""
    called = icha(*arguments)
    assert called.exit_code == status, called.output
    return " ".join(called.output.split())


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project without results, as the working directory."""
    for part in ("Snakefile", "config", "workflow/rules", "workflow/schemas", "profiles"):
        source, target = REPOSITORY / part, tmp_path / "project" / part
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(source, target) if source.is_dir() else shutil.copyfile(source, target)
    monkeypatch.chdir(tmp_path / "project")
    return tmp_path / "project"


@pytest.mark.parametrize("command", [[], *([each.callback.__name__] for each in app.registered_commands)])
def test_every_command_explains_itself_on_a_narrow_terminal(command):
    lines = CliRunner().invoke(app, [*command, "--help"], env={"COLUMNS": "80"}).output.splitlines()
    assert len(lines) > 6 and "Usage:" in "".join(lines) and [line for line in lines if len(line) > 80] == []


def test_mistakes_are_messages_and_status_2(project):
    """All of tests/data/messages.yaml."""
    Path("loop").symlink_to("loop")
    for each in yaml.safe_load((REPOSITORY / "tests/data/messages.yaml").read_text(encoding="utf-8")):
        assert each["says"] in told(*each["icha"], status=2), each
        assert not Path("run.nc").exists() and not Path("results").exists()
    assert told("--version").startswith("icha ") and icha("nonsense").exit_code == 2


def test_the_campaign_of_the_default_file_has_a_name_as_others_have(project):
    for command in (["describe", "paper"], ["describe"]):
        assert "configuration: config/config.yaml" in told(*command)
    assert "paper, " in icha("describe", "nonsense").output
    Path("config/config.yaml").write_bytes(b"name: \xff")
    assert icha("describe", "paper").exit_code == 2 and icha("describe", "smoke").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "without"),
    [
        (["--help"], ["numpy", "pydantic", "yaml", "rich", "pint", *HEAVY]),
        (["describe"], ["pint", *HEAVY]),
        (["show", "run.nc"], ["matplotlib", "scipy.special"]),
    ],
)
def test_commands_wait_for_no_library_that_they_do_not_use(project, arguments, without):
    write_dataset(small.run(), project / "run.nc")
    script = f"from icha.cli import app\nimport sys\napp({arguments}, standalone_mode=False)\n"
    script += f"print([name for name in {without} if name in sys.modules])\n"
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert said.splitlines()[-1] == "[]"


@pytest.mark.parametrize("options", [[], ["--pull-off"], ["--boundary-elements", "--pull-off"]])
def test_a_new_campaign_is_valid_as_it_is(project, options):
    written = icha("new", "mine", *options)
    assert written.exit_code == 0 and "config/campaigns/mine.yaml written" in written.output
    file = project / "config/campaigns/mine.yaml"
    configuration = load_configuration(file)
    campaign = configuration.campaign
    assert configuration.warnings == ()
    assert campaign.name == "mine" and ("pull" in campaign.studies) == ("--pull-off" in options)
    first = file.read_text().splitlines()[0]
    schema = file.parent / first.removeprefix("# yaml-language-server: $schema=")
    assert json.loads(schema.read_text())["$schema"]
    seconds = time_on(plan(campaign, project / "results/mine"), 2)
    assert seconds < 60, "a template is to be quick"


def test_the_examples_in_the_comments_of_a_new_campaign_are_valid_too(project):
    icha("new", "mine")
    file = project / "config/campaigns/mine.yaml"
    text = file.read_text()
    for start, lines in (("# vary:", 1), ("# cases:", 3), ("# defaults:", 2), ("# publication:", 4)):
        head, tail = text.split(start)
        block = (start + tail).splitlines()[:lines]
        (project / "config/campaigns/example.yaml").write_text(
            head + "\n".join(line.replace("# ", "", 1) for line in block) + "\n" + "\n".join(tail.splitlines()[lines:])
        )
        assert run_cases(load_configuration(project / "config/campaigns/example.yaml").campaign), start


def test_a_measured_file_is_asked_what_it_knows(project):
    lines = [f"{x * 1e-6:.7e} {y * 1e-6:.7e} {np.sin(x * y) * 1e-7:.7e}" for y in range(12) for x in range(12)]
    Path("scan 1.xyz").write_text("\n".join(lines))
    written = icha("new", "scan", "--measured", "scan 1.xyz")
    assert written.exit_code == 0
    section = yaml.safe_load(Path("config/campaigns/scan.yaml").read_text())["surfaces"]["scan_1"]
    assert section["kind"] == "measured" and section["path"] == "../../scan 1.xyz"
    text = Path("config/campaigns/scan.yaml").read_text()
    assert "12 x 12 points over 1.2e-05 x 1.2e-05 in its coordinates\n" in text and "It runs as it is" not in text
    assert section["lateral_unit"] is None and "to fill in: surfaces.scan_1.lateral_unit" in written.output
    # Coordinates without a unit, heights without one: nothing is made up.
    assert section["height_unit"] is None and "to fill in: surfaces.scan_1.height_unit" in written.output


def test_scans_that_cannot_be_used_get_no_campaign(project):
    for name, heights, reason in (
        ("small", rough_heights()[:6], "leaves 6 x 6 points"),
        ("flat", np.ones((20, 20)), "heights that are all the same"),
        ("profile", rough_heights()[:1].T, "is a line scan, one profile of 64 points"),
    ):
        np.savetxt(f"{name}.txt", heights)
        assert reason in told("new", "other", "--measured", f"{name}.txt", status=2)
    for name, text in (("words", "no heights in here\n"), ("empty", "\n \n")):
        Path(f"{name}.txt").write_text(text)
        assert f"{name}.txt" in told("new", "other", "--measured", f"{name}.txt", status=2)
    told("new", "other", "--measured", "none.xyz", status=2)
    told("new", "other", "--data", "z", status=2)
    assert not Path("config/campaigns/other.yaml").exists()


def test_one_of_several_datasets_of_a_measured_file_is_chosen_by_its_name(project):
    with h5py.File("my.h5", "w") as file:
        for name in ("first", "second"):
            file[name] = np.random.default_rng(1).normal(size=(16, 16))
            file[name].attrs["units"] = "nm"
    refused = told("new", "two", "--measured", "my.h5", status=2)
    assert "expected one of: first, second; say which by --data NAME" in refused
    assert icha("new", "two", "--measured", "my.h5", "--data", "third").exit_code == 2
    written = icha("new", "two", "--measured", "my.h5", "--data", "second")
    assert written.exit_code == 0 and "to fill in: surfaces.my.size" in written.output
    file = Path("config/campaigns/two.yaml")
    assert "It runs once the keys marked" in file.read_text() and "lateral_unit" not in file.read_text()
    file.write_text(file.read_text().replace("size: ", "size: 16 um").replace("boundary: ", "boundary: free"))
    assert load_configuration(file).campaign.surfaces["my"].data == "second"
    with netCDF4.Dataset("my.nc", "w") as file:
        file.createDimension("row", 64)
        file.createDimension("column", 64)
        for name in ("intensity", "z"):
            file.createVariable(name, "f8", ("row", "column"))[:] = rough_heights() * 1e9
            file[name].units = "nm"
    # One of a usual name is taken, said, and written into the configuration.
    assert "read as netcdf, `data: z` of several" in told("new", "mine", "--measured", "my.nc")
    assert yaml.safe_load(Path("config/campaigns/mine.yaml").read_text())["surfaces"]["my"]["data"] == "z"


def write_scan(file, heights, size):
    """As Gwyddion exports it: with size and units."""
    heading = ["# Channel: Z", f"# Width: {size[0]}", f"# Height: {size[1]}", "# Value units: m"]
    rows = [" ".join(f"{height:.8e}" for height in row) for row in heights]
    Path(file).write_text("\n".join([*heading, *rows]) + "\n")


def rough_heights(noise=0.0, grid=64, side=10e-6):
    heights = SelfAffineSpectrum(side, side, side / 8, 0.8, rms_slope=0.1).realise(grid, 1).heights
    return heights + noise * np.random.default_rng(1).normal(size=heights.shape)


def test_many_filled_points_and_edges_that_do_not_fit_are_told(project):
    heights = rough_heights()
    heights[20:45, 10:40] = np.nan
    write_scan("scan.txt", heights[:48, :48], ("10 um", "10 um"))
    written = told("new", "mine", "--measured", "scan.txt")
    assert "scan: read as matrix, 750 points had no height and were filled" in written
    assert "scan: 33 % of the points are filled" in written and "opposite edges" not in written
    assert "scan: warning: more than 5 % of the points are filled" in written
    file = Path("config/campaigns/mine.yaml")
    for boundary, warned in (("periodic", True), ("window", False)):
        file.write_text(re.sub("boundary: .*", f"boundary: {boundary}  # to fill in", file.read_text()))
        described = told("describe", "mine")
        assert "33 % of the points are filled" in described
        assert ("warning: `boundary: periodic`, but opposite edges differ" in described) == warned


@pytest.mark.parametrize("boundary", ["free", "window", "mirror", "periodic"])
def test_of_a_file_that_says_all_only_the_boundary_is_left_to_fill_in(project, boundary):
    write_scan("scan.txt", rough_heights(), ("10 um", "10 um"))
    written = icha("new", "mine", "--measured", "scan.txt")
    assert written.exit_code == 0, written.output
    assert written.output.count("to fill in: ") == 1 and "to settle" not in written.output
    file = Path("config/campaigns/mine.yaml")
    text = file.read_text()
    assert "It runs once the keys marked `to fill in` have values." in text
    assert "surfaces.scan.boundary: (empty) is not a choice; allowed: 'periodic'" in told("describe", "mine", status=2)
    # Each choice is explained there.
    for choice in ("free", "window", "mirror", "periodic"):
        assert any(line.strip().startswith(f"#   {choice}  ") for line in text.splitlines())
    file.write_text(text.replace("boundary: ", f"boundary: {boundary}"))
    assert load_configuration(file).warnings == ()


def test_what_describe_would_refuse_is_said_when_the_campaign_is_written(project):
    """A scan of 160 m, as a file with a wrong unit has it."""
    write_scan("far.txt", rough_heights() * 1e7, ("160 m", "160 m"))
    written = told("new", "far", "--measured", "far.txt")
    key = "surfaces.far.size"
    assert f"to settle: {key}: '160 m' is unusual" in written and f"`confirmed: [{key}]`" in written
    file = Path("config/campaigns/far.yaml")
    text = file.read_text().replace("boundary: ", "boundary: free")
    assert "It runs once `icha describe far` says nothing against it any more." in text
    file.write_text(text)
    assert f"{key}: '160 m' is unusual" in told("describe", "far", status=2)
    file.write_text(f"{text}\nconfirmed: [{key}]\n")
    (warning,) = load_configuration(file).warnings
    assert f"{key}: '160 m' is unusual, as the file has it, but confirmed" in warning
    file.write_text(text.replace("touches_first", "size: 160 um\n    touches_first"))
    with pytest.raises(ConfigurationError, match=r"surfaces\.far\.height_unit: 'rms slope .*' is unusual, as"):
        load_configuration(file)


def test_a_scan_is_looked_at_before_anything_is_computed(project):
    write_scan("scan.txt", rough_heights(noise=20e-9), ("10 um", "10 um"))
    written = icha("new", "mine", "--measured", "scan.txt", "--plot", "scan.png", "--boundary-elements")
    lines = written.output.splitlines()
    assert Path("scan.png").read_bytes()[:4] == b"\x89PNG"
    assert "scan: read as matrix, no point is missing" in lines
    assert any(re.match(r"scan: \d+ rows x \d+ columns of points; pixels of \S+ \S+ x ", line) for line in lines)
    noise = next(line for line in lines if "noise floor" in line)
    rms, wavelength = re.search(r"noise floor of (\S+) nm rms; waves shorter than (\S+) um are", noise).groups()
    assert float(rms) == pytest.approx(20, rel=0.1) and 0.5 < float(wavelength) < 2
    advice = next(line for line in lines if "advisable" in line)
    cutoff = re.search("`cutoff: ([^`]*)`", advice)[1]
    file = Path("config/campaigns/mine.yaml")
    assert f"# cutoff: {cutoff} " in file.read_text() and "# advised: " in file.read_text()
    text = file.read_text().replace("boundary: ", "boundary: window")
    file.write_text(text)
    described = icha("describe", "mine", "--plot", "mine.svg")
    assert described.exit_code == 0 and "<svg" in Path("mine.svg").read_text()
    assert f"advisable: `cutoff: {cutoff}`" in described.output
    summits = [int(re.search(r"(\d+) summits?, ", each.output)[1]) for each in (written, described)]
    few = r"scan: boundary elements have about (\S+) nodes for its shortest waves, .* recommended: 8, by a longer"
    assert 1 < float(re.search(few, described.output)[1]) < 8
    # What is advised is taken by taking the sign of a remark away; the noise is seen as before, its summits are not.
    file.write_text(text.replace("# cutoff: ", "cutoff: "))
    filtered = icha("describe", "mine")
    assert "noise floor of " + rms in filtered.output and "advisable" not in filtered.output
    assert int(re.search(r"(\d+) summits?, ", filtered.output)[1]) < min(summits) / 2
    # Shorter waves than twice its length have next to nothing left by a filter of sixteen pixels.
    file.write_text(re.sub(r"# cutoff: \S+ um", "cutoff: 2.5 um", text))
    assert "boundary elements have" not in icha("describe", "mine").output
    assert icha("describe", "smoke", "--plot", "none.png").exit_code == 2
    assert icha("describe", "mine", "--plot", "scan.bmp").exit_code == 2


def test_what_the_system_refuses_is_a_message_and_status_1(project):
    write_surface("surface.nc", small.surface(), name="rough", seed=1, spectrum=small.SPECTRUM)
    refused = icha("show", "surface.nc", "--plot", "/proc/none/p.png")
    assert refused.exit_code == 1 and "Error: /proc/none: No such file or directory" in refused.output
    shutil.rmtree("config/campaigns")
    Path("config/campaigns").write_text("a file where a folder is wanted")
    refused = icha("new", "mine")
    assert refused.exit_code == 1 and "config/campaigns: " in refused.output


def test_slips_are_refused_and_warned_of_once_they_are_confirmed(project):
    text = TINY.replace("25 MPa", "25 mPa", 1)
    Path("slip.yaml").write_text(text)
    key = "materials.bare.contact_modulus"
    for command in ("describe", "run"):
        refused = told(command, "slip.yaml", status=2)
        assert f"slip.yaml: {key}: '25 mPa' is unusual" in refused and f"`confirmed: [{key}]`" in refused
    Path("slip.yaml").write_text(f"{text}confirmed: [{key}]\n")
    assert f"Warning: slip.yaml: {key}: '25 mPa' is unusual, but confirmed" in told("describe", "slip.yaml")
    # All that is wrong is told at once.
    Path("wrong.yaml").write_text(TINY.replace("25 MPa", "25", 1).replace("grid: 32", "grid: 6"))
    for command in ("describe", "run"):
        refused = told(command, "wrong.yaml", status=2)
        assert f"wrong.yaml: {key}" in refused and "grid: 6" in refused


@pytest.mark.parametrize(
    ("licence", "said"),
    [
        ("CC-BY", "tiny.yaml: license: 'CC-BY' is "),
        ("cc0-1.0", "tiny.yaml: license: 'cc0-1.0' is "),
        ("CC0-1.0", None),
    ],
)
def test_a_licence_that_no_deposit_can_have_is_told_before_anything_is_computed(licence, said, project):
    Path("tiny.yaml").write_text(TINY.replace("CC0-1.0", licence))
    described = told("describe", "tiny.yaml")
    assert (f"not to be published: {said}" in described) if said else "published" not in described


def test_outside_of_a_clone_the_workflow_that_is_installed_is_used(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shipped = {path.stem for path in (REPOSITORY / "config/campaigns").glob("*.yaml")}
    assert {*campaigns()} == {*shipped, "paper"}
    nothing = icha("run")
    assert nothing.exit_code == 2 and "no config/config.yaml here; name a campaign: cmc_full, " in nothing.output
    assert icha("describe", "paper").output.startswith("paper: ")
    assert icha("describe", "smoke").output.startswith("smoke: ")
    taken = icha("new", "smoke")
    assert taken.exit_code == 2 and "smoke is the campaign of " in taken.output
    assert [*tmp_path.iterdir()] == []
    assert icha("new", "mine").exit_code == 0
    file = tmp_path / "config/campaigns/mine.yaml"
    schema = file.parent / file.read_text().splitlines()[0].partition("$schema=")[2]
    for copy, name in (
        (schema, "workflow/schemas/config.schema.json"),
        (tmp_path / "config/README.md", "config/README.md"),
    ):
        assert copy.read_bytes() == (REPOSITORY / name).read_bytes()
    assert "configuration: config/campaigns/mine.yaml" in icha("describe", "mine").output
    # What is in the folder goes before what was installed.
    shutil.copyfile(file, tmp_path / "config/config.yaml")
    assert "configuration: config/config.yaml" in icha("describe").output


@pytest.mark.parametrize("place", ["results", "results/smoke", ".snakemake"])
@pytest.mark.parametrize("link", [True, False])
def test_what_is_in_the_place_of_a_folder_is_named(tmp_path, monkeypatch, place, link):
    monkeypatch.chdir(tmp_path)
    obstacle = tmp_path / place
    obstacle.parent.mkdir(exist_ok=True)
    if link:
        obstacle.symlink_to("nowhere")
    else:
        obstacle.write_text("something else")
    refused = icha("run", "smoke")
    assert refused.exit_code == 2
    what = "a link to nowhere, which is not there, or not to be reached" if link else "a file, and no folder"
    assert f"Error: {place} is {what}: " in refused.output and "File exists" not in refused.output


TINY = """
name: tiny
title: Tiny
summary: For tests.
license: CC0-1.0
surfaces:
  rough: {kind: self_affine, period: 100 um, rolloff_wavelength: 40 um, short_wavelength: 14.3 um, hurst: 0.8, grid: 32}
materials:
  bare: {contact_modulus: 25 MPa, surface_energy: 0 mJ/m^2, interaction_range: 2 nm}
  soft: {contact_modulus: 25 MPa, surface_energy: 50 mJ/m^2, interaction_range: 2 nm}
studies:
  load:
    surfaces: [rough]
    seeds: [1, 2]
    rms_slopes: [1.0]
    materials: [bare, soft]
    targets: {reduced_pressures: [1.0e-3, 1.0e-2]}
"""


def test_what_is_there_is_told_from_what_is_to_do(project):
    Path("tiny.yaml").write_text(TINY)
    campaign, results = load_configuration("tiny.yaml").campaign, project / "results/tiny"
    done, changed, failed, missing = run_cases(campaign)
    reason = "the path ends early"
    for case, attrs in (
        (done, {"config_sha256": run_sha256(campaign, done)}),
        (changed, {"config_sha256": "0" * 64}),
        (failed, {"config_sha256": run_sha256(campaign, failed), "incomplete": reason}),
    ):
        (results / f"runs/{case.path}.nc").parent.mkdir(parents=True, exist_ok=True)
        write_dataset(small.run().assign_attrs(attrs), results / f"runs/{case.path}.nc")
    states = {item.path: item.state for item in plan(campaign, results)}
    for case, state in ((done, DONE), (changed, CHANGED), (failed, FAILED), (missing, TO_DO)):
        assert states[f"runs/{case.path}.nc"] == state
    assert failed_runs(campaign, results) == {failed.path: reason}
    sums = total(item for item in plan(campaign, results) if item.is_run)
    assert (sums.count, sums.done, sums.failed, sums.to_do) == (4, 1, 1, 2)
    described = told("describe", "tiny.yaml", "--runs")
    assert "4 runs, 2 to do" in described and "1 run there, but with other settings" in described
    assert f"failed: runs/{failed.path}.nc: {reason}" in described


def test_results_of_another_file_of_the_same_name_are_left_alone(project, monkeypatch):
    def begun(*_):
        raise SystemExit(BEGUN)

    monkeypatch.setattr(sys.modules["icha.cli.run"], "_follow", begun)
    for file in ("tiny.yaml", "copy.yaml"):
        Path(file).write_text(TINY)
    record = project / "results/tiny/belongs_to.txt"
    record.parent.mkdir(parents=True)
    record.write_text("tiny.yaml\n")
    message = "results/tiny belongs to tiny.yaml, and copy.yaml has the same `name: tiny`: its results would replace"
    ways_out = ("Give copy.yaml another `name:`;", "remove results/tiny/belongs_to.txt")
    for command, status in (("describe", 0), ("run", 2)):
        refused = told(command, "copy.yaml", status=status)
        assert message in refused and all(way in refused for way in ways_out)
        assert "belongs to" not in icha(command, "tiny.yaml").output
    assert icha("run", "copy.yaml", "--dry-run").exit_code == 2
    assert icha("run", "copy.yaml", "--directory", "elsewhere").exit_code == BEGUN
    assert record.read_text() == "tiny.yaml\n"
    record.unlink()
    assert icha("run", "copy.yaml").exit_code == BEGUN


def test_the_kept_configuration_belongs_to_its_results(project):
    results = project / "results/tiny"
    results.mkdir(parents=True)
    (results / "config.used.yaml").write_text(TINY)
    claim(results, results / "config.used.yaml", project)
    assert not (results / "belongs_to.txt").exists()
    claim(results, project / "tiny.yaml", project)
    claim(results, project / "copy.yaml", project)
    assert (results / "belongs_to.txt").read_text() == "tiny.yaml\n"
    assert belongs_to_another(results, "tiny", results / "config.used.yaml", project) is None
    assert belongs_to_another(results, "tiny", project / "config/../tiny.yaml", project) is None


def test_what_the_models_were_verified_for_is_told_before_a_run(project, small_machine):
    Path("tiny.yaml").write_text(TINY)
    for said in (icha("describe", "tiny.yaml").output, icha("run", "tiny.yaml", "--anyway").output):
        assert all(f"{word}: " in said for word in ("models", "jump-in", "adhesion", "accuracy"))


def test_checks_and_validity_are_told_apart_after_a_run(project, capsys):
    Path("tiny.yaml").write_text(TINY)
    campaign, results = load_configuration("tiny.yaml").campaign, project / "results/tiny"
    write_campaign(small.runs(), results / "dataset/tiny.nc")
    write_checks(check_campaign(small.tree()), results / "checks.json")
    sys.modules["icha.cli.run"]._tell_what_it_is_worth(campaign, results)
    checks, question, models, energy, jumps, surfaces, accuracy = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"checks:  all of \d+ passed: the equations are solved", checks)
    assert question == "Whether the models hold here is another question:"
    assert models == "models:   asperities in slopes, single" and jumps.endswith("; all cases inside")
    assert energy.startswith("adhesion: U_full/dgamma is ") and surfaces.startswith("surfaces: rough: anisotropy ")
    assert accuracy.startswith("accuracy: nothing is known of the accuracy here (rough: ")


def test_files_that_were_cut_off_are_damaged_and_to_do_again(project):
    Path("tiny.yaml").write_text(TINY)
    campaign, results = load_configuration("tiny.yaml").campaign, project / "results/tiny"
    whole, cut, *_ = (f"runs/{case.path}.nc" for case in run_cases(campaign))
    sha256 = run_sha256(campaign, run_cases(campaign)[0])
    empty = ["surfaces/rough/seed2.nc", "references/rough.nc", "dataset/tiny.nc", "aggregated/tiny.nc"]
    for path in (whole, cut, *empty):
        (results / path).parent.mkdir(parents=True, exist_ok=True)
        write_dataset(small.run().assign_attrs(config_sha256=sha256), results / path)
        write_checksum(results, path)
    assert damaged(results) == []
    (results / cut).write_bytes((results / cut).read_bytes()[:-100])
    for path in empty:
        (results / path).write_bytes(b"")
    assert set(damaged(results)) == {cut, *empty}
    states = {item.path: item.state for item in plan(campaign, results)}
    assert states[whole] == DONE and states[cut] == DAMAGED and states["surfaces/rough/seed2.nc"] == DAMAGED
    sums = total(item for item in plan(campaign, results) if item.is_run)
    assert (sums.done, sums.to_do) == (1, 3)
    described = told("describe", "tiny.yaml")
    assert "other settings" not in described
    for path in (cut, *empty):
        assert f"damaged: {path}: to do again" in described


BEGUN = 77


@pytest.fixture
def small_machine(monkeypatch):
    monkeypatch.setattr("icha.planning.needs.memory_of_machine", lambda: 2**20)

    def begun(*_):
        raise SystemExit(BEGUN)

    # The package's own name `run` is the command.
    monkeypatch.setattr(sys.modules["icha.cli.run"], "_follow", begun)


def test_what_exceeds_the_machine_is_refused_where_nobody_can_be_asked(project, small_machine):
    Path("tiny.yaml").write_text(TINY)
    refused = told("run", "tiny.yaml", status=2)
    assert "MB of memory are needed on 2 cores, and this machine has 1.05 MB" in refused and "--anyway" in refused
    assert "not enough: about" in icha("describe", "tiny.yaml").output
    assert icha("run", "tiny.yaml", "all", "--", "--forceall", "--resources", "mem_mb=60000").exit_code == 2
    assert icha("run", "tiny.yaml", "results/tiny/report.html").exit_code == BEGUN
    assert icha("run", "tiny.yaml", "--anyway").exit_code == BEGUN
    # On a cluster the memory of this machine is no matter.
    assert icha("run", "tiny.yaml", "--profile", "slurm").exit_code == BEGUN
    assert icha("run", "tiny.yaml", "--profile", "default").exit_code == 2


def test_a_single_run_that_exceeds_the_machine_is_refused_with_its_size(project, monkeypatch):
    monkeypatch.setattr("icha.planning.needs.memory_of_machine", lambda: 16e9)
    refused = told("simulate", "run.nc", "--grid", "32768", status=2)
    assert "--grid 32768" in refused and "this machine has 16 GB" in refused
    told("simulate", "run.nc", "--grid", "16384", "--model", "boundary_elements", status=2)

    def fail(*_, **__):
        raise MemoryError("Unable to allocate 80 GiB for an array")

    monkeypatch.setattr("icha.simulation.simulate", fail)
    assert "not enough memory: Unable to allocate 80 GiB" in told("simulate", "run.nc", "--grid", "32", status=1)


def test_what_exceeds_the_machine_is_begun_if_that_is_said(project, small_machine, monkeypatch):
    Path("tiny.yaml").write_text(TINY)
    monkeypatch.setattr(sys.modules["icha.cli.run"], "_at_a_terminal", lambda: True)
    for answer, status in (("y\n", BEGUN), ("n\n", 2), ("", 1)):
        asked = CliRunner().invoke(app, ["run", "tiny.yaml"], input=answer)
        assert "MB of memory are needed" in asked.output and "Begin all the same?" in asked.output
        assert asked.exit_code == status


def test_one_run_without_the_workflow(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = ["--grid", "32", "--rolloff", "50 um", "--short", "20 um"]
    made = icha("simulate", "run.nc", *options, "--pressures", "1e-3,1e-2")
    assert made.exit_code == 0 and "2 steps" in made.output
    checked = icha("check", "run.nc")
    assert checked.exit_code == 0 and "run dataset, all is well" in checked.output
    shown = icha("show", "run.nc", "--plot", "run.png")
    assert shown.exit_code == 0 and "1.0000e-02" in shown.output
    assert Path("run.png").read_bytes().startswith(b"\x89PNG")
    refused = icha("simulate", "run.nc", *options)
    assert refused.exit_code == 2 and "--force replaces it" in refused.output
    sticky = icha("simulate", "sticky.nc", *options, "--modulus", "10 kPa", "--energy", "0.5 J/m^2")
    assert sticky.exit_code == 1 and "failed:" in sticky.output
    flawed = icha("check", "run.nc", "sticky.nc")
    assert flawed.exit_code == 1 and "sticky.nc: run dataset, 1 flaw" in flawed.output
    assert "the run failed: the path ends" in flawed.output
    # Every file is checked, whatever the others are.
    Path("bad.npy").write_bytes(b"")
    mixed = icha("check", "bad.npy", "none.nc", "sticky.nc", "run.nc")
    assert mixed.exit_code == 2
    for words in (
        "bad.npy: the file is empty",
        "none.nc: no such file",
        "sticky.nc: run",
        "run.nc: run dataset, all is",
    ):
        assert words in mixed.output


def test_both_separations_of_a_free_square_are_shown_and_told_apart(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = small.run()
    free = run.assign(boundary=run["boundary"].copy(data="free"), mean_gap=run["mean_separation"] + run["rms_height"])
    write_dataset(free.assign(mean_gap=free["mean_gap"].assign_attrs(run["mean_gap"].attrs)), "free.nc")
    shown = icha("show", "free.nc").output
    assert "gap: mean gap between the surfaces" in shown
    ends = {line.split()[0]: line.split()[-1] for line in shown.splitlines() if "/h_rms " in line and " to " in line}
    assert float(ends["gap/h_rms"]) == pytest.approx(float(ends["u/h_rms"]) + 1, abs=0.01)


def test_surfaces_and_campaigns_are_shown(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_surface("surface.nc", small.surface(), name="rough", seed=1, spectrum=small.SPECTRUM)
    write_dataset(small.tree(), "campaign.nc")
    shown = icha("show", "surface.nc", "--plot", "surface.pdf")
    assert shown.exit_code == 0 and "Hurst exponent: 0.8" in shown.output
    shown = icha("show", "campaign.nc", "--plot", "campaign.svg")
    assert shown.exit_code == 0 and "slopes: 1 model, 1 surface, 1 seed, 2 rms_slope, 2 material" in shown.output
    assert Path("surface.pdf").stat().st_size and Path("campaign.svg").stat().st_size
    one = icha("show", "campaign.nc", "--study", "single")
    assert "single: " in one.output and "slopes: " not in one.output
    refused = icha("show", "campaign.nc", "--study", "none")
    assert refused.exit_code == 2 and "there are: slopes, single" in refused.output
    # A study without snapshots is drawn, too.
    whole = small.tree()
    without = {name: study.to_dataset().isel(snapshot=[], spot=[]) for name, study in whole.children.items()}
    write_dataset(xr.DataTree.from_dict({"/": whole.to_dataset(), **without}), "without.nc")
    told("show", "without.nc", "--plot", "without.png")


def test_what_was_measured_is_shown_in_its_own_units(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_surface("surface.nc", small.surface(), name="rough", seed=1)
    surface = read_dataset("surface.nc")
    write_dataset(surface.assign(measured_rms_slope=surface["rms_slope"] * 1e-3), "scan.nc")
    height = quantity(1e-3 * float(surface["rms_height"]), "m")
    assert f"as measured: rms height {height}, rms slope 0.001" in told("show", "scan.nc")
    assert ", as stored; a line" in told("show", "surface.nc")


def test_results_without_checks_are_called_what_they_are(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_dataset(reference_dataset(small.SPECTRUM), "theories.nc")
    assert "theories.nc: theories and published points" in told("check", "theories.nc")
    assert "theories and published points" in told("show", "theories.nc", status=2)
    Path("paper-1.0.zip").write_text("text")
    assert told("check", "paper-1.0.zip") == "paper-1.0.zip: deposit; `icha verify` checks it"
    Path("deposit").mkdir()
    assert "deposit: is a folder; allowed: a file" in told("check", "deposit", status=2)


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def started(number, rule="run", **more):
    return {"event": "job_info", "jobid": number, "rule_name": rule, "rule_msg": f"Sweep {number}"} | {
        "output": [f"results/tiny/runs/{number}.nc"],
        "log": more.get("log", []),
    }


@pytest.fixture
def watch():
    clock = Clock()
    watch = Watch({f"results/tiny/runs/{k}.nc": 10.0 for k in range(4)}, clock)
    watch.take({"event": "resources_info", "cores": 2})
    watch.take({"event": "run_info", "stats": {"run": 4, "all": 1, "total": 5}})
    return watch


def test_events_are_counted_by_rule(watch):
    assert watch.job_count == 4  # not `all`, which computes nothing
    for number in (0, 1, 2):
        watch.take(started(number))
    watch.take(started(9, rule="all"))
    assert watch.take({"event": "job_finished", "job_id": 0}).title == "Sweep 0"
    assert watch.take({"event": "job_error", "jobid": 1}).rule == "run"
    assert watch.counts() == [("run", 1, 1, 1, 4)]
    assert watch.take({"event": "job_finished", "job_id": 9}) is None


def test_time_left_follows_what_jobs_take(watch):
    assert watch.seconds_left() == pytest.approx(4 * 10 / 2)
    watch.take(started(0))
    watch.take(started(1))
    watch.clock.now = 30.0
    watch.take({"event": "job_finished", "job_id": 0})
    watch.take({"event": "job_finished", "job_id": 1})
    # Two jobs of 10 s took 30 s each: about three times as long is expected of the other two.
    assert 2 * 10 * 2 / 2 < watch.seconds_left() <= 2 * 10 * 3 / 2
    watch.take(started(2))
    before = watch.seconds_left()
    watch.clock.now += 5
    assert watch.seconds_left() == pytest.approx(before - 5 / 2)


def test_the_live_view_shows_jobs_and_what_they_say(watch, tmp_path):
    from rich.console import Console

    (tmp_path / "0.log").write_text("stop 1 of 2\nstop 2 of 2: A/A0 3e-2\nhalf a li")
    watch.take(started(0, log=["0.log (check log file(s) for error details)"]))
    watch.clock.now = 65
    console = Console(width=100, record=True, force_terminal=True, color_system=None)
    view = LiveView(watch, "tiny", tmp_path, console)
    console.print(view._draw())
    text = console.export_text()
    assert "tiny: 0 of 4 jobs" in text and "1.1 min  Sweep 0" in text and "stop 2 of 2: A/A0 3e-2" in text
    assert "half a li" not in text


def test_reasons_are_taken_from_logs(watch, tmp_path):
    watch.take(started(0, log=["0.log"]))
    job = watch.take({"event": "job_error", "jobid": 0})
    assert reason_of(job, tmp_path) == [] and last_line(job, tmp_path) == ""
    (tmp_path / "0.log").write_text("stop 1 of 2\nError: 2 checks failed\nthis one\nthat one\n")
    assert reason_of(job, tmp_path) == ["2 checks failed", "this one", "that one"]
