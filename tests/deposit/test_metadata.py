"""Metadata of a deposit: the same statements for citation, for Zenodo, and in its RO-Crate."""

import json
from types import SimpleNamespace
from urllib.parse import unquote

import netCDF4
import pytest
import yaml
from conftest import REPOSITORY
from outside_validators import sealed, validated
from publications import ALL, COMMIT, LEAST, ORCID, PUBLICATIONS

from icha.configuration.publication import RESOURCES
from icha.contact.models import DEFAULT_MODEL, MODEL_PAPER, MODELS
from icha.deposit.crate import write_crate
from icha.deposit.metadata import TABLES, citation_cff, licence_problem, read_zenodo_metadata, zenodo_metadata
from icha.deposit.verify import CRATE, files_of


@pytest.mark.parametrize("publication", PUBLICATIONS.values(), ids=PUBLICATIONS)
def test_statements_are_the_same_everywhere(publication):
    cff = yaml.safe_load(citation_cff(publication, COMMIT))
    zenodo = zenodo_metadata(publication)
    assert cff["version"] == zenodo["version"] == publication.version
    assert cff["date-released"] == zenodo["publication_date"] == "2026-01-31"
    assert cff["title"] == zenodo["title"] == publication.title
    assert cff["license"].lower() == zenodo["license"]
    assert cff.get("doi") == zenodo.get("doi") == publication.doi
    assert cff["commit"] == COMMIT and cff["cff-version"] == "1.2.0" and cff["type"] == "dataset"
    # The paper of the model is cited as the program and every run cite it.
    paper = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text(encoding="utf-8"))["preferred-citation"]
    assert cff["references"] == [paper]
    assert zenodo["references"] == [MODELS[DEFAULT_MODEL].references.split("; ")[0]] == [MODEL_PAPER.line]
    # Entries that are not given are absent.
    for content in (cff, zenodo):
        assert all(value not in (None, "", [], {}) for value in content.values())


def test_people_institutions_related_works_and_funding():
    zenodo, (person, team, _) = zenodo_metadata(ALL), yaml.safe_load(citation_cff(ALL, COMMIT))["authors"]
    assert person["orcid"] == f"https://orcid.org/{ORCID}" and "affiliation" in person
    assert team == {"name": "California Digital Library", "website": "https://ror.org/03yrm5c26"}
    creator = {"name": "Carberry, Josiah", "affiliation": "California Digital Library", "orcid": ORCID}
    assert zenodo["creators"][0] == creator
    assert zenodo["related_identifiers"][0] == {
        "identifier": "10.1007/s11249-017-0900-2",
        "relation": "isSupplementTo",
        "resource_type": "publication-article",
    }
    assert {*TABLES["zenodo_types"]} == {*RESOURCES}
    assert zenodo["grants"] == [{"id": "10.13039/501100000780::284382"}]  # of funders that Zenodo knows
    assert "<p>Funded by Nobody &amp; Co.</p>" in zenodo["notes"] and "Area &lt; 0.1 %." in zenodo["notes"]
    assert "(award 284382: Title of the grant, https://cordis.europa.eu/project/id/284382)" in zenodo["notes"]
    spaced = ALL.model_copy(update={"summary": "\nOne\nline <1.\n \n\t\nTwo.\n\n\n"})
    assert zenodo_metadata(spaced)["description"] == "<p>One line &lt;1.</p><p>Two.</p>"


def problem(licence):
    """The problem of a campaign with this licence."""
    return licence_problem(
        SimpleNamespace(deposit_metadata=lambda: LEAST.model_copy(update={"license": licence}), publication=LEAST)
    )


def test_licences_are_those_of_spdx():
    assert problem("CC-BY-4.0") is problem("PDDL-1.0") is None
    # Newer than the licences of the Citation File Format.
    newer = yaml.safe_load(citation_cff(LEAST.model_copy(update={"license": "CC-BY-3.0-IGO"}), COMMIT))
    assert "license" not in newer and newer["license-url"].endswith("/CC-BY-3.0-IGO.html")
    for wrong in ("CC-BY", "my own", "MIT OR CC0-1.0", "LicenseRef-mine", "CC-BY-4.0+", ""):
        assert "expected one identifier" in problem(wrong)[1]
    assert "expected 'CC-BY-4.0'" in problem("cc-by-4.0")[1]


