"""Pixels of a scan that are not square, resampled to square cells."""

import numpy as np
import scipy.fft

from icha.support import in_words
from icha.surfaces.measured.scan import Scan
from icha.surfaces.measured.settings import Preparation
from icha.surfaces.surface import PERIODIC

# Relative difference of the two sides of a pixel that counts as square.
SQUARE = 1e-3


def squared(scan: Scan, how: Preparation) -> tuple[Scan, list[str]]:
    """On square cells as large as the shorter side of a pixel.

    Lines along that side stay as they are. Across them, heights are those of their cosine series, which is
    band-limited: it keeps all measured waves, hence their rms slope, and adds none that is shorter than two pixels.
    Periodic scans are resampled by their Fourier series, when they get their grid (`icha.surfaces.measured.edges`).
    """
    dx, dy = scan.pixel
    if how.boundary == PERIODIC or abs(dx / dy - 1) <= SQUARE:
        return scan, []
    across, cell = (0, dx) if dx < dy else (1, dy)
    grid = int(min(scan.size) / cell * (1 + 1e-9))
    lines = np.take(scan.heights, range(grid), axis=1 - across)
    heights = _by_cosine_series(lines, across, cell / max(dx, dy), grid)
    pixel = " x ".join(map(in_words.length, (dx, dy)))
    said = f"pixels of {pixel} resampled to {grid} x {grid} square ones, by the cosine series along {'yx'[across]}"
    return Scan(heights, (grid * cell, grid * cell)), [said]


def _by_cosine_series(heights, axis, step, count):
    """Heights in the middle of `count` cells, `step` old ones wide, along an axis."""
    # Slow to import, and seldom needed.
    from scipy.signal import czt

    n = heights.shape[axis]
    series = np.moveaxis(scipy.fft.dct(heights, axis=axis, norm="forward", workers=1), axis, 0)
    series[1:] *= 2
    # sum_k series_k cos(pi k y/n) at y = step (j + 1/2): a chirp z-transform.
    turn = 1j * np.pi * step / n
    return np.moveaxis(czt(series, count, w=np.exp(turn), a=np.exp(-turn / 2), axis=0).real, 0, axis)
