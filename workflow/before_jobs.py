"""What is done before Snakemake decides on its jobs, and before it starts them."""

import atexit
import contextlib
import gc
import json
import multiprocessing
import os
import shlex
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from campaign_lock import hold_lock
from snakemake.logging import logger
from snakemake_records import METADATA, file_of, mark_incomplete, record_of

from icha.deposit.program import note_versions
from icha.planning.belonging import belongs_to_another, claim
from icha.support import checksums
from icha.support.atomic_files import is_left_over, why_not_writable
from icha.support.ownership import Superseded, take_over, while_owned
from icha.support.processes import beginning_of, end_with_parent


def end_jobs_with_this_process() -> None:
    """Tell jobs which process wants them, for they end with it: see workflow/scripts/job.py."""
    if sys.platform == "linux":
        os.environ["ICHA_SNAKEMAKE"] = f"{os.getpid()} {beginning_of(os.getpid())}"


def import_nothing_from_here() -> None:
    """Have no Python that is started from here take a file of the working directory for the module of its name."""
    os.environ["PYTHONSAFEPATH"] = "1"


def quote_python() -> None:
    """Have Snakemake call Python by its path as a shell reads it, for it puts that into commands as it stands."""
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


def collect_again() -> None:
    """Collect garbage from now on, but do not look for it in the plan, which stays."""
    gc.collect()
    gc.freeze()
    gc.enable()


def start_without_limit(workflow) -> None:
    """Do without Snakemake's limit of jobs started a second, where jobs run on this machine.

    For the limit's sake every job that ends wakes the scheduler once a second from then on: of a thousand short jobs
    that takes most of a core. There is no option to leave it out.
    """
    if workflow.local_exec:
        workflow.scheduler.job_rate_limiter = None


class Origin:
    """The configuration file of a campaign, to which its results are to belong."""

    def __init__(self, results: str, name: str, file: str, workflow: str):
        """Refuse results that belong to another file, before anything of them is touched."""
        self.results, self.file, self.workflow = Path(results), Path(file).resolve(), Path(workflow)
        if reason := belongs_to_another(self.results, name, self.file, self.workflow):
            raise SystemExit(f"{reason} Nothing was computed.")

    def claim(self) -> None:
        """Record that the results belong to it, where that can be written."""
        with contextlib.suppress(OSError):
            claim(self.results, self.file, self.workflow)

    def note_versions(self) -> None:
        """Record with which versions of packages results are made from now on."""
        with contextlib.suppress(OSError):
            note_versions(self.results)


