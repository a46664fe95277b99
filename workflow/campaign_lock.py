"""One run of a campaign at a time in a working directory.

Snakemake's own lock is a file, which stays behind when the program is killed; every later call then asks for an
`--unlock` that nobody dares to give. This lock belongs to the process and ends with it, however it ends. (`filelock`
holds the same kind of lock, but does not tell who has it.)
"""

import contextlib
import fcntl
import os
from pathlib import Path

_held = []


def hold_lock(path: str) -> str | None:
    """Hold the lock `path` until this process ends; return the process that holds it if that is another one."""
    try:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        # Opened so that starting jobs do not inherit it: what they leave behind must not keep the lock.
        file = open(path, "a+", encoding="ascii")
    except OSError:
        return None  # where nothing can be written nothing will be computed
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.seek(0)
        return file.read().strip() or "?"
    except OSError:
        return None  # a file system without locks: nothing to hold
    _held.append(file)
    with contextlib.suppress(OSError):  # a full disk
        file.truncate(0)
        file.write(f"{os.getpid()}\n")
        file.flush()
    return None
