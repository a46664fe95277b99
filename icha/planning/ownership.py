"""Which configuration file the results of a campaign belong to: two files of one name would replace each other's.

The file is recorded by its path from the folder that holds results/, or else, if it came with the workflow, from there,
so that the record holds wherever these folders are. Results without a record, those of older versions for one, belong
to the first file that is run.
"""

import os
from pathlib import Path

from icha.datasets.results import CONFIGURATION
from icha.support.atomic_files import in_the_way, whole_file

RECORD = "belongs_to.txt"


def belongs_to_another(results: Path, name: str, file: Path, workflow: Path) -> str | None:
    """That results belong to another configuration file, or cannot be where they are to be, and what can be done.

    None if they can be computed.

    Parameters
    ----------
    results : the campaign's folder of results, FOLDER/results/NAME.
    name : of the campaign.
    file : its configuration file.
    workflow : the folder of the workflow.
    """
    if obstacle := in_the_way(results):
        return f"{obstacle}: results cannot be there. Remove it, or put it right."
    owner, own = _recorded(results), _named(results, file, workflow)
    if owner in (None, own) or _is_kept(results, file):
        return None
    return (
        f"{results} belongs to {owner}, and {own} has the same `name: {name}`: its results would replace the others. "
        f"Give {own} another `name:`; or, if it is the same campaign in a file that was moved or renamed, remove "
        f"{results / RECORD}."
    )


def claim(results: Path, file: Path, workflow: Path) -> None:
    """Record that results belong to a configuration file, unless they belong to one already."""
    if _recorded(results) is None and not _is_kept(results, file):
        with whole_file(results / RECORD) as temporary:
            temporary.write_text(f"{_named(results, file, workflow)}\n", encoding="utf-8")


def _recorded(results: Path) -> str | None:
    try:
        return (results / RECORD).read_text(encoding="utf-8", errors="replace").strip() or None
    except OSError:
        return None  # there is none; or nothing can be read there, so that nothing will be replaced


def _is_kept(results: Path, file: Path) -> bool:
    """Whether a file is the configuration that was kept with the results themselves."""
    return Path(file).resolve() == (results / CONFIGURATION).resolve()


def _named(results: Path, file: Path, workflow: Path) -> str:
    """How a file is recorded."""
    folder = Path(os.path.abspath(results)).parent.parent
    folder, workflow, file = (Path(path).resolve() for path in (folder, workflow, file))
    if file.is_relative_to(workflow) and not file.is_relative_to(folder):
        return f"{file.relative_to(workflow).as_posix()} of ICHA"
    return Path(os.path.relpath(file, folder)).as_posix()
