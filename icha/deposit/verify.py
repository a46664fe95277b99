"""Verify deposits, which anybody may have made: nothing is read before names, kinds and sizes have been inspected.

A zip is extracted into an empty folder, within `LIMITS`. Then every byte is compared with `SHA256SUMS`. Nothing in a
deposit is executed.
"""

import contextlib
import os
import re
import shutil
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from icha.support import in_words
from icha.support.checksums import sha256_of
from icha.support.printable import is_printable, printable

CHECKSUMS = "SHA256SUMS"
# Files by which a deposit describes itself: to readers, as an RO-Crate, to Zenodo.
README, CRATE, ZENODO = "README.md", "ro-crate-metadata.json", ".zenodo.json"
# Folder of the program's source.
SOURCE = "source"
# What is computed, and computed again by `icha reproduce`.
COMPUTED = (
    *("dataset", "runs", "surfaces", "references", "aggregated", "figures"),
    *("report.html", "checks.json", "verdict.txt"),
)
# Most bytes of a file that is read as a whole: the list of checksums, a configuration, metadata.
LARGEST_TEXT = 64_000_000
# Most bytes of a name that common file systems accept: of one part, of a path.
_LONGEST_PART, _LONGEST_PATH = 255, 1000
_LINE = re.compile(r"([0-9a-f]{64})  (.+)")
_BLOCK = 1 << 20


class Limits(NamedTuple):
    """Limits for a deposit from a stranger.

    Attributes
    ----------
    files : largest number of files.
    ratio : largest factor by which a zip may grow when it is extracted, beside `allowance`.
    allowance : bytes that a zip may have in any case when it is extracted.
    """

    files: float
    ratio: float
    allowance: int


# ICHA does not compress deposits; whoever compresses one again gains a factor of about three.
LIMITS = Limits(files=200_000, ratio=50, allowance=100_000_000)
# The option of the commands that lifts the limits.
LARGE, NO_LIMITS = "--large", Limits(float("inf"), float("inf"), 0)


class Damaged(ValueError):
    """A deposit that is not whole; the arguments are the problems, one line each."""


@contextlib.contextmanager
def whole_deposit(path: str | os.PathLike, limits: Limits = LIMITS) -> Iterator[Path]:
    """Verify a deposit and provide its folder; a zip is extracted into a temporary one.

    Raises
    ------
    Damaged
        If files differ from their checksums, are missing or were added, or if the deposit cannot be read safely.
    OSError
        If there is no room to extract the zip.
    """
    path = Path(path)
    with contextlib.ExitStack() as opened:
        folder = path
        if not path.is_dir():
            folder = Path(opened.enter_context(tempfile.TemporaryDirectory(prefix="icha-deposit-")))
            _extract(path, folder, limits)
        if problems := list(_problems(folder, limits)):
            raise Damaged(*problems)
        yield folder


def verify_deposit(path: str | os.PathLike, limits: Limits = LIMITS) -> list[str]:
    """List what is wrong with a deposit, a folder or a zip, one line each; the list is empty if it is whole.

    Folders without files do not count, as in git and in the list of checksums.
    """
    try:
        with whole_deposit(path, limits):
            return []
    except Damaged as damaged:
        return list(damaged.args)


def files_of(folder: Path) -> list[str]:
    """Paths of all files below a folder, sorted."""
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir())


def read_text(folder: Path, name: str) -> str:
    """Read a text file of a deposit.

    Raises
    ------
    ValueError
        If it has more than `LARGEST_TEXT` bytes, or is not UTF-8.
    """
    size = (folder / name).stat().st_size
    if size > LARGEST_TEXT:
        raise ValueError(f"{name}: has {in_words.size(size)}; allowed: {in_words.size(LARGEST_TEXT)}")
    return (folder / name).read_text(encoding="utf-8")


def problem_with_name(name: str) -> str:
    """Explain why a path must not be in a deposit; empty if it leads to the same place on every system."""
    parts = name.split("/")
    if name.startswith("/") or re.match("[A-Za-z]:", name):
        return "is an absolute path"
    if any(part in ("", ".", "..") for part in parts):
        return "leads elsewhere, or nowhere"
    if "\\" in name:
        return "has a backslash, which separates folders on other systems"
    if not is_printable(name):
        return "has invisible characters"
    if len(name.encode()) > _LONGEST_PATH or max(len(part.encode()) for part in parts) > _LONGEST_PART:
        return "is too long"
    return ""