class Campaign:
    """A campaign in this working directory that is about to be run: its results looked at, its lock held.

    The Snakefile is read before all else, also for calls that only report or clean up. Those are not kept from it by
    the lock: what has jobs to start is (`refuse_second`).
    """

    def __init__(self, results: str, *, dry_run: bool):
        """Look at the folder `results`; a dry run changes nothing."""
        self.results, self.dry_run = results, dry_run
        self._other = None if dry_run else hold_lock(f".snakemake/{Path(results).name}.lock")
        not_whole = checksums.damaged(results)
        unknown = dict(_of_unknown_origin(results))
        if self._other and (not_whole or unknown):
            self.refuse_second()
        for path in not_whole:
            self._set_aside(path, "damaged", dry_run)
        for path, record in unknown.items():
            if path not in not_whole and os.path.exists(f"{results}/{path}"):
                self._set_aside(path, "Snakemake's record of it is damaged", dry_run)
            if not dry_run:
                record.unlink()  # Snakemake breaks off at some of them
        if dry_run:
            return
        if not METADATA.is_dir() or not os.access(".snakemake", os.W_OK):
            self.refuse_unwritable()  # nothing was computed yet, or Snakemake could not keep its records
        elif os.path.isdir(results) and not os.access(results, os.W_OK):
            # Of what is missing there Snakemake says only that it is protected.
            text = f"{results} cannot be written to: what is not there cannot be computed"
            logger.warning(text, extra={"remark": text})

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
        if self._other:
            self.refuse_second()
        for path, _ in [] if self.dry_run else unseen:
            try:
                mark_incomplete(f"{self.results}/{path}")
            except OSError as error:
                raise SystemExit(_unwritable(".snakemake", error.strerror)) from None
        first, why = unseen[0]
        others = f" and {len(unseen) - 1} more results" if len(unseen) > 1 else ""
        text = f"to be made again: {self.results}/{first} ({why}){others}"
        logger.warning(text, extra={"remark": text})

    def _is_seen(self, path):
        """Whether Snakemake's record of a result belongs to what is there, so that it sees for itself what differs."""
        try:
            record = json.loads(record_of(f"{self.results}/{path}", METADATA).read_bytes())
            return checksums.asked_of(record["params"]) == checksums.made_as(self.results, path)
        except (OSError, ValueError, KeyError, TypeError):
            return False

    def _set_aside(self, path: str, why: str, dry_run: bool) -> None:
        """Rename a result that cannot be trusted, so that it is made again, and say so."""
        file = f"{self.results}/{path}"
        aside = ""
        if not dry_run:
            try:
                aside = f" (what was there is {checksums.set_aside(self.results, path).name} now)"
            except OSError as error:
                raise SystemExit(
                    f"{file} is not what was written, by its checksum, and cannot be set aside: {error.strerror}. "
                    f"Make {os.path.dirname(file)} writable, or copy the results elsewhere."
                ) from None
        text = f"{why}, to be made again: {file}{aside}"
        logger.warning(text, extra={"remark": text})

    def own(self) -> None:
        """Own the results from now on, with jobs to start: what an earlier call has left running changes none of them.

        A call that only reports takes nothing from jobs that run. So what one of those has done since the results were
        looked at is looked for once more.
        """
        try:
            take_over(f".snakemake/{Path(self.results).name}.owner")
        except OSError as error:
            raise SystemExit(_unwritable(".snakemake", error.strerror)) from None
        if changed := checksums.damaged(self.results):
            raise SystemExit(
                f"{self.results}/{changed[0]} has changed since the results were looked at, maybe by a job of an "
                f"earlier call. Nothing was computed; give the same command again."
            )

    def refuse_second(self) -> None:
        """End the program with a message if another one runs the campaign."""
        if self._other:
            raise SystemExit(
                f"Process {self._other} is running this campaign in this directory; wait for it to end, or end it "
                f"first."
            )

    @staticmethod
    def refuse_without(missing: str | None) -> None:
        """End the program with a message if software is missing that the campaign needs."""
        if missing:
            raise SystemExit(f"{missing} Nothing was computed.")

    def refuse_unreadable(self) -> None:
        """End the program with a message if results could be written and not read again."""
        place = os.path.abspath(self.results)
        if "\\" in place:
            raise SystemExit(
                f"{place} has a backslash, which the library of netCDF takes for a slash: no result could be read. "
                f"Nothing was computed. Rename the folder, or work in another one: `icha run --directory FOLDER`, "
                f"`snakemake --directory FOLDER`."
            )

    def refuse_unwritable(self) -> None:
        """End the program with a message if jobs could not write their results."""
        for folder in (self.results, ".snakemake"):
            try:
                Path(folder).mkdir(parents=True, exist_ok=True)
                reason = why_not_writable(Path(folder))
            except OSError as error:
                reason = error
            if reason is not None:
                raise SystemExit(_unwritable(folder, reason.strerror))
        for folder, _, _ in os.walk(self.results):
            if not os.access(folder, os.W_OK | os.X_OK):
                raise SystemExit(_unwritable(folder, "Permission denied"))

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


def _unwritable(folder, reason):
    return (
        f"{folder} cannot be written to: {reason}. Nothing was computed. Make room there or make it writable, or work "
        f"in another folder: `icha run --directory FOLDER`, `snakemake --directory FOLDER`."
    )


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
