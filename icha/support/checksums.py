"""Sidecars: small files that record checksum, settings and inputs of each result.

The sidecar of `results/<campaign>/<path>` is `results/<campaign>/checksums/<path>.json`. A sidecar contains the
SHA-256, size and modification time of a result (file or folder). A result with the recorded size and time counts as
unchanged; otherwise ICHA computes its SHA-256. A damaged disk can change the content of a file without a change of size
and time. A `thorough` check computes the SHA-256 of every file, and so finds errors of the disk.

A sidecar also contains a checksum of the parameters of the job, and the checksums of the job's inputs. An unchanged
result may still come from other settings, another version of the program, or other inputs. If a sidecar exists but its
result does not, the result must be computed again.
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
# Reason for a stale result. Snakemake also detects this reason if Snakemake's own record of the result is valid.
OTHER_SETTINGS = "it was made with other settings, or by another version of the program"


class Checksum(NamedTuple):
    """Content of a sidecar: record of a result at the time when it was written.

    Attributes
    ----------
    sha256 : SHA-256 of the content.
    size, mtime_ns : size (bytes) and modification time (ns); for a folder, sum of sizes and latest time of its files.
    asked : checksum of the parameters of the job (`hash_parameters`).
    inputs : SHA-256 of each result that the job read, by path.
    """

    sha256: str
    size: int
    mtime_ns: int
    asked: str = ""
    inputs: Mapping[str, str] = {}


class LongText(str):
    """Text as a parameter of a job; Snakemake prints, records and compares its checksum instead of the text."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Return the SHA-256 of the text."""
        return f"sha256:{hashlib.sha256(self.encode()).hexdigest()}"


def hash_parameters(parameters: Iterable[str]) -> str:
    """Return the checksum of the parameters of a job, from their Python representations in any order."""
    return hashlib.sha256("\n".join(sorted(parameters)).encode()).hexdigest()


def write_checksum(results: str | os.PathLike, path: str, *, asked: str = "", inputs: Mapping[str, str] = {}) -> None:
    """Write the sidecar of the result `path` in the folder `results`; `Checksum` explains `asked` and `inputs`."""
    file = Path(results, path)
    size, mtime_ns = _size_and_time(file)
    _write(results, path, Checksum(sha256_of(file), size, mtime_ns, asked, inputs))


def begin(results: str | os.PathLike, path: str) -> None:
    """Record that a job starts to write a result, so that an unfinished result counts as stale, not as damaged."""
    _write(results, path, _BEGUN, lasting=False)


def distrust(results: str | os.PathLike, path: str) -> None:
    """Mark a result so that the next check computes its SHA-256, even if size and time are unchanged."""
    written = _read(results, path)
    if written not in (None, _BEGUN):
        _write(results, path, written._replace(mtime_ns=0))


def is_whole(results: str | os.PathLike, path: str, *, thorough: bool = False) -> bool:
    """Return whether a result agrees with the checksum in its sidecar; True if it has no sidecar.

    Unless `thorough` is true, a result with the recorded size and time counts as whole. If only the time differs, the
    sidecar receives the new time. An existing result whose sidecar cannot be read is not whole.
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
        return True  # a missing result is not damaged
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
    """Return the sorted paths of all damaged results: files that differ from the checksums in their sidecars."""
    return [path for path in with_sidecar(results) if not is_whole(results, path, thorough=thorough)]


def stale(
    results: str | os.PathLike, paths: Iterable[str], asked: Callable[[str], str] | None = None
) -> Iterator[tuple[str, str]]:
    """Yield each existing result that was computed with other settings or inputs: its path, and the reason.

    Parameters
    ----------
    results, paths : folder of results of the campaign, and paths in this folder.
    asked : function that returns the present checksum of the job's parameters for a path; None: check only inputs.
    """
    known = cache(lambda path: _known(results, path))

    @cache
    def content(path):
        """Return the SHA-256 of an input; empty if the file does not exist."""
        with contextlib.suppress(FileNotFoundError):
            return known(path).sha256 or sha256_of(Path(results, path))
        return ""

    for path in paths:
        if not os.path.exists(os.path.join(results, path)):
            continue
        written = known(path)
        if not written.asked:
            yield path, "its record of settings and inputs is missing"
        elif asked is not None and asked(path) != written.asked:
            yield path, OTHER_SETTINGS
        else:
            others = [each for each, sha256 in written.inputs.items() if content(each) != sha256]
            if others:
                yield path, f"it was made from another version of {others[0]}"


def recorded_hash(results: str | os.PathLike, path: str) -> str:
    """Return the checksum of the job's parameters from the sidecar of a result; empty if unknown."""
    return _known(results, path).asked


