"""Quantities as people write them, `25 MPa` or `50 mJ/m^2`, turned into floats in SI units."""

import math
import re
import unicodedata
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

# Lengths that people use for scans; pint knows others as well (px, pt, au, hand), which no file means by them.
_PREFIXES = {"deci": "1e-1", "centi": "1e-2", "milli": "1e-3", "micro": "1e-6", "nano": "1e-9", "pico": "1e-12"}
_SYMBOLS = {"km": "1e3", "m": "1", "dm": "1e-1", "cm": "1e-2", "mm": "1e-3", "um": "1e-6", "\u03bcm": "1e-6"}
_SYMBOLS |= {"nm": "1e-9", "pm": "1e-12", "\u00c5": "1e-10", "in": "0.0254", "mil": "2.54e-5", "thou": "2.54e-5"}
_LONG_NAMES = {"micron": "1e-6", "angstrom": "1e-10", "\u00e5ngstr\u00f6m": "1e-10", "inch": "0.0254", "mil": "2.54e-5"}
_LONG_NAMES |= {
    f"{prefix}{metre}": factor
    for prefix, factor in {"": "1", "kilo": "1e3", **_PREFIXES}.items()
    for metre in ("meter", "metre")
}
_LONG_NAMES |= {f"{name}s": factor for name, factor in _LONG_NAMES.items()} | {"inches": "0.0254"}

# Units that are suggested for a slip of case or a missing ^.
_SUGGESTED = {
    "Pa": ("Pa", "hPa", "kPa", "MPa", "GPa", "N/m^2", "kN/m^2", "MN/m^2", "N/mm^2"),
    "J/m^2": ("J/m^2", "mJ/m^2", "uJ/m^2", "N/m", "mN/m", "uN/m"),
    "m": ("m", "dm", "cm", "mm", "um", "nm", "pm", "in", "mil"),
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
        If `unit` is unknown or of another dimension; of a length, if it is none in which scans are measured.
    """
    if len(unit) > _LONGEST:
        raise ValueError(f"a text of {len(unit)} letters is not a unit")
    if unit == si_unit == "1":
        return Decimal(1)
    if (unit, si_unit) in USUAL:
        return Decimal(USUAL[unit, si_unit])
    try:
        return _length(unit) if si_unit == "m" else _by_pint(unit, si_unit)
    except ValueError as error:
        near = [known for known in _SUGGESTED.get(si_unit, ()) if _letters(known) == _letters(unit)]
        raise ValueError(f"{error} (did you mean {near[0]!r}?)" if near else str(error)) from None


def _letters(unit):
    """A unit without what slips: its case, blanks, and the signs of a power."""
    return re.sub(r"[\s^*]", "", unicodedata.normalize("NFKC", unit)).replace("\u03bc", "u").lower()


def _length(unit):
    """Exact factor from a unit of length to metres; both signs for micro and both for angstrom are known."""
    name = unicodedata.normalize("NFKC", unit.strip())
    factor = _SYMBOLS.get(name) or _LONG_NAMES.get(name.lower())
    if factor is None:
        raise ValueError(f"{unit!r} is not a unit of length")
    return Decimal(factor)


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
