"""Section `measurements`."""

import numpy as np
import pytest

from icha.configuration.errors import ConfigurationError
from icha.support.tables import read_columns
from validation.jkr_test import exact_test


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


def test_pressures_on_layers_may_be_larger_than_those_of_full_contact_with_half_spaces(load, tmp_path):
    """On a thin layer, full contact needs a pressure that grows as the thickness decreases."""
    (tmp_path / "points.csv").write_text("p, a\n5, 60\n")
    layer = {"materials.soft.thickness": "4 um", "materials.soft.poisson_ratio": 0.5}
    changes = {"studies.one.models": ["boundary_elements"]}
    changes |= {"measurements": {"lab": _measurement(rms_slope=0.05, load={"column": "p", "unit": "MPa"})}}
    with pytest.raises(ConfigurationError, match="where every rough surface is in full contact"):
        load(changes)
    assert load(changes | layer).campaign.measurements


def _lens(**columns):
    known = {"force": "mN", "indentation": "um", "contact_radius": "um"} | dict.fromkeys(["rms_height"], "nm")
    known |= dict.fromkeys(["advancing_work", "receding_work"], "mJ/m^2")
    columns = {name: {"column": text, "unit": known[name]} for name, text in columns.items()}
    return _measurement(load=None, area=None, material=None, rms_slope=None) | columns


def _some(*names):
    return {name: _measurement()[name] for name in names}


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


TEN, FEW = [10, 20], [1, 2.5]


@pytest.mark.parametrize(
    ("content", "loads", "areas"),
    [
        (b"p;a\n10;1\n20;2,5\n", TEN, FEW),
        (b"p;a\r\n10,0;1,0\r\n20,0;2,5\r\n", TEN, FEW),
        (b"p\ta\n10\t1\n20\t2,5\n", TEN, FEW),
        (b"p a\n10 1\n20 2.5\n", TEN, FEW),
        (b'"p","a","note"\n"10","1","first, dry"\n"20","2,5",""\n', TEN, FEW),
        (b"# from Jena\n\nnote;p;a;\n\xb5;10;1;\n;20;2.5;\n", TEN, FEW),
        ("\ufeffp,a\n10,1\n20,2.5\n".encode(), TEN, FEW),
        ("p;a\n10;1\n20;2,5\n".encode("utf-16"), TEN, FEW),
        # One decimal sign for the table.
        (b"p;a\n1.200;0,12\n2.400;0,37\n", [1200, 2400], [0.12, 0.37]),
        (b'p,a\n"1,200",0.12\n"2,400",0.37\n', [1200, 2400], [0.12, 0.37]),
        (b"p;a\n1.200.000;0,125\n800;0,370\n", [1.2e6, 800], [0.125, 0.37]),
        (b"p;a\n1.200;1.125\n2.400;2.375\n", [1.2, 2.4], [1.125, 2.375]),
    ],
)
def test_tables_as_spreadsheets_write_them(content, loads, areas, tmp_path):
    (tmp_path / "points.csv").write_bytes(content)
    found = read_columns(tmp_path / "points.csv", {"p": 1e3, "a": 0.5}, {"a": (1.5, "100 %")})
    np.testing.assert_allclose(found, [1e3 * np.array(loads), 0.5 * np.array(areas)], rtol=1e-15)


def _columns(load, load_unit, area, area_unit):
    return {"load": {"column": load, "unit": load_unit}, "area": {"column": area, "unit": area_unit}}


