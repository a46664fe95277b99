"""Run the benchmarks one process at a time and save the measurements in benchmarks/results. Standard library only.

On Linux a process inherits the peak memory of its parent, so this process must stay small.

python benchmarks/run.py [--only CODE ...] [--grids N ...] [--threads N] [--limit SECONDS]
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import threading
import time
from importlib.metadata import version
from pathlib import Path

HERE = Path(__file__).resolve().parent
RESULTS, CODES_FOLDER = HERE / "results", HERE / "codes"
OTHERS = HERE.parent / ".venv-benchmarks" / "bin" / "python"
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
PACKAGES = ("icha", "numpy", "scipy", "finufft")

# Code, threads, adhesion, and the given quantity at the stops. ICHA comes first, because its path gives the mean gaps.
SWEEPS = (
    ("icha", 1, False, "load"),
    ("icha", 1, True, "load"),
    ("icha", 1, True, "gap"),
    ("icha-boundary-elements", 1, False, "load"),
    ("icha-boundary-elements", 1, True, "load"),
    ("aspher", 1, False, "load"),
    ("aspher", 2, False, "load"),
    ("tamaas", 1, False, "load"),
    ("tamaas", 2, False, "load"),
    ("contactmechanics", 1, False, "load"),
    ("adhesion", 1, True, "load"),
    ("tamaas", 1, True, "gap"),
    ("tamaas", 2, True, "gap"),
)
CODES = tuple(dict.fromkeys(code for code, *_ in SWEEPS))


def measure(command: list[str], threads: int, limit: float) -> dict:
    """Run a command, kill it after `limit` seconds; return times (s), peak memory (bytes) and outcome."""
    environment = os.environ | dict.fromkeys(THREADS, str(threads)) | {"OMP_WAIT_POLICY": "passive"}
    start = time.perf_counter()
    output = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen(command, env=environment, **output)
    lines: list[str] = []
    reader = threading.Thread(target=lambda: lines.extend(process.stderr))
    reader.start()
    alarm = threading.Timer(limit, process.kill)
    alarm.start()
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    alarm.cancel()
    process.returncode = os.waitstatus_to_exitcode(status)
    reader.join()
    outcome = "complete" if process.returncode == 0 else "over time" if wall >= limit else "failed"
    last_words = "".join(lines[-1:]).strip() if outcome == "failed" else ""
    spent = {"wall": wall, "processor": usage.ru_utime + usage.ru_stime, "peak": usage.ru_maxrss * 1024}
    return spent | {"outcome": outcome, "last_words": last_words}


def save(name: str, record: dict) -> None:
    """Write a result."""
    (RESULTS / f"{name}.json").write_text(json.dumps(record, indent=1) + "\n")


def run(name: str, command: list[str], answer: Path, threads: int, limit: float, about: dict) -> dict:
    """Measure a command that writes its answer to a file, and save both."""
    print(f"{name} ...", end=" ", flush=True)
    measured = measure([*command, str(answer), str(threads)], threads, limit)
    found = json.loads(answer.read_text()) if answer.exists() else {}
    about = about | {"threads": threads, "limit": limit, "machine": machine()["processor"]}
    record = about | measured | found
    save(name, record)
    times = f"{measured['wall']:.1f} s ({measured['processor']:.1f} s of processor)"
    print(measured["outcome"], times, f"{measured['peak'] / 2**20:.0f} MiB", measured["last_words"], flush=True)
    return record


def sweep(scratch: Path, grid: int, codes: set[str], most_threads: int, limit: float) -> None:
    """Measure one sweep of 20 stops on the same heights with every code."""
    folder = scratch / f"sweep-{grid}"
    folder.mkdir()
    subprocess.run([sys.executable, CODES_FOLDER / "make_task.py", folder, str(grid)], check=True)
    task = json.loads((folder / "task.json").read_text())
    saved = RESULTS / f"task-{grid}.json"
    gaps = json.loads(saved.read_text())["mean_gaps"] if saved.exists() else None
    for code, threads, adhesion, control in SWEEPS:
        if code not in codes or threads > most_threads:
            continue
        settings = task if adhesion else task | {"surface_energy": 0.0}
        if control == "gap":
            if gaps is None:
                raise SystemExit(f"no mean gaps for grid {grid}; run first with --only icha")
            settings = settings | {"mean_gaps": gaps}
        (folder / "task.json").write_text(json.dumps(settings))
        name = f"sweep-{code}-{'adhesion' if adhesion else 'hard'}-{control}-{grid}-{threads}"
        about = {"code": code, "grid": grid, "adhesion": adhesion, "control": control}
        if code.startswith("icha"):
            command = [sys.executable, str(CODES_FOLDER / "solve_icha.py"), code, str(folder)]
        else:
            command = [str(OTHERS), str(CODES_FOLDER / f"solve_{code}.py"), str(folder)]
        record = run(name, command, folder / f"{name}.json", threads, limit, about)
        if (code, adhesion, control) == ("icha", True, "load") and (gaps is None or codes == set(CODES)):
            # Saved, so that one code can be measured again at the same stops.
            gaps = [float(f"{stop['mean_gap']:.6g}") for stop in record["stops"]]
            save(saved.stem, task | {"mean_gaps": gaps})


def machine() -> dict:
    """Return the machine and the versions of packages, without names."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": models[0] if models else platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "memory": os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"),
        "system": platform.system(),
        "python": platform.python_version(),
        "versions": {name: version(name) for name in PACKAGES},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=CODES, default=CODES, metavar="CODE", help=", ".join(CODES))
    parser.add_argument("--grids", nargs="+", type=int, default=[256, 512, 1024])
    parser.add_argument("--threads", type=int, default=2, help="leave out sweeps with more threads than this")
    parser.add_argument("--limit", type=float, default=1200.0, help="seconds that one process may take")
    options = parser.parse_args()
    save("machine", machine())
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        for grid in options.grids:
            sweep(scratch, grid, set(options.only), options.threads, options.limit)


if __name__ == "__main__":
    main()
