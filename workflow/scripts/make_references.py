"""Write predictions of theories for surfaces, and data points from publications."""

from job import compute_batch, job_context

from icha.datasets.stamp import program_of_theories
from icha.tasks.theories import make_theories

if "snakemake" in globals():
    with job_context(snakemake):
        files, licence = snakemake.params.files, snakemake.config["license"]
        compute_batch(snakemake.output, files, make_theories, lambda each: program_of_theories(), licence)
