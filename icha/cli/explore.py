"""Write a page for moving along the paths of a campaign."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import UserError, echo
from icha.support.formatting import format_count


def explore(
    results: Annotated[Path, typer.Argument(help="Folder of a campaign's results: results/<campaign>.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="The page. Left out: explore.html in that folder.", show_default=False),
    ] = None,
    study: Annotated[
        list[str] | None, typer.Option(help="Only this study; may be repeated.", show_default=False)
    ] = None,
    surface: Annotated[
        list[str] | None, typer.Option(help="Only this surface; may be repeated.", show_default=False)
    ] = None,
    material: Annotated[
        list[str] | None, typer.Option(help="Only this material; may be repeated.", show_default=False)
    ] = None,
    seed: Annotated[list[int] | None, typer.Option(help="Only this seed; may be repeated.", show_default=False)] = None,
    size: Annotated[float, typer.Option(help="Largest size of the page, MB.")] = 20.0,
) -> None:
    """Write a page for moving along the paths of a campaign.

    Choose a contact and a model; a slider moves spots or patches over the
    topography, the point on the curves, and the distributions. The page is one
    file and needs no network. What does not fit into it is left out and counted.
    """
    from icha.datasets.results import EXPLORER
    from icha.deposit.verify import CHECKSUMS
    from icha.report.explorer import NothingToExplore, write_explorer

    if not results.is_dir():
        what = "is a file" if results.exists() else "no such folder"
        raise UserError(f"{results}: {what}; allowed: the results of a campaign, results/<campaign>")
    if output is None and (results / CHECKSUMS).is_file():
        raise UserError(f"{results}: is a deposit, to which nothing is added; name another place by --output")
    page = output or results / EXPLORER
    if page.is_dir():
        raise UserError(f"--output {page}: is a folder; allowed: the name of an HTML file")
    asked = {"study": study, "surface": surface, "material": material, "seed": seed}
    only = {name: values for name, values in asked.items() if values}
    try:
        written = write_explorer(results, page, only=only, largest=size)
    except NothingToExplore as reason:
        raise UserError(str(reason)) from None
    except ValueError as error:
        raise UserError(f"{error}; `icha run` computes what is missing") from None
    echo(f"{page}: {format_count(written.shown, 'contact')}, {written.size / 1e6:.1f} MB")
    if written.left_out:
        echo(
            f"left out, as the page would be larger than {size:g} MB: {format_count(written.left_out, 'contact')}. "
            "--study, --surface, --material and --seed choose others, --size allows more"
        )
    if written.without_steps:
        echo(f"left out, as their runs reached no stop: {format_count(written.without_steps, 'contact')}")
