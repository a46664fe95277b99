"""Put all runs of a campaign into one file."""

from job import logged

from icha.campaign import campaign_tree
from icha.records import read_run, write_dataset


def make_dataset(runs, output, *, labels, attributes):
    """Write the campaign dataset of the files `runs`, which have the given labels, to `output`."""
    pairs = [(label, read_run(path)) for label, path in zip(labels, runs, strict=True)]
    tree = campaign_tree(pairs, design=labels, attrs=attributes)
    for study in tree.children.values():
        # Not that of one of its runs.
        study.attrs["config_sha256"] = attributes["config_sha256"]
    write_dataset(tree, output)


if "snakemake" in globals():
    with logged(snakemake.log[0]):
        make_dataset(
            snakemake.input,
            snakemake.output[0],
            labels=snakemake.params.labels,
            attributes=snakemake.params.attributes,
        )
