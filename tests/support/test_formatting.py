"""Numbers and quantities with their units, and the rules that check them."""

from decimal import Decimal

import pint
import pytest
import yaml
from pydantic import TypeAdapter, ValidationError

from icha.path.targets import ASPERITY_RANGES
from icha.support import formatting, rules, values
from icha.support.units import conversion_factor
from icha.support.values import to_number, to_si

FORMATTED = {
    formatting.size: "0 B, 999 B, 1 kB, 70.2 kB, 1000 kB, 15.2 MB, 1.5 GB, 2 TB",
    formatting.duration: "0.04 s, 10 s, 59 s, 2 min, 5 min, 1.9 h, 2 h, 100 h, 5.2 days, 116 days",
    formatting.length: "0 m, 2.5 um, -1 nm, 100 mm, 0.003 pm, 20 m",
}
NUMBERS = {
    formatting.size: (0, 999, 1e3, 70_240, 999_700, 15_234_567, 1.5e9, 2e12),
    formatting.duration: (0.04, 9.96, 59, 119, 300, 7000, 7200, 99.7 * 3600, 450_000, 1e7),
    formatting.length: (0.0, 2.5e-6, -1e-9, 0.1, 3e-15, 20.0),
}


@pytest.mark.parametrize("write", FORMATTED)
def test_numbers_have_few_digits_and_a_unit_that_fits(write):
    assert ", ".join(map(write, NUMBERS[write])) == FORMATTED[write]


QUANTITIES = {
    "Pa": {"25MPa": 25e6, "1.0e6 Pa": 1e6},
    "J/m^2": dict.fromkeys(("50 mJ/m^2", "50 mN/m", "50 mJ/m²", "50 mJ·m⁻²", "50 mJ m^-2"), 0.05),
    "m": {"100 um": 1e-4, "100 µm": 1e-4, "0.1 mm": 1e-4, "2.071 nm": 2.071e-9}
    | dict.fromkeys(("3 Angstrom", "3 angstroms", "3 \u00c5", "3 \u212b"), 3e-10)
    | dict.fromkeys(("3 \u00b5m", "3 \u03bcm", "3 micrometers", "3 Microns"), 3e-6)
    | {"3 nanometre": 3e-9, "3 pm": 3e-12, "3 in": 0.0762, "3 inches": 0.0762, "3 mil": 7.62e-5, "3 thou": 7.62e-5},
}


@pytest.mark.parametrize("si_unit", QUANTITIES)
def test_quantities_are_exact_si_values(si_unit):
    assert {text: to_si(text, si_unit) for text in QUANTITIES[si_unit]} == QUANTITIES[si_unit]


def test_numbers_that_yaml_reads_as_text_are_numbers():
    assert yaml.safe_load("1e-3") == "1e-3"
    assert [*map(to_number, ("1e-3", "1.0e6", 3))] == [1e-3, 1e6, 3.0]


OF_PINT = {
    "Pa": ("MPa", "TPa", "N/mm**2", "kgf/cm^2", "kg*m^-1*s^-2", "psi", "mbar", "atm", "kilopascal"),
    "J/m^2": ("mJ/m^2", "erg/cm^2", "mN/m", "dyn/cm", "J m^-2"),
    "N": ("uN", "lbf", "mdyn", "newtons"),
    "s": ("min", "h", "days", "ms"),
    "rad": ("deg", "mrad"),
}


def test_units_have_the_factors_of_pint():
    registry = pint.UnitRegistry(non_int_type=Decimal)
    for si_unit, unit in ((each, unit) for each, units in OF_PINT.items() for unit in units):
        expected = registry.Quantity(Decimal(1), unit).to(si_unit).magnitude
        assert float(conversion_factor(unit, si_unit)) == pytest.approx(float(expected), rel=1e-14), unit


SLIPS = {"2 Mpa": "Pa", "50 J/m2": "J/m^2", "3 UM": "m", "3 Nm": "m", "3 px": "m", "3 Mm": "m", "3 m^2": "m"}


@pytest.mark.parametrize(("text", "si_unit"), SLIPS.items())
def test_slips_of_case_and_powers_are_refused(text, si_unit):
    with pytest.raises(ValueError, match="is not a"):
        to_si(text, si_unit)


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
