"""Folders and zips that strangers made: looked through before anything in them is read, and read within limits.

Whatever a name, a kind of file or a size may do to us ends here. `looked_through` gives the files, and all that is
wrong with them. Where nothing is, they lie in the deposit, are no links or devices, and have no more bytes than are
declared, and together no more than `LIMITS` allow for the size of the zip.
"""

import contextlib
import itertools
import os
import re
import shutil
import stat
import struct
import unicodedata
import zipfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import BinaryIO, NamedTuple

from icha.support import in_words
from icha.support.in_words import is_printable, printable

_BLOCK = 1 << 20
# What of a name most systems can have: of a part, of a path.
_LONGEST_PART, _LONGEST = 255, 1000
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED, _SIZES_AFTERWARDS, _UTF8 = 0x1, 0x8, 0x800
# Headers of a zip: of an entry, of the same in its list of contents, at its end, and there too if it is large (APPNOTE,
# section 4.3). An entry's sizes may come after it, in so many bytes.
_ENTRY = struct.Struct("<4s5H3L2H")
_LISTED, _END, _LARGE_END = 46, 22, 98
_AFTERWARDS = (12, 16, 20, 24)
# In the place of a size that takes more than 32 bits.
_IN_EXTRA = 0xFFFFFFFF
# Of what may follow a name there: another name, which some programs take (Info-ZIP Unicode Path).
_OTHER_NAME = 0x7075


class Limits(NamedTuple):
    """How many files there may be, and by how much a zip may unpack: so many times its size, and `allowance` bytes."""

    files: float
    ratio: float
    allowance: int


# Deposits of ICHA are stored, not compressed; who packs them again gains a factor of three or so.
LIMITS = Limits(files=200_000, ratio=50, allowance=100_000_000)
# What is asked for by `LARGE`, as options of commands are.
LARGE, NO_LIMITS = "--large", Limits(float("inf"), float("inf"), 0)


class Found(NamedTuple):
    """The files in a folder or zip, `path`: their sizes by their paths, what is wrong with them, how one is opened."""

    path: Path
    sizes: dict[str, int]
    flaws: list[str]
    open: Callable[[str], AbstractContextManager[BinaryIO]]


@contextlib.contextmanager
def looked_through(path: Path, limits: Limits = LIMITS) -> Iterator[Found]:
    """The files of a folder, or of a zip with a single folder in it, whose name is no part of their paths.

    Raises
    ------
    OSError, ValueError, zipfile.BadZipFile
        If it cannot be read at all.
    """
    if path.is_dir():
        yield _in_folder(path, limits)
        return
    if not path.is_file():
        raise ValueError("is neither a folder nor a file")
    with zipfile.ZipFile(path) as archive:
        yield _in_zip(path, archive, limits)


def flaw_of_name(name: str) -> str:
    """Why a path is not one in a deposit, which leads to the same place on Linux, macOS and in zips; empty if it is."""
    parts = name.split("/")
    if name.startswith("/") or re.match("[A-Za-z]:", name):
        return "is an absolute path"
    if any(part in ("", ".", "..") for part in parts):
        return "leads elsewhere, or nowhere"
    if "\\" in name:
        return "has a backslash, which separates folders elsewhere"
    if not is_printable(name):
        return "has characters that cannot be seen"
    if len(name.encode()) > _LONGEST or max(len(part.encode()) for part in parts) > _LONGEST_PART:
        return "is too long"
    return ""


def _in_folder(folder: Path, limits: Limits) -> Found:
    sizes: dict[str, int] = {}
    flaws: list[str] = []
    for name, status in _walk(folder):
        if not stat.S_ISREG(status.st_mode):
            flaws.append(f"{printable(name)}: is no file of its own")
        elif flaw := _flaw_of_mode(status.st_mode):
            flaws.append(f"{printable(name)}: {flaw}")
        else:
            sizes[name] = status.st_size
        if len(sizes) + len(flaws) > limits.files:
            return Found(folder, {}, [_too_many(f"more than {limits.files:,}", limits)], _nothing)
    flaws += [f"{printable(name)}: the name {flaw}" for name in sizes if (flaw := flaw_of_name(name))]
    sizes = dict(sorted(sizes.items()))
    return Found(folder, sizes, [*sorted(flaws), *_clashes(sizes)], lambda name: (folder / name).open("rb"))


