"""Where Snakemake keeps its records of results, for which it has no public interface.

There is one of every file that it made, in `.snakemake/metadata`, and one in `.snakemake/incomplete` of every file
whose job has begun and not ended well. Its name is that of the file in base64; one that is too long for the file
system is cut, and its first parts are folders.
"""

import json
import os
from base64 import urlsafe_b64decode, urlsafe_b64encode
from pathlib import Path

METADATA = Path(".snakemake/metadata")
INCOMPLETE = Path(".snakemake/incomplete")


def record_of(name: str, records: Path) -> Path:
    """Where the record of the file `name` is among `records`."""
    code = urlsafe_b64encode(name.encode()).decode()
    longest = os.pathconf(records, "PC_NAME_MAX") - 1
    parts = [code[start : start + longest] for start in range(0, len(code), longest)]
    return records.joinpath(*(f"@{part}" for part in parts[:-1]), parts[-1])


def file_of(record: Path, records: Path) -> str | None:
    """The name of the file that a record is of; None if it is no record."""
    try:
        return urlsafe_b64decode("".join(part.removeprefix("@") for part in record.relative_to(records).parts)).decode()
    except ValueError:
        return None


def mark_incomplete(name: str) -> None:
    """Have the file `name` made again when it is asked for, as if its job had not ended well.

    Raises
    ------
    OSError
        If that cannot be written.
    """
    INCOMPLETE.mkdir(parents=True, exist_ok=True)
    record = record_of(name, INCOMPLETE)
    record.parent.mkdir(parents=True, exist_ok=True)
    record.write_text(json.dumps({"external_jobid": None}), encoding="ascii")
