"""Values that only configurations hold: slopes that may be left as measured, and values to vary."""

from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema

from icha.support.rules import SLOPE
from icha.support.values import distinct, to_number

# The slope of a topography as it was measured.
MEASURED = "measured"


def _slope(value: Any) -> float | str:
    try:
        slope = to_number(value)
    except ValueError as error:
        if value == MEASURED:
            return value
        raise ValueError(f"{error}; allowed: {SLOPE.allowed}, or {MEASURED}") from None
    if not SLOPE.holds(slope):
        raise ValueError(f"is out of range; allowed: {SLOPE.allowed}, or {MEASURED}")
    return slope


_ONE_SLOPE = {"anyOf": [{"type": "number", "minimum": SLOPE.least, "maximum": SLOPE.most}, {"const": MEASURED}]}
Slope = Annotated[Any, BeforeValidator(_slope), WithJsonSchema(_ONE_SLOPE)]
Slopes = Annotated[
    list[Slope],
    BeforeValidator(lambda value: [value] if value == MEASURED else value),
    Field(min_length=1),
    AfterValidator(distinct),
    WithJsonSchema({"anyOf": [{"const": MEASURED}, {"type": "array", "minItems": 1, "items": _ONE_SLOPE}]}),
]
SCALAR_SCHEMA = {"type": ["string", "number", "boolean"]}


def scalar(value: Any) -> Any:
    """Refuse what is no single value."""
    if not isinstance(value, str | int | float):
        raise ValueError("is no single value; allowed: a number, a text, true or false")
    return value


Values = Annotated[
    list[Annotated[Any, AfterValidator(scalar)]],
    BeforeValidator(lambda value: value if isinstance(value, list) else [value]),
    Field(min_length=1),
    AfterValidator(distinct),
    WithJsonSchema({"anyOf": [SCALAR_SCHEMA, {"type": "array", "minItems": 1, "items": SCALAR_SCHEMA}]}),
]
