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
    from icha.datasets.files import read_campaign
    from icha.datasets.results import ANSWERS, SENSITIVITY
    from icha.report.answers import answers_of, answers_table, samples_table, sentences
    from icha.uncertainty.sensitivity import left_out_of_samples

    folder = Path(results)
    if folder.name == results and not folder.is_dir():
        folder = project() / "results" / results
    samples, estimates = (
        {name: node.to_dataset() for name, node in read_campaign(file).children.items()} if file.is_file() else {}
        for file in (folder / SENSITIVITY, folder / ANSWERS)
    )
    if not samples and not estimates:
        raise UserError(
            f"{folder / ANSWERS}: there are no answers; expected a campaign with `levels`, with boundary elements for "
            "several seeds, or with `sample`, that `icha run` has computed"
        )
    if csv:
        import pandas as pd

        from icha.datasets.table import as_csv

        if not estimates:
            raise UserError(f"{folder}: no estimates with intervals; the sampled cases are in {folder / SENSITIVITY}")
        studies = {name: data.to_dataframe() for name, data in estimates.items()}
        typer.echo(as_csv(pd.concat(studies, names=["study"]).reset_index("study")), nl=False)
        return
    found = [
        (f"{name}: {data.sizes['case']} cases", samples_table(data), left_out_of_samples(data))
        for name, data in samples.items()
    ]
    answers = {name: answers_of(data) for name, data in estimates.items()}
    found += [("\n".join([f"{name}:", *sentences(rows)]), answers_table(rows), []) for name, rows in answers.items()]
    for head, table, left_out in found:
        lines = [table.as_latex(), *(f"% {line}" for line in left_out)]
        echo("\n".join(lines if latex else [head, table.as_text(), *left_out]))
