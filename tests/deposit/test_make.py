"""Deposits: what is in them, what is not, that they are whole, and that they are the same wherever they are made."""

import csv
import json
import os
import shutil
import subprocess
from collections import Counter
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import small_campaign as small
import yaml
from conftest import REPOSITORY, SPOTS
from outside_validators import problems_with
from tiny_campaign import CAMPAIGN as TINY

from icha.configuration.cases import campaign_sha256
from icha.configuration.load import collect_inputs, load_configuration
from icha.configuration.publication import KnownFailure
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import write_dataset
from icha.deposit import make
from icha.deposit.dictionary import file_pattern
from icha.deposit.make import make_deposit, refuse_mixed
from icha.deposit.program import Source
from icha.planning.costs import Cost
from icha.planning.results import campaign_files, expected_stamps
from icha.support.checksums import CHECKSUMS, write_checksums

DEPOSIT = "results/smoke/publish/smoke-0.0.1"


def files_of(folder):
    return {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}


# Made by the workflow: the campaign `smoke`.


def test_a_deposit_has_everything_and_nothing_else(smoke):
    present = files_of(smoke / DEPOSIT)
    assert problems_with(smoke / DEPOSIT) == []
    subprocess.run(["sha256sum", "--quiet", "--check", "--strict", CHECKSUMS], cwd=smoke / DEPOSIT, check=True)
    assert {path.split("/")[0] for path in present} == {
        *("README.md", "CITATION.cff", ".zenodo.json", "ro-crate-metadata.json"),
        *("data_dictionary.csv", "SHA256SUMS", "config.used.yaml", "inputs", "dataset", "aggregated", "runs"),
        *("surfaces", "references", "figures", "report.html", "checks.json", "verdict.txt", "source"),
    }
    assert present["inputs/figures/spots/spots.py"].read_text() == SPOTS
    assert present["figures/spots.txt"].read_text() == "Number of spots against load.\n"
    assert "Number of spots against load." in present["report.html"].read_text()
    head = subprocess.run(["git", "rev-parse", "HEAD"], cwd=smoke, capture_output=True, text=True).stdout.strip()
    assert yaml.safe_load(present["CITATION.cff"].read_text())["commit"] == head
    for path, file in present.items():
        top, _, rest = path.partition("/")
        original = smoke / rest if top == "source" else smoke / "results/smoke" / path
        if path != CHECKSUMS and original.is_file():
            assert file.read_bytes() == original.read_bytes(), path


def test_the_dictionary_has_every_variable_and_no_other(smoke):
    with open(smoke / DEPOSIT / "data_dictionary.csv", encoding="utf-8", newline="") as file:
        listed = list(csv.DictReader(file))
    rows = {(row["file"], row["group"], row["variable"]): row for row in listed}
    stated, counts = Counter(), Counter()
    for row in listed:  # a variable whose unit is not the same everywhere has several rows
        stated[row["file"], row["group"], row["variable"]] += int(row["files"])
    for path, file in files_of(smoke / DEPOSIT).items():
        if path.endswith(".nc"):
            with netCDF4.Dataset(file) as data:
                for group in (data, *data.groups.values()):
                    counts.update((file_pattern(path), group.path, name) for name in group.variables)
        elif path.startswith(("dataset/", "figures/")) and path.endswith(".csv"):
            header = file.read_text(encoding="utf-8").partition("\n")[0]
            counts.update((file_pattern(path), "", column) for column in header.split(","))
    assert stated == counts
    assert all(row["long_name"] for row in listed)
    assert all(row["units"] for row in listed if not row["file"].startswith("figures/"))
    run = file_pattern("runs/challenge/challenge/seed1/slope1/cmc.nc"), "/"
    found = [rows[*run, name] for name in ("contact_area_fraction", "step_kind")]
    assert [(row["dimensions"], row["type"]) for row in found] == [("step", "float64"), ("step", "text")]
    assert rows["dataset/smoke.nc", "/challenge", "status"]["flags"].startswith("0: complete, 1: incomplete")


# Made in this process.

PUBLICATION = """
publication:
  version: "1.0.0"
  date: 2026-01-31
  authors: [{name: The team}]
"""


def check(run, value):
    """A check of a run, by the path of its file."""
    facts = {"limit": 1e-8, "passed": value <= 1e-8, "description": "error of the equilibrium"}
    return {"subject": run[5:-3], "name": "residual", "value": value, **facts}


