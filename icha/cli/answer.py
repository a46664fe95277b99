"""The command `icha answer`: print the estimated results of a campaign with their intervals."""

from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import UserError, echo, project


def answer(
    results: Annotated[str, typer.Argument(help="Folder of results such as results/NAME, or the name of a campaign.")],
    csv: Annotated[bool, typer.Option("--csv", help="Print a table with all values as CSV.")] = False,
    latex: Annotated[bool, typer.Option("--latex", help="Print a table for LaTeX.")] = False,
) -> None:
    """Print the results of each study with intervals, what limits their accuracy, and what would narrow them.

    A study with `sample` has a table of results, with the share of their variance that each parameter causes.

    A study has answers if it has boundary elements for two seeds or more. The key `levels` of a study gives the seeds
    of three levels of accuracy, which together need less time than boundary elements for every seed. With the key
    `accuracy`, `icha run` chooses these seeds.
    """
    from icha.analysis.answers import answers_of, as_csv, as_latex, paragraph
    from icha.analysis.sample_words import sample_table
    from icha.datasets.files import read_campaign
    from icha.datasets.results import ANSWERS, SENSITIVITY

    folder = Path(results)
    if folder.name == results and not folder.is_dir():
        folder = project() / "results" / results
    file, sampled = folder / ANSWERS, folder / SENSITIVITY
    if not file.is_file() and not sampled.is_file():
        raise UserError(
            f"{file}: there are no answers; expected a campaign with `levels`, with boundary elements for several "
            "seeds, or with `sample`, that `icha run` has computed"
        )
    if csv or latex:
        if not file.is_file():
            raise UserError(f"{file}: there are no estimates with intervals; the sampled cases are in {sampled}")
        tree = read_campaign(file)
        echo(as_csv(tree).rstrip("\n") if csv else "\n".join(as_latex(tree)))
        return
    samples, estimates = (read_campaign(each).children if each.is_file() else {} for each in (sampled, file))
    for node in samples.values():
        echo(sample_table(node.to_dataset()))
        echo()
    for name, node in estimates.items():
        answers = answers_of(node.to_dataset())
        echo(paragraph(name, answers))
        for each in answers:
            echo("  ".join(filter(None, ("", each.contact, each.state, each.quantity, each.number))))
        echo()
