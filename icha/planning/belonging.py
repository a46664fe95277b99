"""Which configuration file the results of a campaign belong to: two files of one name would replace each other's.

The file is recorded by its path from the project's folder, so that the record holds wherever the project is. Results
without a record, those of older versions for one, belong to the first file that is run.
"""

import os
from pathlib import Path

from icha.datasets.results import CONFIGURATION
from icha.support.atomic_files import whole_file

RECORD = "belongs_to.txt"


def belongs_to_another(results: Path, name: str, file: Path, project: Path) -> str | None:
    """That results belong to another configuration file, and what can be done about it; None if they do not.

    Parameters
    ----------
    results : the campaign's folder of results.
    name : of the campaign.
    file : its configuration file.
    project : the folder of the project.
    """
    owner, own = _recorded(results), _from(project, file)
    if owner in (None, own) or _is_kept(results, file):
        return None
    return (
        f"{results} belongs to {owner}, and {own} has the same `name: {name}`: its results would replace the others. "
        f"Give {own} another `name:`; or, if it is the same campaign in a file that was moved or renamed, remove "
        f"{results / RECORD}."
    )


def claim(results: Path, file: Path, project: Path) -> None:
    """Record that results belong to a configuration file, unless they belong to one already."""
    if _recorded(results) is None and not _is_kept(results, file):
        with whole_file(results / RECORD) as temporary:
            temporary.write_text(f"{_from(project, file)}\n", encoding="utf-8")


def _recorded(results: Path) -> str | None:
    try:
        return (results / RECORD).read_text(encoding="utf-8", errors="replace").strip() or None
    except OSError:
        return None  # there is none; or nothing can be read there, so that nothing will be replaced


def _is_kept(results: Path, file: Path) -> bool:
    """Whether a file is the configuration that was kept with the results themselves."""
    return Path(file).resolve() == (results / CONFIGURATION).resolve()


def _from(project: Path, file: Path) -> str:
    return Path(os.path.relpath(Path(file).resolve(), Path(project).resolve())).as_posix()
