"""Write the configuration as used: the configuration file with the values from the command line."""

import shutil

from job import job_context

from icha.support.atomic_files import whole_file
from icha.support.checksums import refuse_changed


def write_configuration(output, *, text, copies, sha256):
    """Write the configuration and copy its input files; `copies` has the source of each copy, `sha256` its checksum."""
    for (copy, file), expected in zip(copies.items(), sha256, strict=True):
        with whole_file(copy) as temporary:
            shutil.copyfile(file, temporary)
            refuse_changed(temporary, expected, file)
    with whole_file(output) as temporary:
        temporary.write_text(text, encoding="utf-8")


if "snakemake" in globals():
    with job_context(snakemake):
        output, *copies = snakemake.output
        write_configuration(
            output,
            text="".join(snakemake.params.text),
            copies=dict(zip(copies, snakemake.input, strict=True)),
            sha256=snakemake.params.sha256,
        )
