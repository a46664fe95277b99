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

_KINDS = {
    stat.S_IFDIR: "is a folder",
    stat.S_IFIFO: "is a pipe",
    stat.S_IFCHR: "is a device",
    stat.S_IFBLK: "is a device",
    stat.S_IFSOCK: "is a socket",
}


class TooLarge(ValueError):
    """A file that would take more memory than reading one may; the message says how to allow more."""

    def __init__(self, needed: str):
        """Say what is `needed`, what is allowed and what allows more."""
        super().__init__(
            f"needs {needed} of memory; allowed: {in_words.size(most_memory())}, or what the environment "
            f"variable {VARIABLE} says, in MB"
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


def most_memory() -> int:
    """Bytes of memory that reading a file may take.

    Raises
    ------
    ValueError
        If the environment variable is no number.
    """
    asked = os.environ.get(VARIABLE, str(_USUAL_MB))
    if not re.fullmatch(r"[0-9]{1,9}", asked):
        raise ValueError(f"{VARIABLE}: {asked!r} is not a number of MB")
    return int(asked) * 10**6


def require_room(needed: float) -> None:
    """Raise `TooLarge` if reading needs more bytes of memory than it may take."""
    if needed > most_memory():
        raise TooLarge(f"about {in_words.size(needed)}")


@contextmanager
def bounded_memory() -> Iterator[None]:
    """Let a block allocate no more than `most_memory` bytes, whatever libraries it calls; more is `TooLarge`.

    Libraries in C may have errors of their own for memory that they do not get. Only Linux can bound memory so;
    elsewhere nothing but declared sizes is checked.
    """
    most, taken = most_memory(), _taken()
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
        raise TooLarge(f"more than {in_words.size(most)}") from None
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def _taken() -> int | None:
    """Bytes of data of this process, None where the system does not tell."""
    try:
        found = re.search(r"^VmData:\s*(\d+) kB$", Path("/proc/self/status").read_text(), re.MULTILINE)
    except OSError:
        return None
    return int(found[1]) * 1024 if found else None
