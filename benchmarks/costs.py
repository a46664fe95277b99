"""Predicted over measured: processor time, memory and disk by `icha.planning.costs` against small cases, one at a time.

python benchmarks/costs.py [--quick]

The formulas were fitted to cases like those of the group `fitted`; surfaces, seeds and loads of the group `others` were
not looked at then. Every case is a fork of this process, which has everything imported, on one thread; what starting a
process takes is taken off the prediction. Linux only. Writes benchmarks/results/costs.json.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"

import argparse
import json
import math
import resource
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import icha
from icha.asperity.cohesive_zone import shortest_range
from icha.contact.models import ASPERITIES, BOUNDARY_ELEMENTS
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import write_surface
from icha.planning import costs
from icha.references.error_sources.variants import error_sources
from icha.references.finite_range import finite_range_solution
from icha.references.finite_range_loops import finite_range_loop
from icha.simulation import simulate

RESULT = Path(__file__).parent / "results/costs.json"
PERIOD, RANGE = 100e-6, 2.071e-9
HARD, SOFT = (25e6, 0.0, RANGE), (25e6, 0.05, RANGE)
PDMS, STICKY = (0.24e6, 2e-3, RANGE), (0.24e6, 8e-3, RANGE)


def spectrum(grid, hurst=0.8, rolloff=PERIOD / 5, cells=8):
    return icha.SelfAffineSpectrum(PERIOD, rolloff, PERIOD / grid * cells, hurst)


def surface(grid):
    def work(file):
        write_surface(file, spectrum(grid).realise(grid, 1), name="rough", seed=1)

    return f"surface {grid}²", costs.surface_cost(grid), work


def sweep(grid, material, pressures, slope=1.0, seed=1, unload=False, model=ASPERITIES, **shape):
    form = spectrum(grid, **shape)
    path = icha.Path(reduced_pressures=list(pressures), unload=unload)
    described = costs.Sweep(len(pressures), 1, pressures[-1], material[1] > 0, int(unload), path.max_step)
    summits = costs.self_affine_summits(PERIOD, form.rolloff_wavelength, form.short_wavelength, form.hurst)

    def work(file):
        scaled = form.realise(grid, seed).scaled_to_rms_slope(slope)
        write_dataset(simulate(scaled, icha.Material(*material), path, model=model, seed=seed), file)

    ways = "both ways" if unload else "loading"
    about = "".join(f", {name} {value:g}" for name, value in shape.items())
    adhesion = "adhesive" if material[1] else "bare"
    title = f"{ways} {grid}², {adhesion}, {len(pressures)} stops to p* = {pressures[-1]:.3g}, slope {slope:g}{about}"
    if model == BOUNDARY_ELEMENTS:
        return f"boundary elements {title}", costs.patch_cost(grid, summits, described), work
    return title, costs.sweep_cost(grid, summits, described), work


def solution(grid, refinement, pressure, adhesive, hurst=0.8):
    nodes = grid * refinement
    material = _resolved(nodes) if adhesive else HARD

    def work(file):
        rough = spectrum(grid, hurst=hurst).realise(grid, 1)
        write_dataset(finite_range_solution(rough, icha.Material(*material), pressure, refinement=refinement), file)

    title = f"finite range {nodes}², {'adhesive' if adhesive else 'bare'}, p* = {pressure:g}"
    return title, costs.solution_cost(nodes, pressure, adhesive=adhesive), work


def loop(grid, refinement, step, adhesive=True):
    nodes = grid * refinement
    material = _resolved(nodes) if adhesive else HARD

    def work(file):
        rough = spectrum(grid, rolloff=PERIOD).realise(grid, 1).scaled_to_rms_slope(0.3)
        settings = {"largest_reduced_pressure": 0.01, "separation_step": step, "refinement": refinement}
        write_dataset(finite_range_loop(rough, icha.Material(*material), tolerance=1e-6, **settings), file)

    return f"finite range both ways {nodes}², steps {step}", costs.loop_cost(nodes, step, adhesive=adhesive), work


def sources(grid, pressures):
    def work(file):
        write_dataset(error_sources(spectrum(grid).realise(grid, 1), icha.Material(*HARD), pressures), file)

    return (
        f"error sources {2 * grid}², {len(pressures)} loads",
        costs.sources_cost(2 * grid, pressures, adhesive=False),
        work,
    )


def _resolved(nodes):
    return 25e6, 0.05, 1.02 * shortest_range(icha.Material(*SOFT), PERIOD / nodes)


def cases(quick):
    some, many = np.geomspace(1e-3, 3e-2, 4), np.geomspace(5e-4, 8e-2, 20)
    fitted = [
        *(surface(grid) for grid in (64, 512, 2048)),
        *(sweep(grid, HARD, many) for grid in (128, 512)),
        sweep(256, SOFT, some),
        sweep(64, PDMS, some, unload=True),
        sweep(128, STICKY, some, slope=0.5, unload=True),
        solution(128, 2, 0.01, False),
        solution(128, 1, 0.01, True),
        *(sweep(grid, material, many, model=BOUNDARY_ELEMENTS) for grid in (64, 256) for material in (HARD, SOFT)),
        sweep(64, PDMS, some, unload=True, model=BOUNDARY_ELEMENTS),
    ]
    others = [
        surface(1280),
        sweep(160, SOFT, some, seed=21, slope=0.7, hurst=0.4),
        sweep(320, PDMS, many, seed=22, slope=0.6, hurst=0.9, rolloff=PERIOD / 4),
        sweep(448, HARD, [2e-4, 5e-3], seed=23, hurst=0.6, rolloff=PERIOD / 6),
        sweep(80, STICKY, [5e-3, 4e-2], seed=24, slope=1.2, unload=True, hurst=0.7),
        sweep(160, SOFT, [6e-3], seed=25, slope=0.8, unload=True, rolloff=PERIOD / 4),
        sweep(128, HARD, [2e-2], seed=26, unload=True, hurst=0.4),
        solution(80, 2, 0.02, False, hurst=0.6),
        solution(160, 1, 5e-3, True, hurst=0.6),
        sweep(160, SOFT, some, seed=21, slope=0.7, hurst=0.4, model=BOUNDARY_ELEMENTS),
        sweep(320, HARD, [2e-4, 5e-3], seed=23, hurst=0.6, rolloff=PERIOD / 6, model=BOUNDARY_ELEMENTS),
        sweep(80, SOFT, [2e-2], seed=24, slope=1.2, unload=True, hurst=0.7, model=BOUNDARY_ELEMENTS),
        sweep(96, HARD, [2e-2], seed=26, unload=True, hurst=0.4, model=BOUNDARY_ELEMENTS),
        loop(24, 4, 0.25),
        sources(80, [2e-3, 2e-2]),
    ]
    if not quick:
        fitted += [
            sweep(1024, SOFT, many),
            sweep(256, SOFT, some, slope=0.5, unload=True),
            solution(256, 2, 0.1, False),
        ]
        others += [
            sweep(896, PDMS, some, seed=27, slope=0.9, hurst=0.7, rolloff=PERIOD / 3),
            sweep(224, PDMS, [2e-2], seed=28, slope=0.6, unload=True, rolloff=PERIOD / 5),
            solution(224, 2, 2e-2, True),
        ]
    return [("fitted", case) for case in fitted] + [("others", case) for case in others]


def measured(work, folder):
    """Processor time (s), peak memory and size of the file (bytes) of `work` in a fork of this process."""
    file = folder / "out.nc"
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        start, said = time.process_time(), {}
        try:
            work(file)
        except Exception as error:
            said["failure"] = f"{type(error).__name__}: {error}"
        said["seconds"] = time.process_time() - start
        said["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        os.write(writing, json.dumps(said).encode())
        os._exit(0)
    os.close(writing)
    with open(reading) as pipe:
        found = json.load(pipe)
    os.waitpid(child, 0)
    if file.exists():
        found["disk"] = file.stat().st_size
        file.unlink()
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="leave out what takes more than ten seconds")
    rows, results = [], []
    print(f"{'case':<78} {'predicted':>9} {'measured':>9}   time memory  disk", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        # What is imported late is imported now.
        surface(64)[2](Path(folder, "first.nc"))
        sweep(64, HARD, [1e-3, 1e-2])[2](Path(folder, "second.nc"))
        solution(64, 2, 0.01, True)[2](Path(folder, "third.nc"))
        for group, (title, cost, work) in cases(parser.parse_args().quick):
            found = measured(work, Path(folder))
            row = {"group": group, "case": title} | found
            if "disk" in found and "failure" not in found:
                expected = max(cost.seconds - costs.JOB_SECONDS, 0.01)
                row["ratios"] = {
                    "time": expected / max(found["seconds"], 0.01),
                    "memory": cost.memory / found["memory"],
                    "disk": cost.disk / found["disk"],
                }
                rows.append(row)
                ratios = " ".join(f"{ratio:6.2f}" for ratio in row["ratios"].values())
                print(f"{title:<78} {expected:>8.2f}s {found['seconds']:>8.2f}s {ratios}", flush=True)
            else:
                print(f"{title:<78} failed: {found.get('failure', 'no file')}", flush=True)
            results.append(row)
    for group in ("fitted", "others"):
        for name in ("time", "memory", "disk"):
            logs = [math.log2(row["ratios"][name]) for row in rows if row["group"] == group]
            spread = statistics.fmean(abs(value) for value in logs)
            within = sum(abs(value) <= 1 for value in logs)
            print(
                f"{group}, {name}: median {2 ** statistics.median(logs):.2f}, off by a factor of "
                f"{2**spread:.2f} on average, {within} of {len(logs)} within a factor of two"
            )
    RESULT.write_text(json.dumps({"cases": results}, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
