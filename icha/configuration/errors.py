"""Errors of a configuration in words: file, key, value, what is wrong with it and what is allowed."""

import difflib
from collections.abc import Mapping
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel

from icha.configuration.campaign import Campaign
from icha.configuration.surfaces import SURFACE_KINDS
from icha.support.formatting import printable
from icha.support.values import NAME_PATTERN, NOTHING, Problem

# Of what is wrong with a configuration so much is told at once.
MOST_TOLD = 50
# Keys of older versions, by the model of their section: why each is refused, and what is allowed in its place.
_FORMER_KEYS = {
    ("Campaign", "boundary_elements"): "is now `finite_range`; allowed: the same section by that name (`models: "
    "[boundary_elements]` of a study keeps its name)",
    ("Study", "united_until"): "is no longer a choice: united spots split where their two parts would not overlap "
    "(keeping them until detachment was farther from boundary elements in 8 of 9 losses); allowed: leave the key out",
    ("Campaign", "error_sources"): "is no longer a section; allowed: `make error-sources` in a clone",
    ("Campaign", "one_asperity"): "is no longer a section; allowed: `python -m validation.one_asperity` in a clone",
    ("Figures", "fig12_error_sources"): "is no longer a figure of campaigns; allowed: `make error-sources` in a clone",
}
# By the kind of pydantic's error.
_REASONS = dict.fromkeys(("too_short", "string_too_short"), "is empty; allowed: at least one entry")
_REASONS |= dict.fromkeys(("too_long", "string_too_long"), "is too long; allowed: at most {max_length} {what}")
_REASONS |= dict.fromkeys(
    ("model_type", "model_attributes_type"), "is not a section; allowed: a mapping of keys to values"
)
_REASONS |= {
    "literal_error": "is not a choice; allowed: {expected}",
    "list_type": "is not a list; allowed: a list, such as [a, b]",
    "dict_type": "is not a mapping; allowed: names with their sections",
    "string_type": "is not text; allowed: text (in quotes if it looks like a number)",
}


class ConfigurationError(ValueError):
    """A configuration that cannot be run; the message lists file, key, value and what is allowed, line by line."""


def line(origin: str, location: tuple, value: Any, reason: str) -> str:
    """A problem as a line for the author of the file, or for whoever has got it from a stranger."""
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{_cut(str(part), 80)}" for part in location).lstrip(".")
    shown = "" if value is NOTHING else " (empty)" if value is None else f" {_cut(repr(value), 80)}"
    return printable(f"{origin}: {key or 'top level'}:{shown} {_cut(reason, 2000)}")


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 3]}..."


def problem_of(details: Mapping, content: Mapping) -> Problem:
    """One error of pydantic as (location, value, reason and what is allowed), in this project's words."""
    location = _without_tags(details["loc"])
    value, kind, context = details["input"], details["type"], dict(details.get("ctx", {}))
    if location[-1:] == ("[key]",):
        location = location[:-1]
    if kind == "value_error":
        reason = str(context["error"])
        # A model's own error concerns all its keys; the reason names them.
        return location, NOTHING if isinstance(value, Mapping | BaseModel) else value, reason
    if kind in ("extra_forbidden", "missing"):
        return location, NOTHING, _of_key(kind, location, _section_at(location[:-1], content))
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        given = value.get("kind", NOTHING) if isinstance(value, Mapping) else value
        return (*location, "kind"), given, f"is no kind of surface; allowed: {', '.join(SURFACE_KINDS)}"
    if kind == "string_pattern_mismatch" and context.get("pattern") == NAME_PATTERN:
        return location, value, "is not a name; allowed: lower-case letters, digits, '_' and, but not first, '-'"
    context |= {"what": "characters" if isinstance(value, str) else "entries"}
    return location, value, _REASONS[kind].format(**context) if kind in _REASONS else details["msg"].lower()


def _of_key(kind: str, location: tuple, section: type[BaseModel] | None) -> str:
    """What is wrong with a key that is unknown or missing in a section."""
    name, fields = location[-1], section.model_fields if section else {}
    if kind == "missing":
        return f"the key is missing; needed: {fields[name].description if name in fields else 'a value'}"
    if section and (section.__name__, name) in _FORMER_KEYS:
        return _FORMER_KEYS[section.__name__, name]
    allowed = sorted(fields)
    near = difflib.get_close_matches(str(name), allowed, 1)
    return f"unknown key{f' (did you mean {near[0]!r}?)' if near else ''}; allowed: {', '.join(allowed)}"


def _without_tags(location: tuple) -> tuple:
    """The location without what pydantic adds to it: the kind of a surface (its section holds no such key)."""
    if len(location) > 2 and location[0] == "surfaces" and location[2] in SURFACE_KINDS:
        location = (*location[:2], *location[3:])
    return location


def _section_at(location: tuple, content: Any) -> type[BaseModel] | None:
    """The model of the section at `location`."""
    kind: Any = Campaign
    for part in location:
        content = content[part]
        is_section = isinstance(kind, type) and issubclass(kind, BaseModel)
        kind = kind.model_fields[part].annotation if is_section else get_args(kind)[-1]
        kind = _one_of(kind, content)
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None


def _one_of(kind: Any, content: Any) -> Any:
    """The type that is meant where there may be nothing or one of several kinds of surfaces."""
    if get_origin(kind) is Annotated:
        return _one_of(get_args(kind)[0], content)
    if get_origin(kind) not in (Union, UnionType):
        return kind
    kinds = [each for each in get_args(kind) if each is not type(None)]
    return _one_of(kinds[0], content) if len(kinds) == 1 else SURFACE_KINDS.get(content.get("kind"), kinds[0])
