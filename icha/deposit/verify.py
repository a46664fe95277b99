"""Verify deposits of unknown origin.

A zip is extracted into an empty folder, if its size and number of files are within limits. Names and kinds of all files
in the folder are inspected before a file is read. Then every file is compared with its checksum in `SHA256SUMS`. No
program in a deposit is executed.
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
from icha.support.checksums import sha256_of
from icha.support.formatting import printable

CHECKSUMS = "SHA256SUMS"
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
# Largest lengths in bytes of a name and of a path that common file systems accept.
_LONGEST_NAME, _LONGEST_PATH = 255, 1000
# Limits without the option `LARGE`: a zip has at most MOST_FILES files, and its extracted size is at most ALLOWANCE
# bytes plus MOST_GROWTH times the zip size. ICHA does not compress zips; compression would save two thirds.
MOST_FILES, MOST_GROWTH, ALLOWANCE = 200_000, 50, 100_000_000
LARGE = "--large"
_LINE = re.compile(r"([0-9a-f]{64})  (.+)")
_BLOCK = 1 << 20


class DamagedDeposit(ValueError):
    """A deposit is damaged or incomplete; the arguments of the error are the problems, one line each."""


@contextlib.contextmanager
def whole_deposit(path: str | os.PathLike, *, large: bool = False) -> Iterator[Path]:
    """Verify a deposit and yield its folder; a zip is extracted into a temporary folder.

    Empty folders are ignored.

    Parameters
    ----------
    path : folder or zip of the deposit.
    large : True to accept a deposit that exceeds `MOST_FILES`, `MOST_GROWTH` and `ALLOWANCE`.

    Raises
    ------
    DamagedDeposit
        If files differ from their checksums, are missing or were added, or if the deposit cannot be read safely.
    OSError
        If a zip cannot be extracted, for instance because the disk is full.
    """
    path = Path(path)
    with contextlib.ExitStack() as opened:
        folder = path
        if not path.is_dir():
            empty = Path(opened.enter_context(tempfile.TemporaryDirectory(prefix="icha-deposit-")))
            folder = _extract(path, empty, large)
        if problems := list(_problems(folder, large)):
            raise DamagedDeposit(*problems)
        yield folder


def files_of(folder: Path) -> list[str]:
    """Return the sorted paths of all files in a folder and its subfolders, relative to the folder."""
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir())


def read_text(folder: Path, name: str) -> str:
    """Read a text file of a deposit.

    Raises
    ------
    ValueError
        If the file has more than `LARGEST_TEXT` bytes, or is not UTF-8.
    """
    size = (folder / name).stat().st_size
    if size > LARGEST_TEXT:
        raise ValueError(f"{name}: has {formatting.size(size)}; expected at most {formatting.size(LARGEST_TEXT)}")
    return (folder / name).read_text(encoding="utf-8")


def problem_with_name(name: str) -> str:
    """Return the reason why a deposit must not contain a file of this name; "" if every system accepts the name."""
    names = name.split("/")
    if name.startswith("/") or re.match("[A-Za-z]:", name):
        return "is an absolute path"
    if any(each in ("", ".", "..") for each in names):
        return "leads out of its folder, or to no file"
    if "\\" in name:
        return "has a backslash, which separates folders on other systems"
    if printable(name) != name:
        return "has invisible characters"
    if len(name.encode()) > _LONGEST_PATH or max(len(each.encode()) for each in names) > _LONGEST_NAME:
        return "is too long"
    return ""


def _extract(path: Path, folder: Path, large: bool) -> Path:
    """Extract a zip into an empty folder and return the single folder that the zip contains.

    Python's zipfile is safe: it removes `..` and roots from names, extracts links as plain files, and reads no more
    bytes of a file than the zip declares.
    """
    name = printable(path.name)
    if not path.is_file():
        raise DamagedDeposit(f"{name}: is neither a folder nor a file")
    try:
        with zipfile.ZipFile(path) as archive:
            entries, packed = archive.infolist(), path.stat().st_size
            unpacked, free = sum(entry.file_size for entry in entries), shutil.disk_usage(folder).free
            if len(entries) > MOST_FILES and not large:
                raise DamagedDeposit(_too_many(len(entries)))
            if unpacked > MOST_GROWTH * packed + ALLOWANCE and not large:
                raise DamagedDeposit(
                    f"{name}: unpacks from {formatting.size(packed)} to {formatting.size(unpacked)}; expected at "
                    f"most {MOST_GROWTH} times its size plus {formatting.size(ALLOWANCE)}. Use {LARGE} to accept more"
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
        raise DamagedDeposit(
            f"{name}: contains {printable(', '.join(found[:5]) or 'nothing')}; expected a single folder"
        )
    return folder / found[0]


def _too_many(count: int) -> str:
    return f"contains {count:,} files or more; expected at most {MOST_FILES:,}. Use {LARGE} to accept more"


def _problems(folder: Path, large: bool) -> Iterator[str]:
    """Yield the differences between the files in a folder and the folder's list of checksums."""
    found, special = _inspect(folder, large)
    yield from (f"{printable(name)}: {problem}" for name, problem in special.items())
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


def _inspect(folder: Path, large: bool) -> tuple[set[str], dict[str, str]]:
    """Return the acceptable files in a folder, and the problems with all other files; do not follow links."""
    found: set[str] = set()
    problems: dict[str, str] = {}
    pending = [""]
    while pending:
        parent = pending.pop()
        for entry in os.scandir(folder / parent):
            name = f"{parent}{entry.name}"
            if entry.is_dir(follow_symlinks=False):
                pending.append(f"{name}/")
            elif not entry.is_file(follow_symlinks=False):
                problems[name] = "is a link, a device or another special file"
            elif problem := problem_with_name(name):
                problems[name] = f"the name {problem}"
            else:
                found.add(name)
            if len(found) + len(problems) > MOST_FILES and not large:
                raise DamagedDeposit(_too_many(len(found) + len(problems)))
    return found, dict(sorted(problems.items()))
