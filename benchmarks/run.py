"""Run the benchmarks one process at a time and keep what they measured in benchmarks/results. Standard library only.

python benchmarks/run.py [--only CODE ...] [--parts PART ...] [--grids N ...] [--threads N] [--limit SECONDS]
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

from measure import Measurement, measure

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "results"
OTHERS = HERE.parent / ".venv-benchmarks" / "bin" / "python"
PACKAGES = ("icha", "numpy", "scipy", "finufft")

# Code, threads, whether with adhesion, and what is given at the stops. ICHA first: its path gives the mean gaps.
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
PARTS = ("sweep", "scaling", "stages", "campaigns", "start", "truth")
# Patches along a side of the surfaces of the scaling; a patch has some 470 spots at the end of the sweep.
PATCHES = (1, 2, 3, 5, 8, 15)


def interpreter(code: str) -> str:
    return sys.executable if code.startswith("icha") else str(OTHERS)


def script(name: str) -> str:
    return str(HERE / "codes" / f"{name}.py")


def keep(name: str, record: dict) -> None:
    """Write a result, whole or not at all."""
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.json"
    partial = path.with_suffix(".partial")
    partial.write_text(json.dumps(record, indent=1) + "\n")
    partial.replace(path)


def run(name: str, command: list[str], answer: Path, threads: int, limit: float, about: dict) -> dict:
    """Measure a command that writes its answer to a file, and keep both."""
    print(f"{name} ...", end=" ", flush=True)
    measured = measure([*command, str(answer), str(threads)], threads, limit)
    found = json.loads(answer.read_text()) if answer.exists() else {}
    about = about | {"threads": threads, "limit": limit, "machine": machine()["processor"]}
    record = about | asdict(measured) | found
    keep(name, record)
    spent = f"{measured.wall:.1f} s ({measured.processor:.1f} s of processor), {measured.peak / 2**20:.0f} MiB"
    print(f"{measured.outcome}, {spent}", measured.last_words, flush=True)
    return record


def sweep(scratch: Path, grid: int, codes: set[str], most_threads: int, limit: float) -> None:
    """One sweep of 20 stops on the same heights by every code."""
    folder = scratch / f"sweep-{grid}"
    folder.mkdir()
    subprocess.run([sys.executable, script("make_task"), folder, str(grid)], check=True)
    task = json.loads((folder / "task.json").read_text())
    saved = RESULTS / f"task-{grid}.json"
    gaps = json.loads(saved.read_text())["mean_gaps"] if saved.exists() else None
    for code, threads, adhesion, control in SWEEPS:
        if code not in codes or threads > most_threads:
            continue
        settings = task if adhesion else task | {"surface_energy": 0.0}
        if control == "gap":
            if gaps is None:
                raise SystemExit(f"no mean gaps for grid {grid}: run icha first")
            settings = settings | {"mean_gaps": gaps}
        (folder / "task.json").write_text(json.dumps(settings))
        name = f"sweep-{code}-{'adhesion' if adhesion else 'hard'}-{control}-{grid}-{threads}"
        about = {"code": code, "grid": grid, "adhesion": adhesion, "control": control}
        command = [interpreter(code), script(f"solve_{code.replace('-', '_')}"), str(folder)]
        record = run(name, command, folder / f"{name}.json", threads, limit, about)
        if (code, adhesion, control) == ("icha", True, "load") and (gaps is None or codes == set(CODES)):
            # Rounded, and kept, so that one code can be measured again at the same stops.
            gaps = [float(f"{stop['mean_gap']:.6g}") for stop in record["stops"]]
            keep(saved.stem, task | {"mean_gaps": gaps})


def scaling(scratch: Path, limit: float) -> None:
    """The contact solver alone against the number of spots."""
    folder = scratch / "scaling"
    folder.mkdir()
    subprocess.run([sys.executable, script("make_patches"), folder], check=True)
    for patches in PATCHES:
        for adhesion in (False, True):
            name = f"scaling-{'adhesion' if adhesion else 'hard'}-{patches}"
            command = [sys.executable, script("scale_icha"), str(folder), str(patches), "01"[adhesion]]
            run(name, command, folder / f"{name}.json", 1, limit, {"patches": patches, "adhesion": adhesion})


def stages(scratch: Path, limit: float) -> None:
    """Where time and memory go, on 512^2 and on the challenge's full surface."""
    cores = min(2, os.cpu_count())
    cases = [("512", adhesion, threads) for adhesion in (False, True) for threads in sorted({1, cores})]
    cases += [("challenge", adhesion, cores) for adhesion in (False, True)]
    for surface, adhesion, threads in cases:
        name = f"stages-{surface}-{'adhesion' if adhesion else 'hard'}-{threads}"
        command = [sys.executable, script("profile_icha"), surface, "01"[adhesion]]
        run(name, command, scratch / f"{name}.json", threads, limit, {"surface": surface, "adhesion": adhesion})


