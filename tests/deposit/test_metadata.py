"""Metadata of a deposit: the same statements in every format, valid after the schema of each."""

import json
import re

import pytest
import yaml
from conftest import REPOSITORY
from outside_validators import sealed, validated
from publications import ALL, COMMIT, LEAST, ORCID, PUBLICATIONS

from icha.configuration.publication import RELATIONS, RESOURCES, RelatedIdentifier
from icha.contact.models import DEFAULT_MODEL, MODEL_PAPER, MODELS
from icha.deposit.metadata import (
    citation_cff,
    datacite_metadata,
    discovery_attributes,
    find_licence,
    read_zenodo_metadata,
    summary_of,
    web_address,
    zenodo_metadata,
)

NEWER = LEAST.model_copy(update={"license": "CC-BY-3.0-IGO"})  # than the licences of the Citation File Format
RELATED = [
    RelatedIdentifier(identifier=f"10.1234/{relation}", relation=relation, resource=RESOURCES[n % len(RESOURCES)])
    for n, relation in enumerate(RELATIONS)
]


def written(folder, publication):
    """Write the files of citation and metadata."""
    folder.mkdir()
    (folder / "CITATION.cff").write_text(citation_cff(publication, COMMIT), encoding="utf-8")
    (folder / ".zenodo.json").write_text(json.dumps(zenodo_metadata(publication)), encoding="utf-8")
    (folder / "datacite.json").write_text(json.dumps(datacite_metadata(publication)), encoding="utf-8")
    (folder / "ro-crate-metadata.json").write_text("{}")  # which every deposit has
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    "publication", [LEAST, ALL.model_copy(update={"related_identifiers": [*ALL.related_identifiers, *RELATED]}), NEWER]
)
def test_all_of_it_is_valid_and_what_is_not_is_found(publication, tmp_path):
    folder, names = written(tmp_path / "deposit", publication), ["cffconvert", "datacite", "zenodo"]
    done = validated(sealed(folder), *names)
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.findall(r"^(\w+): passed", done.stdout, re.MULTILINE) == names
    for file in ("CITATION.cff", "datacite.json", ".zenodo.json"):
        text = (folder / file).read_text(encoding="utf-8")
        (folder / file).write_text(text.replace("title", "titel"), encoding="utf-8")
    done = validated(sealed(folder), *names)
    assert done.returncode == 1 and re.findall(r"^(\w+): failed", done.stdout, re.MULTILINE) == names


@pytest.mark.parametrize("publication", PUBLICATIONS.values(), ids=PUBLICATIONS)
def test_statements_are_the_same_everywhere(publication):
    cff = yaml.safe_load(citation_cff(publication, COMMIT))
    zenodo, datacite = zenodo_metadata(publication), datacite_metadata(publication)
    assert cff["version"] == zenodo["version"] == datacite["version"] == publication.version
    assert cff["date-released"] == zenodo["publication_date"] == datacite["dates"][0]["date"] == "2026-01-31"
    assert cff["title"] == zenodo["title"] == datacite["titles"][0]["title"] == publication.title
    assert cff["license"].lower() == zenodo["license"] == datacite["rightsList"][0]["rightsIdentifier"].lower()
    assert cff.get("doi") == zenodo.get("doi") == datacite.get("doi") == publication.doi
    assert [creator["name"] for creator in zenodo["creators"]] == [creator["name"] for creator in datacite["creators"]]
    assert cff["commit"] == COMMIT
    # The paper of the model is cited as the program and every run cite it.
    paper = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text(encoding="utf-8"))["preferred-citation"]
    assert cff["references"] == [paper]
    assert zenodo["references"] == [MODELS[DEFAULT_MODEL].references.split("; ")[0]] == [MODEL_PAPER.line]
    assert web_address(datacite["relatedIdentifiers"][-1]["relatedIdentifier"]) == paper["url"]
    # Entries that are not given are absent.
    for content in (cff, zenodo, datacite):
        assert all(value not in (None, "", [], {}) for value in content.values())


