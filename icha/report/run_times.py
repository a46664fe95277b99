"""What the jobs of a campaign took: measurements, and so on a page of their own."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from icha.report.template import template
from icha.support.atomic_files import whole_file

# So many of the longest jobs are listed.
_LONGEST = 30


@dataclass(frozen=True)
class Benchmark:
    """What one job took: wall time in s and peak memory in MB (none where it ended before it was measured).

    The memory is its own (`max_uss`): jobs that are forks share what the process had that they were forked from.
    """

    job: str
    seconds: float
    megabytes: float | None


def write_times_page(path: str | os.PathLike, jobs: Sequence[Benchmark]) -> None:
    """Write the page of what the jobs took: all of them by kind, and the longest ones.

    The kind of a job is what its name begins with, up to the first slash.
    """
    kinds: dict[str, list[Benchmark]] = {}
    for job in jobs:
        kinds.setdefault(job.job.split("/")[0], []).append(job)
    rows = [
        {
            "name": name,
            "count": len(own),
            "total": sum(job.seconds for job in own),
            "longest": max(job.seconds for job in own),
            "memory": max((job.megabytes or 0 for job in own), default=0),
        }
        for name, own in kinds.items()
    ]
    longest = sorted(jobs, key=lambda job: -job.seconds)
    page = template("run_times.html").render(
        kinds=sorted(rows, key=lambda row: -row["total"]),
        total=sum(job.seconds for job in jobs),
        count=len(jobs),
        longest=longest[:_LONGEST],
    )
    with whole_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def write_times(table: str | os.PathLike, page: str | os.PathLike, benchmarks: str | os.PathLike) -> None:
    """Write wall time and peak memory of every job that left a benchmark file below a folder, as table and page."""
    folder = Path(benchmarks)
    jobs = [
        read_benchmark(path, str(path.relative_to(folder).with_suffix(""))) for path in sorted(folder.rglob("*.jsonl"))
    ]
    rows = [f"{each.job}\t{each.seconds:.2f}\t{each.megabytes or 0:.0f}" for each in jobs]
    with whole_file(table) as temporary:
        temporary.write_text("\n".join(["job\tseconds\tmegabytes", *rows]) + "\n", encoding="utf-8")
    write_times_page(page, jobs)


def read_benchmark(path: Path, job: str) -> Benchmark:
    """Read a benchmark file of Snakemake, `.jsonl`; repeats add up."""
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    memory = [row.get("max_uss", row.get("max_rss")) for row in rows]
    known = [float(each) for each in memory if isinstance(each, int | float) and math.isfinite(each)]
    return Benchmark(job, sum(float(row["s"]) for row in rows), max(known, default=None))
