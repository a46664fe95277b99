"""The view of a running campaign: a table that is drawn anew in a terminal, a line for every job elsewhere."""

from collections.abc import Callable
from pathlib import Path

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from icha.cli.events import Job, Watch, last_line, reason_of
from icha.support import in_words
from icha.support.printable import printable

# Running jobs that are shown.
_MOST_JOBS = 8


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
        parts += [time_left(watch), f"{in_words.duration(watch.clock() - watch.started)} so far"]
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
            lines.append(Text(f"▸ {in_words.duration(watch.clock() - job.started):>8}  {job.title}", no_wrap=True))
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
        self._say(f"[{count}, {time_left(watch)}] {what}{job.title} ({in_words.duration(job.seconds)})")
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
    return "time left unknown" if seconds is None else f"about {in_words.duration(seconds)} left"
