"""Table of the times and the memory of the jobs of a campaign; these values differ between executions."""

import json
import os
from pathlib import Path

from icha.support.atomic_files import whole_file


def write_times(table: str | os.PathLike, benchmarks: str | os.PathLike) -> None:
    """Write the wall time and the peak memory of every job that has a benchmark file below a folder.

    Only memory that a job does not share with other processes counts (`max_uss`). The memory is 0 if the
    job ended before the first measurement of its memory.
    """
    rows = ["job\tseconds\tmegabytes"]
    for file in sorted(Path(benchmarks).rglob("*.jsonl")):
        executions = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
        seconds = sum(float(each["s"]) for each in executions)
        megabytes = max(each.get("max_uss") or 0 for each in executions)
        rows.append(f"{file.relative_to(benchmarks).with_suffix('')}\t{seconds:.2f}\t{megabytes:.0f}")
    with whole_file(table) as temporary:
        temporary.write_text("\n".join(rows) + "\n", encoding="utf-8")
