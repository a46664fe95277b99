"""Check files against their documented format and the identities of the physics."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import FAILED, WRONG, echo
from icha.deposit.verify import CHECKSUMS
from icha.support.formatting import format_count, printable


def check(
    files: Annotated[list[Path], typer.Argument(help="Runs, surfaces, campaign datasets or other results.")],
) -> None:
    """Check files: documented names, dimensions, units and attributes, and the physics that every result must satisfy.

    Exit status: 0 if all is well, 1 if a file has flaws (each is printed), 2 if a file is none that ICHA writes. All
    files are checked in any case.
    """
    from icha.datasets.format import CAMPAIGN, RUN, SOLUTION, SURFACE, UnknownFile, kind_of

    status = 0
    for file in files:
        if (file.suffix == ".zip" and file.is_file()) or (file / CHECKSUMS).is_file():
            echo(f"{file}: deposit; `icha verify` checks it")
            continue
        try:
            kind, data = kind_of(file)
        except UnknownFile as error:
            echo(f"Error: {error}", err=True, fg="red")
            status = WRONG
            continue
        if kind not in (RUN, SURFACE, CAMPAIGN, SOLUTION):
            echo(f"{file}: {kind}; it can be read, and has no checks of its own")
            continue
        try:
            found, tested = _checked(kind, data)
        except Exception as error:  # whatever is missing, or of another shape, in a file from elsewhere
            found, tested = [f"is of another format: {error!r}"], 0
        if found:
            status = max(status, FAILED)
            echo(f"{file}: {kind}, {format_count(len(found), 'flaw')}", fg="red")
            for flaw in found:
                echo(f"    {printable(flaw)}")
        else:
            numbers = f" ({format_count(tested, 'check')} of its numbers)" if tested else ""
            echo(f"{file}: {kind}, all is well{numbers}")
    if status:
        raise typer.Exit(status)


def _checked(kind, data):
    """Everything that is wrong with a file, as text, and how many checks of its numbers there are."""
    from icha.datasets.format import SOLUTION, SURFACE, flaws

    found = flaws(kind, data) if kind != SOLUTION else []
    return (found, 0) if found or kind == SURFACE else _physics(kind, data)


def _physics(kind, data):
    """Checks of the numbers that failed, as text, and how many there are."""
    from icha.analysis.checks import check_campaign, check_solution
    from icha.checks.run import check_run
    from icha.datasets.format import RUN, SOLUTION

    if kind == SOLUTION:
        checks = check_solution(data)
        return [_said(check) for check in checks if not check.passed], len(checks)
    if kind == RUN and "incomplete" in data.attrs:
        return [f"the run failed: {data.attrs['incomplete']}"], 1
    checks = check_run(data) if kind == RUN else check_campaign(data)
    return [_said(check) for check in checks if not check.passed], len(checks)


def _said(check):
    from icha.analysis.checks import COMPLETED

    subject = f"{check.subject}: " if check.subject else ""
    if check.name == COMPLETED:
        return f"{subject}the run failed: {check.description}"
    return f"{subject}{check.name}: {check.value:.3g}, {check.description}; allowed: at most {check.limit:g}"
