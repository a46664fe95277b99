"""Section `publication`."""

import datetime

import pytest
from demo_configuration import CARBERRY, ORCID

from icha.configuration.errors import ConfigurationError


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
