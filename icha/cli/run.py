"""The command `icha run`: start Snakemake, count the finished files, and report the outcome."""

import itertools
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

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
    read_profile,
    shorten_path,
)
from icha.support import formatting
from icha.support.formatting import format_count, printable

# Largest number of lines that are printed about missing files, failed runs or the output of Snakemake.
MOST_LINES = 12
# Largest number of times that the seeds of a study are increased to reach its accuracy.
_MOST_EXTENSIONS = 2


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
    profile_folder = _profile_folder(profile, workflow)
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
        *(["--workflow-profile", str(profile_folder)] if profile else []),
    ]
    cores = cores or DEFAULT_CORES
    # Jobs of other executors run on other machines.
    local = profile is None or read_profile(profile_folder).get("executor", "local") == "local"
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
        campaign, choices = _reach_accuracy(campaign, path, folder, cores, compute)
    passed = compute(campaign, targets)
    if every:
        _print_checks(campaign, results)
        _print_accuracy(choices)
    if not passed:
        raise typer.Exit(FAILED)
    if "publish" in targets:
        version = campaign.deposit_metadata().version
        echo(f"deposit: {shorten_path(results / 'publish' / f'{campaign.name}-{version}.zip')}")


def _profile_folder(profile: str | None, workflow: Path) -> Path:
    """Find the folder of a Snakemake profile by its path or its name; None means the default profile."""
    for path in (Path(profile or "default"), workflow / "profiles" / (profile or "default")):
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
    table = done.stdout.partition("Job stats:")[2].partition("\ntotal")[0]
    rows = re.findall(r"^(\w+) +(\d+)$", table, re.MULTILINE)
    jobs = sum(int(number) for rule, number in rows if rule not in TARGETS)
    return f"{format_count(jobs, 'job')} would run." if jobs else "Nothing would run: all results are up to date."


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
        with log.open("a") as output:
            begin = output.tell()
    except OSError as error:
        raise UserError(
            f"cannot write to {results}: {error.strerror}; free some space, change its permissions, or use another "
            "folder: --directory FOLDER"
        ) from None
    status, stopped = run_process(command, workflow, log, progress, campaign.name)
    count = len(progress.finished)
    if count or status:
        items = needed_for(targets, plan(campaign, results))
        missing = sum(item.to_do for item in items)
        text = f"{format_count(count, 'file')} computed in {formatting.duration(progress.seconds)}"
        echo(f"{text}, {missing} missing or outdated" if missing else text)
        _print_early_ends(campaign, results, items)
    else:
        echo("Nothing to do: all requested results exist and are up to date.")
    failed = _print_reasons(results, log, begin, progress, stopped) if status else []
    files = {"figures": "figures", "dataset": f"dataset/{campaign.name}.nc", "report": "report.html"}
    for name, file in files.items() if count or not status else ():  # otherwise the files are from an earlier call
        if (results / file).exists():
            echo(f"{name + ':':<9}{shorten_path(results / file)}")
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
        if file != log and file.stat().st_mtime >= progress.called:
            lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
            if found := [line for line in lines if line.startswith("Error:")]:
                errors[file] = found[-1].removeprefix("Error:").strip()
    if errors:
        lines = [f"{printable(error)}\n        log: {shorten_path(file)}" for file, error in errors.items()]
        _print_lines(f"{format_count(len(errors), 'job')} failed:", lines)
    elif not stopped:
        heading = "continue" if progress.finished else "start"
        output = log.read_bytes()[begin:].decode(errors="replace").splitlines()
        # A job that was killed has written no error; Snakemake names the signal in the lines before the rule.
        failed = next((k for k, line in enumerate(output) if line.startswith("Error in rule")), None)
        shown = output[-MOST_LINES:] if failed is None else output[max(failed - 3, 0) : failed + 6]
        _print_lines(f"Snakemake could not {heading}:", shown)
    if reason := probe_folder(results):
        # The logs of the jobs are in the same folder, so the jobs may have been unable to report the error.
        echo(
            f"cannot write to {shorten_path(results)}: {reason.strerror}. Solve this problem and repeat the command",
            fg="red",
        )
    if stopped:
        echo("Stopped before the end. Repeat the command to continue.", fg="red")
    return [file.name for file in errors]


def _print_lines(heading: str, lines: list[str]) -> None:
    echo(heading, fg="red")
    for line in lines[:MOST_LINES]:
        echo(f"    {line}")
    if len(lines) > MOST_LINES:
        echo(f"    … and {len(lines) - MOST_LINES} more")


def _print_early_ends(campaign, results: Path, items) -> None:
    """Print the runs that failed, and those that physics ended early; write all reasons to files in `logs`."""
    from icha.planning.plan import DONE, FAILED, RUNS
    from icha.planning.results import campaign_files

    cases = campaign_files(campaign).runs
    kinds = (
        (FAILED, "failed", "failed_runs.txt", "red"),
        (DONE, "ended before the last target, as physics decides", "ended_runs.txt", None),
    )
    for state, what, name, colour in kinds:
        reasons = {
            cases[item.path]: item.reason for item in items if item.part == RUNS and item.state == state and item.reason
        }
        if not reasons:
            continue
        file = results / "logs" / name
        file.write_text("".join(f"{case.path}: {reason}\n" for case, reason in reasons.items()), encoding="utf-8")
        echo(f"{format_count(len(reasons), 'run')} {what}; all reasons: {shorten_path(file)}", fg=colour)
        _print_contacts(reasons, cases.values())


def _print_contacts(reasons, cases) -> None:
    """Print one line for all seeds of a contact in `reasons`, with the first reason; `cases` are all runs."""
    from icha.contact.models import DEFAULT_MODEL, MODELS

    requested = Counter(case._replace(seed=0) for case in cases)
    groups: dict = {}
    for case in reasons:
        groups.setdefault(case._replace(seed=0), []).append(case)
    for contact, failed in itertools.islice(groups.items(), MOST_LINES):
        seeds = f"{len(failed)} of {requested[contact]} seeds" if requested[contact] > 1 else "1 run"
        model = "" if contact.model == DEFAULT_MODEL else f", {MODELS[contact.model].words}"
        place = f"{contact.surface}, slope {contact.rms_slope:g}, {contact.material}{model}"
        echo(f"  {contact.study}: {seeds} of {place}", bold=True)
        echo(f"    {reasons[failed[0]]}")
    if len(groups) > MOST_LINES:
        echo(f"  … and {len(groups) - MOST_LINES} more groups in the file")


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
    _print_statements(statements)


def _print_statements(statements) -> None:
    for statement in statements:
        echo(f"{statement.about + ':':<9} {statement.text}", fg=None if statement.good else "yellow")