# Small runs, of 7 loads with adhesion, that differ in seed and surface energy.
CAMPAIGN = """
name: many
title: Many small runs
summary: A benchmark of the workflow.
license: CC-BY-4.0
surfaces:
  rough: {{kind: self_affine, period: 100 um, rolloff_wavelength: 50 um, short_wavelength: {short} um,
          hurst: 0.8, grid: {grid}}}
materials:
  soft: {{contact_modulus: 25 MPa, surface_energy: 50 mJ/m^2, interaction_range: 2 nm}}
studies:
  many:
    surfaces: [rough]
    seeds: 1..{seeds}
    rms_slopes: [1.0]
    materials: [soft]
    vary: {{surface_energy: [0 J/m^2, 5 mJ/m^2, 10 mJ/m^2, 20 mJ/m^2, 50 mJ/m^2]}}
    targets: {{reduced_pressures: [1.0e-3, 2.15e-3, 4.64e-3, 1.0e-2, 2.15e-2, 4.64e-2, 0.1]}}
figures:
  fig2_area_and_gap: {{study: many}}
"""


def campaigns(scratch: Path, limit: float) -> None:
    """The workflow itself: the plan of 10 000 runs, and 1 000 small runs of two sizes from surfaces to report."""
    cores = min(2, os.cpu_count())

    def snakemake(seeds: int, grid: int, *options: str) -> tuple[Path, Path, list[str]]:
        folder = scratch / f"campaign-{seeds}-{grid}"
        folder.mkdir()
        file = folder / "campaign.yaml"
        file.write_text(CAMPAIGN.format(seeds=seeds, grid=grid, short=800 / grid))
        command = [sys.executable, "-m", "snakemake", "--snakefile", str(HERE.parent / "Snakefile")]
        return (
            folder,
            file,
            [*command, "--directory", str(folder), "--configfile", str(file), "--quiet", "all", *options],
        )

    _, _, command = snakemake(2000, 128, "--dry-run")
    print("campaign-plan ...", end=" ", flush=True)
    planned = measure(command, cores, limit)
    keep("campaign-plan", {"runs": 10000} | asdict(planned))
    print(f"{planned.outcome}, {planned.wall:.1f} s, {planned.peak / 2**20:.0f} MiB", flush=True)

    for grid in (128, 256):
        name = f"campaign-runs-{grid}"
        folder, file, command = snakemake(200, grid, "--cores", str(cores))
        print(f"{name} ...", end=" ", flush=True)
        # The number of threads of a job is its rule's; Snakemake sets it.
        whole = measure(command, cores, limit)
        print(f"{whole.outcome}, {whole.wall:.1f} s", flush=True)
        if whole.outcome == "complete":
            sample = [sys.executable, script("solve_small"), str(file), str(folder / "results/many"), "100"]
            about = {"whole": asdict(whole), "cores": cores, "grid": grid}
            found = run(name, sample, folder / "sample.json", cores, limit, about)
            share = found["seconds_a_run"] * found["runs"] / (cores * whole.wall)
            print(f"{share:.0%} of {cores} x {whole.wall:.0f} s is the contact solver's", flush=True)


