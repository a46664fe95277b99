"""How a deposit is cited: the same statements in every language, valid after each one's schema."""

import json
import re

import pytest
import yaml
from conftest import REPOSITORY
from outside_validators import sealed, validated
from publications import ALL, COMMIT, LEAST, ORCID, PUBLICATIONS

from icha.configuration.publication import RELATIONS, RESOURCES, RelatedIdentifier
from icha.contact.models import DEFAULT_MODEL, MODEL_PAPER, MODELS
from icha.deposit.citation import citation_cff, datacite_metadata, web_address, zenodo_metadata


def written(folder, publication):
    """Write all that says how a deposit is cited."""
    folder.mkdir()
    (folder / "CITATION.cff").write_text(citation_cff(publication, COMMIT), encoding="utf-8")
    (folder / ".zenodo.json").write_text(json.dumps(zenodo_metadata(publication)), encoding="utf-8")
    (folder / "datacite.json").write_text(json.dumps(datacite_metadata(publication)), encoding="utf-8")
    (folder / "ro-crate-metadata.json").write_text("{}")  # by which a deposit is known
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLICATIONS)
def test_all_of_it_is_valid_after_the_schemas_of_others(name, tmp_path):
    # Every relation and every kind of resource, too.
    related = [
        RelatedIdentifier(identifier=f"10.1234/{relation}", relation=relation, resource=RESOURCES[n % len(RESOURCES)])
        for n, relation in enumerate(RELATIONS)
    ]
    publication = PUBLICATIONS[name]
    if name == "all":
        publication = publication.model_copy(update={"related_identifiers": [*ALL.related_identifiers, *related]})
    done = validated(sealed(written(tmp_path / "deposit", publication)), "cffconvert", "datacite", "zenodo")
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.findall(r"^(\w+): passed", done.stdout, re.MULTILINE) == ["cffconvert", "datacite", "zenodo"]


@pytest.mark.slow
def test_the_validators_see_what_is_wrong(tmp_path):
    folder = written(tmp_path / "deposit", ALL)
    for file, old, new in (
        ("CITATION.cff", "type: dataset", "type: data"),
        ("datacite.json", '"IsSupplementTo"', '"isSupplementTo"'),
        (".zenodo.json", '"isSupplementTo"', '"IsSupplementTo"'),
    ):
        text = (folder / file).read_text(encoding="utf-8")
        assert old in text
        (folder / file).write_text(text.replace(old, new), encoding="utf-8")
    done = validated(sealed(folder), "cffconvert", "datacite", "zenodo")
    assert done.returncode == 1
    assert re.findall(r"^(\w+): failed", done.stdout, re.MULTILINE) == ["cffconvert", "datacite", "zenodo"]


@pytest.mark.parametrize("publication", PUBLICATIONS.values(), ids=PUBLICATIONS)
def test_version_date_title_and_names_are_the_same_everywhere(publication):
    cff = yaml.safe_load(citation_cff(publication, COMMIT))
    zenodo, datacite = zenodo_metadata(publication), datacite_metadata(publication)
    assert cff["version"] == zenodo["version"] == datacite["version"] == publication.version
    assert cff["date-released"] == zenodo["publication_date"] == datacite["dates"][0]["date"] == "2026-01-31"
    assert cff["title"] == zenodo["title"] == datacite["titles"][0]["title"] == publication.title
    assert cff["license"].lower() == zenodo["license"] == datacite["rightsList"][0]["rightsIdentifier"].lower()
    assert cff.get("doi") == zenodo.get("doi") == datacite.get("doi") == publication.doi
    assert [creator["name"] for creator in zenodo["creators"]] == [creator["name"] for creator in datacite["creators"]]
    assert cff["commit"] == COMMIT


def test_people_are_named_with_their_identifiers():
    cff = yaml.safe_load(citation_cff(ALL, COMMIT))["authors"]
    assert cff[0] == {
        "family-names": "Carberry",
        "given-names": "Josiah",
        "orcid": f"https://orcid.org/{ORCID}",
        "affiliation": "California Digital Library",
    }
    assert cff[1] == {"name": "California Digital Library", "website": "https://ror.org/03yrm5c26"}
    zenodo = zenodo_metadata(ALL)["creators"]
    assert zenodo[0] == {"name": "Carberry, Josiah", "affiliation": "California Digital Library", "orcid": ORCID}
    assert zenodo[1] == {"name": "California Digital Library"}
    person, team, other = datacite_metadata(ALL)["creators"]
    assert (person["nameType"], team["nameType"]) == ("Personal", "Organizational")
    assert person["nameIdentifiers"][0]["nameIdentifier"] == f"https://orcid.org/{ORCID}"
    assert person["affiliation"][0]["affiliationIdentifier"] == "https://ror.org/03yrm5c26"
    assert team["nameIdentifiers"][0]["nameIdentifier"] == "https://ror.org/03yrm5c26"
    assert other["name"] == "Öre Ünal, Zoë" and "nameIdentifiers" not in other


