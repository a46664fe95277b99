"""Write a campaign to start from."""

import json
import os
import re
from pathlib import Path
from string import Template
from typing import Annotated

import typer

from icha.cli.project import CAMPAIGNS, Mistake, campaigns, project, shown

TEMPLATES = Path(__file__).parent / "templates"
# Whether boundary elements stand beside the model.
_MODELS = {
    False: "# models: [asperities, boundary_elements]",
    True: "models: [asperities, boundary_elements]",
}


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
    pull_off: Annotated[bool, typer.Option("--pull-off", help="Add a study of pull-off and hysteresis.")] = False,
    boundary_elements: Annotated[
        bool, typer.Option("--boundary-elements", help="Add runs by boundary elements.")
    ] = False,
) -> None:
    """Write a commented campaign, config/campaigns/NAME.yaml, and say how to go on.

    It runs as it is. With a measured file, first fill in what the file does not say; the command lists these keys.
    """
    from icha.support.values import NAME_PATTERN

    folder = project()
    if not re.fullmatch(NAME_PATTERN, name) or name.startswith("-"):
        raise Mistake(f"{name!r} is not a name; allowed: lower-case letters, digits, '_' and '-'")
    file = folder / CAMPAIGNS / f"{name}.yaml"
    if name in campaigns(folder) and not file.exists():
        raise Mistake(f"{name} is the campaign of {shown(campaigns(folder)[name])}; choose another name")
    if file.exists():
        raise Mistake(f"{shown(file)} is there already; choose another name, or remove it")
    if measured is not None and boundary_elements:
        raise Mistake(
            "--boundary-elements and --measured cannot be combined: boundary elements need a periodic surface, and "
            "the measured surface of the template is free"
        )
    if data is not None and measured is None:
        raise Mistake("--data: names data in a measured file; allowed: only with --measured")
    surface, section, to_fill_in = ("rough", _part("self_affine"), [])
    if measured is not None:
        surface, section, to_fill_in = _measured(measured, data, file.parent)
    slopes = "[0.5]" if measured is None else "measured"
    text = _part(
        "campaign",
        name=name,
        title=name.replace("_", " ").replace("-", " ").capitalize(),
        runs="It runs once the keys marked `to fill in` have values." if to_fill_in else "It runs as it is.",
        schema=_relative(folder / "workflow/schemas/config.schema.json", file.parent),
        readme=_relative(folder / "config/README.md", folder),
        surface=surface,
        surfaces=section.rstrip("\n"),
        seeds="    seeds: 1..3                  # or a list; the figures show means and their confidence\n"
        if measured is None
        else "",
        slopes=slopes,
        vary="hurst: [0.6, 0.8]" if measured is None else "contact_modulus: [1 MPa, 2 MPa]",
        pull_off=_part("pull_off", surface=surface, slopes=slopes) if pull_off else "",
        models=_MODELS[boundary_elements],
        figures="".join(
            f"  {figure}\n"
            for figure, wanted in (
                ("fig13_loops: {study: pull}", pull_off),
                ("fig15_loss: {studies: [pull]}", pull_off),
                ("fig10_model_error: {study: load}", boundary_elements),
            )
            if wanted
        ),
    )
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text.rstrip("\n") + "\n", encoding="utf-8")
    typer.echo(f"{shown(file)} written")
    for line in to_fill_in:
        typer.secho(f"to fill in: {line}", fg="yellow")
    typer.echo(f"next:  icha describe {name}    what it will compute\n       icha run {name}         compute it")


def _part(template: str, **values: str) -> str:
    """A template with the values in their places."""
    return Template((TEMPLATES / f"{template}.yaml").read_text(encoding="utf-8")).substitute(values)


def _relative(path: Path, start: Path) -> str:
    return Path(os.path.relpath(path, start)).as_posix()


def _measured(path: Path, data: str | None, start: Path) -> tuple[str, str, list[str]]:
    """Name and section of a measured surface, and what of it is left to fill in."""
    import numpy as np

    from icha.surfaces.measured.scan import read_scan
    from icha.surfaces.measured.settings import Preparation, UnfitTopography

    if path.is_dir():
        raise Mistake(f"--measured {path}: is a folder; allowed: a file that holds a topography")
    if not path.is_file():
        raise Mistake(f"--measured {path}: no such file")
    if not path.read_bytes().strip():
        raise Mistake(f"--measured {path}: the file is empty; allowed: one that holds a topography")
    assumed, missing = {}, {}
    guesses = {"height_unit": 1e-9, "size": (1e-4, 1e-4)}
    while True:
        try:
            scan = read_scan(path, Preparation("auto", "free", data, **assumed))
            break
        except UnfitTopography as error:
            if error.key not in guesses or error.key in assumed:
                how = "; say which by --data NAME" if error.key == "data" else ""
                raise Mistake(f"--measured {path}: {error.key} {error}{how}") from None
            assumed[error.key] = guesses[error.key]
            missing[error.key] = str(error)
    sides = None
    if "height_unit" in missing and "size" not in missing:
        # Coordinates without a unit would count in that of the heights, which is not known either.
        bare = read_scan(path, Preparation("auto", "free", data, **assumed, lateral_unit=1.0))
        if bare.size != scan.size:
            sides = bare.size
            missing["lateral_unit"] = "is missing, and the file does not say it; left out, it is that of the heights"
    rows, columns = scan.heights.shape
    lines = [f"data: {json.dumps(data)}"] if data is not None else []
    lines.append(f"# {columns} x {rows} points{_what_is_known(scan, missing, sides)}")
    examples = {"height_unit": "nm", "lateral_unit": "um", "size": "[90 um, 90 um]"}
    for key in missing:
        empty = " (empty: that of the heights)" if key == "lateral_unit" else ""
        lines.append(f"{key}:        # to fill in, since the file does not say it{empty}: such as {examples[key]}")
    if gaps := int(np.count_nonzero(~np.isfinite(scan.heights))):
        lines.append(f"missing: fill                # {gaps} points have no height; `refuse` makes that an error")
    found = "".join(f"    {line}\n" for line in lines)
    name = re.sub("[^a-z0-9_-]+", "_", path.stem.lower()).strip("_") or "measured"
    section = _part("measured", surface=name, path=_relative(path.resolve(), start.resolve()), found=found)
    return name, section, [f"surfaces.{name}.{key} ({why})" for key, why in missing.items()]


def _what_is_known(scan, missing, sides) -> str:
    """Size and heights of a scan; `sides` are in the file's coordinates, if it gives these without their unit."""
    import numpy as np

    known = ""
    if sides is not None:
        known += f" over {sides[0]:.4g} x {sides[1]:.4g} in its coordinates"
    elif "size" not in missing:
        known += f" over {scan.size[0] * 1e6:.4g} um x {scan.size[1] * 1e6:.4g} um"
    if "height_unit" not in missing:
        known += f", heights from {np.nanmin(scan.heights) * 1e6:.4g} um to {np.nanmax(scan.heights) * 1e6:.4g} um"
    return known
