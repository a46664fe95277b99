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
    (tmp_path / "points.csv").write_text("p, a\n1, 1\n")
    shape = {"surfaces.rough.shape": {"sphere": {"radius": "1 mm"}}, "studies.one.models": ["boundary_elements"]}
    assert load(shape | {"measurements": {"lab": _measurement(rms_slope=None)}}).campaign.measurements
    reduced = _measurement(rms_slope=None, load={"column": "p", "unit": "1"})
    assert load({"measurements": {"lab": reduced}}).campaign.measurements
    with pytest.raises(ConfigurationError, match=r"lab\.rms_slope: the key is missing; .* beside a surface with"):
        load(shape | {"measurements": {"lab": reduced}})
    too_large = _measurement(rms_slope=None, load={"column": "p", "unit": "GPa"})
    with pytest.raises(ConfigurationError, match=r"'1' is more than 25 MPa \(F/\(E\* A0\) = 1"):
        load(shape | {"measurements": {"lab": too_large}})


def _lens(**columns):
    known = {"force": "mN", "indentation": "um", "contact_radius": "um"} | dict.fromkeys(["rms_height"], "nm")
    known |= dict.fromkeys(["advancing_work", "receding_work"], "mJ/m^2")
    columns = {name: {"column": text, "unit": known[name]} for name, text in columns.items()}
    return _measurement(load=None, area=None, material=None, rms_slope=None) | columns


SHAPE = {"surfaces.rough.shape": {"sphere": {"radius": "1 mm"}}, "studies.one.models": ["boundary_elements"]}


def test_measurements_of_indenters_may_be_negative(load, tmp_path):
    (tmp_path / "points.csv").write_text("F (mN),d,a\n-1,-20,1\n2,5,2\n")
    lens = _lens(force="F (mN)", indentation="d", contact_radius="a") | {"material": "soft"}
    figures = {"fig17_force_indentation": {"study": "one"}, "fig5_multi_slope": {"study": "one"}}
    changes = SHAPE | {"measurements": {"lab": lens}, "figures": figures, "studies.one.unload": True}
    campaign = load(changes).campaign
    (known,) = campaign.figures.by_name()["fig17_force_indentation"].arguments(campaign)["measurements"]
    assert known["columns"] == pytest.approx({"F (mN)": 1e-3, "d": 1e-6, "a": 1e-6})
    assert known["quantities"] == ["force", "indentation", "contact_radius"]
    assert "measurements" not in campaign.figures.by_name()["fig5_multi_slope"].arguments(campaign)


@pytest.mark.parametrize(
    ("columns", "changes", "message"),
    [
        ({"force": "a"}, {}, "lab: has columns of force; expected load and area"),
        ({}, {}, "lab: has columns of no quantity"),
        ({"force": "a", "indentation": "b", "rms_height": "c"}, {}, "or rms_height with advancing_work"),
        ({"force": "a", "indentation": "a"}, {}, "several quantities have the same column"),
        ({"rms_height": "a", "advancing_work": "b"}, {}, "rms_height without material; expected this key"),
        ({"force": "a", "contact_radius": "b"}, {}, "column 'b', line 2: '-2'; expected a number greater than 0"),
        ({"force": "a (N)", "contact_radius": "b"}, {}, "force: the unit is 'mN', but the heading 'a (N)' states 'N'"),
        (
            {"force": "a", "indentation": "b"},
            {"load": _measurement()["load"]},
            "has columns of load, force, indentation",
        ),
        (
            {"force": "a", "indentation": "b"},
            {name: _measurement()[name] for name in ("load", "area", "material", "rms_slope")},
            "has columns of figure 5 and of indenters",
        ),
    ],
)
def test_measurements_of_indenters_that_cannot_be_drawn(columns, changes, message, load, tmp_path):
    (tmp_path / "points.csv").write_text("a,b\n1,-2\n")
    with pytest.raises(ConfigurationError, match=r"measurements\.lab") as error:
        load(SHAPE | {"measurements": {"lab": _lens(**columns) | changes}})
    assert message in str(error.value)


def test_contact_radii_need_one_lens(load, tmp_path):
    (tmp_path / "points.csv").write_text("F,a\n1,2\n")
    other = {"kind": "smooth", "side": "1 mm", "grid": 32, "shape": {"sphere": {"radius": "2 mm"}}}
    changes = {"surfaces.other": other, "studies.one.surfaces": ["rough", "other"]}
    with pytest.raises(
        ConfigurationError, match=r"contact_radius: 'a' has a study whose surfaces have different radii"
    ):
        load(SHAPE | changes | {"measurements": {"lab": _lens(force="F", contact_radius="a")}})


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
    loads, areas = read_columns(tmp_path / "points.csv", {"p": 1e3, "a": 0.01}, {"a": (1.0, "100 %")})
    assert loads.tolist() == [1e4, 2e4] and areas.tolist() == [0.01, 0.025]


