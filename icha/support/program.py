"""This program on this machine: where its workflow is (in the repository, or installed beside), and its processes.

`python -m icha.support.program` prints where shipped campaigns and example files lie, in config/.
"""

import ctypes
import os
import signal
from pathlib import Path

# The folder beside the installed package; pyproject.toml puts it there (tool.hatch.build.targets.wheel.hooks).
INSTALLED = "icha_workflow"
_PACKAGE = Path(__file__).resolve().parent.parent
_PR_SET_PDEATHSIG = 1  # of prctl(2)


def own_workflow() -> Path:
    """The folder with the Snakefile: the repository of an editable installation, else what was installed."""
    beside = _PACKAGE.parent
    return beside if (beside / "Snakefile").is_file() else beside / INSTALLED


def is_installed(workflow: Path) -> bool:
    """Whether the folder with a Snakefile is what was installed, and no clone of the repository."""
    return workflow.name == INSTALLED and not (workflow / "icha").is_dir()


def package_of(workflow: Path) -> Path:
    """The package `icha` that belongs to a workflow: in its folder, or beside it where that is installed."""
    return (workflow.parent if is_installed(workflow) else workflow) / "icha"


if __name__ == "__main__":
    print(own_workflow())


def beginning_of(process: int) -> str:
    """When a process began, in the system's own count: with its number it tells the process from all others.

    Raises
    ------
    FileNotFoundError, ProcessLookupError
        If there is no such process.
    """
    # The name of the program, in parentheses, may hold anything.
    status = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    return status.rpartition(")")[2].split()[19]


def end_with_parent(parent: int) -> None:
    """Have the system kill this process when its parent, the process `parent`, ends, however that does."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
