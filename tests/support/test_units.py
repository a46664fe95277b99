"""Quantities with their units."""

from decimal import Decimal

import pint
import pytest
import yaml

from icha.support.units import conversion_factor
from icha.support.values import to_number, to_si


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


OF_PINT = {
    "Pa": ("MPa", "TPa", "N/mm**2", "kgf/cm^2", "kg*m^-1*s^-2", "psi", "mbar", "atm", "kilopascal"),
    "J/m^2": ("mJ/m^2", "erg/cm^2", "mN/m", "dyn/cm", "J m^-2"),
    "N": ("uN", "lbf", "mdyn", "newtons"),
    "s": ("min", "h", "days", "ms"),
    "rad": ("deg", "mrad"),
}


@pytest.mark.parametrize(("si_unit", "unit"), [(each, unit) for each, units in OF_PINT.items() for unit in units])
def test_units_have_the_factors_of_pint(si_unit, unit):
    expected = pint.UnitRegistry(non_int_type=Decimal).Quantity(Decimal(1), unit).to(si_unit).magnitude
    assert float(conversion_factor(unit, si_unit)) == pytest.approx(float(expected), rel=1e-14)


def test_signs_of_products_and_powers():
    assert {conversion_factor(unit, "J/m^2") for unit in ("mJ/m²", "mJ·m⁻²", "mN/m", "mJ m^-2")} == {Decimal("1e-3")}


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


SLIPS = {"2 Mpa": "Pa", "50 J/m2": "J/m^2", "3 UM": "m", "3 Nm": "m", "3 px": "m", "3 Mm": "m", "3 m^2": "m"}


@pytest.mark.parametrize(("text", "si_unit"), SLIPS.items())
def test_slips_of_case_and_powers_are_refused(text, si_unit):
    with pytest.raises(ValueError, match="is not a"):
        to_si(text, si_unit)
