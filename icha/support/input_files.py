"""Files that others made, as input: which are opened at all, how much memory reading one may take, HDF5 traps, tables.

A small file can declare, or unpack to, any size. Readers hold declared sizes against the limit (`require_room`) and
read within it (`bounded_memory`), whatever library does the reading.
"""

import csv
import math
import os
import re
import stat
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from icha.support import formatting

# Environment variable with the limit in MB, and the limit without it.
VARIABLE = "ICHA_INPUT_MB"
_USUAL_MB = 2000
# Arrays of the size of a file that reading it may take.
_COPIES = 3
# Names in an HDF5 file, and groups in one another: to go through more takes minutes.
_MOST_NAMES, _DEEPEST = 100_000, 50
_WHOLE = "allowed: files that hold all of their data"

_KINDS = {
    stat.S_IFDIR: "is a folder",
    stat.S_IFIFO: "is a pipe",
    stat.S_IFCHR: "is a device",
    stat.S_IFBLK: "is a device",
    stat.S_IFSOCK: "is a socket",
}


class RefusedFile(ValueError):
    """A file that is not read, for it might do harm; the message says why, and what is allowed."""


class TooLarge(RefusedFile):
    """A file that would take more memory than reading one may; the message says how to allow more."""

    def __init__(self, needed: str, most: int):
        """Say what is `needed`, that `most` bytes are allowed, and what allows more."""
        super().__init__(
            f"needs {needed} of memory; allowed: {formatting.size(most)}, or what the environment variable {VARIABLE} "
            f"says, in MB"
        )


def problem_with_path(path: str | os.PathLike) -> str | None:
    """What keeps a path from being opened as a file, None if nothing does; pipes and devices might never end."""
    try:
        kind = stat.S_IFMT(os.stat(path).st_mode)
    except (FileNotFoundError, NotADirectoryError, ValueError):  # the last one for zero bytes in a path
        return "no such file"
    except OSError as error:
        return f"cannot be read ({error.strerror})"
    return _KINDS.get(kind)


def most_memory(file: str | os.PathLike | None = None) -> int:
    """Bytes of memory that reading a file may take.

    Parameters
    ----------
    file : which one, if no environment variable sets the limit: one that is large itself may take what it needs.

    Raises
    ------
    ValueError
        If the environment variable is no number.
    """
    asked = os.environ.get(VARIABLE)
    if asked is None:
        # Of a file with holes only what is on the disk; 512 is the unit of st_blocks everywhere.
        own = 0 if file is None else _COPIES * 512 * os.stat(file).st_blocks
        return max(_USUAL_MB * 10**6, own)
    if not re.fullmatch(r"[0-9]{1,9}", asked):
        raise ValueError(f"{VARIABLE}: {asked!r} is not a number of MB")
    return int(asked) * 10**6


def require_room(needed: float, most: int | None = None) -> None:
    """Raise `TooLarge` if reading needs more bytes of memory than it may take: `most`, or those of any file."""
    most = most_memory() if most is None else most
    if needed > most:
        raise TooLarge(f"about {formatting.size(needed)}", most)


@contextmanager
def bounded_memory(most: int | None = None) -> Iterator[None]:
    """Let a block allocate no more than `most` bytes, those of any file if left out, whatever libraries it calls.

    More is `TooLarge`.
    Libraries in C may have errors of their own for memory that they do not get. Only Linux can bound memory so;
    elsewhere nothing but declared sizes is checked.
    """
    most, taken = most_memory() if most is None else most, _taken()
    if taken is None:
        yield
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    bounds = [bound for bound in (taken + most, soft, hard) if bound != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_DATA, (min(bounds), hard))
    try:
        yield
    except MemoryError:
        raise TooLarge(f"more than {formatting.size(most)}", most) from None
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def _taken() -> int | None:
    """Bytes of data of this process, None where they cannot be bounded."""
    if sys.platform != "linux":
        return None
    import psutil

    return psutil.Process().memory_info().data


