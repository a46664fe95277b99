"""Compute the runs of a batch: load each surface against a material along a path."""

from functools import partial

from job import compute_batch, job_context

from icha.tasks.run import compute_run

if "snakemake" in globals():
    with job_context(snakemake):
        progress = partial(print, flush=True)
        compute_batch(snakemake.output, snakemake.params.files, partial(compute_run, progress=progress))
