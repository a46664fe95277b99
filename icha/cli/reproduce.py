"""Compute a deposit again, from its own source and lock file, and compare."""

from __future__ import annotations

import contextlib
import difflib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
import zipfile
from pathlib import Path
from typing import Annotated, Literal

import typer

from icha.cli.options import Cores
from icha.cli.project import FAILED, Mistake, counted, shown

CONFIGURATION = "config.used.yaml"
SMALLEST = "smallest"
# In the folder of a rerun: what it is of, the deposit's files if it is a zip, the project, what was said.
_BEGUN, _UNPACKED, _PROJECT, _LOG = "SHA256SUMS", "deposit", "source", "environment.log"
# Of the caller's: they would change which programs and settings the rerun has.
_LEFT_BEHIND = ("PYTHON", "VIRTUAL_ENV", "CONDA", "UV_PROJECT", "UV_PYTHON", "SNAKEMAKE", "ICHA_", "MAKE", "MFLAGS")
_LAST_LINES = 8
# Characters of a reason that are told.
_LONGEST = 120


def reproduce(
    deposit: Annotated[Path, typer.Argument(help="Folder of a deposit, or its zip.", show_default=False)],
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="RUN",
            help="Only this run, and the surface that it needs; may be given several times. "
            "study/surface/seed1/slope1/material, or `smallest`: that of the complete ones with the least data.",
            show_default=False,
        ),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option(
            help="Where it is computed; the same folder again goes on. Left out: a temporary one, removed if all is "
            "reproduced.",
            show_default=False,
        ),
    ] = None,
    cores: Cores = None,
    environment: Annotated[
        Literal["lock", "here"],
        typer.Option(help="Install what the deposit's lock file says, or take what is installed here, if it agrees."),
    ] = "lock",
    json: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the comparison to this file.", show_default=False)
    ] = None,
    keep: Annotated[bool, typer.Option("--keep", help="Keep the temporary folder in any case.")] = False,
) -> None:
    """Compute a deposit again and compare every number with it.

    The deposit is verified and only read. Its source is copied, its environment is installed from the lock file (that
    needs network, make and Python), its configuration is run, and everything that was computed is compared, variable by
    variable: identical, within tolerance, or different. With `--only smallest`, that takes minutes.

    Exit status: 0 if all is identical or within tolerance, 1 if not, 2 if the deposit is damaged or there is none.
    """
    from icha.publication.deposit_files import CHECKSUMS, contents, read_file, verify_deposit

    if not deposit.exists():
        raise Mistake(f"{deposit}: no such file or folder; needed: the folder of a deposit, or its zip")
    if wrong := verify_deposit(deposit):
        raise Mistake(f"{deposit}: the deposit is damaged; needed: a whole one:\n" + "\n".join(wrong))
    names = contents(deposit)
    campaign, runs = _campaign(deposit, names), _asked_runs(only, deposit, names)
    temporary = folder is None
    if temporary:
        folder = Path(tempfile.mkdtemp(prefix="icha-reproduce-"))
    folder = folder.resolve()
    _begin(folder, deposit, read_file(deposit, CHECKSUMS))
    goes_on = f"the same command with --folder {shown(folder)} goes on from here"
    try:
        with _stopped_by_signals():
            project, original = _prepare(folder, deposit)
            program = _program(project, folder, environment)
            made = project / "results" / campaign
            status = _run(program, project, _targets(runs, campaign), cores)
            if not made.is_dir():
                _fail(f"nothing was computed; {goes_on}")
            comparison = _compared(original, made, runs, names)
    except KeyboardInterrupt:
        _fail(f"stopped; {goes_on}")
    except Mistake:
        if temporary:
            shutil.rmtree(folder)
        raise
    if json:
        from icha.publication.rerun_comparison import write_json

        write_json(comparison, json)
    good = _tell(comparison, status)
    if temporary and good and not keep:
        shutil.rmtree(folder)
    else:
        typer.echo(f"what was computed again: {shown(made)}")
    if not good:
        raise typer.Exit(FAILED)


def _fail(message: str):
    typer.secho(f"Error: {message}", err=True, fg="red")
    raise typer.Exit(FAILED) from None


