"""Run a campaign by Snakemake, and tell how it goes and what has become of it."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import Annotated

import typer

from icha.cli.describe import tell
from icha.cli.project import (
    DEFAULT,
    FAILED,
    Anyway,
    Config,
    Cores,
    Folder,
    UserError,
    configuration_path,
    core_count,
    echo,
    profile_settings,
    project,
    read_configuration,
    shown,
    workflow_folder,
)
from icha.support.atomic_files import in_the_way
from icha.support.formatting import format_count

TARGETS = ("all", "surfaces", "runs", "references", "figures", "dataset", "report", "publish")
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
# Lines of a reason that are printed at the end.
_MOST_LINES = 12
# What Snakemake says in any case, before it says why it ends.
_BEFORE_REASONS = r"Using workflow specific profile|Assuming unrestricted|host: |Building DAG of jobs|total +\d+$"


def run(
    config: Config = None,
    targets: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[TARGET]...",
            help=f"What to make: {', '.join(TARGETS)}, or a file. Left out: all. After `--`: options of Snakemake.",
            show_default=False,
        ),
    ] = None,
    cores: Cores = None,
    profile: Annotated[
        str | None,
        typer.Option(
            help="Folder of a Snakemake profile, or its name under profiles/, e.g. slurm.", show_default=False
        ),
    ] = None,
    folder: Folder = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", "-n", help="Only show the plan, and which jobs would run.")
    ] = False,
    plain: Annotated[
        bool, typer.Option("--plain", help="Print a line for every job instead of the live view.")
    ] = False,
    anyway: Anyway = False,
) -> None:
    """Run a campaign; what is there and up to date is not computed again.

    At the end it lists what failed, and where figures, dataset and report are. Exit status: 0 if everything was made,
    1 if something failed (the rest is made all the same), 2 if the campaign cannot be run.

    If more memory or disk is needed than there is, it asks before it begins; without a terminal it does not begin.

    Ctrl-C stops it; the next call continues from there.
    """
    workflow = workflow_folder()
    asked = list(targets or [])
    if config is not None and config in TARGETS and not Path(config).is_file():
        config, asked = None, [config, *asked]  # `icha run figures`
    elif config is not None and config.startswith("-"):
        config, asked = None, [config, *asked]  # `icha run -- --forceall`
    path = configuration_path(config)
    campaign = read_configuration(path).campaign
    folder = (folder or project()).resolve()
    _refuse_results_of_another(folder / "results" / campaign.name, campaign.name, path, workflow)
    if obstacle := in_the_way(shown(folder / ".snakemake")):
        raise UserError(f"{obstacle}: Snakemake keeps its records there; remove it, or put it right. Nothing was begun")
    command = [
        # Not what lies in the folder by the name of a module.
        *(sys.executable, "-P", "-m", "snakemake", *asked),
        *("--snakefile", str(workflow / "Snakefile"), "--directory", str(folder)),
        *(["--configfile", str(path.resolve())] if path.resolve() != (workflow / DEFAULT).resolve() else []),
        *(["--cores", cores] if cores else []),
        # In the place of profiles/default, which would be found by itself.
        *(["--workflow-profile", str(_profile(profile, workflow))] if profile else []),
    ]
    if dry_run:
        planned = _rehearse([*command, "--dry-run"], workflow, campaign, asked)
        tell(
            path,
            campaign,
            workflow,
            folder,
            core_count(cores),
            profile=_profile(profile, workflow) if profile else None,
        )
        echo(planned)
        return
    from rich.console import Console

    from icha.cli.live import LiveView, PlainView, Watch
    from icha.planning.plan import expected_seconds, plan, time_on
    from icha.planning.validity import expected_validity

    console = Console()
    items = plan(campaign, folder / "results" / campaign.name)
    if not anyway:
        settings = profile_settings(_profile(profile, workflow) if profile else workflow / "profiles/default")
        _ask_if_wanting(items, asked, core_count(cores), folder / "results" / campaign.name, settings)
    if not set(asked) - set(TARGETS):
        _say_what_holds(expected_validity(campaign))
    watch = Watch(expected_seconds(items, f"results/{campaign.name}"))
    if plain or not console.is_terminal:
        view = PlainView(watch, campaign.name, folder, echo)
    else:
        view = LiveView(watch, campaign.name, folder, console)
    log = _log_file(folder, campaign.name)
    status, stopped = _follow([*command, "--logger", "icha"], workflow, log, watch, view)
    if status and watch.started is None and not stopped:
        try:
            _refuse_unknown(log.read_text(encoding="utf-8", errors="replace"), asked, campaign)
        except UserError:
            log.unlink(missing_ok=True)
            raise
    # What `icha describe` says: of everything, on this machine.
    promised = None if profile or set(asked) - {"all"} else time_on(items, core_count(cores))
    _tell(status, stopped, watch, campaign, folder, log, promised)
    if not status and not set(asked) - {"all", "report", "publish"}:
        _tell_what_it_is_worth(campaign, folder / "results" / campaign.name)
    if not status and "publish" in asked:
        deposit = f"{campaign.name}-{campaign.published().version}.zip"
        echo(f"deposit: {shown(folder / 'results' / campaign.name / 'publish' / deposit)}")
    if status:
        raise typer.Exit(FAILED)


def _refuse_results_of_another(results: Path, name: str, path: Path, workflow: Path) -> None:
    from icha.planning.ownership import belongs_to_another

    if reason := belongs_to_another(shown(results), name, path, workflow):
        raise UserError(f"{reason} Nothing was begun")


def _profile(asked: str, workflow: Path) -> Path:
    for path in (Path(asked), workflow / "profiles" / asked):
        if (path / "config.yaml").is_file():
            return path.resolve()
    there = sorted(path.parent.name for path in (workflow / "profiles").glob("*/config.yaml"))
    raise UserError(f"--profile {asked}: no folder with a config.yaml; there are: {', '.join(there)}")


def _ask_if_wanting(items, asked: list[str], cores: int, results: Path, profile: dict) -> None:
    """Have somebody say whether to go on where memory or disk will not do.

    Raises
    ------
    UserError
        If nobody is there to be asked, or says no.
    """
    from icha.planning.requirements import wanting

    if "surfaces" in asked:
        items = [item for item in items if item.part == "surfaces"]
    elif any(each.startswith("results/") for each in asked):
        return  # single files, of which nothing is known
    # Of the resources that jobs may take together those of the call go before the profile's.
    resources = [each for each in asked if "=" in each] + profile.get("resources", [])
    lacks = wanting(items, cores, results, profile | {"resources": resources})
    if not lacks:
        return
    said = "\n".join(["not enough for what is to be done:", *(f"  {lack}" for lack in lacks)])
    if not _at_a_terminal():
        raise UserError(f"{said}\nNothing was begun; --anyway begins it all the same")
    echo(said, fg="red")
    if not typer.confirm("Begin all the same?"):
        raise UserError("nothing was begun")


def _at_a_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()


def _rehearse(command: list[str], workflow: Path, campaign, asked: list[str]) -> str:
    """Have Snakemake plan what was asked for: how many jobs of which kind would run, or the end with why none can."""
    done = subprocess.run(command, cwd=workflow, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode == 0:
        return _planned(done.stdout)
    _refuse_unknown(done.stdout, asked, campaign)
    _heading("Snakemake could not start:")
    _reason(None, _last_words(done.stdout))
    raise typer.Exit(FAILED)


def _planned(said: str) -> str:
    """What Snakemake would do, by its table of jobs, and by what the Snakefile would have made again besides."""
    again = re.findall(r"^(?:.+, )?to be made again: .+$", said, re.MULTILINE)
    table = said.partition("Job stats:")[2].partition("\ntotal")[0]
    rows = re.findall(r"^(\w+) +(\d+)$", table, re.MULTILINE)
    counts = {rule.replace("_", " "): int(number) for rule, number in rows if rule not in TARGETS}
    if not counts:
        nothing = "Nothing would run: everything that was asked for is there and up to date."
        return "\n".join([*again, "and what is made from it"]) if again else nothing
    listed = ", ".join(f"{number} {rule}" for rule, number in counts.items())
    would = "would run, those included that a changed program makes anew"
    return "\n".join([*again, f"{format_count(sum(counts.values()), 'job')} {would}: {listed}"])


def _refuse_unknown(said: str, asked: list[str], campaign) -> None:
    """Raise `UserError` if Snakemake has ended because a target that was asked for is none."""
    unknown = re.findall(r"^No rule to produce (.+) \(if you use", said, re.MULTILINE)
    if "\nInputFunctionException" in said:  # a file of a rule, but of no case of the campaign
        unknown = [name for name in asked if name not in TARGETS and not name.startswith("-")]
    if any(name in asked for name in unknown):
        raise UserError(
            f"{', '.join(unknown)}: no target, and no file that campaign {campaign.name} makes; allowed: "
            f"{', '.join(TARGETS)}, or a file of its own under results/{campaign.name}/"
        )


def _last_words(said: str) -> list[str]:
    """Why Snakemake has ended without a failed job: the last lines that it said after its plan, and no traceback."""
    lines = [line for line in said.splitlines() if line.strip()]
    plan = [number for number, line in enumerate(lines) if re.match(_BEFORE_REASONS, line)]
    lines = lines[plan[-1] + 1 :] if plan else lines
    calls = [number for number, line in enumerate(lines) if line.startswith("Traceback")]
    if calls:
        lines = lines[: calls[0]] + [line for line in lines[calls[0] + 1 :] if not line.startswith(" ")]
    return lines[-_MOST_LINES:]


def _log_file(folder: Path, campaign: str) -> Path:
    """A new file beside Snakemake's own logs."""
    logs = folder / ".snakemake/log"
    try:
        logs.mkdir(parents=True, exist_ok=True)
        file, name = tempfile.mkstemp(prefix=f"icha-{campaign}-", suffix=".log", dir=logs)
    except OSError as error:
        raise UserError(
            f"{folder} cannot be written to: {error.strerror}; make room there or make it writable, or work in another "
            f"folder: --directory FOLDER"
        ) from None
    os.close(file)
    return Path(name)


