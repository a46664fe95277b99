"""Executor of Snakemake whose jobs are forks of one process that has imported what they need.

A job's script needs some seconds to import NumPy, SciPy, xarray and the package, often longer than its work. So the
first job starts a process that has done so, the fork server of `multiprocessing`, and every job of one thread is a fork
of it that runs the script. Other jobs, and all jobs where libraries do not survive a fork (elsewhere than on Linux) or
that process cannot be started, run by themselves, as with Snakemake's executor `local`.

However one of these processes ends, those that it started end with it: Snakemake, the fork server, its forks.
"""

import contextlib
import json
import multiprocessing
import multiprocessing.util
import os
import resource
import runpy
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
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

# Bytes of the path of a folder that still has room for the path of a socket, of which there are 107.
_LONGEST = 70
# What `multiprocessing` takes for the status of a process of which only the fork server knew how it ended.
_SERVER_LOST = 255


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
        file = Path(self.workflow.main_snakefile).parent / "workflow/scripts" / PurePath(script).name
        told = Snakemake(
            input_, output, params, wildcards, threads, resources, log, {}, rule.name, None, str(file.parent)
        )
        return self.pool.submit(self._run_forked, str(file), told, benchmark)

    def _server_runs(self) -> bool:
        """Start the fork server if it does not run; False where that cannot be."""
        if not self._without_server:
            try:
                with _short_temporary_folder():
                    # From the thread that lasts as long as the process: the fork server ends with it.
                    forkserver.ensure_running()
            except OSError as error:
                self._without_server = True
                self.logger.warning(f"Every job takes some seconds more, for no process can be prepared: {error}.")
        return not self._without_server

    def _run_forked(self, *job):
        status = self._status(*job)
        if status == _SERVER_LOST:  # and the job with it
            time.sleep(0.5)  # until the system knows of it, too, and another one is started
            status = self._status(*job)
        if status:
            how = f"was killed by signal {-status}" if status < 0 else f"ended with status {status}"
            self.logger.error(f"{PurePath(job[0]).name} {how}.")
            raise SpawnedJobError

    def _status(self, *job) -> int:
        """Exit status of a job that is run in a fork."""
        process = self._processes.Process(target=run_script, args=job, daemon=True)
        try:
            # One at a time, for each of these looks at the ends of all processes.
            with self._turn:
                process.start()
            wait([process.sentinel])
            with self._turn:
                process.join()
        except (EOFError, ConnectionError):
            return _SERVER_LOST
        return process.exitcode


@contextlib.contextmanager
def _short_temporary_folder() -> Iterator[None]:
    """Have `multiprocessing` put its socket where the path is short, whatever the folder for temporary files."""
    folders = [tempfile.gettempdir(), os.environ.get("XDG_RUNTIME_DIR", ""), "/tmp", "/dev/shm"]
    short = [each for each in folders if len(os.fsencode(each)) <= _LONGEST and os.access(each, os.W_OK | os.X_OK)]
    former, tempfile.tempdir = tempfile.tempdir, short[0] if short else folders[0]
    try:
        multiprocessing.util.get_temp_dir()  # which keeps to its first answer
        yield
    finally:
        tempfile.tempdir = former


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
