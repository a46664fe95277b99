"""Make `synthetic_scan.txt`, a computed topography that examples and tests use like a measured scan.

The scan has typical defects of measurements: it is neither periodic nor square, it is tilted and curved, it has a
scratch, and some points are missing. `python config/topographies/make_synthetic_scan.py` always writes the same bytes.
"""

from pathlib import Path

import numpy as np

from icha.support.atomic_files import whole_file
from icha.surfaces.spectrum import SelfAffineSpectrum

ROWS, COLUMNS, PIXEL = 128, 144, 0.5e-6
HEADING = """\
# Synthetic scan, made by make_synthetic_scan.py; not a measurement.
# Heights in nm, one row of 144 points along x per line, 128 rows along y; 72 um x 64 um; nan: no height.
"""


def scan() -> np.ndarray:
    """Return the heights (ROWS, COLUMNS) of the scan, m; nan at missing points."""
    spectrum = SelfAffineSpectrum(
        period=256 * PIXEL, rolloff_wavelength=32e-6, short_wavelength=4e-6, hurst=0.8, rms_slope=0.15
    )
    heights = spectrum.realise(256, seed=6, amplitudes="gaussian").heights[40 : 40 + ROWS, 90 : 90 + COLUMNS]
    y, x = np.mgrid[:ROWS, :COLUMNS] * PIXEL
    tilt = 0.02 * x - 0.012 * y
    bow = -200.0 * ((x - 30e-6) ** 2 + (y - 36e-6) ** 2)
    across = (x * np.sin(0.4) + y * np.cos(0.4) - 50e-6) / 1.5e-6
    heights = heights + tilt + bow - 0.4e-6 * np.exp(-0.5 * across**2)
    missing = np.random.Generator(np.random.PCG64(60)).random((12, 2)) * (ROWS, COLUMNS)
    for row, column in missing:
        heights[np.hypot(y / PIXEL - row, x / PIXEL - column) < 2.2] = np.nan
    return heights


def write(path: Path) -> None:
    """Write the scan to a text file, with heights rounded to 0.1 nm."""
    lines = (" ".join("nan" if np.isnan(h) else f"{h * 1e9:.1f}" for h in row) for row in scan())
    with whole_file(path) as temporary:
        temporary.write_text(HEADING + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write(Path(__file__).with_name("synthetic_scan.txt"))
