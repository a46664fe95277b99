"""Make run files of a campaign: one small run after the other by name, with spots of different number.

python make_runs.py FOLDER COUNT
"""

import sys
from pathlib import Path

import numpy as np

import icha
from icha.datasets.files import write_dataset
from icha.datasets.labels import RunLabels

MATERIALS = {"soft": icha.Material(25e6, 0.05, 2.071e-9), "hertz": icha.Material(25e6, 0.0, 2.071e-9)}
SLOPES = (0.5, 1.0)


def labels(count: int) -> list[RunLabels]:
    """Of every seed four runs: two slopes, two materials."""
    return [
        RunLabels("many", "asperities", "rough", 1 + k // 4, SLOPES[k // 2 % 2], list(MATERIALS)[k % 2])
        for k in range(count)
    ]


def main() -> None:
    """Simulate each contact once, and write it under the name of every seed with a few spots less or more."""
    folder, count = Path(sys.argv[1]), int(sys.argv[2])
    spectrum = icha.SelfAffineSpectrum(100e-6, 40e-6, 100e-6 / 7, 0.8)
    loads = np.geomspace(1e-3, 3e-2, 15).tolist()
    path = icha.Path(reduced_pressures=loads, snapshots=[("reduced_pressure", loads[k]) for k in (4, 9, 14)])
    surface = spectrum.realise(grid=32, seed=1)
    runs = {
        (slope, name): icha.simulate(surface.scaled_to_rms_slope(slope), material, path)
        for slope in SLOPES
        for name, material in MATERIALS.items()
    }
    random = np.random.default_rng(0)
    for each in labels(count):
        run = runs[each.rms_slope, each.material].copy()
        spots = np.sort(random.integers(0, run.sizes["spot"], random.integers(0, 100)))
        run = run.isel(spot=spots)
        run["seed"] = run["seed"].copy(data=each.seed)
        write_dataset(run, folder / f"{each}.nc")


if __name__ == "__main__":
    main()
