"""The paraboloids of the summits as a surface."""

import numpy as np
import scipy.fft
import scipy.ndimage

from icha.surfaces.square import periodic_difference
from icha.surfaces.summits import Asperities
from icha.surfaces.surface import Surface


def summit_curvatures(surface: Surface, summits: Asperities) -> np.ndarray:
    """Return the second derivatives xx, xy, yy of the heights at the summits, (n, 3), 1/m, from the spectrum."""
    return np.stack(
        [_at(summits, derivative) for derivative in _derivatives(surface, ((2, 0), (1, 1), (0, 2)))], axis=1
    )


def circular_curvatures(summits: Asperities) -> np.ndarray:
    """Return the second derivatives of paraboloids of revolution, (n, 3), 1/m."""
    curvature = -1 / summits.radius_of_curvature
    return np.stack([curvature, np.zeros(len(summits)), curvature], axis=1)


def _derivatives(surface, orders):
    """Yield derivatives of the heights at the nodes, of orders (along x, along y) whose sum is even."""
    modes = scipy.fft.rfft2(surface.heights)
    n, unit = surface.grid, 2 * np.pi / surface.period
    ky, kx = scipy.fft.fftfreq(n, 1 / n)[:, None] * unit, np.arange(n // 2 + 1) * unit
    for along_x, along_y in orders:
        sign = (-1.0) ** ((along_x + along_y) // 2)
        yield scipy.fft.irfft2(sign * kx**along_x * ky**along_y * modes, s=(n, n))


def _at(summits, field):
    """Return a periodic field (n, n) at the summits, by a quintic spline."""
    spacing = summits.period / len(field)
    return scipy.ndimage.map_coordinates(field, summits.position.T[::-1] / spacing, order=5, mode="grid-wrap")


def paraboloids(summits: Asperities, curvatures: np.ndarray, grid: int) -> np.ndarray:
    """Return the upper envelope (grid, grid) of paraboloids with given curvatures (n, 3), m.

    Only the nearest image of each paraboloid counts.
    """
    x = np.arange(grid) * (summits.period / grid)
    xx, xy, yy = curvatures.T
    dx = periodic_difference(x[:, None], summits.position[:, 0], summits.period)
    along_x = summits.height + 0.5 * xx * dx**2
    oblique = xy * dx
    heights = np.empty((grid, grid))
    for row, y in enumerate(x):
        dy = periodic_difference(y, summits.position[:, 1], summits.period)
        heights[row] = np.max(along_x + (oblique + 0.5 * yy * dy) * dy, axis=1)
    return heights
