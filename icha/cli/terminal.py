"""What commands print: whatever is in it, nothing acts on the terminal but the colours that are asked for here."""

import sys

import typer

from icha.support.printable import printable_lines


def say(text: object = "", *, err: bool = False, **style) -> None:
    """Print text, to the error output if `err`; `style` is that of `typer.style`: `fg="red"`, `bold=True`."""
    typer.secho(printable_lines(text), err=err, **style)


def markup(text: object) -> str:
    """The text for a table or line of rich, in which brackets stand for themselves."""
    from rich.markup import escape

    return escape(printable_lines(text))


def confirmed(question: str) -> bool:
    """The answer of who sits at the terminal; that there is none, and Ctrl-C, are a no."""
    try:
        return sys.stdin.isatty() and typer.confirm(question)
    except typer.Abort:
        say()
        return False
