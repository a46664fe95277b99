"""Preparations before Snakemake plans jobs, and before Snakemake starts jobs."""

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
from icha.planning.ownership import claim, find_conflict
from icha.support import checksums
from icha.support.atomic_files import Superseded, is_left_over, probe_folder, take_over, while_owned
from icha.support.program import beginning_of, end_with_parent

ANOTHER_FOLDER = "use another folder: `icha run --directory FOLDER`, `snakemake --directory FOLDER`"


def prepare_process() -> None:
    """Set the environment variables that jobs inherit from this process."""
    if sys.platform == "linux":
        # Jobs end when this process ends; see workflow/scripts/job.py.
        os.environ["ICHA_SNAKEMAKE"] = f"{os.getpid()} {beginning_of(os.getpid())}"
    # A file in the working directory must not replace a module of the same name.
    os.environ["PYTHONSAFEPATH"] = "1"
    # Snakemake inserts the path of Python into shell commands without quotes.
    multiprocessing.set_executable(sys.executable)
    sys.executable = shlex.quote(sys.executable)


def end_with_caller() -> None:
    """End this process when `icha run`, which started this process, ends or is killed."""
    if caller := os.environ.get("ICHA_CALLER"):
        end_with_parent(int(caller))


def refuse_superseded() -> None:
    """End this process, which runs jobs on another machine, if a later call owns the results."""
    try:
        with while_owned():
            pass
    except Superseded as error:
        raise SystemExit(f"{error}.") from None


def plan_without_collecting() -> None:
    """Disable garbage collection until the first job starts, and avoid a collection when the process ends.

    Snakemake's plan contains almost no garbage. For ten thousand runs, collection would take a third of planning time.
    """
    gc.disable()
    atexit.register(gc.freeze)


def start_jobs_freely(workflow) -> None:
    """Enable garbage collection of objects younger than the plan; remove Snakemake's limit of job starts per second.

    With Snakemake's limit, each finished local job wakes the scheduler once a second until all jobs are done. After a
    thousand short jobs, the scheduler uses most of a core. Snakemake has no option to disable the limit.
    """
    gc.collect()
    gc.freeze()
    gc.enable()
    if workflow.local_exec:
        workflow.scheduler.job_rate_limiter = None


class CampaignResults:
    """Results of one campaign in the working directory; the results are inspected and locked before jobs start.

    Snakemake also reads the Snakefile for calls that only report or clean up. The lock stops only calls that start jobs
    (`begin`).
    """

    def __init__(self, results: str, name: str, file: str, workflow: str, *, dry_run: bool):
        """Inspect the results; a dry run changes nothing.

        Parameters
        ----------
        results : folder of the results, relative to the working directory; no other configuration may own the folder.
        name : name of the campaign.
        file : configuration file of the campaign.
        workflow : folder of the workflow.
        dry_run : whether this call is a dry run.
        """
        self.results, self.dry_run = results, dry_run
        self._origin = Path(file).resolve(), Path(workflow)
        if reason := find_conflict(Path(results), name, *self._origin):
            raise SystemExit(f"{reason} Nothing was computed.")
        self._other_process = None if dry_run else hold_lock(f".snakemake/{Path(results).name}.lock")
        damaged = checksums.damaged(results)
        records = dict(_damaged_records(results))
        if damaged or records:
            self._refuse_second()
        for path in damaged:
            self._set_aside(path, "damaged")
        for path, record in records.items():
            if path not in damaged and os.path.exists(f"{results}/{path}"):
                self._set_aside(path, "damaged record in Snakemake")
            if not dry_run:
                record.unlink()  # some damaged records stop Snakemake
        if dry_run:
            return
        if os.path.isdir(results):
            self._claim()  # claim results of an older version, even if no job starts
        if not METADATA.is_dir() or not os.access(".snakemake", os.W_OK):
            self._refuse_unwritable()  # nothing was computed yet, or Snakemake could not write its records
        elif os.path.isdir(results) and not os.access(results, os.W_OK):
            # If a folder cannot be written to, Snakemake only reports that missing files are protected.
            _warn(f"cannot write to {results}: missing results cannot be computed")

    def have_stale_made_again(self, paths: Iterable[str], rules: Iterable) -> None:
        """Mark results as incomplete if their settings or inputs have changed, unless Snakemake detects these changes.

        Snakemake compares the settings with its own records. If a result was restored from a backup, its record may be
        missing or may describe another file. For inputs, Snakemake compares time stamps, not contents.

        Parameters
        ----------
        paths : results, relative to the working directory.
        rules : the rules of the workflow.
        """
        rules = [rule for rule in rules if rule.script]
        stale = checksums.stale(
            self.results,
            (os.path.relpath(path, self.results) for path in paths),
            lambda path: _present_settings(rules, f"{self.results}/{path}"),
        )
        unseen = [(path, why) for path, why in stale if why != checksums.OTHER_SETTINGS or not self._is_seen(path)]
        if not unseen:
            return
        self._refuse_second()
        for path, _ in [] if self.dry_run else unseen:
            with _writing(".snakemake"):
                mark_incomplete(f"{self.results}/{path}")
        first, why = unseen[0]
        others = f" and {len(unseen) - 1} more results" if len(unseen) > 1 else ""
        _warn(f"to be made again: {self.results}/{first} ({why}){others}")

    def _is_seen(self, path: str) -> bool:
        """Return whether Snakemake's record describes the present file, so that Snakemake itself detects changes."""
        try:
            record = json.loads(record_of(f"{self.results}/{path}", METADATA).read_bytes())
            return checksums.hash_parameters(record["params"]) == checksums.recorded_hash(self.results, path)
        except (OSError, ValueError, KeyError, TypeError):
            return False

    def _set_aside(self, path: str, why: str) -> None:
        """Rename a result that may be damaged, so that the result is computed again; print a warning."""
        file = f"{self.results}/{path}"
        aside = ""
        if not self.dry_run:
            with _writing(f"{file} does not match its checksum, and cannot be renamed: its folder"):
                aside = f" (the old file is {checksums.set_aside(self.results, path).name})"
        _warn(f"{why}, to be made again: {file}{aside}")

    def begin(self) -> None:
        """Make this call the owner of the results before its first job starts.

        Afterwards, jobs of an earlier call cannot change the results. The results are inspected again, because jobs of
        an earlier call may have changed results since the first inspection. Calls that only report do not use this
        method.

        Raises
        ------
        SystemExit
            If another process runs the campaign, or results cannot be written or read.
        """
        self._refuse_second()
        if "\\" in os.path.abspath(self.results):
            raise SystemExit(
                f"{os.path.abspath(self.results)} has a backslash, which the netCDF library reads as a slash, so "
                f"results could not be read. Nothing was computed. Rename the folder, or {ANOTHER_FOLDER}."
            )
        self._refuse_unwritable()
        with _writing(".snakemake"):
            take_over(f".snakemake/{Path(self.results).name}.owner")
        if changed := checksums.damaged(self.results):
            raise SystemExit(
                f"{self.results}/{changed[0]} has changed while the jobs were planned. Perhaps a job of an earlier "
                "call has changed this file. Nothing was computed; repeat the command."
            )
        self.remove_left_over()
        self._claim()
        with contextlib.suppress(OSError):
            note_versions(Path(self.results))

    def _claim(self) -> None:
        """Record that the results belong to the configuration file, if the record can be written."""
        with contextlib.suppress(OSError):
            claim(Path(self.results), *self._origin)

    def _refuse_second(self) -> None:
        if self._other_process:
            raise SystemExit(
                f"Process {self._other_process} is running this campaign in this directory; wait for it to end, or "
                "stop it."
            )

    def _refuse_unwritable(self) -> None:
        for folder in (self.results, ".snakemake"):
            with _writing(folder):
                Path(folder).mkdir(parents=True, exist_ok=True)
                if reason := probe_folder(Path(folder)):
                    raise reason
        for folder, _, _ in os.walk(self.results):
            with _writing(folder):
                if not os.access(folder, os.W_OK | os.X_OK):
                    raise PermissionError(0, "Permission denied")

    def remove_left_over(self) -> None:
        """Remove temporary files of killed programs from the results."""
        for folder, _, names in os.walk(self.results):
            for name in filter(is_left_over, names):
                Path(folder, name).unlink(missing_ok=True)


