"""Deposits: what is in them, what is not, that they are whole, and that they are the same wherever they are made."""

import base64
import csv
import getpass
import hashlib
import importlib.metadata
import json
import os
import random
import re
import shutil
import subprocess
import sys
import time
import zipfile
import zlib
from pathlib import Path

import matplotlib.pyplot as plt
import netCDF4
import numpy as np
import pytest
import small_campaign as small
import xarray as xr
import yaml
from conftest import REPOSITORY, copy_project, snakemake_command
from icha.deposit.deposit import make_deposit
from icha.deposit.deposit_files import verify_deposit, whole_deposit
from icha.deposit.dictionary import data_dictionary, kind_of
from icha.deposit.source import committed_source
from PIL import Image, PngImagePlugin
from traces import traces
from typer.testing import CliRunner

from icha.analysis.checks import read_checks
from icha.cli import app
from icha.configuration.load import load_configuration
from icha.configuration.named_files import with_files_beside_it
from icha.configuration.publication import KnownFailure
from icha.configuration.settings import campaign_sha256
from icha.deposit import deposit as deposits
from icha.deposit import dictionary
from icha.planning.plan import whole_cost
from icha.support.checksums import write_checksum

# Where and by whom the campaign is run: words that are nowhere else.
PLACE, PERSON, MACHINE, SECRET = "Quittenbaumhof", "zwetschgenwirt", "mirabellenrechner", "hagebuttengeheimnis"
CAMPAIGN = """
name: tiny
title: One file | one material
summary: A height map from a file, and measurements beside it.
license: CC-BY-4.0
surfaces:
  plate: {{kind: file, path: {absolute}/heights of a plate.npy, height_unit: um, period: 10 um}}
materials:
  soft: {{contact_modulus: 25 MPa, surface_energy: 50 mJ/m^2, interaction_range: 40 nm}}
studies:
  load:
    surfaces: [plate]
    rms_slopes: [0.5]
    materials: [soft]
    targets: {{reduced_pressures: [1.0e-3, 3.0e-3, 1.0e-2]}}
measurements:
  lab:
    path: ../measured/areas.csv
    label: laboratory
    citation: Nobody, nowhere.
    study: load
    load: {{column: p, unit: "1"}}
    area: {{column: a, unit: percent}}
figures:
  fig5_multi_slope: {{study: load}}
publication:
  version: "1.0.0"
  date: 2026-01-31
  authors:
    - {{family_names: Carberry, given_names: Josiah, orcid: 0000-0002-1825-0097}}
"""
RUN = "load/plate/seed0/slope0.5/soft"


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A clone in which the campaign was run and published; not to be changed."""
    home = tmp_path_factory.mktemp(PLACE)
    folder = copy_project(REPOSITORY, home / "clone")
    (home / "measured").mkdir()
    np.save(home / "measured/heights of a plate.npy", 1e6 * small.surface().heights)
    (home / "measured/areas.csv").write_text("p,a\n0.001,0.3\n0.01,2\n")
    (home / "asked").mkdir()
    (home / "asked/tiny.yaml").write_text(CAMPAIGN.format(absolute=home / "measured"))
    command, environment = snakemake_command("publish", configuration=home / "asked/tiny.yaml")
    environment |= dict.fromkeys(("USER", "LOGNAME", "USERNAME"), PERSON) | {"HOSTNAME": MACHINE, "TOKEN": SECRET}
    done = subprocess.run(
        command, cwd=folder, env=environment | {"PYTHONPATH": str(folder)}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.fixture(scope="module")
def results(project):
    return project / "results/tiny"


@pytest.fixture(scope="module")
def published(results):
    """The folder of the deposit."""
    return results / "publish/tiny-1.0.0"


@pytest.fixture
def own(published, tmp_path):
    """A copy of the deposit's folder, without most of the source, to be spoilt."""
    folder = shutil.copytree(published, tmp_path / "own", ignore=shutil.ignore_patterns("source"))
    sums = (published / "SHA256SUMS").read_text().splitlines(keepends=True)
    (folder / "SHA256SUMS").write_text("".join(line for line in sums if "  source/" not in line))
    assert verify_deposit(folder) == []
    return folder


