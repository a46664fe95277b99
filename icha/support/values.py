"""Values of a configuration: quantities such as `25 MPa`, kept as floats in SI units, and types that refuse others."""

import math
import re
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from decimal import Decimal
from functools import cache, lru_cache
from itertools import pairwise
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema

from icha.support.rules import CONTACT_MODULUS, LENGTH, POSITIVE, SEED, SURFACE_ENERGY, Integer, Real

# A number as people write it. PyYAML hands `1.0e6` and `1e-3` over as text, so text must be accepted.
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*", re.DOTALL)
_UNIT = re.compile(r"[A-Za-zµμÅ°%²³⁻·][\w\s*/^().µμÅ°%²³⁻·-]*")

# Letters of a number or a unit; patterns and pint take their time for texts that are neither.
_LONGEST = 100

# The quantities of a configuration, by the SI unit in which the model gets them.
PHYSICAL_NAMES = {"m": "length", "Pa": "pressure", "J/m^2": "energy per area", "1": "ratio"}

# What most configurations are written in, besides lengths: pint takes longer to get ready than all else takes to read
# one. These are its own factors, which tests/support/test_units.py sees to.
USUAL = {
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
# Names are those of folders and files, too, which commands would take for options if they began with a hyphen.
NAME_PATTERN = r"^[a-z0-9_][a-z0-9_-]*$"
# Letters of a name, and of one with the values that a study varies: a file's name with its ending has up to 255.
_LONGEST_NAME, LONGEST_LABEL = 80, 200
# Rounding of the quotient of two lengths must not decide whether a wave has its cells.
ROUNDING = 1e-9
# Names that messages list at most.
_MOST_LISTED = 30
# Location in a configuration, value, and what is wrong with it and allowed.
Problem = tuple[tuple, Any, str]
# In the place of a value that is not there, in problems.
NOTHING = object()
Name = Annotated[str, Field(strict=True, pattern=NAME_PATTERN, max_length=_LONGEST_NAME)]
# A name, or that of a variant made by a study's `vary`.
Label = Annotated[str, Field(strict=True, pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.+-]*$", max_length=LONGEST_LABEL)]
_RANGE = re.compile(r"\s*(\d{1,10})\s*\.\.\s*(\d{1,10})\s*")
# More are a slip of the pen.
_MOST_SEEDS = 10**5


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


def quantity(rule: Real, example: str):
    """Type of a value that is written with its unit and kept as a float in that of `rule`."""
    bounds = f"in {rule.interval} {rule.unit}" if rule.most is not None else "0 or greater"
    allowed = f"{PHYSICAL_NAMES[rule.unit]} with its unit, {bounds}, such as {example!r}"
    schema = {"type": "string", "pattern": PATTERN, "examples": [example]}
    return _float(lambda value: to_si(value, rule.unit), rule, allowed, schema, Unit(rule.unit))


@dataclass(frozen=True)
class Unit:
    """Unit in which a quantity is kept, to be found in the metadata of its type."""

    si: str


def number(rule: Real):
    """Type of a pure number; `1e-3`, which YAML takes for text, is one."""
    bounds = {"exclusiveMinimum": rule.above, "minimum": rule.least, "maximum": rule.most}
    schema = {"type": "number"} | {key: bound for key, bound in bounds.items() if bound is not None}
    return _float(to_number, rule, rule.allowed, schema)


def _float(convert, rule, allowed, schema, *metadata):
    """Type of a float that `convert` reads and that keeps to a rule; refused with what is allowed."""

    def read(value: Any) -> float:
        try:
            result = convert(value)
        except ValueError as error:
            raise ValueError(f"{error}; allowed: {allowed}") from None
        if not rule.holds(result):
            raise ValueError(f"is out of range; allowed: {allowed}")
        return result

    return Annotated[float, BeforeValidator(read), WithJsonSchema(schema), *metadata]


def integer(rule: Integer):
    """Type of an integer."""
    least, most = rule.least, rule.most

    def read(value: Any) -> int:
        if not rule.holds(value):
            raise ValueError(f"is not an integer from {least} to {most}; allowed: {least}, {least + 1}, … {most}")
        return value

    schema = {"type": "integer", "minimum": least, "maximum": most}
    return Annotated[int, BeforeValidator(read), WithJsonSchema(schema)]


def flag(value: Any) -> bool:
    """True or false, and not one of the many words that YAML and Python take for them."""
    if not isinstance(value, bool):
        raise ValueError("is neither true nor false; allowed: true, false")
    return value


def distinct(values):
    """Refuse a list in which an entry stands twice."""
    seen = set()
    for value in values:
        if value in seen:
            raise ValueError(f"{value!r} is given twice; allowed: every entry once")
        seen.add(value)
    return values


def increasing(values):
    """Refuse a list of numbers that does not increase."""
    for before, after in pairwise(values):
        if not after > before:
            raise ValueError(f"{after:g} comes after {before:g}; allowed: values in increasing order")
    return values


def decreasing(values):
    """Refuse a list of lengths that does not decrease."""
    for before, after in pairwise(values):
        if not after < before:
            raise ValueError(f"{after:g} m comes after {before:g} m; allowed: values in decreasing order")
    return values


def exactly_one(section):
    """Refuse a section with no key given, or more than one."""
    given = sorted(name for name in section.model_fields_set if getattr(section, name) is not None)
    if len(given) != 1:
        names = ", ".join(type(section).model_fields)
        raise ValueError(f"{' and '.join(given) or 'nothing'} is given; allowed: exactly one of {names}")
    return section


def listed(names: Iterable) -> str:
    """Names as a message lists them: `a, b, c`, or the first ones and how many more there are."""
    names = list(names)
    more = f", … ({len(names) - _MOST_LISTED} more)" if len(names) > _MOST_LISTED else ""
    return ", ".join(map(str, names[:_MOST_LISTED])) + more


def unknown(location: tuple, name: str, names: Iterable[str]) -> Iterator[Problem]:
    """The problem of a name that is none of some section's, if it is one."""
    if name not in names:
        yield location, name, f"is not defined; allowed: {listed(names) or 'none, for there is none'}"


def _without_controls(value: str) -> str:
    """Refuse what a YAML file cannot hold but as an escape: characters that act on a terminal, halves of characters."""
    for char in value:
        if unicodedata.category(char) in ("Cc", "Cs") and char not in "\n\t":
            raise ValueError(f"holds the control character {char!r}; allowed: text")
    return value


Text = Annotated[str, Field(strict=True, min_length=1), AfterValidator(_without_controls)]


def _file(value: str) -> str:
    """Refuse paths that workflows take for patterns."""
    if re.search(r"[{}]", value):
        raise ValueError("has braces; allowed: the path of a file without { and } in it")
    return value


# The path of a file.
File = Annotated[Text, AfterValidator(_file)]
Length = quantity(LENGTH, "100 um")
Modulus = quantity(CONTACT_MODULUS, "25 MPa")
SurfaceEnergy = quantity(SURFACE_ENERGY, "50 mJ/m^2")
Positive = number(POSITIVE)
Seed = integer(SEED)
Flag = Annotated[bool, BeforeValidator(flag)]


def stops(kind, in_order):
    """Type of a list of values, at least one, that `in_order` does not refuse."""
    return Annotated[list[kind], Field(min_length=1), AfterValidator(in_order)]


def list_of_names(description, kind=Name):
    """Type of a list of names, at least one and each once."""
    return Annotated[list[kind], Field(min_length=1, description=description), AfterValidator(distinct)]


class Section(BaseModel):
    """A part of the configuration: immutable, and without room for keys that nobody reads."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def _seeds(value: Any) -> Any:
    """Seeds with their ranges written out: `1..50`, or a list of integers and such ranges."""
    allowed = "allowed: integers from 0 and ranges of them, such as 1..50 or [1..5, 9]"
    if isinstance(value, list) and not value:
        return value
    found = []
    for entry in value if isinstance(value, list) else [value]:
        if not isinstance(entry, str):
            found.append(entry)
            continue
        shown = f"{entry!r} " if isinstance(value, list) else ""
        match = _RANGE.fullmatch(entry)
        if not match:
            raise ValueError(f"{shown}is no range of seeds; {allowed}")
        first, last = map(int, match.groups())
        if last < first or last - first >= _MOST_SEEDS:
            raise ValueError(f"{shown}ends before it begins, or has more than {_MOST_SEEDS} seeds; {allowed}")
        found += range(first, last + 1)
        if len(found) > _MOST_SEEDS:
            raise ValueError(f"{shown}makes more than {_MOST_SEEDS} seeds; {allowed}")
    return found if isinstance(value, list | str) else value


Seeds = Annotated[
    list[Seed],
    Field(min_length=1),
    BeforeValidator(_seeds),
    AfterValidator(distinct),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string", "pattern": r"^\s*\d+\s*\.\.\s*\d+\s*$", "examples": ["1..50"]},
                {"type": "array", "minItems": 1, "items": {"type": ["integer", "string"]}},
            ]
        }
    ),
]
