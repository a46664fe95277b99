"""The deposit as an RO-Crate: its statements on files and jobs, and other programs that read it."""

import hashlib
import json
import re
import shutil
from urllib.parse import unquote

import pytest
from outside_validators import sealed, validated
from publications import ALL, COMMIT, ORCID, PUBLICATIONS

from icha.contact.models import MODEL_PAPER
from icha.deposit.crate import Job, write_crate
from icha.deposit.verify import CRATE

SCRIPTS = "source/workflow/scripts"
SCAN = "inputs/scan 1 µm.npy"
RUNS = tuple(f"runs/load/a/seed1/slope{slope}/soft+dry.nc" for slope in ("0.5", "1"))
JOBS = (
    Job("surface", (SCAN,), ("surfaces/a/seed1.nc",), (("kind", "measured"),), "Make it.", f"{SCRIPTS}/surface.py"),
    *(
        Job(
            "run",
            ("surfaces/a/seed1.nc",),
            (run,),
            (("material.contact_modulus", "2000000.0"), ("rms_slope", slope)),
            "Press it.",
            f"{SCRIPTS}/run.py",
        )
        for run, slope in zip(RUNS, ("0.5", "1"), strict=True)
    ),
    Job("gather", RUNS, ("dataset/mine.nc",), (), "Gather them.", f"{SCRIPTS}/gather.py"),
    Job("figure", ("config.used.yaml", "dataset/mine.nc"), ("figures/fig.pdf",), (), "Draw.", f"{SCRIPTS}/figure.py"),
)
OTHERS = ("README.md", "LICENSE.txt", "CITATION.cff", "source/Snakefile", "source/uv.lock", "source/LICENSE")
OTHERS += ("source/icha/path/follow.py",)


