"""The folder in which a deposit is computed again: what of the deposit goes there, and which runs are asked for."""

import contextlib
import difflib
import math
import os
import re
import shutil
import sys
import tempfile
import textwrap
import tomllib
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from pathlib import Path

import netCDF4

from icha.configuration.yaml_files import read_yaml
from icha.datasets.results import CONFIGURATION
from icha.planning.software import BY_TAMAAS, TAMAAS
from icha.publication.deposit_files import CHECKSUMS, COMPUTED, read_file
from icha.publication.environment import differences
from icha.publication.strangers_files import NO_LIMITS, looked_through, unpack
from icha.support.checksums import sha256_of
from icha.support.in_words import counted
from icha.support.values import NAME_PATTERN

SMALLEST = "smallest"
# Of the program in a deposit: what says its version, and those of all packages.
PROGRAM, LOCK = "source/pyproject.toml", "source/uv.lock"
# What it takes to run that program.
OWN_SOURCE = ("source/Snakefile", "source/Makefile", LOCK)
# In the folder of a rerun: what it is of, the deposit's files if it is a zip, the project with or without its source.
_BEGUN, _UNPACKED, _PROJECT, _DATA = CHECKSUMS, "deposit", "source", "data"
# Variables that are passed on: of language, numerical libraries and network, and where packages and certificates are.
_PASSED = re.compile(
    r"HOME|LANG|LANGUAGE|LC_\w+|PATH|TERM|TMPDIR|TZ|(MKL|OMP|OPENBLAS)_\w+|"
    r"(ALL|HTTPS?|NO)_PROXY|(all|https?|no)_proxy|SSL_CERT_(FILE|DIR)|(REQUESTS|CURL)_CA_BUNDLE|"
    r"PIP_(CERT|EXTRA_INDEX_URL|FIND_LINKS|INDEX_URL|NO_INDEX)|"
    r"UV_(CACHE_DIR|DEFAULT_INDEX|EXTRA_INDEX_URL|FIND_LINKS|INDEX|INDEX_URL|OFFLINE|SYSTEM_CERTS)"
)
# An address with a user name or a password in it.
_SECRET = re.compile(r"://[^/\s]*@")
_RUN = re.compile(r"runs(/[^/]+){4}/[^/]+\.nc")
# Characters of a reason that are told.
_LONGEST = 120


class Refused(ValueError):
    """A rerun that cannot be begun; the message says why, and what can."""


def campaign_of(deposit: Path, sizes: Mapping[str, int], needed: Iterable[str]) -> dict:
    """The configuration of a deposit that has the files needed, with the name of its campaign; else `Refused`."""
    for file in (CONFIGURATION, *needed):
        if file not in sizes:
            raise Refused(f"{deposit}: has no {file}, so it cannot be computed again")
    if not any(name.split("/")[0] in COMPUTED for name in sizes):
        raise Refused(f"{deposit}: has no results, so there is nothing to compare with")
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch, CONFIGURATION)
        try:
            file.write_bytes(read_file(deposit, CONFIGURATION))
            content = read_yaml(file)
        except ValueError as error:
            raise Refused(f"{deposit}: {str(error).replace(str(file), CONFIGURATION)}") from None
    name = content.get("name")
    if not (isinstance(name, str) and re.fullmatch(NAME_PATTERN, name)):
        raise Refused(f"{deposit}: {CONFIGURATION}: name: {name!r}: is no name of a campaign")
    return content


def unlike_installed(deposit: Path) -> list[str]:
    """In what the program of a deposit is not the one installed, a line each: version, versions of packages."""
    try:
        made_by = tomllib.loads(read_file(deposit, PROGRAM).decode("utf-8"))["project"]["version"]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise Refused(f"{deposit}: {PROGRAM}: has no version of the program") from None
    try:
        wrong = differences(read_file(deposit, LOCK).decode("utf-8"))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise Refused(f"{deposit}: {LOCK}: is no lock file of uv") from None
    own = version("icha")
    return [*([] if made_by == own else [f"  icha: {own} is installed, {made_by} made the deposit"]), *wrong]


def changed_modules(deposit: Path) -> int:
    """How many modules of the package in a deposit are not those of the package that is installed."""
    package, prefix = Path(__file__).parents[1], "source/icha/"
    lines = read_file(deposit, CHECKSUMS).decode("utf-8").splitlines()
    theirs = {name.removeprefix(prefix): digest for digest, _, name in (line.partition("  ") for line in lines)
              if name.startswith(prefix) and name.endswith(".py")}  # fmt: skip
    ours = {path.relative_to(package).as_posix(): sha256_of(path) for path in package.rglob("*.py")}
    return sum(theirs.get(name) != ours.get(name) for name in {*theirs, *ours})


