"""The command line: `icha`. Commands import slow libraries only when they run."""

from typing import Annotated

import typer

from icha.cli.answer import answer
from icha.cli.check import check
from icha.cli.deposits import reproduce, upload, verify
from icha.cli.describe import describe
from icha.cli.explore import explore
from icha.cli.jkr import jkr
from icha.cli.new import new
from icha.cli.project import echo, reports_errors
from icha.cli.run import run
from icha.cli.show import show

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        echo(f"icha {version('icha')}")
        raise typer.Exit


@app.callback()
def icha(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and exit.", callback=_print_version, is_eager=True),
    ] = False,
) -> None:
    """Compute adhesive contacts of rough surfaces; one YAML file describes a campaign of runs.

    `icha new NAME` writes the file of a new campaign. `icha describe NAME` prints what the campaign will compute.
    `icha run NAME` computes the campaign.

    Exit status: 0 on success, 1 if a job or a check has failed or a file has problems, 2 if the command line or the
    configuration is invalid.
    """


for command in (new, describe, run, answer, show, explore, check, jkr, verify, reproduce, upload):
    app.command()(reports_errors(command))


def main() -> None:
    """Start the command `icha` with the arguments of the command line."""
    app()