class _Wildcards(dict):
    """Wildcards in the form that the functions of rules expect."""

    __getattr__ = dict.__getitem__


def _present_settings(rules, path: str) -> str:
    """Return the checksum of the parameters with which the job would make a result now."""
    rule = next(rule for rule in rules if any(output.match(path) for output in rule.output))
    wildcards = _Wildcards(rule.get_wildcards(path))
    values = (value(wildcards) if callable(value) else value for value in rule.params)
    return checksums.hash_parameters(map(repr, values))


@contextlib.contextmanager
def _writing(folder: str):
    """Context manager: end the program with a message if a folder cannot be written to."""
    try:
        yield
    except OSError as error:
        exists = isinstance(error, FileExistsError | NotADirectoryError)
        reason = "instead of a folder there is a file, or a link to nowhere" if exists else error.strerror
        raise SystemExit(
            f"{folder} cannot be written to: {reason}. Nothing was computed. Free some space, change its "
            f"permissions, or {ANOTHER_FOLDER}."
        ) from None


def _warn(text: str) -> None:
    """Print a warning; the live view of `icha run` shows it too."""
    logger.warning(text, extra={"remark": text})


def _damaged_records(results: str) -> Iterator[tuple[str, Path]]:
    """Yield pairs: a result whose record in Snakemake is damaged (as by a full disk), and the path of this record.

    If a record is damaged, Snakemake stops or considers the result up to date. Snakemake has no public interface that
    lists damaged records.
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


# Locked files. The locks end with this process.
locks = []


def hold_lock(path: str) -> str | None:
    """Lock a file until this process ends; if another process has locked the file, return its process number.

    Snakemake itself creates a file as a lock. A killed program leaves this file behind, and later calls then require
    `--unlock`.
    """
    try:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        # Jobs do not inherit this file, because processes that jobs leave behind would keep the lock.
        file = open(path, "a+", encoding="ascii")
    except OSError:
        return None  # without write permission in this folder, nothing can be computed
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.seek(0)
        return file.read().strip() or "?"
    except OSError:
        return None  # a file system without locks
    locks.append(file)
    with contextlib.suppress(OSError):  # a full disk
        file.truncate(0)
        file.write(f"{os.getpid()}\n")
        file.flush()
    return None
