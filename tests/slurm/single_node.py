"""A Slurm of one node on this machine, for tests.

It needs root and, on Debian, `apt-get install --no-install-recommends slurmctld slurmd slurm-client munge`. The daemons
are children of this process and end with the `with` block; all their files are in one temporary folder. If the machine
already has a Slurm, none is started: `why_not` returns the reason.
"""

import ctypes
import fcntl
import os
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue", "sinfo", "scancel")
PACKAGES = "slurmctld slurmd slurm-client munge"
FOLDER = "icha-slurm-"
# Job steps read this file, because the executor does not pass the variable SLURM_CONF to them.
SYSTEM_CONFIGURATION = Path("/etc/slurm/slurm.conf")

CONFIGURATION = """\
ClusterName=icha
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmdPort={node_port}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
# Control groups of the kernel are not used, because many containers lack them.
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
# One line for each finished job.
JobCompType=jobcomp/filetxt
JobCompLoc={folder}/finished_jobs
MpiDefault=none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=1,bf_interval=1
MinJobAge=3600
KillWait=2
ReturnToService=2
# The number of cores is the one below, not that of the machine.
SlurmdParameters=config_overrides
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory} State=UNKNOWN
PartitionName=local Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


@dataclass(frozen=True)
class SingleNode:
    """A running Slurm: its folder, and the environment variables that its commands need."""

    folder: Path
    environment: dict[str, str]

    def command(self, *arguments: str) -> str:
        """Run a command of Slurm and return its output."""
        done = subprocess.run(
            arguments, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60
        )
        if done.returncode:
            raise RuntimeError(f"{' '.join(arguments)} ended with {done.returncode}:\n{done.stdout}")
        return done.stdout

    def finished_jobs(self) -> list[dict[str, str]]:
        """Return Slurm's records of the finished jobs, in the order in which they ended."""
        records = self.folder / "finished_jobs"
        lines = records.read_text().splitlines() if records.exists() else []
        return [dict(field.split("=", 1) for field in line.split() if "=" in field) for line in lines]


def why_not() -> str | None:
    """Return the reason why this machine cannot start a Slurm; None if it can."""
    if os.geteuid() != 0:
        return "Slurm's daemons need root"
    missing = [name for name in PROGRAMS if shutil.which(name) is None]
    if missing:
        return f"Slurm is not installed ({', '.join(missing)} missing; on Debian: apt-get install {PACKAGES})"
    if "SLURM_CONF" in os.environ:
        return f"this machine belongs to a Slurm (SLURM_CONF={os.environ['SLURM_CONF']})"
    if os.path.lexists(SYSTEM_CONFIGURATION) and not _ours(SYSTEM_CONFIGURATION):
        return f"this machine belongs to a Slurm ({SYSTEM_CONFIGURATION})"
    return None


@contextmanager
def single_node(cores: int = 4, memory: int = 8000):
    """Start a Slurm with one node of `cores` cores and `memory` megabytes, and end it with the block."""
    with ExitStack() as stack:
        # Only one at a time, because all use the same SYSTEM_CONFIGURATION.
        lock = stack.enter_context(open(Path(tempfile.gettempdir(), "icha-slurm.lock"), "w"))
        fcntl.flock(lock, fcntl.LOCK_EX)
        reason = why_not()
        if reason:
            raise RuntimeError(reason)
        folder = Path(tempfile.mkdtemp(prefix=FOLDER))
        stack.callback(shutil.rmtree, folder, ignore_errors=True)
        folder.chmod(0o755)
        for name in ("state", "spool"):
            (folder / name).mkdir()
        key = folder / "munge.key"
        key.write_bytes(secrets.token_bytes(1024))
        key.chmod(0o400)

        configuration = folder / "slurm.conf"
        values = {"host": socket.gethostname().split(".")[0], "folder": folder, "cores": cores, "memory": memory}
        values["controller_port"], values["node_port"] = _free_ports(2)
        configuration.write_text(CONFIGURATION.format(**values))
        SYSTEM_CONFIGURATION.parent.mkdir(parents=True, exist_ok=True)
        SYSTEM_CONFIGURATION.unlink(missing_ok=True)
        SYSTEM_CONFIGURATION.symlink_to(configuration)
        stack.callback(SYSTEM_CONFIGURATION.unlink, missing_ok=True)

        environment = {name: value for name, value in os.environ.items() if not name.startswith(("SLURM_", "SBATCH_"))}
        environment["SLURM_CONF"] = str(configuration)
        node = SingleNode(folder, environment)
        for name, *options in (
            ("munged", "--foreground", "--force", f"--key-file={key}", f"--socket={folder}/munge.socket",
             f"--pid-file={folder}/munged.pid", f"--seed-file={folder}/munged.seed", f"--log-file={folder}/munged.log"),
            ("slurmctld", "-D", "-c"),
            ("slurmd", "-D"),
        ):  # fmt: skip
            output = stack.enter_context(open(folder / f"{name}.output", "w"))
            daemon = subprocess.Popen(
                [shutil.which(name), *options],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                start_new_session=True,
                preexec_fn=_end_with_parent,
            )
            stack.callback(_end, daemon)
            if name == "munged":
                _wait_for((folder / "munge.socket").exists, daemon, folder)
        _wait_for(lambda: "idle" in node.command("sinfo", "--noheader", "--format=%t"), daemon, folder)
        stack.callback(_cancel_all, node)
        yield node


def _ours(path: Path) -> bool:
    """Return whether a configuration belongs to a Slurm of this module, perhaps of a killed test."""
    return path.is_symlink() and os.readlink(path).startswith(str(Path(tempfile.gettempdir(), FOLDER)))


def _end_with_parent() -> None:
    """Let the operating system kill this process when the process that started it ends for any reason."""
    death_signal = 1  # PR_SET_PDEATHSIG of prctl(2)
    ctypes.CDLL(None).prctl(death_signal, signal.SIGKILL)


def _free_ports(number: int) -> list[int]:
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(number)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in sockets]


def _wait_for(ready, daemon: subprocess.Popen, folder: Path, seconds: float = 30) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end and daemon.poll() is None:
        try:
            if ready():
                return
        except RuntimeError:
            pass  # the controller does not respond yet
        time.sleep(0.1)
    output = "\n".join(f"{file.name}: {file.read_text()[-2000:]}" for file in sorted(folder.glob("*.output")))
    raise RuntimeError(f"Slurm did not start:\n{output}")


def _cancel_all(node: SingleNode) -> None:
    """Cancel all jobs, and wait until they have ended."""
    node.command("scancel", "--user=root")
    end = time.monotonic() + 30
    while node.command("squeue", "--noheader") and time.monotonic() < end:
        time.sleep(0.3)


def _end(daemon: subprocess.Popen) -> None:
    daemon.terminate()
    try:
        daemon.wait(timeout=20)
    except subprocess.TimeoutExpired:
        daemon.send_signal(signal.SIGKILL)
        daemon.wait()
