"""`icha reproduce` of a stranger's deposit: nothing in it is run unasked, and what is run is kept to its folder."""

import hashlib
import json
import os
import pty
import re
import shutil
import socket
import subprocess
import sys
import threading
import zipfile
from importlib.metadata import version
from types import SimpleNamespace

import h5py
import netCDF4
import numpy as np
import pytest
from conftest import REPOSITORY
from reproduced import caller, lock

from icha.deposit.deposit_files import whole_deposit
from icha.deposit.isolation import BWRAP, isolated, works
from icha.deposit.rerun import changed_files, surroundings
from icha.deposit.source import PROGRAM as PARTS
from icha.support.checksums import sha256_of

CAMPAIGN = """
name: tiny
title: A file
summary: One height map.
license: CC-BY-4.0
surfaces:
  plate: {{kind: file, path: {path}, height_unit: um, period: 10 um}}
materials:
  soft: {{contact_modulus: 25 MPa, surface_energy: 0 mJ/m^2, interaction_range: 40 nm}}
studies:
  load:
    surfaces: [plate]
    rms_slopes: [0.5]
    materials: [soft]
    targets: {{reduced_pressures: [1.0e-3]}}
"""
# Whatever is run of the deposit leaves its mark.
MAKEFILE = f"""
environment:
	@date > "$(MARK)"; mkdir -p .venv/bin
	@cp program.py .venv/bin/icha; chmod +x .venv/bin/icha
	@{sys.executable} program.py installs
"""
PROGRAM = f"""#!{sys.executable}
import json, os, pathlib, socket, sys
def tried(what):
    try:
        return what() or True
    except OSError:
        return False
port, secret, outside = json.loads(pathlib.Path("inputs/plan.json").read_text())
found = {{
    "network": tried(lambda: socket.create_connection(("127.0.0.1", port), timeout=5).close()),
    "secret": tried(lambda: pathlib.Path(secret).read_text()),
    "outside": tried(lambda: pathlib.Path(outside).write_text("here")),
    "usr": tried(lambda: pathlib.Path("/usr/written").write_text("here")),
    "processes": len([each for each in os.listdir("/proc") if each.isdigit()]),
    "home": os.environ["HOME"],
    "terminal": tried(lambda: open("/dev/tty").close()),
}}
pathlib.Path(f"{{sys.argv[1]}}.json").write_text(json.dumps(found))
print("\\x1b[2Jall is\\u202e whole")
made = pathlib.Path("results/tiny")
made.mkdir(parents=True, exist_ok=True)
(made / "verdict.txt").write_text("passed")
"""


@pytest.fixture
def deposit(tmp_path):
    """A function that makes a deposit with other contents of some files; `None` leaves one out."""

    def make(**changes):
        folder = tmp_path / "tiny-1.0.0"
        shutil.rmtree(folder, ignore_errors=True)
        files = {
            "config.used.yaml": CAMPAIGN.format(path="inputs/z.npy"),
            "verdict.txt": "passed",
            ".zenodo.json": json.dumps({"title": "A \x1b[2J title", "creators": [{"name": "Carberry, J."}]}),
            "source/pyproject.toml": f'[project]\nversion = "{version("icha")}"\n',
            "source/uv.lock": lock(),
            "source/Snakefile": "",
            "source/Makefile": MAKEFILE.replace("$(MARK)", str(tmp_path / "mark")),
            "source/program.py": PROGRAM,
        } | changes
        for path, content in files.items():
            if content is None:
                continue
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(content if isinstance(content, bytes) else content.encode())
        names = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
        sums = [f"{hashlib.sha256((folder / name).read_bytes()).hexdigest()}  {name}\n" for name in names]
        (folder / "SHA256SUMS").write_text("".join(sums))
        return folder

    return make


@pytest.fixture
def reproduce(monkeypatch, tmp_path, capfd):
    return caller(monkeypatch, capfd, tmp_path / "temporary")


