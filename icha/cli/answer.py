"""The command `icha answer`: print the estimated results of a campaign with their intervals."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import UserError, echo, option, project


def answer(
    results: Annotated[str, typer.Argument(help="Folder of results such as results/NAME, or the name of a campaign.")],
    csv: Annotated[bool, typer.Option("--csv", help="Print a table with all values as CSV.")] = False,
    latex: Annotated[bool, typer.Option("--latex", help="Print a table for LaTeX.")] = False,
    accuracy: Annotated[
        float | None,
        option(
            "Relative half-width in per cent; print the `levels` that reach it at the least cost.", min=0.01, max=100
        ),
    ] = None,
    quantity: Annotated[
        str, option("Quantity with this accuracy. Default: contact_area_fraction.")
    ] = "contact_area_fraction",
) -> None:
    """Print the results of each study with intervals, what limits their accuracy, and what would narrow them.

    A study has answers if it has boundary elements for two seeds or more. The key `levels` of a study gives the seeds
    of three levels of accuracy, which together need less time than boundary elements for every seed.
    """
    from icha.analysis.answers import answers_of, as_csv, as_latex, paragraph
    from icha.datasets.files import read_campaign
    from icha.datasets.results import ANSWERS

    folder = Path(results) if Path(results).is_dir() else project() / "results" / results
    file = folder / ANSWERS
    if not file.is_file():
        raise UserError(
            f"{file}: there are no answers; expected a campaign with `levels`, or with boundary elements for several "
            "seeds, that `icha run` has computed"
        )
    tree = read_campaign(file)
    if csv or latex:
        echo(as_csv(tree).rstrip("\n") if csv else "\n".join(as_latex(tree)))
        return
    if accuracy is not None:
        _print_levels(tree, folder, accuracy / 100, quantity)
        return
    for name, node in tree.children.items():
        answers = answers_of(node.to_dataset())
        echo(paragraph(name, answers))
        for each in answers:
            echo("  ".join(filter(None, ("", each.contact, each.state, each.quantity, each.number))))
        echo()


def _print_levels(tree, folder: Path, accuracy: float, quantity: str) -> None:
    """Print, for each study, the numbers of seeds with which a quantity has an accuracy, and the expected time."""
    from icha.analysis.allocation import allocate, variances_per_seed
    from icha.configuration.load import load_configuration
    from icha.contact.models import DEFAULT_MODEL
    from icha.datasets.labels import coarse_study
    from icha.planning.plan import plan
    from icha.planning.results import campaign_files
    from icha.support import formatting

    campaign = load_configuration(folder / "config.used.yaml").campaign
    seconds = {item.path: item.cost.seconds for item in plan(campaign, folder) if item.is_run}
    cases = campaign_files(campaign).runs
    for name, node in tree.children.items():
        study = node.to_dataset()
        study = study.isel(answer=(study["quantity"] == quantity).values)
        if not study.sizes["answer"]:
            raise UserError(f"{quantity}: study {name} has no such answer; expected one of {_quantities(node)}")
        per_seed, grid = variances_per_seed(study)
        costs = {}
        for level in per_seed:
            wanted = coarse_study(name) if level == "coarse" else name
            runs = {
                path: case
                for path, case in cases.items()
                if case.study == wanted and (case.model == DEFAULT_MODEL) == (level == "asperities")
            }
            # All contacts of one seed.
            costs[level] = sum(map(seconds.get, runs)) / len({case.seed for case in runs.values()})
        try:
            found = allocate(per_seed, grid, costs, accuracy)
        except ValueError as error:
            echo(f"{name}: {error}", fg="yellow")
            continue
        total = sum(costs[level] * count for level, count in found.items())
        levels = ", ".join(f"{level}: 1..{count}" for level, count in found.items())
        time = formatting.duration(total)
        echo(f"{name}: levels: {{{levels}}}    # ± {100 * accuracy:g} % of {quantity}, {time} of one core")


def _quantities(node) -> str:
    return ", ".join(dict.fromkeys(node["quantity"].values.tolist()))
