"""Section `measurements`."""

import pytest

from icha.configuration.errors import ConfigurationError
from icha.support.tables import read_columns


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
    assert settings["contact_modulus"] == 25e6 and settings["rms_slope"] == 0.5


def test_beside_a_shape_pressures_need_no_slope_and_reduced_pressures_do(load, tmp_path):
    (tmp_path / "points.csv").write_text("p, a\n10, 1\n")
    shape = {"surfaces.rough.shape": {"sphere": {"radius": "1 mm"}}}
    assert load(shape | {"measurements": {"lab": _measurement(rms_slope=None)}}).campaign.measurements
    reduced = _measurement(rms_slope=None, load={"column": "p", "unit": "1"})
    assert load({"measurements": {"lab": reduced}}).campaign.measurements
    with pytest.raises(ConfigurationError, match=r"lab\.rms_slope: the key is missing; .* beside a surface with"):
        load(shape | {"measurements": {"lab": reduced}})


@pytest.mark.parametrize(
    "content",
    [
        b"p;a\n10;1\n20;2,5\n",
        b"p;a\r\n10,0;1,0\r\n20,0;2,5\r\n",
        b"p\ta\n10\t1\n20\t2,5\n",
        b"p a\n10 1\n20 2.5\n",
        b'"p","a","note"\n"10","1","first, dry"\n"20","2,5",""\n',
        b"# from Jena\n\nnote;p;a;\n\xb5;10;1;\n;20;2.5;\n",
        "\ufeffp,a\n10,1\n20,2.5\n".encode(),
        "p;a\n10;1\n20;2,5\n".encode("utf-16"),
    ],
)
def test_tables_as_spreadsheets_write_them(content, tmp_path):
    (tmp_path / "points.csv").write_bytes(content)
    loads, areas = read_columns(tmp_path / "points.csv", {"p": 1e3, "a": 0.01}, ratios=["a"])
    assert loads.tolist() == [1e4, 2e4] and areas.tolist() == [0.01, 0.025]


@pytest.mark.parametrize(
    ("table", "changes", "message"),
    [
        ("p,a\n", {}, "contains no values"),
        ("p,b\n1,2\n", {}, "has no column 'a'; expected one of p, b"),
        ("p,a\n1,2\n3,x\n", {}, "column 'a', line 3: 'x'"),
        ("p,a\n1,2,3\n", {}, "has 3 fields in line 2; expected 2"),
        ("p,a\n1,2\n\n3\n", {}, "has 1 fields in line 4; expected 2"),
        ("p,a\n0,8,0,12\n", {}, "decimal commas need semicolons"),
        ("p;a\n1,234;2\n", {}, "1,234 in column 'p', whose comma may be decimal"),
        ("p,a,a\n1,2,3\n", {}, "has 2 columns 'a'"),
        ("p,a\nkPa,%\n1,2\n", {}, "line 2: 'kPa'"),
        ("p,a\n1,2\n2,101\n", {}, "column 'a', line 3: '101' is more than 100 %"),
        ("p,a\n1,1.2\n", {"area": {"column": "a", "unit": "1"}}, "line 2: '1.2' is more than 100 %"),
        ("p,a\n1,1_0\n", {}, "'1_0'"),
        ("p,a\n1,inf\n", {}, "number greater than 0"),
        ("p,a\n1,nan\n", {}, "number greater than 0"),
        ("p,a\n1,-2\n", {}, "number greater than 0"),
        ("p,a\n1,2\n", {"path": "none.csv"}, "no such file; expected a text file with a table"),
        ("p,a\n1,2\n", {"study": "two"}, "'two' is not defined"),
        ("p,a\n1,2\n", {"material": "hard"}, "'hard' is not defined"),
        ("p,a\n1,2\n", {"rms_slope": None}, "lab.rms_slope: the key is missing"),
        ("p,a\n1,2\n", {"material": None}, "without material"),
        ("p,a\n1,2\n", {"load": {"column": "p", "unit": "kg"}}, "a unit of pressure"),
        ("p,a\n1,2\n", {"area": {"column": "a", "unit": "m"}}, "expected '1' or 'percent'"),
    ],
)
def test_measurements_that_cannot_be_drawn(table, changes, message, load, tmp_path):
    (tmp_path / "points.csv").write_text(table)
    with pytest.raises(ConfigurationError, match=r"measurements\.lab") as error:
        load({"measurements": {"lab": _measurement(**changes)}})
    assert message in str(error.value)
