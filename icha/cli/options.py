"""Options that several commands have."""

import os
import re
from pathlib import Path
from typing import Annotated

import typer


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


Config = Annotated[
    str | None,
    typer.Argument(help="Configuration file, or name of a campaign. Left out: config/config.yaml.", show_default=False),
]
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
Anyway = Annotated[
    bool, typer.Option("--anyway", help="Run even if more memory or disk is expected to be needed than there is.")
]
Large = Annotated[
    bool,
    typer.Option(
        "--large", help="Accept a deposit with more files, or a zip that unpacks to more, than is good from a stranger."
    ),
]
