"""Compare the runs of every study at common loads."""

from job import attributes, job_context

from icha.analysis.common_loads import compare_campaign
from icha.datasets.files import read_campaign, write_dataset


def compare_runs(dataset, output, *, attributes):
    """Compare the runs in a campaign dataset at common loads and write the comparison."""
    write_dataset(compare_campaign(read_campaign(dataset), attrs=attributes), output)


if "snakemake" in globals():
    with job_context(snakemake):
        compare_runs(snakemake.input[0], snakemake.output[0], attributes=attributes(snakemake))