def _walk(folder: Path) -> Iterator[tuple[str, os.stat_result]]:
    """Paths below a folder of all that is no folder; links are not followed."""
    pending = [""]
    while pending:
        inside = pending.pop()
        for entry in os.scandir(folder / inside):
            if entry.is_dir(follow_symlinks=False):
                pending.append(f"{inside}{entry.name}/")
            else:
                yield f"{inside}{entry.name}", entry.stat(follow_symlinks=False)


def _in_zip(path: Path, archive: zipfile.ZipFile, limits: Limits) -> Found:
    entries, nothing = archive.infolist(), Found(path, {}, [], _nothing)
    if len(entries) > limits.files:
        return nothing._replace(flaws=[_too_many(f"{len(entries):,}", limits)])
    flaws = [f"{printable(entry.orig_filename)}: {flaw}" for entry in entries if (flaw := _flaw_of_entry(entry))]
    if flaws:
        return nothing._replace(flaws=flaws)
    tops = {entry.filename.partition("/")[0] for entry in entries}
    files = [entry for entry in entries if not entry.is_dir()]
    if len(tops) != 1 or any("/" not in entry.filename for entry in files):
        held = [printable(top) for top in sorted(tops)[:5]] + ["…"] * (len(tops) > 5)
        return nothing._replace(flaws=[f"holds {', '.join(held) or 'nothing'}; allowed: a single folder, the deposit"])
    there: dict[str, zipfile.ZipInfo] = {}
    for entry in files:
        name = entry.filename.partition("/")[2]
        if name in there:
            flaws.append(f"{name}: is there more than once")
        there[name] = entry
    size = path.stat().st_size
    if flaw := _flaw_of_layout(archive, entries, size) or _flaw_of_size(entries, size, limits):
        return nothing._replace(flaws=[*flaws, flaw])
    sizes = {name: entry.file_size for name, entry in there.items()}
    return Found(path, sizes, [*flaws, *_clashes(sizes)], lambda name: archive.open(there[name]))


def _flaw_of_entry(entry: zipfile.ZipInfo) -> str:
    for name in (entry.orig_filename, entry.filename):
        if flaw := flaw_of_name(name.removesuffix("/")):
            return f"the name {flaw}"
    if _has_other_name(entry.extra):
        return _OTHER
    # Whatever system it says that it is of: programs that unpack do not agree on which of them have modes.
    mode = entry.external_attr >> 16
    kind = stat.S_IFDIR if entry.is_dir() else stat.S_IFREG
    if entry.is_dir() and (entry.file_size or entry.compress_size):
        return "is a folder, and has content"
    if stat.S_IFMT(mode) not in (0, kind):
        return "is a link, a device or something else that is no file"
    if flaw := _flaw_of_mode(mode):
        return flaw
    if entry.flag_bits & _ENCRYPTED or entry.compress_type not in _METHODS:
        return "is encrypted, or compressed by another method than deflate"
    return ""


def _flaw_of_mode(mode: int) -> str:
    if mode & (stat.S_ISUID | stat.S_ISGID | stat.S_ISVTX):
        return f"has the mode {stat.S_IMODE(mode):04o}; allowed: no special bits"
    return ""


def _has_other_name(extra: bytes) -> bool:
    """Whether what follows a name in a header has another one."""
    while len(extra) >= 4:
        kind, length = struct.unpack_from("<HH", extra)
        if kind == _OTHER_NAME:
            return True
        extra = extra[4 + length :]
    return False


