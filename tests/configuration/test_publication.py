"""Section `publication`."""

import datetime

import pytest
from demo_configuration import CARBERRY, GOOD_RUN, ORCID

from icha.configuration.errors import ConfigurationError

DOI = "10.1007/s11249-017-0900-2"
PERSON_ROR = CARBERRY | {"ror": "https://ror.org/05gq02987"}
FAILURE = {"run": GOOD_RUN, "reason": "why"}
BOUNDARY_ELEMENTS = "one/rough/seed1/slope1/boundary_elements/soft"
# Wrong values of a key, and the beginnings of their messages.
WRONG = [
    ("authors", [CARBERRY | {"orcid": "1"}], "authors[0].orcid: '1' is not valid; expected an ORCID"),
    ("authors", [CARBERRY | {"orcid": "0000-0002-1825-0098"}], "authors[0].orcid: '0000-0002-1825-0098' is not valid"),
    ("authors", [{"name": "A", "orcid": ORCID}], "authors[0]: expected orcid only for a person"),
    ("authors", [{"family_names": "Carberry"}], "authors[0]: {'family_names': 'Carberry'} is neither"),
    ("authors", [CARBERRY | {"ror": "x"}], "authors[0].ror: 'x' is not valid; expected a ROR"),
    ("authors", [{"name": "A", "ror": "https://ror.org/03yrm5c27"}], ".ror: 'https://ror.org/03yrm5c27' is not valid"),
    ("authors", [PERSON_ROR], "authors[0]: expected orcid only for a person, and ror"),
    ("authors", [{"name": "The team"}, CARBERRY, {"name": "The team"}], "name='The team'"),
    ("authors", [CARBERRY | {"affiliation": "Brown\x07"}], "authors[0].affiliation: 'Brown\\x07' holds"),
    ("version", 1.10, "version: 1.1 is not valid; expected letters and digits"),
    ("version", "../1", "version: '../1' is not valid"),
    ("date", "2026-02-30", "date: '2026-02-30' is not valid; expected year"),
    ("date", "2026-01-31 12:00:00", "date: '2026-01-31 12:00:00' is not valid"),
    ("related_identifiers", [{"identifier": "the paper", "relation": "Cites"}], "'the paper' is not valid"),
    ("related_identifiers", [{"identifier": "https://a.org/b c", "relation": "Cites"}], "'https://a.org/b c' is not"),
    ("related_identifiers", [{"identifier": DOI, "relation": "Quotes"}], "[0].relation: 'Quotes' is not valid"),
    ("related_identifiers", [{"identifier": x + DOI, "relation": "Cites"} for x in ("", "doi:")], "is given twice"),
    ("doi", "reserved", "doi: 'reserved' is not valid; expected a DOI"),
    ("doi", "10.1000/<1", "doi: '10.1000/<1' is not valid"),
    ("funding", [{}], "funding[0].funder: the key is missing"),
    ("funding", [{"funder": "A", "funder_id": "https://example.org"}], "funder_id: 'https://example.org' is not valid"),
    ("funding", [{"funder": "A", "award_url": "https://a.org/\u200b"}], "'https://a.org/\\u200b' is not valid"),
    ("known_failures", 2 * [FAILURE], "is given twice"),
    ("known_failures", [FAILURE | {"run": BOUNDARY_ELEMENTS}], f"[0].run: '{BOUNDARY_ELEMENTS}' is not a run"),
    ("known_failures", [FAILURE | {"reason": "\n"}], "known_failures[0].reason: '\\n' is blank"),
    ("title", "A title\n", "title: 'A title\\n' holds a line break"),
    ("keywords", ["a", "\u200b"], "keywords[1]: '\\u200b' is blank"),
    ("communities", ["Contact Mechanics"], "communities[0]: 'Contact Mechanics' is not valid"),
    ("keyword", ["x"], "keyword: unknown key"),
]


@pytest.mark.parametrize(("key", "value", "message"), WRONG)
def test_wrong_values_are_refused(key, value, message, refused):
    refused("publication", {key: value}, message)


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
    with pytest.raises(ConfigurationError, match=r"publication\.date: .* is not valid; expected "):
        load(overrides={"publication": {"date": datetime.datetime(2026, 1, 31, 12)}})


def test_texts_of_the_campaign_that_no_deposit_can_have(refused):
    refused("title", "A\nB", "title: 'A\\nB' holds a line break")
    refused("summary", " ", "summary: ' ' is blank; expected ")
