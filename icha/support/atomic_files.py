"""Files that appear whole or not at all, and are still there after a power cut; and whose results they may become.

A folder of results belongs to the call of the program that began last. What an earlier call has left running, on
another machine or stopped at a bad moment, can complete no result any more: whatever is moved into place asks before,
and no call begins in between.
"""

import fcntl
import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path

# As much as libraries want to write at once; a disk on which less is free is full.
_PROBE = 2**20
_ENDING = ".part"
# For the programs that an owner starts, wherever they run: what the file says while the results are its own; the file.
_TOLD = "ICHA_OWNER"
_moving: Callable[[], AbstractContextManager] = nullcontext
_SUPERSEDED = "the campaign was begun again since, and the later call makes this result; nothing was written"


@contextmanager
def whole_file(path: str | os.PathLike, *, lasting: bool = True) -> Iterator[Path]:
    """Give a temporary path beside `path`; move it there when the block ends well, remove it when it does not.

    The folder is created if need be. The temporary path is nobody else's: two programs that write the same file do not
    write into each other's. What is moved is on the disk before, and its name after, unless it need not be `lasting`.

    Raises
    ------
    Superseded
        If files are moved only while owned, and the results are another call's by now.
    OSError
        If the folder cannot be written to. Libraries for data files have other errors for a full disk, which say
        nothing of it: whatever the block raises, this one is raised instead where that is the case.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}{_ENDING}")
    try:
        yield temporary
        if lasting:
            _sync(temporary)
        with moving():
            os.replace(temporary, path)
        if lasting:
            # Some file systems do not know how.
            with suppress(OSError):
                _sync(path.parent)
    except Superseded:
        raise
    except Exception as error:
        reason = why_not_writable(path.parent)
        if reason is not None:
            raise OSError(reason.errno, reason.strerror, str(path.parent)) from error
        raise
    finally:
        _remove(temporary)


def move_only_while_owned() -> None:
    """From now on, move files into place only while their owner is the one that has started this process: in jobs."""
    global _moving
    _moving = while_owned


def moving() -> AbstractContextManager:
    """The context in which files are moved into place."""
    return _moving()


def is_left_over(name: str) -> bool:
    """Whether a file of this name is what a killed program has left where nobody writes any more."""
    return name.startswith(".") and name.endswith(_ENDING)


def sync_folder(folder: Path) -> None:
    """Have all files below a folder, and their names, on the disk."""
    for top, _, names in os.walk(folder):
        for name in names:
            _sync(Path(top, name))
        with suppress(OSError):
            _sync(Path(top))


def in_the_way(folder: Path) -> str | None:
    """What is where a folder is to be, if anything but a folder is: a file, or a link to what is not there."""
    for path in (folder, *folder.parents):
        # Methods of Path raise errors where a folder on the way may not be entered.
        if os.path.exists(path):
            return None if os.path.isdir(path) else f"{path} is a file, and no folder"
        if os.path.islink(path):
            return f"{path} is a link to {os.readlink(path)}, which is not there, or not to be reached"
    return None


def why_not_writable(folder: Path) -> OSError | None:
    """What the system says against data in a folder, if anything; they are removed again."""
    probe = folder / f".{os.getpid()}.probe{_ENDING}"
    try:
        probe.write_bytes(bytes(_PROBE))
    except OSError as error:
        return error
    finally:
        _remove(probe)
    return None


def _sync(path: Path) -> None:
    """Have a file's content, or the names in a folder, on the disk; on macOS that may still have it in its memory."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _remove(file: Path) -> None:
    with suppress(OSError):  # it is not there, or was never, for the folder is read-only
        file.unlink()


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


@contextmanager
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


def _lock(file, kind):
    """Lock a file until it is closed."""
    with suppress(OSError):  # a file system without locks: a moment remains
        fcntl.flock(file, kind)
