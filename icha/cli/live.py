"""A running campaign: what is known of its jobs from Snakemake's events, and the views that show it."""

import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from icha.datasets.results import CHECKS, MODEL_ERROR, REPORT
from icha.support import formatting
from icha.support.formatting import printable

# Rules that only collect others' files.
_TARGETS = ("all", "surfaces", "runs", "references", "dataset", "figures", "report", "publish")
# How much of the time so far must be behind us before it is trusted more than what was expected, in s.
_PRIOR = 5.0
# Expected of a job of which nothing is known, in core-seconds: it writes a few lines.
DEFAULT_SECONDS = 0.1
# By what their files begin with, below the folder of results; the first that fits.
_RULES = {
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
# Running jobs that are shown.
_MOST_JOBS = 8


@dataclass(frozen=True)
class Job:
    """A job: its rule, what it says of itself, its outputs and log files, when it started and ended (s), its cores."""

    rule: str
    title: str
    outputs: tuple[str, ...]
    logs: tuple[str, ...]
    started: float
    ended: float | None = None
    threads: int = 1

    @property
    def seconds(self) -> float:
        """How long it took."""
        return (self.ended or self.started) - self.started


@dataclass
class Watch:
    """State of a campaign that Snakemake is running, kept up to date by its events.

    Parameters
    ----------
    expected : core-seconds that the job of an output file is expected to take, by the file's path.
    clock : time in s.

    Whoever reads it while another thread feeds it holds its `lock`.
    """

    expected: Mapping[str, float] = field(default_factory=dict)
    clock: Callable[[], float] = time.monotonic
    total: dict[str, int] = field(default_factory=dict)
    running: dict[int, Job] = field(default_factory=dict)
    done: list[Job] = field(default_factory=list)
    failed: list[Job] = field(default_factory=list)
    cores: int = 1  # of a cluster: jobs at a time
    started: float | None = None
    lock: threading.RLock = field(default_factory=threading.RLock)

    def __post_init__(self):
        """Keep when it was called."""
        self.called = self.clock()

    def take(self, event: Mapping) -> Job | None:
        """Take in one event of the logger plugin; return the job that it has ended, if any."""
        with self.lock:
            return self._take(event)

    def _take(self, event):
        match event["event"]:
            case "run_info":
                counts = {rule: count for rule, count in event["stats"].items() if rule not in (*_TARGETS, "total")}
                self.total = dict(counts)
                self.started = self.clock() if self.started is None else self.started
            case "resources_info" if event.get("cores") or event.get("nodes"):
                self.cores = int(event.get("cores") or event["nodes"])
            case "job_info" if event["rule_name"] not in _TARGETS:
                job = Job(
                    event["rule_name"],
                    printable(event["rule_msg"] or event["rule_name"]),
                    tuple(event["output"] or ()),
                    tuple(_path(log) for log in event["log"] or ()),
                    self.clock(),
                    threads=event.get("threads") or 1,
                )
                self.running[event["jobid"]] = job
            case "job_finished" if event["job_id"] in self.running:
                return self._ended(event["job_id"], self.done)
            case "job_error" if event["jobid"] in self.running:
                return self._ended(event["jobid"], self.failed)
        return None

    def _ended(self, number, where):
        job = self.running.pop(number)
        job = replace(job, ended=self.clock())
        where.append(job)
        return job

    @property
    def job_count(self) -> int:
        """Number of jobs in all."""
        return sum(self.total.values())

    def counts(self) -> list[tuple[str, int, int, int, int]]:
        """Rule, and how many of its jobs are done, running, failed and there in all; in the order of the plan."""
        done, failed = (Counter(job.rule for job in jobs) for jobs in (self.done, self.failed))
        running = Counter(job.rule for job in self.running.values())
        return [(rule, done[rule], running[rule], failed[rule], total) for rule, total in self.total.items()]

    def work_of(self, job: Job) -> float:
        """Core-seconds that a job is expected to take."""
        return max((self.expected.get(output, 0.0) for output in job.outputs), default=0.0) or DEFAULT_SECONDS

    def seconds_left(self) -> float | None:
        """Time until everything is done, from what is expected of the jobs and how long others took; None if unknown.

        Jobs that a failed one keeps from running count as if they were still to come.
        """
        if self.started is None:
            return None
        now = self.clock()
        ended = [*self.done, *self.failed]
        ended_work = sum(map(self.work_of, ended))
        taken = sum(job.seconds * job.threads for job in ended)
        # How much longer than expected jobs take on this machine, in this company.
        slowness = (taken + _PRIOR) / (ended_work + _PRIOR)
        running = self.running.values()
        begun = sum(max(self.work_of(job) * slowness - (now - job.started) * job.threads, 0.0) for job in running)
        waiting = Counter(self.total) - Counter(job.rule for job in [*ended, *running])
        return (begun + self._work_waiting(waiting) * slowness) / max(self.cores, 1)

    def _work_waiting(self, waiting):
        """Expected core-seconds of the jobs that have not begun: by rule, for which files they are for is not told."""
        known = {output for job in [*self.done, *self.failed, *self.running.values()] for output in job.outputs}
        left: dict[str, list[float]] = {}
        for output, seconds in self.expected.items():
            if output not in known:
                left.setdefault(rule_of(output), []).append(seconds)
        work = 0.0
        for rule, count in waiting.items():
            # Which of the files that are not there yet are to be made is not known, so they count by their mean.
            seconds = left.get(rule)
            work += count * (sum(seconds) / len(seconds) if seconds else DEFAULT_SECONDS)
        return work


def rule_of(output: str) -> str:
    """The rule whose job makes a file under `results/<campaign>/`."""
    inside = "/".join(Path(output).parts[2:])
    return next((rule for beginning, rule in _RULES.items() if inside.startswith(beginning)), "")


def _path(log: str) -> str:
    # Snakemake adds what is special about a file in brackets.
    return log.split(" (")[0]


def reason_of(job: Job, folder: Path) -> list[str]:
    """Why a job failed: the lines of its log from the one that begins with `Error:` on.

    Empty if the job said nothing, for example because it was killed.
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


def last_line(job: Job, folder: Path) -> str:
    """What a running job has last said."""
    for log in job.logs:
        try:
            with open(folder / log, "rb") as file:
                file.seek(0, 2)
                file.seek(max(0, file.tell() - 400))
                lines = file.read().decode("utf-8", errors="replace").split("\n")
        except OSError:
            continue
        # Whole lines only.
        said = [line for line in lines[:-1] if line.strip()]
        return printable(said[-1].strip()) if said else ""
    return ""


class LiveView:
    """Draws a `Watch` over and over in a terminal."""

    def __init__(self, watch: Watch, campaign: str, folder: Path, console: Console):
        """Keep what is drawn; `folder` is where paths of logs start."""
        self._watch, self._campaign, self.folder, self._console = watch, campaign, folder, console
        self._remark = "planning"
        self._live = Live(get_renderable=self._draw, console=console, refresh_per_second=4, transient=True)

    def __enter__(self):
        """Begin to draw."""
        self._live.start()
        return self

    def __exit__(self, *error):
        """Draw no more, and leave the terminal to what is printed next."""
        self._live.stop()

    def ended(self, job: Job, failed: bool) -> None:
        """Print a failed job above the table, where it stays."""
        if failed:
            self._console.print(Text(f"failed: {job.title}", style="red"))
            for line in reason_of(job, self.folder)[:3]:
                self._console.print(Text(f"    {line}", style="red"), overflow="fold")

    def tell(self, text: str) -> None:
        """Print a line above the table, where it stays."""
        self._console.print(Text(printable(text), style="yellow"), soft_wrap=True)

    def remark(self, text: str) -> None:
        """Say `text` beside the campaign's name from now on."""
        self._remark = text

    def _draw(self):
        with self._watch.lock:
            return self._picture()

    def _picture(self):
        watch = self._watch
        if watch.started is None:
            return Text(f"{self._campaign}: {self._remark} …")
        ended, failed = len(watch.done) + len(watch.failed), len(watch.failed)
        parts = [f"{self._campaign}: {ended} of {watch.job_count} jobs"]
        parts += [f"{failed} failed"] if failed else []
        parts += [time_left(watch), f"{formatting.duration(watch.clock() - watch.started)} so far"]
        parts += [self._remark] if self._remark != "planning" else []
        table = Table(box=None, pad_edge=False, header_style="dim")
        for heading in ("", "done", "running", "failed", "of", ""):
            table.add_column(heading, justify="right" if heading else "left")
        for rule, done, running, gone, total in watch.counts():
            style = "red" if gone else "green" if done == total else "bold" if running else "dim"
            bar = ProgressBar(total=total, completed=done + gone, width=20)
            cells = [str(number) if number else "" for number in (done, running, gone)]
            table.add_row(rule.replace("_", " "), *cells, str(total), bar, style=style)
        lines = []
        for job in sorted(watch.running.values(), key=lambda job: job.started)[:_MOST_JOBS]:
            lines.append(Text(f"▸ {formatting.duration(watch.clock() - job.started):>8}  {job.title}", no_wrap=True))
            if said := last_line(job, self.folder):
                lines.append(Text(f"            {said}", style="dim", no_wrap=True))
        if more := len(watch.running) - _MOST_JOBS:
            lines += [Text(f"  and {more} more", style="dim")] if more > 0 else []
        return Group(Text(", ".join(parts), style="bold"), table, *lines)


class PlainView:
    """A line for every job that has ended."""

    def __init__(self, watch: Watch, campaign: str, folder: Path, say: Callable[[str], None]):
        """Keep where the lines go; `folder` is where paths of logs start."""
        self._watch, self._campaign, self.folder, self._say = watch, campaign, folder, say

    def __enter__(self):
        """Begin."""
        return self

    def __exit__(self, *error):
        """End."""

    def ended(self, job: Job, failed: bool) -> None:
        """Say how far the campaign is, which job has ended, and why if it failed."""
        watch = self._watch
        ended = len(watch.done) + len(watch.failed)
        what = "failed: " if failed else ""
        count = f"{ended:>{len(str(watch.job_count))}}/{watch.job_count}"
        self._say(f"[{count}, {time_left(watch)}] {what}{job.title} ({formatting.duration(job.seconds)})")
        for line in reason_of(job, self.folder)[:3] if failed else ():
            self._say(f"    {line}")

    def tell(self, text: str) -> None:
        """Print a line."""
        self._say(text)

    def remark(self, text: str) -> None:
        """Say it."""
        self._say(f"{self._campaign}: {text}")


def time_left(watch: Watch) -> str:
    """How long it still takes, in words."""
    seconds = watch.seconds_left()
    return "time left unknown" if seconds is None else f"about {formatting.duration(seconds)} left"
