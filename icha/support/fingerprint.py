"""Fingerprints of code: checksums of the modules that compute a result.

A fingerprint is computed from syntax trees. So comments, docstrings, formatting and time stamps do not change a
fingerprint. An edit of a module changes the fingerprints of exactly the results that depend on this module.
"""

import ast
import hashlib
import importlib.util
from functools import cache
from pathlib import Path

PACKAGE = "icha"
_DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


@cache
def fingerprint(*modules: str, script: Path | None = None) -> str:
    """Return the fingerprint of modules of ICHA, of all modules that they import, and of the data files of all of them.

    A data file counts if a module in the same folder contains the name of the file, or of the folder of the file. A
    `script` is a Python file outside the package; the file and the modules of ICHA that it imports count, too.
    """
    digest = hashlib.sha256()
    if script is not None:
        digest.update(_checksum_of(script).encode())
        modules += tuple(sorted(_modules_in(ast.parse(script.read_bytes()))))
    for name in imported_modules(*modules):
        digest.update(f"{name} {_checksum_of(_file_of(name))} ".encode())
    return digest.hexdigest()


def imported_modules(*modules: str) -> list[str]:
    """Return the sorted names of modules of ICHA and of all modules that they import, directly or indirectly.

    Importing a module does not add the `__init__` of its package. Raise ValueError if a module imports a name from
    `icha` itself, because then the module that defines the name is unknown.
    """
    graph = _graph()
    found = sorted({*modules}.union(*map(graph.find_upstream_modules, modules)))
    if PACKAGE in found:
        importers = [name for name in found if graph.direct_import_exists(importer=name, imported=PACKAGE)]
        raise ValueError(
            f"{', '.join(importers) or PACKAGE}: import a name from the module that defines it, not from {PACKAGE!r}, "
            "so that its changes are detected"
        )
    return found


@cache
def _graph():
    import grimp  # imported here because most programs need no fingerprints

    return grimp.build_graph(PACKAGE, cache_dir=None, exclude_type_checking_imports=True)


def _modules_in(tree: ast.Module) -> set[str]:
    """Return the modules of ICHA that a script imports."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            inner = {f"{node.module}.{alias.name}" for alias in node.names} & _graph().modules
            names |= inner or {node.module}
    return {name for name in names if name.partition(".")[0] == PACKAGE}


def _file_of(name: str) -> Path:
    """Return the file of a module, without importing its packages."""
    folder = Path(importlib.util.find_spec(PACKAGE).submodule_search_locations[0])
    path = folder.joinpath(*name.split(".")[1:])
    return file if (file := path.with_suffix(".py")).is_file() else path / "__init__.py"


@cache
def _checksum_of(file: Path) -> str:
    """Return the checksum of the syntax tree of a Python file and of the data files that it names.

    Data are files, and folders without modules, in the folder of the Python file.
    """
    parts: list[str] = []
    _write(ast.parse(file.read_bytes(), file.name), parts)
    digest = hashlib.sha256("\n".join(parts).encode())
    texts = set(parts)
    named = (path for path in file.parent.iterdir() if repr(path.name) in texts and path.suffix != ".py")
    for path in sorted(path for path in named if not (path / "__init__.py").exists()):
        for data in sorted(path.iterdir()) if path.is_dir() else [path]:
            if data.is_file():
                digest.update(data.name.encode() + hashlib.sha256(data.read_bytes()).digest())
    return digest.hexdigest()


def _write(node, parts: list[str]) -> None:
    """Append a syntax tree without positions, docstrings and empty fields; versions of Python differ in empty ones."""
    if isinstance(node, list):
        parts.append("[")
        for item in node:
            _write(item, parts)
        parts.append("]")
    elif isinstance(node, ast.AST):
        parts.append(type(node).__name__)
        documented = isinstance(node, _DOCUMENTED) and ast.get_docstring(node, clean=False) is not None
        for name in node._fields:
            value = getattr(node, name, None)
            if value not in (None, []) and name != "kind":
                parts.append(name)
                _write(value[1:] if documented and name == "body" else value, parts)
    else:
        parts.append(repr(node))
