"""Make the deposit of a campaign from its results."""

from pathlib import Path

from job import job_context

from icha.configuration.load import load_configuration
from icha.datasets.results import CONFIGURATION
from icha.deposit.make import make_deposit, refuse_mixed
from icha.deposit.program import program_source
from icha.planning.plan import whole_cost


def publish(archive, *, results, files, project):
    """Write the deposit as a zip and as a folder; `files` are the results that the deposit includes."""
    campaign = load_configuration(Path(results, CONFIGURATION)).campaign
    refuse_mixed(Path(results), campaign)
    make_deposit(
        archive.removesuffix(".zip"),
        archive,
        results=results,
        files=[str(Path(file).relative_to(results)) for file in files],
        campaign=campaign,
        source=program_source(project),
        cost=whole_cost(campaign),
    )


if "snakemake" in globals():
    with job_context(snakemake):
        publish(
            snakemake.output.archive,
            results=snakemake.params.results,
            files=snakemake.input.results,
            project=snakemake.params.project,
        )
