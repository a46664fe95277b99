"""Compute a deposit again, from its own source and lock file, and compare."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated, Literal

import typer

from icha.cli.options import Cores
from icha.cli.project import FAILED, Mistake, shown
from icha.cli.terminal import say
from icha.support.in_words import counted

# In the folder of a rerun: what was said while its environment was installed.
_LOG = "environment.log"
_LAST_LINES = 8


def reproduce(
    deposit: Annotated[Path, typer.Argument(help="Folder of a deposit, or its zip.", show_default=False)],
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="RUN",
            help="Only this run and the surface that it needs; can be given several times. Either "
            "study/surface/seed1/slope1/material or `smallest`, the complete run with the least data.",
            show_default=False,
        ),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option(
            help="Folder to compute in; the same folder again continues. Left out: a temporary one, which is removed "
            "if everything is reproduced.",
            show_default=False,
        ),
    ] = None,
    cores: Cores = None,
    environment: Annotated[
        Literal["lock", "here"],
        typer.Option(help="lock: install what the deposit's lock file says; here: use what is there, if it agrees."),
    ] = "lock",
    json: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the comparison to this file.", show_default=False)
    ] = None,
    keep: Annotated[bool, typer.Option("--keep", help="Keep the temporary folder in any case.")] = False,
) -> None:
    """Compute a deposit again and compare every number with it.

    The deposit is verified and only read. Its source is copied, its environment is installed from the lock file (that
    needs network, make and Python), its configuration is run, and everything that was computed is compared, variable by
    variable: identical, within tolerance, or different. With `--only smallest` this takes minutes.

    Exit status: 0 if all is identical or within tolerance, 1 if not, 2 if the deposit is damaged or not there.
    """
    from icha.publication.deposit_files import contents, verify_deposit
    from icha.publication.rerun import Refused, asked_runs, begin, campaign_of

    if not deposit.exists():
        raise Mistake(f"{deposit}: no such file or folder; needed: the folder of a deposit, or its zip")
    if wrong := verify_deposit(deposit):
        raise Mistake(f"{deposit}: the deposit is damaged; needed: a whole one:\n" + "\n".join(wrong))
    sizes = contents(deposit)
    temporary = folder is None
    try:
        campaign, runs = campaign_of(deposit, sizes), asked_runs(only or (), deposit, sizes)
        folder = Path(tempfile.mkdtemp(prefix="icha-reproduce-") if temporary else folder).resolve()
        begin(folder, deposit)
    except Refused as refused:
        raise Mistake(str(refused)) from None
    try:
        made, comparison, status = _computed_again(deposit, folder, campaign, runs, sizes, environment, cores)
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
        say(f"what was computed again: {shown(made)}")
    if not good:
        raise typer.Exit(FAILED)


def _computed_again(deposit, folder, campaign, runs, sizes, environment, cores):
    """The folder with the results, their comparison with the deposit's, and the exit status of the campaign."""
    from icha.publication.rerun import prepare

    goes_on = f"the same command with --folder {shown(folder)} goes on from here"
    try:
        with _stopped_by_signals():
            project, original = prepare(folder, deposit)
            program = _program(project, folder, environment)
            made = project / "results" / campaign
            status = _run(program, project, _targets(runs, campaign), cores)
            if not made.is_dir():
                _fail(f"nothing was computed; {goes_on}")
            return made, _compared(original, made, runs, sizes), status
    except KeyboardInterrupt:
        _fail(f"stopped; {goes_on}")


def _fail(message: str):
    say(f"Error: {message}", err=True, fg="red")
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


def _targets(runs: list[str], campaign: str) -> list[str]:
    return [f"results/{campaign}/{run}" for run in runs] or ["all"]


def _program(project: Path, folder: Path, environment: str) -> tuple[list[str], dict[str, str]]:
    """The command `icha` of the deposit's source in the environment that is asked for, and its variables."""
    from icha.publication.rerun import environment_target, surroundings

    if environment == "here":
        from icha.publication.environment import differences

        if wrong := differences(project / "uv.lock"):
            raise Mistake(
                "--environment here: what is installed is not what the deposit's uv.lock says; needed: that, or "
                "--environment lock:\n" + "\n".join(wrong)
            )
        called = [sys.executable, "-c", "from icha.cli import main; main()"]
        return called, {**surroundings(), "PATH": os.environ.get("PATH", ""), "PYTHONPATH": str(project)}
    log = folder / _LOG
    say(f"installing the environment of the deposit ({shown(log)})")
    python = os.path.realpath(sys.executable)  # that of no environment
    with log.open("w", encoding="utf-8") as said:
        try:
            status = _call(
                ["make", environment_target(project), f"PYTHON={python}"],
                cwd=project,
                env=surroundings(),
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=subprocess.STDOUT,
            )
        except FileNotFoundError:
            _fail("`make`, which installs the environment, was not found; needed: make, or --environment here")
    if status:
        lines = [line for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip()]
        last = "\n".join(f"    {line}" for line in lines[-_LAST_LINES:])
        _fail(
            f"the environment could not be installed; without network, --environment here uses what is installed, if "
            f"it agrees with the lock file:\n{last}\n    log: {shown(log)}"
        )
    return [str(project / ".venv/bin/icha")], surroundings()


def _run(program, project: Path, targets: list[str], cores: str | None) -> int:
    """Run the campaign, which says itself how it goes; return its exit status."""
    from icha.datasets.results import CONFIGURATION

    command, variables = program
    say(f"computing in {shown(project)}; paths are relative to it")
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


def _compared(original: Path, made: Path, runs: list[str], sizes):
    from icha.publication.rerun import surface_of
    from icha.publication.rerun_comparison import compare_folders

    paths = None
    if runs:
        paths = [*runs, *(surface for surface in map(surface_of, runs) if surface in sizes)]
    return compare_folders(original, made, paths)


def _tell(comparison, status: int) -> bool:
    """Print the comparison; return whether all is reproduced."""
    from icha.publication.rerun_comparison import DIFFERENT, IDENTICAL, TOLERANCE, table

    say(f"\nthe deposit, and what was computed again:\n\n{table(comparison)}\n")
    files = counted(len(comparison.files), "file")
    if comparison.verdict == DIFFERENT:
        say("different: not everything is reproduced", fg="red")
    elif comparison.verdict == IDENTICAL:
        say(f"identical: {files}, every value", fg="green")
    else:
        say(f"within tolerance: {files}, every value to {TOLERANCE:g}", fg="green")
    if status:
        say("Not everything could be computed: see above.", fg="yellow")
    return comparison.verdict != DIFFERENT