def asked_runs(only: Iterable[str], deposit: Path, sizes: Mapping[str, int]) -> list[str]:
    """Paths of the runs that are asked for by name, or by `SMALLEST`.

    Parameters
    ----------
    only : names, `study/surface/seed1/slope1/material`.
    deposit : a deposit that is whole.
    sizes : bytes of its files by their paths.

    Raises
    ------
    Refused
        If there is no such run, or if it holds no data.
    """
    there = sorted(name for name in sizes if _RUN.fullmatch(name))
    found = []
    for asked in only:
        if asked == SMALLEST and there:
            path = _smallest(deposit, there, sizes)
        else:
            path = f"runs/{asked.removeprefix('runs/').removesuffix('.nc')}.nc"
        if path not in there:
            runs = [run.removeprefix("runs/").removesuffix(".nc") for run in there]
            near = difflib.get_close_matches(asked, runs, 5, 0) or runs[:5]
            raise Refused(
                f"--only {asked}: the deposit has no such run; allowed: {SMALLEST}, or one of its "
                f"{counted(len(runs), 'run')}, such as {', '.join(near)}"
            )
        steps, failure = _outcome(deposit, path)
        if steps == 0:
            why = f" ({textwrap.shorten(failure, _LONGEST, placeholder=' …')})" if failure else ""
            raise Refused(
                f"--only {asked}: this run holds no data{why}, so there is nothing to compare; allowed: a run with at "
                f"least one step, or {SMALLEST}"
            )
        found.append(path)
    return list(dict.fromkeys(found))


def _smallest(deposit: Path, runs: list[str], sizes: Mapping[str, int]) -> str:
    """The complete run that, with its surface, has the fewest bytes."""
    for run in sorted(runs, key=lambda run: sizes[run] + sizes.get(surface_of(run), 0)):
        steps, failure = _outcome(deposit, run)
        if steps and not failure:
            return run
    raise Refused(
        f"--only {SMALLEST}: no run of the deposit is complete; allowed: the name of a run that has steps, or "
        f"no --only at all"
    )


def _outcome(deposit: Path, run: str) -> tuple[int, str]:
    """Number of steps of a run, and why it is incomplete; an empty text if it is complete."""
    try:
        with netCDF4.Dataset(run, memory=read_file(deposit, run, math.inf)) as file:
            steps = file.dimensions.get("step")
            return (len(steps) if steps is not None else 0), str(getattr(file, "incomplete", ""))
    except OSError as error:
        raise Refused(f"{deposit}: {run}: is no run: {error}") from None


def surface_of(run: str) -> str:
    """The file of the surface of a run: of `runs/study/surface/seed1/slope1/material.nc`."""
    _, _, surface, seed, *_ = run.split("/")
    return f"surfaces/{surface}/{seed}.nc"


def begin(folder: Path, deposit: Path) -> None:
    """Make the folder, or find in it a rerun of the same deposit that has been begun; `Refused` if it is another's."""
    checksums = read_file(deposit, CHECKSUMS)
    if deposit.is_dir() and folder.is_relative_to(deposit.resolve()):
        raise Refused(f"--folder {folder}: is in the deposit, which is not written to; allowed: another one")
    begun = folder / _BEGUN
    if begun.is_file():
        if begun.read_bytes() != checksums:
            raise Refused(f"--folder {folder}: belongs to another deposit; allowed: a new or empty folder")
        return
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise Refused(f"--folder {folder}: has other files in it; allowed: a new or empty folder")
    begun.write_bytes(checksums)


def prepare(folder: Path, deposit: Path, *, own_source: bool) -> tuple[Path, Path]:
    """The project of the rerun, with the configuration and its files in it, and the deposit as a folder.

    With its own source the project is that; else it is nothing but data.
    """
    project, original = folder / (_PROJECT if own_source else _DATA), deposit
    if not deposit.is_dir():
        original = folder / _UNPACKED
        with _whole_folder(original) as part, looked_through(deposit, NO_LIMITS) as found:
            if part:
                unpack(found, part)
    with _whole_folder(project) as part:
        if part:
            if own_source:
                _copy_files(original / "source", part)
            _copy_files(original / "inputs", part / "inputs")
            shutil.copyfile(original / CONFIGURATION, part / CONFIGURATION)
    return project, original


def refuse_wrong_configuration(project: Path) -> None:
    """`Refused` if the configuration is none that this program can run, or names files that are not in the deposit."""
    from icha.configuration.errors import ConfigurationError
    from icha.configuration.load import load_configuration

    try:
        load_configuration(project / CONFIGURATION, within=project)
    except ConfigurationError as error:
        raise Refused(f"the configuration of the deposit cannot be run:\n{error}") from None


@contextlib.contextmanager
def _whole_folder(folder: Path):
    """Give a new folder that gets its name when the block ends well; None if it is there already."""
    if folder.is_dir():
        yield None
        return
    part = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir()
    yield part
    part.rename(folder)


def _copy_files(source: Path, target: Path) -> None:
    """Copy the contents of files, and not that nobody may write to them."""
    for file in source.rglob("*"):
        if file.is_file():
            (target / file.relative_to(source)).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, target / file.relative_to(source))


def environment_target(project: Path, campaign: Mapping) -> str:
    """The target of the project's Makefile that installs all that its campaign needs; older ones have one for all."""
    makefile = (project / "Makefile").read_text(encoding="utf-8", errors="replace")
    has_it = re.search(rf"^{TAMAAS}:", makefile, re.MULTILINE)
    return TAMAAS if has_it and any(campaign.get(section) for section in BY_TAMAAS) else "environment"


def surroundings() -> dict[str, str]:
    """The environment variables of the rerun: those of the caller that are known to be needed and hold no secret."""
    kept = {name: value for name, value in os.environ.items() if _PASSED.fullmatch(name) and not _SECRET.search(value)}
    own = Path(sys.prefix).resolve()
    if sys.prefix != sys.base_prefix:
        path = kept.get("PATH", os.defpath).split(os.pathsep)
        kept["PATH"] = os.pathsep.join(part for part in path if part and not Path(part).resolve().is_relative_to(own))
    return kept
