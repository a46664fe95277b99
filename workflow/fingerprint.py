"""Fingerprints of code: what a job computes depends on its script and on the modules that the script imports.

Snakemake's own trigger looks at the time stamp of the script, and at nothing behind it. A fingerprint is taken from the
syntax trees, so comments, docstrings, formatting, touched files and fresh clones change nothing, and an edit of a
module changes exactly the jobs that use it.

(`grimp` also follows imports, as fast, but only within a package: not those of scripts, and no data files.)
"""

import ast
import atexit
import contextlib
import hashlib
import importlib.util
import json
import os
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

PACKAGE = "icha"
# What surrounds the work of every script, from beside it: it says how jobs begin, fail and end, and changes no number.
AROUND = "job.py"


def code_fingerprint(script: str | Path, *modules: str) -> str:
    """Fingerprint of the files that a script is made of (`files_of`)."""
    files = files_of(script, *modules)
    digest = hashlib.sha256("".join(files).encode())
    for file in files.values():
        digest.update(bytes.fromhex(_syntax_of(file).digest))
        for data in _data_files(file):
            digest.update(data.name.encode() + hashlib.sha256(data.read_bytes()).digest())
    return digest.hexdigest()[:16]


def files_of(script: str | Path, *modules: str) -> dict[str, Path]:
    """Files of a script, of what it imports from the package or from beside itself, and so on, by their sorted names.

    `modules` are those that the script imports by a name that it gets when it runs. Packages on the way to a module are
    not part of it, nor is what surrounds all scripts, with what only that imports; data files are, if they lie beside a
    module whose text names them.
    """
    around = Path(script).with_name(AROUND)
    found: set[Path] = set()
    pending = [Path(script), *(_module_file(name) for name in modules)]
    while pending:
        file = pending.pop()
        if file not in found:
            found.add(file)
            pending += (each for each in _imports(file) if each != around)
    return {_name(file): file for file in sorted(found, key=_name)}


@cache
def _package_folder() -> Path:
    # The package that jobs will import, wherever it is installed.
    return Path(importlib.util.find_spec(PACKAGE).submodule_search_locations[0])


def _name(file: Path) -> str:
    folder = _package_folder()
    return str(file.relative_to(folder.parent)) if file.is_relative_to(folder) else file.name


@cache
def _imports(file: Path) -> set[Path]:
    found = set()
    for level, module, name in _syntax_of(file).imports:
        if level:
            package = file.relative_to(_package_folder().parent).parts[:-level]
            module = ".".join([*package, *([module] if module else [])])
        found.add(_resolve(file, module, name))
    return found - {None}


def _resolve(file: Path, module: str, name: str | None) -> Path | None:
    if module.split(".")[0] != PACKAGE:
        beside = file.parent / f"{module}.py"
        return beside if beside.is_file() and not file.is_relative_to(_package_folder()) else None
    if name is not None:
        submodule = _module_file(f"{module}.{name}", missing_ok=True)
        if submodule is not None:
            return submodule
    if module == PACKAGE:
        if name in ("__version__", None):
            return None
        raise ValueError(f"{file}: import {name!r} from the module that defines it, so that changes there are seen")
    return _module_file(module)


def _module_file(name: str, missing_ok: bool = False) -> Path | None:
    place = _package_folder().joinpath(*name.split(".")[1:])
    for file in (place.with_suffix(".py"), place / "__init__.py"):
        if file.is_file():
            return file
    if missing_ok:
        return None
    raise ValueError(f"no module {name!r} in {_package_folder()}")


@cache
def _data_files(file: Path) -> list[Path]:
    """Files in the module's folder that its text names by their path from there, or by that of their folder."""
    found = set()
    for name in _syntax_of(file).names:
        place = file.parent / name
        if Path(name).is_absolute():
            continue  # a file of the system, such as one in /proc that says something else every time
        if place.is_file() and place.suffix != ".py":
            found.add(place)
        elif place.is_dir() and place.parent == file.parent and not name.startswith((".", "_")):
            found |= {data for data in place.iterdir() if data.is_file() and data.suffix not in (".py", ".pyc")}
    return sorted(found)


class _Syntax(NamedTuple):
    """What the text of a module says.

    Attributes
    ----------
    digest : of its syntax tree, without what changes nothing.
    imports : level (0 but for relative ones), module and the name that is imported from it (None in `import module`).
    names : the texts in it that could be names of files.
    """

    digest: str
    imports: list[tuple[int, str, str | None]]
    names: list[str]


# Syntax trees of all modules take a second to read. So what they say is kept beside Python's bytecode, by the checksum
# of the module's text, for the same reader: this module and this version of Python.
_READER = hashlib.sha256(Path(__file__).read_bytes() + sys.version.encode()).hexdigest()[:16]
_KEPT = Path(importlib.util.cache_from_source(__file__)).with_suffix(f".{_READER}.json")
_syntaxes: dict[str, list] = {}


@cache
def _syntax_of(file: Path) -> _Syntax:
    text = file.read_bytes()
    sha256 = hashlib.sha256(text).hexdigest()
    if not _syntaxes:
        with contextlib.suppress(OSError, ValueError):
            _syntaxes.update(json.loads(_KEPT.read_text(encoding="ascii")))
    if sha256 not in _syntaxes:
        atexit.unregister(keep)
        atexit.register(keep)
        _syntaxes[sha256] = list(_read(ast.parse(text, file.name)))
    return _Syntax(*_syntaxes[sha256])


def keep() -> None:
    """Keep what the modules say for the next process; where nothing can be written, that reads them again."""
    # Not by `whole_file`, which asks for the owner of results: these are none, and Snakemake has left their folder.
    temporary = _KEPT.with_suffix(f".{os.getpid()}.tmp")
    with contextlib.suppress(OSError):
        temporary.write_text(json.dumps(_syntaxes), encoding="ascii")
        temporary.replace(_KEPT)


def _read(tree: ast.Module) -> _Syntax:
    imports, names = [], set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports += [(0, alias.name, None) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            imports += [(node.level, node.module or "", alias.name) for alias in node.names]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and _could_be_a_file(node.value):
            names.add(node.value)
    return _Syntax(hashlib.sha256(repr(_canonical(tree)).encode()).hexdigest(), imports, sorted(names))


def _could_be_a_file(text: str) -> bool:
    return 0 < len(text) < 80 and all(c.isalnum() or c in "._-/" for c in text)


def _canonical(node):
    """A syntax tree without positions, docstrings and empty fields (which differ between versions of Python)."""
    if isinstance(node, ast.AST):
        fields = ((name, value) for name, value in ast.iter_fields(node) if value not in (None, []))
        if isinstance(node, _DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            fields = ((name, value[1:] if name == "body" else value) for name, value in fields)
        return type(node).__name__, *((name, _canonical(value)) for name, value in fields if name != "kind")
    if isinstance(node, list):
        return [_canonical(item) for item in node]
    return repr(node)


_DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
