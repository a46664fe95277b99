"""The files of a deposit, folder or zip, by their paths in it; and whether they are what its checksums say."""

import hashlib
import os
import re
import zipfile
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path

from icha.deposit.strangers_files import LIMITS, NO_LIMITS, Found, Limits, blocks, flaw_of_name, looked_through
from icha.support import in_words
from icha.support.in_words import printable

CHECKSUMS = "SHA256SUMS"
# What it says of itself: to readers, as an RO-Crate, to Zenodo.
README, CRATE, ZENODO = "README.md", "ro-crate-metadata.json", ".zenodo.json"
# The folder of the program.
SOURCE = "source"
# What is computed, and made again by a rerun; all the rest of a deposit says what it is and how.
COMPUTED = (
    *("dataset", "runs", "surfaces", "references", "aggregated", "figures"),
    *("report.html", "checks.json", "verdict.txt"),
)
# Bytes of a file that is read as a whole: a list of checksums, a configuration, metadata.
LARGEST_TEXT = 64_000_000
_LINE = re.compile(r"([0-9a-f]{64})  (.+)")


def whole_deposit(path: str | os.PathLike) -> AbstractContextManager[Found]:
    """The files of a deposit that `verify_deposit` has found to be whole."""
    return looked_through(Path(path), NO_LIMITS)


def read_file(found: Found, name: str) -> bytes:
    """The content of a text in a deposit, by its path there.

    Raises
    ------
    ValueError
        If it has more than `LARGEST_TEXT` bytes.
    """
    if found.sizes[name] > LARGEST_TEXT:
        raise ValueError(f"{name}: has {in_words.size(found.sizes[name])}; allowed: {in_words.size(LARGEST_TEXT)}")
    return b"".join(blocks(found, name))


def copy_file(found: Found, name: str, copy: Path) -> None:
    """Write a file of a deposit to another one, however large it is; its folder is made if need be."""
    copy.parent.mkdir(parents=True, exist_ok=True)
    with copy.open("wb") as file:
        file.writelines(blocks(found, name))


def files_of(folder: Path) -> list[str]:
    """Paths of all files below a folder, sorted."""
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir())


def verify_deposit(path: str | os.PathLike, limits: Limits = LIMITS) -> list[str]:
    """What is wrong with a deposit, a line each: files that differ, are missing, or were added. Empty if it is whole.

    A deposit is its files, as for git and in the list of checksums: folders without any are of no account. Nothing is
    read of one with names, kinds of files or sizes that a deposit does not have.

    Parameters
    ----------
    path : its folder or its zip.
    limits : how many files and bytes there may be.
    """
    path = Path(path)
    try:
        with looked_through(path, limits) as found:
            return list(_problems(found))
    except FileNotFoundError:
        return [f"{printable(path.name)}: no such file or folder"]
    except (zipfile.BadZipFile, ValueError, NotImplementedError, EOFError, OSError) as error:
        return [f"{printable(path.name)}: no readable folder or zip archive: {printable(error)}"]


def _problems(found: Found) -> Iterator[str]:
    """What is wrong with files, by themselves and by the list of checksums among them."""
    yield from found.flaws
    if CHECKSUMS not in found.sizes:
        # Where names are wrong, no list was looked for.
        if found.sizes or not found.flaws:
            yield f"{CHECKSUMS}: is missing, so this is no whole deposit"
        return
    try:
        lines = read_file(found, CHECKSUMS).decode("utf-8").splitlines()
    except Exception as error:  # whatever a damaged archive may lead to
        yield f"{CHECKSUMS}: cannot be read: {printable(error)}"
        return
    expected: dict[str, str] = {}
    for number, line in enumerate(lines, 1):
        listed = _LINE.fullmatch(line)
        if listed is None or flaw_of_name(listed[2]):
            yield f"{CHECKSUMS}, line {number}: {line[:80]!r} is no checksum of a file in this folder"
        elif listed[2] in expected:
            yield f"{CHECKSUMS}, line {number}: {listed[2]} is named twice"
        else:
            expected[listed[2]] = listed[1]
    yield from _differences(found, expected)


def _differences(found: Found, expected: dict[str, str]) -> Iterator[str]:
    """Files that are not what their checksums say, are missing, or were added."""
    flawed = {flaw.partition(": ")[0] for flaw in found.flaws}
    for name, digest in expected.items():
        if name not in found.sizes:
            if name not in flawed:
                yield f"{name}: is missing"
            continue
        made = hashlib.sha256()
        try:
            for block in blocks(found, name):
                made.update(block)
        except Exception as error:
            yield f"{name}: cannot be read: {printable(error)}"
        else:
            if made.hexdigest() != digest:
                yield f"{name}: is not what it was: its checksum is another one"
    for name in sorted(set(found.sizes) - set(expected) - {CHECKSUMS}):
        yield f"{printable(name)}: was added: it is not in {CHECKSUMS}"
