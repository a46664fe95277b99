"""`icha reproduce --own-source`: a program that is a small script, for all that may go right and wrong around it."""

import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import zipfile
from importlib.metadata import version

import netCDF4
import numpy as np
import pytest
import yaml
from reproduced import caller, lock

from icha.deposit.deposit_files import verify_deposit, whole_deposit
from icha.deposit.rerun import Refused, environment_target

NAME = "mine-1.0.0"
# Nothing is isolated, so that a test can plant something; `LC_` is a beginning of names that are passed on.
OWN = ("--own-source", "--isolation", "none", "--yes")
SOFT, HARD = "load/rough/seed1/slope1/soft", "load/rough/seed2/slope1/hard"
# Stands for the deposit's `icha`: it makes what it is asked for, a number each, and tells how it was called.
PROGRAM = """
import json, os, signal, sys, time, netCDF4, pathlib
signal.signal(signal.SIGTERM, signal.default_int_handler)
command, configuration, *targets = sys.argv[1:]
assert command == "run" and "cores" not in targets
number = float(pathlib.Path("inputs/number.txt").read_text())
results = pathlib.Path("results/mine")
runs = ["runs/load/rough/seed1/slope1/soft.nc", "runs/load/rough/seed2/slope1/hard.nc"]
files = [*runs, "surfaces/rough/seed1.nc", "surfaces/rough/seed2.nc", "dataset/mine.nc"]
asked = [t.removeprefix("results/mine/") for t in targets if t.endswith(".nc")]
with open("called.jsonl", "a") as log:
    log.write(json.dumps([sys.argv[1:], dict(os.environ)]) + "\\n")
if os.environ.get("LC_PLANTED") == "fails":
    sys.exit("the program fails")
surfaces = [f"surfaces/rough/{path.split('/')[3]}.nc" for path in asked]
for path in [*surfaces, *asked] or files:
    (results / path).parent.mkdir(parents=True, exist_ok=True)
    with netCDF4.Dataset(results / path, "w") as file:
        file.createDimension("step", 3)
        planted = os.environ.get("LC_PLANTED", "")
        factor = 1 + float(planted or 0) if path.endswith("soft.nc") and planted != "sleeps" else 1
        file.createVariable("pressure", "f8", ("step",))[:] = [number, 2.0 * factor, 3.0]
        if "seed2" in path:
            file.note = 1000 * "large"
    try:
        print("made", path, flush=True)
        if os.environ.get("LC_PLANTED") == "sleeps":
            time.sleep(60)
    except KeyboardInterrupt:
        time.sleep(0.5)
        print("\\n".join(3000 * [100 * "."]), flush=True)  # more than a pipe holds
        pathlib.Path("ended").touch()
        sys.exit(1)
(results / "verdict.txt").write_text("passed")
"""
MAKEFILE = f"""
environment:
	@test "$$LC_PLANTED" != "no network" || (echo "cannot reach the index" && exit 1)
	@mkdir -p .venv/bin
	@printf '#!{sys.executable}\\nimport runpy; runpy.run_path("program.py")\\n' > .venv/bin/icha
	@chmod +x .venv/bin/icha
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A deposit as a folder and as a zip; not to be changed."""
    folder = tmp_path_factory.mktemp("deposit")
    deposit = folder / NAME
    for path, text in {
        "config.used.yaml": "name: mine\n",
        "inputs/number.txt": "1.5",
        "source/Snakefile": "",
        "source/Makefile": MAKEFILE,
        "source/uv.lock": lock(),
        "source/program.py": PROGRAM,
        "README.md": "# Mine\n",
    }.items():
        (deposit / path).parent.mkdir(parents=True, exist_ok=True)
        (deposit / path).write_text(text)
    work = folder / "work"
    shutil.copytree(deposit / "source", work)
    shutil.copytree(deposit / "inputs", work / "inputs")
    subprocess.run([sys.executable, "program.py", "run", "config.used.yaml", "all"], cwd=work, check=True)
    shutil.copytree(work / "results/mine", deposit, dirs_exist_ok=True)
    seal(deposit)
    return deposit


def seal(deposit):
    """Write checksums and the zip."""
    files = sorted(path.relative_to(deposit).as_posix() for path in deposit.rglob("*") if path.is_file())
    sums = [f"{hashlib.sha256((deposit / f).read_bytes()).hexdigest()}  {f}\n" for f in files if f != "SHA256SUMS"]
    (deposit / "SHA256SUMS").write_text("".join(sums))
    with zipfile.ZipFile(deposit.with_name(f"{NAME}.zip"), "w") as archive:
        for file in sorted({*files, "SHA256SUMS"}):
            archive.write(deposit / file, f"{NAME}/{file}")


