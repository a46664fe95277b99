"""Checksum sidecars of results: begun, written, verified, and what a result was made from; results that are set aside.

The sidecar of `results/<campaign>/<path>` is `results/<campaign>/checksums/<path>.json`, with the file's SHA-256, size
and time of change. A file of the same size and time is trusted, any other one is hashed; what the storage itself has
spoilt changes neither, and is found where a file is hashed in any case (`thorough`). A result may be a folder, too.

A sidecar without its result says that the result was there, or was about to be, and is to be made again.

It also says what was asked of the job that made the result, and from which content of which other results: a result
that is whole may still be one of other settings, of another program, or of data that are not those beside it.
"""

import contextlib
import hashlib
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

from icha.support.atomic_files import whole_file

FOLDER = "checksums"
# Why a result is stale that Snakemake sees for itself, if its record belongs to the result.
OTHER_SETTINGS = "it was made with other settings, or by another version of the program"


class Checksum(NamedTuple):
    """A result as it was written; of a folder the sum of sizes and the latest time of its files.

    `asked` is the checksum of what was asked of its job (`asked_of`); `inputs` are those of the results that it read.
    """

    sha256: str
    size: int
    mtime_ns: int
    asked: str = ""
    inputs: Mapping[str, str] = {}


def asked_of(parameters: Iterable[str]) -> str:
    """Checksum of what is asked of a job: of its parameters as Python represents them, in any order."""
    return hashlib.sha256("\n".join(sorted(parameters)).encode()).hexdigest()


def write_checksum(results: str | os.PathLike, path: str, *, asked: str = "", inputs: Mapping[str, str] = {}) -> None:
    """Write the sidecar of the result `path`, given from the campaign's folder `results`.

    Parameters
    ----------
    results, path : the result.
    asked, inputs : what it was made from, see `Checksum`; left out if nobody knows.

    Raises
    ------
    OSError
        If there is no such result, or the sidecar cannot be written.
    """
    file = Path(results, path)
    size, mtime_ns = _size_and_time(file)
    _write(results, path, Checksum(sha256_of(file), size, mtime_ns, asked, inputs))


def begin(results: str | os.PathLike, path: str) -> None:
    """Say that a result is about to be written; until its checksum is, it is not checked for damage, and stale."""
    _write(results, path, _BEGUN, lasting=False)


def distrust(results: str | os.PathLike, path: str) -> None:
    """Have a result hashed by whoever looks at it next, whatever its size and time."""
    written = _read(results, path)
    if written not in (None, _BEGUN):
        _write(results, path, written._replace(mtime_ns=0))


def is_whole(results: str | os.PathLike, path: str, *, thorough: bool = False) -> bool:
    """True if the result `path` in the campaign's folder `results` is what was written, or has no sidecar.

    A file of the same size and time is taken for whole, unless all are to be hashed (`thorough`). A file that was only
    copied or touched has another time and the same content; its sidecar gets the new time, where it can be written.

    A sidecar that cannot be read vouches for nothing: its result does not count as whole.
    """
    file = Path(results, path)
    try:
        written = _read(results, path)
    except ValueError:
        return not file.exists()
    if written in (None, _BEGUN):
        return True
    try:
        size, mtime_ns = _size_and_time(file)
    except FileNotFoundError:
        return True  # nothing there that could be damaged
    if size != written.size:
        return False
    if mtime_ns == written.mtime_ns and not thorough:
        return True
    if sha256_of(file) != written.sha256:
        return False
    if mtime_ns != written.mtime_ns:
        with contextlib.suppress(OSError):
            _write(results, path, written._replace(mtime_ns=mtime_ns))
    return True


def damaged(results: str | os.PathLike, *, thorough: bool = False) -> list[str]:
    """Paths of all results of a campaign that are there but are not what was written, sorted."""
    return [path for path in with_sidecar(results) if not is_whole(results, path, thorough=thorough)]


