"""JKR tests from tables: exact curves, coverage of intervals, columns, points left out, refusals, warnings."""

import itertools
import math
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import icha
from icha.boundary_elements.contact import contact_of
from icha.cli import app
from icha.references.jkr_tables import read_points, refuse_lost_order
from icha.references.jkr_test import Estimate, force_increase_by_layer
from validation.jkr_test import exact_test, noisy_test, with_free_states

TRUTH = {"contact_modulus": 1.8e6, "advancing_work": 0.03, "receding_work": 0.09}
RADIUS, COLUMNS = 5e-3, ["contact_radius", "indentation"]
# The table of the tests that need no noise, with little scatter.
EXACT = exact_test(points=40)


def values(test):
    return [getattr(test, name).value for name in TRUTH]


def as_csv(table, folder, headings="force (mN),contact radius (um)", factors=(1e3, 1e6), delimiter=","):
    rows = np.column_stack(list(table.values())) * factors
    path = folder / "test.csv"
    np.savetxt(path, rows, "%.9g", delimiter, header=headings.replace(",", delimiter), comments="", encoding="utf-8")
    return path


@pytest.mark.parametrize(("columns", "receding"), [(COLUMNS[:1], 0.09), (COLUMNS[1:], 0.03), (COLUMNS, 0.09)])
def test_exact_points_return_their_parameters(columns, receding):
    table = {name: each for name, each in exact_test(receding=receding).items() if name in ("force", *columns)}
    if "indentation" in columns:
        table["indentation"] = table["indentation"] + 3e-6
    test = icha.fit_jkr_test(table, RADIUS)
    np.testing.assert_allclose(values(test), [1.8e6, 0.03, receding], rtol=1e-3)
    assert test.warnings == () and set(test.counts) <= {"loading", "stuck", "receding"}
    assert np.abs(test.residuals["force"]).max() < 1e-5 * table["force"].max()
    if "indentation" in columns:
        assert test.indentation_offset.value == pytest.approx(3e-6, abs=1e-9)
        known = icha.fit_jkr_test(table, RADIUS, indentation_offset=3e-6)
        assert known.indentation_offset is None
        np.testing.assert_allclose(values(known), values(test), rtol=1e-3)
        assert np.abs(known.residuals["indentation"]).max() < 1e-9


def reversible_test(order, seed, **branch):
    """Return a test with one work of adhesion, and noise of 0.5 %, from points of 40 loads and 40 loads back."""
    states, rng = exact_test(receding=TRUTH["advancing_work"], points=80), np.random.default_rng(seed)
    columns = {name: states[name][order] for name in ("force", "contact_radius")}
    return {n: each + 0.005 * np.ptp(each) * rng.standard_normal(len(order)) for n, each in columns.items()} | branch


@pytest.mark.parametrize("seed", range(4))
def test_the_turning_point_of_a_reversible_test_lies_at_the_largest_force(seed):
    test = icha.fit_jkr_test(reversible_test(range(80), seed), RADIUS)
    assert test.loop.stuck_radius == pytest.approx(exact_test()["contact_radius"].max(), rel=5e-3)
    assert test.warnings == ()


def test_points_that_dwell_at_the_turning_point_have_the_same_intervals_on_both_branches():
    order, widths = [*range(40), *[39] * 18, *range(40, 80)], []
    for loading in (40, 58):
        branch = ["loading"] * loading + ["unloading"] * (98 - loading)
        low_high = icha.fit_jkr_test(reversible_test(order, 7, branch=branch), RADIUS).advancing_work[1:]
        widths.append(np.ptp(low_high))
    assert widths[0] == pytest.approx(widths[1], rel=0.2)


