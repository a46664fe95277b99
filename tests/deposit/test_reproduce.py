"""`icha reproduce`: a deposit is data for the ICHA that is installed; it is checked, and nothing in it runs."""

import json
import re
import shutil
from importlib.metadata import version

import netCDF4
import numpy as np
import pytest
import typer
from outside_validators import lock, problems_with
from typer.testing import CliRunner

from icha.cli import app, deposits

SOFT, HARD = "load/plate/seed0/slope0.5/soft", "load/plate/seed0/slope0.5/hard"
RUNS = (f"runs/{SOFT}.nc", f"runs/{HARD}.nc")
CAMPAIGN = """
name: tiny
title: Tiny
summary: One file.
license: CC0-1.0
surfaces:
  plate: {{kind: file, path: {path}, height_unit: um, period: 10 um}}
materials:
  soft: {{contact_modulus: 25 MPa, surface_energy: 0 mJ/m^2, interaction_range: 40 nm}}
  hard: {{contact_modulus: 250 MPa, surface_energy: 0 mJ/m^2, interaction_range: 40 nm}}
studies:
  load:
    surfaces: [plate]
    rms_slopes: [0.5]
    materials: [soft, hard]
    targets: {{reduced_pressures: [1.0e-3]}}
"""
LEAVES_A_MARK = "import pathlib; pathlib.Path({mark!r}).touch()\n"


def write_run(path, steps=3, factor=1.0, size=1, **attributes):
    """A file that stands for a run or a surface."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("step", steps)
        file.createVariable("pressure", "f8", ("step",))[:] = factor * (np.arange(steps) + 1.0)
        file.note = size * "large"
        file.setncatts(attributes)


@pytest.fixture
def deposit(pack, tmp_path):
    """A function that makes a deposit, with files changed or left out (None)."""
    x = np.arange(32) / 32 * 2 * np.pi
    np.save(tmp_path / "z.npy", np.cos(x) + np.cos(2 * x)[:, None])
    write_run(tmp_path / "soft.nc")
    write_run(tmp_path / "hard.nc", size=1000)
    files = {
        "config.used.yaml": CAMPAIGN.format(path="inputs/z.npy"),
        "inputs/z.npy": (tmp_path / "z.npy").read_bytes(),
        f"runs/{SOFT}.nc": (tmp_path / "soft.nc").read_bytes(),
        f"runs/{HARD}.nc": (tmp_path / "hard.nc").read_bytes(),
        "surfaces/plate/seed0.nc": (tmp_path / "soft.nc").read_bytes(),
        "verdict.txt": "passed",
        "source/pyproject.toml": f'[project]\nversion = "{version("icha")}"\n',
        "source/uv.lock": lock(numpy=version("numpy")),
        ".zenodo.json": json.dumps({"title": "A \x1b[2J title", "creators": [{"name": "Carberry, Josiah"}]}),
    }

    def made(**changes):
        return pack({path: text for path, text in (files | changes).items() if text is not None})

    return made


@pytest.fixture
def reproduce(monkeypatch, tmp_path):
    """Call the command; return exit status and output. Nothing may stay of what is refused, or act on the terminal."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))

    def call(*arguments):
        done = CliRunner().invoke(app, ["reproduce", *map(str, arguments)])
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
        assert done.exit_code != 2 or list(temporary.iterdir()) == []
        assert not set("\x1b\u202e") & set(done.output)
        return done.exit_code, done.output

    return call


@pytest.fixture
def computed(monkeypatch, tmp_path):
    """Stand in for `icha run`: make the files that are asked for, and note how it was called."""
    calls = []

    def run(configuration, targets, *, cores, folder):
        calls.append((configuration, targets, cores))
        results = folder / "results/tiny"
        asked = [each.removeprefix("results/tiny/") for each in targets if each != "all"]
        for path in asked or RUNS:
            write_run(
                results / path, factor=calls.factor if "soft" in path else 1.0, size=1000 if "hard" in path else 1
            )
        write_run(results / "surfaces/plate/seed0.nc")
        (results / "verdict.txt").write_text("passed")
        if calls.fails:
            shutil.rmtree(results)
            raise typer.Exit(1)

    calls = type("Calls", (list,), {"factor": 1.0, "fails": False})()
    monkeypatch.setattr(deposits, "run", run)
    return calls


@pytest.mark.parametrize("ending", ["", ".zip"])
def test_what_is_the_same_is_identical_and_leaves_nothing_behind(ending, deposit, reproduce, computed, tmp_path):
    folder = deposit(**{"source/uv.lock": lock(numpy="0.1")})
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    status, output = reproduce(folder.with_name(folder.name + ending), "--cores", "3")
    assert status == 0 and "identical: every value in 4 files" in output, output
    assert f"program:    the installed ICHA {version('icha')}; nothing in the deposit is executed" in output
    assert re.search(rf"other versions of packages.*\s+numpy: {version('numpy')} is installed, 0.1 is", output), output
    ((_, targets, cores),) = computed
    assert (targets, cores) == (["all"], 3)
    assert list((tmp_path / "temporary").iterdir()) == []
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before


