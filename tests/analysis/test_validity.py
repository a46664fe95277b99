"""What is said of whether the model holds: numbers that are those of the validation, and what the data say."""

import re

import pytest
import small_campaign as small
from conftest import REPOSITORY

from icha.analysis.validity import VALIDATION, named, of_dataset, statements
from icha.datasets.campaign import campaign_tree


@pytest.mark.parametrize("adhesive", [False, True])
def test_the_errors_are_those_of_the_page_of_the_validation(adhesive):
    page = " ".join((REPOSITORY / "docs/validation.md").read_text().split())
    said = page.split(f"**{'With' if adhesive else 'Without'} adhesion**")[1][:400]
    assert "states of 7 surfaces, p\\* from 0.001 to 0.1" in said
    for quantity, (low, high) in VALIDATION[adhesive].items():
        found = re.search(rf"{quantity} \S+ % \((\S+) to (\S+) %\)", said)
        assert [float(number) for number in found.groups()] == [low, high]
        # The words say that they are too small.
        assert low < high < 0


def told(*arguments):
    return {statement.about: (statement.text, statement.good) for statement in statements(*arguments)}


def test_each_kind_is_said_in_one_line():
    found = told({"load": ["asperities", "boundary_elements"], "pull": ["asperities"]}, {True, False}, "", [])
    assert found["models"] == ("asperities in load, pull; boundary elements in load", True)
    assert found["jump-in"] == ("Wu's distance is verified for Tabor parameters of 1 and more; all cases inside", True)
    text, good = found["accuracy"]
    assert good and text.startswith("contact area 8 to 25 % too small with adhesion and 5 to 21 % without, mean sep")
    assert "contact area 5 to 21 % too small, mean" in told({}, {False}, None, ["scan"])["accuracy"][0]
    assert told({}, {False}, None, ["scan"])["accuracy"][0].endswith(
        "; scan is not a self-affine surface: errors may be others there"
    )
    assert set(told({"load": ["boundary_elements"]}, set(), None, [])) == {"models"}
    assert named("abcdef") == "a, b, c, d and 2 more" and named("ab") == "a, b"


def test_the_data_say_where_spots_lay_outside():
    found = {each.about: each for each in of_dataset(small.tree())}
    assert found["models"].text == "asperities in slopes, single"
    assert found["jump-in"].good and found["jump-in"].text.endswith("; all cases inside")
    sticky = [float(run["stickiness"]) for labels, run in small.runs() if labels.material == "soft"]
    said = f"soft on rough (stickiness {max(sticky):.2g})"
    assert (said in found["sticky"].text) if max(sticky) > 1 else "sticky" not in found
    runs = [
        (labels, run.assign(outside_wu_fraction=0.4 + 0 * run["residual"]) if labels.material == "soft" else run)
        for labels, run in small.runs()
    ]
    found = {each.about: each for each in of_dataset(campaign_tree(runs, attrs=small.tree().attrs))}
    assert found["jump-in"].text.endswith("; outside: soft on rough (40 % of single spots)")
    assert not found["jump-in"].good
