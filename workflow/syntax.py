"""What the text of a module says, as far as fingerprints of code need it.

Every call of Snakemake asks it of all modules, and their syntax trees take a second to read. So it is kept beside
Python's bytecode, with the checksum of the text that it was read from: of another text, it is read again.
"""

import ast
import atexit
import contextlib
import hashlib
import importlib.util
import json
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

from icha.support.atomic_files import whole_file

_KEPT = Path(importlib.util.cache_from_source(__file__)).with_suffix(".json")


class Syntax(NamedTuple):
    """What a module says.

    `digest` is that of its syntax tree, without what changes nothing. Its imports have a level (0 but for relative
    ones), a module and the name that is imported from it (none in `import module`). `names` are the texts in it that
    could be names of files.
    """

    digest: str
    imports: list[tuple[int, str, str | None]]
    names: list[str]


@cache
def syntax_of(file: Path) -> Syntax:
    """What a module says."""
    text = file.read_bytes()
    sha256 = hashlib.sha256(text).hexdigest()
    known = _kept().get(str(file))
    if known is None or known[0] != sha256:
        if not _new:
            atexit.register(_keep)
        known = _new[str(file)] = [sha256, *_read(ast.parse(text, file.name))]
    return Syntax(*known[1:])


def _read(tree: ast.Module) -> Syntax:
    imports, names = [], set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports += [(0, alias.name, None) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            imports += [(node.level, node.module or "", alias.name) for alias in node.names]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and _could_be_a_file(node.value):
            names.add(node.value)
    return Syntax(hashlib.sha256(repr(_canonical(tree)).encode()).hexdigest(), imports, sorted(names))


def _could_be_a_file(text: str) -> bool:
    return 0 < len(text) < 80 and all(c.isalnum() or c in "._-/" for c in text)


def _canonical(node):
    """A syntax tree without positions, docstrings and empty fields (which differ between versions of Python)."""
    if isinstance(node, ast.AST):
        fields = ((name, value) for name, value in ast.iter_fields(node) if value not in (None, []))
        if ast.get_docstring(node, clean=False) is not None if isinstance(node, _DOCUMENTED) else False:
            fields = ((name, value[1:] if name == "body" else value) for name, value in fields)
        return type(node).__name__, *((name, _canonical(value)) for name, value in fields if name != "kind")
    if isinstance(node, list):
        return [_canonical(item) for item in node]
    return repr(node)


_DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef

# What was read and is not kept yet, by the path of the module: the checksum of its text, and its syntax.
_new: dict[str, list] = {}


@cache
def _reader() -> str:
    """What tells this way of reading from any other: this module and the version of Python."""
    return hashlib.sha256(Path(__file__).read_bytes() + sys.version.encode()).hexdigest()


@cache
def _kept() -> dict[str, list]:
    """What was kept, if all of it is what was written, by the same reader."""
    with contextlib.suppress(OSError, ValueError):
        sha256, reader, text = _KEPT.read_text(encoding="ascii").splitlines()
        if reader == _reader() and sha256 == hashlib.sha256(text.encode()).hexdigest():
            return json.loads(text)
    return {}


def _keep() -> None:
    text = json.dumps(_kept() | _new)
    lines = (hashlib.sha256(text.encode()).hexdigest(), _reader(), text)
    # Where nothing can be written it is read every time.
    with contextlib.suppress(OSError), whole_file(_KEPT, lasting=False) as temporary:
        temporary.write_text("".join(f"{line}\n" for line in lines), encoding="ascii")
