"""Values of a configuration from more than one place: overrides, and the section `defaults`."""

from collections.abc import Iterator, Mapping
from copy import deepcopy

from icha.configuration.campaign import Defaults
from icha.configuration.surfaces import SURFACE_KINDS
from icha.support.values import NOTHING, Problem

_MOST_VALUES = 500_000


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
            kind = entry.get("kind", given.get("kind"))
            foreign = _of_other_kinds(kind) if section == "surfaces" and isinstance(kind, str) else ()
            entries[name] = {key: deepcopy(value) for key, value in given.items() if key not in foreign} | entry
    return result


def excessive_defaults(written: Mapping) -> Iterator[Problem]:
    """Sections of defaults that would be more than half a million values, written out in all entries."""
    defaults = written.get("defaults")
    for section in Defaults.model_fields if isinstance(defaults, Mapping) else ():
        entries = written.get(section)
        count = _values_in(defaults.get(section)) * (len(entries) if isinstance(entries, Mapping) else 0)
        if count > _MOST_VALUES:
            reason = f"would be {count} values, written out in all {section}; allowed: {_MOST_VALUES} at most"
            yield ("defaults", section), NOTHING, reason


def _values_in(content) -> int:
    inside = content.values() if isinstance(content, Mapping) else content if isinstance(content, list) else ()
    return 1 + sum(map(_values_in, inside))


def _of_other_kinds(kind: str) -> set[str]:
    """Keys that only surfaces of other kinds have; none if there is no such kind."""
    if kind not in SURFACE_KINDS:
        return set()
    every = {key for other in SURFACE_KINDS.values() for key in other.model_fields}
    return every - set(SURFACE_KINDS[kind].model_fields)


def place_in_defaults(location: tuple, written: Mapping) -> tuple:
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
