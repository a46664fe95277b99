"""Functions for all commands: options, printing, error messages, and the folders of campaigns and results."""

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

CAMPAIGNS = Path("config/campaigns")
DEFAULT = Path("config/config.yaml")
TARGETS = ("all", "surfaces", "runs", "references", "figures", "dataset", "report", "publish")
# Exit statuses.
FAILED, WRONG = 1, 2
DEFAULT_CORES = 2  # number of cores in profiles/default


def option(help_text: str, *names: str, **settings):
    """Declare an option whose default is not printed automatically; `help_text` states the default."""
    return typer.Option(*names, help=help_text, show_default=False, **settings)


Config = Annotated[
    str | None,
    typer.Argument(help="Configuration file, or name of a campaign. Default: config/config.yaml.", show_default=False),
]
Cores = Annotated[int | None, option("Number of cores to use. Default: 2.", "--cores", "-c", min=1, max=999_999)]
Folder = Annotated[
    Path | None,
    option(
        "Folder that contains results/. Default: the clone of ICHA; outside a clone, the working directory.",
        "--directory",
        "-d",
        resolve_path=True,
    ),
]


def echo(text: object = "", *, err: bool = False, **style) -> None:
    """Print text; if `err` is true, print to standard error. `style` contains options such as `fg="red"`."""
    typer.secho(printable_lines(text), err=err, **style)


class UserError(Exception):
    """Error: a command cannot be carried out; the message gives the reason and a remedy."""


def reports_errors(command: Callable) -> Callable:
    """Decorate a command so that an expected error prints a message without traceback, and sets the exit status."""

    def fail(message: object, status: int):
        echo(f"Error: {message}", err=True, fg="red")
        raise typer.Exit(status) from None

    @wraps(command)
    def call(*args, **kwargs):
        try:
            return command(*args, **kwargs)
        except UserError as error:
            fail(error, WRONG)
        except BrokenPipeError:  # `icha describe --runs | head`
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(FAILED) from None
        except MemoryError as error:
            fail(f"not enough memory: {error or 'all memory is in use'}", FAILED)
        except OSError as error:  # a folder without permission, a full disk
            fail(f"{error.filename}: {error.strerror}" if error.filename and error.strerror else error, FAILED)

    return call


def find_project() -> Path | None:
    """Return the clone of ICHA that contains the working directory; None outside a clone."""
    for folder in (Path.cwd(), *Path.cwd().parents):
        if (folder / "Snakefile").is_file() and (folder / "workflow/rules/runs.smk").is_file():
            return folder
    return None


def project() -> Path:
    """Return the folder of campaigns and results: inside a clone of ICHA the clone, else the working directory."""
    return find_project() or Path.cwd()


def find_workflow() -> Path:
    """Return the folder with Snakefile and profiles: inside a clone of ICHA the clone, else the installed workflow."""
    return find_project() or own_workflow()


def list_campaigns() -> dict[str, Path]:
    """Return the configuration files of the project and of ICHA, by the name of the campaign.

    The name of a campaign is the file name without .yaml, or the value of the key `name` in config/config.yaml.
    """
    files: dict[str, Path] = {}
    for folder in (find_workflow(), project()):  # files of the project replace files of ICHA with the same name
        default = folder / DEFAULT
        text = default.read_text(encoding="utf-8", errors="replace") if default.is_file() else ""
        if name := re.search(r"^name: *([\w-]+)", text, re.MULTILINE):
            files[name[1]] = default
        files |= {path.stem: path for path in sorted((folder / CAMPAIGNS).glob("*.yaml"))}
    return files


def find_configuration(config: str | None) -> Path:
    """Find a configuration file by its path or by the name of its campaign; None means the default file."""
    files = list_campaigns()
    listed = f"expected a YAML file or a campaign: {', '.join(sorted(files))}. `icha new NAME` writes a new campaign"
    if config is None:
        if not (project() / DEFAULT).is_file():
            raise UserError(f"no {DEFAULT} in this folder; {listed}")
        return shorten_path(project() / DEFAULT)
    if Path(config).is_file():
        return Path(config)
    if config in files:
        return shorten_path(files[config])
    raise UserError(f"{config}: {problem_with_path(config)}, and not the name of a campaign; {listed}")


def read_configuration(path: Path, home: Path | None = None):
    """Load a configuration and print its warnings; raise `UserError` with all of its errors.

    `home` is the folder that contains results/. Default: the folder of the project.
    """
    from icha.configuration.errors import ConfigurationError
    from icha.configuration.load import load_configuration

    try:
        configuration = load_configuration(path, results=(home or project()) / "results")
    except ConfigurationError as error:
        raise UserError(f"the configuration cannot be run:\n{error}") from None
    for warning in configuration.warnings:
        echo(f"Warning: {warning}", err=True, fg="yellow")
    return configuration


def shorten_path(path: Path) -> Path:
    """Shorten a path for printing: a path inside the working directory becomes relative to this directory."""
    path = Path(path)
    return path.relative_to(Path.cwd()) if path.is_absolute() and path.is_relative_to(Path.cwd()) else path
