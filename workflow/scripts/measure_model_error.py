"""Compare runs of the asperity model with runs with boundary elements."""

from job import attributes, job_context

from icha.analysis.model_error import model_error
from icha.datasets.files import read_campaign, read_run, write_dataset
from icha.datasets.labels import RunLabels


def measure_model_error(campaign, runs, output, *, labels, attributes):
    """Write the errors of the asperity model; `labels` belong to the files `runs` with boundary elements."""
    truths = zip((RunLabels(*label) for label in labels), map(read_run, runs), strict=True)
    write_dataset(model_error(read_campaign(campaign), truths, attrs=attributes), output)


if "snakemake" in globals():
    with job_context(snakemake):
        measure_model_error(
            snakemake.input.campaign,
            snakemake.input.runs,
            snakemake.output[0],
            labels=snakemake.params.labels,
            attributes=attributes(snakemake),
        )
