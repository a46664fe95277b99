"""YAML files of configurations, read and written: every key once, in the order in which they stand."""

import codecs
from collections.abc import Mapping
from pathlib import Path

import yaml

from icha.configuration.errors import ConfigurationError


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
        raise ConfigurationError(f"{path}, line {where}: control character {code}; allowed: text alone") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark else ""
        what = getattr(error, "problem", None) or "not YAML"
        raise ConfigurationError(f"{path}{where}: {what}; allowed: a YAML mapping with every key once") from None
    if not isinstance(content, dict):
        what = "empty" if content is None else f"a {type(content).__name__}"
        raise ConfigurationError(f"{path}: the file is {what}; allowed: a YAML mapping of keys to values")
    return content


def _text_of(path: Path) -> str:
    try:
        content = path.read_bytes()
    except IsADirectoryError:
        raise ConfigurationError(f"{path}: is a folder; allowed: a YAML file") from None
    except OSError as error:
        raise ConfigurationError(f"{path}: {error.strerror}; allowed: a readable YAML file") from None
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise ConfigurationError(f"{path}: is text in UTF-16; allowed: a YAML file saved in UTF-8")
    if b"\0" in content:
        raise ConfigurationError(f"{path}: is a binary file; allowed: a YAML file, which is text")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        where, byte = content[: error.start].count(b"\n") + 1, f"0x{content[error.start]:02x}"
        raise ConfigurationError(
            f"{path}, line {where}: byte {byte} is not UTF-8, so the text is in another encoding, such as Latin-1; "
            f"allowed: a YAML file saved in UTF-8"
        ) from None


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


def dumped(content: Mapping) -> str:
    """The text of a configuration, in the order in which it was written."""
    return yaml.safe_dump(dict(content), sort_keys=False, allow_unicode=True, width=110)
