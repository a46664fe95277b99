"""Atomic writes: a file is complete or does not exist, survives a power cut, and is written only by the owner.

The call of the program that started last owns a folder of results. Jobs of an earlier call may still run on another
machine, but cannot complete a result: before a file is moved to its place, the owner is checked under a lock, which a
new call needs as well.
"""

import fcntl
import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path

# Bytes that must fit on the disk; libraries write about as much at once.
_PROBE = 2**20
_ENDING = ".part"
# Environment variable for the programs that an owner starts: content of the owner's file, and its path.
_OWNER_VARIABLE = "ICHA_OWNER"
_moving: Callable[[], AbstractContextManager] = nullcontext
_SUPERSEDED = "a later call of this campaign owns this result and computes it; nothing was written"


@contextmanager
def whole_file(path: str | os.PathLike, *, lasting: bool = True) -> Iterator[Path]:
    """Provide a temporary path beside `path`; move the file to `path` if the block succeeds, else remove it.

    The folder is created if it is missing. The temporary path is unique, so two programs may write the same file.
    Unless `lasting` is False, the content is synchronised to the disk before the move, and the name after it.

    Raises
    ------
    Superseded
        If this process is a job (`move_only_while_owned`), and a later call owns the results.
    OSError
        If the folder cannot be written to. It replaces the errors of libraries for data files, which do not mention a
        full disk.
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
            # Some file systems cannot synchronise folders.
            with suppress(OSError):
                _sync(path.parent)
    except Superseded:
        raise
    except Exception as error:
        reason = probe_folder(path.parent)
        if reason is not None:
            raise OSError(reason.errno, reason.strerror, str(path.parent)) from error
        raise
    finally:
        with suppress(OSError):  # it may be missing, as in a read-only folder
            temporary.unlink()


def move_only_while_owned() -> None:
    """Make this process a job: it writes results only while the call that started it owns the results."""
    global _moving
    _moving = while_owned


def moving() -> AbstractContextManager:
    """Return the context in which files are moved into place."""
    return _moving()


def is_left_over(name: str) -> bool:
    """Return whether a file name is that of a temporary file; a killed program leaves such files behind."""
    return name.startswith(".") and name.endswith(_ENDING)


def sync_folder(folder: Path) -> None:
    """Synchronise all files below a folder, and their names, to the disk."""
    for top, _, names in os.walk(folder):
        for name in names:
            _sync(Path(top, name))
        with suppress(OSError):
            _sync(Path(top))


def probe_folder(folder: Path) -> OSError | None:
    """Write some data to a folder and remove them; return the error if it cannot be written to."""
    probe = folder / f".{os.getpid()}.probe{_ENDING}"
    try:
        probe.write_bytes(bytes(_PROBE))
        return None
    except OSError as error:
        return error
    finally:
        with suppress(OSError):
            probe.unlink()


def _sync(path: Path) -> None:
    """Synchronise the content of a file, or the names in a folder, to the disk; macOS may still buffer it."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


class Superseded(ValueError):
    """A later call owns the results."""


def take_over(file: str | os.PathLike) -> None:
    """Make this process and those that it starts the owner of the results of `file`; raise OSError if it cannot."""
    os.environ.pop(_OWNER_VARIABLE, None)
    word = secrets.token_hex(8)
    Path(file).parent.mkdir(parents=True, exist_ok=True)
    with open(file, "a+", encoding="ascii") as owner:
        _lock(owner, fcntl.LOCK_EX)
        owner.truncate(0)
        owner.write(word)
        owner.flush()
        os.fsync(owner.fileno())
    os.environ[_OWNER_VARIABLE] = f"{word} {file}"


@contextmanager
def while_owned() -> Iterator[None]:
    """Keep other calls from taking over the results; raise `Superseded` if one has done so."""
    word, _, file = os.environ.get(_OWNER_VARIABLE, "").partition(" ")
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
    with suppress(OSError):  # on a file system without locks a short race remains
        fcntl.flock(file, kind)