def sha256_as_written(results: str | os.PathLike, path: str) -> str:
    """Return the SHA-256 of a result from its sidecar; without a sidecar, compute the SHA-256 from the content."""
    return _known(results, path).sha256 or sha256_of(Path(results, path))


def _known(results, path) -> Checksum:
    with contextlib.suppress(ValueError):
        return _read(results, path) or _BEGUN
    return _BEGUN


def with_sidecar(results: str | os.PathLike) -> Iterator[str]:
    """Yield the sorted paths of all results with a sidecar, even if the result is missing."""
    top = os.path.join(results, FOLDER)
    for folder, folders, names in os.walk(top):
        folders.sort()
        for name in sorted(names):
            if name.endswith(".json") and not name.startswith("."):
                yield os.path.relpath(os.path.join(folder, name.removesuffix(".json")), top)


def set_aside(results: str | os.PathLike, path: str) -> Path:
    """Rename a damaged result to `<name>.damaged`, `.damaged2` …, so that it is computed again; return the new path."""
    file = Path(results, path)
    names = (file.with_name(f"{file.name}.damaged{number}") for number in ("", *range(2, 10**6)))
    return file.rename(next(name for name in names if not name.exists()))


# Record of a result that a job has started to write. The empty SHA-256 differs from the SHA-256 of every file.
_BEGUN = Checksum("", 0, 0)


def _sidecar(results, path) -> str:
    return os.path.join(results, FOLDER, f"{path}.json")


def _read(results, path) -> Checksum | None:
    """Read the sidecar of a result; None if there is no sidecar; raise ValueError if the sidecar is not valid."""
    try:
        with open(_sidecar(results, path), "rb") as file:
            return Checksum(**json.loads(file.read()))
    except FileNotFoundError:
        return None
    except TypeError as error:
        raise ValueError(f"{_sidecar(results, path)}: not a checksum record: {error}") from None


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
    """Return the SHA-256 of a file, in hexadecimal form; for a folder, the SHA-256 of all paths and contents."""
    if not file.is_dir():
        with file.open("rb") as content:
            return hashlib.file_digest(content, "sha256").hexdigest()
    digest = hashlib.sha256()
    for each in _files_in(file):
        digest.update(f"{sha256_of(each)}  {each.relative_to(file).as_posix()}\n".encode())
    return digest.hexdigest()


def _files_in(folder: Path) -> list[Path]:
    """Return all files in a folder and its subfolders, sorted, without the timestamp files of Snakemake."""
    return sorted(each for each in folder.rglob("*") if each.is_file() and each.name != ".snakemake_timestamp")


def refuse_changed(file: str | os.PathLike, sha256: str, name: str | os.PathLike | None = None) -> None:
    """Raise an error if a file has changed; otherwise the results would be attributed to the old content.

    Parameters
    ----------
    file : path of the file.
    sha256 : expected checksum of the file.
    name : original name of a copied file, for the message.

    Raises
    ------
    ValueError
        If the checksum differs.
    """
    if sha256_of(Path(file)) != sha256:
        raise ValueError(f"{name or file} has changed since the campaign started; repeat the command")
