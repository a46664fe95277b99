"""Compute the runs of a batch: load each surface against a material along a path."""

from functools import partial

from job import compute_batch, job_context

from icha.contact.models import DEFAULT_MODEL
from icha.datasets.stamp import program_of_runs
from icha.tasks.run import compute_run


def program(run):
    """Return the fingerprint of the program that computes a run."""
    return program_of_runs(run.get("model", DEFAULT_MODEL))


if "snakemake" in globals():
    with job_context(snakemake):
        task, licence = partial(compute_run, progress=partial(print, flush=True)), snakemake.config["license"]
        compute_batch(snakemake.output, snakemake.params.files, task, program, licence)
