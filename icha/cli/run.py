"""The command `icha run`: start Snakemake, count the finished files, and report the outcome."""

import itertools
import re
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer

from icha.cli.accuracy import print_accuracy, reach_accuracy
from icha.cli.describe import print_plan
from icha.cli.progress import Progress, run_process
from icha.cli.project import (
    DEFAULT,
    DEFAULT_CORES,
    FAILED,
    TARGETS,
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
    shorten_path,
)
from icha.support import formatting
from icha.support.formatting import format_count, printable

# Largest number of lines that are printed about missing files, failed runs or the output of Snakemake.
MOST_LINES = 12


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
        bool, typer.Option("--dry-run", "-n", help="Print the plan and the number of jobs; compute nothing.")
    ] = False,
) -> None:
    """Compute the results of a campaign that are missing or outdated.

    In a terminal, a bar shows the progress; otherwise the command prints a line at least once a minute. At the end the
    command prints failures, and the paths of figures, dataset and report. Ctrl-C stops the campaign; repeat the command
    to continue.

    Exit status: 0 if all requested results exist, 1 if a job failed (independent jobs run nevertheless), 2 if the
    campaign cannot start.
    """
    from icha.planning.ownership import find_conflict
    from icha.planning.validity import expected_validity

    workflow = find_workflow()
    targets = list(targets or [])
    # The first argument of `icha run figures` and `icha run -- --forceall` is not a configuration.
    if config is not None and (config.startswith("-") or (config in TARGETS and not Path(config).is_file())):
        config, targets = None, [config, *targets]
    path = find_configuration(config)
    folder = (folder or project()).resolve()
    campaign = read_configuration(path, folder).campaign
    results = folder / "results" / campaign.name
    names = list(itertools.takewhile(lambda target: not target.startswith("-"), targets))
    if unknown := [name for name in names if name not in TARGETS and not name.startswith(f"results/{campaign.name}/")]:
        expected = f"{', '.join(TARGETS)}, or a file under results/{campaign.name}/"
        raise UserError(f"{', '.join(unknown)}: not a target; expected {expected}")
    if reason := find_conflict(shorten_path(results), path):
        raise UserError(f"{reason} Nothing was started")
    # With -P, a file in the working directory cannot replace a module of the same name.
    program = [sys.executable, "-P", "-m", "snakemake"]
    options = [
        *("--snakefile", str(workflow / "Snakefile"), "--directory", str(folder)),
        *(["--configfile", str(path.resolve())] if path.resolve() != (workflow / DEFAULT).resolve() else []),
        *(["--cores", str(cores)] if cores else []),
        # Snakemake finds profiles/default without this option.
        *(["--workflow-profile", str(_find_profile(profile, workflow))] if profile else []),
    ]
    cores = cores or DEFAULT_CORES
    local = profile is None  # with another profile, jobs may run on other machines
    if dry_run:
        jobs = _dry_run([*program, *targets, *options, "--dry-run"], workflow)
        print_plan(path, campaign, folder, cores, local=local)
        echo(jobs)
        return
    every = not set(targets) - {"all", "report", "publish"}
    if not set(names) - set(TARGETS):
        _print_statements(expected_validity(campaign))

    def compute(campaign, targets):
        """Compute targets with Snakemake, and print the outcome; return whether all checks passed."""
        return _compute([*program, *targets, *options], workflow, campaign, results, targets, cores, local)

    choices = {}
    if every:
        campaign, choices = reach_accuracy(campaign, path, folder, cores, compute)
    passed = compute(campaign, targets)
    if every:
        _print_checks(campaign, results)
        print_accuracy(choices)
    if not passed:
        raise typer.Exit(FAILED)
    if "publish" in targets:
        version = campaign.deposit_metadata().version
        echo(f"deposit: {shorten_path(results / 'publish' / f'{campaign.name}-{version}.zip')}")