@pytest.mark.slow
def test_a_deposit_is_computed_without_anything_in_it_being_run(deposit, reproduce, tmp_path):
    """Whatever Python, Snakemake or make might take from it would leave a mark."""
    leaves_a_mark = f"open({str(tmp_path / 'mark')!r}, 'a').write('x')\n"
    names = ("Snakefile", "icha/__init__.py", "sitecustomize.py", "workflow/rules/runs.smk", "workflow/scripts/job.py")
    names += ("workflow/scripts/run_sweep.py", "numpy.py")
    places = (f"{folder}{name}" for folder in ("source/", "inputs/", "") for name in names)
    x = np.arange(32) / 32 * 2 * np.pi
    np.save(tmp_path / "z.npy", np.cos(x) + np.cos(2 * x)[:, None])
    with netCDF4.Dataset(tmp_path / "soft.nc", "w") as file:
        file.createDimension("step", 1)
    run = "load/plate/seed0/slope0.5/soft"
    own = deposit(
        **dict.fromkeys(places, leaves_a_mark),
        **{"inputs/z.npy": (tmp_path / "z.npy").read_bytes(), f"runs/{run}.nc": (tmp_path / "soft.nc").read_bytes()},
    )
    status, said = reproduce(own, "--only", run, "--folder", tmp_path / "again")
    assert not (tmp_path / "mark").exists()
    assert status == 1 and "different: not everything is reproduced" in said, said
    with netCDF4.Dataset(tmp_path / f"again/data/results/tiny/runs/{run}.nc") as file:
        assert float(file["reduced_pressure"][-1]) == pytest.approx(1e-3)  # it was computed


def test_nothing_of_a_deposit_is_run_unasked(deposit, reproduce, tmp_path):
    status, said = reproduce(deposit())
    assert status == 2 and "no such file; allowed: a square array" in said  # by the checks of every configuration
    assert "it says of itself, and nobody has checked it:\n  title:    A \\x1b[2J title\n  authors:  Carb" in said
    assert f"is run:     the ICHA that is installed, {version('icha')}; nothing in the deposit is executed" in said
    assert "the deposit's source differs from it in" in said
    for asked in (["--isolation", "none"], ["--environment", "lock"]):
        status, said = reproduce(deposit(), *asked)
        assert status == 2 and "needed: --own-source as well" in said
    status, said = reproduce(deposit(), "--own-source")
    assert status == 2 and "no terminal to ask at" in said and "the program in the deposit" in said
    assert not (tmp_path / "mark").exists()


def test_at_a_terminal_it_asks(deposit, tmp_path):
    ours, theirs = pty.openpty()
    os.write(ours, b"n\n")
    command = [sys.executable, "-c", "from icha.cli import main; main()", "reproduce", deposit(), "--own-source"]
    done = subprocess.run([*command, "--isolation", "none"], stdin=theirs, capture_output=True, text=True, cwd=tmp_path)
    os.close(ours), os.close(theirs)
    assert done.returncode == 1 and "Run it?" in done.stdout and "Nothing was run." in done.stdout, done
    assert "can touch:  whatever you can" in done.stdout and "advice:     run it isolated" in done.stdout
    assert not (tmp_path / "mark").exists()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"source/pyproject.toml": '[project]\nversion = "99.0"\n'}, "is installed, 99.0 made the deposit"),
        ({"source/uv.lock": lock("0.1")}, "is installed, 0.1 is locked"),
        ({"source/pyproject.toml": "project = 3"}, "has no version of the program"),
        ({"source/pyproject.toml": b"\xff"}, "has no version of the program"),
        ({"source/uv.lock": "package = [1]"}, "is no lock file of uv"),
        ({"source/uv.lock": "x = " + 10_000 * "["}, "is no lock file of uv"),
        ({"source/uv.lock": None}, "has no source/uv.lock"),
        ({"verdict.txt": None}, "has no results, so there is nothing to compare with"),
        ({"config.used.yaml": "name: [a, b]"}, "name: ['a', 'b']: is no name"),
        ({"config.used.yaml": "name: ../../tmp"}, "name: '../../tmp': is no name"),
        ({"config.used.yaml": "- name"}, "config.used.yaml: the file is a list"),
        ({"config.used.yaml": "name: !!python/object/apply:os.getcwd []"}, "config.used.yaml"),
        ({"config.used.yaml": b"\xff\xfe\x00"}, "config.used.yaml"),
        ({"config.used.yaml": "name: tiny\ntitle: 3\n"}, "the configuration of the deposit cannot be run"),
        ({"config.used.yaml": CAMPAIGN.format(path="/etc/passwd")}, "allowed: files beside it"),
        ({"config.used.yaml": CAMPAIGN.format(path="../../../secret.npy")}, "allowed: files beside it"),
        ({".zenodo.json": "[1]"}, ".zenodo.json: not a mapping"),
        ({".zenodo.json": '{"title": ["a"]}'}, ".zenodo.json: title is no text"),
        ({".zenodo.json": '{"creators": {"name": 1}}'}, ".zenodo.json: creators is no list"),
        ({".zenodo.json": 100_000 * "["}, ".zenodo.json: "),
    ],
)
def test_what_a_deposit_says_is_checked(changes, said, deposit, reproduce, tmp_path):
    status, told = reproduce(deposit(**changes))
    assert status == 2 and said in told, told
    assert not (tmp_path / "mark").exists()


