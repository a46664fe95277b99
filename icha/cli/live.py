"""Progress of a running campaign, from the events of Snakemake, and the views that print it."""

import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from icha.cli.project import echo
from icha.datasets.results import CHECKS, MODEL_ERROR, REPORT
from icha.support import formatting
from icha.support.formatting import printable

# Rules without a job of their own: they collect files of other rules.
TARGET_RULES = ("all", "surfaces", "runs", "references", "dataset", "figures", "report", "publish")
# Measured times outweigh expected ones once the jobs have taken this long, in s.
PRIOR_SECONDS = 5.0
# Expected core-seconds of a job without an estimate, which writes a few lines.
DEFAULT_SECONDS = 0.1
# Rule of an output file by the beginning of its path in the folder of results; the first match counts.
RULES = {
    "surfaces/": "surface",
    "runs/": "run",
    "references/boundary_elements/": "boundary_elements",
    "references/loops/": "boundary_element_loop",
    "references/": "reference",
    "dataset/": "campaign_dataset",
    MODEL_ERROR: "model_error",
    "aggregated/": "comparison",
    CHECKS: "checks",
    "figures/": "figure",
    REPORT: "report_page",
}
MOST_JOBS = 8  # running jobs in the live view


@dataclass(frozen=True)
class JobRecord:
    """A job of Snakemake.

    Attributes
    ----------
    rule : its rule.
    title : the message of the rule.
    outputs, logs : paths of its files.
    started, ended : times in s; `ended` is None while it runs.
    threads : cores that it uses.
    """

    rule: str
    title: str
    outputs: tuple[str, ...]
    logs: tuple[str, ...]
    started: float
    ended: float | None = None
    threads: int = 1

    @property
    def seconds(self) -> float:
        """Duration."""
        return (self.ended or self.started) - self.started


@dataclass
class Progress:
    """Jobs of a campaign, updated by the events of Snakemake.

    Another thread must hold `lock` while it reads them.

    Attributes
    ----------
    expected : expected core-seconds of the job of an output file, by the path of the file.
    clock : function that returns the time in s.
    total : number of jobs by rule.
    running, done, failed : the jobs; running ones by their number.
    cores : cores in use; on a cluster, jobs at a time.
    started, called : times of the first plan (None before) and of the call.
    """

    expected: Mapping[str, float] = field(default_factory=dict)
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
        """Apply an event of the logger plugin; return the job that it ended, if any."""
        with self.lock:
            match event["event"]:
                case "run_info":
                    self.total = {
                        rule: count for rule, count in event["stats"].items() if rule not in (*TARGET_RULES, "total")
                    }
                    self.started = self.clock() if self.started is None else self.started
                case "resources_info" if event.get("cores") or event.get("nodes"):
                    self.cores = int(event.get("cores") or event["nodes"])
                case "job_info" if event["rule_name"] not in TARGET_RULES:
                    self.running[event["jobid"]] = JobRecord(
                        event["rule_name"],
                        printable(event["rule_msg"] or event["rule_name"]),
                        tuple(event["output"] or ()),
                        # Snakemake adds remarks in brackets to the path.
                        tuple(log.split(" (")[0] for log in event["log"] or ()),
                        self.clock(),
                        threads=event.get("threads") or 1,
                    )
                case "job_finished" | "job_error" as name:
                    jobs, key = (self.done, "job_id") if name == "job_finished" else (self.failed, "jobid")
                    if job := self.running.pop(event[key], None):
                        jobs.append(replace(job, ended=self.clock()))
                        return jobs[-1]
        return None

    @property
    def job_count(self) -> int:
        """Number of all jobs."""
        return sum(self.total.values())

    def counts(self) -> list[tuple[str, int, int, int, int]]:
        """Return each rule with its numbers of jobs: done, running, failed, all; in the order of the plan."""
        done, failed = (Counter(job.rule for job in jobs) for jobs in (self.done, self.failed))
        running = Counter(job.rule for job in self.running.values())
        return [(rule, done[rule], running[rule], failed[rule], total) for rule, total in self.total.items()]

    def _expected_work(self, job: JobRecord) -> float:
        """Return the core-seconds that a job is expected to take."""
        return max((self.expected.get(output, 0.0) for output in job.outputs), default=0.0) or DEFAULT_SECONDS

    def seconds_left(self) -> float | None:
        """Estimate the time until all jobs are done, from expected and measured times; None if unknown.

        Jobs that cannot run because another one failed count as if they were still to run.
        """
        if self.started is None:
            return None
        now = self.clock()
        ended = [*self.done, *self.failed]
        running = list(self.running.values())
        measured = sum(job.seconds * job.threads for job in ended)
        # Ratio of measured to expected times on this machine.
        slowness = (measured + PRIOR_SECONDS) / (sum(map(self._expected_work, ended)) + PRIOR_SECONDS)
        work = sum(max(self._expected_work(job) * slowness - (now - job.started) * job.threads, 0.0) for job in running)
        return (work + self._waiting_work([*ended, *running]) * slowness) / max(self.cores, 1)

    def _waiting_work(self, begun: list[JobRecord]) -> float:
        """Return the expected core-seconds of the jobs that have not begun.

        Snakemake reports only their number by rule, so each counts as the mean over the files of this rule.
        """
        outputs = {output for job in begun for output in job.outputs}
        expected: dict[str, list[float]] = {}
        for output, seconds in self.expected.items():
            if output not in outputs:
                expected.setdefault(find_rule(output), []).append(seconds)
        waiting = Counter(self.total) - Counter(job.rule for job in begun)
        work = 0.0
        for rule, count in waiting.items():
            seconds = expected.get(rule, [DEFAULT_SECONDS])
            work += count * sum(seconds) / len(seconds)
        return work

    def time_left(self) -> str:
        """Return the estimated time until all jobs are done, as text."""
        seconds = self.seconds_left()
        return "time left unknown" if seconds is None else f"about {formatting.duration(seconds)} left"


