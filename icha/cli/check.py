"""The command `icha check`: check the format of files, and whether their results satisfy physical identities."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import FAILED, WRONG, echo
from icha.support.formatting import format_count, printable


def check(
    files: Annotated[
        list[Path], typer.Argument(help="Runs, surfaces, campaign datasets or other results, or folders results/NAME.")
    ],
) -> None:
    """Check the variables, units and attributes of files, and whether results satisfy physical identities.

    For example, the areas of all spots must add up to the contact area. For a folder of results, the command compares
    all files with their checksums, which shows damage of the disk. The command prints all problems of all files.
    Exit status: 0 if no file has problems, 1 if a file has problems, 2 if ICHA cannot read a file.
    """
    from icha.datasets.format import CAMPAIGN, RUN, SURFACE, UnknownFile, identify_file

    status = 0
    for file in files:
        if file.is_dir():
            status = max(status, _check_folder(file))
            continue
        try:
            kind, data = identify_file(file)
        except UnknownFile as error:
            echo(f"Error: {error}", err=True, fg="red")
            status = WRONG
            continue
        if kind not in (RUN, SURFACE, CAMPAIGN):
            echo(f"{file}: {kind}; ICHA can read this file, but has no checks for this kind of file")
            continue
        try:
            problems, count = _problems(kind, data)
        except Exception as error:  # a file of another program may lack any variable
            problems, count = [f"unknown format: {error!r}"], 0
        if problems:
            status = max(status, FAILED)
            echo(f"{file}: {kind}, {format_count(len(problems), 'problem')}", fg="red")
            for problem in problems:
                echo(f"    {printable(problem)}")
        else:
            echo(f"{file}: {kind}, no problems" + (f" ({format_count(count, 'check')} passed)" if count else ""))
    if status:
        raise typer.Exit(status)


def _check_folder(folder: Path) -> int:
    """Compare the files of a folder of results with their checksums; return the exit status."""
    from icha.support.checksums import CHECKSUMS, changed_files

    try:
        changed = changed_files(folder)
    except FileNotFoundError:
        echo(f"Error: {folder}: has no {CHECKSUMS}; expected the folder of a finished campaign", err=True, fg="red")
        return WRONG
    for path in changed:
        echo(f"{folder / path}: is missing, or differs from its checksum in {CHECKSUMS}", fg="red")
    if not changed:
        echo(f"{folder}: all files have their checksums")
    return FAILED if changed else 0


def _problems(kind, data) -> tuple[list[str], int]:
    """Return the problems of a file, and the number of checks of the results."""
    from icha.analysis.checks import COMPLETED, check_campaign
    from icha.checks.run import check_run
    from icha.datasets.format import RUN, SURFACE, problems_with_file

    problems = problems_with_file(kind, data)
    if problems or kind == SURFACE:
        return problems, 0
    if kind == RUN and "incomplete" in data.attrs:
        return [f"the run failed: {data.attrs['incomplete']}"], 1
    checks = (check_run if kind == RUN else check_campaign)(data)
    for check in checks:
        if not check.passed:
            subject = f"{check.subject}: " if check.subject else ""
            values = f"{check.name}: {check.value:.3g}, {check.description}; expected at most {check.limit:g}"
            failure = f"the run failed: {check.description}"
            problems.append(subject + (failure if check.name == COMPLETED else values))
    return problems, len(checks)
