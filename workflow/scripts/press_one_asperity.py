"""Press one asperity by the model and by boundary elements."""

from job import attributes, guarded

from icha.datasets.files import write_dataset
from icha.references.one_asperity import hertz_asperity, one_asperity


def press_one_asperity(output, *, tabor_parameter, attributes, progress):
    """Write the comparison at a Tabor parameter, or of Hertz's contact if that is None, to `output`."""
    if tabor_parameter is None:
        dataset = hertz_asperity(progress=progress)
    else:
        dataset = one_asperity(tabor_parameter, progress=progress)
    write_dataset(dataset.assign_attrs(attributes), output)


if "snakemake" in globals():
    with guarded(snakemake):
        press_one_asperity(
            snakemake.output[0],
            tabor_parameter=snakemake.params.tabor_parameter,
            attributes=attributes(snakemake),
            progress=lambda line: print(line, flush=True),
        )