def checksums_of(folder):
    """The checksums of all files, as `sha256sum` prints them."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path.name != CRATE)
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def written(folder, publication, jobs=JOBS):
    """A deposit with files of some bytes, and its crate."""
    for path in {*OTHERS, *(path for job in JOBS for path in (*job.inputs, *job.outputs, job.script))}:
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(f"{path}\n" * len(path))
    write_crate(folder, publication, jobs, campaign="mine", revision=COMMIT, checksums=checksums_of(folder))
    return folder


@pytest.fixture(scope="module")
def deposit(tmp_path_factory):
    return written(tmp_path_factory.mktemp("deposit"), ALL)


@pytest.fixture(scope="module")
def entities(deposit):
    """The entities of the crate, by identifier."""
    graph = json.loads((deposit / CRATE).read_bytes())["@graph"]
    assert len({entity["@id"] for entity in graph}) == len(graph)
    return {entity["@id"]: entity for entity in graph}


def references(value):
    """Identifiers that a property names."""
    values = value if isinstance(value, list) else [value]
    return [entry["@id"] for entry in values if isinstance(entry, dict)]


def of_type(entities, name):
    return [entity for entity in entities.values() if name in [entity["@type"], *entity["@type"]]]


def tool_actions(entities):
    return [action for action in of_type(entities, "CreateAction") if action["instrument"]["@id"] != "source/Snakefile"]


def test_every_reference_has_an_entity(entities):
    for entity in entities.values():
        for key, value in entity.items():
            for name in references(value):
                outside = entity["@id"] == CRATE and key == "conformsTo" and name.startswith("https://w3id.org/")
                assert name in entities or outside, (entity["@id"], key, name)


def test_files_are_those_of_the_deposit_with_size_and_checksum(deposit, entities):
    files = {unquote(file["@id"]): file for file in of_type(entities, "File")}
    known = checksums_of(deposit)
    shown = {path for path in known if not path.startswith("source/")}
    assert shown | {job.script for job in JOBS} | {"source/Snakefile", "source/uv.lock"} <= set(files) <= set(known)
    for path, file in files.items():
        assert file["sha256"] == known[path]
        assert int(file["contentSize"]) == (deposit / path).stat().st_size
    assert files["dataset/mine.nc"]["encodingFormat"] == "application/netcdf"
    assert files["figures/fig.pdf"]["encodingFormat"] == "application/pdf"
    parts = {unquote(name) for name in references(entities["./"]["hasPart"])}
    assert set(files) | {"source/"} == parts
    assert entities["source/"]["version"] == COMMIT


def test_every_job_has_an_action_with_its_files_and_settings(entities):
    found = set()
    for action in tool_actions(entities):
        objects = [entities[name] for name in references(action["object"])]
        found.add(
            (
                action["instrument"]["@id"],
                tuple(sorted(unquote(each["@id"]) for each in objects if each["@type"] != "PropertyValue")),
                tuple(sorted(map(unquote, references(action["result"])))),
                tuple(sorted((each["name"], each["value"]) for each in objects if each["@type"] == "PropertyValue")),
            )
        )
    assert found == {(job.script, tuple(sorted(job.inputs)), job.outputs, job.parameters) for job in JOBS}


def test_steps_stand_in_the_order_of_the_data(entities):
    workflow = entities["source/Snakefile"]
    steps = sorted((entities[name] for name in references(workflow["step"])), key=lambda step: int(step["position"]))
    assert [step["name"] for step in steps] == ["surface", "run", "gather", "figure"]
    assert {step["workExample"]["@id"] for step in steps} == set(references(workflow["hasPart"]))
    (organised,) = of_type(entities, "OrganizeAction")
    controls = [entities[name] for name in references(organised["object"])]
    assert len(controls) == len(JOBS)
    for control in controls:
        step, action = entities[control["instrument"]["@id"]], entities[control["object"]["@id"]]
        assert step["workExample"] == action["instrument"]


def test_authors_licence_and_paper_of_the_model(entities):
    root = entities["./"]
    people = [entities[name] for name in references(root["author"])]
    assert [person["@type"] for person in people] == ["Person", "Organization", "Person"]
    assert people[0]["@id"] == f"https://orcid.org/{ORCID}" and people[0]["name"] == "Josiah Carberry"
    assert people[0]["affiliation"]["@id"] == "https://ror.org/03yrm5c26"
    assert entities[root["license"]["@id"]]["identifier"] == "CC0-1.0"
    assert root["datePublished"] == "2026-01-31" and root["version"] == "1.0.0-rc.1"
    assert root["identifier"] == "https://doi.org/10.5281/zenodo.1234567"
    assert root["keywords"] == ["adhesion", "rough surfaces, soft"]
    paper = entities[root["citation"]["@id"]]
    assert paper["@id"] == MODEL_PAPER.address and paper["name"] == MODEL_PAPER.line


def test_the_same_deposit_has_the_same_bytes_whatever_the_order_of_jobs(deposit, tmp_path):
    assert (written(tmp_path, ALL, reversed(JOBS)) / CRATE).read_bytes() == (deposit / CRATE).read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLICATIONS)
def test_it_is_a_provenance_run_crate_and_can_be_read(name, deposit, tmp_path):
    folder = tmp_path / "tiny"
    if name == "all":
        shutil.copytree(deposit, folder)
    else:
        written(folder, PUBLICATIONS[name])
    done = validated(sealed(folder), "roc-validator", "runcrate")
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"^roc-validator: passed; \d{2,} checks of provenance-run-crate-0.5, 0 problems", done.stdout)
    assert f"runcrate: passed; {len(JOBS) + 1} actions" in done.stdout
    content = json.loads((folder / CRATE).read_bytes())
    content["@graph"] = [entity for entity in content["@graph"] if entity["@id"] != "source/Snakefile#run"]
    (folder / CRATE).write_text(json.dumps(content))
    (folder / "dataset/mine.nc").unlink()
    done = validated(sealed(folder), "roc-validator")
    assert done.returncode == 1 and "A ControlAction must reference a HowToStep instance" in done.stdout
    assert "dataset/mine.nc" in done.stdout
