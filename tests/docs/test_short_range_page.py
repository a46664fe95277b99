"""The page on the limit of short range says what was measured; nothing is measured here."""

import math

import pytest
from pages import short_range
from write_pages import DOCS, write_short_range


def rows(*errors, cells=10.0, **more):
    return [{"cells": cells, "area_error": error} | more for error in errors]


def test_errors_stand_in_classes_of_the_contact_radius():
    table = short_range.by_radius([*rows(0.01, 0.03), *rows(-0.2, cells=30.0)], {"area_error": "area"})
    assert table.rows == [["8 to 12", "2", "+2.00 (+1.00 to +3.00)"], ["over 20", "1", "-20.00 (-20.00 to -20.00)"]]


def test_largest_error_is_without_its_sign():
    assert short_range.largest(rows(0.01, -0.03), "area_error") == 0.03
    assert math.isnan(short_range.largest([], "area_error"))


def test_order_of_convergence():
    own = [*rows(0.04, grid=10), *rows(-0.01, grid=20)]
    assert short_range.order(own, "area_error") == "2.0 (4.00 % at 10², 1.00 % at 20²)"


def test_trapping_is_the_difference_between_the_ways():
    out_and_in = [
        {"grid": 8, "offset": [0, 0], "approach": approach, "area_error": error}
        for approach, error in ((1, 0.01), (1, 0.013), (2, 0.5))
    ]
    assert short_range.hysteresis(out_and_in) == pytest.approx(0.003)


def test_straight_line_to_zero_range():
    finite = [{"range": 2.0, "pressure": 5.0}, {"range": 1.0, "pressure": 4.0}]
    assert short_range._extrapolated(finite, ["pressure"]) == [3.0]


def test_bound_that_is_missed_says_so():
    assert not short_range.Bound("area", 0.02, 0.01).met
    assert short_range.Bound("area", 0.01, 0.01).met


def test_page_is_that_of_the_numbers_that_are_kept(tmp_path):
    before = (DOCS / "short_range.md").read_text(encoding="utf-8")
    write_short_range(page=tmp_path / "short_range.md")
    assert (tmp_path / "short_range.md").read_text(encoding="utf-8") == before
