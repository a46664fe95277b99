"""The executor `slurm` of Snakemake, with batches (groups of jobs) whose jobs run in parallel and fail independently.

The executor `slurm` runs the jobs of a group one after the other, each in a separate Snakemake, on any number of cores.
If a job fails, `slurm` starts no further jobs, and removes the results of finished jobs. The executor in this module
starts one Snakemake on the node. This Snakemake runs all jobs of the group on the cores and in the memory of the
submission, and continues after a failed job. Finished results are kept (`keep-incomplete` in the profile `slurm`).
"""

from pathlib import Path

from snakemake_executor_plugin_slurm import Executor as SlurmExecutor
from snakemake_executor_plugin_slurm import ExecutorSettings, common_settings
from snakemake_interface_executor_plugins.executors.base import SubmittedJobInfo

__all__ = ["Executor", "ExecutorSettings", "common_settings"]


def _jobs_of(submission):
    return list(submission.jobs) if submission.is_group() else [submission]


class Executor(SlurmExecutor):
    """Executor that submits jobs and groups of jobs; on the node, jobs are forks of one process (workflow/plugins)."""

    def run_job_pre(self, job):
        """Remove the outdated results of a job before it is submitted.

        Snakemake removes outdated results only when a job starts. A job never starts if its submission is cancelled or
        runs out of time. Its outdated results would remain, and `keep-incomplete` would let them count as new results.
        """
        for each in _jobs_of(job):
            for file in each.output:
                Path(file).unlink(missing_ok=True)
        super().run_job_pre(job)

    def get_job_args(self, job, **kwargs):
        """Return the command of Snakemake on the node, with the cores and the memory of the submission as limits."""
        return f"{super().get_job_args(job, **kwargs)} --cores {job.threads} --resources mem_mb={job.resources.mem_mb}"

    def additional_general_args(self):
        """Return further options of Snakemake on the node."""
        return "--executor icha --keep-going --show-failed-logs"

    async def check_active_jobs(self, active_jobs):
        """Check the states of the submissions; the interval between checks is at most six times the first interval."""
        async for job in super().check_active_jobs(active_jobs):
            yield job
        longest = 6 * self.workflow.executor_settings.init_seconds_before_status_checks
        self.next_seconds_between_status_checks = min(self.next_seconds_between_status_checks, longest)

    def print_job_error(self, job_info, msg=None, **kwargs):
        """Report the jobs of a failed batch that have no result."""
        failed = [job for job in _jobs_of(job_info.job) if not all(Path(file).exists() for file in job.output)]
        if not failed:
            super().print_job_error(job_info, msg, **kwargs)
        for job in failed:
            super().print_job_error(SubmittedJobInfo(job, job_info.external_jobid, job_info.aux), msg, **kwargs)
            kwargs.pop("aux_logs", None)  # print the log of the batch once
