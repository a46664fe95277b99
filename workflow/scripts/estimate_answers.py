"""Estimate the results of every study that has boundary elements for several seeds."""

from job import attributes, job_context

from icha.analysis.estimates import estimate_campaign
from icha.datasets.files import read_campaign, write_dataset


def estimate_answers(dataset, output, *, attributes):
    """Estimate the results of a campaign dataset and write the estimates."""
    write_dataset(estimate_campaign(read_campaign(dataset), attrs=attributes), output)


if "snakemake" in globals():
    with job_context(snakemake):
        estimate_answers(snakemake.input[0], snakemake.output[0], attributes=attributes(snakemake))