def start(scratch: Path, limit: float) -> None:
    """What people wait for before anything is computed, and the campaign that they see first, there and back."""
    cores = min(2, os.cpu_count())
    # As it is where people work: modules are compiled once.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    icha = str(Path(sys.executable).parent / "icha")
    results = scratch / "paper"
    results.mkdir()

    def least(name: str, *command: str, folder: Path = HERE.parent) -> Measurement:
        """The quickest of three calls."""
        print(f"{name} ...", end=" ", flush=True)
        found = min((measure(command, cores, limit, folder) for _ in range(3)), key=lambda each: each.processor)
        keep(name, {"repeats": 3} | asdict(found))
        print(f"{found.outcome}, {found.processor:.2f} s of processor, {found.wall:.2f} s", flush=True)
        return found

    least("start-help", icha, "--help")
    least("start-describe-paper", icha, "describe")
    # A project to write the template into.
    project = scratch / "project"
    for part in ("config", "workflow"):
        shutil.copytree(HERE.parent / part, project / part)
    shutil.copy(HERE.parent / "Snakefile", project)
    subprocess.run([icha, "new", "template"], cwd=project, check=True, stdout=subprocess.DEVNULL)
    least("start-describe-template", icha, "describe", "template", folder=project)
    answers = []
    for _ in range(3):
        answer = scratch / "first.json"
        subprocess.run([sys.executable, script("first_run"), str(answer), str(cores)], check=True)
        answers.append(json.loads(answer.read_text()))
    keep("start-simulate", {"repeats": 3} | min(answers, key=lambda each: each["overhead"]))
    print("campaign-paper ...", end=" ", flush=True)
    command = [icha, "run", "--directory", str(results), "--cores", str(cores), "--plain"]
    whole = measure(command, cores, limit, HERE.parent)
    keep("campaign-paper", {"cores": cores} | asdict(whole))
    print(f"{whole.outcome}, {whole.wall:.1f} s", flush=True)
    if whole.outcome == "complete":
        least("start-nothing-to-do", *command)
        run = next((results / "results/paper/runs").rglob("cmc.nc"))
        least("start-show", icha, "show", str(run))
        least("start-check", icha, "check", str(run))


def truth(scratch: Path) -> None:
    """The challenge's full surface by boundary elements: campaign cmc_truth, where it is not there already."""
    cores = min(2, os.cpu_count())
    print("truth ...", end=" ", flush=True)
    icha = [str(Path(sys.executable).parent / "icha"), "run", "config/campaigns/cmc_truth.yaml", "--plain"]
    subprocess.run([*icha, "--cores", str(cores)], cwd=HERE.parent, check=True, stdout=subprocess.DEVNULL)
    answer = scratch / "truth.json"
    subprocess.run([sys.executable, script("read_truth"), HERE.parent / "results/cmc_truth", answer], check=True)
    found = {"cores": cores} | json.loads(answer.read_text())
    keep("truth", found)
    print(f"{found['wall'] / 60:.0f} min, {found['peak'] / 2**30:.1f} GiB", flush=True)


def machine() -> dict:
    """What the numbers were taken on, without names."""
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
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS, metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--grids", nargs="+", type=int, default=[256, 512, 1024])
    parser.add_argument("--threads", type=int, default=2, help="leave out sweeps with more threads than this")
    parser.add_argument("--limit", type=float, default=1200.0, help="seconds that one process may take")
    options = parser.parse_args()
    keep("machine", machine())
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        if "sweep" in options.parts:
            for grid in options.grids:
                sweep(scratch, grid, set(options.only), options.threads, options.limit)
        if "icha" in options.only and "scaling" in options.parts:
            scaling(scratch, options.limit)
        if "icha" in options.only and "stages" in options.parts:
            stages(scratch, options.limit)
        if "icha" in options.only and "campaigns" in options.parts:
            campaigns(scratch, options.limit)
        if "icha" in options.only and "start" in options.parts:
            start(scratch, options.limit)
        if "icha" in options.only and "truth" in options.parts:
            truth(scratch)


if __name__ == "__main__":
    main()
