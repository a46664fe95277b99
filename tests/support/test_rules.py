"""Rules for values: the same for arguments and for configurations, each in its own words."""

import pytest
from pydantic import TypeAdapter, ValidationError

from icha.path.targets import QUANTITIES
from icha.support import rules, values

OUTSIDE = [
    (rules.POSITIVE, 0.0, "must be greater than 0", "a number greater than 0"),
    (rules.HURST, 1.5, "must lie in (0, 1]", "a number in (0, 1]"),
    (rules.TOLERANCE, 1e-3, "must lie in [1e-12, 1e-4]", "a number in [1e-12, 1e-4]"),
    (rules.NUMBER, float("inf"), "is not finite", "a number"),
    (
        QUANTITIES["area_fraction"].rule,
        0.3,
        "lies beyond the range of the asperity model",
        "a number in [1e-9, 0.25], where the asperity model holds",
    ),
    (
        QUANTITIES["reduced_pressure"].rule,
        0.0,
        "must lie in [1e-12, 0.15]",
        "a number in [1e-12, 0.15], where the asperity model holds",
    ),
    (rules.LENGTH, 1e100, "must lie in [1e-24, 1e9] (in m)", "a number in [1e-24, 1e9]"),
    (rules.POSITIVE, True, "is not a number", "a number greater than 0"),
]


@pytest.mark.parametrize(("rule", "value", "of_an_argument", "of_a_key"), OUTSIDE)
def test_what_a_rule_refuses_is_refused_in_both_places(rule, value, of_an_argument, of_a_key):
    with pytest.raises(ValueError) as argument:
        rule.checked("it", value)
    assert str(argument.value).startswith(f"it: {value!r} {of_an_argument}")
    with pytest.raises(ValidationError) as key:
        TypeAdapter(values.number(rule)).validate_python(value)
    assert f"; allowed: {of_a_key} " in f"{key.value} "


@pytest.mark.parametrize(("value", "reason"), [(7, "at least 8"), (40000, "at most 32768"), (8.0, "is not an integer")])
def test_integers_are_refused_in_both_places(value, reason):
    with pytest.raises(ValueError, match=f"grid: .*{reason}"):
        rules.GRID.checked("grid", value)
    with pytest.raises(ValidationError, match="is not an integer from 8 to 32768"):
        TypeAdapter(values.integer(rules.GRID)).validate_python(value)


@pytest.mark.parametrize("digits", [400, 5000])
def test_numbers_that_no_float_holds_are_refused_by_name(digits):
    """Of more than 4300 digits Python writes none."""
    for value in (10**digits, -(10**digits)):
        with pytest.raises(ValueError, match=r"^it: a number beyond 1e308 is not finite \(in m\)$"):
            rules.LENGTH.checked("it", value)
        with pytest.raises(ValueError, match=r"^it: a number of more than 30 digits must be at (least 8|most 32768)$"):
            rules.GRID.checked("it", value)


def test_what_a_rule_allows_is_returned():
    assert rules.HURST.checked("hurst", 1) == 1.0
    assert rules.GRID.checked("grid", 8) == 8
    assert TypeAdapter(values.quantity(rules.SURFACE_ENERGY, "50 mJ/m^2")).validate_python("0 J/m^2") == 0
