"""Read and write YAML files of configurations, with overrides and defaults; every key may stand once."""

import codecs
import re
from collections.abc import Iterator, Mapping
from copy import deepcopy
from functools import partial
from pathlib import Path

import yaml

from icha.configuration.campaign import Defaults
from icha.configuration.errors import ConfigurationError
from icha.configuration.surfaces import SURFACE_KINDS
from icha.support import formatting
from icha.support.input_files import problem_with_path
from icha.support.values import NOTHING, Problem

# Bounds of a file: bytes; values, with aliases expanded; nested sections; characters of a number.
_MOST_BYTES, _MOST_VALUES, _DEEPEST, _LONGEST_NUMBER = 10**6, 10**6, 50, 100


def read_yaml(path: Path) -> dict:
    """Read a YAML file that holds a mapping and no key twice.

    Raises
    ------
    ConfigurationError
        If the file is missing, empty, not YAML, or holds anything else.
    """
    text = _text_of(path)
    try:
        content = yaml.load(text, Loader=_Loader)
    except yaml.reader.ReaderError as error:
        where, code = text[: error.position].count("\n") + 1, f"{error.character:#04x}"
        raise ConfigurationError(f"{path}, line {where}: control character {code}; expected text") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark else ""
        what = getattr(error, "problem", None) or "not YAML"
        raise ConfigurationError(f"{path}{where}: {what}; expected a YAML mapping with every key once") from None
    if not isinstance(content, dict):
        what = "empty" if content is None else f"a {type(content).__name__}"
        raise ConfigurationError(f"{path}: the file is {what}; expected a YAML mapping of keys to values")
    return content


def _text_of(path: Path) -> str:
    if problem := problem_with_path(path):
        raise ConfigurationError(f"{path}: {problem}; expected a YAML file")
    try:
        with path.open("rb") as file:
            content = file.read(_MOST_BYTES + 1)
    except OSError as error:
        raise ConfigurationError(f"{path}: {error.strerror}; expected a readable YAML file") from None
    if len(content) > _MOST_BYTES:
        raise ConfigurationError(f"{path}: is longer than {formatting.size(_MOST_BYTES)}; expected a shorter YAML file")
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise ConfigurationError(f"{path}: is text in UTF-16; expected a YAML file saved in UTF-8")
    if b"\0" in content:
        raise ConfigurationError(f"{path}: is a binary file; expected a YAML file, which is text")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        where, byte = content[: error.start].count(b"\n") + 1, f"0x{content[error.start]:02x}"
        raise ConfigurationError(
            f"{path}, line {where}: byte {byte} is not UTF-8, so the text is in another encoding, such as Latin-1; "
            "expected a YAML file saved in UTF-8"
        ) from None


class _Loader(yaml.SafeLoader):
    """A loader that refuses tags, repeated keys and excessive sizes.

    Aliases count with all of their values, because a few lines of aliases of aliases can have billions.
    """

    def __init__(self, text):
        super().__init__(text)
        self._depth, self._values = 0, 0
        # Number of values of a node, by the identity of the node.
        self._sizes = {}

    def compose_node(self, parent, index):
        event, before = self.peek_event(), self._values
        self._values += self._size_of_alias(event) or 1
        self._depth += 1
        self._refuse(event, getattr(event, "tag", None) is not None, "a tag")
        self._refuse(event, self._depth > _DEEPEST, f"more than {_DEEPEST} nested sections or lists")
        many = f"the file has more than {_MOST_VALUES} values, with aliases expanded"
        self._refuse(event, self._values > _MOST_VALUES, many)
        node = super().compose_node(parent, index)
        self._depth -= 1
        # An alias returns its node, whose size is known.
        self._sizes.setdefault(id(node), self._values - before)
        return node

    def _size_of_alias(self, event):
        if not isinstance(event, yaml.AliasEvent) or event.anchor not in self.anchors:
            return 0
        size = self._sizes.get(id(self.anchors[event.anchor]))
        # The node is not composed yet, because the alias is within it.
        self._refuse(event, size is None, "an alias of a section within that section")
        return size

    def _refuse(self, event, wrong, problem):
        if wrong:
            raise yaml.composer.ComposerError(None, None, problem, event.start_mark)

    def construct_unless_text(self, node, construct):
        """Construct the value of a scalar; return its text if that fails, which the section then checks.

        Examples of scalars that fail: `0b_` looks like a number, 30 February looks like a date, and Python refuses
        integers of thousands of digits.
        """
        text = self.construct_scalar(node)
        # YAML 1.1 would read a time such as 1:30 as a number of base 60.
        if len(text) > _LONGEST_NUMBER or (":" in text and not node.tag.endswith("timestamp")):
            return text
        # YAML 1.1 would read 064 as an octal number, which no author of a configuration means.
        if node.tag.endswith(":int") and re.fullmatch(r"[-+]?0[0-9_]+", text):
            return int(text.replace("_", ""))
        try:
            return construct(self, node)
        except (ValueError, OverflowError):
            return text

    def construct_mapping(self, node, deep=False):
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            wrong = "" if isinstance(key, str) else "is not text; use quotes"
            wrong = wrong or ("is given twice" if key in seen else "")
            if wrong:
                raise yaml.constructor.ConstructorError(None, None, f"key {key!r} {wrong}", key_node.start_mark)
            seen.add(key)
        return super().construct_mapping(node, deep)


