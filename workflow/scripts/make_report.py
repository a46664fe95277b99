"""Write the report of a campaign, and what its jobs took."""

from pathlib import Path

import yaml
from job import guarded

from icha.analysis.checks import read_checks
from icha.datasets.files import read_campaign
from icha.figures.registry import DECLARATIONS
from icha.report.report import (
    ReportFigure,
    read_benchmarks,
    read_surface_statistics,
    write_report,
    write_times_page,
)
from icha.support.atomic_files import whole_file


def make_report(
    page, *, campaign, comparison, checks, model_error, configuration, surfaces, figures, citations, times_page
):
    """Write the page from the files of the campaign's results; `figures` maps names to (PNG, PDF).

    `model_error` is empty where there are no boundary elements.
    """
    text = Path(configuration).read_text(encoding="utf-8")
    asked = yaml.safe_load(text)
    files = {"Configuration": configuration, "Comparison": comparison, "Checks": checks}
    write_report(
        page,
        campaign=read_campaign(campaign),
        figures=[
            ReportFigure(name, DECLARATIONS[name].caption, png, pdf, studies_of(asked, name))
            for name, (png, pdf) in figures.items()
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


def studies_of(configuration, figure):
    """The studies that a figure shows, by the configuration as used."""
    options = (configuration.get("figures") or {}).get(figure) or {}
    if "entry" in options:
        options = configuration["error_sources"][options["entry"]]
    listed = [options.get("study"), *options.get("load_studies", ()), *options.get("studies", ())]
    return tuple(dict.fromkeys(name for name in listed if name))


def write_times(table, page, benchmarks):
    """Write wall time and peak memory of every job that left a benchmark file below the folder `benchmarks`.

    They are measurements, so the page that shows them lies among these files and not among the results.
    """
    folder = Path(benchmarks)
    files = {str(path.relative_to(folder).with_suffix("")): path for path in sorted(folder.rglob("*.jsonl"))}
    jobs = read_benchmarks(files)
    rows = [f"{each.job}\t{each.seconds:.2f}\t{each.megabytes or 0:.0f}" for each in jobs]
    with whole_file(table) as temporary:
        temporary.write_text("\n".join(["job\tseconds\tmegabytes", *rows]) + "\n", encoding="utf-8")
    write_times_page(page, jobs)


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
            figures={name: (next(pictures), next(pictures)) for name in snakemake.params.figures},
            citations=snakemake.params.citations,
            times_page=times_page,
        )
        write_times(snakemake.output.times, times_page, snakemake.params.benchmarks)
