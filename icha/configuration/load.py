"""From the text of a configuration file to a campaign, or to a list of everything that is wrong with it."""

from __future__ import annotations

import difflib
import hashlib
import os
from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

import yaml
from pydantic import BaseModel, ValidationError

from icha.configuration.design import designed
from icha.configuration.measurement import read_columns
from icha.configuration.model import SURFACE_KINDS, Campaign, Defaults, Topography
from icha.configuration.problems import Problem, problems
from icha.configuration.topography import Crop, MeasuredSurface
from icha.configuration.values import MEASURED
from icha.support.values import NAME_PATTERN, NOTHING
from icha.surfaces.measured.height_map import read_height_map


class ConfigurationError(ValueError):
    """A configuration that cannot be run; the message lists file, key, value and what is allowed, line by line."""


@dataclass(frozen=True)
class Configuration:
    """A valid campaign and where it came from.

    `text` is the merged configuration as its author wrote it, units included; `campaign` is what it means, in SI
    units and with the paths of its files resolved; `origin` is its file.
    """

    campaign: Campaign
    text: str
    origin: str = field(compare=False)


def load_configuration(path: str | os.PathLike, overrides: Mapping[str, Any] | None = None) -> Configuration:
    """Read and check a configuration file.

    Parameters
    ----------
    path : YAML file.
    overrides : values that replace those of the file, key by key, as given by `snakemake --config`.

    Raises
    ------
    ConfigurationError
        Naming every key that is wrong.
    """
    path = Path(path)
    from_file = read_yaml(path)
    written = merged(from_file, overrides or {})
    content = with_defaults(written)

    def fail(found: Iterable[Problem]):
        found = [(_in_defaults(location, written), value, reason) for location, value, reason in found]
        lines = [_line(_origin(path, from_file, overrides or {}, problem[0]), *problem) for problem in found]
        if lines:
            raise ConfigurationError("\n".join(dict.fromkeys(lines)))

    try:
        campaign = Campaign.model_validate(content)
    except ValidationError as error:
        fail(_problem(details, content) for details in error.errors())
    campaign, design_problems = designed(campaign.with_files_beside(path.parent), content)
    fail(design_problems)
    topographies, unread = _topographies(campaign)
    fail(unread)
    campaign = campaign.with_topographies(topographies)
    fail([*problems(campaign), *_problems_of_measurements(campaign)])
    return Configuration(campaign, dumped(written), str(path))


def dumped(content: Mapping) -> str:
    """The text of a configuration, in the order in which it was written."""
    return yaml.safe_dump(dict(content), sort_keys=False, allow_unicode=True, width=110)


def read_yaml(path: Path) -> dict:
    """Read a YAML file that holds a mapping and no key twice.

    Raises
    ------
    ConfigurationError
        If the file is missing, empty, not YAML, or holds anything else.
    """
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), Loader=_Loader)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ConfigurationError(f"{path}: {reason}; allowed: a readable YAML file") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark else ""
        what = getattr(error, "problem", None) or "not YAML"
        raise ConfigurationError(f"{path}{where}: {what}; allowed: a YAML mapping with every key once") from None
    if not isinstance(content, dict):
        what = "empty" if content is None else f"a {type(content).__name__}"
        raise ConfigurationError(f"{path}: the file is {what}; allowed: a YAML mapping of keys to values")
    return content


class _Loader(yaml.SafeLoader):
    """YAML in which a key that is given twice is an error, not the last one's secret win."""

    def construct_yaml_timestamp(self, node):
        try:
            return super().construct_yaml_timestamp(node)
        except ValueError:  # a 30th of February, say: text, which is checked where it belongs
            return self.construct_scalar(node)

    def construct_mapping(self, node, deep=False):
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, str | int | float):
                raise yaml.constructor.ConstructorError(None, None, "a key is no text", key_node.start_mark)
            if key in seen:
                raise yaml.constructor.ConstructorError(None, None, f"key {key!r} is given twice", key_node.start_mark)
            seen.add(key)
        return super().construct_mapping(node, deep)


_Loader.add_constructor("tag:yaml.org,2002:timestamp", _Loader.construct_yaml_timestamp)


def merged(content: Mapping, overrides: Mapping) -> dict:
    """`content` with the values of `overrides` in their places; lists are replaced whole."""
    result = deepcopy(dict(content))
    for key, value in overrides.items():
        inside = result.get(key)
        both = isinstance(inside, Mapping) and isinstance(value, Mapping)
        result[key] = merged(inside, value) if both else deepcopy(value)
    return result


