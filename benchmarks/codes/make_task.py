"""Make the heights of one grid and print what else the codes need to know (see task.py)."""

import json
import sys
from pathlib import Path

import numpy as np

import icha

PERIOD, ROLLOFF, HURST, RMS_SLOPE, SEED = 100e-6, 20e-6, 0.8, 1.0, 1
CELLS_PER_SHORT_WAVE = 8
MODULUS, SURFACE_ENERGY = 25e6, 0.05
REDUCED_PRESSURES = np.geomspace(5e-4, 8e-2, 20)


def range_resolved(spacing):
    """The shortest range of an exponential attraction that a grid resolves, in m.

    Sanner's rule from contacts of spheres, spacing <= 8 rho^2 E*/(3 pi gamma), and that of Wang, Zhou & Mueser
    (Lubricants 9 (2021) 17, eq. 9), sqrt(gamma spacing/E*)/rho < 0.5; 2 per cent more than the longer of the two.
    """
    length = SURFACE_ENERGY / MODULUS
    return 1.02 * max(np.sqrt(3 * np.pi / 8 * length * spacing), 2 * np.sqrt(length * spacing))


def main(folder, grid):
    spectrum = icha.SelfAffineSpectrum(PERIOD, ROLLOFF, PERIOD / grid * CELLS_PER_SHORT_WAVE, HURST, RMS_SLOPE)
    surface = spectrum.realise(grid, SEED)
    np.save(folder / "heights.npy", surface.heights)
    interaction_range = range_resolved(surface.spacing)
    settings = {
        "grid": grid,
        "period": PERIOD,
        "rolloff_wavelength": ROLLOFF,
        "short_wavelength": spectrum.short_wavelength,
        "hurst": HURST,
        "seed": SEED,
        "rms_slope": surface.rms_slope,
        "rms_height": surface.rms_height,
        "contact_modulus": MODULUS,
        "surface_energy": SURFACE_ENERGY,
        "interaction_range": interaction_range,
        "tabor_parameter": np.cbrt((SURFACE_ENERGY / MODULUS) ** 2 / surface.rms_curvature) / interaction_range,
        "pressures": list(REDUCED_PRESSURES * MODULUS * surface.rms_slope),
    }
    plain = {name: value if isinstance(value, int | list) else float(value) for name, value in settings.items()}
    (folder / "task.json").write_text(json.dumps(plain))


main(Path(sys.argv[1]), int(sys.argv[2]))
