"""Compute the files of a batch: surfaces, theories, or runs."""

from functools import partial

from job import compute_batch, job_context

from icha.contact.models import DEFAULT_MODEL
from icha.datasets.stamp import program_of_runs, program_of_surfaces, program_of_theories


def task_and_program(kind):
    """Return the function that computes a file, and one that returns the fingerprint of its program from arguments."""
    if kind == "surfaces":
        from icha.tasks.surface import make_surface

        return make_surface, lambda arguments: program_of_surfaces()
    if kind == "references":
        from icha.tasks.theories import make_theories

        return make_theories, lambda arguments: program_of_theories()
    from icha.tasks.run import compute_run

    task = partial(compute_run, progress=partial(print, flush=True))
    return task, lambda arguments: program_of_runs(arguments.get("model", DEFAULT_MODEL))


if "snakemake" in globals():
    with job_context(snakemake):
        task, program = task_and_program(snakemake.params.kind)
        compute_batch(snakemake.output, snakemake.params.files, task, program, snakemake.config["license"])