for _kind in ("int", "float", "timestamp"):
    _construct = getattr(yaml.SafeLoader, f"construct_yaml_{_kind}")
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", partial(_Loader.construct_unless_text, construct=_construct))


def dump_yaml(content: Mapping, origin: str) -> str:
    """Return the text of a configuration in its order, with a line for each value.

    Raises ConfigurationError, which names the file `origin`, if the text is too long to be read again.
    """
    text = yaml.safe_dump(dict(content), sort_keys=False, allow_unicode=True, width=110)
    if len(text.encode()) > _MOST_BYTES:
        raise ConfigurationError(
            f"{origin}: the copy for the results, with a line for each value, is longer than "
            f"{formatting.size(_MOST_BYTES)}; expected fewer values, such as ranges of seeds"
        )
    return text


# Largest number of values of defaults in all entries.
_MOST_DEFAULTS = 500_000


def merge(content: Mapping, overrides: Mapping) -> dict:
    """Return `content` with the values of `overrides`, which replace lists as a whole."""
    result = deepcopy(dict(content))
    for key, value in overrides.items():
        inside = result.get(key)
        both = isinstance(inside, Mapping) and isinstance(value, Mapping)
        result[key] = merge(inside, value) if both else deepcopy(value)
    return result


def _find_defaults(content: Mapping) -> Iterator[tuple[str, Mapping, dict]]:
    """Return sections with their defaults and entries, if both are mappings; the model refuses others."""
    defaults = content.get("defaults")
    for section in Defaults.model_fields if isinstance(defaults, Mapping) else ():
        given, entries = defaults.get(section), content.get(section)
        if isinstance(given, Mapping) and isinstance(entries, Mapping):
            yield section, given, entries


def apply_defaults(content: Mapping) -> dict:
    """Return `content` with its `defaults` filled into the entries; a surface gets only those that its kind has."""
    result = deepcopy(dict(content))
    for section, given, entries in _find_defaults(result):
        for name, entry in entries.items():
            if not isinstance(entry, Mapping | None):
                continue
            entry = dict(entry or {})
            kind = entry.get("kind", given.get("kind"))
            foreign = _keys_of_other_kinds(kind) if section == "surfaces" and isinstance(kind, str) else ()
            entries[name] = {key: deepcopy(value) for key, value in given.items() if key not in foreign} | entry
    return result


def excessive_defaults(written: Mapping) -> Iterator[Problem]:
    """Report sections of defaults with too many values when repeated in all entries."""
    for section, given, entries in _find_defaults(written):
        count = _count_values(given) * len(entries)
        if count > _MOST_DEFAULTS:
            reason = f"has {count} values when repeated in all {section}; expected at most {_MOST_DEFAULTS}"
            yield ("defaults", section), NOTHING, reason


def _count_values(content) -> int:
    inside = content.values() if isinstance(content, Mapping) else content if isinstance(content, list) else ()
    return 1 + sum(map(_count_values, inside))


def _keys_of_other_kinds(kind: str) -> set[str]:
    """Return the keys that only surfaces of other kinds have; none for an unknown kind."""
    if kind not in SURFACE_KINDS:
        return set()
    every = {key for other in SURFACE_KINDS.values() for key in other.model_fields}
    return every - set(SURFACE_KINDS[kind].model_fields)


def location_in_defaults(location: tuple, written: Mapping) -> tuple:
    """Return where the value at `location` was written: in its entry, or in the defaults of its section."""
    for section, given, entries in _find_defaults(written):
        if len(location) > 2 and location[0] == section:
            _, name, key = location[:3]
            entry = entries.get(name) or {}
            if key in given and isinstance(entry, Mapping) and key not in entry:
                return ("defaults", section, *location[2:])
    return location
