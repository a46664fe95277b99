"""Put all runs of a campaign into one file."""

import hashlib
from pathlib import Path

from job import logged

from icha.records import campaign_tree, read_run, write_dataset


def make_dataset(runs, configuration, output, *, labels, attributes):
    """Write the campaign dataset of the files `runs`, which have the given labels, to `output`."""
    checksum = {"config_sha256": hashlib.sha256(Path(configuration).read_bytes()).hexdigest()}
    pairs = [(label, read_run(path)) for label, path in zip(labels, runs, strict=True)]
    tree = campaign_tree(pairs, attrs=attributes | checksum)
    for study in tree.children.values():
        study.attrs.update(checksum)
    write_dataset(tree, output)


if "snakemake" in globals():
    with logged(snakemake.log[0]):
        make_dataset(
            snakemake.input.runs,
            snakemake.input.configuration,
            snakemake.output[0],
            labels=snakemake.params.labels,
            attributes=snakemake.params.attributes,
        )
