"""Steps of the workflow, which made the files of a deposit."""

import ast
from collections.abc import Sequence
from pathlib import Path

from icha.configuration.campaign import Campaign
from icha.deposit.crate import Job
from icha.deposit.verify import SOURCE
from icha.planning.results import campaign_files

SCRIPTS = "workflow/scripts"


def campaign_steps(campaign: Campaign, given: Sequence[str], source: Path) -> list[Job]:
    """Return the steps that made the results of a campaign, in their order.

    Parameters
    ----------
    campaign : the campaign.
    given : files that no step made (topographies, measurements), as paths in the deposit.
    source : folder of the workflow, whose scripts have descriptions.
    """
    files = campaign_files(campaign)
    inputs = [files.configuration, *given]
    tables = [files.comparison, *files.model_error, *files.answers, *files.sensitivity]
    analysis = [files.dataset, *tables, files.checks]
    steps = {
        "surfaces": ("make_surfaces.py", inputs, files.surfaces),
        "runs": ("run_batch.py", [files.configuration, *files.surfaces], files.runs),
        "references": ("make_references.py", [files.configuration, *files.surfaces], files.theories),
        "analyse": ("analyse.py", files.runs, [*analysis, files.table]),
        "verdict": ("judge_results.py", [files.checks], [files.verdict]),
        "figures": ("draw_figures.py", [*inputs, *analysis, *files.surfaces, *files.theories], files.figures),
        "report": ("make_report.py", [*inputs, *analysis, *files.surfaces, *files.figures], [files.report]),
    }
    return [
        Job(
            rule=rule,
            inputs=tuple(sorted(read)),
            outputs=tuple(sorted(written)),
            parameters=(),
            description=_description(source / SCRIPTS / script),
            script=f"{SOURCE}/{SCRIPTS}/{script}",
        )
        for rule, (script, read, written) in steps.items()
        if written
    ]


def _description(script: Path) -> str:
    """Return the first paragraph of the docstring of a script."""
    text = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split())
