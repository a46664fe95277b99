"""Executor of Snakemake whose jobs are forks of one process that has already imported the libraries.

Importing NumPy, SciPy, xarray and the package takes seconds, often longer than the work of a job. Therefore the first
job starts the fork server of `multiprocessing`, a process that imports these libraries. Every job that uses one thread
is a fork of the fork server. Other jobs run in a new process, as with Snakemake's executor `local`. All jobs run in a
new process if the fork server cannot be started, and on systems other than Linux, where libraries may fail after a
fork.

The fork server ends when Snakemake ends. The forks end when the fork server ends.
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
    """Executor for this machine; scripts that use one thread run in forks."""

    def __post_init__(self):
        """Set the modules that the fork server imports, and limit the libraries of the fork server to one thread."""
        super().__post_init__()
        self._processes = multiprocessing.get_context("forkserver")
        self._processes.set_forkserver_preload([f"{__name__}.preload"])
        # Libraries read these variables when they are loaded. Snakemake sets the variables only for new processes.
        os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
        os.environ["ICHA_EXECUTOR"] = str(os.getpid())  # the fork server ends with this process
        # Without a spec, forks would import the main program: the whole command line of Snakemake.
        program = sys.modules["__main__"]
        program.__spec__ = program.__spec__ or find_spec("snakemake.__main__")
        self._turn = threading.Lock()
        self._without_server = sys.platform != "linux"

    def run_single_job(self, job):
        """Start a job."""
        script = job.rule.script
        deployed = self.workflow.deployment_settings.deployment_method
        if not script or job.threads != 1 or deployed or not self._server_runs():
            return super().run_single_job(job)
        rule, input_, output, params, wildcards, threads, resources, log, benchmark, *_ = self.job_args_and_prepare(job)
        file = Path(os.path.normpath(Path(str(job.rule.basedir)) / script))
        context = Snakemake(
            input_, output, params, wildcards, threads, resources, log, {}, rule.name, None, str(file.parent)
        )
        return self.pool.submit(self._run_forked, str(file), context, benchmark)

    def _server_runs(self) -> bool:
        """Start the fork server if necessary; return False if the fork server cannot be started."""
        if not self._without_server:
            try:
                # The fork server ends with the thread that starts it, so the main thread must start the fork server.
                forkserver.ensure_running()
            except OSError as error:  # such as a path of temporary files that is too long for a socket
                self._without_server = True
                self.logger.warning(
                    f"Every job takes some seconds more, because the fork server cannot be started: {error}."
                )
        return not self._without_server

    def _run_forked(self, *job):
        process = self._processes.Process(target=run_script, args=job, daemon=True)
        try:
            # One thread at a time, because each call checks whether any process has ended.
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


def run_script(script: str, context: Snakemake, benchmark: str | None) -> None:
    """Run the script of a job, with `context` as its global variable `snakemake`, and write times and memory."""
    from . import preload

    end_with_parent(preload.SERVER)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    started = time.monotonic()
    sys.argv = [script]
    sys.path.insert(0, os.path.dirname(script))
    runpy.run_path(script, {"snakemake": context}, "__main__")
    if benchmark:
        usage = resource.getrusage(resource.RUSAGE_SELF)
        record = {
            "s": round(time.monotonic() - started, 4),
            "max_rss": round(usage.ru_maxrss / 1024, 2),
            "max_uss": round(usage.ru_maxrss / 1024 - _shared_megabytes(), 2),
            "cpu_time": round(usage.ru_utime + usage.ru_stime, 2),
        }
        Path(benchmark).write_text(json.dumps(record) + "\n", encoding="ascii")


def _shared_megabytes() -> float:
    """Return the memory that this process shares with others, MiB. Just after a fork, nearly all memory is shared."""
    memory = psutil.Process().memory_full_info()
    return (memory.rss - memory.uss) / 2**20
