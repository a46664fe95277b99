"""Files that others made, as input: which paths are opened at all, and how much memory reading one may take.

A small file can declare, or unpack to, any size. Readers hold declared sizes against the limit (`require_room`) and
read within it (`bounded_memory`), whatever library does the reading.
"""

import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from icha.support import in_words

# Environment variable with the limit in MB, and the limit without it.
VARIABLE = "ICHA_INPUT_MB"
_USUAL_MB = 2000
# Arrays of the size of a file that reading it may take.
_COPIES = 3

_KINDS = {
    stat.S_IFDIR: "is a folder",
    stat.S_IFIFO: "is a pipe",
    stat.S_IFCHR: "is a device",
    stat.S_IFBLK: "is a device",
    stat.S_IFSOCK: "is a socket",
}


class TooLarge(ValueError):
    """A file that would take more memory than reading one may; the message says how to allow more."""

    def __init__(self, needed: str, most: int):
        """Say what is `needed`, that `most` bytes are allowed, and what allows more."""
        super().__init__(
            f"needs {needed} of memory; allowed: {in_words.size(most)}, or what the environment variable {VARIABLE} "
            f"says, in MB"
        )


def flaw_of_path(path: str | os.PathLike) -> str | None:
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
        raise TooLarge(f"about {in_words.size(needed)}", most)


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
        raise TooLarge(f"more than {in_words.size(most)}", most) from None
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def _taken() -> int | None:
    """Bytes of data of this process, None where the system does not tell."""
    try:
        found = re.search(r"^VmData:\s*(\d+) kB$", Path("/proc/self/status").read_text(), re.MULTILINE)
    except OSError:
        return None
    return int(found[1]) * 1024 if found else None
