"""Analyse the sampled cases of a campaign: results of every case, and the shares of variance of the parameters."""

from job import attributes, job_context

from icha.analysis.sensitivity import sensitivity_of_campaign
from icha.datasets.files import read_campaign, write_dataset


def analyse_samples(dataset, output, *, samples, attributes):
    """Analyse the studies with samples of a campaign dataset and write the results."""
    write_dataset(sensitivity_of_campaign(read_campaign(dataset), samples, attrs=attributes), output)


if "snakemake" in globals():
    with job_context(snakemake):
        analyse_samples(
            snakemake.input[0],
            snakemake.output[0],
            samples=snakemake.params.samples,
            attributes=attributes(snakemake),
        )