def test_stuck_points_lie_on_the_line_of_a_punch():
    test = icha.fit_jkr_test(EXACT, RADIUS)
    stuck = test.used_for == "stuck"
    assert stuck.sum() > 5
    np.testing.assert_allclose(test.fitted["contact_radius"][stuck], EXACT["contact_radius"].max(), rtol=1e-4)
    slope = np.polyfit(test.fitted["indentation"][stuck], test.fitted["force"][stuck], 1)[0]
    assert slope == pytest.approx(2 * 1.8e6 * EXACT["contact_radius"].max(), rel=1e-4)


def test_intervals_contain_the_truth_in_eight_to_ten_of_ten_tests():
    rng, inside = np.random.default_rng(1), dict.fromkeys(TRUTH, 0)
    for number in range(10):
        columns, offset = COLUMNS[number % 2 :][:1], 1e-6 * (number % 2)
        test = icha.fit_jkr_test(noisy_test(EXACT, rng, columns, offset), RADIUS)
        for name, value in TRUTH.items():
            interval = getattr(test, name)
            assert interval.low < interval.value < interval.high
            inside[name] += interval.low <= value <= interval.high
    assert all(8 <= count <= 10 for count in inside.values()), inside


@pytest.mark.parametrize(
    ("headings", "factors", "delimiter", "options"),
    [
        ("force (mN),contact radius (um)", (1e3, 1e6), ",", {}),
        ("Load [µN],a / mm", (1e6, 1e3), ";", {}),
        ("F_N,radius um", (1, 1e6), "\t", {}),
        ("force,a", (1e3, 1e6), ",", {"units": {"force": "mN", "contact_radius": "um"}}),
        (
            "cell (gf),a (nm)",
            (1e3 / 9.80665, 1e9),
            ",",
            {"columns": {"force": "cell (gf)", "contact_radius": "a (nm)"}},
        ),
    ],
)
def test_units_of_headings_and_options(headings, factors, delimiter, options, tmp_path):
    table = {name: EXACT[name] for name in ("force", "contact_radius")}
    path = as_csv(table, tmp_path, headings, factors, delimiter)
    found = read_points(path, options.get("columns", {}), options.get("units", {})).values
    for name, each in table.items():
        np.testing.assert_allclose(found[name], each, rtol=1e-8)


def test_a_column_of_the_branch_replaces_the_order():
    order = np.random.default_rng(2).permutation(40)
    table = {name: EXACT[name][order] for name in ("force", "contact_radius")}
    table["branch"] = np.where(order < 20, "loading", "Retraction")
    np.testing.assert_allclose(values(icha.fit_jkr_test(table, RADIUS)), list(TRUTH.values()), rtol=1e-3)
    # Sorted by the force, neighbours are of both branches.
    order = np.argsort(EXACT["force"], kind="stable")
    table = {name: EXACT[name][order] for name in ("force", "contact_radius")}
    table["branch"] = np.where(order < 20, "loading", "unloading")
    np.testing.assert_allclose(values(icha.fit_jkr_test(table, RADIUS)), list(TRUTH.values()), rtol=1e-3)


def test_points_without_contact_are_left_out_and_counted():
    """An instrument records noise around zero before the jump-in and after pull-off."""
    rng = np.random.default_rng(3)
    before, after = np.linspace(-20e-6, -1e-6, 15), np.linspace(-4e-6, -20e-6, 12)
    states = exact_test(points=60)
    # The jump-in under displacement control leads to tension, which a test under load control has not.
    jumped = {"force": [-4 / 3 * math.pi * 0.03 * RADIUS], "indentation": [0.0]}
    force = np.concatenate([np.zeros(15), jumped["force"], states["force"], np.zeros(12)])
    depth = np.concatenate([before, jumped["indentation"], states["indentation"], after])
    test = icha.fit_jkr_test({"force": force + 1e-5 * rng.standard_normal(len(force)), "indentation": depth}, RADIUS)
    assert test.counts["without contact"] == 27
    np.testing.assert_allclose(values(test), list(TRUTH.values()), rtol=0.05)
    assert np.isnan(test.fitted["force"][:15]).all()
    contact = np.concatenate([np.zeros(16), states["contact_radius"], np.zeros(12)])
    assert icha.fit_jkr_test({"force": force, "contact_radius": contact}, RADIUS).counts["without contact"] == 28


