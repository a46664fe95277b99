"""Write the configuration of a campaign as it was used: defaults of the file with the command line's values."""

import shutil

from job import guarded, refuse_changed

from icha.support.atomic_files import whole_file


def write_configuration(output, *, text, copies, sha256):
    """Write `text` to the file `output`, and files to the paths of their copies; `sha256` are their checksums."""
    for (copy, file), expected in zip(copies.items(), sha256, strict=True):
        with whole_file(copy) as temporary:
            shutil.copyfile(file, temporary)
            refuse_changed(temporary, expected, file)
    with whole_file(output) as temporary:
        temporary.write_text(text, encoding="utf-8")


if "snakemake" in globals():
    with guarded(snakemake):
        output, *copies = snakemake.output
        write_configuration(
            output,
            text=snakemake.params.text,
            copies=dict(zip(copies, snakemake.input, strict=True)),
            sha256=snakemake.params.sha256,
        )
