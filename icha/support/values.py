"""Types of values in a configuration. A value with a unit, such as `25 MPa`, becomes a float in SI units."""

import math
import operator
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_args

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo, WithJsonSchema

from icha.support.rules import (
    CONTACT_MODULUS,
    FORCES,
    LENGTH,
    POSITIVE,
    PRESSURES,
    SEED,
    SURFACE_ENERGY,
    FloatRange,
    IntegerRange,
)
from icha.support.units import PHYSICAL_NAMES, conversion_factor

# A number as text. PyYAML reads `1.0e6` and `1e-3` as text, so text must be accepted as a number.
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*", re.DOTALL)

# Largest number of characters of a number with its unit, because patterns are slow for long texts.
_LONGEST = 100

PATTERN = rf"^\s*{_NUMBER}\s*[A-Za-zµμÅ%].*$"
# Names become names of folders and files. Commands would read a name that begins with a hyphen as an option.
NAME_PATTERN = r"^[a-z0-9_][a-z0-9_-]*$"
# Largest number of characters of a name, and of a name with varied values. A file name may have 255 characters.
_LONGEST_NAME, LONGEST_LABEL = 80, 200
# A quotient of two lengths, such as the number of cells per wave, may have this relative rounding error.
ROUNDING = 1e-9
# Largest number of names in a message.
_MOST_LISTED = 30
# A problem has three parts: its location (keys) in a configuration, the value, and the message.
Problem = tuple[tuple, Any, str]
# Placeholder for the value of a problem if the key is missing.
NOTHING = object()
Name = Annotated[str, Field(strict=True, pattern=NAME_PATTERN, max_length=_LONGEST_NAME)]
# A name, or the name of a variant from the key `vary` of a study.
Label = Annotated[str, Field(strict=True, pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.+-]*$", max_length=LONGEST_LABEL)]
_RANGE = re.compile(r"\s*(\d{1,10})\s*\.\.\s*(\d{1,10})\s*")
# Largest number of seeds.
_MOST_SEEDS = 10**5


def to_si(value, si_unit: str) -> float:
    """Convert text such as `25 MPa` to a float in `si_unit`; raise ValueError for other values."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise ValueError("the unit is missing")
    match = _QUANTITY.fullmatch(value) if isinstance(value, str) and len(value) <= _LONGEST else None
    _refuse_decimal_comma(value)
    if not match:
        raise ValueError("is not a number with a unit")
    magnitude, unit = match.groups()
    if not unit:
        raise ValueError("the unit is missing")
    try:
        return finite(Decimal(magnitude) * conversion_factor(unit, si_unit))
    except ArithmeticError:  # too large for a Decimal, such as 1e999999 MPa
        raise ValueError("is not finite") from None


def _refuse_decimal_comma(value) -> None:
    """Raise ValueError for a text with a comma in its number, such as `12,5 um`."""
    if isinstance(value, str) and re.match(r"\s*[+-]?\d*,\d", value[:_LONGEST]):
        example = value[:_LONGEST].replace(",", ".", 1)
        raise ValueError(f"has a decimal comma; expected a decimal point, as in {example!r}, and no other separators")


def to_number(value) -> float:
    """Convert a number, or text such as `1e-3`, to a finite float; raise ValueError for other values."""
    if isinstance(value, str):
        if len(value) > _LONGEST:
            raise ValueError("is not a number")
        _refuse_decimal_comma(value)
        if not re.fullmatch(rf"\s*{_NUMBER}\s*", value):
            what = "must be a number without a unit" if _QUANTITY.fullmatch(value) else "is not a number"
            raise ValueError(what)
        return finite(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("is not a number")
    return finite(value)


def finite(value) -> float:
    """Convert a number or its text to a float; raise ValueError if the result is not finite."""
    try:
        value = float(value)
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise ValueError("is not finite")
    return value


def quantity(rule: FloatRange, example: str):
    """Return the type of a value with a unit; the value becomes a float in the unit of `rule`."""
    unit = "" if rule.unit == "1" else f" {rule.unit}"
    bounds = f"in {rule.interval}{unit}" if rule.most is not None else "0 or greater"
    expected = f"{PHYSICAL_NAMES[rule.unit]} with its unit, {bounds}, such as {example!r}"
    schema = {"type": "string", "pattern": PATTERN, "examples": [example]}
    return _float(lambda value: to_si(value, rule.unit), rule, expected, schema, rule)


def number(rule: FloatRange):
    """Return the type of a number without a unit, within the bounds of `rule`."""
    bounds = {"exclusiveMinimum": rule.above, "minimum": rule.least, "maximum": rule.most}
    schema = {"type": "number"} | {key: bound for key, bound in bounds.items() if bound is not None}
    return _float(to_number, rule, rule.expected, schema, rule)


def _float(convert, rule, expected, schema, *metadata):
    """Return the type of a float; the arguments are those of `reader`."""
    return Annotated[float, BeforeValidator(reader(convert, rule, expected)), WithJsonSchema(schema), *metadata]


def reader(convert: Callable[[Any], float], rule: FloatRange, expected: str) -> Callable[[Any], float]:
    """Return a function that reads a value by `convert` and checks the bounds; its messages contain `expected`."""

    def read(value: Any) -> float:
        try:
            result = convert(value)
        except ValueError as error:
            raise ValueError(f"{error}; expected {expected}") from None
        if not rule.contains(result):
            raise ValueError(f"is out of range; expected {expected}")
        return result

    return read


def rule_of(field: Any) -> FloatRange | None:
    """Return the bounds and the unit of a field of a section; None for a field that is not a real number."""
    # The type of a key without a default, such as `Length`, or one of the types in `Length | None`.
    types = [field, *get_args(field.annotation)]
    rules = [rule for each in types for rule in getattr(each, "metadata", None) or getattr(each, "__metadata__", ())]
    return next((rule for rule in rules if isinstance(rule, FloatRange)), None)


def integer(rule: IntegerRange):
    """Return the type of an integer within the bounds of `rule`."""
    least, most = rule.least, rule.most

    def read(value: Any) -> int:
        if not rule.contains(value):
            raise ValueError(f"is not an integer from {least} to {most}; expected {least}, {least + 1}, … {most}")
        return value

    schema = {"type": "integer", "minimum": least, "maximum": most}
    return Annotated[int, BeforeValidator(read), WithJsonSchema(schema)]


def distinct(values):
    """Return a list; raise ValueError if an entry occurs twice."""
    seen = set()
    for value in values:
        if value in seen:
            raise ValueError(f"{value!r} is given twice; expected every entry once")
        seen.add(value)
    return values


def _ordered(follows, order: str, unit: str = ""):
    """Return a validator that refuses a list of numbers that is not in the given order."""

    def check(values):
        for before, after in pairwise(values):
            if not follows(after, before):
                raise ValueError(f"{after:g}{unit} comes after {before:g}{unit}; expected values in {order} order")
        return values

    return check


increasing = _ordered(operator.gt, "increasing")
decreasing = _ordered(operator.lt, "decreasing", " m")


def exactly_one(section):
    """Return a section; raise ValueError unless exactly one of its keys is given."""
    optional = [name for name, field in type(section).model_fields.items() if field.default is None]
    given = sorted(
        name for name in section.model_fields_set.intersection(optional) if getattr(section, name) is not None
    )
    if len(given) != 1:
        names = ", ".join(optional)
        raise ValueError(f"given: {', '.join(given) or 'none'}; expected exactly one of {names}")
    return section


def list_names(names: Iterable) -> str:
    """Join names for a message; a long list is cut, and the number of further names is added."""
    names = list(names)
    more = f", … ({len(names) - _MOST_LISTED} more)" if len(names) > _MOST_LISTED else ""
    return ", ".join(map(str, names[:_MOST_LISTED])) + more


def unknown(location: tuple, name: str, names: Iterable[str]) -> Iterator[Problem]:
    """Yield a problem if a name is not one of the defined `names`."""
    if name not in names:
        yield location, name, f"is not defined; expected {list_names(names) or 'no name, because none is defined'}"


def _without_controls(value: str) -> str:
    """Return a text; raise ValueError for control characters and surrogates, which YAML can contain as escapes."""
    for char in value:
        if unicodedata.category(char) in ("Cc", "Cs") and char not in "\n\t":
            raise ValueError(f"contains the control character {char!r}; expected text without control characters")
    return value


Text = Annotated[str, Field(strict=True, min_length=1), AfterValidator(_without_controls)]


class Folders(NamedTuple):
    """Context in which a configuration is validated.

    Attributes
    ----------
    of_paths : folder to which the paths in the configuration are relative.
    within : folder that must contain all files; None to allow any folder.
    """

    of_paths: Path
    within: Path | None = None


def _file(value: str, info: ValidationInfo) -> str:
    """Return the complete path of a file; raise ValueError if the path has braces or leads out of the allowed folder.

    Without the context `Folders`, the path remains as it is. Snakemake would read braces as patterns.
    """
    if re.search(r"[{}]", value):
        raise ValueError("contains braces; expected the path of a file without { and }")
    if (folders := info.context) is None:
        return value
    path = folders.of_paths / value
    if folders.within is not None and not path.resolve().is_relative_to(folders.within.resolve()):
        raise ValueError("is outside the folder of the configuration; expected files in this folder")
    return str(path)


File = Annotated[Text, AfterValidator(_file)]
Length = quantity(LENGTH, "100 um")
Force = quantity(FORCES, "1 mN")
Pressure = quantity(PRESSURES, "10 kPa")
Modulus = quantity(CONTACT_MODULUS, "25 MPa")
SurfaceEnergy = quantity(SURFACE_ENERGY, "50 mJ/m^2")
Positive = number(POSITIVE)
Seed = integer(SEED)


class OrSchema:
    """Annotation that adds an alternative to the JSON schema of a value.

    Attributes
    ----------
    alternative : JSON schema of the values that are valid instead, such as `{"const": "rigid"}`.
    """

    def __init__(self, alternative: dict):
        self.alternative = alternative

    def __get_pydantic_json_schema__(self, core_schema: Any, handler: Callable[[Any], dict]) -> dict:
        """Return the JSON schema: the value without null, or the alternative."""
        schema = handler(core_schema)
        given = [each for each in schema.get("anyOf", [schema]) if each != {"type": "null"}]
        return {"anyOf": [*given, self.alternative]}


def stops(kind, in_order):
    """Return the type of a list of at least one value of type `kind`; `in_order` checks the order of the values."""
    return Annotated[list[kind], Field(min_length=1), AfterValidator(in_order)]


# List of at least one name; each name may occur once.
Names = Annotated[list[Name], Field(min_length=1), AfterValidator(distinct)]


class Section(BaseModel):
    """Base class of the sections of a configuration: immutable, without unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


def _seeds(value: Any) -> Any:
    """Convert a range of seeds such as `1..50`, or a list of integers and ranges, to a list of integers."""
    expected = "expected integers from 0 or ranges, such as 1..50 or [1..5, 9]"
    found = []
    for entry in value if isinstance(value, list) else [value]:
        if not isinstance(entry, str):
            found.append(entry)
            continue
        shown = f"{entry!r} " if isinstance(value, list) else ""
        match = _RANGE.fullmatch(entry)
        if not match:
            raise ValueError(f"{shown}is not a range of seeds; {expected}")
        first, last = map(int, match.groups())
        if last < first:
            raise ValueError(f"{shown}must begin with the smaller seed; {expected}")
        if len(found) + last - first >= _MOST_SEEDS:
            raise ValueError(f"{shown}gives more than {_MOST_SEEDS} seeds; {expected}")
        found += range(first, last + 1)
    if type(value) is int:
        raise ValueError(
            f"is a number, but the seeds are a list; expected `1..{value}` for {value} seeds, or `[{value}]`"
        )
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