def recorded_jobs(project, results, files):
    """What Snakemake recorded of the files of some results, wherever these are now."""
    sys.path.insert(0, str(project / "workflow"))
    try:
        provenance = importlib.import_module("provenance")
    finally:
        sys.path.pop(0)
    home = project.parent
    given = {
        str(home / "measured/heights of a plate.npy"): "inputs/surfaces/plate/heights of a plate.npy",
        str(home / "asked/../measured/areas.csv"): "inputs/measurements/lab/areas.csv",
        "results/tiny/config.used.yaml": "config.used.yaml",
    }
    made = {f"results/tiny/{file}": file for file in files if file not in given.values()}
    return provenance.recorded_jobs(project / ".snakemake/metadata", made, given, scripts=project / "workflow/scripts")


def deposited(project, published):
    """The files of the results that were published."""
    with whole_deposit(published) as found:
        there = {path for path in found.sizes if not path.startswith("source/")}
    return sorted(path for path in there if (project / "results/tiny" / path).is_file())


def publish(project, published, results, folder, **changed):
    """Make the deposit of some results in this process."""
    campaign = load_configuration(results / "config.used.yaml").campaign
    files = deposited(project, published)
    settings = {
        "results": results,
        "files": files,
        "publication": campaign.published(),
        "campaign": campaign,
        "source": committed_source(project),
        "jobs": recorded_jobs(project, results, files),
        "cost": whole_cost(campaign, results),
    }
    make_deposit(folder, f"{folder}.zip", **settings | changed)
    return folder


def files_of(folder):
    return {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}


# What is in it.


def test_a_deposit_has_everything_and_nothing_else(project, published):
    there = files_of(published)
    tops = {path.split("/")[0] for path in there}
    assert tops == {
        *("README.md", "LICENSE.txt", "CITATION.cff", ".zenodo.json", "datacite.json", "ro-crate-metadata.json"),
        *("data_dictionary.csv", "SHA256SUMS", "config.used.yaml", "inputs", "dataset", "aggregated", "runs"),
        *("surfaces", "references", "figures", "report.html", "checks.json", "verdict.txt", "source"),
    }
    for path in deposited(project, published):
        assert there[path].read_bytes() == (project / "results/tiny" / path).read_bytes()
    assert f"runs/{RUN}.nc" in there and "figures/fig5_multi_slope.pdf" in there
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=project, capture_output=True).stdout.decode()
    source = {path.removeprefix("source/") for path in there if path.startswith("source/")}
    assert source == set(listed.split("\0")[:-1])
    assert {"Snakefile", "uv.lock", "LICENSE", "icha/asperity/jkr.py", ".gitignore"} <= source
    for path in source:
        assert there[f"source/{path}"].read_bytes() == (project / path).read_bytes()


def test_sha256sum_accepts_it_sorted_and_in_the_zip(published, tmp_path):
    command = ["sha256sum", "--check", "--strict", "--quiet", "SHA256SUMS"]
    assert subprocess.run(command, cwd=published).returncode == 0
    names = [line[66:] for line in (published / "SHA256SUMS").read_text().splitlines()]
    assert names == sorted(names) and {*names, "SHA256SUMS"} == set(files_of(published))
    with zipfile.ZipFile(f"{published}.zip") as archive:
        entries = archive.infolist()
        archive.extractall(tmp_path)
    assert [entry.filename for entry in entries] == sorted(f"tiny-1.0.0/{name}" for name in [*names, "SHA256SUMS"])
    assert {entry.compress_type for entry in entries} == {zipfile.ZIP_STORED}
    assert {entry.date_time for entry in entries} == {(1980, 1, 1, 0, 0, 0)}
    assert {entry.external_attr >> 16 for entry in entries} <= {0o100644, 0o100755}
    assert subprocess.run(command, cwd=tmp_path / "tiny-1.0.0").returncode == 0