def with_defaults(content: Mapping) -> dict:
    """`content` with the values of its section `defaults` in the entries that do not give their own.

    Of the defaults of surfaces an entry takes those that its kind has.
    """
    result = deepcopy(dict(content))
    defaults = result.get("defaults")
    for section in Defaults.model_fields if isinstance(defaults, Mapping) else ():
        given, entries = defaults.get(section), result.get(section)
        if not isinstance(given, Mapping) or not isinstance(entries, Mapping):
            continue  # an error, which the model words
        for name, entry in entries.items():
            if not isinstance(entry, Mapping | None):
                continue
            entry = dict(entry or {})
            kind = SURFACE_KINDS.get(entry.get("kind", given.get("kind")))
            foreign = _of_other_kinds(kind) if section == "surfaces" and kind else ()
            entries[name] = {key: deepcopy(value) for key, value in given.items() if key not in foreign} | entry
    return result


def _of_other_kinds(kind: type[BaseModel]) -> set[str]:
    """Keys that only surfaces of other kinds have."""
    return {key for other in SURFACE_KINDS.values() for key in other.model_fields} - set(kind.model_fields)


def _in_defaults(location: tuple, written: Mapping) -> tuple:
    """Where the value at `location` was written: in its entry, or in the defaults of its section."""
    if len(location) < 3 or location[0] not in Defaults.model_fields:
        return location
    section, name, key = location[:3]
    given = written.get("defaults")
    given = given.get(section) if isinstance(given, Mapping) else None
    entries = written.get(section)
    own = (entries.get(name) or {}) if isinstance(entries, Mapping) else {}
    if isinstance(given, Mapping) and key in given and isinstance(own, Mapping) and key not in own:
        return ("defaults", section, *location[2:])
    return location


def _origin(path: Path, from_file: Mapping, overrides: Mapping, location: tuple) -> str:
    """Who gave the value at `location`, or failed to give it: the file, or the command line's overrides."""

    def holds(content, keys):
        for key in keys:
            if not isinstance(content, Mapping):
                return True
            if key not in content:
                return False
            content = content[key]
        return True

    given = bool(location) and holds(overrides, location)
    return "--config" if given or not holds(from_file, location[:-1]) else str(path)


def _line(origin: str, location: tuple, value: Any, reason: str) -> str:
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location).lstrip(".")
    shown = "" if value is NOTHING else " (empty)" if value is None else f" {_short(value)}"
    return f"{origin}: {key or 'top level'}:{shown} {reason}"


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def _problem(details: Mapping, content: Mapping) -> tuple[tuple, Any, str]:
    """One error of pydantic as (location, value, reason and what is allowed), in this project's words."""
    location = _without_tags(details["loc"], content)
    value, kind, context = details["input"], details["type"], details.get("ctx", {})
    if location[-1:] == ("[key]",):
        location = location[:-1]
    if kind == "value_error":
        reason = str(context["error"])
        # A model's own error concerns all its keys; the reason names them.
        return location, NOTHING if isinstance(value, Mapping | BaseModel) else value, reason
    if kind == "extra_forbidden":
        allowed = sorted(set(_keys(location[:-1], content)))
        near = difflib.get_close_matches(str(location[-1]), allowed, 1)
        hint = f" (did you mean {near[0]!r}?)" if near else ""
        return location, NOTHING, f"unknown key{hint}; allowed: {', '.join(allowed)}"
    if kind == "missing":
        section = _model(location[:-1], content)
        field = section.model_fields.get(location[-1]) if section else None
        return location, NOTHING, f"the key is missing; needed: {field.description if field else 'a value'}"
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        given = value.get("kind", NOTHING) if isinstance(value, Mapping) else value
        return (*location, "kind"), given, f"is no kind of surface; allowed: {', '.join(SURFACE_KINDS)}"
    if kind == "string_pattern_mismatch" and context.get("pattern") == NAME_PATTERN:
        return location, value, "is not a name; allowed: lower-case letters, digits, '_' and '-'"
    if kind in ("too_short", "string_too_short"):
        return location, value, "is empty; allowed: at least one entry"
    if kind == "literal_error":
        return location, value, f"is not a choice; allowed: {context['expected']}"
    wrong_type = {
        "list_type": "is not a list; allowed: a list, such as [a, b]",
        "dict_type": "is not a mapping; allowed: names with their sections",
        "model_type": "is not a section; allowed: a mapping of keys to values",
        "model_attributes_type": "is not a section; allowed: a mapping of keys to values",
        "string_type": "is not text; allowed: text (in quotes if it looks like a number)",
    }
    return location, value, wrong_type.get(kind, f"{details['msg'].lower()}")


