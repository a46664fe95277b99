"""Tell whether a deposit is what it was."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.deposits import flaws_of, listed
from icha.cli.project import FAILED, Large, say
from icha.support import in_words
from icha.support.in_words import printable


def verify(
    deposit: Annotated[Path, typer.Argument(help="Folder of a deposit, or its zip.", show_default=False)],
    large: Large = False,
) -> None:
    """Verify a deposit: all its files must be there with the right checksums, and no others.

    Names that lead out of it, links, devices and zips that unpack to far more than their size are flaws, too, and
    nothing is read of what has them. Nothing of the deposit is executed.

    Exit status: 0 if it is whole, 1 if not (the first hundred flaws are printed), 2 if there is no such file or folder.
    """
    from icha.deposit.deposit_files import whole_deposit

    if problems := flaws_of(deposit, large=large):
        say(listed(problems))
        say(f"{printable(deposit)}: not whole: {in_words.counted(len(problems), 'problem')}", err=True, fg="red")
        raise typer.Exit(FAILED)
    with whole_deposit(deposit) as found:
        sizes = found.sizes
    say(f"{printable(deposit)}: whole: {in_words.counted(len(sizes), 'file')}, {in_words.size(sum(sizes.values()))}")