def test_the_configuration_is_the_same_campaign_and_names_its_files_in_the_deposit(project, published):
    asked = load_configuration(project.parent / "asked/tiny.yaml").campaign
    kept = load_configuration(published / "config.used.yaml").campaign
    assert campaign_sha256(kept) == campaign_sha256(asked)
    text = yaml.safe_load((published / "config.used.yaml").read_text())
    assert text["surfaces"]["plate"]["path"] == "inputs/surfaces/plate/heights of a plate.npy"
    assert text["measurements"]["lab"]["path"] == "inputs/measurements/lab/areas.csv"
    for section, name, path in (("surfaces", "plate", "heights of a plate.npy"), ("measurements", "lab", "areas.csv")):
        copy = published / "inputs" / section / name / path
        assert copy.read_bytes() == (project.parent / "measured" / path).read_bytes()
    with netCDF4.Dataset(published / f"runs/{RUN}.nc") as run, netCDF4.Dataset(published / "dataset/tiny.nc") as tree:
        assert run.config_sha256 != tree.config_sha256 == campaign_sha256(kept)


def test_files_are_kept_with_the_configuration_whatever_names_them(tmp_path):
    campaign = yaml.safe_load(CAMPAIGN.format(absolute=tmp_path))
    scans = {"height_unit": "nm", "size": "10 um", "boundary": "mirror"}
    campaign["defaults"] = {"surfaces": {"path": "scan.txt", "kind": "measured"} | scans}
    campaign["surfaces"] = {
        "one": None,
        "other": {"path": "sub/scan.txt"},
        "idle": {"path": "/nobody/knows/scan.txt"},
        "random": {
            "kind": "self_affine",
            **{"period": "10 um", "rolloff_wavelength": "5 um", "short_wavelength": "2 um", "hurst": 0.8, "grid": 16},
        },
    }
    campaign["studies"]["load"]["surfaces"] = ["one", "other", "random"]
    campaign["studies"]["load"]["vary"] = {"grid": [16, 32]}
    (tmp_path / "sub").mkdir()
    heights = np.round(1e9 * small.surface().heights, 3)
    np.savetxt(tmp_path / "scan.txt", heights)
    np.savetxt(tmp_path / "sub/scan.txt", 2 * heights.T)
    (tmp_path / "areas.csv").write_text("p,a\n0.001,0.3\n")
    campaign["measurements"]["lab"]["path"] = str(tmp_path / "areas.csv")
    (tmp_path / "asked.yaml").write_text(yaml.safe_dump(campaign))
    asked = load_configuration(tmp_path / "asked.yaml")
    text, files = with_files_beside_it(asked)
    assert str(tmp_path) not in text and "nobody" not in text
    kept = tmp_path / "kept"
    for place, file in files.items():
        (kept / place).parent.mkdir(parents=True)
        shutil.copyfile(file, kept / place)
    assert sorted(files) == [
        "inputs/measurements/lab/areas.csv",
        "inputs/surfaces/one/scan.txt",
        "inputs/surfaces/other/scan.txt",
    ]
    (kept / "config.used.yaml").write_text(text)
    again = load_configuration(kept / "config.used.yaml")
    assert campaign_sha256(again.campaign) == campaign_sha256(asked.campaign)
    assert with_files_beside_it(again) == (text, {place: str(kept / place) for place in files})


