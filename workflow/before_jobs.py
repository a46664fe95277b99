"""What is done before Snakemake decides on its jobs, and before it starts them."""

import atexit
import contextlib
import fcntl
import gc
import json
import multiprocessing
import os
import shlex
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from snakemake.logging import logger
from snakemake_records import METADATA, file_of, mark_incomplete, record_of

from icha.deposit.program import note_versions
from icha.planning.ownership import belongs_to_another, claim
from icha.support import checksums
from icha.support.atomic_files import Superseded, is_left_over, take_over, while_owned, why_not_writable
from icha.support.program import beginning_of, end_with_parent


def prepare_process() -> None:
    """Set what jobs inherit from this process."""
    if sys.platform == "linux":
        # Jobs end with the process that wants them: see workflow/scripts/job.py.
        os.environ["ICHA_SNAKEMAKE"] = f"{os.getpid()} {beginning_of(os.getpid())}"
    # No Python that is started from here takes a file of the working directory for the module of its name.
    os.environ["PYTHONSAFEPATH"] = "1"
    # Snakemake puts the path of Python into commands of a shell as it stands.
    multiprocessing.set_executable(sys.executable)
    sys.executable = shlex.quote(sys.executable)


def end_with_caller() -> None:
    """End with the `icha run` that has called, however that ends: nobody else would know that this goes on."""
    if caller := os.environ.get("ICHA_CALLER"):
        end_with_parent(int(caller))


def refuse_superseded() -> None:
    """End the program, one that runs jobs of a call on another machine, if a later call owns the results."""
    try:
        with while_owned():
            pass
    except Superseded as error:
        raise SystemExit(f"{error}.") from None


def plan_without_collecting() -> None:
    """Do without Python's collector of garbage until the first job, and for what is left at the end.

    It would go through the growing plan again and again, of which next to nothing is garbage: of the plan of ten
    thousand runs that takes a third of the time.
    """
    gc.disable()
    atexit.register(gc.freeze)


def start_jobs_freely(workflow) -> None:
    """Collect garbage from now on, but not in the plan; do without Snakemake's limit of jobs started a second.

    For the sake of that limit every local job that ends wakes the scheduler once a second from then on: of a thousand
    short jobs that takes most of a core. There is no option to leave it out.
    """
    gc.collect()
    gc.freeze()
    gc.enable()
    if workflow.local_exec:
        workflow.scheduler.job_rate_limiter = None


