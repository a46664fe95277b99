"""The executor `slurm` of Snakemake, with batches (groups of jobs) whose jobs run side by side and fail alone.

The executor `slurm` runs the jobs of a group one after the other, whatever cores the group has asked for, each within
a Snakemake of its own; and when one of them fails, the others are not started and the results of those that have
ended are removed. Here one Snakemake on the node runs them all, on the cores and in the memory of the submission, and
goes on when one fails. What has been computed stays: see `keep-incomplete` in profiles/slurm/config.yaml.
"""

from pathlib import Path

from snakemake_executor_plugin_slurm import Executor as SlurmExecutor
from snakemake_executor_plugin_slurm import ExecutorSettings, common_settings

__all__ = ["Executor", "ExecutorSettings", "common_settings"]


class Executor(SlurmExecutor):
    """Submits jobs and groups of jobs; on the node, Snakemake's own local executor runs them."""

    def run_job_pre(self, job):
        """Remove the outdated results of a job before it is submitted.

        Snakemake removes them when a job starts. One that never starts, because the submission was cancelled or ran
        out of time, would leave them behind, and with `keep-incomplete` they would be taken for new ones.
        """
        for each in job.jobs if job.is_group() else [job]:
            for file in each.output:
                Path(file).unlink(missing_ok=True)
        super().run_job_pre(job)

    def get_job_args(self, job, **kwargs):
        """What the Snakemake on the node is to run: no more at a time than fits into the submission."""
        return f"{super().get_job_args(job, **kwargs)} --cores {job.threads} --resources mem_mb={job.resources.mem_mb}"

    def additional_general_args(self):
        """How the Snakemake on the node is to run it."""
        return "--executor local --keep-going --show-failed-logs"