def text(attribute: bytes | str | Iterable[bytes | str]) -> str:
    """A text, however the library that wrote it keeps texts; that of netCDF puts those beyond ASCII into arrays."""
    if not isinstance(attribute, bytes | str):
        (attribute,) = attribute
    return attribute.decode() if isinstance(attribute, bytes) else str(attribute)


def refuse_traps(path: str | os.PathLike) -> None:
    """Refuse a file whose names lead elsewhere or in circles, or are too many; what is no HDF5 file passes.

    Names and data that lie in other files could be any of this machine. Groups that are reached in two ways may lie in
    one another: the library of netCDF is torn apart by them. Links to data of the same file stay.

    Raises
    ------
    RefusedFile
        Naming the link, group or dataset.
    OSError
        If the file is damaged.
    """
    import h5py

    if not h5py.is_hdf5(path):
        return
    with h5py.File(path, "r") as file:
        groups, count = {h5py.h5o.get_info(file.id).addr}, 0

        def trap(name, link):
            """What ends the visit, and is given by it."""
            nonlocal count
            count += 1
            if count > _MOST_NAMES or name.count(b"/") >= _DEEPEST:
                return f"it has more than {_MOST_NAMES:,} names, or {_DEEPEST} groups in one another; allowed: fewer"
            if link.type == h5py.h5l.TYPE_EXTERNAL:
                return f"{_shown(name)} is a link to another file; {_WHOLE}"
            try:
                node = h5py.h5o.open(file.id, name)
            except (KeyError, RuntimeError, SystemError):  # a link to nothing, or to itself
                return None
            if isinstance(node, h5py.h5d.DatasetID) and _lies_elsewhere(node.get_create_plist()):
                return f"{_shown(name)} has its data elsewhere; {_WHOLE}"
            if isinstance(node, h5py.h5g.GroupID):
                if (address := h5py.h5o.get_info(node).addr) in groups:
                    return f"{_shown(name)} is a group that has another name, too; allowed: one name for each"
                groups.add(address)
            return None

        if found := file.id.links.visit(trap, info=True):
            raise RefusedFile(found)


def _lies_elsewhere(properties):
    import h5py

    return properties.get_layout() == h5py.h5d.VIRTUAL or (
        properties.get_layout() == h5py.h5d.CONTIGUOUS and properties.get_external_count() > 0
    )


def _shown(name):
    return repr(name.decode("utf-8", "replace"))


def read_columns(path: str | Path, columns: dict[str, float]) -> list:
    """Read columns of a CSV file, each an array in the file's own order.

    Parameters
    ----------
    path : the file, with a line of headings.
    columns : headings of the wanted columns, and the factors that their numbers are multiplied with.

    Raises
    ------
    ValueError
        If the file cannot be read, or a column is missing or holds anything but positive numbers.
    """
    import numpy as np  # which commands that read no table do not wait for

    if problem := problem_with_path(path):
        raise ValueError(f"{problem}; allowed: a CSV file")
    try:
        with bounded_memory(), Path(path).open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.DictReader(file, skipinitialspace=True))
    except (OSError, UnicodeDecodeError, csv.Error, TooLarge) as error:
        reason = getattr(error, "strerror", None) or error
        raise ValueError(f"cannot be read ({reason}); allowed: a CSV file") from None
    if not rows:
        raise ValueError("holds no values; allowed: a CSV file with a line of headings and at least one of numbers")
    found = []
    for heading, factor in columns.items():
        if heading not in rows[0]:
            raise ValueError(f"has no column {heading!r}; allowed: {', '.join(map(str, rows[0]))}")
        values = [_positive(row[heading], f"column {heading!r}, row {n}") for n, row in enumerate(rows, start=1)]
        found.append(np.array(values) * factor)
    return found


def _positive(text, where: str) -> float:
    try:
        value = float(text)
    except (TypeError, ValueError):
        value = math.nan
    if not 0 < value < math.inf:
        raise ValueError(f"{where}: {text!r}; allowed: numbers greater than 0")
    return value
