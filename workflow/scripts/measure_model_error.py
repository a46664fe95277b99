"""Compare runs of the asperity model with boundary elements: runs of the campaign, and solutions at finite ranges."""

from job import attributes, job_context

from icha.analysis.model_error import model_error
from icha.datasets.files import read_campaign, read_dataset, read_run, write_dataset
from icha.datasets.labels import RunLabels, SolutionLabels


def measure_model_error(campaign, runs, solutions, output, *, run_labels, labels, attributes):
    """Write the errors of the asperity model; `run_labels` belong to the files `runs`, `labels` to `solutions`."""
    others = zip((RunLabels(*label) for label in run_labels), map(read_run, runs), strict=True)
    pairs = zip((SolutionLabels(*label) for label in labels), map(read_dataset, solutions), strict=True)
    write_dataset(model_error(read_campaign(campaign), pairs, runs=others, attrs=attributes), output)


if "snakemake" in globals():
    with job_context(snakemake):
        measure_model_error(
            snakemake.input.campaign,
            snakemake.input.runs,
            snakemake.input.solutions,
            snakemake.output[0],
            run_labels=snakemake.params.run_labels,
            labels=snakemake.params.labels,
            attributes=attributes(snakemake),
        )
