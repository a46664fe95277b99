"""Write the report of a campaign."""

from pathlib import Path

from job import job_context

from icha.analysis.checks import read_checks
from icha.datasets.files import read_campaign
from icha.report.report import write_report
from icha.report.spectra import read_surface_statistics

if "snakemake" in globals():
    with job_context(snakemake):
        files, params = snakemake.input, snakemake.params
        page = snakemake.output.page
        # Absent without boundary elements, boundary elements for several seeds, or sampled parameters.
        trees = {name: "".join(files[name]) for name in ("model_error", "answers", "sensitivity")}
        linked = {
            "Campaign dataset": files.campaign,
            "Table of all runs": files.table,
            "Comparison at common loads": files.comparison,
            "Error of the asperity model": trees["model_error"],
            "Answers": trees["answers"],
            "Sampled cases": trees["sensitivity"],
            "Checks": files.checks,
            "Configuration": files.configuration,
        }
        write_report(
            page,
            campaign=read_campaign(files.campaign),
            figures=files.figures,
            checks=read_checks(files.checks),
            **{name: read_campaign(path) if path else None for name, path in trees.items()},
            surfaces=[read_surface_statistics(path) for path in params.surfaces],
            configuration=Path(files.configuration).read_text(encoding="utf-8"),
            files={name: path for name, path in linked.items() if path},
            results=Path(page).parent,
            citations=params.citations,
        )
