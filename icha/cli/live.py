"""Progress of a running campaign. Events of Snakemake update the progress; a view prints the progress."""

import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from icha.cli.project import TARGETS
from icha.support import formatting
from icha.support.formatting import printable

# Measured and expected times have the same weight when finished jobs were expected to take this many core-seconds.
PRIOR_SECONDS = 5.0
# Expected core-seconds of a job that the plan does not list. Jobs outside the plan only write a few lines.
DEFAULT_SECONDS = 0.1
MOST_JOBS = 8  # largest number of running jobs that the view lists
SILENCE = 45.0  # seconds without a line, outside a terminal, after which the view prints the running jobs
MOST_ERROR_LINES = 3  # largest number of lines that the view prints for the error of a failed job


@dataclass
class JobRecord:
    """A job that Snakemake has started.

    Attributes
    ----------
    rule : name of the Snakemake rule of the job.
    title : description of the job, from the `message` of its rule.
    outputs : paths of the files that the job writes.
    log : path of the log file; empty for a job without a log.
    started : time of the start, s.
    seconds : duration, s; 0 while the job runs.
    threads : number of cores that the job uses.
    """

    rule: str
    title: str
    outputs: tuple[str, ...]
    log: str
    started: float
    seconds: float = 0.0
    threads: int = 1


@dataclass
class Progress:
    """Jobs of a campaign, updated by the events of Snakemake.

    Other threads must hold `lock` while they read the attributes.

    Attributes
    ----------
    expected : for the path of each file, the rule of the job that writes the file, and the job's expected core-seconds.
    clock : function that returns the present time, s.
    total : number of jobs of each rule.
    running : running jobs, by their number in Snakemake.
    done : jobs that succeeded.
    failed : jobs that failed.
    cores : number of cores in use; on a cluster, largest number of jobs that run at the same time.
    started : time at which Snakemake finished its first plan, s; None before this time.
    called : time at which `icha run` was called, s.
    """

    expected: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    clock: Callable[[], float] = time.monotonic
    total: dict[str, int] = field(default_factory=dict)
    running: dict[int, JobRecord] = field(default_factory=dict)
    done: list[JobRecord] = field(default_factory=list)
    failed: list[JobRecord] = field(default_factory=list)
    cores: int = 1
    started: float | None = None
    called: float = field(default_factory=time.monotonic)
    lock: threading.RLock = field(default_factory=threading.RLock)

    def update(self, event: Mapping) -> JobRecord | None:
        """Update the jobs with an event of the logger plugin; return the job that has just ended, or None."""
        with self.lock:
            match event["event"]:
                case "run_info":
                    # Rules of targets compute nothing: they only collect files of other rules.
                    self.total = {name: n for name, n in event["stats"].items() if name not in (*TARGETS, "total")}
                    self.started = self.started or self.clock()
                case "resources_info" if event.get("cores") or event.get("nodes"):
                    self.cores = int(event.get("cores") or event["nodes"])
                case "job_info" if event["rule_name"] not in TARGETS:
                    self.running[event["jobid"]] = JobRecord(
                        event["rule_name"],
                        printable(event["rule_msg"] or event["rule_name"]),
                        tuple(event["output"] or ()),
                        # Snakemake adds remarks in brackets to the path.
                        next(iter(event["log"] or ()), "").split(" (")[0],
                        self.clock(),
                        threads=event.get("threads") or 1,
                    )
                case "job_finished" | "job_error" as name:
                    jobs, key = (self.done, "job_id") if name == "job_finished" else (self.failed, "jobid")
                    if job := self.running.pop(event[key], None):
                        job.seconds = self.clock() - job.started
                        jobs.append(job)
                        return job
        return None

    @property
    def job_count(self) -> int:
        """Number of all jobs."""
        return sum(self.total.values())

    @property
    def ended_count(self) -> int:
        """Number of jobs that succeeded or failed."""
        return len(self.done) + len(self.failed)

    def seconds_left(self) -> float | None:
        """Estimate the time until all jobs are done, from expected and measured times; None before the first plan.

        The estimate includes jobs that cannot run because another job failed.
        """
        if self.started is None:
            return None
        ended, running = [*self.done, *self.failed], [*self.running.values()]
        measured = sum(job.seconds * job.threads for job in ended)
        # Factor by which jobs take longer than expected on this machine.
        slowness = (measured + PRIOR_SECONDS) / (sum(map(self._expected_work, ended)) + PRIOR_SECONDS)
        work = self._waiting_work([*ended, *running]) * slowness
        for job in running:
            work += max(self._expected_work(job) * slowness - (self.clock() - job.started) * job.threads, 0.0)
        return work / max(self.cores, 1)

    def _expected_work(self, job: JobRecord) -> float:
        """Return the core-seconds that a job is expected to take."""
        return max((self.expected[each][1] for each in job.outputs if each in self.expected), default=DEFAULT_SECONDS)

    def _waiting_work(self, begun: list[JobRecord]) -> float:
        """Return the expected core-seconds of the jobs that have not begun.

        Each job counts with the mean of its rule, because Snakemake reports only how many jobs of a rule are waiting.
        """
        outputs = {output for job in begun for output in job.outputs}
        expected: dict[str, list[float]] = {}
        for output, (rule, seconds) in self.expected.items():
            if output not in outputs:
                expected.setdefault(rule, []).append(seconds)
        waiting = Counter(self.total) - Counter(job.rule for job in begun)
        means = {rule: sum(seconds) / len(seconds) for rule, seconds in expected.items()}
        return sum(count * means.get(rule, DEFAULT_SECONDS) for rule, count in waiting.items())

    def time_left(self) -> str:
        """Return the estimated time until all jobs are done, as text."""
        seconds = self.seconds_left()
        return "time left unknown" if seconds is None else f"about {formatting.duration(seconds)} left"


