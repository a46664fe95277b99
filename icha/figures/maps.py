"""Maps of the nodes of a surface."""

from __future__ import annotations

import numpy as np

# More cells a side than this cannot be told apart in a panel.
_MOST_CELLS = 1024


def draw_whole(axes, means: np.ndarray, n: int, side: float, **look):
    """Draw a periodic map of n nodes a side, or `block_means` of it.

    Nodes are the centres of the picture's cells; the first row and column come again at the far border.
    """
    drawn = np.pad(means, [(0, 1), (0, 1), (0, 0)][: means.ndim], mode="wrap")
    half = side / n / 2
    borders = (-half, side - half + side / (len(drawn) - 1))
    return axes.imshow(drawn, extent=borders * 2, interpolation="antialiased", **look)


def block_means(nodes: np.ndarray, most: int = _MOST_CELLS) -> np.ndarray:
    """Means over blocks of nodes, as near to equal as can be, where there are more than `most` along a side."""
    count = min(len(nodes), most)
    if count == len(nodes):
        return nodes
    starts = np.arange(count) * len(nodes) // count
    width = np.diff(starts, append=len(nodes))
    sums = np.add.reduceat(np.add.reduceat(nodes, starts, axis=1), starts, axis=0)
    return (sums.T / np.outer(width, width)).T
