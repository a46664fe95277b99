"""Arguments and configuration keys are checked by the same rules."""

import pytest
from pydantic import TypeAdapter, ValidationError

from icha.path.targets import ASPERITY_RANGES
from icha.support import rules, values

OUTSIDE = [
    (rules.POSITIVE, 0.0, "a number greater than 0"),
    (rules.HURST, 1.5, "a number in (0, 1]"),
    (ASPERITY_RANGES["area_fraction"], 0.3, "a number in [1e-9, 0.25], where the asperity model holds"),
    (ASPERITY_RANGES["reduced_pressure"], 0.2, "a number of at most 0.15, where the asperity model holds"),
    (rules.LENGTH, 1e100, "a number in [1e-24, 1e9]"),
    (rules.NUMBER, float("inf"), "a number"),
    (rules.POSITIVE, True, "a number greater than 0"),
]


@pytest.mark.parametrize(("rule", "value", "expected"), OUTSIDE)
def test_arguments_and_keys_are_refused_by_the_same_rule(rule, value, expected):
    with pytest.raises(ValueError, match=rf"^it: {value!r} .*".replace("+", r"\+")) as argument:
        rule.validate("it", value)
    if value < float("inf") and value is not True:
        assert f" must be {expected}" in str(argument.value)
    with pytest.raises(ValidationError) as key:
        TypeAdapter(values.number(rule)).validate_python(value)
    assert f"; expected {expected} " in f"{key.value} "


@pytest.mark.parametrize(("value", "reason"), [(7, "at least 8"), (40000, "at most 32768"), (8.0, "is not an integer")])
def test_integers_are_refused_in_both_places(value, reason):
    with pytest.raises(ValueError, match=f"grid: .*{reason}"):
        rules.GRID.validate("grid", value)
    with pytest.raises(ValidationError, match="is not an integer from 8 to 32768"):
        TypeAdapter(values.integer(rules.GRID)).validate_python(value)


def test_integers_that_no_float_holds_are_refused_by_name():
    with pytest.raises(ValueError, match=r"^it: 10+ is not finite \(in m\)$"):
        rules.LENGTH.validate("it", 10**400)


def test_what_a_rule_allows_is_returned():
    assert rules.HURST.validate("hurst", 1) == 1.0
    assert rules.GRID.validate("grid", 8) == 8
    assert TypeAdapter(values.quantity(rules.SURFACE_ENERGY, "50 mJ/m^2")).validate_python("0 J/m^2") == 0
