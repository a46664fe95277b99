"""Progress of a running campaign: count the finished files of the plan, and estimate the time that is left."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from icha.cli.project import echo
from icha.support import formatting
from icha.support.formatting import format_count

if TYPE_CHECKING:
    from icha.planning.plan import Item

_STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
# Time in s between two counts, and after which a signal to stop is repeated.
_INTERVAL, _REPEAT_STOP = 1.0, 15.0
# Outside a terminal, a line is printed after this time in s if a file was finished, and otherwise after the longer one.
_SHORT_SILENCE, _LONG_SILENCE = 10.0, 45.0
# Measured and expected times have the same weight when finished files were expected to take this many core-seconds.
_PRIOR = 20.0
_PR_SET_PDEATHSIG = 1  # of prctl(2)


class Progress:
    """Files of a campaign that a call of Snakemake computes.

    A file counts as finished if its modification time has changed since this object was made. Files that the jobs keep
    do not count, although Snakemake changes their times.

    Attributes
    ----------
    expected : files that must be computed.
    finished : files that are finished.
    start : time of the call, s, as in the modification times of files.
    """

    def __init__(self, items: Iterable[Item], results: Path, cores: int):
        self._work = {str(results / item.path): item.cost.work for item in items if item.may_be_written}
        self.expected = {str(results / item.path) for item in items if item.to_do}
        self._before = {path: _time_of(path) for path in self._work}
        self.finished: set[str] = set()
        self._cores = cores
        self.start = self._last = time.time()

    @property
    def seconds(self) -> float:
        """Time since the start, s."""
        return time.time() - self.start

    def count(self) -> tuple[int, int]:
        """Look which files are finished; return their number, and that of all files, as far as it is known."""
        found = {path for path, before in self._before.items() if _time_of(path) not in (None, before)}
        if found > self.finished:
            self.finished, self._last = found, time.time()
        return len(self.finished), len(self.expected | self.finished)

    def time_left(self) -> str:
        """Return the expected time until all files are finished, as text."""
        if not (waiting := self.expected - self.finished):
            return "finishing"
        # Factor by which the finished files have taken longer than expected on this machine.
        done = sum(self._work[path] for path in self.finished)
        slowness = ((self._last - self.start) * self._cores + _PRIOR) / (done + _PRIOR)
        left = sum(self._work[path] for path in waiting) * slowness / self._cores - (time.time() - self._last)
        return f"about {formatting.duration(left)} left" if left > 0 else "longer than expected"


def _time_of(path: str) -> int | None:
    try:
        return os.stat(path).st_mtime_ns
    except OSError:
        return None


def run_process(command: list[str], folder: Path, log: Path, progress: Progress, name: str) -> tuple[int, bool]:
    """Run a command and show the progress of campaign `name`; a signal to stop ends the command.

    Return the exit status, and whether a signal stopped the command.
    """
    with log.open("a", encoding="utf-8") as output:
        # The command gets its own process group, so that a signal reaches it and its jobs only once, from this process.
        process = subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            process_group=0,
            preexec_fn=_end_with_parent if sys.platform == "linux" else None,
        )
    # Signals that are already ignored, for example under nohup, remain ignored.
    for number in _STOP_SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)
    try:
        _show_progress(process, progress, name)
    except KeyboardInterrupt:
        echo("stopping …")
        # Snakemake can miss a signal that arrives while Snakemake starts a job.
        while process.poll() is None:
            with contextlib.suppress(ProcessLookupError, subprocess.TimeoutExpired):
                os.killpg(process.pid, signal.SIGINT)
                process.wait(_REPEAT_STOP)
        return process.returncode, True
    finally:
        progress.count()
    return process.returncode, process.returncode < 0


def _show_progress(process: subprocess.Popen, progress: Progress, name: str) -> None:
    """Show a bar in a terminal, and otherwise print a line at least once a minute, until a process ends."""
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    bar = Bar(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), transient=True)
    bar.disable = not bar.console.is_terminal
    task, printed, shown = bar.add_task(name), time.monotonic(), 0
    with bar:
        while process.poll() is None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(_INTERVAL)
            count, total = progress.count()
            state = progress.time_left() if count else "planning, and starting the first jobs"
            bar.update(task, completed=count, total=total, description=f"{name}: {state}")
            silence = time.monotonic() - printed
            if bar.disable and silence > (_SHORT_SILENCE if count > shown else _LONG_SILENCE):
                so_far = formatting.duration(progress.seconds)
                echo(f"{name}: {count} of {format_count(total, 'file')}, {state}, {so_far} so far")
                printed, shown = time.monotonic(), count


def _end_with_parent() -> None:
    """Let the operating system kill this process when `icha run` is killed, so that the next call can start."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
