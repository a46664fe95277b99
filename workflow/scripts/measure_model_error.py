"""Compare the runs of a campaign with the boundary-element solutions beside them."""

from job import attributes, guarded

from icha.analysis.model_error import model_error
from icha.datasets.files import read_campaign, read_dataset, write_dataset
from icha.datasets.labels import SolutionLabels


def measure_model_error(campaign, solutions, output, *, labels, attributes):
    """Write the error of the runs of the file `campaign` against the files `solutions`, labelled in their order."""
    pairs = zip((SolutionLabels(*label) for label in labels), map(read_dataset, solutions), strict=True)
    write_dataset(model_error(read_campaign(campaign), pairs, attrs=attributes), output)


if "snakemake" in globals():
    with guarded(snakemake):
        measure_model_error(
            snakemake.input.campaign,
            snakemake.input.solutions,
            snakemake.output[0],
            labels=snakemake.params.labels,
            attributes=attributes(snakemake),
        )
