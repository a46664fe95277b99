"""Measure a command as a whole process: wall time and peak memory. Standard library only.

On Linux a process inherits the peak memory of the one that starts it, so whoever measures has to stay small.
"""

from __future__ import annotations

import os
import subprocess
import threading
import time
from dataclasses import dataclass
from pathlib import Path

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True)
class Measurement:
    """Wall and processor time in s, peak resident memory in bytes, and the end: "complete", "over time" or "failed"."""

    wall: float
    processor: float
    peak: int
    outcome: str
    last_words: str


def measure(command: list[str], threads: int, limit: float, folder: Path | None = None) -> Measurement:
    """Run the command with a number of threads, in a folder; it is killed after `limit` seconds."""
    environment = os.environ | dict.fromkeys(THREADS, str(threads)) | {"OMP_WAIT_POLICY": "passive"}
    start = time.perf_counter()
    output = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen(command, cwd=folder, env=environment, **output)
    lines: list[str] = []
    reader = threading.Thread(target=lambda: lines.extend(process.stderr))
    reader.start()
    alarm = threading.Timer(limit, process.kill)
    alarm.start()
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    alarm.cancel()
    process.returncode = os.waitstatus_to_exitcode(status)
    reader.join()
    outcome = "complete" if process.returncode == 0 else "over time" if wall >= limit else "failed"
    last_words = "".join(lines[-1:]).strip() if outcome == "failed" else ""
    return Measurement(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024, outcome, last_words)
