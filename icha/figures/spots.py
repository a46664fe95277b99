"""Contact spots as circles of true size."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def circles_in_cell(x, y, radius, period: float, boundary: str) -> np.ndarray:
    """Centre and radius, (m, 3), of every circle and, on a periodic surface, of its images that reach into [0, L)²."""
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
