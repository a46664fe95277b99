"""Write predictions of theories for a surface, and data points from publications."""

from job import job_context

from icha.tasks.theories import make_theories

if "snakemake" in globals():
    with job_context(snakemake):
        make_theories(
            snakemake.input.surface,
            snakemake.output[0],
            settings=snakemake.params.settings,
            adhesive=snakemake.params.adhesive,
            attributes=snakemake.params.attributes,
        )
