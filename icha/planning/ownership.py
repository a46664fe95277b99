"""A folder of results belongs to one configuration file; no other file may replace the results.

A record in the folder of results contains the path of the configuration file, relative to the folder of results/.
"""

import os
from pathlib import Path

from icha.datasets.results import CONFIGURATION
from icha.support.atomic_files import whole_file

RECORD = "belongs_to.txt"


def find_conflict(results: Path, file: Path) -> str | None:
    """Return a message if a folder of results belongs to another configuration file than `file`; else None."""
    owner, record = _read_owner(results), _record_of(results, file)
    if owner in ("", record) or _is_copy(results, file):
        return None
    return (
        f"{results} belongs to {owner}, but {record} has the same `name: {results.name}` and would replace these "
        f"results. Give {record} another `name:`. If the configuration file was only moved or renamed, remove "
        f"{results / RECORD}."
    )


def claim(results: Path, file: Path) -> None:
    """Record that a folder of results belongs to a configuration file, unless the folder already has a record."""
    if not _read_owner(results) and not _is_copy(results, file):
        with whole_file(results / RECORD) as temporary:
            temporary.write_text(f"{_record_of(results, file)}\n", encoding="utf-8")


def _read_owner(results: Path) -> str:
    record = results / RECORD
    return record.read_text(encoding="utf-8", errors="replace").strip() if record.is_file() else ""


def _record_of(results: Path, file: Path) -> str:
    return Path(os.path.relpath(Path(file).resolve(), results.resolve().parent.parent)).as_posix()


def _is_copy(results: Path, file: Path) -> bool:
    """Return whether a file is the copy of the configuration in the folder of results."""
    return Path(file).resolve() == (results / CONFIGURATION).resolve()