def test_what_is_missing_on_both_sides_is_not_reproduced(deposit, reproduce, monkeypatch):
    from icha.deposit.rerun_comparison import Comparison

    monkeypatch.setattr("icha.deposit.rerun_comparison.compare_folders", lambda *_: Comparison(()))
    status, said = reproduce(deposit(**{"inputs/plan.json": '[1, "/none", "/none/x"]'}), *OWN, "none")
    assert status == 1 and "nothing was compared, so nothing is reproduced" in said and "identical" not in said


OWN = ("--own-source", "--yes", "--isolation")


@pytest.fixture
def plan(tmp_path):
    """Where a deposit's program tries to go: a port where somebody listens, a secret, a file outside."""
    (tmp_path / "secret").write_text("hush")
    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=lambda: [server.accept() for _ in range(4)], daemon=True).start()
        yield json.dumps([server.getsockname()[1], str(tmp_path / "secret"), str(tmp_path / "outside")])


def test_without_isolation_it_can_do_all_and_that_is_said(plan, deposit, reproduce, tmp_path):
    """What the isolated one is held against: each of these can be done here."""
    status, said = reproduce(deposit(**{"inputs/plan.json": plan}), *OWN, "none", "--folder", tmp_path / "again")
    assert status == 0 and "can touch:  whatever you can" in said, said
    assert "\\x1b[2Jall is\\u202e whole" in said
    found = json.loads((tmp_path / "again/source/run.json").read_text())
    assert found["network"] and found["secret"] == "hush" and found["outside"] and not found["terminal"]
    assert (tmp_path / "outside").exists() and (tmp_path / "mark").exists()


def need_bubblewrap():
    if not works(BWRAP):
        reason = "bubblewrap is not installed, or users may not use it here"
        (pytest.fail if os.environ.get("ICHA_REQUIRE_BWRAP") == "1" else pytest.skip)(reason)


@pytest.mark.parametrize("asked", [[BWRAP], []])
def test_bubblewrap_keeps_it_to_its_folder_and_off_the_network(asked, plan, deposit, reproduce, tmp_path):
    need_bubblewrap()
    folder = tmp_path / "again"
    makefile = MAKEFILE.replace('"$(MARK)"', "mark")
    own = deposit(**{"inputs/plan.json": plan, "source/Makefile": makefile})
    isolation = ["--isolation", *asked] if asked else []
    status, said = reproduce(own, "--own-source", "--yes", *isolation, "--folder", folder)
    assert status == 0 and "and by bwrap nothing else; the network until its environment is installed" in said, said
    for step, network in (("installs", True), ("run", False)):
        found = json.loads((folder / f"source/{step}.json").read_text())
        assert found.pop("processes") < 6
        found.pop("outside")  # there is a /tmp of its own, which goes with it
        assert found == {
            "network": network,
            "secret": False,
            "usr": False,
            "home": str(folder / "source/.home"),
            "terminal": False,
        }
    assert not (tmp_path / "outside").exists()


