"""Error messages for configurations: file, line, key, value, problem and expected value."""

from __future__ import annotations

import difflib
import itertools
import re
from collections.abc import Iterable, Mapping
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel

from icha.configuration.campaign import Campaign
from icha.configuration.figures import OwnFigure
from icha.configuration.studies import Study
from icha.configuration.surfaces import SURFACE_KINDS
from icha.support.formatting import printable
from icha.support.values import NAME_PATTERN, NOTHING, Problem

if TYPE_CHECKING:
    from icha.configuration.yaml_files import Source

# Largest number of problems in one message.
MOST_PROBLEMS = 50
# Usual words for quantities that have another key here: keys, of which one exists in the section or in a study; words;
# and how the quantities are related. The relations to the correlation length follow from the spectrum with roll-off:
# docs/faq.md. Those of Ra and Rdq hold for Gaussian heights and for isotropic surfaces (ISO 21920-2, ISO 25178-2).
_WORDS = (
    (
        ("rolloff_wavelength",),
        "correlation_length autocorrelation_length acl",
        "about 4 times the length at which the autocorrelation falls to 1/e, for hurst = 0.8; 5 times for 0.5",
    ),
    (
        ("rolloff_wavelength",),
        "sal",
        "about 3 times Sal, the length at which the autocorrelation falls to 0.2, for hurst = 0.8",
    ),
    (("rolloff_wavelength",), "roll_off rolloff roll_off_wavelength lambda_r lambda_0 longest_wavelength", ""),
    (
        ("short_wavelength", "cutoff"),
        "cutoff_wavelength cutoff cut_off shortest_wavelength smallest_wavelength lambda_s lambda_1",
        "the shortest wavelength of the roughness",
    ),
    (("hurst",), "hurst_exponent h", ""),
    (("hurst",), "fractal_dimension", "3 minus the fractal dimension of the surface"),
    (
        ("rms_heights",),
        "rq sq roughness rms_roughness rms_height sigma h_rms hrms",
        "Sq, the rms height over the area, for each surface of a study",
    ),
    (("rms_heights",), "ra sa", "Sq, which is 1.25 times Sa = Ra for Gaussian heights"),
    (("rms_slopes", "rms_slope"), "sdq rms_slope rms_gradient slope", "Sdq, the rms slope |grad h| over the area"),
    (("rms_slopes", "rms_slope"), "rdq", "Sdq, which is √2 times the rms slope Rdq of profiles of isotropic surfaces"),
    (("surface_energy",), "work_of_adhesion adhesion_energy gamma delta_gamma dgamma w", "the work of adhesion Δγ"),
    (("contact_modulus",), "e_star composite_modulus reduced_modulus effective_modulus", ""),
    (
        ("youngs_modulus",),
        "e young young_modulus youngs elastic_modulus modulus",
        "Young's modulus; with `poisson_ratio` it gives `contact_modulus`: E* = E/(1 - ν²) on a rigid body",
    ),
    (("poisson_ratio",), "nu poisson poissons_ratio poisson_number", ""),
    (("pressures", "forces"), "load loads", ""),
    (("forces",), "force normal_force normal_forces", ""),
)
_OTHER_NAMES = {word: (keys, relation) for keys, words, relation in _WORDS for word in words.split()}
# Messages for users, by pydantic's type of error. The messages of pydantic itself are for programmers.
_NOT_A_SECTION = "is not a section; expected a mapping of keys to values"
_REASONS = {
    "model_type": _NOT_A_SECTION,
    "model_attributes_type": _NOT_A_SECTION,
    "bool_type": "is neither true nor false; expected true or false",
    "dict_type": "is not a mapping; expected names with their sections",
    "list_type": "is not a list; expected a list in brackets, such as [{}]",
    "string_type": "is not text; expected text (in quotes if the text looks like a number)",
}


class ConfigurationError(ValueError):
    """Error: a configuration is not valid. The message has one line for each problem."""


def refuse(source: Source, problems: Iterable[Problem], implausible: Iterable[Problem] = ()) -> None:
    """Raise ConfigurationError if there are problems; the message first lists implausible values as possible causes."""
    found = list(itertools.islice(problems, MOST_PROBLEMS + 1))
    if not found:
        return
    found = [*itertools.islice(implausible, MOST_PROBLEMS + 1), *found]
    lines = list(dict.fromkeys(format_problem(source, *problem) for problem in found))
    if len(lines) > MOST_PROBLEMS:
        lines[MOST_PROBLEMS:] = [f"{source.name}: there are more problems; correct these first"]
    raise ConfigurationError("\n".join(lines))


