"""Times and memory of the jobs of a campaign, on a separate page, because they differ from execution to execution."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from icha.report.template import write_page
from icha.support.atomic_files import whole_file

LONGEST_JOBS = 30  # rows of the table of the longest jobs


@dataclass(frozen=True)
class Benchmark:
    """Cost of one job.

    Attributes
    ----------
    job : name of the job; its kind is the part before the first slash.
    seconds : wall time in s.
    megabytes : peak of its unique memory (`max_uss`) in MB, since forks share the memory of their parent; None if the
        job ended before the first measurement.
    """

    job: str
    seconds: float
    megabytes: float | None


def write_times(table: str | os.PathLike, page: str | os.PathLike, benchmarks: str | os.PathLike) -> None:
    """Write wall time and peak memory of every job with a benchmark file below a folder, as a table and as a page."""
    folder = Path(benchmarks)
    jobs = [
        read_benchmark(path, str(path.relative_to(folder).with_suffix(""))) for path in sorted(folder.rglob("*.jsonl"))
    ]
    rows = [f"{job.job}\t{job.seconds:.2f}\t{job.megabytes or 0:.0f}" for job in jobs]
    with whole_file(table) as temporary:
        temporary.write_text("\n".join(["job\tseconds\tmegabytes", *rows]) + "\n", encoding="utf-8")
    write_times_page(page, jobs)


def read_benchmark(path: Path, job: str) -> Benchmark:
    """Read a benchmark file of Snakemake, `.jsonl`; times of repetitions add up."""
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    memory = [row.get("max_uss", row.get("max_rss")) for row in rows]
    known = [float(value) for value in memory if isinstance(value, int | float) and math.isfinite(value)]
    return Benchmark(job, sum(float(row["s"]) for row in rows), max(known, default=None))


def write_times_page(path: str | os.PathLike, jobs: Sequence[Benchmark]) -> None:
    """Write a page with the sums by kind of job, and the longest jobs."""
    kinds: dict[str, list[Benchmark]] = {}
    jobs = sorted(jobs, key=lambda job: -job.seconds)
    for job in jobs:
        kinds.setdefault(job.job.split("/")[0], []).append(job)
    ordered = sorted(kinds.items(), key=lambda kind: -sum(job.seconds for job in kind[1]))
    write_page(path, "run_times.html", kinds=dict(ordered), jobs=jobs, longest=jobs[:LONGEST_JOBS])
