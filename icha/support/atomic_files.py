"""Files that appear whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

# As much as libraries want to write at once; a disk on which less is free is full.
_PROBE = 2**20


@contextmanager
def whole_file(path: str | os.PathLike) -> Iterator[Path]:
    """Give a temporary path beside `path`; move it there when the block ends well, remove it when it does not.

    The folder is created if need be.

    Raises
    ------
    OSError
        If the folder cannot be written to. Libraries for data files have other errors for a full disk, which say
        nothing of it: whatever the block raises, this one is raised instead where that is the case.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.part")
    try:
        yield temporary
        os.replace(temporary, path)
    except Exception as error:
        reason = why_not_writable(path.parent)
        if reason is not None:
            raise OSError(reason.errno, reason.strerror, str(path.parent)) from error
        raise
    finally:
        _remove(temporary)


def why_not_writable(folder: Path) -> OSError | None:
    """What the system says against data in a folder, if anything; they are removed again."""
    probe = folder / f".{os.getpid()}.probe"
    try:
        probe.write_bytes(bytes(_PROBE))
    except OSError as error:
        return error
    finally:
        _remove(probe)
    return None


def _remove(file: Path) -> None:
    with suppress(OSError):  # it is not there, or was never, for the folder is read-only
        file.unlink()
