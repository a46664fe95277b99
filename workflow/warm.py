"""One process that has imported everything, and forks for each job of a call of Snakemake.

A job's script needs some seconds to import NumPy, SciPy, xarray and the package, often longer than its work. So the
call starts a process that has done so; Python hands the script of a job over to it before it imports anything
(`workflow/early`), and a fork of it runs the script, with the job's own output, working directory and environment. A
script that finds no such process, on a cluster for one, runs by itself. The process ends with the one that started it.

    python warm.py SOCKET MODULE…        (standard input: a pipe that closes when the starter ends)
"""

import array
import contextlib
import fcntl
import importlib
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

ADDRESS = "ICHA_WARM_JOBS"
EARLY = Path(__file__).with_name("early")
_started = []


def start(modules: list[str]) -> None:
    """Start the process with `modules` imported, and tell the jobs of this process of it by the environment.

    On Linux only: elsewhere, libraries that have threads do not survive a fork.
    """
    if sys.platform != "linux":
        return
    folder = tempfile.mkdtemp(prefix="icha-")
    address = os.path.join(folder, "jobs")
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(address)
    listener.listen(512)
    # Libraries read the number of their threads when they are loaded; only jobs of one thread are handed over.
    one = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
    process = subprocess.Popen(
        [sys.executable, __file__, str(listener.fileno()), folder, *modules],
        stdin=subprocess.PIPE,
        pass_fds=[listener.fileno()],
        env=os.environ | one,
        # Ctrl-C is for Snakemake, which ends its jobs in its own way.
        start_new_session=True,
    )
    listener.close()
    # Kept open until this process ends, however it does; jobs do not inherit it.
    _started.append(process)
    os.environ[ADDRESS] = address
    os.environ["PYTHONPATH"] = os.pathsep.join([str(EARLY), *filter(None, [os.environ.get("PYTHONPATH")])])


def serve(listener: socket.socket, folder: str, modules: list[str]) -> None:
    """Import `modules`, then fork for every connection until standard input closes."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # forks are not waited for
    try:
        with _ended_by_closing(sys.stdin):
            for name in modules:
                # What is missing here, a job will say.
                with contextlib.suppress(Exception):
                    importlib.import_module(name)
        while True:
            ready, _, _ = select.select([listener, sys.stdin], [], [])
            if sys.stdin in ready:
                return
            connection, _ = listener.accept()
            if os.fork() == 0:
                listener.close()
                _attend(connection)
            connection.close()
    finally:
        if os.getpid() == _server:
            for leftover in Path(folder).iterdir():
                leftover.unlink()
            os.rmdir(folder)


@contextlib.contextmanager
def _ended_by_closing(pipe):
    """End the process if a pipe closes while the block is at work."""
    former = signal.signal(signal.SIGIO, lambda *_: sys.exit())
    flags = fcntl.fcntl(pipe, fcntl.F_GETFL)
    fcntl.fcntl(pipe, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(pipe, fcntl.F_SETFL, flags | os.O_ASYNC)
    if select.select([pipe], [], [], 0)[0]:
        sys.exit()
    try:
        yield
    finally:
        fcntl.fcntl(pipe, fcntl.F_SETFL, flags)
        signal.signal(signal.SIGIO, former)


def _attend(connection: socket.socket) -> None:
    """Fork once more for the job, and tell the other side how it ends; if that one goes away, end the job."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    _, ancillary, _, _ = connection.recvmsg(1, socket.CMSG_SPACE(2 * array.array("i").itemsize))
    streams = array.array("i")
    streams.frombytes(ancillary[0][2])
    text = connection.makefile().readline()
    if not text:
        os._exit(1)
    job = os.fork()
    if job == 0:
        os.setpgid(0, 0)
        connection.close()
        _run(json.loads(text), *streams)
    for stream in streams:
        os.close(stream)
    ready, _, _ = select.select([connection, os.pidfd_open(job)], [], [])
    if connection in ready:  # nothing more is ever sent: the other side is gone
        with contextlib.suppress(ProcessLookupError):
            os.killpg(job, signal.SIGKILL)
    _, status = os.waitpid(job, 0)
    with contextlib.suppress(OSError):
        connection.sendall(f"{os.waitstatus_to_exitcode(status) & 255}\n".encode())
    os._exit(0)


def _run(request: dict, out: int, error: int) -> None:
    """Be the job."""
    os.dup2(out, 1)
    os.dup2(error, 2)
    os.close(out)
    os.close(error)
    os.environ.clear()
    os.environ.update(request["environment"])
    os.environ.pop(ADDRESS, None)
    os.chdir(request["folder"])
    sys.argv = request["arguments"]
    sys.path[0] = os.path.dirname(request["script"])
    status = 1
    try:
        runpy.run_path(request["script"], run_name="__main__")
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else (0 if end.code is None else 1)
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except OSError:  # a full disk
                status = status or 1
        os._exit(status)


if __name__ == "__main__":
    _server = os.getpid()
    # The folder of this module is none that a job imports from.
    sys.path.pop(0)
    serve(socket.socket(fileno=int(sys.argv[1])), sys.argv[2], sys.argv[3:])
