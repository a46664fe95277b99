"""The program on this machine: the folder of its workflow, in a clone or installed, and its processes.

`python -m icha.support.program` prints the folder of the workflow; shipped campaigns and examples are in its config/.
"""

import ctypes
import os
import signal
from pathlib import Path

# Folder beside the installed package, which the wheel contains (tool.hatch.build.targets.wheel.hooks).
INSTALLED = "icha_workflow"
_PACKAGE = Path(__file__).resolve().parent.parent
_PR_SET_PDEATHSIG = 1  # of prctl(2)


def own_workflow() -> Path:
    """Return the folder with the Snakefile: the repository of an editable installation, else the installed folder."""
    beside = _PACKAGE.parent
    return beside if (beside / "Snakefile").is_file() else beside / INSTALLED


def is_installed(workflow: Path) -> bool:
    """Return whether the folder of a workflow is an installed one, not a clone of the repository."""
    return workflow.name == INSTALLED and not (workflow / "icha").is_dir()


def package_of(workflow: Path) -> Path:
    """Return the folder of the package `icha`: in the clone, or beside the folder of an installed workflow."""
    return (workflow.parent if is_installed(workflow) else workflow) / "icha"


if __name__ == "__main__":
    print(own_workflow())


def beginning_of(process: int) -> str:
    """Return the start time of a process in system ticks. The number and the start time identify a process.

    Raises FileNotFoundError or ProcessLookupError if the process does not exist.
    """
    # The name of the program, in parentheses, may contain any characters.
    status = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    return status.rpartition(")")[2].split()[19]


def end_with_parent(parent: int) -> None:
    """Let the system kill this process when its parent, the process `parent`, ends for any reason."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
