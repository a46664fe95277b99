"""Write the configuration of a campaign as it was used: defaults of the file with the command line's values."""

from job import logged

from icha.files import whole_file


def write_configuration(output, *, text):
    """Write `text` to the file `output`."""
    with whole_file(output) as temporary:
        temporary.write_text(text, encoding="utf-8")


if "snakemake" in globals():
    with logged(snakemake.log[0]):
        write_configuration(snakemake.output[0], text=snakemake.params.text)
