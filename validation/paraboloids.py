"""The paraboloids of the summits as a surface, and the shape of summits beyond their paraboloids."""

import numpy as np
import scipy.fft
import scipy.ndimage

from icha.surfaces.square import periodic_difference
from icha.surfaces.summits import Asperities
from icha.surfaces.surface import Surface


def summit_curvatures(surface: Surface, summits: Asperities) -> np.ndarray:
    """Return the second derivatives xx, xy, yy of the heights at the summits, (n, 3), 1/m, from the spectrum."""
    return np.stack(_derivatives(surface, summits.position, ((2, 0), (1, 1), (0, 2))), axis=1)


def circular_curvatures(summits: Asperities) -> np.ndarray:
    """Return the second derivatives of paraboloids of revolution, (n, 3), 1/m."""
    curvature = -1 / summits.radius_of_curvature
    return np.stack([curvature, np.zeros(len(summits)), curvature], axis=1)


def fourth_order_terms(surface: Surface, position: np.ndarray) -> np.ndarray:
    """Return b of the mean profile h0 - r^2/(2R) + b r^4 around summits, their bi-Laplacian over 64, (n,), m^-3."""
    xxxx, xxyy, yyyy = _derivatives(surface, position, ((4, 0), (2, 2), (0, 4)))
    return (xxxx + 2 * xxyy + yyyy) / 64


def _derivatives(surface, position, orders):
    """Return derivatives of the heights at positions (n, 2), of orders (along x, along y) whose sum is even."""
    modes = scipy.fft.rfft2(surface.heights)
    n, unit = surface.grid, 2 * np.pi / surface.period
    ky, kx = scipy.fft.fftfreq(n, 1 / n)[:, None] * unit, np.arange(n // 2 + 1) * unit
    found = []
    for along_x, along_y in orders:
        sign = (-1.0) ** ((along_x + along_y) // 2)
        at_nodes = scipy.fft.irfft2(sign * kx**along_x * ky**along_y * modes, s=(n, n))
        # A quintic spline between the nodes.
        found.append(
            scipy.ndimage.map_coordinates(at_nodes, position.T[::-1] / surface.spacing, order=5, mode="grid-wrap")
        )
    return found


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
