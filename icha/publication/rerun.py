"""The folder in which a deposit is computed again: what of the deposit goes there, and which runs are asked for."""

import contextlib
import difflib
import os
import re
import shutil
import sys
import textwrap
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path

import netCDF4
import yaml

from icha.datasets.results import CONFIGURATION
from icha.planning.software import BY_TAMAAS, TAMAAS
from icha.publication.deposit_files import CHECKSUMS, read_file
from icha.support.in_words import counted

SMALLEST = "smallest"
# In the folder of a rerun: what it is of, the deposit's files if it is a zip, the project.
_BEGUN, _UNPACKED, _PROJECT = CHECKSUMS, "deposit", "source"
# Of the caller's: they would change which programs and settings the rerun has.
_LEFT_BEHIND = ("PYTHON", "VIRTUAL_ENV", "CONDA", "UV_PROJECT", "UV_PYTHON", "SNAKEMAKE", "ICHA_", "MAKE", "MFLAGS")
# Characters of a reason that are told.
_LONGEST = 120


class Refused(ValueError):
    """A rerun that cannot be begun; the message says why, and what can."""


def campaign_of(deposit: Path, sizes: Mapping[str, int]) -> str:
    """The name of the campaign of a deposit that can be computed again; `Refused` if it cannot."""
    for needed in (CONFIGURATION, "source/Snakefile", "source/Makefile", "source/uv.lock"):
        if needed not in sizes:
            raise Refused(f"{deposit}: has no {needed}, so it cannot be computed again")
    return yaml.safe_load(read_file(deposit, CONFIGURATION))["name"]


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
    there = sorted(name for name in sizes if name.startswith("runs/") and name.endswith(".nc"))
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
    with netCDF4.Dataset(run, memory=read_file(deposit, run)) as file:
        steps = file.dimensions.get("step")
        return (len(steps) if steps is not None else 0), str(getattr(file, "incomplete", ""))


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


def prepare(folder: Path, deposit: Path) -> tuple[Path, Path]:
    """The project of the rerun, with the configuration and its files in it, and the deposit as a folder."""
    project, original = folder / _PROJECT, deposit
    if not deposit.is_dir():
        original = folder / _UNPACKED
        with _whole_folder(original) as part, zipfile.ZipFile(deposit) as archive:
            if part:
                archive.extractall(part)
                (top,) = part.iterdir()
                for path in [*top.iterdir()]:
                    path.rename(part / path.name)
                top.rmdir()
    with _whole_folder(project) as part:
        if part:
            _copy_files(original / "source", part)
            _copy_files(original / "inputs", part / "inputs")
            shutil.copyfile(original / CONFIGURATION, part / CONFIGURATION)
    return project, original


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


def environment_target(project: Path) -> str:
    """The target of the project's Makefile that installs all that its campaign needs; older ones have one for all."""
    asked = yaml.safe_load((project / CONFIGURATION).read_text(encoding="utf-8"))
    has_it = re.search(rf"^{TAMAAS}:", (project / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    return TAMAAS if has_it and any(asked.get(section) for section in BY_TAMAAS) else "environment"


def surroundings() -> dict[str, str]:
    """The environment variables of the rerun: the caller's, but for what would bring the caller's programs in."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(_LEFT_BEHIND)}
    own = Path(sys.prefix).resolve()
    if sys.prefix != sys.base_prefix:
        path = kept.get("PATH", os.defpath).split(os.pathsep)
        kept["PATH"] = os.pathsep.join(part for part in path if part and not Path(part).resolve().is_relative_to(own))
    return kept