@pytest.mark.parametrize(
    ("factor", "status", "message"), [(1 + 1e-9, 0, "within tolerance: every value in 4"), (1.001, 1, "different:")]
)
def test_differences_are_listed_by_variable(factor, status, message, deposit, reproduce, computed, tmp_path):
    computed.factor = factor
    ended, output = reproduce(deposit())
    assert ended == status and message in output, output
    assert re.search(rf"runs: pressure: .* \(runs/{SOFT}.nc\)", output) and HARD not in output
    assert len(list((tmp_path / "temporary").iterdir())) == status  # what differs is kept


def test_single_runs(deposit, reproduce, computed, tmp_path):
    packed = deposit()
    for only, runs in ((["smallest"], [SOFT]), ([HARD, f"runs/{SOFT}.nc"], [HARD, SOFT])):
        status, output = reproduce(packed, *(f"--only={each}" for each in only), "--folder", tmp_path / "again")
        assert status == 0 and f"every value in {len(runs) + 1} files" in output, output  # and the surface of both
        assert computed[-1][1] == [f"results/tiny/runs/{run}.nc" for run in runs]
    status, output = reproduce(packed, "--only", "load/plate/seed3/slope1/soft")
    assert status == 2 and "has no such run; expected smallest, or one of its 2 runs" in output and HARD in output


def test_a_folder_continues_its_own_rerun_only(deposit, reproduce, computed, tmp_path):
    packed = deposit()
    computed.fails = True
    status, output = reproduce(packed, "--folder", tmp_path / "again")
    assert status == 1 and "nothing was computed" in output
    computed.fails = False
    assert reproduce(packed, "--folder", tmp_path / "again")[0] == 0
    (tmp_path / "again/rerun-of.sha256").write_text("another")
    (tmp_path / "other").mkdir()
    (tmp_path / "other/file").write_text("mine")
    for folder, message in (
        (tmp_path / "again", "belongs to another deposit"),
        (tmp_path / "other", "contains other files"),
        (packed / "again", "is inside the deposit"),
    ):
        status, output = reproduce(packed, "--folder", folder)
        assert status == 2 and message in output, output
    assert problems_with(packed) == [] and len(computed) == 2


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"source/pyproject.toml": '[project]\nversion = "99.0"\n'}, "is installed, but 99.0 made the deposit"),
        ({"source/pyproject.toml": "project = 3"}, "expected a file with the program's version"),
        ({"source/uv.lock": "package = [1]"}, "and a uv lock file"),
        ({"source/uv.lock": None}, "has no source/uv.lock"),
        ({"config.used.yaml": "name: [a, b]"}, "name: ['a', 'b'] is not the name"),
        ({"config.used.yaml": "name: ../../tmp"}, "name: '../../tmp' is not the name"),
        ({"config.used.yaml": "name: !!python/object/apply:os.getcwd []"}, "config.used.yaml"),
        ({"config.used.yaml": b"\xff\xfe\x00"}, "deposit"),
        ({"config.used.yaml": "name: tiny\ntitle: 3\n"}, "the configuration of the deposit cannot be run"),
        ({"config.used.yaml": CAMPAIGN.format(path="/etc/passwd")}, "expected files in this folder"),
    ],
)
def test_the_content_of_a_deposit_is_checked(changes, message, deposit, reproduce, computed):
    status, output = reproduce(deposit(**changes))
    assert status == 2 and message in output and not computed, output


def test_damaged_deposits_are_refused(deposit, reproduce, computed):
    (packed := deposit()).joinpath("verdict.txt").write_text("Passed")
    status, output = reproduce(packed)
    assert status == 2 and "damaged" in output and "verdict.txt" in output and not computed


def test_scripts_of_own_figures_are_not_asked_for(deposit, reproduce, computed, tmp_path):
    script = 'def draw(study):\n    """Own."""\n    return study\n'
    text = CAMPAIGN.format(path="inputs/z.npy") + "figures:\n  own: {study: load, script: inputs/figures/own/own.py}\n"
    packed = deposit(**{"config.used.yaml": text, "inputs/figures/own/own.py": script})
    _, output = reproduce(packed)
    [(_, targets, _)] = computed
    assert "scripts of the deposit would run" in output
    assert "results/tiny/verdict.txt" in targets and f"results/tiny/runs/{SOFT}.nc" in targets
    assert not [each for each in targets if each == "all" or "figures" in each or "report" in each]


@pytest.mark.slow
def test_nothing_in_a_deposit_is_executed(deposit, reproduce, tmp_path, monkeypatch):
    """For real, wherever the command is called: neither the source, nor what lies beside configuration and inputs."""
    mark = LEAVES_A_MARK.format(mark=str(tmp_path / "mark"))
    names = ("Snakefile", "icha/__init__.py", "sitecustomize.py", "workflow/rules/runs.smk", "workflow/scripts/job.py")
    names += ("workflow/scripts/compute_batch.py", "numpy.py")
    places = [f"{folder}{name}" for folder in ("source/", "inputs/", "") for name in names]
    packed = deposit(**dict.fromkeys(places, mark))
    monkeypatch.chdir(packed / "source")
    status, output = reproduce(packed, "--only", SOFT, "--folder", tmp_path / "again")
    assert not (tmp_path / "mark").exists()
    assert status == 1 and "different: not everything is reproduced" in output, output
    with netCDF4.Dataset(tmp_path / f"again/data/results/tiny/runs/{SOFT}.nc") as file:
        assert float(file["reduced_pressure"][-1]) == pytest.approx(1e-3)  # it was computed
