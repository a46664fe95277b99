"""Write the report of a campaign, and a table of the times of its jobs."""

from pathlib import Path

from job import job_context

from icha.analysis.checks import read_checks
from icha.datasets.files import read_campaign
from icha.report.report import ReportFigure, write_report
from icha.report.run_times import write_times
from icha.report.sections import read_surface_statistics

if "snakemake" in globals():
    with job_context(snakemake):
        files, params = snakemake.input, snakemake.params
        page, times = snakemake.output.page, snakemake.output.times
        model_error = "".join(files.model_error)  # empty without boundary elements
        linked = {"Configuration": files.configuration, "Comparison": files.comparison, "Checks": files.checks}
        answers = "".join(files.answers)  # empty without boundary elements for several seeds
        sensitivity = "".join(files.sensitivity)  # empty without sampled parameters
        linked |= {"Answers": answers} if answers else {}
        linked |= {"Sampled cases": sensitivity} if sensitivity else {}
        linked |= {"Times and memory of the jobs": times} | ({"Error of the model": model_error} if model_error else {})
        campaign, errors = read_campaign(files.campaign), read_campaign(model_error) if model_error else None
        figures = zip(params.figures.items(), *(files.figures[k::3] for k in range(3)), strict=True)
        shown = [ReportFigure(name, *paths, tuple(studies)) for (name, studies), *paths in figures]
        write_report(
            page,
            campaign=campaign,
            figures=shown,
            checks=read_checks(files.checks),
            model_error=errors,
            answers=read_campaign(answers) if answers else None,
            sensitivity=read_campaign(sensitivity) if sensitivity else None,
            surfaces=[read_surface_statistics(path) for path in files.surfaces],
            configuration=Path(files.configuration).read_text(encoding="utf-8"),
            dataset_path=files.campaign,
            files=linked,
            results=Path(page).parent,
            citations=params.citations,
        )
        write_times(times, params.benchmarks)
