"""Put all runs of a campaign into one file."""

from job import attributes, guarded

from icha.datasets.campaign_file.write import write_campaign


def make_dataset(runs, output, *, labels, attributes):
    """Write the campaign dataset of the files `runs`, which have the given labels, to `output`."""
    write_campaign(zip(labels, runs, strict=True), output, design=labels, attrs=attributes)


if "snakemake" in globals():
    with guarded(snakemake):
        make_dataset(
            snakemake.input,
            snakemake.output[0],
            labels=snakemake.params.labels,
            attributes=attributes(snakemake),
        )
