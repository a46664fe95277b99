"""Write the tidy table of a campaign: one row for each run and target."""

from job import job_context

from icha.datasets.files import read_campaign
from icha.datasets.table import as_csv, tidy_table
from icha.support.atomic_files import whole_file


def make_table(dataset, output):
    """Write the table of a campaign dataset as CSV."""
    with whole_file(output) as temporary:
        temporary.write_text(as_csv(tidy_table(read_campaign(dataset))), encoding="utf-8")


if "snakemake" in globals():
    with job_context(snakemake):
        make_table(snakemake.input[0], snakemake.output[0])
