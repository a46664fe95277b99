"""What commands that take a deposit have in common: it is there and whole, and somebody agrees to what is done."""

import sys
from pathlib import Path

import typer

from icha.cli.project import FAILED, Mistake, confirmed, say

_MOST_FLAWS = 100


def flaws_of(deposit: Path, *, large: bool) -> list[str]:
    """What is wrong with a deposit that is there, folder or zip, a line each; no line if it is whole."""
    from icha.deposit.deposit_files import verify_deposit
    from icha.deposit.strangers_files import LIMITS, NO_LIMITS

    if not deposit.exists():
        raise Mistake(f"{deposit}: no such file or folder; needed: the folder of a deposit, or its zip")
    return verify_deposit(deposit, NO_LIMITS if large else LIMITS)


def listed(flaws: list[str]) -> str:
    """The flaws, a line each, but for those beyond the first hundred."""
    more = [f"… and {len(flaws) - _MOST_FLAWS:,} more"] if len(flaws) > _MOST_FLAWS else []
    return "\n".join([*flaws[:_MOST_FLAWS], *more])


def agree(question: str, *, yes: bool, done: str) -> None:
    """Ask who sits at the terminal, unless the answer is given by `yes`; end the command, with nothing `done`, if not.

    Raises
    ------
    Mistake
        If nobody is there to be asked.
    """
    if yes:
        return
    if not sys.stdin.isatty():
        raise Mistake(f"there is no terminal to ask at, so nothing is {done}; needed: --yes, or a terminal")
    if not confirmed(question):
        say(f"Nothing was {done}.")
        raise typer.Exit(FAILED)
