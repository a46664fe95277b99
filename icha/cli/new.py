"""The command `icha new`: write the configuration file of a new campaign."""

import os
import re
import shutil
from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import CAMPAIGNS, UserError, echo, find_workflow, list_campaigns, option, project, shorten_path
from icha.cli.scans import describe_scan, read_measured_section, show_first_lines

TEMPLATES = Path(__file__).parent / "templates"
# Explanations of the keys of a configuration: a schema for text editors, and a page for readers.
SCHEMA, README = Path("workflow/schemas/config.schema.json"), Path("config/README.md")


def new(
    name: Annotated[str, typer.Argument(help="Name of the campaign: lower-case letters, digits, `_`, `-`.")],
    measured: Annotated[
        Path | None, option("File of a measured topography; the command fills in keys that the file determines.")
    ] = None,
    data: Annotated[
        str | None,
        option("Variable, dataset or channel with the heights, if the file contains several.", metavar="NAME"),
    ] = None,
    pull_off: Annotated[bool, typer.Option("--pull-off", help="Add a study of pull-off and hysteresis.")] = False,
    boundary_elements: Annotated[
        bool, typer.Option("--boundary-elements", help="Add runs with boundary elements.")
    ] = False,
    indenter: Annotated[
        bool,
        typer.Option(
            "--indenter", help="Press a sphere, smooth and rough or with a measured surface, into a soft body."
        ),
    ] = False,
) -> None:
    """Write the commented file of a new campaign, config/campaigns/NAME.yaml, and print the next commands.

    The campaign runs without changes. For a measured topography, fill in the keys that the command lists. The command
    also prints the number of summits of the topography, whether its spectrum ends in noise, and recommended keys.
    """
    from jinja2 import Environment, FileSystemLoader

    from icha.support.values import NAME_PATTERN

    file = project() / CAMPAIGNS / f"{name}.yaml"
    if not re.fullmatch(NAME_PATTERN, name) or name.startswith("-"):
        raise UserError(f"{name!r} is not a valid name; expected lower-case letters, digits, '_' and '-'")
    if file.exists():
        raise UserError(f"{shorten_path(file)} exists already; choose another name, or remove the file")
    if name in list_campaigns():
        raise UserError(f"{name} is the campaign of {shorten_path(list_campaigns()[name])}; choose another name")
    if data is not None and measured is None:
        raise UserError("--data needs a measured file; use it with --measured FILE")
    if indenter and (pull_off or boundary_elements):
        raise UserError("--indenter includes boundary elements and pull-off; remove --pull-off and --boundary-elements")
    if measured is not None:
        for line in show_first_lines(measured):
            echo(line)
    section = None if measured is None else read_measured_section(measured, data, file.parent)
    if section is not None and indenter:
        section["to_fill_in"].pop("boundary")
        section["to_fill_in"]["shape.sphere.radius"] = "the radius of the indenter"
    # Autoescape is for HTML; this file is YAML.
    templates = Environment(loader=FileSystemLoader(TEMPLATES), trim_blocks=True, keep_trailing_newline=True)
    text = templates.get_template("indenter.yaml" if indenter else "campaign.yaml").render(
        name=name,
        schema=Path(os.path.relpath(_schema(), file.parent)).as_posix(),
        readme=README.as_posix(),
        scan=section,
        indenter=indenter,
        pull_off=pull_off,
        boundary_elements=boundary_elements,
    )
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    echo(f"{shorten_path(file)} written")
    if section is not None:
        _print_section(section)
    echo(f"next:  icha describe {name}    print the plan\n       icha run {name}         compute the campaign")


def _schema() -> Path:
    """Return the path of the schema of configurations; outside a clone, first copy schema and README.md to config/."""
    workflow, folder = find_workflow(), project()
    if workflow == folder:
        return folder / SCHEMA
    copies = [folder / "config" / file.name for file in (SCHEMA, README)]
    for file, copy in zip((SCHEMA, README), copies, strict=True):
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(workflow / file, copy)
    return copies[0]


def _print_section(section: dict) -> None:
    """Print the description of a scan, and the keys that the user must fill in."""
    missing = section["to_fill_in"].keys()
    known = {"to_scale": not missing - {"boundary", "scattered"}, "sized": "size" not in missing}
    for line in describe_scan(section["name"], section["scan"], **known):
        echo(line)
    for key, reason in section["to_fill_in"].items():
        echo(f"to fill in: surfaces.{section['name']}.{key} ({reason})", fg="yellow")
