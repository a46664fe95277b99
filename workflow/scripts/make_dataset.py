"""Put all runs of a campaign into one file."""

from job import attributes, job_context

from icha.datasets.campaign_file import write_campaign
from icha.datasets.stamp import refuse_outdated


def make_dataset(runs, output, *, labels, stamps, attributes, varied=()):
    """Combine run files into a campaign dataset, with the labels and the expected stamp of each run."""
    refuse_outdated(dict(zip(runs, stamps, strict=True)))
    pairs = zip(labels, runs, strict=True)
    write_campaign(pairs, output, design=labels, attrs=attributes, varied=dict(varied))


if "snakemake" in globals():
    with job_context(snakemake):
        make_dataset(
            snakemake.input,
            snakemake.output[0],
            labels=snakemake.params.labels,
            stamps=snakemake.params.stamps,
            attributes=attributes(snakemake),
            varied=snakemake.params.varied,
        )
