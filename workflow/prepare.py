"""Preparations before Snakemake plans jobs: read the configuration, lock the results, remove outdated results."""

import contextlib
import fcntl
import os
import re
import sys
from collections.abc import Mapping
from pathlib import Path

from snakemake.logging import logger

from icha.configuration.errors import ConfigurationError
from icha.configuration.load import Configuration, load_configuration
from icha.datasets.stamp import OTHER_LICENCE, Stamp, outdated, state_licence
from icha.planning.ownership import claim, find_conflict
from icha.support.atomic_files import is_left_over, probe_folder
from icha.support.formatting import format_count, printable, printable_lines

DEFAULT = "config/config.yaml"
ANOTHER_FOLDER = "use another folder: `icha run --directory FOLDER`, `snakemake --directory FOLDER`"
# Options of Snakemake with which a call reads the workflow, but runs no job.
REPORTING = re.compile(
    "--(touch|report|summary|detailed-summary|list.*|l[ciptu]|dag|rulegraph|filegraph|d3dag|lint|archive|unlock|delete.*|"
    "cleanup-metadata|cm|containerize|generate-unit-tests|print-compilation|conda-c.*|list-conda-envs)|-[tlSD]"
)
TARGET = re.compile("all|surfaces|runs|references|dataset|figures|report|publish|results/.*")


def targets_of(arguments: list[str]) -> list[str]:
    """Return the targets on a command line. Snakemake itself names them only after it has read the workflow."""
    return [argument for argument in arguments[1:] if TARGET.fullmatch(argument)]


def read_configuration(workflow, root: str) -> Configuration:
    """Read the file of `--configfile`, or the default file in `root`, and replace values by those of `--config`.

    Snakemake's own `config` is not used, because Snakemake would merge two files and accept duplicate keys. If the
    configuration has errors, the program ends with the list of the errors.
    """
    settings = workflow.config_settings
    files = [_shorten(path) for path in settings.configfiles]
    try:
        if len(files) > 1:
            names = ", ".join(map(str, files))
            raise ConfigurationError(f"--configfile: {names}; expected one file, because one file describes a campaign")
        file = files[0] if files else _shorten(Path(root, DEFAULT))
        configuration = load_configuration(file, dict(settings.config), results="results")
    except ConfigurationError as error:
        raise SystemExit(f"The configuration cannot be run:\n{printable_lines(error)}") from None
    for warning in configuration.warnings:
        logger.warning(f"Warning: {printable(warning)}")
    return configuration


def _shorten(path: str | Path) -> Path:
    """Return a path in the working directory as a relative path, which remains valid in a copy of the directory."""
    path = Path(path)
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


class Results:
    """Folder of results of one campaign. One call of Snakemake at a time computes results in the folder."""

    def __init__(self, folder: str, file: str, stamps: Mapping[str, Stamp], *, dry_run: bool = False):
        """Lock the folder and remove outdated results, because Snakemake computes what is missing.

        A dry run or a call that only reports changes nothing. No configuration but `file` may own the folder. `stamps`
        are the expected stamps of computed files, by path.
        """
        self.folder, self._origin = Path(folder), Path(file).resolve()
        if reason := find_conflict(self.folder, self._origin):
            raise SystemExit(f"{reason} Nothing was computed.")
        self._reports = dry_run or any(REPORTING.fullmatch(argument.partition("=")[0]) for argument in sys.argv[1:])
        self._other_process = None if self._reports else hold_lock(f".snakemake/{self.folder.name}.lock")
        try:
            wrong = dict(outdated(stamps))
        except OSError as error:
            raise SystemExit(f"{folder}: results cannot be read: {error}. Nothing was computed.") from None
        again = [path for path, reason in wrong.items() if reason != OTHER_LICENCE]
        if relicensed := len(wrong) - len(again):
            logger.warning(f"other licence, will be stated without computing: {format_count(relicensed, 'file')}")
        if again:
            others = f" and {format_count(len(again) - 1, 'more result')}" if len(again) > 1 else ""
            logger.warning(f"outdated, to be computed again: {again[0]} ({wrong[again[0]]}){others}")
        if not self._reports and not self._other_process:
            for path, reason in wrong.items():
                with _report_unwritable(os.path.dirname(path)):
                    state_licence(path, stamps[path]["license"]) if reason == OTHER_LICENCE else os.unlink(path)

    def begin(self) -> None:
        """Prepare the folder before the first job starts; end if another process runs the campaign."""
        if self._other_process:
            raise SystemExit(
                f"Process {self._other_process} is running this campaign in this directory; wait for it to end, or "
                "stop it."
            )
        if "\\" in os.path.abspath(self.folder):
            raise SystemExit(
                f"{os.path.abspath(self.folder)} has a backslash, which the netCDF library reads as a slash, so "
                f"results could not be read. Nothing was computed. Rename the folder, or {ANOTHER_FOLDER}."
            )
        for folder in (self.folder, Path(".snakemake")):
            with _report_unwritable(folder):
                folder.mkdir(parents=True, exist_ok=True)
                if reason := probe_folder(folder):
                    raise reason
        self.remove_left_over()
        claim(self.folder, self._origin)

    def remove_left_over(self) -> None:
        """Remove temporary files of killed programs from the results; without the lock, they may be in use."""
        if self._reports or self._other_process:
            return
        for folder, _, names in os.walk(self.folder):
            for name in filter(is_left_over, names):
                Path(folder, name).unlink(missing_ok=True)


@contextlib.contextmanager
def _report_unwritable(folder: str | Path):
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
