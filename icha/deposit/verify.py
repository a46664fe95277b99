"""Verify deposits of unknown origin.

A zip is extracted into an empty folder, if its extracted size is within limits. Names and kinds of all files in the
folder are inspected before a file is read. Then every file is compared with its checksum in `SHA256SUMS`. No program in
a deposit is executed.
"""

import contextlib
import os
import re
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

from icha.support import formatting
from icha.support.checksums import CHECKSUMS, sha256_of
from icha.support.formatting import printable

# Files that describe a deposit: for readers, as an RO-Crate, and for Zenodo.
README, CRATE, ZENODO = "README.md", "ro-crate-metadata.json", ".zenodo.json"
# Folder of the program's source in a deposit.
SOURCE = "source"
# Folders and files of results that `icha reproduce` computes again.
COMPUTED = (
    *("dataset", "runs", "surfaces", "references", "aggregated", "figures"),
    *("report.html", "checks.json", "verdict.txt"),
)
# Largest size in bytes of a file that is read as a whole, such as the list of checksums.
LARGEST_TEXT = 64_000_000
# The extracted size of a zip is at most ALLOWANCE bytes plus MOST_GROWTH times the size of the zip. ICHA does not
# compress zips; compression would save two thirds.
MOST_GROWTH, ALLOWANCE = 50, 100_000_000
_LINE = re.compile(r"([0-9a-f]{64})  (.+)")


class DamagedDeposit(ValueError):
    """A deposit is damaged or incomplete; the arguments of the error are the problems, one line each."""


@contextlib.contextmanager
def whole_deposit(path: str | os.PathLike) -> Iterator[Path]:
    """Verify a deposit, a folder or a zip, and yield its folder; a zip is extracted into a temporary folder.

    Raise `DamagedDeposit` if files differ from their checksums, are missing or were added, or if the deposit cannot be
    read safely; raise OSError if a zip cannot be extracted, for instance because the disk is full. Empty folders are
    ignored.
    """
    folder = Path(path)
    with contextlib.ExitStack() as opened:
        if not folder.is_dir():
            temporary = opened.enter_context(tempfile.TemporaryDirectory(prefix="icha-deposit-"))
            folder = _extract(folder, Path(temporary))
        if problems := list(_problems(folder)):
            raise DamagedDeposit(*problems)
        yield folder


def files_of(folder: Path) -> list[str]:
    """Return the sorted paths of all files in a folder and its subfolders, relative to the folder."""
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir())


def read_text(folder: Path, name: str) -> str:
    """Read a text file of a deposit; raise ValueError if it has more than `LARGEST_TEXT` bytes, or is not UTF-8."""
    size = (folder / name).stat().st_size
    if size > LARGEST_TEXT:
        raise ValueError(f"{name}: has {formatting.size(size)}; expected at most {formatting.size(LARGEST_TEXT)}")
    return (folder / name).read_text(encoding="utf-8")


def problem_with_name(name: str) -> str:
    """Return the reason why a deposit must not contain a file of this name; "" if every system accepts the name."""
    if name.startswith("/") or re.match("[A-Za-z]:", name):
        return "is an absolute path"
    if any(each in ("", ".", "..") for each in name.split("/")):
        return "leads out of its folder, or to no file"
    if "\\" in name:
        return "has a backslash, which separates folders on other systems"
    return "has invisible characters" if printable(name) != name else ""


def _extract(path: Path, folder: Path) -> Path:
    """Extract a zip into an empty folder and return the single folder that the zip contains.

    Python's zipfile is safe: it removes `..` and roots from names, extracts links as plain files, and reads no more
    bytes of a file than the zip declares.
    """
    name = printable(path.name)
    if not path.is_file():
        raise DamagedDeposit(f"{name}: is neither a folder nor a file")
    try:
        with zipfile.ZipFile(path) as archive:
            packed, free = path.stat().st_size, shutil.disk_usage(folder).free
            unpacked = sum(entry.file_size for entry in archive.infolist())
            if unpacked > MOST_GROWTH * packed + ALLOWANCE:
                raise DamagedDeposit(
                    f"{name}: unpacks from {formatting.size(packed)} to {formatting.size(unpacked)}; expected at "
                    f"most {MOST_GROWTH} times its size plus {formatting.size(ALLOWANCE)}. If you trust the zip, "
                    "unpack it yourself and give the folder"
                )
            if unpacked > free:
                raise OSError(
                    f"{folder.parent}: {name} needs {formatting.size(unpacked)}, but only {formatting.size(free)} "
                    "are free. Set TMPDIR to a folder with more space"
                )
            archive.extractall(folder)
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, zlib.error) as error:
        # The zip is damaged, encrypted, or compressed by an unknown method.
        raise DamagedDeposit(f"{name}: not a readable zip archive: {printable(error)}") from None
    found = sorted(os.listdir(folder))
    if len(found) != 1 or not (folder / found[0]).is_dir():
        shown = printable(", ".join(found[:5]) or "nothing")
        raise DamagedDeposit(f"{name}: contains {shown}; expected a single folder")
    return folder / found[0]


def _problems(folder: Path) -> Iterator[str]:
    """Yield the differences between the files in a folder and the folder's list of checksums; do not follow links."""
    paths = {path.relative_to(folder).as_posix(): path for path in sorted(folder.rglob("*"))}
    special = {name for name, path in paths.items() if path.is_symlink() or not (path.is_file() or path.is_dir())}
    names = [name for name, path in paths.items() if name not in special and path.is_file()]
    unsafe = {name: problem for name in names if (problem := problem_with_name(name))}
    yield from (f"{printable(name)}: is a link, a device or another special file" for name in sorted(special))
    yield from (f"{printable(name)}: the name {problem}" for name, problem in unsafe.items())
    found = set(names) - set(unsafe)
    if CHECKSUMS not in found:
        yield f"{CHECKSUMS}: is missing, so this is not a complete deposit"
        return
    try:
        lines = read_text(folder, CHECKSUMS).splitlines()
    except (OSError, ValueError) as error:
        yield f"{CHECKSUMS}: cannot be read: {printable(error)}"
        return
    expected: dict[str, str] = {}
    for number, line in enumerate(lines, 1):
        listed = _LINE.fullmatch(line)
        if listed is None or problem_with_name(listed[2]):
            yield f"{CHECKSUMS}, line {number}: {line[:80]!r} is not a checksum of a file in this folder"
        elif listed[2] in expected:
            yield f"{CHECKSUMS}, line {number}: {listed[2]} is listed twice"
        else:
            expected[listed[2]] = listed[1]
    for name, digest in expected.items():
        if name not in found:
            if name not in special:
                yield f"{name}: is missing"
        elif sha256_of(folder / name) != digest:
            yield f"{name}: was changed: its checksum differs"
    for name in sorted(found - set(expected) - {CHECKSUMS}):
        yield f"{printable(name)}: was added: it is not in {CHECKSUMS}"
