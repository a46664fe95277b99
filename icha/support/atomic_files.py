"""Write files atomically: a file is either complete or missing, also after a power cut.

The latest call of the program owns a folder of results: only jobs of this call may complete results in the folder. Jobs
of an earlier call may still run on another machine. A small file records the owner. Before a job moves a result to its
final path, the job locks this file and checks the owner. A new call needs the same lock before it becomes the owner.
"""

import fcntl
import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path

# A test of free disk space writes this number of bytes, because libraries write about as many bytes at once.
_PROBE = 2**20
_ENDING = ".part"
# Environment variable: content and path of the file that records the owner. Child processes inherit the variable.
_OWNER_VARIABLE = "ICHA_OWNER"
_moving: Callable[[], AbstractContextManager] = nullcontext
_SUPERSEDED = "a later call of this campaign owns this result; this job wrote nothing"


@contextmanager
def whole_file(path: str | os.PathLike, *, lasting: bool = True) -> Iterator[Path]:
    """Provide a temporary path; move the file to `path` if the block succeeds, else remove the temporary file.

    The folder of `path` is created if it is missing. The temporary path is unique, so two programs may write the same
    file at the same time. If `lasting` is true, the content reaches the disk before the move, and the new name reaches
    the disk after the move.

    Raises
    ------
    Superseded
        If this process is a job (`move_only_while_owned`), and a later call owns the results.
    OSError
        If nothing can be written to the folder. Libraries for data files raise other errors, which do not mention a
        full disk; OSError replaces these errors.
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
        with suppress(OSError):  # the temporary file may be missing
            temporary.unlink()


def move_only_while_owned() -> None:
    """Mark this process as a job: it may move results only while the call that started the job owns the results."""
    global _moving
    _moving = while_owned


def moving() -> AbstractContextManager:
    """Return the context manager for moving a file to its final path; in a job, it checks the owner of the results."""
    return _moving()


def is_left_over(name: str) -> bool:
    """Return whether a file name belongs to a temporary file that a killed program has left."""
    return name.startswith(".") and name.endswith(_ENDING)


def sync_folder(folder: Path) -> None:
    """Write all files of a folder and its subfolders, and the names of the files, from the cache to the disk."""
    for top, _, names in os.walk(folder):
        for name in names:
            _sync(Path(top, name))
        with suppress(OSError):
            _sync(Path(top))


def probe_folder(folder: Path) -> OSError | None:
    """Test whether data can be written to a folder; return the error, or None."""
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
    """Write the content of a file, or the names in a folder, from the cache to the disk; macOS may delay the write."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


class Superseded(ValueError):
    """Error: a later call of the program owns the results."""


def take_over(file: str | os.PathLike) -> None:
    """Let this process, and all processes that it starts, own the results; write the record of the owner to `file`."""
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
    """Prevent other calls from becoming owner during a block; raise `Superseded` if another call is the owner."""
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
    """Lock a file until the file is closed."""
    with suppress(OSError):  # without locks in the file system, two calls may conflict for a short time
        fcntl.flock(file, kind)
