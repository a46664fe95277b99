"""The folder in which a deposit is computed again: what of the deposit goes there, and which runs are asked for."""

import contextlib
import difflib
import hashlib
import os
import re
import shutil
import sys
import tempfile
import textwrap
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from importlib.metadata import version
from pathlib import Path

import netCDF4

from icha.configuration.yaml_files import read_yaml
from icha.datasets.attributes import why_no_result
from icha.datasets.results import CONFIGURATION
from icha.deposit.deposit_files import CHECKSUMS, COMPUTED, SOURCE, copy_file, read_file
from icha.deposit.environment import differences
from icha.deposit.source import PROGRAM
from icha.deposit.strangers_files import Found, unpack
from icha.planning.needs import BY_TAMAAS, TAMAAS
from icha.support.checksums import sha256_of
from icha.support.in_words import counted
from icha.support.input_files import refuse_traps
from icha.support.program import own_workflow, package_of
from icha.support.values import NAME_PATTERN

SMALLEST = "smallest"
# Of the program in a deposit: what says its version, those of all packages, and what installs them.
PYPROJECT, LOCK, _MAKEFILE = f"{SOURCE}/pyproject.toml", f"{SOURCE}/uv.lock", f"{SOURCE}/Makefile"
# What it takes to run that program.
OWN_SOURCE = (f"{SOURCE}/Snakefile", _MAKEFILE, LOCK)
# In the folder of a rerun: what it is of, the deposit's files if it is a zip, the project with or without its source.
# The deposit's program may write to its source alone, so that nothing else here is anything but what we made of it.
_BEGUN, _UNPACKED, PROJECT, _DATA = "rerun-of.sha256", "deposit", SOURCE, "data"
# Variables that are passed on: of language, numerical libraries and certificates, and how large a data file may be.
_PASSED = re.compile(
    r"HOME|ICHA_INPUT_MB|LANG|LANGUAGE|LC_\w+|PATH|TERM|TMPDIR|TZ|(MKL|OMP|OPENBLAS)_\w+|"
    r"NO_PROXY|no_proxy|SSL_CERT_(FILE|DIR)|(REQUESTS|CURL)_CA_BUNDLE|"
    r"PIP_(CERT|NO_INDEX)|UV_(CACHE_DIR|OFFLINE|SYSTEM_CERTS)"
)
# Addresses of proxies and packages, which are passed on if no user name or password is before an @ in them.
_ADDRESS = re.compile(
    r"(ALL|HTTPS?)_PROXY|(all|https?)_proxy|PIP_(EXTRA_INDEX_URL|FIND_LINKS|INDEX_URL)|"
    r"UV_(DEFAULT_INDEX|EXTRA_INDEX_URL|FIND_LINKS|INDEX|INDEX_URL)"
)
_RUN = re.compile(r"runs(/[^/]+){4}/[^/]+\.nc")
# Characters of a reason that are told.
_LONGEST = 120


class Refused(ValueError):
    """A rerun that cannot be begun; the message says why, and what can."""


def campaign_of(deposit: Found, needed: Iterable[str]) -> dict:
    """The configuration of a deposit that has the files needed, with the name of its campaign; else `Refused`."""
    for file in (CONFIGURATION, *needed):
        if file not in deposit.sizes:
            raise Refused(f"{deposit.path}: has no {file}, so it cannot be computed again")
    if not any(name.split("/")[0] in COMPUTED for name in deposit.sizes):
        raise Refused(f"{deposit.path}: has no results, so there is nothing to compare with")
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch, CONFIGURATION)
        try:
            file.write_bytes(read_file(deposit, CONFIGURATION))
            content = read_yaml(file)
        except ValueError as error:
            raise Refused(f"{deposit.path}: {str(error).replace(str(file), CONFIGURATION)}") from None
    name = content.get("name")
    if not (isinstance(name, str) and re.fullmatch(NAME_PATTERN, name)):
        raise Refused(f"{deposit.path}: {CONFIGURATION}: name: {name!r}: is no name of a campaign")
    return content


def unlike_installed(deposit: Found) -> list[str]:
    """In what the program of a deposit is not the one installed, a line each: version, versions of packages."""
    try:
        made_by = tomllib.loads(read_file(deposit, PYPROJECT).decode("utf-8"))["project"]["version"]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise Refused(f"{deposit.path}: {PYPROJECT}: has no version of the program") from None
    own, wrong = version("icha"), unlike_lock(deposit)
    return [*([] if made_by == own else [f"  icha: {own} is installed, {made_by} made the deposit"]), *wrong]


def unlike_lock(deposit: Found) -> list[str]:
    """Packages that are installed in another version than in the lock file of a deposit, a line each."""
    try:
        return differences(read_file(deposit, LOCK).decode("utf-8"))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise Refused(f"{deposit.path}: {LOCK}: is no lock file of uv") from None


def changed_files(deposit: Found) -> int:
    """How many files of the program in a deposit are not those of the program that is installed: package, workflow."""
    lines = read_file(deposit, CHECKSUMS).decode("utf-8").splitlines()
    listed = (line.partition("  ")[::2] for line in lines)
    theirs = {name.removeprefix(f"{SOURCE}/"): digest for digest, name in listed if name.startswith(f"{SOURCE}/")}
    theirs = {name: digest for name, digest in theirs.items() if f"{name}/".startswith(tuple(f"{p}/" for p in PROGRAM))}
    ours = {name: sha256_of(file) for name, file in _installed_files()}
    return sum(theirs.get(name) != ours.get(name) for name in {*theirs, *ours})


