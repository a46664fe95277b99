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

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
# Time in s between two counts, and after which a signal to stop is repeated.
_INTERVAL, _REPEAT_STOP = 1.0, 15.0
# Outside a terminal, a line is printed after this time in s if a file was finished, and otherwise after the longer one.
_SHORT_SILENCE, _LONG_SILENCE = 10.0, 45.0
# Measured and expected times have the same weight when finished files were expected to take this many core-seconds.
_PRIOR = 10.0
_PR_SET_PDEATHSIG = 1  # of prctl(2)


class Progress:
    """Files of a campaign that a call of Snakemake computes.

    A file counts as finished if its modification time has changed since this object was made. Files that the jobs keep
    do not count, although Snakemake changes their times.
    """

    def __init__(self, items: Iterable[Item], results: Path, cores: int):
        """Note the present modification times.

        Parameters
        ----------
        items : files that Snakemake may compute, with their states.
        results : folder of the results.
        cores : number of cores in use.
        """
        self._work = {str(results / item.path): item.work for item in items if item.may_be_written}
        self.expected = {str(results / item.path) for item in items if item.to_do}
        self._before = {path: _time_of(path) for path in self._work}
        self._cores, self._start = cores, time.monotonic()
        self.called = time.time()  # as in the modification times of files
        self.finished: set[str] = set()
        self._first = self._last = self._start  # time when the first file and the last file were finished
        self._done = 0.0  # expected work of the files that were finished after the first

    @property
    def total(self) -> int:
        """Number of files that the call computes, as far as this is known."""
        return len(self.expected | self.finished)

    @property
    def seconds(self) -> float:
        """Time since the start, s."""
        return time.monotonic() - self._start

    def count(self) -> int:
        """Look which files are finished, and return how many."""
        new = {
            path
            for path, before in self._before.items()
            if path not in self.finished and _time_of(path) not in (None, before)
        }
        if new:
            self._last = time.monotonic()
            if self.finished:
                self._done += sum(self._work[path] for path in new)
            else:
                self._first = self._last
            self.finished |= new
        return len(self.finished)

    def time_left(self) -> str:
        """Return the expected time until all files are finished, as text."""
        waiting = [self._work[path] for path in self.expected - self.finished]
        if not waiting:
            return "finishing"
        now = time.monotonic()
        # Factor by which the files take longer than expected on this machine. If no file was finished for a long time,
        # the factor grows, because each core is busy with at most one file.
        slowness = max(
            ((until - self._first) * self._cores + _PRIOR) / (self._done + running + _PRIOR)
            for until, running in ((self._last, 0.0), (now, self._cores * max(waiting)))
        )
        left = sum(waiting) * slowness / self._cores - (now - self._last)
        return f"about {formatting.duration(left)} left" if left > 0 else "longer than expected"


def _time_of(path: str) -> int | None:
    try:
        return os.stat(path).st_mtime_ns
    except OSError:
        return None


def run_process(command: list[str], folder: Path, log: Path, progress: Progress, name: str) -> tuple[int, bool]:
    """Run a command and show the progress of campaign `name`; a signal to stop is passed on.

    In a terminal, a bar shows the progress; otherwise a line is printed at least once a minute.

    Returns
    -------
    The exit status, and whether a signal stopped the command.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    stopped: list[int] = []
    with log.open("a", encoding="utf-8") as output:
        # The command gets its own process group, so that Ctrl-C reaches it and its jobs only once, from `stop`.
        process = subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            process_group=0,
            preexec_fn=_end_with_parent if sys.platform == "linux" else None,
        )

    def stop(number, frame):
        stopped.append(number)
        echo("stopping …")
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, number)

    # Signals that are already ignored, for example under nohup, remain ignored.
    signals = [number for number in STOP_SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
    handlers = {number: signal.signal(number, stop) for number in signals}
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    bar = Bar(*columns, transient=True)
    bar.disable = not bar.console.is_terminal
    task = bar.add_task(name)
    printed, shown, next_stop = time.monotonic(), 0, _REPEAT_STOP
    try:
        with bar:
            while process.poll() is None:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(_INTERVAL)
                count, total = progress.count(), progress.total
                state = progress.time_left() if count else "planning, and starting the first jobs"
                bar.update(task, completed=count, total=total, description=f"{name}: {state}")
                silence = time.monotonic() - printed
                if bar.disable and silence > (_SHORT_SILENCE if count > shown else _LONG_SILENCE):
                    so_far = formatting.duration(progress.seconds)
                    echo(f"{name}: {count} of {format_count(total, 'file')}, {state}, {so_far} so far")
                    printed, shown = time.monotonic(), count
                # Snakemake can miss a signal that arrives while Snakemake starts a job.
                if stopped and (next_stop := next_stop - _INTERVAL) <= 0:
                    next_stop = _REPEAT_STOP
                    stop(stopped[-1], None)
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    progress.count()
    return process.returncode, bool(stopped) or process.returncode < 0


def _end_with_parent() -> None:
    """Let the operating system kill this process when `icha run` is killed, so that the next call can start."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
