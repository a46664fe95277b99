"""Section `publication`."""

import datetime

import pytest
from demo_configuration import (
    CARBERRY,
    GOOD_RUN,
    ORCID,
)

from icha.configuration.errors import ConfigurationError
from icha.configuration.publication import needed

BAD = {
    # key, value, what the message must say of it
    "no ORCID": (
        "publication",
        {"authors": [CARBERRY | {"orcid": "1"}]},
        "publication.authors[0].orcid: '1' is no ORCID",
    ),
    "check digit of an ORCID": (
        "publication",
        {"authors": [CARBERRY | {"orcid": "0000-0002-1825-0098"}]},
        "publication.authors[0].orcid: '0000-0002-1825-0098' is no ORCID: its check digit is wrong; allowed: four",
    ),
    "ORCID of an organisation": (
        "publication",
        {"authors": [{"name": "A", "orcid": "0000-0002-1825-0097"}]},
        "publication.authors[0]: an organisation has no ORCID; allowed: orcid beside family_names",
    ),
    "half an author": (
        "publication",
        {"authors": [{"family_names": "Carberry"}]},
        "publication.authors[0]: {'family_names': 'Carberry'} is neither a person nor an organisation; allowed: family",
    ),
    "ROR": ("publication", {"authors": [CARBERRY | {"ror": "x"}]}, "authors[0].ror: 'x' is no ROR identifier; allowed"),
    "version that YAML takes for a number": (
        "publication",
        {"version": 1.10},
        "publication.version: 1.1 is no version; allowed: letters, digits and . + - _ between them, in quotes",
    ),
    "version that is a path": (
        "publication",
        {"version": "../1"},
        "publication.version: '../1' is no version; allowed",
    ),
    "no day": ("publication", {"date": "2026-02-30"}, "publication.date: '2026-02-30' is no date; allowed: year"),
    "no identifier": (
        "publication",
        {"related_identifiers": [{"identifier": "the paper", "relation": "Cites"}]},
        "publication.related_identifiers[0].identifier: 'the paper' is no identifier; allowed: a DOI such as",
    ),
    "no relation": (
        "publication",
        {"related_identifiers": [{"identifier": "10.1007/s11249-017-0900-2", "relation": "Quotes"}]},
        "publication.related_identifiers[0].relation: 'Quotes' is not a choice; allowed: 'IsCitedBy'",
    ),
    "no DOI": ("publication", {"doi": "reserved"}, "publication.doi: 'reserved' is no DOI; allowed: a DOI such as"),
    "funding without a funder": ("publication", {"funding": [{}]}, "publication.funding[0].funder: the key is missing"),
    "unknown key of a publication": (
        "publication",
        {"keyword": ["x"]},
        "publication.keyword: unknown key (did you mean 'keywords'?)",
    ),
    "author with the same ORCID twice": (
        "publication",
        {"authors": [CARBERRY | {"orcid": ORCID}, {"family_names": "C.", "given_names": "J.", "orcid": ORCID}]},
        "'J. C.' is given twice; allowed: every author once",
    ),
    "author with the same name twice": (
        "publication",
        {"authors": [CARBERRY | {"orcid": ORCID}, {"family_names": "carberry", "given_names": "Josiah "}]},
        "'Josiah  carberry' is given twice; allowed: every author once",
    ),
    "organisation twice": (
        "publication",
        {"authors": [{"name": "The team"}, CARBERRY, {"name": "The team"}]},
        "'The team' is given twice; allowed: every author once",
    ),
    "related identifier twice": (
        "publication",
        {
            "related_identifiers": [
                {"identifier": "10.1000/ABC", "relation": "Cites", "resource": "Text"},
                {"identifier": "https://doi.org/10.1000/abc", "relation": "Cites"},
            ]
        },
        "'Cites 10.1000/abc' is given twice; allowed: every relation to an identifier once",
    ),
    "known failure twice": (
        "publication",
        {"known_failures": [{"run": GOOD_RUN, "reason": "why"}, {"run": GOOD_RUN, "reason": "because"}]},
        f"'{GOOD_RUN}' is given twice; allowed: every run once",
    ),
    "funding twice": (
        "publication",
        {"funding": [{"funder": "A", "award_number": "1"}, {"funder": "a", "award_number": "1", "award_title": "T"}]},
        "'a' is given twice; allowed: every award of a funder once",
    ),
    "funding without an award twice": (
        "publication",
        {
            "funding": [
                {"funder": "A", "funder_id": "https://ror.org/00k4n6c32"},
                {"funder": "B", "funder_id": "00K4N6C32"},
            ]
        },
        "'B' is given twice; allowed: every award of a funder once",
    ),
    "control character in a name": (
        "publication",
        {"authors": [CARBERRY | {"affiliation": "Brown\x07 University"}]},
        "authors[0].affiliation: 'Brown\\x07 University' holds the control character '\\x07'; allowed: text of",
    ),
    "tab in a summary": (
        "publication",
        {"summary": "One\n\ttwo"},
        "publication.summary: 'One\\n\\ttwo' holds the control character '\\t'; allowed: text, with or without",
    ),
    "line break in a title": (
        "publication",
        {"title": "A title\n"},
        "publication.title: 'A title\\n' holds a line break; allowed: text of one line; in YAML, >-",
    ),
    "half a character": ("publication", {"title": "A\ud800"}, "holds the control character '\\ud800'; allowed: text"),
    "blank title": ("publication", {"title": " "}, "publication.title: ' ' is blank; allowed: text of one line"),
    "blank reason": (
        "publication",
        {"known_failures": [{"run": GOOD_RUN, "reason": "\n"}]},
        "publication.known_failures[0].reason: '\\n' is blank; allowed: text, with or without line breaks",
    ),
    "keyword without anything visible": (
        "publication",
        {"keywords": ["a", "\u200b"]},
        "keywords[1]: '\\u200b' is blank",
    ),
    "empty funder": ("publication", {"funding": [{"funder": ""}]}, "publication.funding[0].funder: '' is blank"),
    "check digits of a ROR": (
        "publication",
        {"authors": [{"name": "A", "ror": "https://ror.org/03yrm5c27"}]},
        "authors[0].ror: 'https://ror.org/03yrm5c27' is no ROR identifier: its check digits are wrong; allowed: one of",
    ),
    "ROR of a person without an affiliation": (
        "publication",
        {"authors": [CARBERRY | {"ror": "https://ror.org/05gq02987"}]},
        "publication.authors[0]: a person has no ROR; allowed: ror beside affiliation",
    ),
    "funder without a registry": (
        "publication",
        {"funding": [{"funder": "A", "funder_id": "https://example.org"}]},
        "funding[0].funder_id: 'https://example.org' is neither a ROR identifier nor a DOI; allowed: one of them, such",
    ),
    "check digits of a funder": (
        "publication",
        {"funding": [{"funder": "A", "funder_id": "00k4n6c33"}]},
        "funding[0].funder_id: '00k4n6c33' is no ROR identifier: its check digits are wrong",
    ),
    "bracket in a DOI": (
        "publication",
        {"doi": "10.1000/<1"},
        "publication.doi: '10.1000/<1' holds '<', which no web address can; allowed: none, or '%3C' for it",
    ),
    "space in an address": (
        "publication",
        {"related_identifiers": [{"identifier": "https://a.org/b c", "relation": "Cites"}]},
        "identifier: 'https://a.org/b c' holds ' ', which no web address can; allowed: none, or '%20' for it",
    ),
    "invisible character in an address": (
        "publication",
        {"funding": [{"funder": "A", "award_url": "https://a.org/\u200b"}]},
        "award_url: 'https://a.org/\\u200b' holds '\\u200b', which no web address can; allowed: visible characters",
    ),
    "community by its title": (
        "publication",
        {"communities": ["Contact Mechanics"]},
        "publication.communities[0]: 'Contact Mechanics' is no community of Zenodo; allowed: what its address ends",
    ),
    "day of another age": (
        "publication",
        {"date": "0026-01-31"},
        "publication.date: '0026-01-31' is no day of a publication; allowed: from 1900-01-01 to 2199-12-31",
    ),
    "day too late": ("publication", {"date": "2200-01-01"}, "'2200-01-01' is no day of a publication; allowed: from"),
    "time of day": ("publication", {"date": "2026-01-31 12:00:00"}, "'2026-01-31 12:00:00' is no date; allowed: year"),
    "failure of no run": (
        "publication",
        {"known_failures": [{"run": "one", "reason": "why"}]},
        "publication.known_failures[0].run: 'one' is not a run; allowed: a run of the campaign, such as one/",
    ),
}


