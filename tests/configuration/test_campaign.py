"""The whole of a campaign: its names and its sections."""

import pytest

BAD = {
    # key, value, what the message must say of it
    "unknown key at the top": ("titel", "x", "titel: unknown key (did you mean 'title'?)"),
    "name of the campaign": ("name", "My Campaign", "is not a name; allowed: lower-case letters, digits"),
    "number as a name": ("name", 7, "name: 7 is not text"),
}


@pytest.mark.parametrize("case", BAD, ids=lambda case: case.replace(" ", "_"))
def test_mistakes_are_named(case, refused):
    refused(*BAD[case])


def test_campaigns_are_immutable(load):
    with pytest.raises(ValueError, match="frozen"):
        load().campaign.materials["soft"].contact_modulus = 1.0
