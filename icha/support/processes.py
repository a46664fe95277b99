"""Processes of this machine."""

from pathlib import Path


def beginning_of(process: int) -> str:
    """When a process began, in the system's own count: with its number it tells the process from all others (Linux).

    Raises
    ------
    FileNotFoundError, ProcessLookupError
        If there is no such process.
    """
    # The name of the program, in parentheses, may hold anything.
    status = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    return status.rpartition(")")[2].split()[19]