def test_what_is_related_keeps_its_relation_and_its_kind_of_identifier():
    zenodo = zenodo_metadata(ALL)["related_identifiers"]
    assert zenodo[0] == {
        "identifier": "10.1007/s11249-017-0900-2",
        "relation": "isSupplementTo",
        "resource_type": "publication-article",
    }
    assert "resource_type" not in zenodo[-1]
    datacite = datacite_metadata(ALL)["relatedIdentifiers"]
    assert [related["relatedIdentifierType"] for related in datacite] == ["DOI", "arXiv", "DOI", "URL", "URL"]
    assert [related["relationType"] for related in datacite][:3] == ["IsSupplementTo", "Cites", "IsDerivedFrom"]


@pytest.mark.parametrize("publication", PUBLICATIONS.values(), ids=PUBLICATIONS)
def test_the_paper_of_the_model_is_cited_as_the_program_and_every_run_cite_it(publication):
    paper = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text(encoding="utf-8"))["preferred-citation"]
    names = [(author["given-names"], author["family-names"]) for author in paper["authors"]]
    assert yaml.safe_load(citation_cff(publication, COMMIT))["references"] == [paper]
    assert MODELS[DEFAULT_MODEL].references.startswith(f"{MODEL_PAPER.line}; ")
    assert zenodo_metadata(publication)["references"] == [MODELS[DEFAULT_MODEL].references.split("; ")[0]]
    (item,) = datacite_metadata(publication)["relatedItems"]
    assert item["titles"] == [{"title": paper["title"]}] and item["publicationYear"] == str(paper["year"])
    assert web_address(item["relatedItemIdentifier"]["relatedItemIdentifier"]) == paper["url"]
    assert [(creator["givenName"], creator["familyName"]) for creator in item["creators"]] == names


def test_identifiers_lead_somewhere():
    assert web_address("10.1007/s11249-017-0900-2") == "https://doi.org/10.1007/s11249-017-0900-2"
    assert web_address("arXiv:1606.03166") == "https://arxiv.org/abs/1606.03166"
    assert web_address("https://example.org/page") == "https://example.org/page"


def test_funding_is_a_grant_where_zenodo_knows_the_funder_and_told_in_any_case():
    zenodo = zenodo_metadata(ALL)
    assert zenodo["grants"] == [{"id": "10.13039/501100000780::284382"}]
    assert (
        "<p>Funded by California Digital Library (award 7 b).</p><p>Funded by Nobody &amp; Co.</p>" in zenodo["notes"]
    )
    kinds = [each.get("funderIdentifierType") for each in datacite_metadata(ALL)["fundingReferences"]]
    assert kinds == ["Crossref Funder ID", "ROR", None]


def test_texts_are_html_only_where_html_is_asked_for():
    zenodo = zenodo_metadata(ALL)
    assert zenodo["description"] == "<p>Loading of one surface, at five slopes &lt;1.</p><p>And unloading.</p>"
    assert "load/flat/seed1/slope1/soft. Area &lt; 0.1 %." in zenodo["notes"]
    assert zenodo["title"] == ALL.title
    spaced = ALL.model_copy(update={"summary": "\nOne\nline.\n \n\t\nTwo.\n\n\n"})
    assert zenodo_metadata(spaced)["description"] == "<p>One line.</p><p>Two.</p>"
    assert datacite_metadata(ALL)["descriptions"][0]["description"] == ALL.summary


def test_a_licence_that_the_citation_file_format_does_not_know_is_given_by_its_address(tmp_path):
    newer = LEAST.model_copy(update={"license": "CC-BY-3.0-IGO"})
    cff = yaml.safe_load(citation_cff(newer, COMMIT))
    assert "license" not in cff and cff["license-url"] == "https://spdx.org/licenses/CC-BY-3.0-IGO.html"
    assert validated(sealed(written(tmp_path / "deposit", newer)), "cffconvert").returncode == 0


def test_who_publishes_is_not_made_up():
    assert datacite_metadata(ALL)["publisher"] == {"name": "Zenodo"}
    assert datacite_metadata(LEAST)["publisher"] == {"name": ":tba"}


def test_nothing_is_said_of_what_is_not_given():
    for content in (yaml.safe_load(citation_cff(LEAST, COMMIT)), zenodo_metadata(LEAST), datacite_metadata(LEAST)):
        assert not {"doi", "keywords", "subjects", "grants", "notes", "fundingReferences"} & set(content)
        assert all(value not in (None, "", [], {}) for value in content.values())