@pytest.fixture
def deposit(made, tmp_path):
    """One of one's own."""
    shutil.copytree(made.parent, tmp_path / "own", ignore=shutil.ignore_patterns("work"))
    return tmp_path / "own" / NAME


@pytest.fixture
def reproduce(monkeypatch, tmp_path, capfd):
    """Call the command for the deposit's own source, with something planted; return exit status and what was said."""
    called = caller(monkeypatch, capfd, tmp_path / "temporary")

    def call(*arguments, planted=""):
        monkeypatch.setenv("LC_PLANTED", planted)
        return called(*arguments, *OWN)

    call.temporary = tmp_path / "temporary"
    return call


def calls(folder):
    return [json.loads(line) for line in (folder / "source/called.jsonl").read_text().splitlines()]


@pytest.mark.parametrize("ending", ["", ".zip"])
def test_what_is_the_same_is_identical_and_leaves_nothing_behind(ending, made, reproduce):
    deposit = made.with_name(NAME + ending)
    before = {path: path.stat().st_mtime_ns for path in made.rglob("*")}
    status, said = reproduce(deposit)
    assert status == 0, said
    assert "identical: 6 files, every value" in said and "made dataset/mine.nc" in said
    assert list(reproduce.temporary.iterdir()) == []
    assert verify_deposit(deposit) == [] and {path: path.stat().st_mtime_ns for path in made.rglob("*")} == before


@pytest.mark.parametrize(
    ("asked", "targets", "target"),
    [
        ("name: mine\nfinite_range: {truth: {study: load}}\n", "environment tamaas", "tamaas"),
        ("name: mine\n", "environment tamaas", "environment"),
        # Of a program that installed all for everybody.
        ("name: mine\nfinite_range: {truth: {study: load}}\n", "environment", "environment"),
    ],
)
def test_the_environment_is_the_one_that_the_campaign_needs(asked, targets, target, tmp_path):
    (tmp_path / "source").mkdir()
    (tmp_path / "source/Makefile").write_text("".join(f"{each}:\n\t@true\n" for each in targets.split()))
    with whole_deposit(tmp_path) as found:
        assert environment_target(found, yaml.safe_load(asked)) == target


def test_a_makefile_that_is_too_large_is_refused(made):
    with whole_deposit(made) as found:
        larger = found._replace(sizes=found.sizes | {"source/Makefile": 10**9})
        with pytest.raises(Refused, match="source/Makefile: has 1 GB; allowed: "):
            environment_target(larger, {})


def test_nothing_of_the_caller_s_environment_gets_in(made, reproduce, tmp_path, monkeypatch):
    leaking = ("VIRTUAL_ENV", "PYTHONPATH", "PYTHONHOME_", "SNAKEMAKE_PROFILE", "UV_PROJECT_ENVIRONMENT", "MAKEFLAGS")
    leaking += ("ZENODO_TOKEN", "GITHUB_TOKEN", "AWS_SECRET_ACCESS_KEY", "SSH_AUTH_SOCK", "UV_PUBLISH_TOKEN", "X")
    for name in leaking:
        monkeypatch.setenv(name, str(tmp_path))
    monkeypatch.setenv("HTTPS_PROXY", "http://user:secret@proxy:8080")
    monkeypatch.setenv("HTTP_PROXY", "http://proxy:8080")
    monkeypatch.setenv("PATH", os.pathsep.join([f"{sys.prefix}/bin", os.environ["PATH"]]))
    status, said = reproduce(made, "--folder", tmp_path / "again", "--cores", "3")
    assert status == 0
    ((arguments, environment),) = calls(tmp_path / "again")
    assert arguments == ["run", "config.used.yaml", "all", "--cores", "3"]
    assert not {*leaking, "HTTPS_PROXY"} & set(environment) and {"LC_PLANTED", "HTTP_PROXY"} <= set(environment)
    passed = re.search("^variables:  (.*); no other ones of yours$", said, re.MULTILINE)[1].split(", ")
    # Make and the shell add some of their own.
    assert {"HTTP_PROXY", "PATH"} <= set(passed) and set(environment) <= {
        *passed,
        "PWD",
        "SHLVL",
        "_",
        "LC_CTYPE",
        "HDF5_PLUGIN_PATH",
    }
    if sys.prefix != sys.base_prefix:
        assert f"{sys.prefix}/bin" not in environment["PATH"].split(os.pathsep)