@pytest.mark.parametrize(
    ("table", "changes", "message"),
    [
        ("p,b\n1,2\n", {}, "has no column 'a'; expected one of p, b"),
        ("p,a\n1,2\n3,x\n", {}, "column 'a', line 3: 'x'"),
        ("p,a\n1,2\n\n3\n", {}, "has 1 fields in line 4; expected 2"),
        ("p,a\n0,8,0,12\n", {}, "decimal commas need semicolons"),
        ("p;a\n1,234;2\n", {}, "1,234, whose comma may be decimal"),
        ("p,a\n1,2\n2,101\n", {}, "column 'a', line 3: '101' is more than 100 %"),
        ("p;a\n1.200;12\n2.400;37\n", {}, "1.200, whose point may be decimal or separate thousands"),
        ("p;a\n1.5;0,12\n", {}, "1.5 and 0,12 with different decimal signs"),
        ("p;a\n90.000;0,2\n800;3\n", {}, "line 2: '90.000' (the number 90000) is more than 47.98 MPa"),
        ("p,a\n0.8,2\n800,3\n", {"load": {"column": "p", "unit": "1"}}, "line 3: '800' is more than 3.84 (p/(E*"),
        ("p,a\n1,nan\n", {}, "number greater than 0"),
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


@pytest.mark.parametrize(
    ("load_column", "load_unit", "area_column", "area_unit", "message"),
    [
        ("pressure (MPa)", "kPa", "area (%)", "percent", "load: the unit is 'kPa', but the heading 'pressure (MPa)'"),
        ("pressure (MPa)", "MPa", "area (%)", "1", "area: the unit is '1', but the heading 'area (%)' states '%'"),
        ("pressure", "kPa", "area [1]", "percent", "states '1'"),
        ("load (N)", "kPa", "area", "percent", "states 'N'"),
        ("pressure (kPa)", "1", "area", "percent", "states 'kPa'"),
        ("pressure (N/mm²)", "MPa", "A/A0 [%]", "percent", None),
        ("pressure", "kPa", "area [‰]", "percent", "states '‰'"),
        ("pressure", "kPa", "A/A0", "percent", "area: the heading 'A/A0' is the name of a fraction; expected the unit"),
        ("pressure", "kPa", "area fraction", "percent", None),
        ("log10 pressure (Pa)", "Pa", "area", "percent", "load: the heading 'log10 pressure (Pa)' contains 'log10'"),
        ("pressure x 1e3 (kPa)", "kPa", "area", "percent", "contains a factor; expected numbers without a factor"),
        ("pressure/1000 (Pa)", "Pa", "area", "percent", "contains a factor"),
        ("F/(E* A0)", "1", "area", "percent", "is a load over E* without the rms slope; expected reduced pressures p/"),
        ("p", "mPa", "area", "percent", "load: the unit 'mPa' is implausibly small; expected 'MPa', 'kPa' or 'Pa'"),
        ("p/(E* h'rms)", "1", "area fraction", "1", None),
        ("pressure (N/mm**2)", "MPa", "area (%) 10x objective", "percent", None),
    ],
)
def test_units_in_headings_are_those_of_the_keys(
    load_column, load_unit, area_column, area_unit, message, load, tmp_path
):
    (tmp_path / "points.csv").write_text(f"{load_column},{area_column}\n0.1,0.2\n", encoding="utf-8")
    columns = {"load": {"column": load_column, "unit": load_unit}, "area": {"column": area_column, "unit": area_unit}}
    changes = {"measurements": {"lab": _measurement(**columns)}}
    if message is None:
        assert load(changes).campaign.measurements
        return
    with pytest.raises(ConfigurationError, match=r"measurements\.lab") as error:
        load(changes)
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("table", "loads", "areas"),
    [
        ("p;a\n1.200;0,12\n2.400;0,37\n", [1200, 2400], [0.12, 0.37]),
        ('p,a\n"1,200",0.12\n"2,400",0.37\n', [1200, 2400], [0.12, 0.37]),
        ("p;a\n1.200.000;0,125\n800;0,370\n", [1.2e6, 800], [0.125, 0.37]),
        ("p;a\n1.200;1.125\n2.400;2.375\n", [1.2, 2.4], [1.125, 2.375]),
    ],
)
def test_one_decimal_sign_for_the_table(table, loads, areas, tmp_path):
    (tmp_path / "points.csv").write_text(table)
    found = read_columns(tmp_path / "points.csv", {"p": 1.0, "a": 1.0})
    assert [each.tolist() for each in found] == [loads, areas]
