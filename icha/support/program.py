"""Where the workflow is that came with this package: in the repository, or installed beside the package.

`python -m icha.support.program` prints it: shipped campaigns and example files lie there, in config/.
"""

from pathlib import Path

# The folder beside the installed package; pyproject.toml puts it there (tool.hatch.build.targets.wheel.hooks).
INSTALLED = "icha_workflow"
_PACKAGE = Path(__file__).resolve().parent.parent


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
