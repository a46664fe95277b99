"""Processes of this machine: which is which, and one that ends with another. Linux only."""

import ctypes
import os
import signal
from pathlib import Path

_PR_SET_PDEATHSIG = 1  # of prctl(2)


def beginning_of(process: int) -> str:
    """When a process began, in the system's own count: with its number it tells the process from all others.

    Raises
    ------
    FileNotFoundError, ProcessLookupError
        If there is no such process.
    """
    # The name of the program, in parentheses, may hold anything.
    status = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    return status.rpartition(")")[2].split()[19]


def end_with_parent(parent: int) -> None:
    """Have the system kill this process when its parent, the process `parent`, ends, however that does."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
