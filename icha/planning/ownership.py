"""Ownership of results: each folder of results belongs to one configuration file, and no other file may replace them.

The record contains the path of the file. The path is relative to the folder that holds results/, or to the workflow if
the file came with the workflow. So the record stays valid if these folders move. Results without a record, as of older
versions, belong to the first file that is run.
"""

import os
from pathlib import Path

from icha.datasets.results import CONFIGURATION
from icha.support.atomic_files import whole_file

RECORD = "belongs_to.txt"


def find_conflict(results: Path, name: str, file: Path, workflow: Path) -> str | None:
    """Describe why a configuration file may not write results, and what to do; None if it may.

    Parameters
    ----------
    results : folder of results of the campaign, FOLDER/results/NAME.
    name : name of the campaign.
    file : its configuration file.
    workflow : folder of the workflow.
    """
    owner, record = _read_owner(results), _record_of(results, file, workflow)
    if owner in (None, record) or _is_copy(results, file):
        return None
    return (
        f"{results} belongs to {owner}, and {record} has the same `name: {name}`, so its results would replace the "
        f"others. Give {record} another `name:`. If the file of this campaign was moved or renamed, remove "
        f"{results / RECORD}."
    )


def claim(results: Path, file: Path, workflow: Path) -> None:
    """Record that results belong to a configuration file, unless they belong to one already."""
    if _read_owner(results) is None and not _is_copy(results, file):
        with whole_file(results / RECORD) as temporary:
            temporary.write_text(f"{_record_of(results, file, workflow)}\n", encoding="utf-8")


def _read_owner(results: Path) -> str | None:
    try:
        return (results / RECORD).read_text(encoding="utf-8", errors="replace").strip() or None
    except OSError:
        return None  # without a record, or in a folder that cannot be read, nothing is replaced


def _is_copy(results: Path, file: Path) -> bool:
    """Return whether a file is the configuration that is stored with the results."""
    return Path(file).resolve() == (results / CONFIGURATION).resolve()


def _record_of(results: Path, file: Path, workflow: Path) -> str:
    """Return the path of a configuration file as the record holds it."""
    folder = Path(os.path.abspath(results)).parent.parent
    folder, workflow, file = (Path(path).resolve() for path in (folder, workflow, file))
    if file.is_relative_to(workflow) and not file.is_relative_to(folder):
        return f"{file.relative_to(workflow).as_posix()} of ICHA"
    return Path(os.path.relpath(file, folder)).as_posix()
