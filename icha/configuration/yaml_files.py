"""Read and write configurations as YAML; apply overrides and defaults."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import yaml

from icha.configuration.campaign import Defaults
from icha.configuration.errors import ConfigurationError
from icha.configuration.surfaces import SURFACE_KINDS, MeasuredSurface
from icha.support import formatting
from icha.support.input_files import problem_with_path

# Limits of a file: number of bytes, of values after expansion of aliases, of nested sections, of characters per number.
_MOST_BYTES, _MOST_VALUES, _DEEPEST, _LONGEST_NUMBER = 10**6, 10**6, 50, 100
# What a message of the YAML parser means; `{}` is the line where the text or the brackets begin.
_MEANINGS = {
    r"found character '\\t'": "a tab; YAML allows only spaces in front of a key",
    r"expected ',' or '[]}]'": "a bracket from line {} is not closed, or a comma is missing",
    "2002:merge": "the key <<; write values that several entries share in the section `defaults`",
    "mapping values are not allowed": "a second colon; put text with a colon into quotes, and a key on its own line",
    "unexpected end of stream": "the quotes from line {} are not closed",
}


@dataclass(frozen=True)
class Source:
    """A configuration as written, with the lines of its file.

    Attributes
    ----------
    name : path of the file, or the name of a function whose arguments form the configuration.
    content : values of the file and overrides, without defaults.
    overrides : values that replace values in the file.
    node : nodes of the YAML file, which have line numbers; None without a file.
    """

    name: str
    content: Mapping = field(default_factory=dict)
    overrides: Mapping = field(default_factory=dict)
    node: yaml.Node | None = None

    def locate(self, location: tuple, value: Any) -> tuple[str, tuple, Any]:
        """Return where a value is written: file and line, keys, and the value with its unit as in the file.

        A value that an entry does not have may come from the defaults of its section. If a key is missing, the line is
        that of its section.
        """
        given = _descend(self.content, location)
        defaults = ("defaults", *location[:1], *location[2:])
        if len(given) < 3 <= len(in_defaults := _descend(self.content, defaults)):
            location, given = defaults, in_defaults
        if len(given) == len(location) > 0 and isinstance(value, float) and isinstance(given[-1], str):
            value = given[-1]
        replaced = _descend(self.overrides, location)
        if replaced and not isinstance(replaced[-1], Mapping):
            return f"{self.name} with --config", location, value
        line = _line_of(self.node, location)
        return f"{self.name}, line {line}" if line else self.name, location, value


def _descend(content: Any, location: tuple) -> list:
    """Return the value of each key of a location, one inside the other, up to the first key that is missing."""
    found = []
    for key in location:
        in_list = isinstance(content, list) and isinstance(key, int) and key < len(content)
        if not in_list and not (isinstance(content, Mapping) and key in content):
            break
        found.append(content := content[key])
    return found


def _line_of(node: yaml.Node | None, location: tuple) -> int:
    """Return the line of the last key of a location that is in a YAML file; 0 if no key is in the file."""
    line = 0
    for key in location:
        entries: dict = {}
        if isinstance(node, yaml.MappingNode):
            entries = {name.value: (name, inside) for name, inside in node.value}
        elif isinstance(node, yaml.SequenceNode):
            entries = {k: (inside, inside) for k, inside in enumerate(node.value)}
        if key not in entries:
            break
        name, node = entries[key]
        line = name.start_mark.line + 1
    return line


def read_yaml(path: Path) -> dict:
    """Read a YAML file; raise ConfigurationError if the content is not a mapping, or if a key occurs twice."""
    return read_source(path).content


def read_source(path: Path, overrides: Mapping = {}) -> Source:
    """Read a configuration file and apply overrides; raise the errors of `read_yaml`."""
    text, line, problem, content, node = _read_text(path), 0, "", None, None
    try:
        loader = _Loader(text)
        if (node := loader.get_single_node()) is not None:
            content = loader.construct_document(node)
        problem = excessive_size(content)
    except yaml.reader.ReaderError as error:
        line, problem = text.count("\n", 0, error.position) + 1, f"control character {error.character:#04x}"
    except yaml.MarkedYAMLError as error:
        line, begin = error.problem_mark.line + 1, (error.context_mark or error.problem_mark).line + 1
        meanings = (words for pattern, words in _MEANINGS.items() if re.search(pattern, error.problem))
        problem = next(meanings, error.problem).format(begin)
    except RecursionError:
        problem = _TOO_DEEP
    if problem:
        where = f"{path}, line {line}" if line else path
        raise ConfigurationError(f"{where}: {problem}; expected a YAML mapping with every key once")
    if not isinstance(content, dict):
        what = "empty" if content is None else f"a {type(content).__name__}"
        raise ConfigurationError(f"{path}: the file is {what}; expected a YAML mapping of keys to values")
    return Source(str(path), merge(content, overrides), overrides, node)


def _read_text(path: Path) -> str:
    if problem := problem_with_path(path):
        raise ConfigurationError(f"{path}: {problem}; expected a YAML file")
    try:
        with path.open("rb") as file:
            content = file.read(_MOST_BYTES + 1)
    except OSError as error:
        raise ConfigurationError(f"{path}: {error.strerror}; expected a readable YAML file") from None
    if len(content) > _MOST_BYTES:
        raise ConfigurationError(f"{path}: is longer than {formatting.size(_MOST_BYTES)}; expected a shorter YAML file")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ConfigurationError(f"{path}, line {line}: is not UTF-8; expected a YAML file saved in UTF-8") from None


_TOO_DEEP = f"the file has more than {_DEEPEST} nested sections or lists"


def excessive_size(content: Any) -> str:
    """Return a message if a configuration is too large to be checked; otherwise an empty text.

    Each alias counts with all its values, because a few lines of nested aliases can have billions of values. A default
    value counts once for every entry that receives the value.
    """
    for count, depth in enumerate(_depths(content)):
        if depth > _DEEPEST:
            return _TOO_DEEP
        if count >= _MOST_VALUES:
            return f"the file has more than {_MOST_VALUES} values, with aliases and defaults expanded"
    return ""


def _depths(content: Any, depth: int = 1) -> Iterator[int]:
    """Yield the depth of every value: the number of sections and lists that contain the value."""
    yield depth
    for each in content.values() if isinstance(content, Mapping) else content if isinstance(content, list) else ():
        yield from _depths(each, depth + 1)


class _Loader(yaml.SafeLoader):
    """A YAML loader that refuses repeated keys, and does not read numbers such as 064 as octal numbers."""

    def construct_unless_text(self, node, construct):
        """Convert a scalar to a Python value. If conversion fails, return the text, and a later check refuses it.

        Conversion fails for `0b_` (similar to a number), for 30 February (similar to a date), and for integers with
        thousands of digits.
        """
        text = self.construct_scalar(node)
        # YAML 1.1 would read a time such as 1:30 as a number to base 60.
        if len(text) > _LONGEST_NUMBER or (":" in text and not node.tag.endswith("timestamp")):
            return text
        # YAML 1.1 would read 064 as an octal number, but authors of configurations mean 64.
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
    """Return a configuration as YAML text; the keys keep their order, and each value has its own line.

    Raises ConfigurationError if the text is too long to be read again; the message contains the path `origin`.
    """
    text = yaml.safe_dump(dict(content), sort_keys=False, allow_unicode=True, width=110)
    if len(text.encode()) > _MOST_BYTES:
        raise ConfigurationError(
            f"{origin}: the copy of the configuration, with a line for each value, is longer than "
            f"{formatting.size(_MOST_BYTES)}; expected fewer values. Use ranges of seeds"
        )
    return text


def merge(content: Mapping, overrides: Mapping) -> dict:
    """Return `content` with the values of `overrides`; mappings are merged, and lists are replaced as a whole."""
    result = dict(content)
    for key, value in overrides.items():
        inside = result.get(key)
        both = isinstance(inside, Mapping) and isinstance(value, Mapping)
        result[key] = merge(inside, value) if both else value
    return result


def apply_defaults(content: Mapping) -> dict:
    """Return `content` with default values in all entries; a surface receives only the keys of its kind."""
    defaults, filled = content.get("defaults"), dict(content)
    for section in Defaults.model_fields if isinstance(defaults, Mapping) else ():
        given, entries = defaults.get(section), content.get(section)
        if isinstance(given, Mapping) and isinstance(entries, Mapping):
            filled[section] = {
                name: _fill_in(entry or {}, given) if isinstance(entry, Mapping | None) else entry
                for name, entry in entries.items()
            }
    return filled


def _fill_in(entry: Mapping, given: Mapping) -> dict:
    """Return an entry with default values `given`, except for keys that only surfaces of other kinds have.

    A default `boundary` is meant for measured surfaces, which have most values of this key.
    """
    kinds = [section.model_fields for section in SURFACE_KINDS.values()]
    kind = SURFACE_KINDS.get(str(entry.get("kind", given.get("kind"))))
    others = set().union(*kinds).difference(kind.model_fields) if kind else set()
    if kind and kind is not MeasuredSurface:
        others.add("boundary")
    return {key: value for key, value in given.items() if key not in others} | dict(entry)
