"""Surfaces whose contact is known in closed form, on a grid."""

import numpy as np

from icha.surfaces.surface import Surface

# Flat faces need a summit without effect on the contact: punches are domes of this height over their radius, and waves
# that are infinite along y have a wave along y of the second fraction of their height.
_DOME = 1e-9
_ALONG = 2e-5


def _from_centre(grid, spacing, centre):
    """Return the shortest offsets (n, 1) and (1, n) of all nodes from a centre (x, y) in cells, along y and x, m."""
    x, y = ((np.arange(grid) - place + grid / 2) % grid - grid / 2 for place in centre)
    return y[:, None] * spacing, x[None, :] * spacing


def paraboloid(grid: int, period: float, offset: float = 0.0) -> Surface:
    """Return a paraboloid of radius 1 m in a periodic cell of side `period` (m); `offset` from a node in cells."""
    x = (np.arange(grid) - grid // 2 - offset) * (period / grid)
    return Surface(-(x[:, None] ** 2 + x**2) / 2, period)


def bump(
    grid: int, period: float, offset=(0.0, 0.0), radii_of_curvature=(1.0, 1.0), angle: float = 0.0
) -> tuple[Surface, float]:
    """Return an elliptic paraboloid in a cell, and the height of its summit, m.

    Parameters
    ----------
    offset : (x, y) of its summit from a node near the middle of the cell, in cells.
    radii_of_curvature : m, along the axes, which are turned by `angle`, rad.
    """
    y, x = _from_centre(grid, period / grid, (grid // 2 + offset[0], grid // 2 + offset[1]))
    along, across = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
    heights = -(along**2) / (2 * radii_of_curvature[0]) - across**2 / (2 * radii_of_curvature[1])
    return Surface(heights, period), float(-heights.mean())


def two_bumps(grid: int, period: float, distance: float) -> tuple[Surface, float]:
    """Return the upper envelope of two paraboloids of radius 1 m along x, and the height of their summits, m."""
    half = distance / (2 * period / grid)
    heights = []
    for side in (-half, half):
        y, x = _from_centre(grid, period / grid, (grid // 2 + side, grid // 2))
        heights.append(-(x**2 + y**2) / 2)
    envelope = np.maximum(*heights)
    return Surface(envelope, period), float(-envelope.mean())


def punch(grid: int, period: float, radius: float, depth: float, square: bool = False) -> tuple[Surface, np.ndarray]:
    """Return a flat punch, round or square with sides of twice the radius, and its face, (n, n) of bool.

    The rest lies lower by `depth` (m). The centre is the middle between four nodes.
    """
    y, x = _from_centre(grid, period / grid, (grid / 2 - 0.5,) * 2)
    face = (np.maximum(np.abs(x), np.abs(y)) if square else np.hypot(x, y)) < radius
    dome = _DOME * (radius**2 - x**2 - y**2) / radius
    return Surface(np.where(face, dome, -depth), period), face


def wave(grid: int, period: float, amplitude: float, dimensions: int = 1) -> Surface:
    """Return amplitude cos(2 pi x/L), or its mean with the same along y, with a crest in the middle of the cell."""
    along = np.cos(2 * np.pi * (np.arange(grid) - grid // 2) / grid)
    other = 1.0 if dimensions == 2 else _ALONG
    return Surface(amplitude * (along + other * along[:, None]) / (1 + other), period)