@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize("free", [0.0, -0.2])
def test_a_single_point_without_contact_changes_nothing(noise, free):
    """Exports often begin with the zero of the instrument, or with the last point of the approach."""
    states, rng = exact_test(points=26), np.random.default_rng(1)
    names, largest = ("force", "indentation"), {name: states[name].max() for name in ("force", "indentation")}
    table = {name: states[name] + noise * largest[name] * rng.standard_normal(26) for name in names}
    first = {"force": noise * largest["force"], "indentation": free * largest["indentation"]}
    longer = {name: np.append(first[name], table[name]) for name in names}
    tests = [icha.fit_jkr_test(each, RADIUS) for each in (table, longer)]
    assert tests[1].counts == tests[0].counts | {"without contact": 1} and np.isnan(tests[1].fitted["force"][0])
    np.testing.assert_allclose(values(tests[1]), values(tests[0]), rtol=0.01)
    np.testing.assert_allclose(tests[1].advancing_work, tests[0].advancing_work, rtol=0.02)


@pytest.mark.parametrize("columns", [COLUMNS[:1], COLUMNS[1:]])
def test_a_shifted_zero_of_the_force_is_seen_without_contact(columns):
    states = with_free_states(EXACT, 10)
    for shift, warned in ((0.0, False), (1e-4, True), (-1e-4, True)):
        table = {name: states[name] for name in ("force", *columns)}
        noise = 2e-5 * np.random.default_rng(1).standard_normal(len(table["force"]))
        test = icha.fit_jkr_test(table | {"force": table["force"] + shift + noise}, RADIUS)
        assert test.counts["without contact"] == 20
        shown = f"{'-' * (shift < 0)}(9|10)\\d(\\.\\d)? µN"
        assert any(re.search(f"without contact is {shown}", text) for text in test.warnings) == warned, test.warnings


def test_a_retreat_without_adhesion_is_no_contact():
    radius = np.append(np.linspace(10e-6, 300e-6, 20), np.linspace(290e-6, 10e-6, 20))
    force = np.append(4 * 1e6 * radius**3 / (3 * RADIUS), np.zeros(30))
    depth = np.append(radius**2 / RADIUS, np.linspace(-1e-6, -40e-6, 30))
    noise = 2e-3 * force.max() * np.random.default_rng(2).standard_normal(len(force))
    test = icha.fit_jkr_test({"force": force + noise, "indentation": depth}, RADIUS)
    assert test.contact_modulus.value == pytest.approx(1e6, rel=0.02) and test.counts["without contact"] >= 28


def test_a_long_approach_does_not_replace_points_of_loading():
    states = exact_test(points=40)
    table = {name: states[name][18:] for name in ("force", "indentation")}
    approach = {"force": np.zeros(20), "indentation": np.linspace(-20e-6, -1e-6, 20)}
    with pytest.raises(ValueError, match="has 2 points of loading and 20 of unloading with contact; expected at least"):
        icha.fit_jkr_test({name: np.append(approach[name], table[name]) for name in table}, RADIUS)


def test_without_unloading_there_is_only_the_advancing_work():
    table = {name: EXACT[name][:20] for name in ("force", "contact_radius")}
    # The turning point and one lower force are not unloading.
    table = {name: np.append(each, 0.99 * each[-1]) for name, each in table.items()}
    with pytest.warns(icha.IchaWarning, match="fewer than 3 points of unloading have contact"):
        test = icha.fit_jkr_test(table, RADIUS)
    assert test.receding_work is None and "receding" not in str(test).split("warning")[0]
    assert test.advancing_work.value == pytest.approx(0.03, rel=1e-3) and test.counts.pop("loading") == 20
    assert test.counts["unloading (fewer than 3)"] == 1


