"""The command `icha run`: start Snakemake, show its progress, and report the outcome."""

import contextlib
import itertools
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from icha.cli.describe import print_plan
from icha.cli.project import (
    DEFAULT,
    DEFAULT_CORES,
    FAILED,
    TARGETS,
    Anyway,
    Config,
    Cores,
    Folder,
    UserError,
    echo,
    find_configuration,
    find_workflow,
    option,
    project,
    read_configuration,
    read_profile,
    shorten_path,
)
from icha.support import formatting
from icha.support.formatting import format_count

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
MOST_LINES = 12  # largest number of lines that are printed about a failure
# Lines that every call of Snakemake prints. The reason for an error comes after these lines.
PREAMBLE = r"Using workflow specific profile|Assuming unrestricted|host: |Building DAG of jobs|total +\d+$"


def run(
    config: Config = None,
    targets: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[TARGET]...",
            help=f"Results to make: {', '.join(TARGETS)}, or a file. Default: all. Options of Snakemake follow `--`.",
            show_default=False,
        ),
    ] = None,
    cores: Cores = None,
    profile: Annotated[
        str | None, option("Folder of a Snakemake profile, or its name under profiles/, such as slurm.")
    ] = None,
    folder: Folder = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", "-n", help="Print the plan and the jobs that would run; compute nothing.")
    ] = False,
    anyway: Anyway = False,
) -> None:
    """Compute the results of a campaign that are missing or out of date.

    In a terminal, a table shows the progress; otherwise the command prints a line for each finished job. At the end the
    command prints failures, and the paths of figures, dataset and report. Ctrl-C stops the campaign; repeat the command
    to continue.

    Exit status: 0 if all requested results exist, 1 if a job failed (independent jobs run nevertheless), 2 if the
    campaign cannot start, for example because memory or disk space is probably too small.
    """
    from icha.planning.ownership import find_conflict

    workflow = find_workflow()
    targets = list(targets or [])
    # The first argument of `icha run figures` and `icha run -- --forceall` is not a configuration.
    if config is not None and (config.startswith("-") or (config in TARGETS and not Path(config).is_file())):
        config, targets = None, [config, *targets]
    path = find_configuration(config)
    folder = (folder or project()).resolve()
    campaign = read_configuration(path, folder).campaign
    results = folder / "results" / campaign.name
    profile_folder = _profile_folder(profile, workflow)
    names = itertools.takewhile(lambda target: not target.startswith("-"), targets)
    if unknown := [name for name in names if name not in TARGETS and not name.startswith(f"results/{campaign.name}/")]:
        expected = f"{', '.join(TARGETS)}, or a file under results/{campaign.name}/"
        raise UserError(f"{', '.join(unknown)}: not a target; expected {expected}")
    if reason := find_conflict(shorten_path(results), campaign.name, path, workflow):
        raise UserError(f"{reason} Nothing was started")
    # With -P, a file in the working directory cannot replace a module of the same name.
    program = [sys.executable, "-P", "-m", "snakemake"]
    options = [
        *("--snakefile", str(workflow / "Snakefile"), "--directory", str(folder)),
        *(["--configfile", str(path.resolve())] if path.resolve() != (workflow / DEFAULT).resolve() else []),
        *(["--cores", str(cores)] if cores else []),
        # Snakemake finds profiles/default without this option.
        *(["--workflow-profile", str(profile_folder)] if profile else []),
    ]
    if dry_run:
        jobs = _dry_run([*program, *targets, *options, "--dry-run"], workflow)
        print_plan(path, campaign, workflow, folder, cores or DEFAULT_CORES, profile=profile_folder)
        echo(jobs)
        return
    from icha.planning.validity import expected_validity

    every = not set(targets) - {"all", "report", "publish"}
    if not set(targets) - set(TARGETS):
        _print_validity(expected_validity(campaign))

    def compute(campaign, targets):
        """Compute targets with Snakemake, and print the outcome; return whether all checks passed."""
        from icha.planning.plan import plan

        items = plan(campaign, results)
        if not anyway:
            _refuse_if_too_large(items, targets, cores or DEFAULT_CORES, results, read_profile(profile_folder))
        return _compute([*program, *targets, *options, "--logger", "icha"], workflow, folder, campaign, items)

    choices = {}
    if every:
        campaign, choices = _reach_accuracy(campaign, path, folder, cores or DEFAULT_CORES, compute)
    passed = compute(campaign, targets)
    if every:
        _print_checks(campaign, results)
        _print_accuracy(choices)
    if not passed:
        raise typer.Exit(FAILED)
    if "publish" in targets:
        version = campaign.deposit_metadata().version
        echo(f"deposit: {shorten_path(results / 'publish' / f'{campaign.name}-{version}.zip')}")


