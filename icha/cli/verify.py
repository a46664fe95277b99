"""Tell whether a deposit is what it was."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import FAILED, Mistake
from icha.support import in_words


def verify(
    deposit: Annotated[Path, typer.Argument(help="Folder of a deposit, or its zip.", show_default=False)],
) -> None:
    """Verify a deposit: all its files must be there with the right checksums, and no others.

    Exit status: 0 if it is whole, 1 if not (each flaw is printed), 2 if there is no such file or folder.
    """
    from icha.publication.deposit_files import contents, verify_deposit

    if not deposit.exists():
        raise Mistake(f"{deposit}: no such file or folder; needed: the folder of a deposit, or its zip")
    problems = verify_deposit(deposit)
    for problem in problems:
        typer.echo(problem)
    if problems:
        typer.secho(f"{deposit}: not whole: {in_words.counted(len(problems), 'problem')}", err=True, fg="red")
        raise typer.Exit(FAILED)
    sizes = contents(deposit)
    typer.echo(f"{deposit}: whole: {in_words.counted(len(sizes), 'file')}, {in_words.size(sum(sizes.values()))}")
