"""Section `publication`."""

import datetime

import pytest
from demo_configuration import CARBERRY, GOOD_RUN, ORCID

from icha.configuration.errors import ConfigurationError
from icha.configuration.publication import missing_metadata

DOI = "10.1007/s11249-017-0900-2"
# Wrong values, by the beginning of their message.
BAD = {
    "authors[0].orcid: '1' is not an ORCID": {"authors": [CARBERRY | {"orcid": "1"}]},
    "authors[0].orcid: '0000-0002-1825-0098' is no": {"authors": [CARBERRY | {"orcid": "0000-0002-1825-0098"}]},
    "authors[0]: expected orcid only for a person": {"authors": [{"name": "A", "orcid": ORCID}]},
    "authors[0]: {'family_names': 'Carberry'} is neither": {"authors": [{"family_names": "Carberry"}]},
    "authors[0].ror: 'x' is not a ROR": {"authors": [CARBERRY | {"ror": "x"}]},
    "authors[0].ror: 'https://ror.org/03yrm5c27' is no": {
        "authors": [{"name": "A", "ror": "https://ror.org/03yrm5c27"}]
    },
    "authors[0]: expected orcid only for a person, and ror": {
        "authors": [CARBERRY | {"ror": "https://ror.org/05gq02987"}]
    },
    '{"name":"The team"} is given twice': {"authors": [{"name": "The team"}, CARBERRY, {"name": "The team"}]},
    "authors[0].affiliation: 'Brown\\x07 University' holds": {
        "authors": [CARBERRY | {"affiliation": "Brown\x07 University"}]
    },
    "version: 1.1 is not a version": {"version": 1.10},
    "version: '../1' is not a version": {"version": "../1"},
    "date: '2026-02-30' is not a date": {"date": "2026-02-30"},
    "date: '0026-01-31' is not a date": {"date": "0026-01-31"},
    "date: '2200-01-01' is not a date": {"date": "2200-01-01"},
    "date: '2026-01-31 12:00:00' is not a date": {"date": "2026-01-31 12:00:00"},
    "related_identifiers[0].identifier: 'the paper' is no": {
        "related_identifiers": [{"identifier": "the paper", "relation": "Cites"}]
    },
    "related_identifiers[0].identifier: 'https://a.org/b c' is no": {
        "related_identifiers": [{"identifier": "https://a.org/b c", "relation": "Cites"}]
    },
    "related_identifiers[0].relation: 'Quotes' is not a choice": {
        "related_identifiers": [{"identifier": DOI, "relation": "Quotes"}]
    },
    "related_identifiers: ": {
        "related_identifiers": [{"identifier": each, "relation": "Cites"} for each in (DOI, f"https://doi.org/{DOI}")]
    },
    "doi: 'reserved' is not a DOI": {"doi": "reserved"},
    "doi: '10.1000/<1' is not a DOI": {"doi": "10.1000/<1"},
    "funding[0].funder: the key is missing": {"funding": [{}]},
    "funding[0].funder: ''": {"funding": [{"funder": ""}]},
    "funding[0].funder_id: 'https://example.org' is no": {
        "funding": [{"funder": "A", "funder_id": "https://example.org"}]
    },
    "funding[0].award_url: 'https://a.org/\\u200b' is no": {
        "funding": [{"funder": "A", "award_url": "https://a.org/\u200b"}]
    },
    "funding: ": {"funding": 2 * [{"funder": "A", "award_number": "1"}]},
    "known_failures: ": {"known_failures": 2 * [{"run": GOOD_RUN, "reason": "why"}]},
    "known_failures[0].run: 'one' is not a run": {"known_failures": [{"run": "one", "reason": "why"}]},
    "known_failures[0].run: 'one/rough/seed1/slope1/boundary_elements/soft' is not a run": {
        "known_failures": [{"run": "one/rough/seed1/slope1/boundary_elements/soft", "reason": "why"}]
    },
    "known_failures[0].reason: '\\n' is blank": {"known_failures": [{"run": GOOD_RUN, "reason": "\n"}]},
    "title: 'A title\\n' holds a line break": {"title": "A title\n"},
    "title: ' ' is blank": {"title": " "},
    "keywords[1]: '\\u200b' is blank": {"keywords": ["a", "\u200b"]},
    "communities[0]: 'Contact Mechanics' is not a community": {"communities": ["Contact Mechanics"]},
    "keyword: unknown key": {"keyword": ["x"]},
}


@pytest.mark.parametrize("message", BAD)
def test_wrong_values_are_refused(message, refused):
    refused("publication", BAD[message], message)


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
    with pytest.raises(ConfigurationError, match=r"publication\.date: .* is not a date; expected "):
        load(overrides={"publication": {"date": datetime.datetime(2026, 1, 31, 12)}})


def test_texts_of_the_campaign_that_no_deposit_can_have(load):
    title, summary = missing_metadata(load({"title": "A\nB", "summary": " "}).campaign.deposit_metadata())[-2:]
    assert title.startswith("title: 'A\\nB' holds a line break")
    assert summary.startswith("summary: ' ' is blank; expected ")
