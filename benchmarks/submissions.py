"""What a submission costs: a campaign of small runs on one machine, on a Slurm of one node, in batches and run by run.

    make slurm-environment && .venv/bin/python benchmarks/submissions.py [RUNS]

Needs root and Debian's packages, see tests/slurm/single_node.py. Prints what docs/howto/cluster.md tells; the node
is this machine and answers at once, so there is no waiting for other people's jobs in it.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from datetime import datetime
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]
sys.path.insert(0, str(REPOSITORY / "tests"))

from conftest import copy_project  # noqa: E402
from slurm.single_node import single_node  # noqa: E402

CAMPAIGN = """
name: small
title: Small runs
summary: What submissions cost.
license: CC0-1.0
surfaces:
  rough: {{kind: self_affine, period: 100 um, rolloff_wavelength: 50 um, short_wavelength: 5 um, hurst: 0.8, grid: 128}}
materials:
  soft: {{contact_modulus: 25 MPa, surface_energy: 50 mJ/m^2, interaction_range: 2.071 nm}}
studies:
  slopes:
    surfaces: [rough]
    rms_slopes: {slopes}
    materials: [soft]
    targets: {{reduced_pressures: [1.0e-3, 3.0e-3, 1.0e-2]}}
figures: {{fig1_jkr: {{}}}}
"""
WAYS = {
    "one machine": (),
    "Slurm, in one batch": ("--workflow-profile", "slurm", "--group-components", "surfaces=10", "runs=1000"),
    "Slurm, run by run": ("--workflow-profile", "slurm", "--group-components", "surfaces=1", "runs=1"),
}


def seconds_of(record):
    return (datetime.fromisoformat(record["EndTime"]) - datetime.fromisoformat(record["StartTime"])).total_seconds()


def measure(runs: int) -> None:
    """Print a line for each way to compute the same `runs` small runs."""
    print("| | submissions | wall time | core-seconds of submissions, a run | script of a run |")
    print("| --- | ---: | ---: | ---: | ---: |")
    with single_node(cores=os.cpu_count()) as node, tempfile.TemporaryDirectory() as folder:
        for number, (way, arguments) in enumerate(WAYS.items()):
            project = copy_project(REPOSITORY, Path(folder, str(number)))
            slopes = [round(0.2 + 0.8 * i / runs, 4) for i in range(runs)]
            (project / "config/small.yaml").write_text(CAMPAIGN.format(slopes=slopes))
            before = len(node.finished_jobs())
            begin = time.monotonic()
            subprocess.run(
                [REPOSITORY / ".venv-slurm/bin/python", "-m", "snakemake", "runs", *arguments,
                 "--cores", str(os.cpu_count()), "--slurm-batches-init-seconds-before-status-checks", "1",
                 "--configfile", "config/small.yaml"],
                cwd=project,
                env=node.environment | {"PYTHONPATH": str(project), "OMP_NUM_THREADS": "1"},
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                check=True,
            )  # fmt: skip
            wall = time.monotonic() - begin
            records = node.finished_jobs()[before:]
            held = sum(seconds_of(record) * int(record["ProcCnt"]) for record in records) / runs
            files = list(project.glob("results/small/benchmarks/runs/**/*.jsonl"))
            script = sum(json.loads(file.read_text().splitlines()[0])["s"] for file in files) / runs
            held = f"{held:.1f} s" if records else ""
            print(f"| {way} | {len(records) or ''} | {wall:.0f} s | {held} | {script:.1f} s |", flush=True)


if __name__ == "__main__":
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before the start")
    measure(int(sys.argv[1]) if len(sys.argv) > 1 else 24)
