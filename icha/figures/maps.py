"""Maps of the nodes of a surface, and contact spots as circles of true size."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Largest number of cells a side that are distinguishable in a panel.
_MOST_CELLS = 1024


def draw_whole(axes, means: np.ndarray, n: int, side: float, **look):
    """Draw a periodic map of n nodes a side, or `average_blocks` of it.

    Nodes are the centres of the cells of the image. The first row and column are repeated at the opposite border.
    """
    drawn = np.pad(means, [(0, 1), (0, 1), (0, 0)][: means.ndim], mode="wrap")
    half = side / n / 2
    borders = (-half, side - half + side / (len(drawn) - 1))
    return axes.imshow(drawn, extent=borders * 2, interpolation="antialiased", **look)


def average_blocks(nodes: np.ndarray, most: int = _MOST_CELLS) -> np.ndarray:
    """Return means over blocks of nodes of nearly equal size, if there are more than `most` nodes a side."""
    count = min(len(nodes), most)
    if count == len(nodes):
        return nodes
    starts = np.arange(count) * len(nodes) // count
    width = np.diff(starts, append=len(nodes))
    sums = np.add.reduceat(np.add.reduceat(nodes, starts, axis=1), starts, axis=0)
    return (sums.T / np.outer(width, width)).T


def wrap_circles(x, y, radius, period: float, boundary: str) -> np.ndarray:
    """Return centre and radius, (m, 3), of circles and their periodic images that reach into [0, L)²."""
    steps = (-period, 0.0, period) if boundary == "periodic" else (0.0,)
    shifts = np.array([(dx, dy) for dx in steps for dy in steps])
    centres = np.column_stack([x, y])[:, None, :] + shifts
    circles = np.concatenate([centres, np.broadcast_to(np.asarray(radius)[:, None, None], (*centres.shape[:2], 1))], -1)
    reach = circles[..., 2:]
    return circles[np.all((circles[..., :2] > -reach) & (circles[..., :2] < period + reach), axis=-1)]


def draw_spots(axes: Axes, circles: np.ndarray, **look) -> None:
    """Add circles, (m, 3) of x, y and radius in data units, to axes."""
    from matplotlib.collections import EllipseCollection

    if not len(circles):
        return
    x, y, radius = circles.T
    axes.add_collection(
        EllipseCollection(
            2 * radius,
            2 * radius,
            np.zeros(len(radius)),
            offsets=np.column_stack([x, y]),
            offset_transform=axes.transData,
            units="xy",
            **look,
        )
    )
