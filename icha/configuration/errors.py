"""Error messages of a configuration: file, key, value, what is wrong with it and what is expected."""

import difflib
from collections.abc import Mapping
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel

from icha.configuration.campaign import Campaign
from icha.configuration.surfaces import SURFACE_KINDS
from icha.support.formatting import printable
from icha.support.values import NAME_PATTERN, NOTHING, Problem

# Largest number of problems in one message.
MOST_PROBLEMS = 50
# Reasons against keys of older versions, by the model of their section.
_FORMER_KEYS = {
    ("Campaign", "boundary_elements"): "is now `finite_range`; expected the same section by that name (`models: "
    "[boundary_elements]` of a study keeps its name)",
    ("Study", "united_until"): "is no longer a choice: united spots split where their two parts would not overlap "
    "(keeping them until detachment was farther from boundary elements in 8 of 9 losses). Remove the key",
    ("Campaign", "error_sources"): "is no longer a section. Use `make error-sources` in a clone",
    ("Campaign", "one_asperity"): "is no longer a section. Use `python -m validation.one_asperity` in a clone",
    ("Figures", "fig12_error_sources"): "is no longer a figure of campaigns. Use `make error-sources` in a clone",
}
# Reasons by the type of pydantic's error.
_EMPTY = "is empty; expected at least one entry"
_TOO_LONG = "is too long; expected at most {max_length} {unit}"
_NO_SECTION = "is not a section; expected a mapping of keys to values"
_REASONS = {
    "too_short": _EMPTY,
    "string_too_short": _EMPTY,
    "too_long": _TOO_LONG,
    "string_too_long": _TOO_LONG,
    "model_type": _NO_SECTION,
    "model_attributes_type": _NO_SECTION,
    "literal_error": "is not a choice; expected {expected}",
    "list_type": "is not a list; expected a list, such as [a, b]",
    "bool_type": "is neither true nor false; expected true or false",
    "dict_type": "is not a mapping; expected names with their sections",
    "string_type": "is not text; expected text (in quotes if it looks like a number)",
}


class ConfigurationError(ValueError):
    """A configuration that cannot be run; the message has a line for each problem."""


def format_problem(origin: str, location: tuple, value: Any, reason: str) -> str:
    """Format a problem as a line that is safe to print, since a stranger may have written the file."""
    keys = [f"[{entry}]" if isinstance(entry, int) else f".{_cut(str(entry), 80)}" for entry in location]
    key = "".join(keys).lstrip(".") or "top level"
    shown = "" if value is NOTHING else " (empty)" if value is None else f" {_cut(repr(value), 80)}"
    return printable(f"{origin}: {key}:{shown} {_cut(reason, 2000)}")


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 3]}..."


def problem_of(details: Mapping) -> Problem:
    """Translate an error of pydantic into location, value and reason."""
    location, value, kind = _without_tags(details["loc"]), details["input"], details["type"]
    context = details.get("ctx", {})
    if kind == "value_error":
        # The error of a whole section names its keys itself.
        return location, NOTHING if isinstance(value, Mapping | BaseModel) else value, str(context["error"])
    if kind in ("extra_forbidden", "missing"):
        return location, NOTHING, _reason_for_key(kind, details["loc"])
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        given = value.get("kind", NOTHING) if isinstance(value, Mapping) else value
        return (*location, "kind"), given, f"is not a kind of surface; expected one of {', '.join(SURFACE_KINDS)}"
    if kind == "string_pattern_mismatch" and context.get("pattern") == NAME_PATTERN:
        return location, value, "is not a name; expected lower-case letters, digits, '_' and, but not first, '-'"
    if kind not in _REASONS:
        return location, value, details["msg"].lower()
    return location, value, _REASONS[kind].format(unit="characters" if isinstance(value, str) else "entries", **context)


def _reason_for_key(kind: str, location: tuple) -> str:
    """Return the reason against a key that is unknown or missing in a section."""
    section, name = _section_at(location[:-1]), location[-1]
    if kind == "missing":
        return f"the key is missing; expected: {' '.join(str(section.model_fields[name].description).split())}"
    if reason := _FORMER_KEYS.get((section.__name__, name)):
        return reason
    similar = difflib.get_close_matches(str(name), section.model_fields, 1)
    hint = f" (did you mean {similar[0]!r}?)" if similar else ""
    return f"unknown key{hint}; expected one of {', '.join(sorted(section.model_fields))}"


def _without_tags(location: tuple) -> tuple:
    """Remove what pydantic adds to a location: the kind of a surface, and the mark of a key."""
    if len(location) > 2 and location[0] == "surfaces" and location[2] in SURFACE_KINDS:
        location = (*location[:2], *location[3:])
    return location[:-1] if location[-1:] == ("[key]",) else location


def _section_at(location: tuple) -> type[BaseModel]:
    """Return the model of the section at a location of pydantic, which contains the kind of a surface."""
    model: Any = Campaign
    for key in location:
        if model in SURFACE_KINDS.values() and key in SURFACE_KINDS:
            model = SURFACE_KINDS[key]
            continue
        model = get_args(model)[-1] if get_origin(model) in (dict, list) else model.model_fields[key].annotation
        while get_origin(model) in (Annotated, Union, UnionType):
            model = get_args(model)[0]
    return model