def _follow(command: list[str], workflow: Path, log: Path, watch, view) -> tuple[int, bool]:
    """Run Snakemake, feed its events to `watch` and what ends to `view`.

    Returns its exit status, and whether it was told to stop.
    """
    stopped = []
    reading, writing = os.pipe()
    # The project's own, whatever is installed.
    found = [str(workflow / "workflow/plugins"), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"ICHA_EVENTS": str(writing), "PYTHONPATH": os.pathsep.join(found)}
    if sys.platform == "linux":
        environment["ICHA_CALLER"] = str(os.getpid())
    with view, log.open("w", encoding="utf-8") as said:
        # In a process group of its own, so that Ctrl-C comes to it and its jobs once, from here.
        process = subprocess.Popen(
            command,
            cwd=workflow,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            pass_fds=[writing],
            process_group=0,
        )
        os.close(writing)

        def stop(number, frame):
            stopped.append(number)
            view.remark("stopping")
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, number)

        # Those that are ignored, as under nohup or in the background of a script, are to be ignored.
        heeded = [number for number in _SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
        former = {number: signal.signal(number, stop) for number in heeded}
        try:
            listener = threading.Thread(target=_listen, args=(reading, watch, view, stopped), daemon=True)
            listener.start()
            status = process.wait()
            # What a job has left running may hold the pipe open; everything was said by now.
            listener.join(timeout=2)
        finally:
            for number, handler in former.items():
                signal.signal(number, handler)
    return status, bool(stopped)


def _listen(reading: int, watch, view, stopped: list) -> None:
    from icha.cli.live import reason_of

    with open(reading, encoding="utf-8") as events:
        for line in events:
            event = json.loads(line)
            if event["event"] == "remark":
                view.tell(event["text"])
                continue
            job = watch.take(event)
            failed = event["event"] == "job_error"
            # Jobs that were stopped have not failed.
            if job is not None and not (failed and stopped and not reason_of(job, view.folder)):
                view.ended(job, failed)


def _tell(status: int, stopped: bool, watch, campaign, folder: Path, log: Path, promised: float | None) -> None:
    """Print what has become of the campaign, and in how many seconds of those that were promised."""
    from icha.cli.live import reason_of
    from icha.planning.plan import failed_runs
    from icha.support import formatting
    from icha.support.atomic_files import why_not_writable

    results = folder / "results" / campaign.name
    ended = len(watch.done) + len(watch.failed)
    if status == 0:
        log.unlink(missing_ok=True)  # Snakemake's own has all of it
    if status == 0 and watch.started is None:
        echo("Nothing to do: everything that was asked for is there and up to date.")
    elif ended:
        took = formatting.duration(watch.clock() - watch.called)
        beside = (
            f"; about {formatting.duration(promised)} were expected" if promised and ended == watch.job_count else ""
        )
        echo(f"{len(watch.done)} of {format_count(watch.job_count, 'job')} done in {took}{beside}")
    incomplete = failed_runs(campaign, results) if status or campaign.publication.known_failures else {}
    if incomplete:
        _heading(f"{format_count(len(incomplete), 'run')} without a result:")
        for path, reason in incomplete.items():
            _reason(path, [reason])
    failed = [job for job in watch.failed if not stopped or reason_of(job, folder)]
    if failed:
        _heading(f"{format_count(len(failed), 'job')} failed:")
        for job in failed:
            logs = ", ".join(str(shown(folder / name)) for name in job.logs)
            # The verdict repeats the runs that were just listed.
            reason = [line for line in reason_of(job, folder) if not any(line.startswith(path) for path in incomplete)]
            _reason(
                job.title,
                reason or [f"it ended without a message, perhaps killed (out of memory?); see {logs or log}"],
            )
            if logs:
                echo(f"    log: {logs}")
    if status and results.is_dir() and (reason := why_not_writable(results)):
        # Logs are there as well, so jobs may not have been able to say it.
        _heading(f"{shown(results)} cannot be written to: {reason.strerror}. The same command goes on once it can.")
    kept_back = watch.job_count - ended
    if stopped or status < 0:
        _heading("Stopped before the end. The same command goes on from here.")
    elif status and not watch.failed:
        _heading("Snakemake could not go on:" if ended else "Snakemake could not start:")
        _reason(None, _last_words(log.read_text(encoding="utf-8", errors="replace")))
    elif status and kept_back:
        echo(f"{format_count(kept_back, 'job')} not done, since they need what failed")
    # Where nothing was made, what is there is of another day.
    made = (
        ("figures", results / "figures"),
        ("dataset", results / "dataset" / f"{campaign.name}.nc"),
        ("report", results / "report.html"),
    )
    for what, path in made if ended or not status else ():
        if path.exists():
            echo(f"{what + ':':<9}{shown(path)}")
    if status:
        echo(f"log:     {shown(log)}")


def _tell_what_it_is_worth(campaign, results: Path) -> None:
    """Print whether the checks passed, and, which is another thing, where the models are known to hold."""
    from icha.analysis.checks import read_checks
    from icha.planning.results import campaign_files
    from icha.planning.validity import found_validity

    files = campaign_files(campaign)
    found = read_checks(results / files.checks)
    passed = sum(check.passed for check in found)
    echo(f"checks:  {passed if passed < len(found) else 'all'} of {len(found)} passed: the equations are solved")
    echo("Whether the models hold here is another question:")
    _say_what_holds(found_validity(results / files.dataset))


def _say_what_holds(statements) -> None:
    for statement in statements:
        echo(f"{statement.about + ':':<10}{statement.text}", fg=None if statement.good else "yellow")


def _heading(text: str) -> None:
    echo(text, fg="red")


def _reason(name: str | None, lines: list[str]) -> None:
    if name is not None:
        echo(f"  {name}", bold=True)
    for line in lines[:_MOST_LINES]:
        echo(f"    {line}")
    if len(lines) > _MOST_LINES:
        echo(f"    … and {len(lines) - _MOST_LINES} more lines in its log")