@pytest.mark.parametrize("planted, status, told", [
    ("1e-9", 0, "within tolerance: 6 files, every value to 1e-06"),
    ("1e-3", 1, "different: not everything is reproduced"),
])  # fmt: skip
def test_differences_are_told_by_variable(planted, status, told, made, reproduce, tmp_path):
    ended, said = reproduce(made, "--json", tmp_path / "out.json", planted=planted)
    assert ended == status and told in said, said
    assert "runs: pressure: " in said
    written = json.loads((tmp_path / "out.json").read_text())
    (differing,) = [file for file in written["files"] if file["verdict"] != "identical"]
    assert differing["path"] == f"runs/{SOFT}.nc"
    # What differs is kept to be looked at.
    kept = list(reproduce.temporary.iterdir())
    assert len(kept) == status
    if kept:
        assert f"what was computed again: {kept[0]}/source/results/mine" in said


def test_a_table_is_told_even_if_it_cannot_be_written(made, reproduce, tmp_path):
    (tmp_path / "folder").mkdir()
    status, said = reproduce(made, "--json", tmp_path / "folder")
    assert status == 1 and "identical: 6 files, every value" in said and "Is a directory" in said


def test_what_runs_is_told_to_begin_anyway_if_we_are(made, reproduce, tmp_path):
    assert reproduce(made, "--anyway", "--folder", tmp_path / "again")[0] == 0
    assert calls(tmp_path / "again")[0][0] == ["run", "config.used.yaml", "all", "--anyway"]


def test_single_runs(made, reproduce, tmp_path):
    status, said = reproduce(made, "--only", "smallest", "--folder", tmp_path / "again")
    assert status == 0 and "identical: 2 files" in said, said
    assert calls(tmp_path / "again")[-1][0] == ["run", "config.used.yaml", f"results/mine/runs/{SOFT}.nc"]
    status, said = reproduce(made, "--only", SOFT, "--only", f"runs/{HARD}.nc", "--folder", tmp_path / "again")
    assert status == 0 and "identical: 4 files" in said  # two runs, and the surface of each
    assert calls(tmp_path / "again")[-1][0][2:] == [f"results/mine/runs/{run}.nc" for run in (SOFT, HARD)]


def fail_run(deposit, run, steps):
    """Give a run so many steps, and a reason why there are no more."""
    with netCDF4.Dataset(deposit / f"runs/{run}.nc", "w") as file:
        file.createDimension("step", steps)
        file.incomplete = "the path ends: stuck"
        file.createVariable("pressure", "f8", ("step",))[:] = np.arange(steps) + 1.0
    seal(deposit)


@pytest.mark.parametrize("ending", ["", ".zip"])
@pytest.mark.parametrize("steps", [0, 2])
def test_the_smallest_run_is_the_smallest_that_is_complete(steps, ending, deposit, reproduce, tmp_path):
    fail_run(deposit, SOFT, steps)
    assert (deposit / f"runs/{SOFT}.nc").stat().st_size < (deposit / f"runs/{HARD}.nc").stat().st_size
    status, said = reproduce(deposit.with_name(NAME + ending), "--only", "smallest", "--folder", tmp_path / "again")
    assert status == 0 and "identical: 2 files" in said, said
    assert calls(tmp_path / "again")[-1][0][2:] == [f"results/mine/runs/{HARD}.nc"]
    fail_run(deposit, HARD, steps)
    status, said = reproduce(deposit.with_name(NAME + ending), "--only", "smallest")
    assert status == 2 and "no run of the deposit is complete" in said
    assert list(reproduce.temporary.iterdir()) == []


def test_a_run_without_steps_is_refused_by_name_and_one_with_some_is_not(deposit, reproduce, tmp_path):
    fail_run(deposit, SOFT, 0)
    status, said = reproduce(deposit, "--only", HARD, "--only", SOFT)
    assert status == 2 and f"--only {SOFT}: this run holds no data (the path ends: stuck)" in said
    assert list(reproduce.temporary.iterdir()) == []
    fail_run(deposit, SOFT, 2)
    status, said = reproduce(deposit, "--only", SOFT, "--folder", tmp_path / "again")
    assert status == 1 and "different" in said  # the program that stands for the deposit's makes three
    assert calls(tmp_path / "again")[-1][0][2:] == [f"results/mine/runs/{SOFT}.nc"]


def test_a_damaged_deposit_is_refused(deposit, reproduce):
    with (deposit / "dataset/mine.nc").open("ab") as file:
        file.write(b"x")
    status, said = reproduce(deposit)
    assert status == 2 and "damaged" in said and "dataset/mine.nc" in said
    whole = deposit.with_name(f"{NAME}.zip")
    whole.write_bytes(whole.read_bytes()[:-100])
    assert reproduce(whole)[0] == 2
    assert reproduce(deposit.with_name("none"))[0] == 2
    (deposit / "dataset/mine.nc").unlink()
    (deposit / "source/uv.lock").unlink()
    seal(deposit)
    status, said = reproduce(deposit)
    assert status == 2 and "has no source/uv.lock" in said
    assert list(reproduce.temporary.iterdir()) == []


