"""Contact spots as circles of true size."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection


def periodic_circles(x, y, radius, period: float) -> Iterator[tuple[float, float, float]]:
    """Centre and radius of every circle, and of its images that reach into the cell [0, L)²."""
    for cx, cy, r in zip(x, y, radius, strict=True):
        for dx in (-period, 0.0, period):
            for dy in (-period, 0.0, period):
                if -r < cx + dx < period + r and -r < cy + dy < period + r:
                    yield cx + dx, cy + dy, r


def draw_spots(axes: Axes, circles, **look) -> None:
    """Add circles (x, y, radius in data units) to axes."""
    if not circles:
        return
    x, y, radius = np.array(circles).T
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