def _extract(path: Path, folder: Path, limits: Limits) -> None:
    """Extract a zip that has a single folder into an empty folder; links and devices cannot arise."""
    if not path.is_file():
        raise Damaged(f"{printable(path.name)}: is neither a folder nor a file")
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
            if problems := _problems_with_entries(entries, path.stat().st_size, limits):
                raise Damaged(*problems)
            needed, free = sum(entry.file_size for entry in entries), shutil.disk_usage(folder).free
            if needed > free:
                raise OSError(
                    f"{folder.parent}: {in_words.size(needed)} are needed to extract {path.name}, and "
                    f"{in_words.size(free)} are free; set TMPDIR to a folder with more room"
                )
            for entry in entries:
                if not entry.is_dir():
                    file = folder / entry.filename.partition("/")[2]
                    file.parent.mkdir(parents=True, exist_ok=True)
                    with archive.open(entry) as content, file.open("xb") as copy:
                        shutil.copyfileobj(content, copy, _BLOCK)
    except FileExistsError as error:
        # The same name twice, or a file that is also the folder of another one.
        raise Damaged(f"{printable(Path(error.filename).relative_to(folder))}: is there more than once") from None
    except (zipfile.BadZipFile, NotADirectoryError, IsADirectoryError) as error:
        raise Damaged(f"{printable(path.name)}: not a readable zip archive: {printable(error)}") from None
    except (NotImplementedError, RuntimeError, EOFError, zlib.error) as error:  # encrypted, unknown method, cut off
        raise Damaged(f"{printable(path.name)}: cannot be extracted: {printable(error)}") from None


def _problems_with_entries(entries: list[zipfile.ZipInfo], size: int, limits: Limits) -> list[str]:
    """List what is wrong with the contents of a zip of `size` bytes, by its list of contents alone."""
    if len(entries) > limits.files:
        return [_too_many(f"{len(entries):,}", limits)]
    problems = []
    for entry in entries:
        names = (entry.orig_filename, entry.filename)
        if problem := next(filter(None, (problem_with_name(name.removesuffix("/")) for name in names)), ""):
            problems.append(f"{printable(entry.orig_filename)}: the name {problem}")
        elif stat.S_IFMT(entry.external_attr >> 16) not in (0, stat.S_IFREG, stat.S_IFDIR):
            problems.append(f"{printable(entry.filename)}: is a link, a device or another special file")
    tops = sorted({entry.filename.partition("/")[0] for entry in entries})
    if len(tops) != 1 or any("/" not in entry.filename for entry in entries):
        held = ", ".join([printable(top) for top in tops[:5]] + ["…"] * (len(tops) > 5))
        problems.append(f"holds {held or 'nothing'}; allowed: a single folder, the deposit")
    unpacked = sum(entry.file_size for entry in entries)
    if unpacked > limits.ratio * size + limits.allowance:
        problems.append(
            f"unpacks from {in_words.size(size)} to {in_words.size(unpacked)}; allowed: {limits.ratio} times its size "
            f"and {in_words.size(limits.allowance)}, or more with {LARGE}"
        )
    return problems


def _too_many(count: str, limits: Limits) -> str:
    return f"holds {count} files; allowed: {limits.files:,}, or more with {LARGE}"


def _problems(folder: Path, limits: Limits) -> Iterator[str]:
    """Compare the files in a folder with its list of checksums."""
    found, special = _inspect(folder, limits)
    yield from (f"{printable(name)}: {problem}" for name, problem in special.items())
    if CHECKSUMS not in found:
        yield f"{CHECKSUMS}: is missing, so this is no whole deposit"
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
            yield f"{CHECKSUMS}, line {number}: {line[:80]!r} is no checksum of a file in this folder"
        elif listed[2] in expected:
            yield f"{CHECKSUMS}, line {number}: {listed[2]} is named twice"
        else:
            expected[listed[2]] = listed[1]
    for name, digest in expected.items():
        if name not in found:
            if name not in special:
                yield f"{name}: is missing"
        elif sha256_of(folder / name) != digest:
            yield f"{name}: was changed: its checksum is another one"
    for name in sorted(found - set(expected) - {CHECKSUMS}):
        yield f"{printable(name)}: was added: it is not in {CHECKSUMS}"


def _inspect(folder: Path, limits: Limits) -> tuple[set[str], dict[str, str]]:
    """List the files below a folder, and what is wrong with names and kinds of others; links are not followed."""
    found: set[str] = set()
    problems: dict[str, str] = {}
    pending = [""]
    while pending:
        inside = pending.pop()
        for entry in os.scandir(folder / inside):
            name = f"{inside}{entry.name}"
            if entry.is_dir(follow_symlinks=False):
                pending.append(f"{name}/")
            elif not entry.is_file(follow_symlinks=False):
                problems[name] = "is a link, a device or another special file"
            elif problem := problem_with_name(name):
                problems[name] = f"the name {problem}"
            else:
                found.add(name)
            if len(found) + len(problems) > limits.files:
                raise Damaged(_too_many(f"more than {limits.files:,}", limits))
    return found, dict(sorted(problems.items()))
