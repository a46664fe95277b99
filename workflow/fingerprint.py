"""Fingerprints of code: the result of a job depends on its script and on the modules that the script imports.

Snakemake itself compares only the time stamp of the script. A fingerprint is computed from syntax trees. So comments,
docstrings, formatting and time stamps do not change a fingerprint. An edit of a module changes the fingerprints of
exactly the jobs that use this module.

(The library `grimp` also follows imports, but only inside a package. `grimp` ignores scripts and data files.)
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
# This module starts and ends every job. It is in the folder of the scripts, and has no effect on results.
JOB_MODULE = "job.py"


def code_fingerprint(script: str | Path, *modules: str) -> str:
    """Return the fingerprint of a script with all modules that it imports (`files_of`), and with their data files.

    A data file counts if a module in the same folder contains the name of the file.
    """
    files = files_of(script, *modules)
    digest = hashlib.sha256("".join(files).encode())
    for file in files.values():
        digest.update(bytes.fromhex(_syntax_of(file).digest))
        for data in _data_files(file):
            digest.update(data.name.encode() + hashlib.sha256(data.read_bytes()).digest())
    return digest.hexdigest()[:16]


def files_of(script: str | Path, *modules: str) -> dict[str, Path]:
    """Return a script and all modules that it imports from the package or from its folder, sorted by name.

    Importing a module does not add the `__init__.py` of its package. `JOB_MODULE` is left out, and so are modules that
    only `JOB_MODULE` imports.

    Parameters
    ----------
    script : path of the script.
    modules : names of further modules that the script imports; the text of the script does not contain these names.
    """
    job_module = Path(script).with_name(JOB_MODULE)
    files: set[Path] = set()
    pending = [Path(script), *(_module_file(name) for name in modules)]
    while pending:
        file = pending.pop()
        if file not in files:
            files.add(file)
            pending += _imports(file) - {job_module}
    return {_name(file): file for file in sorted(files, key=_name)}


@cache
def _package_folder() -> Path:
    """Return the folder of the package that jobs will import."""
    return Path(importlib.util.find_spec(PACKAGE).submodule_search_locations[0])


def _name(file: Path) -> str:
    folder = _package_folder()
    return str(file.relative_to(folder.parent)) if file.is_relative_to(folder) else file.name


@cache
def _imports(file: Path) -> set[Path]:
    files = set()
    for level, module, name in _syntax_of(file).imports:
        if level:
            package = file.relative_to(_package_folder().parent).parts[:-level]
            module = ".".join([*package, *([module] if module else [])])
        files.add(_resolve(file, module, name))
    return files - {None}


def _resolve(file: Path, module: str, name: str | None) -> Path | None:
    """Return the file of an import; None if the file is neither in the package nor in the folder of a script."""
    if module.split(".")[0] != PACKAGE:
        neighbour = file.parent / f"{module}.py"
        return neighbour if neighbour.is_file() and not file.is_relative_to(_package_folder()) else None
    if name is not None and (submodule := _module_file(f"{module}.{name}", missing_ok=True)):
        return submodule
    if module == PACKAGE:
        if name in ("__version__", None):
            return None
        raise ValueError(f"{file}: import {name!r} from the module that defines it, so that its changes are detected")
    return _module_file(module)


def _module_file(name: str, missing_ok: bool = False) -> Path | None:
    path = _package_folder().joinpath(*name.split(".")[1:])
    for file in (path.with_suffix(".py"), path / "__init__.py"):
        if file.is_file():
            return file
    if missing_ok:
        return None
    raise ValueError(f"expected a module {name!r} in {_package_folder()}")


@cache
def _data_files(file: Path) -> list[Path]:
    """Return the data files next to a module if the module contains their names, or the name of their folder."""
    files = set()
    for name in _syntax_of(file).names:
        path = file.parent / name
        if Path(name).is_absolute():
            continue  # a file of the system, such as one in /proc, whose content changes all the time
        if path.is_file() and path.suffix != ".py":
            files.add(path)
        elif path.is_dir() and path.parent == file.parent and not name.startswith((".", "_")):
            files |= {data for data in path.iterdir() if data.is_file() and data.suffix not in (".py", ".pyc")}
    return sorted(files)


class _Syntax(NamedTuple):
    """Content of a module that determines fingerprints.

    Attributes
    ----------
    digest : checksum of the syntax tree of the module, without the parts that have no effect on results.
    imports : for each import, its level (0 if absolute), its module, and the imported name (None for `import module`).
    names : texts in the module that may be names of files.
    """

    digest: str
    imports: list[tuple[int, str, str | None]]
    names: list[str]


# Reading the syntax trees of all modules takes a second, so the results are cached in the folder of Python's bytecode.
# Keys of the cache are checksums of modules. The name of its file depends on the version of Python and on this module.
_READER = hashlib.sha256(Path(__file__).read_bytes() + sys.version.encode()).hexdigest()[:16]
_CACHE = Path(importlib.util.cache_from_source(__file__)).with_suffix(f".{_READER}.json")
_syntaxes: dict[str, list] = {}


@cache
def _syntax_of(file: Path) -> _Syntax:
    text = file.read_bytes()
    sha256 = hashlib.sha256(text).hexdigest()
    if not _syntaxes:
        with contextlib.suppress(OSError, ValueError):
            _syntaxes.update(json.loads(_CACHE.read_text(encoding="ascii")))
    if sha256 not in _syntaxes:
        atexit.unregister(save_cache)
        atexit.register(save_cache)
        _syntaxes[sha256] = list(_read(ast.parse(text, file.name)))
    return _Syntax(*_syntaxes[sha256])


def save_cache() -> None:
    """Save the syntax of the modules for the next process, if the folder can be written to."""
    # `whole_file` is not used, because it checks the owner of the results, and the cache is not a result.
    temporary = _CACHE.with_suffix(f".{os.getpid()}.tmp")
    with contextlib.suppress(OSError):
        temporary.write_text(json.dumps(_syntaxes), encoding="ascii")
        temporary.replace(_CACHE)


def _read(tree: ast.Module) -> _Syntax:
    imports, names = [], set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports += [(0, alias.name, None) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            imports += [(node.level, node.module or "", alias.name) for alias in node.names]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and _may_be_a_file(node.value):
            names.add(node.value)
    return _Syntax(hashlib.sha256(repr(_canonical(tree)).encode()).hexdigest(), imports, sorted(names))


def _may_be_a_file(text: str) -> bool:
    return 0 < len(text) < 80 and all(c.isalnum() or c in "._-/" for c in text)


_DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def _canonical(node):
    """Return a syntax tree without positions, docstrings and empty fields; versions of Python differ in empty ones."""
    if isinstance(node, ast.AST):
        fields = ((name, value) for name, value in ast.iter_fields(node) if value not in (None, []))
        if isinstance(node, _DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            fields = ((name, value[1:] if name == "body" else value) for name, value in fields)
        return type(node).__name__, *((name, _canonical(value)) for name, value in fields if name != "kind")
    if isinstance(node, list):
        return [_canonical(item) for item in node]
    return repr(node)
