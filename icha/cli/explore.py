"""The command `icha explore`: write a page that shows the contacts of a campaign step by step along their paths."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import UserError, echo, option
from icha.support.formatting import format_count


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
    """Write a page that shows the contacts of a campaign step by step along their loading paths.

    On the page, choose a contact and a model, and move a slider along the path. The page shows the spots or patches on
    the topography, the state on the curves, and the distributions. The page is one HTML file and needs no network. If
    the page with all contacts would exceed the largest size, contacts are omitted, and the command prints how many.
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
        written = write_explorer(results, page, only=only, largest=size)
    except ValueError as error:
        raise UserError(str(error)) from None
    echo(f"{page}: {format_count(written.shown, 'contact')}, {written.size / 1e6:.1f} MB")
    if written.left_out:
        echo(
            f"omitted, because the page would be larger than {size:g} MB: {format_count(written.left_out, 'contact')}. "
            "Choose other contacts with --study, --surface, --material and --seed, or use a larger --size"
        )
    if written.without_steps:
        echo(f"omitted, because their runs reached no target: {format_count(written.without_steps, 'contact')}")
