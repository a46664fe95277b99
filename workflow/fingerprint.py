"""Fingerprints of code: what a job computes depends on its script and on the modules that the script imports.

Snakemake's own trigger looks at the time stamp of the script, and at nothing behind it. A fingerprint is taken
from the syntax trees, so comments, docstrings, formatting, touched files and fresh clones change nothing, and an
edit of a module changes exactly the jobs that use it.

(`grimp` knows what imports what as well, and as fast, but only within a package: not of scripts, nor of data files. The
trees are read for the fingerprints in any case.)
"""

import hashlib
import importlib.util
from functools import cache
from pathlib import Path

from syntax import syntax_of

PACKAGE = "icha"
# What surrounds the work of every script, from beside it: it says how jobs begin, fail and end, and changes no number.
AROUND = "job.py"


def code_fingerprint(script: str | Path, *modules: str) -> str:
    """Fingerprint of the files that a script is made of (`files_of`)."""
    files = files_of(script, *modules)
    digest = hashlib.sha256("".join(files).encode())
    for file in files.values():
        digest.update(bytes.fromhex(syntax_of(file).digest))
        for data in _data_files(file):
            digest.update(data.name.encode() + hashlib.sha256(data.read_bytes()).digest())
    return digest.hexdigest()[:16]


def files_of(script: str | Path, *modules: str) -> dict[str, Path]:
    """Files of a script, of what it imports from the package or from beside itself, and so on, by their sorted names.

    `modules` are those that the script imports by a name it is told only when it runs. Packages on the way to a
    module are not part of it, nor is what surrounds all scripts, with what only that imports; data files are, if they
    lie beside a module whose text names them.
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
def _imports(file: Path) -> list[Path]:
    found = (_resolve(file, _absolute(file, level, module), name) for level, module, name in syntax_of(file).imports)
    return sorted({each for each in found if each is not None})


def _absolute(file: Path, level: int, module: str) -> str:
    if not level:
        return module
    package = file.relative_to(_package_folder().parent).parts[:-level]
    return ".".join([*package, *([module] if module else [])])


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
    for name in syntax_of(file).names:
        place = file.parent / name
        if Path(name).is_absolute():
            continue  # a file of the system, such as one in /proc that says something else every time
        if place.is_file() and place.suffix != ".py":
            found.add(place)
        elif place.is_dir() and place.parent == file.parent and not name.startswith((".", "_")):
            found |= {data for data in place.iterdir() if data.is_file() and data.suffix not in (".py", ".pyc")}
    return sorted(found)