def _installed_files() -> Iterator[tuple[str, Path]]:
    """The files of the program that is installed, with their names in the repository."""
    workflow = own_workflow()
    for part in PROGRAM:
        top = package_of(workflow) if part == "icha" else workflow / part
        for file in [top] if top.is_file() else top.rglob("*"):
            if file.is_file() and "__pycache__" not in file.parts:
                yield (Path(part) / file.relative_to(top)).as_posix(), file


def asked_runs(only: Iterable[str], deposit: Found) -> list[str]:
    """Paths of the runs that are asked for by name, or by `SMALLEST`.

    Parameters
    ----------
    only : names, `study/surface/seed1/slope1/material`.
    deposit : the files of a deposit that is whole.

    Raises
    ------
    Refused
        If there is no such run, or if it holds no data.
    """
    there = sorted(name for name in deposit.sizes if _RUN.fullmatch(name))
    found = []
    for asked in only:
        if asked == SMALLEST and there:
            path = _smallest(deposit, there)
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


def _smallest(deposit: Found, runs: list[str]) -> str:
    """The complete run that, with its surface, has the fewest bytes."""
    sizes = deposit.sizes
    for run in sorted(runs, key=lambda run: sizes[run] + sizes.get(surface_of(run), 0)):
        steps, failure = _outcome(deposit, run)
        if steps and not failure:
            return run
    raise Refused(
        f"--only {SMALLEST}: no run of the deposit is complete; allowed: the name of a run that has steps, or "
        f"no --only at all"
    )


def _outcome(deposit: Found, run: str) -> tuple[int, str]:
    """Number of steps of a run, and why it is no result; an empty text if it is one."""
    with tempfile.TemporaryDirectory() as scratch:
        copy = Path(scratch, "run.nc")
        copy_file(deposit, run, copy)
        try:
            refuse_traps(copy)
            with netCDF4.Dataset(copy) as file:
                steps = file.dimensions.get("step")
                return (len(steps) if steps is not None else 0), why_no_result(file.__dict__)
        except (OSError, ValueError, RuntimeError) as error:  # the last one for what the library cannot read
            raise Refused(f"{deposit.path}: {run}: is no run: {error}") from None


def surface_of(run: str) -> str:
    """The file of the surface of a run: of `runs/study/surface/seed1/slope1/material.nc`."""
    _, _, surface, seed, *_ = run.split("/")
    return f"surfaces/{surface}/{seed}.nc"


def begin(folder: Path, deposit: Found) -> None:
    """Make the folder, or find in it a rerun of the same deposit that has been begun; `Refused` if it is another's."""
    of = f"{hashlib.sha256(read_file(deposit, CHECKSUMS)).hexdigest()}\n"
    if deposit.path.is_dir() and folder.is_relative_to(deposit.path.resolve()):
        raise Refused(f"--folder {folder}: is in the deposit, which is not written to; allowed: another one")
    begun = folder / _BEGUN
    if begun.is_file():
        if begun.read_text(encoding="ascii", errors="replace") != of:
            raise Refused(f"--folder {folder}: belongs to another deposit; allowed: a new or empty folder")
        return
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise Refused(f"--folder {folder}: has other files in it; allowed: a new or empty folder")
    begun.write_text(of, encoding="ascii")


def prepare(folder: Path, deposit: Found, *, own_source: bool) -> tuple[Path, Path]:
    """The project of the rerun, with the configuration and its files in it, and the deposit as a folder.

    With its own source the project is that; else it is nothing but data.
    """
    from icha.configuration.load import INPUTS

    project, original = folder / (PROJECT if own_source else _DATA), deposit.path
    if not deposit.path.is_dir():
        original = folder / _UNPACKED
        with _whole_folder(original) as part:
            if part:
                unpack(deposit, part)
    with _whole_folder(project) as part:
        if part:
            if own_source:
                _copy_files(deposit, SOURCE, part)
            _copy_files(deposit, INPUTS, part / INPUTS)
            copy_file(deposit, CONFIGURATION, part / CONFIGURATION)
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


def _copy_files(deposit: Found, folder: str, target: Path) -> None:
    """Copy the contents of the files in a folder of a deposit, and not that nobody may write to them."""
    for name in deposit.sizes:
        if name.startswith(f"{folder}/"):
            copy_file(deposit, name, target / name.removeprefix(f"{folder}/"))


def environment_target(deposit: Found, campaign: Mapping) -> str:
    """The target of the Makefile in a deposit that installs all that its campaign needs; older ones have one for all.

    The deposit's own, for the copy in the project may be another by now.
    """
    try:
        makefile = read_file(deposit, _MAKEFILE).decode("utf-8", errors="replace")
    except ValueError as error:
        raise Refused(f"{deposit.path}: {error}") from None
    has_it = re.search(rf"^{TAMAAS}:", makefile, re.MULTILINE)
    return TAMAAS if has_it and any(campaign.get(section) for section in BY_TAMAAS) else "environment"


def surroundings() -> dict[str, str]:
    """The environment variables of the rerun: those of the caller that are known to be needed and hold no secret."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if _PASSED.fullmatch(name) or (_ADDRESS.fullmatch(name) and "@" not in value)
    }
    own = Path(sys.prefix).resolve()
    if sys.prefix != sys.base_prefix:
        path = kept.get("PATH", os.defpath).split(os.pathsep)
        kept["PATH"] = os.pathsep.join(part for part in path if part and not Path(part).resolve().is_relative_to(own))
    return kept
