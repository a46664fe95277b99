"""Tell whether a deposit is what it was."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.options import Large
from icha.cli.project import FAILED, Mistake
from icha.cli.terminal import say
from icha.support import in_words
from icha.support.printable import printable


def verify(
    deposit: Annotated[Path, typer.Argument(help="Folder of a deposit, or its zip.", show_default=False)],
    large: Large = False,
) -> None:
    """Verify a deposit: all its files must be there with the right checksums, and no others.

    Names that lead out of it, links, devices and zips that unpack to far more than their size are flaws, too, and
    nothing is read of what has them. Nothing of the deposit is executed.

    Exit status: 0 if it is whole, 1 if not (each flaw is printed), 2 if there is no such file or folder.
    """
    from icha.publication.deposit_files import contents, verify_deposit
    from icha.publication.strangers_files import LIMITS, NO_LIMITS

    if not deposit.exists():
        raise Mistake(f"{deposit}: no such file or folder; needed: the folder of a deposit, or its zip")
    problems = verify_deposit(deposit, NO_LIMITS if large else LIMITS)
    for problem in problems:
        say(problem)
    if problems:
        say(f"{printable(deposit)}: not whole: {in_words.counted(len(problems), 'problem')}", err=True, fg="red")
        raise typer.Exit(FAILED)
    sizes = contents(deposit)
    say(f"{printable(deposit)}: whole: {in_words.counted(len(sizes), 'file')}, {in_words.size(sum(sizes.values()))}")
