"""Put all runs of a campaign into one file."""

from job import attributes, job_context

from icha.datasets.campaign_file import write_campaign


def make_dataset(runs, output, *, labels, settings, attributes, varied=()):
    """Combine run files into a campaign dataset, with the labels and the checksum of the settings of each run."""
    settings = dict(zip(labels, settings, strict=True))
    pairs = zip(labels, runs, strict=True)
    write_campaign(pairs, output, design=labels, settings=settings, attrs=attributes, varied=dict(varied))


if "snakemake" in globals():
    with job_context(snakemake):
        make_dataset(
            snakemake.input,
            snakemake.output[0],
            labels=snakemake.params.labels,
            settings=snakemake.params.settings,
            attributes=attributes(snakemake),
            varied=snakemake.params.varied,
        )