def _compute(command: list[str], workflow: Path, folder: Path, campaign, items) -> bool:
    """Run a command of Snakemake, show its progress and print its outcome; after a failure, exit.

    Return True if no job failed, and False if only the verdict did: then all results exist, without the failed runs.
    """
    from rich.console import Console

    from icha.cli.live import Progress, View
    from icha.planning.costs import WORKFLOW

    expected = {f"results/{campaign.name}/{item.path}": (item.rule, item.work + WORKFLOW.job) for item in items}
    progress = Progress(expected)
    view = View(progress, campaign.name, folder, Console(highlight=False))
    log = _log_file(folder, campaign.name)
    status, stopped = _run_snakemake(command, workflow, log, progress, view)
    _print_outcome(status, stopped, progress, campaign, folder, log)
    if status and (stopped or {job.rule for job in progress.failed} != {"verdict"}):
        raise typer.Exit(FAILED)
    return not status


# Largest number of times that the seeds of a study are increased to reach its accuracy.
_MOST_EXTENSIONS = 2


def _reach_accuracy(campaign, path: Path, folder: Path, cores: int, compute):
    """Increase the seeds of studies with `accuracy` until all intervals are narrow enough.

    Returns
    -------
    The campaign with the last seeds, and the last choice of each study (`icha.planning.levels`).
    """
    from icha.configuration.load import load_configuration
    from icha.planning.levels import choose_levels, words_of_levels, write_levels

    results, choices = folder / "results" / campaign.name, {}
    if all(study.accuracy is None for study in campaign.studies.values()):
        return campaign, choices
    from icha.planning.results import campaign_files

    for extension in range(_MOST_EXTENSIONS + 1):
        # The target `dataset` includes the verdict, which one failed run is enough to stop.
        compute(campaign, ["runs", f"results/{campaign.name}/{campaign_files(campaign).dataset}"])
        choices = choose_levels(campaign, results, cores)
        extended = {name: choice for name, choice in choices.items() if choice.counts}
        if not extended or extension == _MOST_EXTENSIONS:
            break
        for name, choice in extended.items():
            time = formatting.duration(choice.seconds / cores)
            echo(f"{name}: {choice.sentence}; next: {words_of_levels(choice.counts)}, {time} in all", bold=True)
        write_levels(results, extended)
        campaign = load_configuration(path, results=folder / "results").campaign
    return campaign, choices


def _print_accuracy(choices) -> None:
    """Print the accuracy that each study has reached, and the reason if it is not the required one."""
    for name, choice in choices.items():
        reached = choice.half_width <= choice.required
        reason = "" if reached else f". Not reached: {choice.reason or 'repeat the command to add seeds'}"
        echo(f"answer:   study {name}: {choice.sentence}{reason}", fg=None if reached else "yellow")


def _profile_folder(profile: str | None, workflow: Path) -> Path:
    """Find the folder of a Snakemake profile by its path or its name; None means the default profile."""
    for path in (Path(profile or "default"), workflow / "profiles" / (profile or "default")):
        if (path / "config.yaml").is_file():
            return path.resolve()
    names = sorted(path.parent.name for path in (workflow / "profiles").glob("*/config.yaml"))
    raise UserError(f"--profile {profile}: no folder with a config.yaml; expected a folder, or {', '.join(names)}")