@pytest.fixture
def campaign(tmp_path):
    """A campaign and its results: runs and a dataset that belong together, and all checks passed."""
    results = tmp_path / "results"
    results.mkdir()
    (results / "config.used.yaml").write_text(TINY + PUBLICATION)
    campaign = load_configuration(results / "config.used.yaml").campaign
    files, stamps, runs = campaign_files(campaign), expected_stamps(campaign), []
    for path, case in files.runs.items():
        run = small.run(case.seed, material="hertz").assign_attrs(stamps[path])
        runs.append((case, run))
        (results / path).parent.mkdir(parents=True, exist_ok=True)
        write_dataset(run, results / path)
    write_dataset(
        campaign_tree(runs, attrs={"campaign": "small", "config_sha256": campaign_sha256(campaign)}),
        results / files.dataset,
    )
    (results / "checks.json").write_text(json.dumps([check(run, 1e-12) for run in files.runs]))
    write_checksums(results, [str(results / path) for path in (*files.runs, files.dataset)], results / CHECKSUMS)
    return campaign, results


def published_as(folder, campaign, results):
    files = [path for path in files_of(results) if path != CHECKSUMS]
    make_deposit(
        folder,
        f"{folder}.zip",
        results=results,
        files=files,
        campaign=campaign,
        source=Source("revision", {"Snakefile": REPOSITORY / "Snakefile", "LICENSE": REPOSITORY / "LICENSE"}),
        cost=Cost(60.0, 2e8, 7e6),
    )
    return folder


def test_the_same_results_give_the_same_bytes_and_what_fails_leaves_them(campaign, tmp_path, monkeypatch):
    first = published_as(tmp_path / "out/small-1.0.0", *campaign)
    assert problems_with(first) == problems_with(f"{first}.zip") == []
    for path in campaign[1].rglob("*"):
        os.utime(path, (1e9, 1e9))
    before = os.umask(0o077)
    try:
        other = published_as(tmp_path / "there/small-1.0.0", *campaign)
    finally:
        os.umask(before)
    content = Path(f"{first}.zip").read_bytes()
    assert Path(f"{other}.zip").read_bytes() == content
    assert {path.stat().st_mode & 0o777 for path in files_of(other).values()} == {0o644}

    # Whole, or not at all; what a call that was killed has left is in nobody's way.
    def full(*arguments):
        raise OSError(28, "No space left on device")

    (tmp_path / "out/.small-1.0.0.part/dataset").mkdir(parents=True)
    with monkeypatch.context() as patched, pytest.raises(OSError, match="No space left"):
        patched.setattr(make, "_write_zip", full)
        published_as(first, *campaign)
    published_as(first, *campaign)
    assert sorted(path.name for path in first.parent.iterdir()) == ["small-1.0.0", "small-1.0.0.zip"]
    assert problems_with(first) == [] and Path(f"{first}.zip").read_bytes() == content


def test_failures_are_published_only_with_a_reason(campaign, tmp_path):
    campaign, results = campaign
    runs, out = list(campaign_files(campaign).runs), tmp_path / "out/small-1.0.0"
    (results / "checks.json").write_text(json.dumps([check(runs[0], 1e-3), check(runs[1], 1e-12)]))
    with pytest.raises(ValueError, match=f"{runs[0][5:-3]}: residual"):
        published_as(out, campaign, results)
    known = [KnownFailure(run=runs[0][5:-3], reason="It | shows what stiff springs do.")]
    publication = campaign.publication.model_copy(update={"known_failures": known})
    campaign = campaign.model_copy(update={"publication": publication})
    published_as(out, campaign, results)
    page = (out / "README.md").read_text(encoding="utf-8")
    assert (
        "| residual | 0.001 | 1e-08 | It \\| shows what stiff springs do. |" in page and "1 of 2 checks passed" in page
    )
    (results / "checks.json").write_text(json.dumps([check(run, 1e-12) for run in runs]))
    with pytest.raises(ValueError, match="is listed as a known failure"):
        published_as(out, campaign, results)


@pytest.mark.parametrize("name", ["heights\n.npy", "a\x1b[2J.npy", "a\\b.npy"])
def test_names_that_verify_would_refuse_are_not_published(name, campaign, tmp_path):
    (campaign[1] / "inputs").mkdir()
    (campaign[1] / "inputs" / name).touch()
    with pytest.raises(ValueError, match="not published, because some systems refuse these file names"):
        published_as(tmp_path / "out/small-1.0.0", *campaign)
    assert files_of(tmp_path / "out") == {}