@pytest.mark.parametrize("case", BAD, ids=lambda case: case.replace(" ", "_"))
def test_mistakes_are_named(case, refused):
    refused(*BAD[case])


@pytest.mark.parametrize("ror", ["03yrm5c26", "05gq02987", "00k4n6c32", "01bj3aw27", "02mhbdp94"])
def test_identifiers_of_real_institutions_have_their_check_digits(ror, load):
    written = (ror, f"http://ror.org/{ror}", f"https://ror.org/{ror.upper()}")
    authors = [{"name": str(number), "ror": each} for number, each in enumerate(written)]
    funding = [{"funder": str(number), "funder_id": each, "award_number": each} for number, each in enumerate(written)]
    publication = load({"publication": {"authors": authors, "funding": funding}}).campaign.publication
    found = {each.ror for each in publication.authors} | {each.funder_id for each in publication.funding}
    assert found == {f"https://ror.org/{ror}"}


def test_what_differs_may_stand_side_by_side(load):
    others = [{"funder": "A"}, {"funder": "A", "award_number": "1"}, {"funder": "A", "award_number": "2"}]
    paper = {"identifier": "10.1000/abc"}
    publication = {
        # Two of one name.
        "authors": [CARBERRY | {"orcid": ORCID}, CARBERRY | {"orcid": "0000-0001-5109-3700"}, {"name": "Carberry"}],
        "funding": [*others, {"funder": "B", "funder_id": "https://doi.org/10.13039/501100000780"}],
        "related_identifiers": [paper | {"relation": "Cites"}, paper | {"relation": "IsSupplementTo"}],
        "summary": "One\n\ntwo",
    }
    found = load({"publication": publication}).campaign.publication
    assert len(found.authors) == 3 and len(found.related_identifiers) == 2
    assert found.funding[-1].funder_id == "10.13039/501100000780"


def test_days_of_the_command_line(load):
    day = datetime.date(2026, 1, 31)
    assert load(overrides={"publication": {"date": day}}).campaign.publication.date == "2026-01-31"
    with pytest.raises(ConfigurationError, match=r"publication\.date: '2026-01-31T12:00:00' is no date; allowed: "):
        load(overrides={"publication": {"date": datetime.datetime(2026, 1, 31, 12)}})


def test_texts_of_the_campaign_that_no_deposit_can_have(load):
    title, summary = needed(load({"title": "A\nB", "summary": " "}).campaign.published())[-2:]
    assert title.startswith("title: 'A\\nB' holds a line break; allowed: ")
    assert summary.startswith("summary: ' ' is blank; allowed: ")
