"""Edges of a scan as its boundary has them (a window, mirror images), and the grid that is asked for."""

import numpy as np
import scipy.fft

from icha.support.input_files import TooLarge, require_room
from icha.surfaces.heights import flaw_of_heights
from icha.surfaces.measured.scan import Scan
from icha.surfaces.measured.settings import MIRROR, WINDOW, Preparation, UnfitTopography
from icha.surfaces.surface import FREE, PERIODIC, Surface


def bounded(scan: Scan, how: Preparation) -> tuple[Surface, list[str]]:
    """The surface with edges as its boundary has them, on the grid that is asked for."""
    _require_room_for(how.grid or (2 if how.boundary == MIRROR else 1) * max(scan.heights.shape))
    heights, side = scan.heights - np.mean(scan.heights), scan.size[0]
    said = []
    if how.boundary == WINDOW:
        across, along = (_taper(n, how.taper) for n in heights.shape)
        heights = heights * across[:, None] * along
        said.append(f"heights fall to their mean on {how.taper:g} of the side at every edge")
    if how.boundary == MIRROR:
        heights = np.concatenate([heights, heights[:, ::-1]], axis=1)
        heights = np.concatenate([heights, heights[::-1]], axis=0)
        side = 2 * side
        said.append("joined by its mirror images")
    # Only periodic pixels can still be oblong.
    grid = how.grid or max(heights.shape)
    if heights.shape != (grid, grid):
        heights = _resampled(heights, grid, free=how.boundary == FREE)
        said.append(f"resampled to {grid} x {grid} points")
    if flaw := flaw_of_heights(heights):
        raise UnfitTopography("path", f"holds {flaw}; allowed: a rough surface")
    free = how.boundary == FREE
    said.append("one square on a free half-space" if free else f"repeats after {side:.6g} m")
    try:
        return Surface(heights, side, FREE if free else PERIODIC), said
    except ValueError as error:  # heights out of any range, over the side
        raise UnfitTopography(
            "height_unit", f"gives a surface that cannot be pressed ({error}); allowed: another"
        ) from None


def _require_room_for(grid):
    """Refuse a grid that takes more memory than a surface from a file may; heights are copied as they are resampled."""
    try:
        require_room(3 * 8 * grid**2)
    except TooLarge as error:
        raise UnfitTopography("grid", f"gives a surface of {grid} x {grid} points, which {error}") from None


def _taper(n, part):
    """Tukey's window at n points, cell by cell: a cosine's half wave at either edge and one in between."""
    x = (np.arange(n) + 0.5) / n
    edge = np.minimum(np.minimum(x, 1 - x) / part, 1.0)
    return np.sin(0.5 * np.pi * edge) ** 2


def _resampled(heights, grid, *, free):
    """The same heights on grid x grid points: by their Fourier series, or, of a free square, by their cosine series."""
    # Slow to import, and seldom needed.
    from scipy.signal import resample

    for axis in (0, 1):
        n = heights.shape[axis]
        if n == grid:
            continue
        if not free:
            heights = resample(heights, grid, axis=axis)
            continue
        series = np.moveaxis(scipy.fft.dct(heights, axis=axis, norm="forward", workers=1), axis, 0)[:grid]
        padded = np.zeros((grid, series.shape[1]))
        padded[: len(series)] = series
        heights = np.moveaxis(scipy.fft.idct(padded, axis=0, norm="forward", workers=1), 0, axis)
    return heights