def _complete_lines(job: JobRecord, folder: Path) -> list[str]:
    """Return the complete lines in the log of a job; an empty list if the job has no log."""
    try:
        text = (folder / job.log).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return []
    return [printable(line) for line in text.split("\n")[:-1]]


def read_error(job: JobRecord, folder: Path) -> list[str]:
    """Return why a job failed: the lines of its log, from the last line that begins with `Error:` to the end.

    The list is empty if no line begins with `Error:`, for example because the job was killed.
    """
    lines = _complete_lines(job, folder)
    starts = [number for number, line in enumerate(lines) if line.startswith("Error:")]
    if not starts:
        return []
    first, *others = lines[starts[-1] :]
    return [first.removeprefix("Error:").strip(), *others]


def read_last_line(job: JobRecord, folder: Path) -> str:
    """Return the last complete line in the log of a running job."""
    return next((line.strip() for line in reversed(_complete_lines(job, folder)) if line.strip()), "")


class View:
    """View of the jobs: in a terminal, a table that is updated; in a file, one line for each finished job.

    Parameters
    ----------
    progress : jobs that are shown.
    campaign : name of the campaign.
    folder : folder to which the paths of logs are relative.
    console : terminal or file to which the view is printed.
    """

    def __init__(self, progress: Progress, campaign: str, folder: Path, console: Console):
        """Store the arguments; the context manager `live` draws the table in a terminal."""
        self._progress, self._campaign, self.folder, self._console = progress, campaign, folder, console
        self._is_live, self._printed = console.is_terminal, progress.clock()
        self.live = nullcontext()
        if self._is_live:
            self.live = Live(get_renderable=self._draw, console=console, refresh_per_second=4, transient=True)

    def print(self, text: str, style: str = "") -> None:
        """Print a line of text; if the view shows a table, the line appears above the table."""
        self._console.print(Text(printable(text), style=style), soft_wrap=True)
        self._printed = self._progress.clock()

    def print_running(self) -> None:
        """Print the running jobs if nothing was printed for `SILENCE` seconds; a terminal always shows these jobs."""
        progress = self._progress
        if self._is_live or progress.started is None or progress.clock() - self._printed < SILENCE:
            return
        with progress.lock:
            lines = [self._heading(), *self._running()]
        for line in lines:
            self.print(line.plain)

    def print_job(self, job: JobRecord, failed: bool) -> None:
        """Print a finished job and the number of finished jobs; in a terminal, print only failed jobs."""
        if self._is_live and not failed:
            return
        progress, total = self._progress, str(self._progress.job_count)
        title, style = (f"failed: {job.title}", "red") if failed else (job.title, "")
        head = f"[{progress.ended_count:>{len(total)}}/{total}, {progress.time_left()}]"
        self.print(f"{head} {title} ({formatting.duration(job.seconds)})", style)
        for line in read_error(job, self.folder)[:MOST_ERROR_LINES] if failed else ():
            self.print(f"    {line}", style)

    def _draw(self):
        with self._progress.lock:
            if self._progress.started is None:
                return Text(f"{self._campaign}: planning …")
            return Group(self._heading(), self._table(), *self._running())

    def _heading(self) -> Text:
        progress, failed = self._progress, len(self._progress.failed)
        texts = [f"{self._campaign}: {progress.ended_count} of {progress.job_count} jobs"]
        texts += [f"{failed} failed"] if failed else []
        texts += [progress.time_left(), f"{formatting.duration(progress.clock() - progress.started)} so far"]
        return Text(", ".join(texts), style="bold")

    def _table(self) -> Table:
        table = Table(box=None, pad_edge=False, header_style="dim")
        for heading in ("", "done", "running", "failed", "of", ""):
            table.add_column(heading, justify="right" if heading else "left")
        states = (self._progress.done, self._progress.running.values(), self._progress.failed)
        counts = [Counter(job.rule for job in jobs) for jobs in states]
        for rule, total in self._progress.total.items():
            done, running, failed = (count[rule] for count in counts)
            style = "red" if failed else "green" if done == total else "bold" if running else "dim"
            cells = [str(number or "") for number in (done, running, failed)]
            bar = ProgressBar(total=total, completed=done + failed, width=20)
            table.add_row(rule.replace("_", " "), *cells, str(total), bar, style=style)
        return table

    def _running(self) -> list[Text]:
        progress, lines = self._progress, []
        for job in sorted(progress.running.values(), key=lambda job: job.started)[:MOST_JOBS]:
            duration = formatting.duration(progress.clock() - job.started)
            lines.append(Text(f"▸ {duration:>8}  {job.title}", no_wrap=True))
            if message := read_last_line(job, self.folder):
                lines.append(Text(f"            {message}", style="dim", no_wrap=True))
        if len(progress.running) > MOST_JOBS:
            lines.append(Text(f"  and {len(progress.running) - MOST_JOBS} more", style="dim"))
        return lines
