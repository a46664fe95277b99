"""Write files atomically: a file is either complete or missing, also after a power cut."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

# A test of free disk space writes this number of bytes, because libraries write about as many bytes at once.
_PROBE = 2**20
_ENDING = ".part"


@contextmanager
def whole_file(path: str | os.PathLike) -> Iterator[Path]:
    """Provide a temporary path; move the file to `path` if the block succeeds, else remove the temporary file.

    The folder of `path` is created if it is missing. The temporary path is unique, so two programs may write the same
    file at the same time. The content reaches the disk before the move, and the new name reaches the disk afterwards.

    Raise OSError if nothing can be written to the folder. It replaces the errors of libraries for data files, which do
    not mention a full disk.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}{_ENDING}")
    try:
        yield temporary
        _sync(temporary)
        os.replace(temporary, path)
        # Some file systems cannot synchronise folders.
        with suppress(OSError):
            _sync(path.parent)
    except Exception as error:
        reason = probe_folder(path.parent)
        if reason is not None:
            raise OSError(reason.errno, reason.strerror, str(path.parent)) from error
        raise
    finally:
        with suppress(OSError):  # the temporary file may be missing
            temporary.unlink()


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
