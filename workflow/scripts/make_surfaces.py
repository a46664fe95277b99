"""Make the topographies of a batch: generate random surfaces, read measured ones, or make smooth shapes."""

from job import compute_batch, job_context

from icha.datasets.stamp import program_of_surfaces
from icha.tasks.surface import make_surface

if "snakemake" in globals():
    with job_context(snakemake):
        files, licence = snakemake.params.files, snakemake.config["license"]
        compute_batch(snakemake.output, files, make_surface, lambda each: program_of_surfaces(), licence)