def _without_tags(location: tuple, content: Any) -> tuple:
    """The location without what pydantic adds to it: the kind of a surface (its section holds no such key)."""
    if len(location) > 2 and location[0] == "surfaces" and location[2] in SURFACE_KINDS:
        location = (*location[:2], *location[3:])
    return location


def _model(location: tuple, content: Any) -> type[BaseModel] | None:
    """The model of the section at `location`."""
    from icha.configuration import model, publication

    sections = {
        "materials": model.Material,
        "studies": model.Study,
        "boundary_elements": model.BoundaryElements,
        "boundary_element_loops": model.BoundaryElementLoops,
        "error_sources": model.ErrorSources,
        "measurements": model.Measurement,
    }
    if not location:
        return Campaign
    if location[0] == "defaults":
        return Defaults
    if location[0] == "surfaces" and len(location) == 2:
        return SURFACE_KINDS.get(content["surfaces"][location[1]].get("kind"), model.SelfAffineSurface)
    if location[0] == "surfaces":
        return Crop
    if location == ("figures",):
        return model.Figures
    if location == ("one_asperity",):
        return model.OneAsperity
    if location[0] == "publication":
        return publication.Publication if len(location) == 1 else publication.PARTS.get(location[1])
    if len(location) == 2 and location[0] == "figures":
        return get_args(model.Figures.model_fields[location[1]].annotation)[0]
    if len(location) == 2:
        return sections.get(location[0])
    if location[0] == "studies":
        parts = {
            "targets": model.Targets,
            "turning_points": model.TurningPoint,
            "vary": model.Vary,
            "cases": model.Case,
        }
        return parts.get(location[2], model.Snapshot)
    if location[0] == "figures":
        return model.Snapshot
    return model.Column if location[0] == "measurements" else None


def _keys(location: tuple, content: Any) -> list[str]:
    section = _model(location, content)
    return list(section.model_fields) if section else []


def _topographies(campaign: Campaign) -> tuple[dict[str, Topography], list[Problem]]:
    """What there is to know of every topography that is pressed and comes from a file; what is wrong with them."""
    contacts = [each for study in campaign.studies for each in campaign.contacts(study)]
    asking = {each.surface for each in contacts if each.rms_slope == MEASURED}
    found, wrong = {}, []
    for name in dict.fromkeys(each.surface for each in contacts):
        surface = campaign.surfaces[name]
        if surface.random:
            continue
        try:
            grid, period, boundary, slope = _facts(surface, name in asking)
        except ValueError as error:
            key = getattr(error, "key", "path")
            origin = campaign.origin("surfaces", name)
            variant = "" if origin == name else f"of variant {name!r}: "
            wrong.append((("surfaces", origin, key), getattr(surface, key, NOTHING), f"{variant}{error}"))
            continue
        with open(surface.path, "rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        # Six digits name the files, and are more than any instrument has.
        found[name] = Topography(grid, period, boundary, None if slope is None else float(f"{slope:.6g}"), digest)
    return found, wrong


def _facts(surface, with_slope: bool) -> tuple[int, float, str, float | None]:
    if isinstance(surface, MeasuredSurface):
        # Slow to import, and not for every campaign.
        from icha.surfaces.measured.topography import topography_facts

        facts = topography_facts(surface.path, surface.preparation)
        return facts.grid, facts.period, facts.boundary, facts.rms_slope if with_slope else None
    heights = read_height_map(surface.path, surface.metres_per_unit)
    slope = None
    if with_slope:
        # Imports SciPy's transforms, for which no other call should wait.
        from icha.surfaces.surface import Surface

        slope = Surface(heights, surface.period).rms_slope
    return len(heights), surface.period, "periodic", slope


def _problems_of_measurements(campaign: Campaign) -> Iterable[Problem]:
    for name, measurement in campaign.measurements.items():
        try:
            read_columns(measurement.path, measurement.columns)
        except ValueError as error:
            yield ("measurements", name, "path"), measurement.path, str(error)
