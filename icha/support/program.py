"""Find the folder of the workflow, in a clone or an installation, and identify processes of the program.

`python -m icha.support.program` prints the folder of the workflow; its subfolder config/ contains campaigns.
"""

import ctypes
import os
import signal
from pathlib import Path

# Name of the folder of the workflow next to the installed package; the wheel contains this folder (hatch_build.py).
INSTALLED = "icha_workflow"
_PACKAGE = Path(__file__).resolve().parent.parent
_PR_SET_PDEATHSIG = 1  # of prctl(2)


def own_workflow() -> Path:
    """Return the folder with the Snakefile: the repository for an editable installation, else the installed folder."""
    beside = _PACKAGE.parent
    return beside if (beside / "Snakefile").is_file() else beside / INSTALLED


def is_installed(workflow: Path) -> bool:
    """Return whether the folder of a workflow comes from an installation, not from a clone of the repository."""
    return workflow.name == INSTALLED and not (workflow / "icha").is_dir()


def package_of(workflow: Path) -> Path:
    """Return the folder of the package `icha`: inside a clone, or next to the folder of an installed workflow."""
    return (workflow.parent if is_installed(workflow) else workflow) / "icha"


if __name__ == "__main__":
    print(own_workflow())


def beginning_of(process: int) -> str:
    """Return the start time of a process, in clock ticks. A process is identified by its number and its start time.

    Raises FileNotFoundError or ProcessLookupError if the process does not exist.
    """
    # The name of the program, in parentheses, may contain any characters.
    status = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    return status.rpartition(")")[2].split()[19]


def end_with_parent(parent: int) -> None:
    """Let the operating system kill this process when its parent process (number `parent`) ends for any reason."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