def find_rule(output: str) -> str:
    """Return the rule that makes a file under `results/<campaign>/`."""
    path = "/".join(Path(output).parts[2:])
    return next((rule for beginning, rule in RULES.items() if path.startswith(beginning)), "")


def read_error(job: JobRecord, folder: Path) -> list[str]:
    """Return why a job failed: the lines of its log from the last one that begins with `Error:`.

    Empty if the log has no such line, for example because the job was killed.
    """
    for log in job.logs:
        try:
            lines = (folder / log).read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError:
            continue
        starts = [number for number, line in enumerate(lines) if line.startswith("Error:")]
        if starts:
            first, *others = map(printable, lines[starts[-1] :])
            return [first.removeprefix("Error:").strip(), *others]
    return []


def read_last_line(job: JobRecord, folder: Path) -> str:
    """Return the last complete line in the log of a running job."""
    for log in job.logs:
        try:
            with open(folder / log, "rb") as file:
                file.seek(0, 2)
                file.seek(max(0, file.tell() - 400))
                lines = file.read().decode("utf-8", errors="replace").split("\n")[:-1]
        except OSError:
            continue
        return next((printable(line.strip()) for line in reversed(lines) if line.strip()), "")
    return ""


class PlainView(AbstractContextManager):
    """A line for every job that has ended.

    Parameters
    ----------
    progress : the jobs.
    campaign : name of the campaign.
    folder : folder from which paths of logs start.
    """

    def __init__(self, progress: Progress, campaign: str, folder: Path):
        """Take what is printed."""
        self._progress, self._campaign, self.folder = progress, campaign, folder

    def __exit__(self, *error):
        """Nothing remains to be done."""

    def print_job(self, job: JobRecord, failed: bool) -> None:
        """Print how many jobs have ended, the job, and why it failed."""
        progress = self._progress
        ended, total = len(progress.done) + len(progress.failed), str(progress.job_count)
        title = f"failed: {job.title}" if failed else job.title
        echo(f"[{ended:>{len(total)}}/{total}, {progress.time_left()}] {title} ({formatting.duration(job.seconds)})")
        for line in read_error(job, self.folder)[:3] if failed else ():
            echo(f"    {line}")

    def print(self, text: str) -> None:
        """Print a line."""
        echo(text)

    def remark(self, text: str) -> None:
        """Print a remark on the campaign."""
        echo(f"{self._campaign}: {text}")


class LiveView(PlainView):
    """A table of the jobs in a terminal, drawn again and again; failed jobs are printed above it."""

    def __init__(self, progress: Progress, campaign: str, folder: Path, console: Console):
        """Take what is drawn, and the terminal."""
        super().__init__(progress, campaign, folder)
        self._console, self._remark = console, "planning"
        self._live = Live(get_renderable=self._draw, console=console, refresh_per_second=4, transient=True)

    def __enter__(self):
        """Start drawing."""
        self._live.start()
        return self

    def __exit__(self, *error):
        """Remove the table from the terminal."""
        self._live.stop()

    def print_job(self, job: JobRecord, failed: bool) -> None:
        """Print a job if it failed."""
        if failed:
            self._console.print(Text(f"failed: {job.title}", style="red"))
            for line in read_error(job, self.folder)[:3]:
                self._console.print(Text(f"    {line}", style="red"), overflow="fold")

    def print(self, text: str) -> None:
        """Print a line above the table."""
        self._console.print(Text(printable(text), style="yellow"), soft_wrap=True)

    def remark(self, text: str) -> None:
        """Show a remark beside the name of the campaign."""
        self._remark = text

    def _draw(self):
        with self._progress.lock:
            progress = self._progress
            if progress.started is None:
                return Text(f"{self._campaign}: {self._remark} …")
            return Group(self._heading(), self._table(), *self._running())

    def _heading(self) -> Text:
        progress, failed = self._progress, len(self._progress.failed)
        texts = [f"{self._campaign}: {len(progress.done) + failed} of {progress.job_count} jobs"]
        texts += [f"{failed} failed"] if failed else []
        texts += [progress.time_left(), f"{formatting.duration(progress.clock() - progress.started)} so far"]
        texts += [self._remark] if self._remark != "planning" else []
        return Text(", ".join(texts), style="bold")

    def _table(self) -> Table:
        table = Table(box=None, pad_edge=False, header_style="dim")
        for heading in ("", "done", "running", "failed", "of", ""):
            table.add_column(heading, justify="right" if heading else "left")
        for rule, done, running, failed, total in self._progress.counts():
            style = "red" if failed else "green" if done == total else "bold" if running else "dim"
            cells = [str(number) if number else "" for number in (done, running, failed)]
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
