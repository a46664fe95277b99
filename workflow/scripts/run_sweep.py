"""Compute one run."""

from job import job_context

from icha.tasks.run import compute_run

if "snakemake" in globals():
    with job_context(snakemake):
        compute_run(
            snakemake.input.surface,
            snakemake.output[0],
            **snakemake.params.settings,
            attributes=snakemake.params.attributes,
            progress=lambda line: print(line, flush=True),
            resumable=snakemake.params.resumable,
        )
