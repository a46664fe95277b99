"""The command `icha explore`: write a page that shows the contacts of a campaign along their paths."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import UserError, echo, option
from icha.support.formatting import format_count
from icha.support.formatting import size as size_in_words


def explore(
    results: Annotated[Path, typer.Argument(help="Folder of a campaign's results: results/<campaign>.")],
    output: Annotated[
        Path | None, option("File of the page. Default: explore.html in the folder of results.", "--output", "-o")
    ] = None,
    study: Annotated[list[str] | None, option("Only this study; may be repeated.")] = None,
    surface: Annotated[list[str] | None, option("Only this surface; may be repeated.")] = None,
    material: Annotated[list[str] | None, option("Only this material; may be repeated.")] = None,
    seed: Annotated[list[int] | None, option("Only this seed; may be repeated.")] = None,
    size: Annotated[float, typer.Option(help="Largest size of the page, MB.")] = 20.0,
) -> None:
    """Write a page that shows the contacts of a campaign along their loading paths.

    On the page, choose a contact, and move a slider along the snapshots of its path. The page shows the spots or
    patches on the topography, the state on the curves, and the distributions. The page is one HTML file and needs no
    network.
    """
    from icha.datasets.results import EXPLORER
    from icha.deposit.verify import CRATE
    from icha.report.explorer import write_explorer

    if output is None and (results / CRATE).is_file():
        raise UserError(f"{results} is a deposit, which must not change; choose another file with --output")
    page = output or results / EXPLORER
    choices = {"study": study, "surface": surface, "material": material, "seed": seed}
    only = {name: values for name, values in choices.items() if values}
    try:
        shown, without_steps = write_explorer(results, page, only=only, largest=size)
    except ValueError as error:
        raise UserError(str(error)) from None
    echo(f"{page}: {format_count(shown, 'contact')}, {size_in_words(page.stat().st_size)}")
    if without_steps:
        echo(f"omitted, because their runs reached no step: {format_count(without_steps, 'contact')}")
