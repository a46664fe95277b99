"""Executor of Snakemake whose jobs are forks of one process that has imported what they need.

A job's script needs some seconds to import NumPy, SciPy, xarray and the package, often longer than its work. So the
first job starts a process that has done so, the fork server of `multiprocessing`, and every job of one thread is a fork
of it that runs the script. Other jobs, and all jobs where libraries do not survive a fork (elsewhere than on Linux) or
that process cannot be started, run by themselves, as with Snakemake's executor `local`.

However one of these processes ends, those that it started end with it: Snakemake, the fork server, its forks.
"""

import json
import multiprocessing
import os
import resource
import runpy
import signal
import sys
import threading
import time
from importlib.util import find_spec
from multiprocessing import forkserver
from multiprocessing.connection import wait
from pathlib import Path, PurePath

import psutil
from snakemake.exceptions import SpawnedJobError
from snakemake.executors.local import Executor as LocalExecutor
from snakemake.executors.local import common_settings
from snakemake.script import Snakemake

from icha.support.program import end_with_parent

__all__ = ["Executor", "common_settings"]


class Executor(LocalExecutor):
    """Runs jobs on this machine, the scripts of one thread in forks."""

    def __post_init__(self):
        """Say what the fork server is to import, and with how many threads."""
        super().__post_init__()
        self._processes = multiprocessing.get_context("forkserver")
        self._processes.set_forkserver_preload([f"{__name__}.preload"])
        # Libraries read it when they are loaded; jobs that run by themselves are told their own number.
        os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
        # Or forks would import Snakemake's whole command line, which is the main program.
        program = sys.modules["__main__"]
        program.__spec__ = program.__spec__ or find_spec("snakemake.__main__")
        self._turn = threading.Lock()
        self._without_server = sys.platform != "linux"

    def run_single_job(self, job):
        """Start a job; the future ends with it."""
        script = job.rule.script
        deployed = self.workflow.deployment_settings.deployment_method
        if not script or job.threads != 1 or deployed or not self._server_runs():
            return super().run_single_job(job)
        rule, input_, output, params, wildcards, threads, resources, log, benchmark, *_ = self.job_args_and_prepare(job)
        file = Path(os.path.normpath(Path(str(job.rule.basedir)) / script))
        told = Snakemake(
            input_, output, params, wildcards, threads, resources, log, {}, rule.name, None, str(file.parent)
        )
        return self.pool.submit(self._run_forked, str(file), told, benchmark)

    def _server_runs(self) -> bool:
        """Start the fork server if it does not run; False where that cannot be."""
        if not self._without_server:
            try:
                # From the thread that lasts as long as the process: the fork server ends with it.
                forkserver.ensure_running()
            except OSError as error:  # for one, the path of temporary files is too long for a socket
                self._without_server = True
                self.logger.warning(f"Every job takes some seconds more, for no process can be prepared: {error}.")
        return not self._without_server

    def _run_forked(self, *job):
        process = self._processes.Process(target=run_script, args=job, daemon=True)
        try:
            # One at a time, for each of these looks at the ends of all processes.
            with self._turn:
                process.start()
            wait([process.sentinel])
            with self._turn:
                process.join()
            status = process.exitcode
        except (EOFError, ConnectionError):
            status = 255  # the fork server was killed, and its jobs with it
        if status:
            how = f"was killed by signal {-status}" if status < 0 else f"ended with status {status}"
            self.logger.error(f"{PurePath(job[0]).name} {how}.")
            raise SpawnedJobError


def run_script(script: str, told: Snakemake, benchmark: str | None) -> None:
    """Be a job: run its script, which finds what it is told as `snakemake`, and write what it took."""
    from . import preload

    end_with_parent(preload.SERVER)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    started = time.monotonic()
    sys.argv = [script]
    sys.path.insert(0, os.path.dirname(script))
    runpy.run_path(script, {"snakemake": told}, "__main__")
    if benchmark:
        took = resource.getrusage(resource.RUSAGE_SELF)
        record = {
            "s": round(time.monotonic() - started, 4),
            "max_rss": round(took.ru_maxrss / 1024, 2),
            "max_uss": round(took.ru_maxrss / 1024 - _shared_megabytes(), 2),
            "cpu_time": round(took.ru_utime + took.ru_stime, 2),
        }
        Path(benchmark).write_text(json.dumps(record) + "\n", encoding="ascii")


def _shared_megabytes() -> float:
    """What this process has in memory together with others: nearly all that it was forked with."""
    here = psutil.Process().memory_full_info()
    return (here.rss - here.uss) / 2**20