def test_what_is_isolated_leaves_nothing_that_we_would_follow_or_take_for_ours(deposit, reproduce, tmp_path):
    """What lies in the folder of a rerun is read and written by us, with no isolation; its source alone is its own."""
    need_bubblewrap()
    (tmp_path / "victim").write_text("mine")
    (tmp_path / "secret").write_text("hush")
    # What links may lead to, and what may be in the way of the second call.
    makefile = f"""
environment:
	-ln -sfn {tmp_path}/victim ../environment.log
	-mkdir -p ../deposit/source ../data
	-ln -s {tmp_path}/secret ../deposit/source/stolen
	-cp ../rerun-of.sha256 ../data/verdict.txt
	-mv ../source ../old
	false
"""
    own = deposit(**{"source/Makefile": makefile})
    for _ in range(2):
        status, said = reproduce(own, *OWN, BWRAP, "--folder", tmp_path / "again")
        assert status == 1 and "the environment could not be installed" in said, said
        assert sorted(os.listdir(tmp_path / "again")) == ["environment.log", "rerun-of.sha256", "source"]
        assert not (tmp_path / "again/environment.log").is_symlink()
    assert (tmp_path / "victim").read_text() == "mine"
    assert not list(tmp_path.glob("again/**/stolen"))


def test_results_that_are_a_link_are_none(deposit, reproduce, tmp_path):
    program = f"#!{sys.executable}\nimport os\nos.mkdir('results')\nos.symlink({str(tmp_path)!r}, 'results/tiny')\n"
    makefile = "environment:\n\tmkdir -p .venv/bin; cp program.py .venv/bin/icha; chmod +x .venv/bin/icha\n"
    own = deposit(**{"source/Makefile": makefile, "source/program.py": program})
    status, said = reproduce(own, *OWN, "none")
    assert status == 1 and "nothing was computed" in said


@pytest.mark.parametrize("program", ["podman", "docker"])
def test_containers_have_no_network_and_one_folder(program, plan, deposit, reproduce, tmp_path, monkeypatch):
    """A stand-in for the program: it notes how it was called and runs what is asked for without any isolation."""
    (tmp_path / "bin").mkdir()
    stand_in = tmp_path / f"bin/{program}"
    stand_in.write_text(
        f"#!{sys.executable}\nimport json, subprocess, sys\n"
        f"open({str(tmp_path / 'called')!r}, 'a').write(json.dumps(sys.argv[1:]) + chr(10))\n"
        "image = next((k for k, each in enumerate(sys.argv) if each.startswith('docker.io/')), None)\n"
        "sys.exit(image and subprocess.run(sys.argv[image + 1 :]).returncode)\n"
    )
    stand_in.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:{os.environ['PATH']}")
    folder = tmp_path / "again"
    status, said = reproduce(deposit(**{"inputs/plan.json": plan}), *OWN, program, "--folder", folder)
    assert status == 0, said
    info, install, run = map(json.loads, (tmp_path / "called").read_text().splitlines())
    assert info == ["info"]
    assert "--network=none" in run and "--network=none" not in install
    for called in (install, run):
        assert {"--rm", "--read-only", "--cap-drop=all", f"--volume={folder}/source:{folder}/source"} <= set(called)
        assert f"--workdir={folder}/source" in called and f"--env=HOME={folder}/source/.home" in called
        assert sum(each.startswith(("--volume", "--mount", "-v")) for each in called) == 1
    status, said = reproduce(deposit(), *OWN, program, "--environment", "here")
    assert status == 2 and "allowed: bwrap, none" in said