def test_a_stuck_contact_gives_a_lower_bound_of_the_receding_work():
    states = exact_test(points=60)
    table = {name: states[name][:42] for name in ("force", "contact_radius")}
    with pytest.warns(icha.IchaWarning, match=r"stuck at nearly all points .* at least about") as caught:
        test = icha.fit_jkr_test(table, RADIUS)
    bound = float(str(caught[0].message).split("about ")[1].split()[0]) / 1e3
    assert test.receding_work is None and test.counts["stuck"] > 10 and 0.04 < bound < 0.09


@pytest.mark.parametrize("seed", range(6))
def test_noise_of_stuck_points_is_no_receding_work(seed):
    """Unloading ends halfway to the force at which the contact would recede."""
    stuck = EXACT["contact_radius"] == EXACT["contact_radius"].max()
    top, rng = int(np.argmax(EXACT["force"])), np.random.default_rng(seed)
    last, size = EXACT["force"][stuck].min(), EXACT["contact_radius"].max()
    force = np.append(EXACT["force"][: top + 1], np.linspace(EXACT["force"].max(), last, 41)[1:21])
    radius = np.append(EXACT["contact_radius"][: top + 1], np.full(20, size))
    noise = 0.01 * rng.standard_normal((2, len(force)))
    table = {"force": force + noise[0] * np.ptp(force), "contact_radius": radius + noise[1] * size}
    with pytest.warns(icha.IchaWarning, match="at least about"):
        test = icha.fit_jkr_test(table, RADIUS)
    assert test.receding_work is None and test.counts["stuck"] >= 18


@pytest.mark.parametrize("thickness", [5.0, 2.0, 1.0])
def test_the_force_on_a_thin_layer_is_that_of_boundary_elements(thickness):
    """A sphere of radius 1 without adhesion; thickness in units of the contact radius on a half-space."""
    indentation = 0.02
    size, grid = np.sqrt(indentation), 64
    surface = icha.Surface(np.zeros((grid, grid)), 4 * size, "free", icha.Paraboloid((1.0, 1.0)))
    contact = contact_of(surface, icha.Material(1.0, 0.0, thickness=thickness * size, poisson_ratio=0.5))
    state = contact.equilibrium(contact.untouched(), -indentation)
    radius = np.sqrt(contact.area_fraction(state) * contact.area / np.pi)
    force = contact.pressure(state) * contact.area / (4 / 3 * size**3)
    assert 1 + force_increase_by_layer(radius / (thickness * size)) == pytest.approx(force, rel=0.03)