def format_problem(source: Source, location: tuple, value: Any, reason: str) -> str:
    """Format a problem as one line; escape control characters, because the file may come from an unknown source."""
    where, location, value = source.locate(location, value)
    keys = [f"[{entry}]" if isinstance(entry, int) else f".{_cut(str(entry), 80)}" for entry in location]
    key = "".join(keys).lstrip(".") or "top level"
    shown = "" if value is NOTHING else " (empty)" if value is None else f" {_cut(repr(value), 80)}"
    return printable(f"{where}: {key}:{shown} {_cut(reason, 2000)}")


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 3]}..."


def problem_of(details: Mapping) -> Problem:
    """Convert the details of a pydantic error into location (keys), value and reason."""
    location, value, kind = details["loc"], details["input"], details["type"]
    # Pydantic adds the kind of a surface, and the marker `[key]`.
    if len(location) > 2 and location[0] == "surfaces" and location[2] in SURFACE_KINDS:
        location = (*location[:2], *location[3:])
    location = location[:-1] if location[-1:] == ("[key]",) else location
    context = details.get("ctx", {})
    if kind == "value_error":
        reason = str(context["error"])
        numbers = isinstance(value, list) and reason.startswith("is not a number")
        if numbers and location[0] in ("surfaces", "materials"):
            reason = f"{reason}. To vary it, write `vary: {{{location[-1]}: […]}}` in a study"
        # The message for a whole section already contains keys and values.
        return location, NOTHING if isinstance(value, Mapping | BaseModel) else value, reason
    if kind == "missing" and location[0] == "figures" and location[2:] == ("script",):
        reason = _reason_for_key("extra_forbidden", location[:-1])
        return location[:-1], NOTHING, f"{reason}; or a figure of your own with the key 'script'"
    if kind in ("extra_forbidden", "missing"):
        return location, NOTHING, _reason_for_key(kind, details["loc"])
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        given = value.get("kind", NOTHING) if isinstance(value, Mapping) else value
        return (*location, "kind"), given, f"is not a kind of surface; expected one of {', '.join(SURFACE_KINDS)}"
    if kind == "string_pattern_mismatch" and context.get("pattern") == NAME_PATTERN:
        return location, value, "is not a valid name; expected lower-case letters, digits, '_' and (not first) '-'"
    # Example of a message of pydantic: "List should have at least 1 item after validation, not 0".
    expected = re.sub(r"^\w+ should (be|have) | after validation.*", "", details["msg"])
    reason = _REASONS.get(kind, f"is not valid; expected {expected}")
    return location, value, reason.format("value, value" if isinstance(value, Mapping) else value)


def _reason_for_key(kind: str, location: tuple) -> str:
    """Return the message for an unknown or missing key of a section."""
    section, name = _section_at(location[:-1]), location[-1]
    if kind == "missing":
        return f"the key is missing; expected: {' '.join(str(section.model_fields[name].description).split())}"
    return f"unknown key{_hint(str(name), section)}; expected one of {', '.join(sorted(section.model_fields))}"


def _hint(name: str, section: type[BaseModel]) -> str:
    """Return the key that is meant by an unknown key of a section, in parentheses; empty if there is none."""
    word = re.sub(r"[\s-]+", "_", name.replace("'", "").lower())
    keys, relation = _OTHER_NAMES.get(word, ((), ""))
    because = f" {relation[0].upper()}{relation[1:]}" if relation else ""
    known = [key for key in keys if key in section.model_fields]
    if not known and keys and keys[0] in Study.model_fields:
        return f" (did you mean `{keys[0]}` of a study?{because})"
    similar = known or difflib.get_close_matches(name, section.model_fields, 1)
    return f" (did you mean {similar[0]!r}?{because if known else ''})" if similar else ""


def _section_at(location: tuple) -> type[BaseModel]:
    """Return the class of the section at a location; pydantic adds the kind of a surface to the location."""
    model: Any = Campaign
    for key in location:
        if model in SURFACE_KINDS.values() and key in SURFACE_KINDS:
            model = SURFACE_KINDS[key]
            continue
        if get_origin(model) in (dict, list):
            model = get_args(model)[-1]
        elif key in model.model_fields:
            model = model.model_fields[key].annotation
        else:
            model = OwnFigure  # the only section with names of the user's own among its keys
        while get_origin(model) in (Annotated, Union, UnionType):
            model = get_args(model)[0]
    return model