# Tables, keys of the measurement, and a fragment of the message.
WRONG = [
    ("p,b\n1,2\n", {}, "has no column 'a'; expected one of p, b"),
    ("p,a\n1,2\n3,x\n", {}, "column 'a', line 3: 'x'"),
    ("p,a\n1,2\n\n3\n", {}, "has 1 fields in line 4; expected 2"),
    ("p,a\n0,8,0,12\n", {}, "decimal commas need semicolons"),
    ("p;a\n1,234;2\n", {}, "1,234, whose comma may be decimal"),
    ("p,a\n1,2\n2,101\n", {}, "column 'a', line 3: '101' is more than 100 %"),
    ("p;a\n1.200;12\n2.400;37\n", {}, "1.200, whose point may be decimal or separate thousands"),
    ("p;a\n1.5;0,12\n", {}, "1.5 and 0,12 with different decimal signs"),
    ("p;a\n90.000;0,2\n800;3\n", {}, "line 2: '90.000' (the number 90000) is more than 48.8 MPa"),
    ("p,a\n0.8,2\n800,3\n", {"load": {"column": "p", "unit": "1"}}, "line 3: '800' is more than 3.9 (p/(E*"),
    ("p,a\n1,nan\n", {}, "number greater than 0"),
    ("p,a\n1,2\n", {"rms_slope": None}, "lab.rms_slope: the key is missing"),
    ("p,a\n1,2\n", {"material": None}, "without material"),
    ("p,a\n1,2\n", {"load": {"column": "p", "unit": "kg"}}, "a unit of pressure"),
    ("p,a\n1,2\n", {"area": {"column": "a", "unit": "m"}}, "expected '1' or 'percent'"),
]
# Columns with their units in headings and keys.
UNITS = [
    ("pressure (MPa)", "kPa", "area (%)", "percent", "load: the unit is 'kPa', but the heading 'pressure (MPa)'"),
    ("pressure (MPa)", "MPa", "area (%)", "1", "area: the unit is '1', but the heading 'area (%)' states '%'"),
    ("pressure", "kPa", "area [1]", "percent", "states '1'"),
    ("load (N)", "kPa", "area", "percent", "states 'N'"),
    ("pressure (kPa)", "1", "area", "percent", "states 'kPa'"),
    ("pressure", "kPa", "area [‰]", "percent", "states '‰'"),
    ("pressure", "kPa", "A/A0", "percent", "area: the heading 'A/A0' is the name of a fraction; expected the unit"),
    ("log10 pressure (Pa)", "Pa", "area", "percent", "load: the heading 'log10 pressure (Pa)' contains 'log10'"),
    ("pressure x 1e3 (kPa)", "kPa", "area", "percent", "contains a factor; expected numbers without a factor"),
    ("pressure/1000 (Pa)", "Pa", "area", "percent", "contains a factor"),
    ("F/(E* A0)", "1", "area", "percent", "is a load over E* without the rms slope; expected reduced pressures p/"),
    ("p", "mPa", "area", "percent", "load: the unit 'mPa' is implausibly small; expected 'MPa', 'kPa' or 'Pa'"),
]
# Headings of other quantities, of errors and of factors.
OTHERS = [
    (
        {"contact_radius": "contact diameter (um)"},
        "'contact diameter (um)' contains 'diameter', so the numbers may not be",
    ),
    ({"contact_radius": "2a (um)"}, "contains '2a'"),
    ({"contact_radius": "a^2 (um)"}, "contains '^'"),
    ({"contact_radius": "radius (px)"}, "contains 'px'"),
    ({"indentation": "depth/2 (um)"}, "contains '/'"),
    ({"force": "-force (mN)"}, "contains '-'"),
    ({"force": "force error (mN)"}, "contains 'error'"),
    ({"rms_height": "a", "advancing_work": "error of work (mJ/m^2)"}, "contains 'error'"),
]
UNITS += [
    ("pressure (kPa)", "kPa", area, "percent", "so the numbers may not be the area")
    for area in ("non-contact area (%)", "area (% of maximum)")
]
# Columns of measurements with an indenter, and other keys.
LENS = [
    ({"force": "a"}, {}, "lab: has columns of force; expected load and area"),
    ({}, {}, "lab: has columns of no quantity"),
    ({"force": "a", "indentation": "b", "rms_height": "c"}, {}, "or rms_height with advancing_work"),
    ({"force": "a", "indentation": "a"}, {}, "several quantities have the same column"),
    ({"rms_height": "a", "advancing_work": "b"}, {}, "rms_height without material; expected this key"),
    ({"force": "a", "contact_radius": "b"}, {}, "column 'b', line 2: '-2'; expected a number greater than 0"),
    ({"force": "a (N)", "contact_radius": "b"}, {}, "force: the unit is 'mN', but the heading 'a (N)' states 'N'"),
    ({"force": "a", "indentation": "b"}, _some("load"), "has columns of load, force, indentation"),
    (
        {"force": "a", "indentation": "b"},
        _some("load", "area", "material", "rms_slope"),
        "has columns of figure 5 and of indenters",
    ),
]
OTHER = {"kind": "smooth", "side": "1 mm", "grid": 32, "shape": {"sphere": {"radius": "2 mm"}}}
SEVERAL = {"surfaces.other": OTHER, "studies.one.surfaces": ["rough", "other"]}


@pytest.mark.parametrize(
    ("table", "entry", "changes", "message"),
    [
        *((table, _measurement(**keys), {}, message) for table, keys, message in WRONG),
        *((f"{key[0]},{key[2]}\n0.1,0.2\n", _measurement(**_columns(*key)), {}, message) for *key, message in UNITS),
        *(("a,b\n1,-2\n", _lens(**columns), SHAPE, message) for columns, message in OTHERS),
        *(("a,b\n1,-2\n", _lens(**columns) | keys, SHAPE, message) for columns, keys, message in LENS),
        ("F,a\n1,2\n", _lens(force="F", contact_radius="a"), SHAPE | SEVERAL, "whose surfaces have different radii"),
    ],
)
def test_measurements_that_cannot_be_drawn(table, entry, changes, message, refused, tmp_path):
    (tmp_path / "points.csv").write_text(table, encoding="utf-8")
    refused("", changes | {"measurements": {"lab": entry}}, message)


@pytest.mark.parametrize(
    ("order", "sign", "message"),
    [
        (lambda force: np.argsort(force), 1, "is sorted by force"),
        (lambda force: np.arange(len(force))[::-1], 1, "probably in the reverse order"),
        (lambda force: np.tile(np.arange(len(force)), 2), 1, "the force rises for the second time"),
        (lambda force: np.arange(len(force)), -1, "looks like the largest load"),
    ],
)
def test_points_of_figure_18_are_one_test_in_its_order(order, sign, message, load, tmp_path):
    test = exact_test()
    rows = np.stack([sign * test["force"], test["contact_radius"]], axis=1)[order(test["force"])] * 1e3
    lines = [f"{force!r},{radius!r}" for force, radius in rows.tolist()]
    (tmp_path / "points.csv").write_text("\n".join(["F,a", *lines]))
    lens = _lens(force="F", contact_radius="a") | {"material": "soft"}
    lens["contact_radius"]["unit"] = "mm"
    with pytest.raises(ConfigurationError, match=message):
        load(SHAPE | {"measurements": {"lab": lens}})


@pytest.mark.parametrize(
    "columns",
    [
        ("pressure (N/mm²)", "MPa", "A/A0 [%]", "percent"),
        ("pressure", "kPa", "area fraction", "percent"),
        ("p/(E* h'rms)", "1", "area fraction", "1"),
        ("nominal pressure (N/mm**2)", "MPa", "contact area (%)", "percent"),
    ],
)
def test_units_in_headings_may_be_written_in_other_ways(columns, load, tmp_path):
    (tmp_path / "points.csv").write_text(f"{columns[0]},{columns[2]}\n0.1,0.2\n", encoding="utf-8")
    assert load({"measurements": {"lab": _measurement(**_columns(*columns))}}).campaign.measurements