def stale(
    results: str | os.PathLike, paths: Iterable[str], asked: Callable[[str], str] | None = None
) -> Iterator[tuple[str, str]]:
    """Those of some results that are there but are not what is asked for now, with the reason of each.

    Parameters
    ----------
    results, paths : the results.
    asked : what is asked of each now (`asked_of`); left out, only what they were made from is looked at.
    """
    known = cache(lambda path: _known(results, path))

    @cache
    def content(path):
        """SHA-256 of an input, empty if it is not there; a file that came with the configuration has no sidecar."""
        with contextlib.suppress(FileNotFoundError):
            return known(path).sha256 or sha256_of(Path(results, path))
        return ""

    for path in paths:
        if not os.path.exists(os.path.join(results, path)):
            continue
        written = known(path)
        if not written.asked:
            yield path, "nothing says what it was made from"
        elif asked is not None and asked(path) != written.asked:
            yield path, OTHER_SETTINGS
        else:
            others = [each for each, sha256 in written.inputs.items() if content(each) != sha256]
            if others:
                yield path, f"it was made from another {others[0]} than is there"


def made_as(results: str | os.PathLike, path: str) -> str:
    """What was asked of the job that made a result (`asked_of`), by its sidecar; an empty text if nobody knows."""
    return _known(results, path).asked


def sha256_as_written(results: str | os.PathLike, path: str) -> str:
    """SHA-256 of a result by its sidecar, or else of what is there."""
    return _known(results, path).sha256 or sha256_of(Path(results, path))


def _known(results, path) -> Checksum:
    with contextlib.suppress(ValueError):
        return _read(results, path) or _BEGUN
    return _BEGUN


def with_sidecar(results: str | os.PathLike) -> Iterator[str]:
    """Paths of all results that have a sidecar, whether they are there or not, sorted."""
    top = os.path.join(results, FOLDER)
    for folder, folders, names in os.walk(top):
        folders.sort()
        below = os.path.relpath(folder, top)
        for name in sorted(names):
            if name.endswith(".json") and not name.startswith("."):
                yield os.path.normpath(os.path.join(below, name.removesuffix(".json")))


def set_aside(results: str | os.PathLike, path: str) -> Path:
    """Rename a result to `<name>.damaged`, or `.damaged2` and so on; return the new path.

    Its sidecar stays: the result is lost now, and to be made again.

    Raises
    ------
    OSError
        If it cannot be renamed, in a folder that is read-only for one.
    """
    file = Path(results, path)
    number = 1
    while (aside := file.with_name(f"{file.name}.damaged{number if number > 1 else ''}")).exists():
        number += 1
    file.rename(aside)
    return aside


# No file has this digest.
_BEGUN = Checksum("", 0, 0)


def _sidecar(results, path) -> Path:
    return Path(results, FOLDER, f"{path}.json")


def _read(results, path) -> Checksum | None:
    """The checksum in the sidecar of a result, if it has one; `ValueError` if it cannot be read."""
    try:
        with open(os.path.join(results, FOLDER, f"{path}.json"), "rb") as file:
            return Checksum(**json.loads(file.read()))
    except FileNotFoundError:
        return None
    except TypeError as error:
        raise ValueError(f"{_sidecar(results, path)}: no checksum: {error}") from None


def _write(results, path, checksum: Checksum, *, lasting: bool = True) -> None:
    with whole_file(_sidecar(results, path), lasting=lasting) as temporary:
        temporary.write_text(json.dumps(checksum._asdict()) + "\n", encoding="ascii")


def _size_and_time(file) -> tuple[int, int]:
    if not os.path.isdir(file):
        status = os.stat(file)
        return status.st_size, status.st_mtime_ns
    found = [os.stat(each) for each in _files_in(Path(file))]
    return sum(status.st_size for status in found), max((status.st_mtime_ns for status in found), default=0)


def sha256_of(file: Path) -> str:
    """SHA-256 of a file, hexadecimal; of a folder that of its files with their paths."""
    if not file.is_dir():
        with file.open("rb") as content:
            return hashlib.file_digest(content, "sha256").hexdigest()
    digest = hashlib.sha256()
    for each in _files_in(file):
        digest.update(f"{sha256_of(each)}  {each.relative_to(file).as_posix()}\n".encode())
    return digest.hexdigest()


def _files_in(folder: Path) -> list[Path]:
    """All files below a folder, sorted, without the mark that Snakemake leaves in folders."""
    return sorted(each for each in folder.rglob("*") if each.is_file() and each.name != ".snakemake_timestamp")
