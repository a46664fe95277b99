"""The files of a deposit, folder or zip, by their paths in it; and whether they are what its checksums say."""

import hashlib
import os
import re
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath

CHECKSUMS = "SHA256SUMS"
# What is computed, and made again by a rerun; all the rest of a deposit says what it is and how.
COMPUTED = (
    *("dataset", "runs", "surfaces", "references", "aggregated", "figures"),
    *("report.html", "checks.json", "verdict.txt"),
)
_LINE = re.compile(r"([0-9a-f]{64})  (.+)")


def contents(path: str | os.PathLike) -> dict[str, int]:
    """Bytes of every file of a deposit that is whole, by its path in the deposit."""
    path = Path(path)
    if path.is_dir():
        return {name: (path / name).stat().st_size for name in files_of(path)}
    with zipfile.ZipFile(path) as archive:
        return {info.filename.split("/", 1)[1]: info.file_size for info in archive.infolist() if not info.is_dir()}


def read_file(deposit: str | os.PathLike, name: str) -> bytes:
    """The content of a file of a deposit that is whole, by its path in the deposit."""
    deposit = Path(deposit)
    if deposit.is_dir():
        return (deposit / name).read_bytes()
    with zipfile.ZipFile(deposit) as archive:
        top = archive.namelist()[0].split("/", 1)[0]
        return archive.read(f"{top}/{name}")


def files_of(folder: Path) -> list[str]:
    """Paths of all files below a folder, sorted."""
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir())


def verify_deposit(path: str | os.PathLike) -> list[str]:
    """What is wrong with a deposit, a line each: files that differ, are missing, or were added. Empty if it is whole.

    A deposit is its files, as for git and in the list of checksums: folders without any are of no account.

    Parameters
    ----------
    path : its folder or its zip.
    """
    path = Path(path)
    if path.is_dir():
        return _problems_of_folder(path)
    try:
        with zipfile.ZipFile(path) as archive:
            return _problems_of_zip(archive)
    except FileNotFoundError:
        return [f"{path.name}: no such file or folder"]
    except (zipfile.BadZipFile, ValueError, NotImplementedError, EOFError, OSError) as error:
        return [f"{path.name}: no readable zip archive: {error}"]


def _problems_of_folder(folder: Path) -> list[str]:
    links = [name for name in files_of(folder) if (folder / name).is_symlink() or not (folder / name).is_file()]
    if not (folder / CHECKSUMS).is_file():
        return [f"{CHECKSUMS}: is missing, so this is no whole deposit"]
    there = {name: folder / name for name in files_of(folder) if name not in links}
    return [
        *(f"{name}: is no file of its own" for name in links),
        *_problems(there, lambda name: there[name].open("rb"), set(links)),
    ]


def _problems_of_zip(archive: zipfile.ZipFile) -> list[str]:
    names = [info.filename for info in archive.infolist() if not info.is_dir()]
    tops = {name.split("/", 1)[0] for name in names}
    if len(tops) != 1 or any("/" not in name for name in names):
        return [f"holds {', '.join(sorted(tops)) or 'nothing'}; allowed: a single folder, the deposit"]
    twice = sorted({name for name in names if names.count(name) > 1}) if len(set(names)) < len(names) else []
    (top,) = tops
    there = {name.removeprefix(f"{top}/"): name for name in names}
    if CHECKSUMS not in there:
        return [f"{CHECKSUMS}: is missing, so this is no whole deposit"]
    return [
        *(f"{name}: is there more than once" for name in twice),
        *_problems(there, lambda name: archive.open(there[name])),
    ]


def _problems(there: Iterable[str], opened, others: Iterable[str] = ()) -> Iterator[str]:
    """What is wrong with files, of which `opened` gives the content, by the list of checksums among them."""
    try:
        with opened(CHECKSUMS) as file:
            lines = file.read().decode("utf-8").splitlines()
    except Exception as error:  # whatever a damaged archive may lead to
        yield f"{CHECKSUMS}: cannot be read: {error}"
        return
    expected: dict[str, str] = {}
    for number, line in enumerate(lines, 1):
        found = _LINE.fullmatch(line)
        if found is None or not _is_inside(found[2]):
            yield f"{CHECKSUMS}, line {number}: {line[:80]!r} is no checksum of a file in this folder"
        elif found[2] in expected:
            yield f"{CHECKSUMS}, line {number}: {found[2]} is named twice"
        else:
            expected[found[2]] = found[1]
    for name, digest in expected.items():
        if name not in there:
            if name not in others:
                yield f"{name}: is missing"
            continue
        try:
            with opened(name) as file:
                same = hashlib.file_digest(file, "sha256").hexdigest() == digest
        except Exception as error:
            yield f"{name}: cannot be read: {error}"
        else:
            if not same:
                yield f"{name}: is not what it was: its checksum is another one"
    for name in sorted(set(there) - set(expected) - {CHECKSUMS}):
        yield f"{name}: was added: it is not in {CHECKSUMS}"


def _is_inside(name: str) -> bool:
    path = PurePosixPath(name)
    return not path.is_absolute() and ".." not in path.parts and str(path) == name