class Campaign:
    """A campaign in this working directory that is about to be run: its results looked at, its lock held.

    The Snakefile is read before all else, also for calls that only report or clean up. Those are not kept from it by
    the lock: what has jobs to start is (`begin`).
    """

    def __init__(self, results: str, name: str, file: str, workflow: str, *, dry_run: bool):
        """Look at the folder `results`; refuse those of another configuration file before. A dry run changes nothing.

        Parameters
        ----------
        results : the folder, from the working directory.
        name : of the campaign.
        file : its configuration file.
        workflow : the folder of the workflow.
        """
        self.results, self.dry_run = results, dry_run
        self._origin = Path(file).resolve(), Path(workflow)
        if reason := belongs_to_another(Path(results), name, *self._origin):
            raise SystemExit(f"{reason} Nothing was computed.")
        self._other = None if dry_run else hold_lock(f".snakemake/{Path(results).name}.lock")
        not_whole = checksums.damaged(results)
        unknown = dict(_of_unknown_origin(results))
        if not_whole or unknown:
            self._refuse_second()
        for path in not_whole:
            self._set_aside(path, "damaged")
        for path, record in unknown.items():
            if path not in not_whole and os.path.exists(f"{results}/{path}"):
                self._set_aside(path, "Snakemake's record of it is damaged")
            if not dry_run:
                record.unlink()  # Snakemake breaks off at some of them
        if dry_run:
            return
        if os.path.isdir(results):
            self._claim()  # results of an older version, of which nothing may be left to do
        if not METADATA.is_dir() or not os.access(".snakemake", os.W_OK):
            self._refuse_unwritable()  # nothing was computed yet, or Snakemake could not keep its records
        elif os.path.isdir(results) and not os.access(results, os.W_OK):
            # Of what is missing there Snakemake says only that it is protected.
            _remark(f"{results} cannot be written to: what is not there cannot be computed")

    def have_stale_made_again(self, paths: Iterable[str], rules: Iterable) -> None:
        """Have results made again that are not those of what is asked for, where Snakemake does not see it.

        It compares what is asked for with its own records, which may be gone, or be those of another file than is
        there: of one that was restored from a backup. Of inputs it sees times, and not content.

        Parameters
        ----------
        paths : results, from the working directory.
        rules : the rules of the workflow.
        """
        rules = [rule for rule in rules if rule.script]
        found = checksums.stale(
            self.results,
            (os.path.relpath(path, self.results) for path in paths),
            lambda path: _asked_now(rules, f"{self.results}/{path}"),
        )
        unseen = [(path, why) for path, why in found if why != checksums.OTHER_SETTINGS or not self._is_seen(path)]
        if not unseen:
            return
        self._refuse_second()
        for path, _ in [] if self.dry_run else unseen:
            with _writing(".snakemake"):
                mark_incomplete(f"{self.results}/{path}")
        first, why = unseen[0]
        others = f" and {len(unseen) - 1} more results" if len(unseen) > 1 else ""
        _remark(f"to be made again: {self.results}/{first} ({why}){others}")

    def _is_seen(self, path):
        """Whether Snakemake's record of a result belongs to what is there, so that it sees for itself what differs."""
        try:
            record = json.loads(record_of(f"{self.results}/{path}", METADATA).read_bytes())
            return checksums.asked_of(record["params"]) == checksums.made_as(self.results, path)
        except (OSError, ValueError, KeyError, TypeError):
            return False

    def _set_aside(self, path: str, why: str) -> None:
        """Rename a result that cannot be trusted, so that it is made again, and say so."""
        file = f"{self.results}/{path}"
        aside = ""
        if not self.dry_run:
            with _writing(f"{file} is not what was written, by its checksum, and cannot be set aside: its folder"):
                aside = f" (what was there is {checksums.set_aside(self.results, path).name} now)"
        _remark(f"{why}, to be made again: {file}{aside}")

    def begin(self, missing: str | None = None) -> None:
        """Own the results from now on, with jobs to start: what an earlier call has left running changes none of them.

        Ends the program with a message if another one runs the campaign, if results could not be written or read, or if
        software is `missing`. A call that only reports takes nothing from jobs that run. So what one of those has done
        since the results were looked at is looked for once more.
        """
        self._refuse_second()
        if "\\" in os.path.abspath(self.results):
            raise SystemExit(
                f"{os.path.abspath(self.results)} has a backslash, which the library of netCDF takes for a slash: no "
                f"result could be read. Nothing was computed. Rename the folder, or {_ELSEWHERE}."
            )
        self._refuse_unwritable()
        if missing:
            raise SystemExit(f"{missing} Nothing was computed.")
        with _writing(".snakemake"):
            take_over(f".snakemake/{Path(self.results).name}.owner")
        if changed := checksums.damaged(self.results):
            raise SystemExit(
                f"{self.results}/{changed[0]} has changed since the results were looked at, maybe by a job of an "
                f"earlier call. Nothing was computed; give the same command again."
            )
        self.remove_left_over()
        self._claim()
        with contextlib.suppress(OSError):
            note_versions(Path(self.results))

    def _claim(self) -> None:
        """Record that the results belong to the configuration file, where that can be written."""
        with contextlib.suppress(OSError):
            claim(Path(self.results), *self._origin)

    def _refuse_second(self) -> None:
        if self._other:
            raise SystemExit(
                f"Process {self._other} is running this campaign in this directory; wait for it to end, or end it "
                f"first."
            )

    def _refuse_unwritable(self) -> None:
        for folder in (self.results, ".snakemake"):
            with _writing(folder):
                Path(folder).mkdir(parents=True, exist_ok=True)
                if reason := why_not_writable(Path(folder)):
                    raise reason
        for folder, _, _ in os.walk(self.results):
            with _writing(folder):
                if not os.access(folder, os.W_OK | os.X_OK):
                    raise PermissionError(0, "Permission denied")

    def remove_left_over(self) -> None:
        """Remove what killed programs have left among the results, which are this call's own by now."""
        for folder, _, names in os.walk(self.results):
            for name in filter(is_left_over, names):
                Path(folder, name).unlink(missing_ok=True)


class _Wildcards(dict):
    """Wildcards as the functions of rules take them."""

    __getattr__ = dict.__getitem__


def _asked_now(rules, path):
    """Checksum of what the rule that makes a result asks of its job now."""
    rule = next(rule for rule in rules if any(output.match(path) for output in rule.output))
    wildcards = _Wildcards(rule.get_wildcards(path))
    values = (value(wildcards) if callable(value) else value for value in rule.params)
    return checksums.asked_of(map(repr, values))


_ELSEWHERE = "work in another one: `icha run --directory FOLDER`, `snakemake --directory FOLDER`"


@contextlib.contextmanager
def _writing(folder):
    """End the program with a message if the folder cannot be written to."""
    try:
        yield
    except OSError as error:
        raise SystemExit(
            f"{folder} cannot be written to: {error.strerror}. Nothing was computed. Make room there or make it "
            f"writable, or {_ELSEWHERE}."
        ) from None


def _remark(text: str) -> None:
    """Warn; `icha run` shows it, too."""
    logger.warning(text, extra={"remark": text})


def _of_unknown_origin(results: str) -> Iterator[tuple[str, Path]]:
    """Results with a record of Snakemake that is none, as it may be after a full disk: not known to be up to date.

    Snakemake takes such a result for up to date, or breaks off; it has no public reader that would say which those are.
    """
    for folder, _, names in os.walk(METADATA):
        for record in (Path(folder, name) for name in names):
            file = file_of(record, METADATA)
            if file is not None and file.startswith(f"{results}/") and not _is_record(record):
                yield os.path.relpath(file, results), record


def _is_record(file: Path) -> bool:
    try:
        return isinstance(json.loads(file.read_bytes()), dict)
    except ValueError:
        return False


# Open as long as this process lives: the lock ends with it, however it ends.
locks = []


def hold_lock(path: str) -> str | None:
    """Hold the lock `path` until this process ends; return the process that holds it if that is another one.

    Snakemake's own lock is a file, which stays behind when the program is killed; every later call then asks for an
    `--unlock` that nobody dares to give.
    """
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
    locks.append(file)
    with contextlib.suppress(OSError):  # a full disk
        file.truncate(0)
        file.write(f"{os.getpid()}\n")
        file.flush()
    return None
