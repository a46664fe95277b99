"""The programs that compute a deposit again: the one that is installed, and the deposit's own, isolated or not."""

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import typer

from icha.cli.project import FAILED, Mistake, say, shown
from icha.support.in_words import printable

# Beside the project: what was said while its environment was installed.
_LOG = "environment.log"
_LAST_LINES = 8
_LONGEST_LINE = 10_000


def fail(message: str):
    """Print an error and end the command."""
    say(f"Error: {message}", err=True, fg="red")
    raise typer.Exit(FAILED) from None


@contextlib.contextmanager
def stopped_by_signals():
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


def run_installed(project: Path, asked: list[str]) -> int:
    """Run the configuration in a folder by the program that is installed, which says itself how it goes.

    asked : arguments of its `icha run` after the configuration, targets and options.
    """
    from icha.datasets.results import CONFIGURATION
    from icha.deposit.rerun import surroundings
    from icha.support.program import own_workflow

    program = [sys.executable, "-P", "-c", "from icha.cli import main; main()"]
    own = {name: os.environ[name] for name in ("PATH", "PYTHONPATH") if name in os.environ}
    run = ["run", str(project / CONFIGURATION), *asked, "--directory", str(project)]
    # Where its own workflow is the nearest, whatever others have put above the folder.
    return _call([*program, *run], cwd=own_workflow(), env=surroundings() | own)


def run_own_source(project: Path, deposit, campaign, asked: list[str], environment: str, isolation: str) -> int:
    """Run the program of a deposit, isolated or not, in the environment that is asked for.

    Of its copy in the project, which it may change as it likes, nothing is read here. `asked` as above.
    """
    from icha.datasets.results import CONFIGURATION
    from icha.deposit.isolation import CONTAINERS, NO_ISOLATION, isolated, make_home
    from icha.deposit.rerun import environment_target, surroundings, unlike_lock

    variables = make_home(isolation, project, surroundings())
    if environment == "here":
        if wrong := unlike_lock(deposit):
            raise Mistake(
                "--environment here: what is installed is not what the deposit's uv.lock says; needed: that, or "
                "--environment lock:\n" + "\n".join(wrong)
            )
        program = [sys.executable, "-c", "from icha.cli import main; main()"]
        variables |= {"PATH": os.environ.get("PATH", ""), "PYTHONPATH": str(project)}
    else:
        # That of no environment.
        python = "python3" if isolation in CONTAINERS else os.path.realpath(sys.executable)
        install = ["make", environment_target(deposit, campaign), f"PYTHON={python}"]
        _install(isolated(isolation, install, project, variables, network=True), project, variables)
        program = [str(project / ".venv/bin/icha")]
    command = isolated(
        isolation,
        [*program, "run", CONFIGURATION, *asked],
        *(project, variables),
        network=isolation == NO_ISOLATION,
    )
    return _call(command, cwd=project, env=variables, heard=True)


def _install(command: list[str], project: Path, variables) -> None:
    log = project.with_name(_LOG)
    say(f"installing the environment of the deposit ({shown(log)})")
    with log.open("w", encoding="utf-8") as said:
        try:
            status = _call(command, cwd=project, env=variables, stdout=said, stderr=subprocess.STDOUT)
        except FileNotFoundError:
            fail("`make`, which installs the environment, was not found; needed: make, or --environment here")
    if status:
        lines = [line for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip()]
        last = "\n".join(f"    {printable(line)}" for line in lines[-_LAST_LINES:])
        fail(
            f"the environment could not be installed; without network, --environment here uses what is installed, if "
            f"it agrees with the lock file:\n{last}\n    log: {shown(log)}"
        )


def _call(command: list[str], *, heard: bool = False, **how) -> int:
    """Run a program to its end; tell it once if we are interrupted, and wait until it has ended, too.

    What it says is made printable if it is `heard`. It has a session of its own, and so no terminal to write to.
    """
    sys.stdout.flush()
    said = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT} if heard else {}
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True, **said, **how)
    try:
        return _ended(process)
    except KeyboardInterrupt:
        # What ignores one of them, started in the background of a script for one, heeds the other.
        ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM if ignored else signal.SIGINT)
        _ended(process)
        raise


def _ended(process: subprocess.Popen) -> int:
    """Print what a program says, if we hear it, until it has ended; its exit status."""
    if process.stdout:
        for line in iter(lambda: process.stdout.readline(_LONGEST_LINE), b""):
            say(printable(line.decode("utf-8", errors="replace").removesuffix("\n")))
    return process.wait()