@pytest.mark.parametrize("text", ["[1]", 100_000 * "[", "\xff"])
def test_metadata_from_unknown_makers_are_checked(text, tmp_path):
    (tmp_path / ".zenodo.json").write_text(text, encoding="latin-1")
    with pytest.raises(ValueError, match=r"^\.zenodo\.json: "):
        read_zenodo_metadata(tmp_path)


SCAN, RUN = "inputs/scan 1 µm.npy", "runs/load/a/seed1/slope0.5/soft+dry.nc"
FILES = ("README.md", "config.used.yaml", "dataset/mine.nc", "figures/fig.csv", "figures/fig.pdf", SCAN, RUN)
PROGRAM = ("source/Snakefile", "source/LICENSE", "source/icha/path/follow.py")


def written(folder, publication):
    """A deposit with files of some bytes, and its crate."""
    for path in (*FILES, *PROGRAM):
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(path)
    sizes = {path: (folder / path).stat().st_size for path in files_of(folder)}
    write_crate(folder, publication, campaign="mine", revision=COMMIT, sizes=sizes)
    return folder


def references(value):
    """Identifiers that a property names."""
    return [unquote(entry["@id"]) for entry in (value if isinstance(value, list) else [value]) if "@id" in entry]


def test_the_crate_states_files_origin_authors_and_licence(tmp_path):
    graph = json.loads((written(tmp_path, ALL) / CRATE).read_bytes())["@graph"]
    entities = {entity["@id"]: entity for entity in graph}
    assert len(entities) == len(graph)
    for entity in entities.values():
        for value in entity.values():
            for name in references(value):
                assert name in {*map(unquote, entities)} or name == "https://w3id.org/ro/crate/1.1"
    root, action = entities["./"], entities["#campaign"]
    assert {*references(root["hasPart"])} == {*FILES, "source/", "source/LICENSE"}
    assert entities["figures/fig.pdf"]["encodingFormat"] == "application/pdf"
    assert references(action["object"]) == ["config.used.yaml", SCAN]
    assert references(action["result"]) == ["dataset/mine.nc", "figures/fig.csv", "figures/fig.pdf", RUN]
    assert entities[action["instrument"]["@id"]]["version"] == COMMIT
    person, team, other = (entities[each["@id"]] for each in root["author"])
    assert person["@id"] == f"https://orcid.org/{ORCID}" and person["name"] == "Josiah Carberry"
    assert person["affiliation"]["@id"] == team["@id"] == "https://ror.org/03yrm5c26"
    assert entities[other["affiliation"]["@id"]]["name"] == "Nowhere <Institute> & Sons"
    assert entities[root["license"]["@id"]]["name"] == "CC0-1.0"
    assert root["identifier"] == "https://doi.org/10.5281/zenodo.1234567"
    assert entities[root["citation"]["@id"]]["name"] == MODEL_PAPER.line


@pytest.mark.slow
def test_a_validator_accepts_the_crate_and_finds_problems(tmp_path):
    folder = written(tmp_path / "tiny", ALL)
    done = validated(sealed(folder), "roc-validator")
    assert done.returncode == 0 and "roc-validator: 0 problems" in done.stdout, done.stdout + done.stderr
    (folder / "dataset/mine.nc").unlink()
    done = validated(sealed(folder), "roc-validator")
    assert done.returncode == 1 and "dataset/mine.nc" in done.stdout


@pytest.mark.slow
def test_a_validator_finds_a_unit_that_is_none(tmp_path):
    """A netCDF file with a variable in a group, whose axis is in the group above."""
    with netCDF4.Dataset(tmp_path / "data.nc", "w") as data:
        data.setncatts({"Conventions": "CF-1.11", "title": "Loads", "history": "made up"})
        data.createDimension("step", 3)
        step = data.createVariable("step", "i4", ("step",))
        step.setncatts({"long_name": "step", "units": "1"})
        step[:] = range(3)
        load = data.createGroup("study").createVariable("load", "f8", ("step",))
        load.setncatts({"long_name": "load", "units": "Pa"})
        load[:] = [1.0, 2.0, 3.0]
    done = validated(sealed(tmp_path), "compliance-checker")
    assert done.returncode == 0, done.stdout + done.stderr
    with netCDF4.Dataset(tmp_path / "data.nc", "a") as data:
        data["study/load"].units = "pascalish"
    done = validated(sealed(tmp_path), "compliance-checker")
    assert done.returncode == 1 and "data.nc/study: " in done.stdout, done.stdout
