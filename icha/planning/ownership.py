"""Ownership of results: a folder of results belongs to one configuration file; no other file may replace the results.

A record in the folder of results contains the path of the configuration file. The recorded path is relative to the
parent folder of results/. The path of a file that came with the workflow is relative to the folder of the workflow.
Relative paths keep the record valid if the folders are moved. Results without a record, from older versions, belong to
the first file that is run.
"""

import os
from pathlib import Path

from icha.datasets.results import CONFIGURATION
from icha.support.atomic_files import whole_file

RECORD = "belongs_to.txt"


def find_conflict(results: Path, name: str, file: Path, workflow: Path) -> str | None:
    """Return a message if a folder of results belongs to another configuration file than `file`; else None.

    Parameters
    ----------
    results : folder of results of the campaign, FOLDER/results/NAME.
    name : name of the campaign.
    file : configuration file of the campaign.
    workflow : folder of the workflow.
    """
    owner, record = _read_owner(results), _record_of(results, file, workflow)
    if owner in (None, record) or _is_copy(results, file):
        return None
    return (
        f"{results} belongs to {owner}, but {record} has the same `name: {name}` and would replace these results. "
        f"Give {record} another `name:`. If the configuration file was only moved or renamed, remove "
        f"{results / RECORD}."
    )


def claim(results: Path, file: Path, workflow: Path) -> None:
    """Record that a folder of results belongs to a configuration file, unless the folder already has a record."""
    if _read_owner(results) is None and not _is_copy(results, file):
        with whole_file(results / RECORD) as temporary:
            temporary.write_text(f"{_record_of(results, file, workflow)}\n", encoding="utf-8")


def _read_owner(results: Path) -> str | None:
    try:
        return (results / RECORD).read_text(encoding="utf-8", errors="replace").strip() or None
    except OSError:
        return None  # there is no record, or the folder cannot be read


def _is_copy(results: Path, file: Path) -> bool:
    """Return whether a file is the copy of the configuration in the folder of results."""
    return Path(file).resolve() == (results / CONFIGURATION).resolve()


def _record_of(results: Path, file: Path, workflow: Path) -> str:
    """Return the path of a configuration file in the form of the record."""
    folder = Path(os.path.abspath(results)).parent.parent
    folder, workflow, file = (Path(path).resolve() for path in (folder, workflow, file))
    if file.is_relative_to(workflow) and not file.is_relative_to(folder):
        return f"{file.relative_to(workflow).as_posix()} of ICHA"
    return Path(os.path.relpath(file, folder)).as_posix()