def test_isolation_that_is_not_there_is_refused(deposit, reproduce, monkeypatch, tmp_path):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    status, said = reproduce(deposit(), *OWN, "bwrap")
    assert status == 2 and "--isolation bwrap: is not installed, or cannot isolate here" in said
    status, said = reproduce(deposit(), "--own-source", "--yes")
    assert status == 2 and "needed: --isolation none as well" in said
    assert not (tmp_path / "mark").exists()


def test_a_deposit_that_does_not_fit_leaves_nothing_behind(deposit, reproduce, tmp_path, monkeypatch):
    folder = deposit()
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        for file in folder.rglob("*"):
            if file.is_file():
                archive.write(file, f"tiny/{file.relative_to(folder)}")
    monkeypatch.setattr("icha.deposit.strangers_files.shutil.disk_usage", lambda path: SimpleNamespace(free=3))
    status, said = reproduce(tmp_path / "a.zip")
    assert status == 1 and "are needed, and 3 B are free" in said, said
    assert list((tmp_path / "temporary").iterdir()) == []


def test_whatever_differs_of_the_program_is_counted(tmp_path):
    """Of the package and of the workflow, which decides as much."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", *PARTS],
        **{"cwd": REPOSITORY, "capture_output": True, "text": True, "check": True},
    ).stdout.splitlines()
    sums = {name: sha256_of(REPOSITORY / name) for name in listed}

    def changed(sums):
        (tmp_path / "SHA256SUMS").write_text("".join(f"{digest}  source/{name}\n" for name, digest in sums.items()))
        with whole_deposit(tmp_path) as found:
            return changed_files(found)

    assert changed(sums | {"docs/model.md": 64 * "0"}) == 0
    others = dict.fromkeys(("Snakefile", "workflow/rules/runs.smk", "icha/references/literature.json"), 64 * "0")
    assert changed(sums | others) == 3
    del others["Snakefile"], sums["Snakefile"]
    assert changed(sums | others | {"workflow/scripts/more.py": 64 * "0"}) == 4


def test_variables_are_those_on_the_list(monkeypatch):
    kept = {"HOME": "/h", "PATH": "/opt/python@3.11", "LC_ALL": "de_DE@euro", "UV_INDEX": "https://index"}
    others = {"MY_TOKEN": "x", "HOMES": "x", "home": "x", "PIP_INDEX_URL": "https://me:pass@index"}
    others |= {"HTTPS_PROXY": "me:pass@proxy:8080", "http_proxy": "me@proxy"}
    monkeypatch.setattr(os, "environ", kept | others)
    assert surroundings() == kept


def test_a_command_that_is_not_isolated_stays_as_it_is(tmp_path):
    assert isolated("none", ["a", "b"], tmp_path, {}, network=False) == ["a", "b"]


@pytest.mark.parametrize("where", ["pipe.nc", "other.nc"])
def test_a_run_whose_data_are_elsewhere_is_not_followed(where, deposit, reproduce, tmp_path):
    os.mkfifo(tmp_path / "pipe.nc")  # whoever opens it waits
    with h5py.File(tmp_path / "run.nc", "w") as file:
        file["step"] = h5py.ExternalLink(str(tmp_path / where), "/step")
    own = deposit(**{"runs/load/plate/seed0/slope0.5/soft.nc": (tmp_path / "run.nc").read_bytes()})
    status, said = reproduce(own, "--only", "load/plate/seed0/slope0.5/soft")
    assert status == 2 and "soft.nc: is no run: 'step' is a link to another file" in said, said


def test_what_is_called_a_run_and_is_none_is_said(deposit, reproduce):
    own = deposit(**{"runs/no/run.nc": b""})
    status, said = reproduce(own, "--only", "smallest")
    assert status == 2 and "has no such run" in said
    own = deposit(**{"runs/load/plate/seed0/slope0.5/soft.nc": b"no netCDF"})
    status, said = reproduce(own, "--only", "smallest")
    assert status == 2 and re.search("soft.nc: is no run", said), said