@contextlib.contextmanager
def _stopped_by_signals():
    """Let what asks us to end interrupt us, as Ctrl-C does."""

    def interrupt(number, frame):
        raise KeyboardInterrupt

    heeded = [each for each in (signal.SIGTERM, signal.SIGHUP) if signal.getsignal(each) is not signal.SIG_IGN]
    former = {each: signal.signal(each, interrupt) for each in heeded}
    try:
        yield
    finally:
        for each, handler in former.items():
            signal.signal(each, handler)


# What is asked.


def _campaign(deposit: Path, names) -> str:
    """The name of the campaign."""
    import yaml

    from icha.publication.deposit_files import read_file

    for needed in (CONFIGURATION, "source/Snakefile", "source/Makefile", "source/uv.lock"):
        if needed not in names:
            raise Mistake(f"{deposit}: has no {needed}, so it cannot be computed again")
    return yaml.safe_load(read_file(deposit, CONFIGURATION))["name"]


def _asked_runs(only: list[str] | None, deposit: Path, names: dict[str, int]) -> list[str]:
    """Paths of the runs that are asked for, none if all of the deposit is."""
    there = sorted(name for name in names if name.startswith("runs/") and name.endswith(".nc"))
    found = []
    for asked in only or ():
        if asked == SMALLEST and there:
            path = _smallest(deposit, there, names)
        else:
            path = f"runs/{asked.removeprefix('runs/').removesuffix('.nc')}.nc"
        if path not in there:
            runs = [run.removeprefix("runs/").removesuffix(".nc") for run in there]
            near = difflib.get_close_matches(asked, runs, 5, 0) or runs[:5]
            raise Mistake(
                f"--only {asked}: the deposit has no such run; allowed: {SMALLEST}, or one of its "
                f"{counted(len(runs), 'run')}, such as {', '.join(near)}"
            )
        steps, failure = _outcome(deposit, path)
        if steps == 0:
            why = f" ({textwrap.shorten(failure, _LONGEST, placeholder=' …')})" if failure else ""
            raise Mistake(
                f"--only {asked}: this run holds no data{why}, so there is nothing to compare; allowed: a run with at "
                f"least one step, or {SMALLEST}"
            )
        found.append(path)
    return list(dict.fromkeys(found))


def _smallest(deposit: Path, runs: list[str], names: dict[str, int]) -> str:
    """The complete run that, with its surface, has the fewest bytes."""
    for run in sorted(runs, key=lambda run: names[run] + names.get(_surface_of(run), 0)):
        steps, failure = _outcome(deposit, run)
        if steps and not failure:
            return run
    raise Mistake(
        f"--only {SMALLEST}: no run of the deposit is complete; allowed: the name of a run that has steps, or "
        f"no --only at all"
    )


def _outcome(deposit: Path, run: str) -> tuple[int, str]:
    """Number of steps of a run, and why it is incomplete; an empty text if it is complete."""
    import netCDF4

    from icha.publication.deposit_files import read_file

    with netCDF4.Dataset(run, memory=read_file(deposit, run)) as file:
        steps = file.dimensions.get("step")
        return (len(steps) if steps is not None else 0), str(getattr(file, "incomplete", ""))


def _surface_of(run: str) -> str:
    """The file of the surface of a run: of `runs/study/surface/seed1/slope1/material.nc`."""
    _, _, surface, seed, *_ = run.split("/")
    return f"surfaces/{surface}/{seed}.nc"


def _targets(runs: list[str], campaign: str) -> list[str]:
    return [f"results/{campaign}/{run}" for run in runs] or ["all"]


# The folder of the rerun.


def _begin(folder: Path, deposit: Path, checksums: bytes) -> None:
    """Make the folder, or find in it a rerun of the same deposit that has been begun."""
    if deposit.is_dir() and folder.is_relative_to(deposit.resolve()):
        raise Mistake(f"--folder {folder}: is in the deposit, which is not written to; allowed: another one")
    begun = folder / _BEGUN
    if begun.is_file():
        if begun.read_bytes() != checksums:
            raise Mistake(f"--folder {folder}: belongs to another deposit; allowed: a new or empty folder")
        return
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise Mistake(f"--folder {folder}: has other files in it; allowed: a new or empty folder")
    begun.write_bytes(checksums)


