"""Write the report of a campaign, and the table of what its jobs took."""

import importlib
from pathlib import Path

from job import logged

from icha.checks import read_checks
from icha.files import whole_file
from icha.records import read_campaign, read_dataset
from icha.report import ReportFigure, read_benchmarks, write_report


def make_report(page, *, campaign, comparison, checks, model_error, configuration, surfaces, figures, citations, times):
    """Write the page from the files of the campaign's results; `figures` maps names to (PNG, PDF).

    `model_error` is empty where there are no boundary elements.
    """
    write_report(
        page,
        campaign=read_campaign(campaign),
        figures=[
            ReportFigure(name, importlib.import_module(f"icha.figures.{name}").CAPTION, png, pdf)
            for name, (png, pdf) in figures.items()
        ],
        checks=read_checks(checks),
        comparison=read_campaign(comparison),
        model_error=read_campaign(model_error) if model_error else None,
        surfaces=[read_dataset(path) for path in surfaces],
        configuration=Path(configuration).read_text(encoding="utf-8"),
        dataset_path=campaign,
        citations=citations,
        times_path=times,
    )


def write_times(table, benchmarks):
    """Write wall time and peak memory of every job that left a benchmark file below the folder `benchmarks`."""
    folder = Path(benchmarks)
    files = {str(path.relative_to(folder).with_suffix("")): path for path in sorted(folder.rglob("*.jsonl"))}
    rows = [f"{each.job}\t{each.seconds:.2f}\t{each.megabytes or 0:.0f}" for each in read_benchmarks(files)]
    with whole_file(table) as temporary:
        temporary.write_text("\n".join(["job\tseconds\tmegabytes", *rows]) + "\n", encoding="utf-8")


if "snakemake" in globals():
    with logged(snakemake.log[0]):
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
            times=snakemake.output.times,
        )
        write_times(snakemake.output.times, snakemake.params.benchmarks)
