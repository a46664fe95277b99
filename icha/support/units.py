"""Quantities as people write them, `25 MPa` or `50 mJ/m^2`, turned into floats in SI units."""

import math
import re
from decimal import Decimal
from functools import cache, lru_cache

# A number as people write it. PyYAML hands `1.0e6` and `1e-3` over as text, so text must be accepted.
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*", re.DOTALL)
_UNIT = re.compile(r"[A-Za-zµμÅ°%²³⁻·][\w\s*/^().µμÅ°%²³⁻·-]*")

# Letters of a number or a unit; patterns and pint take their time for texts that are neither.
_LONGEST = 100

# The quantities of a configuration, by the SI unit in which the model gets them.
PHYSICAL_NAMES = {"m": "length", "Pa": "pressure", "J/m^2": "energy per area", "1": "ratio"}

# What most configurations are written in, for pint takes longer to get ready than all else takes to read one. These are
# its own factors, which tests/support/test_units.py sees to.
USUAL = {
    ("m", "m"): "1",
    ("mm", "m"): "1e-3",
    ("um", "m"): "1e-6",
    ("µm", "m"): "1e-6",
    ("nm", "m"): "1e-9",
    ("Pa", "Pa"): "1",
    ("kPa", "Pa"): "1e3",
    ("MPa", "Pa"): "1e6",
    ("GPa", "Pa"): "1e9",
    ("J/m^2", "J/m^2"): "1",
    ("mJ/m^2", "J/m^2"): "1e-3",
}

PATTERN = rf"^\s*{_NUMBER}\s*[A-Za-zµμÅ].*$"


@cache
def _registry():
    # Decimals keep `100 um` exactly 1e-4 m, whatever way it is written.
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)


@lru_cache(maxsize=1024)
def conversion_factor(unit: str, si_unit: str) -> Decimal:
    """Exact factor from `unit` to `si_unit`.

    Raises
    ------
    ValueError
        If `unit` is no unit that pint knows, or one of another dimension.
    """
    if len(unit) > _LONGEST:
        raise ValueError(f"a text of {len(unit)} letters is not a unit")
    if unit == si_unit == "1":
        return Decimal(1)
    if (unit, si_unit) in USUAL:
        return Decimal(USUAL[unit, si_unit])
    return _by_pint(unit, si_unit)


def _by_pint(unit, si_unit):
    import pint

    registry = _registry()
    if not _UNIT.fullmatch(unit):
        raise ValueError(f"{unit!r} is not a unit")
    try:
        quantity = registry.Quantity(Decimal(1), registry.parse_units(unit))
        factor = quantity.to("" if si_unit == "1" else si_unit).magnitude
    except pint.UndefinedUnitError:
        raise ValueError(f"{unit!r} is not a known unit") from None
    except pint.DimensionalityError:
        raise ValueError(f"{unit!r} is not a unit of {PHYSICAL_NAMES[si_unit]}") from None
    except Exception:  # pint raises a dozen kinds of errors for text that is not a unit
        raise ValueError(f"{unit!r} is not a unit") from None
    if not 0 < float(factor) < math.inf:
        raise ValueError(f"{unit!r} is a unit too large or too small for a number")
    return factor


def to_si(value, si_unit: str) -> float:
    """Read a quantity with its unit, such as `25 MPa`, as a float in `si_unit`.

    Raises
    ------
    ValueError
        If the unit is missing, unknown or of another dimension, or the value is not a finite number.
    """
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise ValueError("is not a number with a unit")
    if not isinstance(value, str):
        raise ValueError("the unit is missing")
    match = _QUANTITY.fullmatch(value) if len(value) <= _LONGEST else None
    if not match:
        raise ValueError("is not a number with a unit")
    magnitude, unit = match.groups()
    if not unit:
        raise ValueError("the unit is missing")
    try:
        return finite(Decimal(magnitude) * conversion_factor(unit, si_unit))
    except ArithmeticError:  # beyond what a Decimal can hold, 1e999999 MPa
        raise ValueError("is not finite") from None


def to_number(value) -> float:
    """Read a plain number; text such as `1e-3`, which YAML does not take for a number, is one.

    Raises
    ------
    ValueError
        If it is not a finite number, or has a unit.
    """
    if isinstance(value, str):
        if len(value) > _LONGEST:
            raise ValueError("is not a number")
        if not re.fullmatch(rf"\s*{_NUMBER}\s*", value):
            what = "is a pure number and takes no unit" if _QUANTITY.fullmatch(value) else "is not a number"
            raise ValueError(what)
        return finite(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("is not a number")
    return finite(value)


def finite(value) -> float:
    """Return `value`, a number or the text of one, as a float; raise ValueError unless it is finite."""
    try:
        value = float(value)
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise ValueError("is not finite")
    return value
