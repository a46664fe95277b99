"""Whose a folder of results is: the call of the program that began last.

What an earlier call has left running, on another machine or stopped at a bad moment, can complete no result any more:
whatever is moved into place asks before, and no call begins in between.
"""

import contextlib
import fcntl
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

# For the programs that an owner starts, wherever they run: what the file says while the results are its own; the file.
_TOLD = "ICHA_OWNER"


class Superseded(ValueError):
    """A later call owns the results."""


def take_over(file: str | os.PathLike) -> None:
    """Own from now on the results that the file `file` stands for, in this process and in those that it will start.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    os.environ.pop(_TOLD, None)
    word = secrets.token_hex(8)
    Path(file).parent.mkdir(parents=True, exist_ok=True)
    with open(file, "a+", encoding="ascii") as owner:
        _lock(owner, fcntl.LOCK_EX)
        owner.truncate(0)
        owner.write(word)
        owner.flush()
        os.fsync(owner.fileno())
    os.environ[_TOLD] = f"{word} {file}"


@contextlib.contextmanager
def while_owned() -> Iterator[None]:
    """A context in which nobody takes the results over from the owner that has started this process, if one has.

    Raises
    ------
    Superseded
        If somebody has taken them over.
    """
    word, _, file = os.environ.get(_TOLD, "").partition(" ")
    if not word:
        yield
        return
    try:
        owner = open(file, encoding="ascii")
    except FileNotFoundError:
        raise Superseded(_SUPERSEDED) from None
    with owner:
        _lock(owner, fcntl.LOCK_SH)
        if owner.read() != word:
            raise Superseded(_SUPERSEDED)
        yield


_SUPERSEDED = "the campaign was begun again since, and the later call makes this result; nothing was written"


def _lock(file, kind):
    """Lock a file until it is closed."""
    with contextlib.suppress(OSError):  # a file system without locks: a moment remains
        fcntl.flock(file, kind)
