"""Write the report of a campaign, and what its jobs took."""

from pathlib import Path

from job import guarded

from icha.analysis.checks import read_checks
from icha.datasets.files import read_campaign
from icha.figures.registry import DECLARATIONS
from icha.report.report import (
    ReportFigure,
    read_surface_statistics,
    write_report,
)
from icha.report.run_times import write_times


def make_report(
    page, *, campaign, comparison, checks, model_error, configuration, surfaces, figures, citations, times_page
):
    """Write the page from the files of the campaign's results; `figures` maps names to (studies, PNG, PDF).

    `model_error` is empty where there are no boundary elements.
    """
    text = Path(configuration).read_text(encoding="utf-8")
    files = {"Configuration": configuration, "Comparison": comparison, "Checks": checks}
    write_report(
        page,
        campaign=read_campaign(campaign),
        figures=[
            ReportFigure(name, DECLARATIONS[name].caption, png, pdf, studies)
            for name, (studies, png, pdf) in figures.items()
        ],
        checks=read_checks(checks),
        comparison=read_campaign(comparison),
        model_error=read_campaign(model_error) if model_error else None,
        surfaces=[read_surface_statistics(path) for path in surfaces],
        configuration=text,
        dataset_path=campaign,
        files=files | ({"Error of the model": model_error} if model_error else {}),
        results=Path(page).parent,
        citations=citations,
        times_path=times_page,
    )


if "snakemake" in globals():
    with guarded(snakemake):
        times_page = Path(snakemake.params.benchmarks, "index.html")
        pictures = iter(snakemake.input.figures)
        make_report(
            snakemake.output.page,
            campaign=snakemake.input.campaign,
            comparison=snakemake.input.comparison,
            checks=snakemake.input.checks,
            model_error="".join(snakemake.input.model_error),
            configuration=snakemake.input.configuration,
            surfaces=snakemake.input.surfaces,
            figures={
                name: (tuple(studies), next(pictures), next(pictures))
                for name, studies in snakemake.params.figures.items()
            },
            citations=snakemake.params.citations,
            times_page=times_page,
        )
        write_times(snakemake.output.times, times_page, snakemake.params.benchmarks)