def test_wrong_use_is_refused_before_anything_is_done(made, reproduce, tmp_path):
    status, said = reproduce(made, "--only", "load/rough/seed3/slope1/soft")
    assert status == 2 and "has no such run; allowed: smallest, or one of its 2 runs" in said and SOFT in said
    assert reproduce(made, "--cores", "none")[0] == 2
    status, said = reproduce(made, "--folder", made / "again")
    assert status == 2 and "is in the deposit" in said
    (tmp_path / "other").mkdir()
    (tmp_path / "other/file").write_text("mine")
    status, said = reproduce(made, "--folder", tmp_path / "other")
    assert status == 2 and "has other files in it" in said
    (tmp_path / "other/file").rename(tmp_path / "other/rerun-of.sha256")
    status, said = reproduce(made, "--folder", tmp_path / "other")
    assert status == 2 and "belongs to another deposit" in said
    assert [path.name for path in (tmp_path / "other").iterdir()] == ["rerun-of.sha256"]
    assert list(reproduce.temporary.iterdir()) == []


def test_a_deposit_that_is_unpacked_is_no_folder_of_a_rerun(deposit, reproduce):
    """Even of itself: it is not written to."""
    status, said = reproduce(deposit.with_name(f"{NAME}.zip"), "--folder", deposit)
    assert status == 2 and "has other files in it" in said
    assert verify_deposit(deposit) == []


def test_an_environment_that_cannot_be_installed(made, reproduce, tmp_path):
    folder = tmp_path / "again"
    status, said = reproduce(made, "--folder", folder, planted="no network")
    assert status == 1 and "cannot reach the index" in said and f"log: {folder}/environment.log" in said
    assert "--environment here" in said and not (folder / "source/called.jsonl").exists()
    # With network, the same call goes on.
    assert reproduce(made, "--folder", folder)[0] == 0


def test_a_program_that_fails(made, reproduce, tmp_path):
    status, said = reproduce(made, "--folder", tmp_path / "again", planted="fails")
    assert status == 1 and "the program fails" in said
    assert f"nothing was computed; the same command with --folder {tmp_path / 'again'} goes on" in said


def test_the_environment_that_is_here_has_to_agree_with_the_lock_file(deposit, reproduce):
    (deposit / "source/uv.lock").write_text(lock("0.1"))
    seal(deposit)
    status, said = reproduce(deposit, "--environment", "here")
    assert status == 2 and f"numpy: {version('numpy')} is installed, 0.1 is locked" in said
    for content in (b"package = [1]", b"\xff"):
        (deposit / "source/uv.lock").write_bytes(content)
        seal(deposit)
        status, said = reproduce(deposit, "--environment", "here")
        assert status == 2 and "source/uv.lock: is no lock file of uv" in said
    assert list(reproduce.temporary.iterdir()) == []


@pytest.mark.slow
def test_what_was_stopped_goes_on(made, reproduce, tmp_path):
    folder = tmp_path / "again"
    # What was left by one that was killed while it copied is no part of it.
    assert reproduce(made, "--folder", folder, planted="fails")[0] == 1
    (folder / "source").rename(folder / ".source.part")
    (folder / ".source.part/program.py").unlink()
    (folder / ".source.part/Makefile.orig").touch()
    program = [
        sys.executable,
        "-c",
        "from icha.cli import main; main()",
        "reproduce",
        str(made),
        "--folder",
        str(folder),
        *OWN,
    ]
    process = subprocess.Popen(
        program,
        env=os.environ | {"LC_PLANTED": "sleeps"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    while "made" not in (line := process.stdout.readline()):
        assert line
    process.send_signal(signal.SIGTERM)
    said = process.communicate(timeout=50)[0]
    assert process.returncode == 1 and f"stopped; the same command with --folder {folder} goes on" in said
    ours = subprocess.run(["pgrep", "-f", f"{folder}/source/.venv/bin/icha"], capture_output=True, text=True).stdout
    assert not ours, ours
    assert (folder / "source/ended").exists() and not list(folder.rglob("Makefile.orig"))
    copied = (folder / "source/program.py").stat().st_mtime_ns
    status, said = reproduce(made, "--folder", folder)
    assert status == 0 and "identical: 6 files" in said
    assert (folder / "source/program.py").stat().st_mtime_ns == copied and len(calls(folder)) == 2
