"""What commands share: the project they work in, options, printing, and how users are told of their mistakes."""

import os
import re
import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated

import typer

from icha.support.formatting import printable_lines
from icha.support.input_files import problem_with_path
from icha.support.program import own_workflow

Config = Annotated[
    str | None,
    typer.Argument(help="Configuration file, or name of a campaign. Left out: config/config.yaml.", show_default=False),
]
Anyway = Annotated[
    bool, typer.Option("--anyway", help="Run even if more memory or disk is expected to be needed than there is.")
]
Large = Annotated[
    bool,
    typer.Option(
        "--large", help="Accept a deposit with more files, or a zip that unpacks to more, than is good from a stranger."
    ),
]
CAMPAIGNS = Path("config/campaigns")
DEFAULT = Path("config/config.yaml")
# Exit statuses.
FAILED, WRONG = 1, 2


def echo(text: object = "", *, err: bool = False, **style) -> None:
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
        echo()
        return False


def _cores(value: str | None) -> str | None:
    if value is not None and value != "all" and not re.fullmatch("0*[1-9][0-9]{0,5}", value, re.ASCII):
        raise typer.BadParameter(f"{value!r} is neither a number of cores, 1 or more, nor `all`")
    return value


def _folder(value: Path | None) -> Path | None:
    try:
        return value if value is None else value.resolve()
    except RuntimeError:  # of Python before 3.13
        raise typer.BadParameter(f"{str(value)!r} is a link that leads to itself; allowed: a folder") from None


def core_count(cores: str | None) -> int:
    """How many cores are meant."""
    if cores == "all":
        return os.cpu_count() or 1
    return int(cores) if cores else 2


Cores = Annotated[
    str | None,
    typer.Option("--cores", "-c", help="Cores to use, or `all`. Left out: 2.", callback=_cores, show_default=False),
]
Folder = Annotated[
    Path | None,
    typer.Option(
        "--directory",
        "-d",
        help="Folder that holds results/. Left out: the clone, or the working directory.",
        callback=_folder,
        show_default=False,
    ),
]


class UserError(Exception):
    """What was asked for cannot be done; the message says why and what can."""


def reports_errors(command: Callable) -> Callable:
    """Decorate a command: mistakes and failures end it with their message and an exit status, not with a traceback."""

    @wraps(command)
    def call(*args, **kwargs):
        try:
            return command(*args, **kwargs)
        except UserError as mistake:
            echo(f"Error: {mistake}", err=True, fg="red")
            raise typer.Exit(WRONG) from None
        except UnicodeEncodeError as error:
            echo(f"Error: {error.object!r}: holds bytes that are no UTF-8; allowed: text", err=True, fg="red")
            raise typer.Exit(WRONG) from None
        except BrokenPipeError:
            # Whoever read our output has seen enough (`icha describe --runs | head`).
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(FAILED) from None
        except MemoryError as error:
            echo(f"Error: not enough memory: {error or 'nothing is left'}", err=True, fg="red")
            raise typer.Exit(FAILED) from None
        except OSError as error:
            # What the system refuses: a folder that cannot be written to, a full disk.
            what = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else error
            echo(f"Error: {what}", err=True, fg="red")
            raise typer.Exit(FAILED) from None

    return call


def find_project(start: Path | None = None) -> Path | None:
    """The clone: the folder with the Snakefile, at or above `start` (the working directory if left out)."""
    start = (start or Path.cwd()).resolve()
    for folder in (start, *start.parents):
        if (folder / "Snakefile").is_file() and (folder / "workflow/rules/runs.smk").is_file():
            return folder
    return None


def project() -> Path:
    """The folder that holds the campaigns and results of whoever works here: the clone, else the working directory."""
    return find_project() or Path.cwd()


def workflow_folder() -> Path:
    """The folder of the workflow that is run, with its Snakefile and profiles: the clone, else what is installed."""
    return find_project() or own_workflow()


def configuration_path(asked: str | None) -> Path:
    """The configuration file that is meant: by its path, by the name of a campaign, or the default one.

    Raises
    ------
    UserError
        If there is no such file.
    """
    if asked is None:
        if not (project() / DEFAULT).is_file():
            raise UserError(
                f"there is no {DEFAULT} here; name a campaign: {', '.join(sorted(campaigns()))}, or a YAML file. "
                "`icha new NAME` writes a campaign to start from"
            )
        return shown(project() / DEFAULT)
    if Path(asked).is_file():
        return Path(asked)
    there = campaigns()
    if asked in there:
        return shown(there[asked])
    if Path(asked).exists():
        raise UserError(f"{asked}: {problem_with_path(asked)}; allowed: a YAML file, or the name of a campaign")
    raise UserError(
        f"{asked}: no such file and no campaign of that name; there are: {', '.join(sorted(there))}. `icha new NAME` "
        "writes a campaign to start from"
    )


def campaigns() -> dict[str, Path]:
    """The files of campaigns by the names that commands take: those of the project, and those that come with ICHA.

    The default file goes by the name that is in it.
    """
    named: dict[str, Path] = {}
    for folder in (workflow_folder(), project()):  # where names are the same, the project's own go before
        default = _name_in(folder / DEFAULT) if (folder / DEFAULT).is_file() else None
        named |= {default: folder / DEFAULT} if default else {}
        named |= {path.stem: path for path in sorted((folder / CAMPAIGNS).glob("*.yaml"))}
    return named


def _name_in(file: Path) -> str | None:
    """The name of the campaign of a configuration file; None where it cannot be read, which is told when it is used."""
    from icha.configuration.errors import ConfigurationError
    from icha.configuration.yaml_files import read_yaml

    try:
        name = read_yaml(file).get("name")
    except ConfigurationError:
        return None
    return name if isinstance(name, str) else None


def read_configuration(path: Path):
    """The configuration of a file, as `icha.configuration.load.load_configuration` gives it; warnings are printed.

    Raises
    ------
    UserError
        With everything that is wrong with it.
    """
    from icha.configuration.errors import ConfigurationError
    from icha.configuration.load import load_configuration

    try:
        configuration = load_configuration(path)
    except ConfigurationError as error:
        raise UserError(f"the configuration cannot be run:\n{error}") from None
    for warning in configuration.warnings:
        echo(f"Warning: {warning}", err=True, fg="yellow")
    return configuration


def profile_settings(folder: Path) -> dict:
    """Settings of a profile of Snakemake, a folder; none if it is not there."""
    import yaml

    file = folder / "config.yaml"
    return yaml.safe_load(file.read_text(encoding="utf-8")) or {} if file.is_file() else {}


def shown(path: Path) -> Path:
    """The path as people like to read it: relative to the working directory where it lies in it."""
    path = Path(path)
    return path.relative_to(Path.cwd()) if path.is_absolute() and path.is_relative_to(Path.cwd()) else path
