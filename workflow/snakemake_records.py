"""Location of Snakemake's records of results; Snakemake has no public interface for these records.

`.snakemake/metadata` contains a record of each file that Snakemake made. `.snakemake/incomplete` contains a record of
each file whose job started but did not succeed. The name of a record is the name of the file in base64. A name that is
too long for the file system is split, and the first parts of the name are folders.
"""

import json
import os
from base64 import urlsafe_b64decode, urlsafe_b64encode
from pathlib import Path

METADATA = Path(".snakemake/metadata")
INCOMPLETE = Path(".snakemake/incomplete")


def record_of(name: str, records: Path) -> Path:
    """Return the path of Snakemake's record of a file, in the folder `records`."""
    code = urlsafe_b64encode(name.encode()).decode()
    longest = os.pathconf(records, "PC_NAME_MAX") - 1
    parts = [code[start : start + longest] for start in range(0, len(code), longest)]
    return records.joinpath(*(f"@{part}" for part in parts[:-1]), parts[-1])


def file_of(record: Path, records: Path) -> str | None:
    """Return the name of the file that a record describes; None if `record` is not a record of Snakemake."""
    try:
        return urlsafe_b64decode("".join(part.removeprefix("@") for part in record.relative_to(records).parts)).decode()
    except ValueError:
        return None


def mark_incomplete(name: str) -> None:
    """Make Snakemake compute a file again, as if its job had failed."""
    INCOMPLETE.mkdir(parents=True, exist_ok=True)
    record = record_of(name, INCOMPLETE)
    record.parent.mkdir(parents=True, exist_ok=True)
    record.write_text(json.dumps({"external_jobid": None}), encoding="ascii")