@pytest.mark.parametrize(
    ("options", "changes", "message"),
    [
        ({}, {"radius": 2e-4, "load": 1e-3}, r"times the radius of the lens: .* \d\.\d % larger"),
        ({"thickness": 1e-3}, {}, "times the thickness: on a bonded, incompressible layer, .* 41 %"),
        ({"interaction_range": 1e-5}, {}, "at the Tabor parameter"),
        ({"roughness": "rough"}, {}, r"U_full/Δγ = .* apparent"),
        ({}, {"receding": 0.03}, "less than the advancing one"),
    ],
)
def test_limits_of_the_law_are_warnings(options, changes, message):
    if "roughness" in options:
        spectrum = icha.SelfAffineSpectrum(1e-4, 5e-5, 1.6e-5, 0.8, 0.1)
        options = {"roughness": spectrum.realise(64, 1)}
    states = exact_test(**changes)
    table = {name: states[name] for name in ("force", "contact_radius")}
    if "receding" in changes:  # contact without a stuck part, larger on loading
        table["contact_radius"][-25:] *= 0.97
    with pytest.warns(icha.IchaWarning, match=message):
        icha.fit_jkr_test(table, changes.get("radius", RADIUS), **options)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("force (mN),a (um)\n1,100\n2,nan\n", "column 'a (um)', line 3: 'nan'; expected a number"),
        ("force (mN),a (um)\n1,100\n2,-1\n", "column 'a (um)', line 3: '-1'; expected a number, 0 or greater"),
        ("force (mN),a (um)\n1,200\n2,220\n3,6000\n4,250\n", "line 4: 0.006 m is not less than the radius of the lens"),
        ("force,a (um)\n1,2\n", "column 'force': the unit is missing; expected a unit of force"),
        ("force (um),a (um)\n1,2\n", "'um' is not a unit of force; expected a unit such as mN"),
        ("force (mN),area (um^2)\n1,2\n", "for contact radius or indentation among force (mN), area (um^2)"),
        ("a (um),t\n2,1\n", "has no column for force"),
        ("force (mN),a in diameters (um)\n1,2\n", "column 'a in diameters (um)' contains 'diameters', so"),
        ("force (x10 mN),a (um)\n1,2\n", "the unit is 'mN', but the heading states 'x10 mN'"),
        (
            "load (g),a (um)\n1,2\n",
            "'g' is not a unit of force; expected a unit of force in the heading, such as 'force (mN)'",
        ),
        ("force (mN),indentation/2 (um)\n1,2\n", "contains '/', so the numbers may not be the indentation"),
        ("force (mN e-1),a (um)\n1,2\n", "contains 'e'"),
        ("force (mN),load (N),a (um)\n1,2,3\n", "has several columns for force: force (mN), load (N); choose one"),
        ("force (mN) x 10,a (um)\n1,2\n", "contains a factor"),
        ("force (mN),a (um)\n-1,10\n-2,20\n-3,30\n-2,25\n", "line 4, the smallest force, looks like the largest load"),
        ("force (mN),a (um)\n1,10\n2,20\n", "has 2 points of loading and 0 of unloading with contact; expected"),
        ("force (mN),a (um)\n3,100\n2,90\n1,80\n0,70\n", "has 1 point of loading and 3 of unloading with contact"),
        ("force (mN),a (um)\n1,10\n4,20\n-1,5\n3,15\n-1,5\n", "line 5: the force rises for the second time"),
        ("force (mN),a (um)\n1,1\n2,2\n3,3\n-9999,4\n-9999,5\n", "line 5: -9999 is more than 30 times every other"),
        ("force (mN),depth (um)\n1,-1\n4,-4\n1,-2\n-1,1\n", "Change the sign of the indentations"),
        ("force (mN),a (um)\n1,1\n2,0\n3,3\n4,4\n", "line 3: 0 between points with contact"),
        ("force (mN),a (um)\n1,10\n2,10\n3,10\n4,10\n", "contact_radius: all values are the same"),
        ("force (mN),a (um),branch\n1,10,loading\n2,20,hold\n", "column 'branch', line 3: 'hold'; expected loading or"),
    ],
)
def test_tables_that_are_no_jkr_test_are_refused(text, message, tmp_path):
    path = tmp_path / "test.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"test\.csv: ") as error:
        icha.fit_jkr_test(path, RADIUS)
    assert message in str(error.value)


@pytest.mark.parametrize("load", [2e-3, 4e-3])
def test_a_second_cycle_to_a_lower_load_is_refused(load):
    cycles = [exact_test(points=40), exact_test(points=30, load=load)]
    table = {name: np.concatenate([cycle[name] for cycle in cycles]) for name in ("force", "contact_radius")}
    with pytest.raises(ValueError, match=r"point \d+: the force rises for the second time"):
        icha.fit_jkr_test(table, RADIUS)


@pytest.mark.parametrize(
    ("name", "point", "factor"), [("force", 15, 10), ("contact_radius", 5, 6), ("contact_radius", 30, 0.6)]
)
def test_points_far_from_all_others_are_refused_by_name(name, point, factor):
    table = noisy_test(EXACT, np.random.default_rng(1), COLUMNS[:1])
    table = {each: values / 10 + 0.9 * EXACT[each] for each, values in table.items()}
    table[name][point] *= factor
    with pytest.raises(ValueError, match=rf"one point that lies far from the others: point {point + 1} \(.*remove"):
        icha.fit_jkr_test(table, RADIUS)


