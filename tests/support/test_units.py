"""Quantities with their units."""

from decimal import Decimal

import pint
import pytest
import yaml

from icha.support.values import USUAL, to_number, to_si


def test_quantities_are_exact_si_values():
    assert to_si("100 um", "m") == 1e-4
    assert to_si("100 µm", "m") == 1e-4
    assert to_si("0.1 mm", "m") == 1e-4
    assert to_si("25MPa", "Pa") == 25e6
    assert to_si("1.0e6 Pa", "Pa") == 1e6
    assert to_si("50 mJ/m^2", "J/m^2") == to_si("50 mN/m", "J/m^2") == 0.05
    assert to_si("2.071 nm", "m") == 2.071e-9


def test_numbers_that_yaml_reads_as_text_are_numbers():
    assert yaml.safe_load("1e-3") == "1e-3"
    assert to_number("1e-3") == 1e-3
    assert to_number("1.0e6") == 1e6
    assert to_number(3) == 3.0


def test_factors_that_are_known_without_pint_are_those_of_pint():
    registry = pint.UnitRegistry(non_int_type=Decimal)
    for (unit, si_unit), factor in USUAL.items():
        assert registry.Quantity(Decimal(1), unit).to(si_unit).magnitude == Decimal(factor)


LENGTHS = {
    "Angstrom angstroms \u00c5 \u212b": "1e-10",
    "\u00b5m \u03bcm micrometers Microns": "1e-6",
    "nanometre": "1e-9",
    "pm": "1e-12",
    "in inches": "0.0254",
    "mil thou": "2.54e-5",
}


@pytest.mark.parametrize(("units", "metres"), LENGTHS.items())
def test_lengths_of_scans(units, metres):
    for unit in units.split():
        assert to_si(f"3 {unit}", "m") == float(3 * Decimal(metres))


@pytest.mark.parametrize(("text", "si_unit"), [("2 Mpa", "Pa"), ("50 J/m2", "J/m^2"), ("3 UM", "m"), ("3 Nm", "m")])
def test_slips_of_case_and_powers_are_refused(text, si_unit):
    with pytest.raises(ValueError, match="is not a"):
        to_si(text, si_unit)
