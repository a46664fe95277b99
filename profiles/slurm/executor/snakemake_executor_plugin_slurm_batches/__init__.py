"""The executor `slurm` of Snakemake, with batches (groups of jobs) whose jobs run side by side and fail alone.

The executor `slurm` runs the jobs of a group one after the other, whatever cores the group has asked for, each within
a Snakemake of its own; and when one of them fails, the others are not started and the results of those that have
ended are removed. Here one Snakemake on the node runs them all, on the cores and in the memory of the submission, and
goes on when one fails. What has been computed stays: see `keep-incomplete` in profiles/slurm/config.yaml.
"""

from pathlib import Path

from snakemake_executor_plugin_slurm import Executor as SlurmExecutor
from snakemake_executor_plugin_slurm import ExecutorSettings, common_settings
from snakemake_interface_executor_plugins.executors.base import SubmittedJobInfo

__all__ = ["Executor", "ExecutorSettings", "common_settings"]


def _jobs_of(submission):
    return list(submission.jobs) if submission.is_group() else [submission]


class Executor(SlurmExecutor):
    """Submits jobs and groups of jobs; on the node, they are forks of one process (workflow/plugins)."""

    def run_job_pre(self, job):
        """Remove the outdated results of a job before it is submitted.

        Snakemake removes them when a job starts. One that never starts, because the submission was cancelled or ran
        out of time, would leave them behind, and with `keep-incomplete` they would be taken for new ones.
        """
        for each in _jobs_of(job):
            for file in each.output:
                Path(file).unlink(missing_ok=True)
        super().run_job_pre(job)

    def get_job_args(self, job, **kwargs):
        """Return what Snakemake runs on the node: at most as much at a time as the submission has room for."""
        return f"{super().get_job_args(job, **kwargs)} --cores {job.threads} --resources mem_mb={job.resources.mem_mb}"

    def additional_general_args(self):
        """How the Snakemake on the node is to run it."""
        return "--executor icha --keep-going --show-failed-logs"

    async def check_active_jobs(self, active_jobs):
        """Ask Slurm how the submissions are; no less often than six times the first interval, however long they run."""
        async for job in super().check_active_jobs(active_jobs):
            yield job
        longest = 6 * self.workflow.executor_settings.init_seconds_before_status_checks
        self.next_seconds_between_status_checks = min(self.next_seconds_between_status_checks, longest)

    def print_job_error(self, job_info, msg=None, **kwargs):
        """Report those jobs of a failed batch that have no result, and not the others."""
        failed = [job for job in _jobs_of(job_info.job) if not all(Path(file).exists() for file in job.output)]
        if not failed:
            super().print_job_error(job_info, msg, **kwargs)
        for job in failed:
            super().print_job_error(SubmittedJobInfo(job, job_info.external_jobid, job_info.aux), msg, **kwargs)
            kwargs.pop("aux_logs", None)  # what Slurm has to say of the batch is said once