def _find_profile(profile: str, workflow: Path) -> Path:
    """Find the folder of a Snakemake profile by its path or its name."""
    for path in (Path(profile), workflow / "profiles" / profile):
        if (path / "config.yaml").is_file():
            return path.resolve()
    names = sorted(path.parent.name for path in (workflow / "profiles").glob("*/config.yaml"))
    raise UserError(f"--profile {profile}: no folder with a config.yaml; expected a folder, or {', '.join(names)}")


def _dry_run(command: list[str], workflow: Path) -> str:
    """Plan with Snakemake and run nothing; return how many jobs would run. After an error, print the error and exit."""
    done = subprocess.run(command, cwd=workflow, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        _print_lines("Snakemake could not start:", done.stdout.splitlines()[-MOST_LINES:])
        raise typer.Exit(FAILED)
    jobs = re.findall(r"^(\S+) +1$", done.stdout.partition("Job stats:")[2].partition("\ntotal")[0], re.MULTILINE)
    jobs = [rule for rule in jobs if rule not in TARGETS]
    return f"{format_count(len(jobs), 'job')} would run." if jobs else "Nothing would run: all results are up to date."


def _compute(command: list[str], workflow: Path, campaign, results: Path, targets, cores: int, local: bool) -> bool:
    """Run a command of Snakemake, show its progress and print its outcome; after a failure, exit.

    Return True if no job failed, and False if only the verdict did: then all results exist, without the failed runs.
    """
    from icha.planning.plan import find_shortages, needed_for, plan, time_on

    items = needed_for(targets, plan(campaign, results))
    for shortage in find_shortages(items, cores, results, local=local):
        echo(f"Warning: {shortage}", err=True, fg="yellow")
    progress = Progress(items, results, cores)
    if progress.expected:
        expected = f"about {formatting.duration(time_on(items, cores))} on {format_count(cores, 'core')}"
        echo(f"{campaign.name}: {format_count(len(progress.expected), 'file')} to compute, {expected}; planning …")
    log = results / "logs/snakemake.log"
    try:
        log.parent.mkdir(parents=True, exist_ok=True)
        begin = log.open("a").tell()
    except OSError as error:
        raise UserError(
            f"cannot write to {results}: {error.strerror}; free some space, change its permissions, or use another "
            "folder: --directory FOLDER"
        ) from None
    status, stopped = run_process(command, workflow, log, progress, campaign.name)
    count = len(progress.finished)
    if not count and not status:
        echo("Nothing to do: all requested results exist and are up to date.")
    else:
        items = needed_for(targets, plan(campaign, results))
        missing = sum(item.to_do for item in items)
        text = f"{format_count(count, 'file')} computed in {formatting.duration(progress.seconds)}"
        echo(f"{text}, {missing} missing or outdated" if missing else text)
        _print_early_ends(results, items)
    failed = _print_reasons(results, log, begin, progress, stopped) if status else []
    files = {"figures": "figures", "dataset": f"dataset/{campaign.name}.nc", "report": "report.html"}
    for name, file in files.items() if count or not status else ():  # otherwise the files are from an earlier call
        if (results / file).exists():
            echo(f"{name + ':':<9}{shorten_path(results / file)}")
    drawn = {file.stem for file in (results / "figures").glob("*.png")}
    if others := sorted(drawn - campaign.figures.by_name().keys()):
        echo(f"not in the configuration, remove their files if they are not needed: figures {', '.join(others)}")
    if status:
        echo(f"log:     {shorten_path(log)}")
    if status and (stopped or failed != ["verdict.log"]):
        raise typer.Exit(FAILED)
    return not status


def _print_reasons(results: Path, log: Path, begin: int, progress: Progress, stopped: bool) -> list[str]:
    """Print why jobs failed: the last line `Error: …` of each log, or else a part of Snakemake's output.

    Return the names of the logs with errors. In `log`, the output of this call begins at the byte `begin`.
    """
    from icha.support.atomic_files import probe_folder

    errors = {}
    for file in sorted(log.parent.rglob("*.log")):
        if file != log and file.stat().st_mtime >= progress.start:
            found = re.findall("^Error: *(.*)", file.read_text(encoding="utf-8", errors="replace"), re.MULTILINE)
            errors |= {file: found[-1]} if found else {}
    if errors:
        lines = [f"{printable(error)}\n        log: {shorten_path(file)}" for file, error in errors.items()]
        _print_lines(f"{format_count(len(errors), 'job')} failed:", lines)
    elif not stopped:
        output = log.read_bytes()[begin:].decode(errors="replace").splitlines()
        # A job that was killed has written no error; Snakemake names the signal in the lines before the rule.
        failed = next((k for k, line in enumerate(output) if line.startswith("Error in rule")), None)
        shown = output[-MOST_LINES:] if failed is None else output[max(failed - 3, 0) : failed + 6]
        _print_lines(f"Snakemake could not {'continue' if progress.finished else 'start'}:", shown)
    if reason := probe_folder(results):
        # The logs of the jobs are in the same folder, so the jobs may have been unable to report the error.
        folder = shorten_path(results)
        echo(f"cannot write to {folder}: {reason.strerror}. Solve this problem and repeat the command", fg="red")
    if stopped:
        echo("Stopped before the end. Repeat the command to continue.", fg="red")
    return [file.name for file in errors]


def _print_lines(heading: str, lines: list[str], colour: str | None = "red") -> None:
    echo(heading, fg=colour)
    for line in lines[:MOST_LINES]:
        echo(f"    {line}")
    if len(lines) > MOST_LINES:
        echo(f"    … and {len(lines) - MOST_LINES} more")


def _print_early_ends(results: Path, items) -> None:
    """Print the contacts whose runs failed or ended early by physics; write all reasons to files in `logs`."""
    from icha.planning.plan import DONE, FAILED, RUNS

    for state, what, name, colour in (
        (FAILED, "failed", "failed_runs.txt", "red"),
        (DONE, "ended before the last target, as physics decides", "ended_runs.txt", None),
    ):
        found = [item for item in items if item.part == RUNS and item.state == state and item.reason]
        if not found:
            continue
        reasons = {item.path.removeprefix("runs/").removesuffix(".nc"): item.reason for item in found}
        file = results / "logs" / name
        file.write_text("".join(f"{run}: {reason}\n" for run, reason in reasons.items()), encoding="utf-8")
        # One line for all seeds of a contact, with the first reason.
        contacts: dict[str, list[str]] = {}
        for run in reasons:
            contacts.setdefault(re.sub("/seed[0-9]+/", "/", run), []).append(run)
        lines = [f"{runs[0]}: {reasons[runs[0]]} ({format_count(len(runs), 'seed')})" for runs in contacts.values()]
        _print_lines(f"{format_count(len(found), 'run')} {what}; all reasons: {shorten_path(file)}", lines, colour)


def _print_checks(campaign, results: Path) -> None:
    """Print how many checks of the results have passed, and whether the models are applicable to the campaign."""
    import xarray as xr

    from icha.analysis.checks import read_checks
    from icha.datasets.files import read_campaign
    from icha.planning.results import campaign_files
    from icha.report.validity import statements_on_results

    files = campaign_files(campaign, str(results))
    checks = read_checks(files.checks)
    passed = sum(check.passed for check in checks)
    echo(f"checks:  {passed} of {len(checks)} checks of the solved equations passed")
    echo("Applicability of the models, which is a separate question:")
    errors = read_campaign(files.model_error[0]) if files.model_error else None
    with xr.open_datatree(files.dataset, engine="netcdf4") as tree:
        _print_statements(statements_on_results(tree, errors))


def _print_statements(statements) -> None:
    for statement in statements:
        echo(f"{statement.about + ':':<9} {statement.text}", fg=None if statement.good else "yellow")
