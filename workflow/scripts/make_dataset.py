"""Put all runs of a campaign into one file."""

from job import attributes, guarded

from icha.datasets.campaign_file import write_campaign


def make_dataset(runs, output, *, labels, settings, attributes):
    """Write the campaign dataset of the files `runs`, with their labels and checksums of settings, to `output`."""
    settings = dict(zip(labels, settings, strict=True))
    write_campaign(zip(labels, runs, strict=True), output, design=labels, settings=settings, attrs=attributes)


if "snakemake" in globals():
    with guarded(snakemake):
        make_dataset(
            snakemake.input,
            snakemake.output[0],
            labels=snakemake.params.labels,
            settings=snakemake.params.settings,
            attributes=attributes(snakemake),
        )