def test_results_that_do_not_belong_together_are_refused(campaign):
    campaign, results = campaign
    files = campaign_files(campaign)
    refuse_mixed(results, campaign)
    path = next(iter(files.runs))
    content, times = (results / path).read_bytes(), (results / path).stat()
    # One bit, far from the attributes.
    damaged = bytearray(content)
    damaged[-9] ^= 1
    (results / path).write_bytes(damaged)
    os.utime(results / path, ns=(times.st_atime_ns, times.st_mtime_ns))
    with pytest.raises(ValueError, match=rf"have changed since their jobs wrote them(.|\n)*{path}"):
        refuse_mixed(results, campaign)
    # A run of another program.
    run = small.run(1, material="hertz").assign_attrs(expected_stamps(campaign)[path])
    write_dataset(run.assign_attrs(program_sha256="0" * 64), results / path)
    with pytest.raises(ValueError, match=f"{path}: it was computed by another version of the program"):
        refuse_mixed(results, campaign)
    (results / path).write_bytes(content)
    write_dataset(campaign_tree(list(small.runs()), attrs={"config_sha256": "0" * 64}), results / files.dataset)
    with pytest.raises(ValueError, match=r"dataset/tiny.nc was not computed with the settings of the campaign"):
        refuse_mixed(results, campaign)


def test_files_are_stored_with_the_configuration(tmp_path):
    campaign = yaml.safe_load(TINY)
    scans = {"height_unit": "nm", "size": "10 um", "boundary": "mirror"}
    campaign["defaults"] = {"surfaces": {"path": "scan.txt", "kind": "measured"} | scans}
    campaign["surfaces"] = {"one": None, "other": {"path": "sub/scan.txt"}, "idle": {"path": "/nobody/knows/scan.txt"}}
    campaign["studies"]["load"] |= {"surfaces": ["one", "other"], "rms_slopes": [0.5]}
    campaign["defaults"]["materials"] = {"surface_energy": {"file": "map.npy", "unit": "mJ/m^2"}}
    campaign["materials"]["soft"].pop("surface_energy")
    campaign["materials"]["soft"].pop("contact_modulus")
    campaign["defaults"]["materials"]["contact_modulus"] = "30 TPa"
    campaign["confirmed"] = ["defaults.materials.contact_modulus"]
    campaign["studies"]["load"]["models"] = ["boundary_elements"]
    campaign["figures"] = {"spots": {"study": "load", "script": "spots.py"}}
    columns = {"load": {"column": "p", "unit": "1"}, "area": {"column": "a", "unit": "percent"}}
    lab = {"path": str(tmp_path / "areas.csv"), "label": "laboratory", "citation": "Nobody, nowhere.", "study": "load"}
    campaign["measurements"] = {"lab": lab | columns}
    (tmp_path / "sub").mkdir()
    np.savetxt(tmp_path / "scan.txt", np.round(1e9 * small.surface().heights, 3))
    np.savetxt(tmp_path / "sub/scan.txt", np.round(2e9 * small.surface().heights.T, 3))
    (tmp_path / "areas.csv").write_text("p,a\n0.001,0.3\n")
    works = np.random.default_rng(1).uniform(10, 50, (64, 64))
    np.save(tmp_path / "map.npy", works)
    (tmp_path / "spots.py").write_text(f"import labels\n{SPOTS}")
    (tmp_path / "labels.py").write_text("SPOTS = 'spots'\n")
    (tmp_path / "asked.yaml").write_text(yaml.safe_dump(campaign))
    asked = load_configuration(tmp_path / "asked.yaml")
    text, files = collect_inputs(asked)
    assert str(tmp_path) not in text and "nobody" not in text
    places = "figures/spots/labels.py", "figures/spots/spots.py", "materials/soft/map.npy", "measurements/lab/areas.csv"
    places += "surfaces/one/scan.txt", "surfaces/other/scan.txt"
    assert sorted(files) == [f"inputs/{place}" for place in places]
    kept = tmp_path / "kept"
    for place, file in files.items():
        (kept / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, kept / place)
    (kept / "config.used.yaml").write_text(text)
    again = load_configuration(kept / "config.used.yaml")
    assert campaign_sha256(again.campaign) == campaign_sha256(asked.campaign)
    assert collect_inputs(again) == (text, {place: str(kept / place) for place in files})
    # Another map gives other results; no map outside of the folder is read.
    np.save(kept / "inputs/materials/soft/map.npy", works + 1)
    other = load_configuration(kept / "config.used.yaml", within=kept)
    assert campaign_sha256(other.campaign) != campaign_sha256(asked.campaign)
    (kept / "config.used.yaml").write_text(text.replace("inputs/materials/soft/map.npy", "../map.npy"))
    with pytest.raises(ValueError, match=r"'\.\./map\.npy' is outside the folder of the configuration"):
        load_configuration(kept / "config.used.yaml", within=kept)
