"""Asperities of patches of the challenge's spectrum, from which the surfaces of the scaling are put together."""

import sys
from pathlib import Path

import numpy as np

import icha
from icha.surfaces.summits import find_summits

GRID, CELLS_PER_SHORT_WAVE, SEEDS = 512, 8, 16


def main(folder):
    spectrum = icha.SelfAffineSpectrum(100e-6, 20e-6, 100e-6 / GRID * CELLS_PER_SHORT_WAVE, 0.8, 1.0)
    for seed in range(SEEDS):
        surface = spectrum.realise(GRID, seed)
        found = find_summits(surface)
        np.savez(
            folder / f"patch{seed}.npz",
            position=found.position,
            height=found.height,
            radius=found.radius_of_curvature,
            period=found.period,
            rms_height=surface.rms_height,
            rms_slope=surface.rms_slope,
        )


main(Path(sys.argv[1]))