def test_a_sorted_table_has_lost_the_order_of_the_test():
    """Sorting mixes loading and unloading, and a column of the branch separates them."""
    table = noisy_test(EXACT, np.random.default_rng(1), COLUMNS)
    order = {name: np.argsort(each) for name, each in table.items()}
    branch = np.where(np.arange(40) < 20, "loading", "unloading")
    for name, places in order.items():
        mixed = {quantity: each[places] for quantity, each in table.items()}
        with pytest.raises(ValueError, match=f"is sorted by {name}, so neighbouring points jump"):
            icha.fit_jkr_test(mixed, RADIUS)
    test = icha.fit_jkr_test(mixed | {"branch": branch[places]}, RADIUS)
    np.testing.assert_allclose(values(test), list(TRUTH.values()), rtol=0.15)


@pytest.mark.parametrize("noise", [0.005, 0.01])
def test_most_short_sorted_tables_are_refused_and_few_tables_of_loading(noise):
    """With 16 to 40 points; loading under load control has forces without noise, which look sorted."""
    rng, refused = np.random.default_rng(3), {"sorted": 0, "loading": 0}
    for _ in range(40):
        truth = {"radius": RADIUS, "receding": rng.uniform(0.06, 0.2), "points": int(rng.integers(16, 40))}
        states = exact_test(**truth)
        size = noise * np.abs(states["indentation"]).max()
        states["indentation"] = states["indentation"] + size * rng.standard_normal(len(states["force"]))
        loading = np.arange(truth["points"] // 2)
        for name, places in {"sorted": np.argsort(states["force"], kind="stable"), "loading": loading}.items():
            table = {quantity: states[quantity][places] for quantity in ("force", "indentation")}
            try:
                refuse_lost_order(table, [""] * len(places))
            except ValueError:
                refused[name] += 1
    assert refused["sorted"] >= 36 and refused["loading"] <= 1


def test_implausible_fits_are_refused_or_warned_of():
    force, radius = EXACT["force"], EXACT["contact_radius"]
    for other, message in (
        (np.random.default_rng(0).permutation(radius), "not determine the contact modulus"),
        (1e-3 * radius, "contact_modulus: .* is unusual"),
    ):
        with pytest.raises(ValueError, match=message):
            icha.fit_jkr_test({"force": force, "contact_radius": other}, RADIUS)
    with pytest.warns(icha.IchaWarning, match="residuals of neighbouring points are correlated"):
        icha.fit_jkr_test({"force": force, "contact_radius": radius**2 / radius.max()}, RADIUS)
    for ratio, column, warned in ((8, 0, False), (30, 1, True)):
        states = exact_test(load=ratio * 1.5 * math.pi * 0.09 * RADIUS)
        table = noisy_test(states, np.random.default_rng(1), COLUMNS[column:][:1])
        test = icha.fit_jkr_test(table, RADIUS, indentation_offset=0.0)
        assert any("times the pull-off force: noise hides the adhesion" in text for text in test.warnings) == warned


def test_points_without_adhesion_are_said_to_show_none():
    """Without adhesion at all, and with adhesion in unloading alone."""
    radius = np.concatenate([np.linspace(20e-6, 100e-6, 20), np.linspace(98e-6, 15e-6, 20)])
    hertz = {"force": 4 * 1e6 * radius**3 / (3 * RADIUS), "contact_radius": radius}
    hertz["indentation"] = radius**2 / RADIUS
    cases = (hertz, COLUMNS[:1], 1e-4), (exact_test(advancing=0.0), COLUMNS[:1], 1e-3), (hertz, COLUMNS[1:], 1e-2)
    unseen = 0
    for (states, columns, most), seed in itertools.product(cases, range(6)):
        table = noisy_test(states, np.random.default_rng(seed), columns)
        test = icha.fit_jkr_test(table, RADIUS, indentation_offset=0.0)
        work, texts = test.advancing_work, " ".join(test.warnings)
        assert work.value < work.high < most
        assert ("points of loading show no adhesion: the interval of the advancing work" in texts) == (work.low == 0)
        assert work.low > 0 or "advancing work: at the Tabor parameter" not in texts
        unseen += work.low == 0
    assert unseen >= 0.7 * 18


def test_the_width_of_an_interval_is_printed_with_two_digits():
    narrow = Estimate(1e6, 0.99999e6, 1.00001e6).text("Pa")
    assert narrow == "1.000000 MPa, 90 % interval 0.999990 to 1.000010 MPa"


def test_intervals_do_not_depend_on_wrong_ratios_of_errors():
    """Contact radii with half of the default error: near pull-off, the error of the force alone matters."""
    rng, ratios = np.random.default_rng(1), []
    for _ in range(5):
        table = noisy_test(EXACT, rng, COLUMNS[:1], size="range")
        errors = {name: float(np.ptp(EXACT[name])) for name in table}
        works = [icha.fit_jkr_test(table, RADIUS, errors=each).receding_work for each in (None, errors)]
        ratios.append((works[0].high - works[0].low) / (works[1].high - works[1].low))
    assert np.mean(ratios) > 0.9


@pytest.mark.parametrize(
    ("table", "options", "message"),
    [
        (EXACT, {"radius": -1.0}, "radius: -1.0 must be"),
        (EXACT, {"units": {"strength": "N"}}, "units: 'strength' is not a quantity"),
        (EXACT, {"columns": {"force": "load"}}, "has no column 'load'; expected one of force, contact_radius"),
        (EXACT, {"errors": {"force": 1e-5}}, "errors: no value for contact_radius"),
        (EXACT | {"force": ["1"] * 40}, {}, "column 'force': expected a list of 40 finite numbers"),
        ({"force": [], "contact_radius": []}, {}, "column 'force': expected a list of several finite numbers"),
        ([1.0], {}, "list is not a table"),
    ],
)
def test_invalid_arguments_are_refused(table, options, message):
    with pytest.raises(ValueError, match=message.replace("(", r"\(")):
        icha.fit_jkr_test(table, **{"radius": RADIUS} | options)


def test_the_command_prints_intervals_and_draws_the_figure(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = noisy_test(EXACT, np.random.default_rng(1), COLUMNS[:1])
    as_csv(table, tmp_path)
    done = CliRunner().invoke(app, ["jkr", "test.csv", "--radius", "5 mm", "--thickness", "10 mm"])
    assert done.exit_code == 0, done.output
    for words in ("contact modulus E*", "adhesion, receding", "90 % interval", "points: ", "figure: test_jkr.png"):
        assert words in done.output
    assert Path("test_jkr.png").stat().st_size > 10_000 and Path("test_jkr.pdf").exists()
    figure = icha.plot_jkr_test(icha.fit_jkr_test(EXACT, RADIUS))
    assert len(figure.axes) == 6
    drawn = sum(len(line.get_xdata()) for line in figure.axes[0].lines if line.get_marker() in "oDs")
    assert drawn == len(EXACT["force"])
    assert "intervals are those of random errors, with a correct zero of the force\n" in done.output
    slip = CliRunner().invoke(app, ["jkr", "test.csv", "--radius", "5 m"])
    assert "mJ/m², is less than 1 mJ/m²; expected 10 to 200 mJ/m²" in slip.output
    for options in ("5", "0 mm", "5 mm --unit mN", "5 mm --offset x"):
        radius, *others = re.split(" (?=--)", options)
        words = [word for each in others for word in each.split()]
        refused = CliRunner().invoke(app, ["jkr", "test.csv", "--radius", radius, *words])
        assert refused.exit_code == 2 and "expected" in refused.output