def test_the_dictionary_has_every_variable_and_no_other(published):
    with open(published / "data_dictionary.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    told = {(row["file"], row["group"], row["variable"]): int(row["files"]) for row in rows}
    assert len(told) == len(rows)
    there = {}
    for path in files_of(published):
        if path.endswith(".nc"):
            with netCDF4.Dataset(published / path) as data:
                for group in (data, *data.groups.values()):
                    for name in group.variables:
                        key = (kind_of(path), group.path, name)
                        there[key] = there.get(key, 0) + 1
    assert told == there
    assert all(row["units"] and row["long_name"] for row in rows)
    (row,) = (r for r in rows if r["file"].startswith("runs/") and r["variable"] == "contact_area_fraction")
    area = xr.load_dataset(published / f"runs/{RUN}.nc").contact_area_fraction
    assert (float(row["smallest"]), float(row["largest"])) == (float(area.min()), float(area.max()))
    assert (row["dimensions"], row["type"]) == ("step", "float64")
    (status,) = (r for r in rows if r["file"] == "dataset/tiny.nc" and r["variable"] == "status")
    assert status["flags"].startswith("0: complete, 1: incomplete")
    (kind,) = (r for r in rows if r["file"].startswith("runs/") and r["variable"] == "step_kind")
    assert (kind["type"], kind["dimensions"], kind["smallest"]) == ("text", "step", "")


def test_ranges_leave_out_what_is_missing_and_do_not_hang_on_the_size_of_blocks(tmp_path, monkeypatch):
    values = np.random.default_rng(1).normal(size=(7, 5))
    values[2, 3], values[0, 0], values[6, 4] = np.nan, 1e30, -1e30
    with netCDF4.Dataset(tmp_path / "a.nc", "w") as file:
        group = file.createGroup("g")
        for dim, size in zip("xy", values.shape, strict=True):
            group.createDimension(dim, size)
        group.createVariable("v", "f8", ("x", "y"), fill_value=-1e30)[:] = values
        group.createVariable("none", "i4", ("y",), fill_value=-9)[:] = -9
    wanted = (float(np.nanmin(np.where(values == -1e30, np.nan, values))), 1e30)
    for block in (1, 8, 10**6):
        monkeypatch.setattr(dictionary, "_BLOCK", block)
        first, second = data_dictionary(tmp_path, ["a.nc", "b.txt"])
        assert (first.group, first.variable, first.smallest, first.largest) == ("/g", "v", *wanted)
        assert (second.smallest, second.largest) == (None, None) and second.missing.startswith("-9")


def test_the_page_for_readers_tells_the_numbers(published):
    page = (published / "README.md").read_text(encoding="utf-8")
    assert page.startswith("# One file \\| one material\n")
    for said in (
        "Carberry, Josiah (2026): One file | one material. Version 1.0.0".replace("|", "\\|"),
        "| made by | ORCID |\n|---|---|\n| Josiah Carberry | <https://orcid.org/0000-0002-1825-0097> |\n",
        "> G. Violano and L. Afferrante, Modeling the adhesive contact of rough soft media",
        "Every run that was asked for is here and complete.",
        "| completed | 1 | 0 | 0 | 0 if the run reached the end of its path, else 1 |",
        "| load | asperities | plate | 0 | 0.5 | soft | 1 | 1 | 0 |",
        "| soft | 2.5e+07 | 0.05 | 4e-08 |",
        "sha256sum -c SHA256SUMS",
        committed_commit(published),
    ):
        assert said in page, said
    checks = read_checks(published / "checks.json")
    assert f"{len(checks)} of {len(checks)} checks passed" in page
    residual = max(check.value for check in checks if check.name == "residual")
    assert f"| residual | 1 | {residual:.2g} | 1e-08 |" in page
    computed = ("dataset", "aggregated", "runs", "surfaces", "references", "figures")
    computed += ("report.html", "checks.json", "verdict.txt")
    there = sum(path.stat().st_size for name, path in files_of(published).items() if name.split("/")[0] in computed)
    ((told, unit),) = re.findall(r"The results take ([\d.]+) (kB|MB) of disk", page)
    assert float(told) * {"kB": 1e3, "MB": 1e6}[unit] == pytest.approx(there, rel=6e-3)
    assert "fails again" not in page and "did not reach" not in page
    # Every path that it names is there, but for pages that only a whole clone has.
    for path in re.findall(r"`([\w./-]+)`", page):
        if "/" in path and not path.startswith("source/docs/"):
            assert (published / path).exists(), path


def committed_commit(published):
    return yaml.safe_load((published / "CITATION.cff").read_text())["commit"]


def test_its_example_runs_in_the_deposit_and_draws_the_data(published, monkeypatch):
    page = (published / "README.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(published)
    plt.switch_backend("Agg")
    plt.close("all")
    exec(compile(example, "README.md", "exec"), {})
    (line,) = plt.gca().lines
    run = xr.load_dataset(published / f"runs/{RUN}.nc")
    np.testing.assert_array_equal(line.get_ydata(), run.contact_area_fraction)
    np.testing.assert_array_equal(line.get_xdata(), run.reduced_pressure)
    assert line.get_label() == "soft"
    plt.close("all")
    assert verify_deposit(published) == []


# What is not in it.


def test_nothing_tells_where_when_or_by_whom_it_was_made(project, published):
    files = files_of(published)
    own = [path for name, path in files.items() if not name.startswith("source/")]
    public = b"\0".join(path.read_bytes() for name, path in files.items() if name.startswith("source/"))
    home = str(Path.home()).rstrip("/")
    words = [
        PLACE,
        PERSON,
        MACHINE,
        SECRET,
        str(project),
        str(project.parent.parent),
        f"{home}/",
        str(REPOSITORY) + "/",
    ]
    words += [name for name in (getpass.getuser(), os.uname().nodename) if len(name) > 4]
    settings = [part for value in os.environ.values() for part in (value, *value.split(os.pathsep))]
    words += [value for value in settings if len(value) > 8 and value.encode() not in public]
    words = sorted({word.encode() for word in words if len(word) > 4})
    finished = time.time()
    assert traces(own, words, (finished - 86400, finished)) == []
    # The list of entries of the zip, and what is between them; its files are those of the folder.
    archive = Path(f"{published}.zip").read_bytes()
    for word in (PLACE, PERSON, MACHINE, SECRET, str(project.parent.parent)):
        assert word.encode() not in archive
    with zipfile.ZipFile(f"{published}.zip") as opened:
        assert opened.comment == b"" and not any(info.extra or info.comment for info in opened.infolist())


def planted_png(path):
    chunks = PngImagePlugin.PngInfo()
    chunks.add_text("Author", f"by {PERSON}", zip=True)
    Image.new("L", (2, 2)).save(path, pnginfo=chunks)


def planted_netcdf(path, text="variable"):
    with netCDF4.Dataset(path, "w") as file:
        if text == "attribute":
            file.history = f"by {PERSON}"
            return
        file.createDimension("n", 3000)
        values = np.frombuffer((PERSON + " " * (3000 - len(PERSON))).encode(), "S1")
        file.createVariable("v", "S1", ("n",), zlib=True)[:] = values


def test_traces_are_found_wherever_they_hide(published, tmp_path):
    word = PERSON.encode()
    planted_netcdf(tmp_path / "a.nc", "attribute")
    planted_netcdf(tmp_path / "b.nc")
    planted_png(tmp_path / "c.png")
    (tmp_path / "d.pdf").write_bytes(b"%PDF-1.4\n1 0 obj\nstream\n" + zlib.compress(b"by " + word) + b"\nendstream\n")
    (tmp_path / "e.html").write_bytes(
        b"<img src='data:image/png;base64," + base64.b64encode((tmp_path / "c.png").read_bytes())
    )
    with zipfile.ZipFile(tmp_path / "f.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(tmp_path / "b.nc", "b.nc")
    (tmp_path / "g.json").write_text(json.dumps({"by": PERSON}))
    for path in sorted(tmp_path.iterdir()):
        hidden = path.suffix not in (".json",) and path.name != "a.nc"
        assert hidden == (word not in path.read_bytes()), path
        assert traces([path], [word]), path
        assert not traces([path], [b"somebody else"]) or path.suffix == ".zip"
    times = ["2026-01-31T10:11:12Z", "2026-01-31 10:11", "D:20260131101112+00'00", "Sat Jan 31 10:11:12 2026"]
    for number, text in enumerate([*times, "1795292701.8"]):
        file = tmp_path / f"{number}.txt"
        file.write_text(f"made at {text}\n")
        assert traces([file], [], (1795292000, 1795293000)), text
    (tmp_path / "day.txt").write_text("2026-01-31, 0.1795292701, 17952927010, version 1.10.11")
    assert not traces([tmp_path / "day.txt"], [], (1795292000, 1795293000))


def test_the_same_results_elsewhere_give_the_same_bytes(project, published, tmp_path, monkeypatch):
    clone = tmp_path / "another_clone"
    shutil.copytree(project, clone, ignore=shutil.ignore_patterns("results", ".snakemake"))
    results = shutil.copytree(
        project / "results/tiny", tmp_path / "elsewhere", ignore=shutil.ignore_patterns("publish")
    )
    for path in results.rglob("*"):
        os.utime(path, (1e9, 1e9))
    monkeypatch.chdir(tmp_path)
    before = os.umask(0o077)
    try:
        folder = publish(project, published, results, tmp_path / "there/tiny-1.0.0", source=committed_source(clone))
    finally:
        os.umask(before)
    assert (folder.parent / "tiny-1.0.0.zip").read_bytes() == Path(f"{published}.zip").read_bytes()
    assert {name: path.read_bytes() for name, path in files_of(folder).items()} == {
        name: path.read_bytes() for name, path in files_of(published).items()
    }
    assert {path.stat().st_mode & 0o777 for path in files_of(folder).values()} <= {0o644, 0o755}


# Whole, or not at all.


def test_what_fails_leaves_the_deposit_that_was_there(project, published, results, tmp_path, monkeypatch):
    folder = publish(project, published, results, tmp_path / "out/tiny-1.0.0")
    publish(project, published, results, tmp_path / "out/tiny-0.9.0")
    there = sorted(path.name for path in folder.parent.iterdir())
    assert there == ["tiny-0.9.0", "tiny-0.9.0.zip", "tiny-1.0.0", "tiny-1.0.0.zip"]
    first = Path(f"{folder}.zip").read_bytes()
    with pytest.raises(ValueError, match="no job"):
        publish(project, published, results, folder, jobs=[])

    def full(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(deposits, "_write_zip", full)
    with pytest.raises(OSError, match="No space left"):
        publish(project, published, results, folder)
    assert sorted(path.name for path in folder.parent.iterdir()) == there
    assert verify_deposit(folder) == [] and Path(f"{folder}.zip").read_bytes() == first
    # What a call that was killed has left is in nobody's way.
    monkeypatch.undo()
    (folder.parent / ".tiny-1.0.0.part/dataset").mkdir(parents=True)
    (folder.parent / ".tiny-1.0.0.part/dataset/half.nc").write_text("half")
    publish(project, published, results, folder)
    assert sorted(path.name for path in folder.parent.iterdir()) == there
    assert Path(f"{folder}.zip").read_bytes() == first


def test_results_that_are_not_what_was_written_are_refused(project, published, results, tmp_path):
    spoilt = shutil.copytree(results, tmp_path / "spoilt", ignore=shutil.ignore_patterns("publish"))
    figure = spoilt / "figures/fig5_multi_slope.png"
    write_checksum(spoilt, "figures/fig5_multi_slope.png")
    content, times = bytearray(figure.read_bytes()), figure.stat()
    content[len(content) // 2] ^= 1
    figure.write_bytes(content)
    os.utime(figure, ns=(times.st_atime_ns, times.st_mtime_ns))
    with pytest.raises(ValueError, match=r"not what was written(.|\n)*figures/fig5_multi_slope.png"):
        publish(project, published, spoilt, tmp_path / "out/tiny-1.0.0")
    assert not (tmp_path / "out").exists()


def test_failures_are_published_only_with_their_reason(project, published, results, tmp_path):
    failed = shutil.copytree(results, tmp_path / "failed", ignore=shutil.ignore_patterns("publish", "checksums"))
    checks = json.loads((failed / "checks.json").read_text())
    (residual,) = (check for check in checks if check["name"] == "residual")
    assert residual["subject"] == RUN
    residual |= {"value": 1e-3, "passed": False}
    (failed / "checks.json").write_text(json.dumps(checks))
    own = load_configuration(failed / "config.used.yaml").campaign.published()
    out = tmp_path / "out/tiny-1.0.0"
    with pytest.raises(ValueError, match=f"not published(.|\n)*{RUN}: residual"):
        publish(project, published, failed, out)
    known = [KnownFailure(run=RUN, reason="It | shows what stiff springs do.")]
    with pytest.raises(ValueError, match=f"{RUN}: is said to fail"):
        publish(project, published, results, out, publication=own.model_copy(update={"known_failures": known}))
    assert not out.parent.exists()
    publish(project, published, failed, out, publication=own.model_copy(update={"known_failures": known}))
    page = (out / "README.md").read_text(encoding="utf-8")
    assert f"| {RUN} | residual | 0.001 | 1e-08 | It \\| shows what stiff springs do. |" in page
    assert "What failed here fails again: these runs are listed in\n`config.used.yaml`" in page
    assert f"{len(checks) - 1} of {len(checks)} checks passed" in page


@pytest.mark.parametrize("name", ["heights\n.npy", "a\x1b[2J.npy", "a\\b.npy", "x" * 256])
def test_names_that_verify_would_refuse_are_not_published(name, tmp_path):
    with pytest.raises(ValueError, match="not published, for these names; needed: others"):
        make_deposit(
            tmp_path / "tiny",
            tmp_path / "tiny.zip",
            results=tmp_path,
            files=[f"inputs/{name}"],
            publication=None,
            campaign=None,
            source=None,
            jobs=(),
            cost=None,
        )
    assert list(tmp_path.iterdir()) == []


# Verified.


def test_whole_deposits_are_said_to_be_whole(published):
    for path in (published, Path(f"{published}.zip")):
        called = CliRunner().invoke(app, ["verify", str(path)])
        assert called.exit_code == 0, called.output
        assert f"whole: {len(files_of(published))} files, " in called.output
    nothing = CliRunner().invoke(app, ["verify", "nothing.zip"])
    assert nothing.exit_code == 2 and "nothing.zip: no such file or folder" in nothing.output


@pytest.mark.slow
@pytest.mark.parametrize("own_source", [[], ["--own-source", "--yes", "--environment", "here"]])
def test_computed_again_it_has_the_same_bytes(own_source, published, tmp_path):
    """By what is installed, and by its own source without the repository: every file of the results."""
    archive = published.with_name(f"{published.name}.zip")
    asked = [*own_source, "--folder", str(tmp_path / "again"), "--json", str(tmp_path / "out.json")]
    done = CliRunner().invoke(app, ["reproduce", str(archive), *asked])
    assert done.exit_code == 0, done.output
    files = json.loads((tmp_path / "out.json").read_text())["files"]
    assert {file["path"].split("/")[0] for file in files} == {
        *("dataset", "runs", "surfaces", "references", "aggregated", "figures"),
        *("report.html", "checks.json", "verdict.txt"),
    }
    with whole_deposit(published) as found:
        assert len(files) == sum(file.endswith((".nc", ".png", ".pdf")) for file in found.sizes) + 3
    assert {file["verdict"] for file in files} == {"identical"} and not any(file["variables"] for file in files)


def test_whatever_is_done_to_the_folder_is_said(own):
    figure, run = own / "figures/fig5_multi_slope.png", own / f"runs/{RUN}.nc"
    content = bytearray(figure.read_bytes())
    content[100] ^= 4
    figure.write_bytes(content)
    run.write_bytes(run.read_bytes()[:-1])
    (own / "verdict.txt").rename(own / "Verdict.txt")
    (own / "LICENSE.txt").unlink()
    (own / ".DS_Store").write_text("")
    (own / "report.html").rename(own / "elsewhere")
    (own / "report.html").symlink_to("elsewhere")
    called = CliRunner().invoke(app, ["verify", str(own)])
    assert called.exit_code == 1
    for line in (
        "figures/fig5_multi_slope.png: is not what it was: its checksum is another one",
        f"runs/{RUN}.nc: is not what it was: its checksum is another one",
        "verdict.txt: is missing",
        "Verdict.txt: was added: it is not in SHA256SUMS",
        "LICENSE.txt: is missing",
        ".DS_Store: was added: it is not in SHA256SUMS",
        "report.html: is no file of its own",
        "elsewhere: was added: it is not in SHA256SUMS",
    ):
        assert line in called.stdout.splitlines(), line
    assert len(called.stdout.splitlines()) == 8 and "not whole: 8 problems" in called.stderr


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("no checksum\n", "line 1: 'no checksum' is no checksum"),
        (f"{'0' * 64}  ../outside\n", "is no checksum of a file in this folder"),
        (f"{'0' * 64}  /etc/passwd\n", "is no checksum of a file in this folder"),
        (f"{'0' * 64}  README.md\n{'0' * 64}  README.md\n", "README.md is named twice"),
        ("\udcff\n", "SHA256SUMS: cannot be read"),
        ("", "README.md: was added"),
    ],
)
def test_lists_that_are_none_are_said(own, text, said):
    (own / "SHA256SUMS").write_bytes(text.encode("utf-8", "surrogateescape"))
    assert any(said in line for line in verify_deposit(own))
    (own / "SHA256SUMS").unlink()
    assert verify_deposit(own) == ["SHA256SUMS: is missing, so this is no whole deposit"]


def test_a_spoilt_zip_is_said_to_be_or_has_the_same_files(own, tmp_path):
    whole = tmp_path / "own.zip"
    deposits._write_zip(whole, own, "tiny")
    assert verify_deposit(whole) == []
    content = whole.read_bytes()
    files = {f"tiny/{name}": path.read_bytes() for name, path in files_of(own).items()}
    chance = random.Random(1)
    spoilt, said = tmp_path / "spoilt.zip", 0
    listed_from = content.index(b"PK\x01\x02")
    for trial in range(120):
        # Half of them in the entries at the end, where there is little else than names and sizes.
        place = chance.randrange(listed_from if trial % 2 else 0, len(content))
        changed = bytearray(content)
        changed[place] ^= 1 << chance.randrange(8)
        spoilt.write_bytes(changed)
        if verify_deposit(spoilt):
            said += 1
            continue
        with zipfile.ZipFile(spoilt) as archive:
            assert {info.filename: archive.read(info) for info in archive.infolist()} == files, place
    assert said > 60
    for _ in range(20):
        spoilt.write_bytes(content[: chance.randrange(len(content))])
        assert verify_deposit(spoilt)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["tiny/README.md", "tiny/more.txt"], "more.txt: was added"),
        (["tiny/README.md", "tiny/README.md"], "more than once"),
        (["tiny/README.md", "other/README.md"], "a single folder"),
        (["tiny/README.md", "README.md"], "a single folder"),
        ([], "README.md: is missing"),
    ],
)
def test_zips_with_other_files_are_said(tmp_path, names, said):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("tiny/SHA256SUMS", f"{hashlib.sha256(b'read').hexdigest()}  README.md\n")
        for name in names:
            with pytest.warns() if name in archive.namelist() else open(os.devnull):
                archive.writestr(name, b"read")
    assert any(said in line for line in verify_deposit(tmp_path / "a.zip"))
