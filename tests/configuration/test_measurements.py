"""Section `measurements`."""

import pytest

from icha.configuration.errors import ConfigurationError


def _measurement(**changes):
    return {
        "path": "points.csv",
        "label": "measured",
        "citation": "someone",
        "study": "one",
        "load": {"column": "p", "unit": "kPa"},
        "area": {"column": "a", "unit": "percent"},
        "material": "soft",
        "rms_slope": 0.5,
    } | changes


def test_measurements(load, tmp_path):
    (tmp_path / "points.csv").write_text("p, a\n10, 1\n20, 2.5\n")
    changes = {"measurements": {"lab": _measurement()}, "figures": {"fig5_multi_slope": {"study": "one"}}}
    campaign = load(changes).campaign
    (settings,) = campaign.figures.by_name()["fig5_multi_slope"].arguments(campaign)["measurements"]
    assert settings["columns"] == {"p": 1e3, "a": 0.01}
    assert settings["load_unit"] == 25e6 * 0.5


@pytest.mark.parametrize(
    ("table", "changes", "message"),
    [
        ("p,a\n", {}, "contains no values"),
        ("p,b\n1,2\n", {}, "has no column 'a'; expected one of p, b"),
        ("p,a\n1,2\n3,x\n", {}, "column 'a', row 2: 'x'"),
        ("p,a\n1,nan\n", {}, "number greater than 0"),
        ("p,a\n1,-2\n", {}, "number greater than 0"),
        ("p,a\n1,2\n", {"path": "none.csv"}, "no such file; expected a CSV file"),
        ("p,a\n1,2\n", {"study": "two"}, "'two' is not defined"),
        ("p,a\n1,2\n", {"material": "hard"}, "'hard' is not defined"),
        ("p,a\n1,2\n", {"rms_slope": None}, "without material and rms_slope"),
        ("p,a\n1,2\n", {"load": {"column": "p", "unit": "kg"}}, "a unit of pressure"),
        ("p,a\n1,2\n", {"area": {"column": "a", "unit": "m"}}, "expected '1' or 'percent'"),
    ],
)
def test_measurements_that_cannot_be_drawn(table, changes, message, load, tmp_path):
    (tmp_path / "points.csv").write_text(table)
    with pytest.raises(ConfigurationError, match=r"measurements\.lab") as error:
        load({"measurements": {"lab": _measurement(**changes)}})
    assert message in str(error.value)
