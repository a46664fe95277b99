"""The deposit as an RO-Crate: its statements, and a validator that reads it."""

import json
from urllib.parse import unquote

import pytest
from outside_validators import sealed, validated
from publications import ALL, COMMIT, ORCID, PUBLICATIONS

from icha.contact.models import MODEL_PAPER
from icha.deposit.crate import write_crate
from icha.deposit.verify import CRATE, files_of

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


def entities_of(folder):
    graph = json.loads((folder / CRATE).read_bytes())["@graph"]
    entities = {entity["@id"]: entity for entity in graph}
    assert len(entities) == len(graph)
    return entities


def references(value):
    """Identifiers that a property names."""
    return [unquote(entry["@id"]) for entry in (value if isinstance(value, list) else [value]) if "@id" in entry]


def test_the_crate_states_files_origin_authors_and_licence(tmp_path):
    entities = entities_of(written(tmp_path, ALL))
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
@pytest.mark.parametrize("name", PUBLICATIONS)
def test_a_validator_accepts_the_crate_and_finds_problems(name, tmp_path):
    folder = written(tmp_path / "tiny", PUBLICATIONS[name])
    done = validated(sealed(folder), "roc-validator")
    assert done.returncode == 0 and "checks of ro-crate-1.1, 0 problems" in done.stdout, done.stdout + done.stderr
    (folder / "dataset/mine.nc").unlink()
    done = validated(sealed(folder), "roc-validator")
    assert done.returncode == 1 and "dataset/mine.nc" in done.stdout
