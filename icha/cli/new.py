"""Write a campaign to start from."""

import os
import re
import shutil
from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import CAMPAIGNS, UserError, campaigns, echo, project, shown, workflow_folder
from icha.cli.scans import MeasuredSection, about_scan, check_picture, measured_section

_TEMPLATE = Path(__file__).parent / "templates/campaign.yaml"
# What explains the keys of a configuration to editors and to people.
_SCHEMA, _README = Path("workflow/schemas/config.schema.json"), Path("config/README.md")


def new(
    name: Annotated[str, typer.Argument(help="Name of the campaign: lower-case letters, digits, `_`, `-`.")],
    measured: Annotated[
        Path | None,
        typer.Option(help="File of a measured topography; what the file says is filled in.", show_default=False),
    ] = None,
    data: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Variable, dataset or channel of the measured file, if it has several.",
            show_default=False,
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            help="Draw the measured file, with its spectrum, into this file (.png, .pdf or .svg).", show_default=False
        ),
    ] = None,
    pull_off: Annotated[bool, typer.Option("--pull-off", help="Add a study of pull-off and hysteresis.")] = False,
    boundary_elements: Annotated[
        bool, typer.Option("--boundary-elements", help="Add runs by boundary elements.")
    ] = False,
) -> None:
    """Write a commented campaign, config/campaigns/NAME.yaml, and say how to go on.

    It runs as it is. With a measured file, first fill in what the file does not say; the command lists these keys. It
    also says how many summits the scan has, whether its spectrum ends in noise, and what is advisable then.
    """
    from icha.support.values import NAME_PATTERN

    folder = project()
    if not re.fullmatch(NAME_PATTERN, name) or name.startswith("-"):
        raise UserError(f"{name!r} is not a name; allowed: lower-case letters, digits, '_' and '-'")
    file = folder / CAMPAIGNS / f"{name}.yaml"
    if name in campaigns() and not file.exists():
        raise UserError(f"{name} is the campaign of {shown(campaigns()[name])}; choose another name")
    if file.exists():
        raise UserError(f"{shown(file)} is there already; choose another name, or remove it")
    if data is not None and measured is None:
        raise UserError("--data: names data in a measured file; allowed: only with --measured")
    check_picture(plot)
    if plot is not None and measured is None:
        raise UserError("--plot: draws a measured file; allowed: only with --measured")
    own = None if measured is None else measured_section(measured, data, file.parent)
    values = {
        "name": name,
        "schema": _relative(_schema(folder), file.parent),
        "readme": _README.as_posix(),
        "scan": own,
        "pull_off": pull_off,
        "boundary_elements": boundary_elements,
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    _write(file, values, "as it is" if own is None else "once the keys marked `to fill in` have values")
    against = [] if own is None else _against(file, own)
    if against:
        _write(file, values, f"once `icha describe {name}` says nothing against it any more")
    echo(f"{shown(file)} written")
    if own is not None:
        _tell(own, against, plot)
    echo(f"next:  icha describe {name}    what it will compute\n       icha run {name}         compute it")


def _write(file: Path, values: dict, runs: str) -> None:
    """Write the campaign; `runs` says when it can be run."""
    from jinja2 import Template

    template = Template(_TEMPLATE.read_text(encoding="utf-8"), trim_blocks=True, keep_trailing_newline=True)
    file.write_text(template.render(values, runs=runs), encoding="utf-8")


def _tell(section: MeasuredSection, against: list[str], plot: Path | None) -> None:
    """Tell of a scan, what is to fill in, and what else is in the way; draw it if asked."""
    to_scale = not against and not section.to_fill_in.keys() - {"boundary"}
    for line in about_scan(section.name, section.scan, to_scale=to_scale):
        echo(line)
    if not to_scale:
        echo(f"{section.name}: `icha describe` looks at its spectrum once units and size are settled")
    if plot is not None:
        from icha.cli.quick_plot import draw_scans

        draw_scans({section.name: section.scan}, plot)
        echo(f"drawn: {shown(plot)}")
    for key, why in section.to_fill_in.items():
        echo(f"to fill in: surfaces.{section.name}.{key} ({why})", fg="yellow")
    for line in against:
        echo(f"to settle: {line}", fg="yellow")


def _schema(folder: Path) -> Path:
    """The schema of configurations; outside of a clone a copy in config/, beside one of the page on all keys."""
    workflow = workflow_folder()
    if workflow == folder:
        return folder / _SCHEMA
    copies = [folder / "config" / file.name for file in (_SCHEMA, _README)]
    for file, copy in zip((_SCHEMA, _README), copies, strict=True):
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(workflow / file, copy)
    return copies[0]


def _relative(path: Path, start: Path) -> str:
    return Path(os.path.relpath(path, start)).as_posix()


def _against(file: Path, section: MeasuredSection) -> list[str]:
    """What is wrong with a configuration apart from what is to fill in, as `icha describe` will say it."""
    from icha.configuration.errors import ConfigurationError
    from icha.configuration.load import load_configuration

    try:
        load_configuration(file, {"surfaces": {section.name: section.filled_in}})
    except ConfigurationError as error:
        lines = [line.partition(": ")[2] for line in str(error).splitlines()]
        # Without their units, sizes, slopes and whether a surface sticks are guesses.
        guessed = ()
        if section.to_fill_in.keys() - {"boundary"}:
            guessed = (
                f"surfaces.{section.name}.size:",
                f"surfaces.{section.name}.height_unit:",
                "studies.load.models:",
            )
        return [line for line in lines if not line.startswith(guessed)]
    return []
