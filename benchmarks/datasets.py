"""Time and memory that the campaign dataset and its checks take, by the number of runs.

python benchmarks/datasets.py [--runs N ...]

Writes benchmarks/results/dataset-write-N.json and dataset-check-N.json. Standard library only: whoever measures memory
has to stay small.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from dataclasses import asdict

from measure import measure
from run import keep, script


def main() -> None:
    """Make the files of the most runs, then measure each part of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, nargs="+", default=[100, 1000, 10000])
    parser.add_argument("--limit", type=float, default=1800, help="seconds for each, at most")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, script("make_runs"), folder, str(max(options.runs))], check=True)
        for count in options.runs:
            for part in ("write", "check"):
                command = [sys.executable, script(f"{part}_campaign"), folder, str(count)]
                measured = measure(command, 1, options.limit)
                keep(f"dataset-{part}-{count}", {"runs": count} | asdict(measured))
                spent = f"{measured.wall:.1f} s ({measured.processor:.1f} s of processor)"
                print(f"{part} {count}: {measured.outcome}, {spent}, {measured.peak / 2**20:.0f} MiB", flush=True)


if __name__ == "__main__":
    main()