def _flaw_of_layout(archive: zipfile.ZipFile, entries: list[zipfile.ZipInfo], size: int) -> str:
    """Why a zip of so many bytes is read differently by different programs; empty if it is not.

    One that follows the list of contents and one that reads from the beginning must find the same entries: these lie
    one after another, are called the same in both places, and there is nothing else.
    """
    raw, end, before = archive.fp, 0, None
    for entry in sorted(entries, key=lambda entry: entry.header_offset):
        name = printable(entry.orig_filename)
        if entry.header_offset < end:
            return f"{name}: its files overlap: some bytes of it belong to two of them"
        if not _is_next(entry.header_offset - end, before):
            return _more_before(name)
        raw.seek(entry.header_offset)
        header = raw.read(_ENTRY.size)
        if len(header) < _ENTRY.size or not header.startswith(zipfile.stringFileHeader):
            return f"{name}: is not where the zip's list of contents says"
        _, _, flags, method, _, _, _, packed, _, named, more = _ENTRY.unpack(header)
        if raw.read(named) != _encoded(entry):
            return f"{name}: has another name in the zip's list of contents than before its content"
        sizes = (entry.compress_size, _IN_EXTRA, *[0] * bool(flags & _SIZES_AFTERWARDS))
        if method != entry.compress_type or packed not in sizes:
            return f"{name}: has another size or method in the zip's list of contents than before its content"
        if _has_other_name(raw.read(more)):
            return f"{name}: {_OTHER}"
        end, before = entry.header_offset + _ENTRY.size + named + more + entry.compress_size, entry
    if archive.start_dir < end:
        return f"its files take {in_words.size(end)}, and the zip has {in_words.size(archive.start_dir)} for them"
    if not _is_next(archive.start_dir - end, before):
        return _more_before("its list of contents")
    listed = sum(_LISTED + len(_encoded(entry)) + len(entry.extra) + len(entry.comment) for entry in entries)
    if size - archive.start_dir - listed not in (_END, _LARGE_END):
        return "has bytes beside its files and their list, such as a comment; allowed: none"
    return ""


_OTHER = "has a second name, which some programs use in the place of the first"


def _encoded(entry: zipfile.ZipInfo) -> bytes:
    """The name of an entry as it stands in a zip."""
    return entry.orig_filename.encode("utf-8" if entry.flag_bits & _UTF8 else "cp437")


def _is_next(gap: int, before: zipfile.ZipInfo | None) -> bool:
    """Whether nothing but an entry's sizes, if they come after it, lies in the bytes between it and what is next."""
    return gap == 0 or bool(before and before.flag_bits & _SIZES_AFTERWARDS and gap in _AFTERWARDS)


def _more_before(name: str) -> str:
    return f"{name}: before it the zip has bytes that belong to no file"


def _flaw_of_size(entries: list[zipfile.ZipInfo], size: int, limits: Limits) -> str:
    """Whether a zip of so many bytes unpacks to too much; empty if it does not."""
    unpacked, most = sum(entry.file_size for entry in entries), limits.ratio * size + limits.allowance
    if unpacked > most:
        return (
            f"unpacks from {in_words.size(size)} to {in_words.size(unpacked)}; allowed: {limits.ratio} times its size "
            f"and {in_words.size(limits.allowance)}, or more with {LARGE}"
        )
    return ""


def _clashes(names) -> list[str]:
    """Paths that are the same on systems that know no upper and lower case, and files that are folders of others."""
    found, seen = [], {}
    for name in names:
        folded = unicodedata.normalize("NFC", name).casefold()
        if folded in seen:
            found.append(f"{printable(name)}: is {printable(seen[folded])} on some systems")
        seen[folded] = name
    # What lies in a folder comes right after its name, so that names have not to be held against all others.
    ordered = sorted(seen, key=lambda folded: folded.replace("/", "\0"))
    found += [
        f"{printable(seen[above])}: is a file, and the folder of {printable(seen[name])}"
        for above, name in itertools.pairwise(ordered)
        if name.startswith(f"{above}/")
    ]
    return found


def _too_many(count: str, limits: Limits) -> str:
    return f"holds {count} files; allowed: {limits.files:,}, or more with {LARGE}"


def _nothing(name: str):
    raise KeyError(name)


def blocks(found: Found, name: str) -> Iterator[bytes]:
    """The content of a file; ValueError if it is not as long as was declared."""
    left = found.sizes[name]
    with found.open(name) as file:
        while block := file.read(min(_BLOCK, left + 1)):
            left -= len(block)
            if left < 0:
                break
            yield block
    if left:
        raise ValueError(f"has not the {found.sizes[name]:,} bytes that are declared")


def unpack(found: Found, folder: Path) -> None:
    """Write the files into a new or empty folder; OSError if they do not fit there."""
    needed, free = sum(found.sizes.values()), shutil.disk_usage(folder).free
    if needed > free:
        raise OSError(f"{folder}: {in_words.size(needed)} are needed, and {in_words.size(free)} are free")
    for name in found.sizes:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        with (folder / name).open("xb") as file:
            file.writelines(blocks(found, name))