def _refuse_if_too_large(items, targets: list[str], cores: int, results: Path, profile: dict) -> None:
    """Raise `UserError` if memory or disk space is probably too small."""
    from icha.planning.requirements import find_shortages

    if targets and all(target.startswith("results/") for target in targets):
        return  # the cost of single files is unknown
    # Resources on the command line have priority over resources in the profile.
    resources = [each for each in targets if "=" in each] + profile.get("resources", [])
    if shortages := find_shortages(items, cores, results, profile | {"resources": resources}):
        lines = "\n  ".join(["this machine is probably too small:", *shortages])
        raise UserError(f"{lines}\nNothing was started; use --anyway to start nevertheless")


def _dry_run(command: list[str], workflow: Path) -> str:
    """Plan with Snakemake and run nothing; return how many jobs would run. After an error, print the error and exit."""
    done = subprocess.run(command, cwd=workflow, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode == 0:
        return _planned_jobs(done.stdout)
    _print_failure("Snakemake could not start:", _reason_in(done.stdout), fg="red")
    raise typer.Exit(FAILED)


def _planned_jobs(output: str) -> str:
    """Summarise the output of a dry run: the number of jobs of each rule, and the outdated results."""
    outdated = re.findall(r"^(?:.+, )?to be made again: .+$", output, re.MULTILINE)
    table = output.partition("Job stats:")[2].partition("\ntotal")[0]
    rows = re.findall(r"^(\w+) +(\d+)$", table, re.MULTILINE)
    counts = {rule.replace("_", " "): int(number) for rule, number in rows if rule not in TARGETS}
    if counts:
        listed = ", ".join(f"{number} {rule}" for rule, number in counts.items())
        total = format_count(sum(counts.values()), "job")
        return "\n".join([*outdated, f"{total} would run, including jobs for outdated results: {listed}"])
    if outdated:
        return "\n".join([*outdated, "and all results that depend on these"])
    return "Nothing would run: all requested results exist and are up to date."


def _reason_in(output: str) -> list[str]:
    """Return why Snakemake stopped without a failed job: the end of its output after the plan, without tracebacks."""
    lines = [line for line in output.splitlines() if line.strip()]
    preamble = [number for number, line in enumerate(lines) if re.match(PREAMBLE, line)]
    lines = lines[preamble[-1] + 1 :] if preamble else lines
    calls = [number for number, line in enumerate(lines) if line.startswith("Traceback")]
    if calls:
        lines = lines[: calls[0]] + [line for line in lines[calls[0] + 1 :] if not line.startswith(" ")]
    return lines[-MOST_LINES:]


def _log_file(folder: Path, campaign: str) -> Path:
    """Create an empty log file for `icha run` in the folder of Snakemake's own logs."""
    logs = folder / ".snakemake/log"
    try:
        logs.mkdir(parents=True, exist_ok=True)
        file, name = tempfile.mkstemp(prefix=f"icha-{campaign}-", suffix=".log", dir=logs)
    except OSError as error:
        raise UserError(
            f"cannot write to {folder}: {error.strerror}; free some space, change its permissions, or use another "
            "folder: --directory FOLDER"
        ) from None
    os.close(file)
    return Path(name)


# A signal to stop is repeated after this number of seconds.
_REPEAT_STOP = 15.0


def _run_snakemake(command: list[str], workflow: Path, log: Path, progress, view) -> tuple[int, bool]:
    """Run Snakemake, update `progress` and `view`; return the exit status, and whether a signal stopped the run."""
    stopped = []
    reading, writing = os.pipe()
    # The plugins of this workflow replace installed plugins of the same name.
    modules = [str(workflow / "workflow/plugins"), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"ICHA_EVENTS": str(writing), "PYTHONPATH": os.pathsep.join(modules)}
    if sys.platform == "linux":
        environment["ICHA_CALLER"] = str(os.getpid())
    with view.live, log.open("w", encoding="utf-8") as output:
        # Snakemake gets its own process group, so that Ctrl-C reaches Snakemake and its jobs only once, from `stop`.
        process = subprocess.Popen(
            command,
            cwd=workflow,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            pass_fds=[writing],
            process_group=0,
        )
        os.close(writing)

        def stop(number, frame):
            stopped.append(number)
            view.print("stopping …")
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, number)

        # Signals that are already ignored, for example under nohup, remain ignored.
        signals = [number for number in STOP_SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
        handlers = {number: signal.signal(number, stop) for number in signals}
        try:
            listener = threading.Thread(target=_listen, args=(reading, progress, view, stopped), daemon=True)
            listener.start()
            status = None
            while status is None:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    status = process.wait(timeout=_REPEAT_STOP)
                view.print_running()
                if status is None and stopped:
                    # Snakemake can miss a signal that arrives while Snakemake starts a job.
                    os.killpg(process.pid, stopped[-1])
            # A process that outlives its job may hold the pipe open.
            listener.join(timeout=2)
        finally:
            for number, handler in handlers.items():
                signal.signal(number, handler)
    return status, bool(stopped)


def _listen(reading: int, progress, view, stopped: list) -> None:
    """Read the events of Snakemake, one JSON object per line, and update progress and view until Snakemake ends."""
    from icha.cli.live import read_error

    with open(reading, encoding="utf-8") as events:
        for line in events:
            event = json.loads(line)
            if event["event"] == "remark":
                view.print(event["text"], "yellow")
                continue
            job = progress.update(event)
            failed = event["event"] == "job_error"
            # A job that was stopped has not failed.
            if job is not None and not (failed and stopped and not read_error(job, view.folder)):
                view.print_job(job, failed)


def _print_outcome(status: int, stopped: bool, progress, campaign, folder: Path, log: Path) -> None:
    """Print the numbers of finished jobs, the reasons for failures, and the paths of results and log."""
    from icha.support.atomic_files import probe_folder

    results = folder / "results" / campaign.name
    ended = progress.ended_count
    if status == 0:
        log.unlink(missing_ok=True)  # Snakemake has written the same log
    if status == 0 and progress.started is None:
        echo("Nothing to do: all requested results exist and are up to date.")
    elif ended:
        duration = formatting.duration(progress.clock() - progress.called)
        echo(f"{len(progress.done)} of {format_count(progress.job_count, 'job')} done in {duration}")
    _print_failures(status, stopped, progress, campaign, folder, log)
    if status and results.is_dir() and (reason := probe_folder(results)):
        # The logs of the jobs are in the same folder, so the jobs may have been unable to report the error.
        echo(
            f"cannot write to {shorten_path(results)}: {reason.strerror}. Solve this problem and repeat the command",
            fg="red",
        )
    if stopped or status < 0:
        echo("Stopped before the end. Repeat the command to continue.", fg="red")
    elif status and not progress.failed:
        heading = "Snakemake could not continue:" if ended else "Snakemake could not start:"
        _print_failure(heading, _reason_in(log.read_text(encoding="utf-8", errors="replace")), fg="red")
    elif status and progress.job_count > ended:
        echo(f"{format_count(progress.job_count - ended, 'job')} not run, because they need results of failed jobs")
    if ended or not status:  # otherwise the files are from an earlier call
        files = {"figures": "figures", "dataset": f"dataset/{campaign.name}.nc", "report": "report.html"}
        for name, file in files.items():
            if (results / file).exists():
                echo(f"{name + ':':<9}{shorten_path(results / file)}")
    if status:
        echo(f"log:     {shorten_path(log)}")


def _print_failures(status: int, stopped: bool, progress, campaign, folder: Path, log: Path) -> None:
    """Print the failed jobs and the failed runs, with the reason for each failure."""
    from icha.cli.live import read_error
    from icha.planning.plan import early_ends

    results = folder / "results" / campaign.name
    incomplete, ended = early_ends(campaign, results)
    if status or campaign.publication.known_failures:
        _print_early_ends("failed", incomplete, campaign, results / "logs/failed_runs.txt", "red")
    what = "ended before the last target, as physics decides"
    _print_early_ends(what, ended, campaign, results / "logs/ended_runs.txt")
    incomplete = [case.path for case in incomplete]
    failed = [job for job in progress.failed if not stopped or read_error(job, folder)]
    if failed:
        echo(f"{format_count(len(failed), 'job')} failed:", fg="red")
        for job in failed:
            # The message of the job "Verdict on the checks" repeats the failed runs, which are printed above.
            reason = [line for line in read_error(job, folder) if not any(line.startswith(path) for path in incomplete)]
            unknown = f"the job ended without a message, perhaps for lack of memory; see {job.log or log}"
            _print_failure(f"  {job.title}", reason or [unknown], bold=True)
            if job.log:
                echo(f"    log: {shorten_path(folder / job.log)}")


def _print_early_ends(what: str, reasons: Mapping, campaign, file: Path, colour: str | None = None) -> None:
    """Print the runs that failed or ended early, one line for all seeds of a contact; write all reasons to a file."""
    from icha.configuration.cases import run_cases
    from icha.contact.models import DEFAULT_MODEL, MODELS
    from icha.datasets.labels import RunLabels

    if not reasons:
        return
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("".join(f"{case.path}: {reason}\n" for case, reason in reasons.items()), encoding="utf-8")
    echo(f"{format_count(len(reasons), 'run')} {what}; all reasons: {shorten_path(file)}", fg=colour)
    groups: dict[RunLabels, list[RunLabels]] = {}
    for case in reasons:
        groups.setdefault(case._replace(seed=0), []).append(case)
    for contact, cases in itertools.islice(groups.items(), MOST_LINES):
        asked = sum(each.path == contact.path for each in (case._replace(seed=0) for case in run_cases(campaign)))
        seeds = f"{len(cases)} of {asked} seeds" if asked > 1 else "1 run"
        model = "" if contact.model == DEFAULT_MODEL else f", {MODELS[contact.model].words}"
        echo(
            f"  {contact.study}: {seeds} of {contact.surface}, slope {contact.rms_slope:g}, {contact.material}{model}",
            bold=True,
        )
        echo(f"    {reasons[cases[0]]}")
    if len(groups) > MOST_LINES:
        echo(f"  … and {len(groups) - MOST_LINES} more groups in the file")


def _print_failure(heading: str, lines: list[str], **style) -> None:
    echo(heading, **style)
    for line in lines[:MOST_LINES]:
        echo(f"    {line}")
    if len(lines) > MOST_LINES:
        echo(f"    … and {len(lines) - MOST_LINES} more lines in the log")


def _print_checks(campaign, results: Path) -> None:
    """Print how many checks of the results have passed, and whether the models are applicable to the campaign."""
    import xarray as xr

    from icha.analysis.checks import read_checks
    from icha.analysis.measured_error import measured_errors
    from icha.analysis.validity import statements_on_dataset
    from icha.contact.models import DEFAULT_MODEL
    from icha.planning.results import campaign_files

    files = campaign_files(campaign)
    checks = read_checks(results / files.checks)
    passed = sum(check.passed for check in checks)
    echo(f"checks:  {passed} of {len(checks)} checks of the solved equations passed")
    echo("Applicability of the models, which is a separate question:")
    with xr.open_datatree(results / files.dataset, engine="netcdf4") as tree:
        statements = statements_on_dataset(tree)
        of_asperities = {name for name, node in tree.children.items() if DEFAULT_MODEL in node["model"].values}
    if files.model_error:
        with xr.open_datatree(results / files.model_error[0], engine="netcdf4") as errors:
            measured = measured_errors(errors)
        # Where all studies have a measured error, the statement on other surfaces is not needed.
        if of_asperities <= measured.keys():
            statements = [each for each in statements if each.about != "accuracy"]
        statements = [*measured.values(), *statements]
    _print_validity(statements)


def _print_validity(statements) -> None:
    for statement in statements:
        echo(f"{statement.about + ':':<9} {statement.text}", fg=None if statement.good else "yellow")
