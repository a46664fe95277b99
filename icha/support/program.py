"""Find the folder of the workflow, in a clone or an installation.

`python -m icha.support.program` prints the folder of the workflow; its subfolder config/ contains campaigns.
"""

from pathlib import Path

# Name of the folder of the workflow next to the installed package; the wheel contains this folder (hatch_build.py).
INSTALLED = "icha_workflow"
_PACKAGE = Path(__file__).resolve().parent.parent


def own_workflow() -> Path:
    """Return the folder with the Snakefile: the repository for an editable installation, else the installed folder."""
    beside = _PACKAGE.parent
    return beside if (beside / "Snakefile").is_file() else beside / INSTALLED


if __name__ == "__main__":
    print(own_workflow())
