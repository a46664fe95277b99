"""Check input files from unknown sources: kind of file, memory for reading, dangerous HDF5 files.

A small file can declare a very large array, or contain a large array in compressed form. Readers compare the declared
size with a limit (`require_room`). `bounded_memory` limits the memory of the libraries that read the file.
"""

import os
import re
import stat
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from icha.support import formatting

# Environment variable with the memory limit in MB, and the default limit.
VARIABLE = "ICHA_INPUT_MB"
_DEFAULT_MB = 2000
# Largest memory for reading a large file, divided by the size of the file.
_COPIES = 3
# Largest numbers of names and of nested groups in an HDF5 file; visiting more names takes minutes.
_MOST_NAMES, _DEEPEST = 100_000, 50
_WHOLE = "expected a file that contains all of its data"


class RefusedFile(ValueError):
    """Error: a file is not read because it might do harm. The message contains the reason and what is expected."""


class TooLarge(RefusedFile):
    """Error: reading a file needs more memory than the limit. The message explains how to raise the limit."""

    def __init__(self, needed: str, most: int):
        """Create the message from the needed memory (text) and the limit `most` (bytes)."""
        super().__init__(
            f"needs {needed} of memory; expected at most {formatting.size(most)}. To allow more, set the environment "
            f"variable {VARIABLE} (in MB)"
        )


def problem_with_path(path: str | os.PathLike) -> str | None:
    """Describe why a path is not a readable file, or return None. Reading a pipe or device might never end."""
    try:
        mode = os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError, ValueError):  # ValueError for zero bytes in a path
        return "no such file"
    except OSError as error:
        return f"cannot be read ({error.strerror})"
    if stat.S_ISDIR(mode):
        return "is a folder"
    return None if stat.S_ISREG(mode) else "is not a file but a device, a pipe or a socket"


def most_memory(file: str | os.PathLike | None = None) -> int:
    """Return the memory limit for reading a file, bytes; the default limit grows with the size of `file`.

    Raises RefusedFile if the environment variable is not a number.
    """
    limit = os.environ.get(VARIABLE)
    if limit is None:
        # Only the occupied part of a sparse file counts; the unit of st_blocks is 512 bytes on all systems.
        needed = 0 if file is None else _COPIES * 512 * os.stat(file).st_blocks
        return max(_DEFAULT_MB * 10**6, needed)
    if not re.fullmatch(r"[0-9]{1,9}", limit):
        raise RefusedFile(f"{VARIABLE}: {limit!r} is not a number of MB")
    return int(limit) * 10**6


def require_room(needed: float, most: int | None = None) -> None:
    """Raise `TooLarge` if `needed` bytes of memory exceed `most` bytes; `most_memory` gives the default of `most`."""
    most = most_memory() if most is None else most
    if needed > most:
        raise TooLarge(f"about {formatting.size(needed)}", most)


@contextmanager
def bounded_memory(most: int | None = None) -> Iterator[None]:
    """Limit the memory of a block of code and of the libraries that it calls to `most` bytes (default: `most_memory`).

    A block that needs more memory raises `TooLarge`; libraries in C may raise their own errors instead. Only Linux
    supports the limit. On other systems, `require_room` is the only check.
    """
    most = most_memory() if most is None else most
    if sys.platform != "linux":
        yield
        return
    import resource

    import psutil

    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    used = psutil.Process().memory_info().data
    bounds = [bound for bound in (used + most, soft, hard) if bound != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_DATA, (min(bounds), hard))
    try:
        yield
    except MemoryError:
        raise TooLarge(f"more than {formatting.size(most)}", most) from None
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def text(attribute: bytes | str | Iterable[bytes | str]) -> str:
    """Convert a text attribute of a netCDF file to str; files store non-ASCII text as bytes or as an array."""
    if not isinstance(attribute, bytes | str):
        (attribute,) = attribute
    return attribute.decode() if isinstance(attribute, bytes) else str(attribute)


def refuse_traps(path: str | os.PathLike) -> None:
    """Raise RefusedFile for an HDF5 file with external links or data, cyclic groups, or too many names.

    Links to other files could reach any file of this machine. A group with two names may contain itself, which crashes
    the netCDF library. Links to data in the same file are accepted. Files of other formats are not checked.
    """
    import h5py

    if not h5py.is_hdf5(path):
        return
    with h5py.File(path, "r") as file:
        groups, count = {h5py.h5o.get_info(file.id).addr}, 0

        def trap(name, link):
            """Return the reason why the file is refused, or None; h5py stops after the first reason."""
            nonlocal count
            count, shown = count + 1, name.decode("utf-8", "replace")
            if count > _MOST_NAMES or name.count(b"/") >= _DEEPEST:
                return f"it has more than {_MOST_NAMES:,} names, or {_DEEPEST} nested groups; expected fewer"
            if link.type == h5py.h5l.TYPE_EXTERNAL:
                return f"{shown!r} is a link to another file; {_WHOLE}"
            try:
                node = h5py.h5o.open(file.id, name)
            except (KeyError, RuntimeError, SystemError):  # the link has no target, or is its own target
                return None
            if isinstance(node, h5py.h5d.DatasetID):
                properties = node.get_create_plist()
                layout = properties.get_layout()
                outside = layout == h5py.h5d.CONTIGUOUS and properties.get_external_count() > 0
                if outside or layout == h5py.h5d.VIRTUAL:
                    return f"{shown!r} has its data in another file or dataset; {_WHOLE}"
            if isinstance(node, h5py.h5g.GroupID):
                if (address := h5py.h5o.get_info(node).addr) in groups:
                    return f"{shown!r} is a group with a second name; expected one name for each group"
                groups.add(address)
            return None

        if found := file.id.links.visit(trap, info=True):
            raise RefusedFile(found)
