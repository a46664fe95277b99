"""Prepare the rerun of a deposit with the installed ICHA. No program in the deposit is executed.

The deposit is a folder that `icha.deposit.verify.whole_deposit` has verified before.
"""

import re
import shutil
import tomllib
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path

from icha.configuration.errors import ConfigurationError
from icha.configuration.load import INPUTS, load_configuration
from icha.configuration.yaml_files import read_yaml
from icha.datasets.attributes import why_no_result
from icha.datasets.results import CONFIGURATION
from icha.datasets.stamp import read_stamp
from icha.deposit.program import version_differences
from icha.deposit.verify import CHECKSUMS, SOURCE, files_of, read_text
from icha.planning.results import campaign_files
from icha.support.checksums import sha256_of
from icha.support.formatting import format_count
from icha.support.values import NAME_PATTERN

SMALLEST = "smallest"
# Two files in the source of a deposit: one with the version of the program, one with the versions of all packages.
_PYPROJECT, _LOCK = f"{SOURCE}/pyproject.toml", f"{SOURCE}/uv.lock"
# Entries in the folder of a rerun: file with the checksum of SHA256SUMS, and folder for configuration and results.
_BEGUN, _PROJECT = "rerun-of.sha256", "data"


class RerunError(ValueError):
    """A rerun of a deposit cannot begin; the message gives the reason."""


def campaign_name(deposit: Path) -> str:
    """Return the name of the campaign in a deposit; raise `RerunError` if files are missing or invalid."""
    for file in (CONFIGURATION, _PYPROJECT, _LOCK):
        if not (deposit / file).is_file():
            raise RerunError(f"the deposit has no {file}, which is necessary to compute the results again")
    try:
        read_text(deposit, CONFIGURATION)  # raises ValueError if the file is too large
        name = read_yaml(deposit / CONFIGURATION).get("name")
    except ValueError as error:
        raise RerunError(str(error).replace(f"{deposit}/", "")) from None
    if not (isinstance(name, str) and re.fullmatch(NAME_PATTERN, name)):
        raise RerunError(f"{CONFIGURATION}: name: {name!r} is not the name of a campaign")
    return name


def other_versions(deposit: Path) -> list[str]:
    """List installed packages with other versions than in the lock file of a deposit.

    Raise `RerunError` if another version of ICHA made the deposit, or if the files with versions cannot be read.
    """
    try:
        made_by = tomllib.loads(read_text(deposit, _PYPROJECT))["project"]["version"]
        found = version_differences(read_text(deposit, _LOCK))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise RerunError(
            f"{_PYPROJECT} or {_LOCK} cannot be read; expected a file with the program's version, and a uv lock file"
        ) from None
    if made_by != version("icha"):
        raise RerunError(
            f"icha {version('icha')} is installed, but {made_by} made the deposit; expected the same version. Run "
            "`make environment` in a clone of this version, or in a copy of the deposit's source"
        )
    return [f"  {name}: {text}" for name, text in found.items()]


def find_runs(only: Iterable[str], deposit: Path) -> list[str]:
    """Return the paths of the runs of a deposit that a user selects by name, or by `SMALLEST`.

    A name is `study/surface/seed1/slope1/material`, as in the path of the run. Raise `RerunError` for other names.
    """
    runs = [name for name in files_of(deposit) if name.startswith("runs/") and name.endswith(".nc")]
    found = []
    for name in only:
        path = _smallest(deposit, runs) if name == SMALLEST and runs else f"runs/{_label(name)}.nc"
        if path not in runs:
            such_as = f", such as {_label(runs[0])}" if runs else ""
            raise RerunError(
                f"--only {name}: the deposit has no such run; expected {SMALLEST}, or one of its "
                f"{format_count(len(runs), 'run')}{such_as}"
            )
        found.append(path)
    return list(dict.fromkeys(found))


def _label(path: str) -> str:
    return path.removeprefix("runs/").removesuffix(".nc")


def _smallest(deposit: Path, runs: list[str]) -> str:
    """Return the complete run for which the files of run and surface have the smallest total size."""
    sizes = {run: sum((deposit / path).stat().st_size for path in add_surfaces([run], deposit)) for run in runs}
    for run in sorted(runs, key=lambda run: sizes[run]):
        attributes = read_stamp(deposit / run, ("incomplete", "failed_checks"))
        if attributes is None:
            raise RerunError(f"{run}: is not the file of a run, or is damaged")
        if not why_no_result(attributes):
            return run
    raise RerunError(f"--only {SMALLEST}: no run of the deposit is complete; expected the name of a run")


def add_surfaces(runs: Iterable[str], deposit: Path) -> list[str]:
    """Return the paths of runs and of the surfaces of these runs; leave out surfaces that are not in the deposit."""
    surfaces = dict.fromkeys("surfaces/{2}/{3}.nc".format(*run.split("/")) for run in runs)
    return [*runs, *(path for path in surfaces if (deposit / path).is_file())]


def results_without_scripts(project: Path) -> list[str]:
    """Return the results to compute, relative to the folder of results, if the figures of a rerun include own scripts.

    The scripts of a deposit must not run, so no figure and no report is made. Without scripts the list is empty, and
    everything is computed.
    """
    campaign = load_configuration(project / CONFIGURATION, within=project).campaign
    files = campaign_files(campaign)
    return [*files.verified, files.verdict] if campaign.figures.model_extra else []


def prepare_rerun(folder: Path, deposit: Path) -> Path:
    """Copy configuration and inputs of a deposit to the folder of a rerun, unless an earlier command did so.

    Raise `RerunError` if the folder has other files or belongs to another deposit, or if the configuration cannot be
    run, for example because it names files outside the deposit.
    """
    if folder.resolve().is_relative_to(deposit.resolve()):
        raise RerunError(f"--folder {folder}: is inside the deposit, which must not change; expected another folder")
    digest = f"{sha256_of(deposit / CHECKSUMS)}\n"
    begun, project = folder / _BEGUN, folder / _PROJECT
    if begun.is_file():
        if begun.read_text(encoding="ascii", errors="replace") != digest:
            raise RerunError(f"--folder {folder}: belongs to another deposit; expected a new or empty folder")
    else:
        if folder.is_dir() and any(folder.iterdir()):
            raise RerunError(f"--folder {folder}: contains other files; expected a new or empty folder")
        project.mkdir(parents=True)
        if (deposit / INPUTS).is_dir():
            shutil.copytree(deposit / INPUTS, project / INPUTS, copy_function=shutil.copyfile)
        shutil.copyfile(deposit / CONFIGURATION, project / CONFIGURATION)
    try:
        load_configuration(project / CONFIGURATION, within=project)
    except ConfigurationError as error:
        raise RerunError(f"the configuration of the deposit cannot be run:\n{error}") from None
    begun.write_text(digest, encoding="ascii")
    return project
