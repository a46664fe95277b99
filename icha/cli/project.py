"""Where campaigns and the workflow are, which configuration is meant, and how users are told of their mistakes."""

import os
import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path

import typer

from icha.cli.terminal import say
from icha.support.input_files import flaw_of_path
from icha.support.program import own_workflow

CAMPAIGNS = Path("config/campaigns")
DEFAULT = Path("config/config.yaml")
# Exit statuses.
FAILED, WRONG = 1, 2


class Mistake(Exception):
    """What was asked for cannot be done; the message says why and what can."""


def told(command: Callable) -> Callable:
    """Decorate a command: mistakes and failures end it with their message and an exit status, not with a traceback."""

    @wraps(command)
    def call(*args, **kwargs):
        try:
            return command(*args, **kwargs)
        except Mistake as mistake:
            say(f"Error: {mistake}", err=True, fg="red")
            raise typer.Exit(WRONG) from None
        except UnicodeEncodeError as error:
            say(f"Error: {error.object!r}: holds bytes that are no UTF-8; allowed: text", err=True, fg="red")
            raise typer.Exit(WRONG) from None
        except BrokenPipeError:
            # Whoever read our output has seen enough (`icha describe --runs | head`).
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(FAILED) from None
        except MemoryError as error:
            say(f"Error: not enough memory: {error or 'nothing is left'}", err=True, fg="red")
            raise typer.Exit(FAILED) from None
        except OSError as error:
            # What the system refuses: a folder that cannot be written to, a full disk.
            what = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else error
            say(f"Error: {what}", err=True, fg="red")
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
    Mistake
        If there is no such file.
    """
    if asked is None:
        if not (project() / DEFAULT).is_file():
            raise Mistake(
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
        raise Mistake(f"{asked}: {flaw_of_path(asked)}; allowed: a YAML file, or the name of a campaign")
    raise Mistake(
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
    Mistake
        With everything that is wrong with it.
    """
    from icha.configuration.errors import ConfigurationError
    from icha.configuration.load import load_configuration

    try:
        configuration = load_configuration(path)
    except ConfigurationError as error:
        raise Mistake(f"the configuration cannot be run:\n{error}") from None
    for warning in configuration.warnings:
        say(f"Warning: {warning}", err=True, fg="yellow")
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
