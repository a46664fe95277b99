"""Check files against their documented format and the identities of the physics."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import FAILED, WRONG
from icha.support.in_words import counted


def check(
    files: Annotated[list[Path], typer.Argument(help="Runs, surfaces or campaign datasets (.nc).")],
) -> None:
    """Check files: documented names, dimensions, units and attributes, and the physics that every result must satisfy.

    Exit status: 0 if all is well, 1 if a file has flaws (each is printed), 2 if a file is no run, surface or campaign
    dataset. All files are checked in any case.
    """
    from icha.datasets.format import CAMPAIGN, RUN, UnknownFile, flaws, kind_of

    status = 0
    for file in files:
        try:
            kind, data = kind_of(file)
        except UnknownFile as error:
            typer.secho(f"Error: {error}", err=True, fg="red")
            status = WRONG
            continue
        found = flaws(kind, data)
        tested = 0
        if not found and kind in (RUN, CAMPAIGN):
            findings, tested = _physics(kind, data)
            found += findings
        if found:
            status = max(status, FAILED)
            typer.secho(f"{file}: {kind}, {counted(len(found), 'flaw')}", fg="red")
            for flaw in found:
                typer.echo(f"    {flaw}")
        else:
            numbers = f" ({counted(tested, 'check')} of its numbers)" if tested else ""
            typer.echo(f"{file}: {kind}, all is well{numbers}")
    if status:
        raise typer.Exit(status)


def _physics(kind, data):
    """Checks of the numbers that failed, as text, and how many there are."""
    from icha.analysis.checks import check_campaign, check_run
    from icha.datasets.format import RUN

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