def _prepare(folder: Path, deposit: Path) -> tuple[Path, Path]:
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


# The rerun.


def _surroundings() -> dict[str, str]:
    """The environment variables of the rerun: the caller's, but for what would bring the caller's programs in."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(_LEFT_BEHIND)}
    own = Path(sys.prefix).resolve()
    if sys.prefix != sys.base_prefix:
        path = kept.get("PATH", os.defpath).split(os.pathsep)
        kept["PATH"] = os.pathsep.join(part for part in path if part and not Path(part).resolve().is_relative_to(own))
    return kept


def _program(project: Path, folder: Path, environment: str) -> tuple[list[str], dict[str, str]]:
    """The command `icha` of the deposit's source in the environment that is asked for, and its variables."""
    if environment == "here":
        from icha.publication.environment import differences

        if wrong := differences(project / "uv.lock"):
            raise Mistake(
                "--environment here: what is installed is not what the deposit's uv.lock says; needed: that, or "
                "--environment lock:\n" + "\n".join(wrong)
            )
        called = [sys.executable, "-c", "from icha.cli import main; main()"]
        return called, {**_surroundings(), "PATH": os.environ.get("PATH", ""), "PYTHONPATH": str(project)}
    log = folder / _LOG
    typer.echo(f"installing the environment of the deposit ({shown(log)})")
    python = os.path.realpath(sys.executable)  # that of no environment
    with log.open("w", encoding="utf-8") as said:
        try:
            status = _call(
                ["make", "environment", f"PYTHON={python}"],
                cwd=project,
                env=_surroundings(),
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=subprocess.STDOUT,
            )
        except FileNotFoundError:
            _fail("there is no `make`, which installs the environment; needed: it, or --environment here")
    if status:
        lines = [line for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip()]
        last = "\n".join(f"    {line}" for line in lines[-_LAST_LINES:])
        _fail(
            f"the environment could not be installed; without network, --environment here takes the one that is "
            f"installed, if it agrees with the lock file:\n{last}\n    log: {shown(log)}"
        )
    return [str(project / ".venv/bin/icha")], _surroundings()


def _run(program, project: Path, targets: list[str], cores: str | None) -> int:
    """Run the campaign, which says itself how it goes; return its exit status."""
    command, variables = program
    typer.echo(f"computing in {shown(project)}, which paths are relative to")
    asked = ["run", CONFIGURATION, *targets, *(["--cores", cores] if cores else [])]
    sys.stdout.flush()
    return _call([*command, *asked], cwd=project, env=variables, stdin=subprocess.DEVNULL)


def _call(command: list[str], **how) -> int:
    """Run a program to its end; tell it once if we are interrupted, and wait until it has ended, too."""
    process = subprocess.Popen(command, process_group=0, **how)
    try:
        return process.wait()
    except KeyboardInterrupt:
        # What ignores one of them, started in the background of a script for one, heeds the other.
        ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM if ignored else signal.SIGINT)
        process.wait()
        raise


def _compared(original: Path, made: Path, runs: list[str], names):
    from icha.publication.rerun_comparison import compare_folders

    paths = None
    if runs:
        paths = [*runs, *(surface for surface in map(_surface_of, runs) if surface in names)]
    return compare_folders(original, made, paths)


def _tell(comparison, status: int) -> bool:
    """Print the comparison; return whether all is reproduced."""
    from icha.publication.rerun_comparison import DIFFERENT, IDENTICAL, TOLERANCE, table

    typer.echo(f"\nthe deposit, and what was computed again:\n\n{table(comparison)}\n")
    files = counted(len(comparison.files), "file")
    if comparison.verdict == DIFFERENT:
        typer.secho("different: not everything is reproduced", fg="red")
    elif comparison.verdict == IDENTICAL:
        typer.secho(f"identical: {files}, every value", fg="green")
    else:
        typer.secho(f"within tolerance: {files}, every value to {TOLERANCE:g}", fg="green")
    if status:
        typer.secho("Not everything could be computed: see above.", fg="yellow")
    return comparison.verdict != DIFFERENT
