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
from icha.analysis.common_loads import compare_campaign
from icha.cli import app
from icha.cli.live import LiveView, Watch, last_line, reason_of
from icha.cli.project import campaigns
from icha.cli.show import sparkline
from icha.configuration.cases import run_cases, run_sha256
from icha.configuration.errors import ConfigurationError
from icha.configuration.load import load_configuration
from icha.datasets.campaign_file import write_campaign
from icha.datasets.files import read_dataset, write_dataset
from icha.datasets.surface_file import write_surface
from icha.figures.style import quantity
from icha.planning.belonging import belongs_to_another, claim
from icha.planning.costs import WORKFLOW
from icha.planning.plan import CHANGED, DAMAGED, DONE, FAILED, TO_DO, failed_runs, plan, start_up, time_on, total
from icha.references.theories import reference_dataset
from icha.support.checksums import damaged, write_checksum
from icha.surfaces.spectrum import SelfAffineSpectrum

HEAVY = ["scipy", "pandas", "xarray", "matplotlib", "netCDF4", "snakemake"]


def icha(*arguments):
    """Call the program in this process; whatever users do, there must be no traceback."""
    called = CliRunner().invoke(app, [str(each) for each in arguments])
    assert called.exception is None or isinstance(called.exception, SystemExit), called.exception
    return called


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project without results, as the working directory."""
    for part in ("Snakefile", "config", "workflow/rules", "workflow/schemas", "profiles"):
        source, target = REPOSITORY / part, tmp_path / "project" / part
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(source, target) if source.is_dir() else shutil.copyfile(source, target)
    monkeypatch.chdir(tmp_path / "project")
    return tmp_path / "project"


def test_every_command_explains_itself():
    overview = icha("--help")
    assert overview.exit_code == 0
    for command in ("new", "describe", "run", "simulate", "show", "check"):
        assert command in overview.output
        told = icha(command, "--help")
        assert told.exit_code == 0 and "Usage:" in told.output and len(told.output.splitlines()) > 6
    assert icha("--version").output.startswith("icha ")
    assert icha("nonsense").exit_code == 2


def test_help_fits_a_narrow_terminal():
    commands = [each.name or each.callback.__name__ for each in app.registered_commands]
    for command in ([], *([name] for name in commands)):
        told = CliRunner().invoke(app, [*command, "--help"], env={"COLUMNS": "80"}).output
        assert len(told.splitlines()) > 6
        assert [line for line in told.splitlines() if len(line) > 80] == [], command


def test_the_campaign_of_the_default_file_has_a_name_as_others_have(project):
    for command in (["describe", "paper"], ["describe"]):
        told = icha(*command)
        assert told.exit_code == 0 and "configuration: config/config.yaml" in told.output
    assert "paper, " in icha("describe", "nonsense").output
    Path("config/config.yaml").write_bytes(b"name: \xff")
    assert icha("describe", "paper").exit_code == 2 and icha("describe", "smoke").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "without"),
    [
        (["--help"], ["numpy", "pydantic", "yaml", "rich", "pint", *HEAVY]),
        (["describe"], ["pint", *HEAVY]),
        (["show", "run.nc"], ["matplotlib", "scipy.special"]),
        (["check", "run.nc"], ["matplotlib", "scipy.special"]),
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
    assert icha("new", "other", "--measured", "none.xyz").exit_code == 2
    Path("words.txt").write_text("no heights in here\n")
    refused = icha("new", "other", "--measured", "words.txt")
    assert refused.exit_code == 2 and "words.txt" in refused.output
    Path("empty.txt").write_text("\n \n")
    refused = icha("new", "other", "--measured", "empty.txt")
    assert refused.exit_code == 2 and "empty.txt: the file is empty" in refused.output
    assert icha("new", "other", "--data", "z").exit_code == 2
    assert not Path("config/campaigns/other.yaml").exists()


def test_one_of_several_datasets_of_a_measured_file_is_chosen_by_its_name(project):
    with h5py.File("my.h5", "w") as file:
        for name in ("first", "second"):
            file[name] = np.random.default_rng(1).normal(size=(16, 16))
            file[name].attrs["units"] = "nm"
    refused = icha("new", "two", "--measured", "my.h5")
    told = " ".join(refused.output.split())
    assert refused.exit_code == 2 and "allowed: first, second; say which by --data NAME" in told
    assert icha("new", "two", "--measured", "my.h5", "--data", "third").exit_code == 2
    written = icha("new", "two", "--measured", "my.h5", "--data", "second")
    assert written.exit_code == 0 and "to fill in: surfaces.my.size" in written.output
    file = Path("config/campaigns/two.yaml")
    assert "It runs once the keys marked" in file.read_text() and "lateral_unit" not in file.read_text()
    file.write_text(file.read_text().replace("size: ", "size: 16 um").replace("boundary: ", "boundary: free"))
    assert load_configuration(file).campaign.surfaces["my"].data == "second"


def write_scan(file, heights, size):
    """As Gwyddion exports it: with size and units."""
    heading = ["# Channel: Z", f"# Width: {size[0]}", f"# Height: {size[1]}", "# Value units: m"]
    rows = [" ".join(f"{height:.8e}" for height in row) for row in heights]
    Path(file).write_text("\n".join([*heading, *rows]) + "\n")


def rough_heights(noise=0.0, grid=64, side=10e-6):
    heights = SelfAffineSpectrum(side, side, side / 8, 0.8, rms_slope=0.1).realise(grid, 1).heights
    return heights + noise * np.random.default_rng(1).normal(size=heights.shape)


def test_the_array_that_is_taken_is_written_into_the_configuration(project):
    with netCDF4.Dataset("my.nc", "w") as file:
        file.createDimension("row", 64)
        file.createDimension("column", 64)
        for name in ("intensity", "z"):
            file.createVariable(name, "f8", ("row", "column"))[:] = rough_heights() * 1e9
            file[name].units = "nm"
    written = icha("new", "mine", "--measured", "my.nc")
    assert written.exit_code == 0 and "read as netcdf, `data: z` of several" in " ".join(written.output.split())
    assert yaml.safe_load(Path("config/campaigns/mine.yaml").read_text())["surfaces"]["my"]["data"] == "z"


def test_many_filled_points_and_edges_that_do_not_fit_are_told(project):
    heights = rough_heights()
    heights[20:45, 10:40] = np.nan
    write_scan("scan.txt", heights[:48, :48], ("10 um", "10 um"))
    written = icha("new", "mine", "--measured", "scan.txt")
    told = " ".join(written.output.split())
    assert written.exit_code == 0 and "scan: 33 % of the points are filled" in told
    assert "scan: warning: more than 5 % of the points are filled" in told and "opposite edges" not in told
    file = Path("config/campaigns/mine.yaml")
    for boundary, warned in (("periodic", True), ("window", False)):
        file.write_text(re.sub("boundary: .*", f"boundary: {boundary}  # to fill in", file.read_text()))
        told = " ".join(icha("describe", "mine").output.split())
        assert "33 % of the points are filled" in told
        assert ("warning: `boundary: periodic`, but opposite edges differ" in told) == warned


@pytest.mark.parametrize("boundary", ["free", "window", "mirror", "periodic"])
def test_of_a_file_that_says_all_only_the_boundary_is_left_to_fill_in(project, boundary):
    write_scan("scan.txt", rough_heights(), ("10 um", "10 um"))
    written = icha("new", "mine", "--measured", "scan.txt")
    assert written.exit_code == 0, written.output
    assert written.output.count("to fill in: ") == 1 and "to settle" not in written.output
    file = Path("config/campaigns/mine.yaml")
    text = file.read_text()
    assert "It runs once the keys marked `to fill in` have values." in text
    told = icha("describe", "mine")
    assert told.exit_code == 2
    assert "surfaces.scan.boundary: (empty) is not a choice; allowed: 'periodic', 'window', 'mirror' or 'free'" in (
        " ".join(told.output.split())
    )
    # Each choice is explained there.
    for choice in ("free", "window", "mirror", "periodic"):
        assert any(line.strip().startswith(f"#   {choice}  ") for line in text.splitlines())
    file.write_text(text.replace("boundary: ", f"boundary: {boundary}"))
    assert load_configuration(file).warnings == ()


def test_what_describe_would_refuse_is_said_when_the_campaign_is_written(project):
    """A scan of 160 m, as a file with a wrong unit has it."""
    write_scan("far.txt", rough_heights() * 1e7, ("160 m", "160 m"))
    written = icha("new", "far", "--measured", "far.txt")
    told = " ".join(written.output.split())
    assert written.exit_code == 0
    key = "surfaces.far.size"
    assert f"to settle: {key}: '160 m' is unusual, as the file has it; usual: 1 nm to 1 m" in told
    assert f"allowed: another value, or, if it is meant, this one with `confirmed: [{key}]` at the top level" in told
    file = Path("config/campaigns/far.yaml")
    text = file.read_text().replace("boundary: ", "boundary: free")
    assert "It runs once `icha describe far` says nothing against it any more." in text
    file.write_text(text)
    refused = icha("describe", "far")
    assert refused.exit_code == 2 and f"{key}: '160 m' is unusual" in " ".join(refused.output.split())
    file.write_text(f"{text}\nconfirmed: [{key}]\n")
    (warning,) = load_configuration(file).warnings
    assert f"{key}: '160 m' is unusual, as the file has it, but confirmed" in warning
    file.write_text(text.replace("touches_first", "size: 160 um\n    touches_first"))
    with pytest.raises(ConfigurationError, match=r"surfaces\.far\.height_unit: 'rms slope .*' is unusual, as"):
        load_configuration(file)


def test_scans_that_cannot_be_used_get_no_campaign(project):
    for name, heights, reason in (
        ("small", rough_heights()[:6], "leaves 6 x 6 points"),
        ("flat", np.ones((20, 20)), "heights that are all the same"),
        ("profile", rough_heights()[:1].T, "is a line scan, one profile of 64 points"),
    ):
        np.savetxt(f"{name}.txt", heights)
        refused = icha("new", name, "--measured", f"{name}.txt")
        assert refused.exit_code == 2 and reason in " ".join(refused.output.split())
        assert not Path(f"config/campaigns/{name}.yaml").exists()


def test_points_that_were_filled_are_told(project):
    heights = rough_heights(noise=0)
    heights[3:5, 7] = np.nan
    write_scan("scan.txt", heights, ("10 um", "10 um"))
    assert (
        "scan: read as matrix, 2 points had no height and were filled"
        in icha("new", "m", "--measured", "scan.txt").output
    )


def test_a_scan_is_looked_at_before_anything_is_computed(project):
    write_scan("scan.txt", rough_heights(noise=20e-9), ("10 um", "10 um"))
    written = icha("new", "mine", "--measured", "scan.txt", "--plot", "scan.png", "--boundary-elements")
    lines = written.output.splitlines()
    assert Path("scan.png").read_bytes()[:4] == b"\x89PNG"
    assert "scan: read as matrix, no point is missing" in lines
    noise = next(line for line in lines if "noise floor" in line)
    rms, wavelength = re.search(r"noise floor of (\S+) nm rms; waves shorter than (\S+) um are", noise).groups()
    assert float(rms) == pytest.approx(20, rel=0.1) and 0.5 < float(wavelength) < 2
    advice = next(line for line in lines if "advisable" in line)
    cutoff = re.search("`cutoff: ([^`]*)`", advice)[1]
    file = Path("config/campaigns/mine.yaml")
    assert f"# cutoff: {cutoff} " in file.read_text() and "# advised: " in file.read_text()
    text = file.read_text().replace("boundary: ", "boundary: window")
    file.write_text(text)
    told = icha("describe", "mine", "--plot", "mine.svg")
    assert (
        told.exit_code == 0
        and f"advisable: `cutoff: {cutoff}`" in told.output
        and "<svg" in Path("mine.svg").read_text()
    )
    summits = [int(re.search(r"(\d+) summits?, ", each.output)[1]) for each in (written, told)]
    few = r"scan: boundary elements have about (\S+) nodes for its shortest waves, .* recommended: 8, by a longer"
    assert 1 < float(re.search(few, told.output)[1]) < 8
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


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["new", "Mine"], "'Mine' is not a name; allowed: lower-case letters"),
        (["new", "paper"], "paper is the campaign of config/config.yaml; choose another name"),
        (["describe", "config"], "config: is a folder; allowed: a YAML file, or the name of a campaign"),
        (["new", "smoke"], "config/campaigns/smoke.yaml is there already"),
        (["describe", "nonsense"], "nonsense: no such file and no campaign of that name; there are: cmc_full,"),
        (["run", "nonsense"], "nonsense: no such file"),
        (["run", "smoke", "--cores", "some"], "'some' is neither a number of cores"),
        (["describe", "smoke", "--cores", "9" * 400], "is neither a number of cores"),
        (["describe", "smoke", "--directory", "loop"], "is a link that leads to itself; allowed: a folder"),
        (["run", "smoke", "--profile", "none"], "--profile none: no folder with a config.yaml; there are: default"),
        (["simulate", "none/run.nc"], "none/run.nc: no such folder as none"),
        (["simulate", "run.nc", "--modulus", "25"], "'25': the unit is missing; allowed: such as '25 MPa'"),
        (
            ["simulate", "run.nc", "--modulus", "2 mPa"],
            "--modulus: 0.002 Pa is unusual; usual: 1 kPa to 2000 GPa (from",
        ),
        (
            ["simulate", "run.nc", "--energy", "5 J/m^2"],
            "allowed: another value, or, if it is meant, this one with --co",
        ),
        (["simulate", "run.nc", "--rms-slope", "1e3"], "--rms-slope: 1000.0 is unusual; usual: 1e-4 to 5"),
        (["simulate", "run.nc", "--short", "0 m", "--confirmed"], "--short: 0.0 must lie in [1e-24, 1e9] (in m)"),
        (["simulate", "\udcff.nc", "--grid", "16"], "holds bytes that are no UTF-8; allowed: text"),
        (["simulate", "run.nc", "--surface", "/dev/zero"], "/dev/zero: is a device; allowed: a file"),
        (["check", "/dev/zero"], "/dev/zero: is a device; allowed: a file"),
        (["new", "scan", "--measured", "/dev/zero"], "/dev/zero: is a device; allowed: a file that holds"),
        (["describe", "/dev/zero"], "/dev/zero: is a device; allowed: a YAML file, or"),
        (["simulate", "run.nc", "--period", "1 kg"], "is not a unit of length"),
        (["simulate", "run.nc", "--hurst", "2"], "hurst: 2.0 must lie in (0, 1]"),
        (["simulate", "run.nc", "--grid", "1000000"], "grid: 1000000 must be at most 32768"),
        (
            ["simulate", "run.nc", "--short", "1e-15 m", "--confirmed"],
            "needs about 1600000000000 TB of memory, and this machine has",
        ),
        (["simulate", "run.nc", "--grid", "32", "--rolloff", "20 um"], "--short 25 um, which is 8 grid cells if left"),
        (["simulate", "run.nc", "--short", "30 um", "--rolloff", "20 um"], "give a smaller --short or a longer --roll"),
        (["simulate", "run.nc", "--pressures", "a,b"], "'a,b' is no list of numbers"),
        (["simulate", "run.nc", "--pressures", "0.1,0.01"], "strictly increasing"),
        (["simulate", "run.nc", "--pressures", "0.1", "--areas", "0.1"], "exactly one must be given"),
        (["simulate", "run.nc", "--surface", "none.nc"], "none.nc: no such file"),
        (["simulate", "run.nc", "--surface", "none.npy"], "none.npy: no such file"),
        (["show", "Snakefile"], "Snakefile: not a readable netCDF file"),
        (["show", "Snakefile", "--plot", "a.txt"], "--plot a.txt: ends in '.txt'; allowed: .png"),
        (["check", "none.nc"], "none.nc: no such file"),
        (["show", "config"], "config: is a folder; allowed: a file"),
        (["new", "scan", "--measured", "config"], "--measured config: is a folder; allowed: a file that holds a topo"),
        (["simulate", "run.nc", "--surface", "config"], "config: is a folder; allowed: a file"),
        (["simulate", "config", "--force"], "config: is a folder; allowed: a file"),
    ],
)
def test_mistakes_are_messages_and_status_2(project, arguments, message):
    Path("loop").symlink_to("loop")
    refused = icha(*arguments)
    assert refused.exit_code == 2
    assert message in " ".join(refused.output.split())
    assert not Path("run.nc").exists() and not Path("results").exists()


def test_what_the_system_refuses_is_a_message_and_status_1(project):
    write_surface("surface.nc", small.surface(), name="rough", seed=1, spectrum=small.SPECTRUM)
    refused = icha("show", "surface.nc", "--plot", "/proc/none/p.png")
    assert refused.exit_code == 1 and "Error: /proc/none: No such file or directory" in refused.output
    shutil.rmtree("config/campaigns")
    Path("config/campaigns").write_text("a file where a folder is wanted")
    refused = icha("new", "mine")
    assert refused.exit_code == 1 and "config/campaigns: " in refused.output


def test_a_wrong_configuration_says_all_that_is_wrong(project):
    text = Path("config/campaigns/smoke.yaml").read_text().replace("25 MPa", "25", 1).replace("grid: 64", "grid: 6")
    Path("wrong.yaml").write_text(text)
    for command in ("describe", "run"):
        refused = icha(command, "wrong.yaml")
        assert refused.exit_code == 2
        assert "wrong.yaml: materials.cmc.contact_modulus" in refused.output and "grid: 6" in refused.output


def test_slips_are_refused_and_warned_of_once_they_are_confirmed(project):
    text = TINY.replace("25 MPa", "25 mPa", 1)
    Path("slip.yaml").write_text(text)
    for command in ("describe", "run"):
        refused = icha(command, "slip.yaml")
        assert refused.exit_code == 2
        assert "slip.yaml: materials.bare.contact_modulus: '25 mPa' is unusual; usual: 1 kPa to" in refused.output
        assert "`confirmed: [materials.bare.contact_modulus]` at the top level" in refused.output
    Path("slip.yaml").write_text(f"{text}confirmed: [materials.bare.contact_modulus]\n")
    told = icha("describe", "slip.yaml")
    assert told.exit_code == 0
    assert "Warning: slip.yaml: materials.bare.contact_modulus: '25 mPa' is unusual, but confirmed" in told.output


@pytest.mark.parametrize(
    ("licence", "told"),
    [
        ("CC-BY", "tiny.yaml: license: 'CC-BY' is no licence that SPDX knows; allowed: one identifier of"),
        ("cc0-1.0", "tiny.yaml: license: 'cc0-1.0' is not written as SPDX writes it; allowed: 'CC0-1.0'"),
        ("CC0-1.0", None),
    ],
)
def test_a_licence_that_no_deposit_can_have_is_told_before_anything_is_computed(licence, told, project):
    Path("tiny.yaml").write_text(TINY.replace("CC0-1.0", licence))
    described = icha("describe", "tiny.yaml")
    assert described.exit_code == 0
    assert (f"not to be published: {told}" in described.output) if told else "published" not in described.output


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


def test_a_shipped_campaign_and_a_copy_of_it_are_two_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shipped, own = REPOSITORY / "config/campaigns/smoke.yaml", tmp_path / "config/campaigns/smoke.yaml"
    results = tmp_path / "results/smoke"
    results.mkdir(parents=True)
    claim(results, shipped, REPOSITORY)
    assert belongs_to_another(results, "smoke", shipped, REPOSITORY) is None
    said = belongs_to_another(results, "smoke", own, REPOSITORY)
    assert f"{results} belongs to config/campaigns/smoke.yaml of ICHA, and config/campaigns/smoke.yaml has" in said
    # The record holds wherever folder and workflow are.
    assert (results / "belongs_to.txt").read_text() == "config/campaigns/smoke.yaml of ICHA\n"


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
    told = icha("describe", "tiny.yaml", "--runs")
    assert told.exit_code == 0
    assert "4 runs, 2 to do" in told.output and "1 run there, but with other settings" in told.output
    assert f"failed: runs/{failed.path}.nc: {reason}" in " ".join(told.output.split())


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
        refused = icha(command, "copy.yaml")
        told = " ".join(refused.output.split())
        assert refused.exit_code == status and message in told and all(way in told for way in ways_out)
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
        told = " ".join(said.split())
        assert "models: asperities in load" in told
        assert "jump-in: Wu's distance is verified for Tabor parameters of 1 and more; " in told
        assert "adhesion: U_full/dgamma is " in told
        assert "accuracy: nothing is known of the accuracy here (rough: " in told


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
    told = icha("describe", "tiny.yaml").output
    for path in (cut, *empty):
        assert f"damaged: {path}: to do again" in told
    assert "other settings" not in told


def test_jobs_that_were_slow_make_the_rest_expected_slower(project):
    Path("tiny.yaml").write_text(TINY)
    campaign, results = load_configuration("tiny.yaml").campaign, project / "results/tiny"

    def left():
        return total(item for item in plan(campaign, results) if item.is_run).work

    before = left()
    for case in run_cases(campaign)[:3]:
        (results / f"runs/{case.path}.nc").parent.mkdir(parents=True, exist_ok=True)
        write_dataset(
            small.run().assign_attrs(config_sha256=run_sha256(campaign, case)), results / f"runs/{case.path}.nc"
        )
        benchmark = results / f"benchmarks/runs/{case.path}.jsonl"
        benchmark.parent.mkdir(parents=True, exist_ok=True)
        benchmark.write_text(json.dumps({"s": 100.0}) + "\n")
    # One of four is left, of which much more is expected.
    assert left() > 5 * before


def test_time_on_several_cores_is_never_less_than_the_longest_job_of_every_stage(project):
    Path("tiny.yaml").write_text(TINY)
    items = plan(load_configuration("tiny.yaml").campaign, project / "results/tiny")
    runs = [item for item in items if item.is_run]
    start, sums, handing_out = start_up(runs), total(runs), WORKFLOW.job * len(runs)
    assert time_on(runs, 2) == pytest.approx(start + max((sums.work + handing_out) / 2, sums.longest, handing_out))
    assert time_on(runs, 10**6) == start + max(sums.longest, handing_out)
    longest = [total(item for item in items if item.stage == stage).longest for stage in range(5)]
    assert time_on(items, 10**6) >= start_up(items) + sum(longest)


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
    refused = icha("run", "tiny.yaml")
    told = " ".join(refused.output.split())
    assert refused.exit_code == 2
    assert "MB of memory are needed on 2 cores, and this machine has 1.05 MB" in told
    assert "Nothing was begun; --anyway begins it all the same" in told
    assert "not enough: about" in icha("describe", "tiny.yaml").output
    assert icha("run", "tiny.yaml", "all", "--", "--forceall", "--resources", "mem_mb=60000").exit_code == 2
    assert icha("run", "tiny.yaml", "results/tiny/report.html").exit_code == BEGUN
    assert icha("run", "tiny.yaml", "--anyway").exit_code == BEGUN


def test_a_single_run_that_exceeds_the_machine_is_refused_with_its_size(project, monkeypatch):
    monkeypatch.setattr("icha.planning.needs.memory_of_machine", lambda: 16e9)
    refused = icha("simulate", "run.nc", "--grid", "32768")
    told = " ".join(refused.output.split())
    assert refused.exit_code == 2
    assert "--grid 32768, with 4.1e+03 of the shortest waves along a side, needs about 23" in told
    assert "GB of memory, and this machine has 16 GB; choose a smaller --grid" in told
    by_cells = icha("simulate", "run.nc", "--grid", "16384", "--model", "boundary_elements")
    assert by_cells.exit_code == 2 and "needs about 42.9 GB of memory" in " ".join(by_cells.output.split())


def test_want_of_memory_is_a_message(project, monkeypatch):
    def fail(*_, **__):
        raise MemoryError("Unable to allocate 80 GiB for an array")

    monkeypatch.setattr("icha.simulation.simulate", fail)
    refused = icha("simulate", "run.nc", "--grid", "32")
    assert refused.exit_code == 1 and "Error: not enough memory: Unable to allocate 80 GiB" in refused.output


def test_what_exceeds_the_machine_is_begun_if_that_is_said(project, small_machine, monkeypatch):
    Path("tiny.yaml").write_text(TINY)
    monkeypatch.setattr(sys.modules["icha.cli.run"], "_at_a_terminal", lambda: True)
    for answer, status in (("y\n", BEGUN), ("n\n", 2), ("", 1)):
        asked = CliRunner().invoke(app, ["run", "tiny.yaml"], input=answer)
        assert "MB of memory are needed" in asked.output and "Begin all the same?" in asked.output
        assert asked.exit_code == status


def test_the_memory_of_this_machine_is_no_matter_on_a_cluster(project, small_machine):
    Path("tiny.yaml").write_text(TINY)
    assert icha("run", "tiny.yaml", "--profile", "slurm").exit_code == BEGUN
    assert icha("run", "tiny.yaml", "--profile", "default").exit_code == 2


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
    for told in (
        "bad.npy: the file is empty",
        "none.nc: no such file",
        "sticky.nc: run",
        "run.nc: run dataset, all is",
    ):
        assert told in mixed.output


def test_results_without_checks_are_called_what_they_are(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_dataset(reference_dataset(small.SPECTRUM), "theories.nc")
    write_dataset(compare_campaign(small.tree()), "aggregated.nc")
    for name, kind in (("theories.nc", "theories and published points"), ("aggregated.nc", "comparison of runs")):
        told = icha("check", name)
        assert told.exit_code == 0 and f"{name}: {kind}" in told.output and "has no checks" in told.output
        refused = icha("show", name)
        assert refused.exit_code == 2 and kind in refused.output
    names = [
        "checks.json",
        "verdict.txt",
        "report.html",
        "run_times.tsv",
        "belongs_to.txt",
        "a.png",
        "a.pdf",
        "run.log",
    ]
    names += ["run.jsonl", "a.nc.json", "config.used.yaml", "paper-1.0.zip"]
    for name in names:
        Path(name).write_text("text")
    told = icha("check", *names)
    assert told.exit_code == 0
    assert [line.split(": ")[0] for line in told.output.splitlines()] == names
    assert "paper-1.0.zip: deposit; `icha verify` checks it" in told.output
    Path("deposit").mkdir()
    refused = icha("check", "deposit")
    assert refused.exit_code == 2 and "deposit: is a folder; allowed: a file" in refused.output
    Path("deposit/SHA256SUMS").touch()
    assert icha("check", "deposit").output == "deposit: deposit; `icha verify` checks it\n"
    assert icha("check", "none.log").exit_code == 2


@pytest.mark.parametrize("options", [["--grid", "32"], ["--grid", "16"], ["--grid", "32", "--period", "1 mm"]])
def test_the_left_out_options_of_a_single_run_fit_each_other(tmp_path, monkeypatch, options):
    monkeypatch.chdir(tmp_path)
    made = icha("simulate", "run.nc", *options, "--energy", "0 J/m^2", "--pressures", "1e-3")
    assert made.exit_code == 0 and "1 step" in made.output


def test_what_was_measured_is_shown_in_its_own_units(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_surface("surface.nc", small.surface(), name="rough", seed=1)
    surface = read_dataset("surface.nc")
    write_dataset(surface.assign(measured_rms_slope=surface["rms_slope"] * 1e-3), "scan.nc")
    height = 1e-3 * float(surface["rms_height"])
    told = icha("show", "scan.nc").output
    assert f"as measured: rms height {quantity(height, 'm')}, rms slope 0.001" in told
    low, high = (quantity(1e-3 * float(each), "m") for each in (surface["height"].min(), surface["height"].max()))
    assert f"heights from {low} to {high}, as measured" in told
    assert ", as stored; a line" in icha("show", "surface.nc").output


def test_both_separations_of_a_free_square_are_shown_and_told_apart(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = small.run()
    free = run.assign(boundary=run["boundary"].copy(data="free"), mean_gap=run["mean_separation"] + run["rms_height"])
    write_dataset(free.assign(mean_gap=free["mean_gap"].assign_attrs(run["mean_gap"].attrs)), "free.nc")
    told = icha("show", "free.nc").output
    assert "gap: mean gap between the surfaces" in told
    ends = {line.split()[0]: line.split()[-1] for line in told.splitlines() if "/h_rms " in line and " to " in line}
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


def test_studies_without_snapshots_are_drawn(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    whole = small.tree()
    without = {name: study.to_dataset().isel(snapshot=[], spot=[]) for name, study in whole.children.items()}
    write_dataset(xr.DataTree.from_dict({"/": whole.to_dataset(), **without}), "campaign.nc")
    shown = icha("show", "campaign.nc", "--plot", "campaign.png")
    assert shown.exit_code == 0, shown.output
    assert Path("campaign.png").stat().st_size


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


def test_what_is_expected_counts_the_imports_of_the_first_jobs_and_the_cores_of_each():
    clock = Clock()
    watch = Watch({f"results/tiny/runs/{k}.nc": 10.0 for k in range(4)}, clock, environment=3.0)
    clock.now = 2.0
    watch.take({"event": "resources_info", "cores": 2})
    watch.take({"event": "run_info", "stats": {"run": 4, "all": 1, "total": 5}})
    assert watch.seconds_left() == pytest.approx(3 + 4 * 10 / 2)
    watch.take(started(0) | {"threads": 2})
    clock.now += 8.0
    # Of two cores for 3 s of imports and 5 s of its own work.
    watch.take({"event": "job_finished", "job_id": 0})
    assert watch.seconds_left() == pytest.approx(3 * 10 / 2)


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


def test_curves_in_short():
    assert sparkline([0, 1, 2]) == "▁▅█" and sparkline([]) == "" and sparkline([3, 3]) == "▁▁"
    assert len(sparkline(range(1000))) == 60