def test_people_and_institutions_have_their_identifiers():
    person, team, _ = yaml.safe_load(citation_cff(ALL, COMMIT))["authors"]
    assert person["orcid"] == f"https://orcid.org/{ORCID}" and "affiliation" in person
    assert team == {"name": "California Digital Library", "website": "https://ror.org/03yrm5c26"}
    assert zenodo_metadata(ALL)["creators"][0] == {
        "name": "Carberry, Josiah",
        "affiliation": "California Digital Library",
        "orcid": ORCID,
    }
    person, team, other = datacite_metadata(ALL)["creators"]
    assert (person["nameType"], team["nameType"]) == ("Personal", "Organizational")
    assert person["nameIdentifiers"][0]["nameIdentifier"] == f"https://orcid.org/{ORCID}"
    assert person["affiliation"][0]["affiliationIdentifier"] == "https://ror.org/03yrm5c26"
    assert team["nameIdentifiers"][0]["nameIdentifier"] == "https://ror.org/03yrm5c26"
    assert other["name"] == "Öre Ünal, Zoë" and "nameIdentifiers" not in other
    attributes = discovery_attributes(ALL)
    assert attributes["creator_name"] == "Josiah Carberry; California Digital Library; Zoë Öre Ünal"
    assert attributes["creator_url"] == f"https://orcid.org/{ORCID}; https://ror.org/03yrm5c26; "
    assert attributes["creator_institution"] == "California Digital Library; ; Nowhere <Institute> & Sons"
    assert set(discovery_attributes(LEAST)) == {"creator_name", "creator_type", "product_version"}


def test_related_works_funding_and_publisher():
    zenodo, datacite = zenodo_metadata(ALL), datacite_metadata(ALL)
    assert zenodo["related_identifiers"][0] == {
        "identifier": "10.1007/s11249-017-0900-2",
        "relation": "isSupplementTo",
        "resource_type": "publication-article",
    }
    types = [related["relatedIdentifierType"] for related in datacite["relatedIdentifiers"]]
    assert types == ["DOI", "arXiv", "DOI", "URL", "URL", "arXiv"]
    assert zenodo["grants"] == [{"id": "10.13039/501100000780::284382"}]  # of funders that Zenodo knows
    assert "<p>Funded by Nobody &amp; Co.</p>" in zenodo["notes"] and "Area &lt; 0.1 %." in zenodo["notes"]
    assert "(award 284382: Title of the grant, https://cordis.europa.eu/project/id/284382)" in zenodo["notes"]
    funding = datacite["fundingReferences"]
    assert funding[0]["awardUri"] == "https://cordis.europa.eu/project/id/284382"
    assert [each.get("funderIdentifierType") for each in funding] == ["Crossref Funder ID", "ROR", None]
    assert datacite["publisher"] == {"name": "Zenodo"} and datacite_metadata(LEAST)["publisher"] == {"name": ":tba"}
    spaced = ALL.model_copy(update={"summary": "\nOne\nline <1.\n \n\t\nTwo.\n\n\n"})
    assert zenodo_metadata(spaced)["description"] == "<p>One line &lt;1.</p><p>Two.</p>"
    assert datacite_metadata(spaced)["descriptions"][0]["description"] == spaced.summary


def test_licences_are_those_of_spdx():
    for identifier in ("CC-BY-4.0", "CC-BY-SA-4.0", "CC0-1.0", "ODbL-1.0"):
        licence = find_licence(identifier)
        page = licence.page()
        assert licence.name in page and licence.address in page and len(licence.text) > 1000
        assert page.endswith(licence.text)
    assert "PDDL-1.0" in find_licence("PDDL-1.0").page() and find_licence("PDDL-1.0").text == ""
    assert "license" not in yaml.safe_load(citation_cff(NEWER, COMMIT))
    for wrong in ("CC-BY", "my own", "MIT OR CC0-1.0", "LicenseRef-mine", "CC-BY-4.0+", ""):
        with pytest.raises(ValueError, match="expected one identifier"):
            find_licence(wrong)
    with pytest.raises(ValueError, match=r"expected 'CC-BY-4\.0'"):
        find_licence("cc-by-4.0")


@pytest.mark.parametrize(
    "text", ["[1]", 100_000 * "[", "\xff", '{"title": ["a"], "creators": {"name": 1}, "communities": [1]}']
)
def test_metadata_from_unknown_makers_are_checked(text, tmp_path):
    (tmp_path / ".zenodo.json").write_text(text, encoding="latin-1")
    if text.startswith("{"):
        assert summary_of(read_zenodo_metadata(tmp_path))["title"] == "['a']"
        return
    with pytest.raises(ValueError, match=r"^\.zenodo\.json: "):
        read_zenodo_metadata(tmp_path)
