"""How well the summits of a surface stand for its highest places, where contact begins."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from icha.support.parallel import blocks, on_cores
from icha.surfaces.summits import Asperities
from icha.surfaces.surface import Surface

# Largest share of the load, and of the summits, that may be without support before asperities do not stand for the
# surface. Smooth random surfaces with at least 5 nodes per shortest wave stay below 0.1 (`tests/surfaces`).
MAX_SHARE = 0.1
# Rows and columns between a node and the summit that stands for it: on a crest oblique to the grid there are two nodes
# higher than their neighbours beside one summit.
_NEAR = range(-2, 3)
# Rows of the grid that are examined at a time, which bounds the memory.
_LINES = 16


@dataclass(frozen=True, eq=False)
class SummitCoverage:
    """The highest places of a surface, and whether summits stand for them.

    peak_height : (k,) array, heights of the nodes that are not lower than any of their eight neighbours, m. Every node
        of a plateau is one.
    covered : (k,) array, whether a summit is found within two rows and columns of the node.
    summit_height : (n,) array, heights of the summits, m.
    unsupported_height : (m,) array, heights of the maxima that are left out, as their nodes do not support them, m.
    """

    peak_height: np.ndarray
    covered: np.ndarray
    summit_height: np.ndarray
    unsupported_height: np.ndarray

    @classmethod
    def of(cls, surface: Surface, asperities: Asperities) -> SummitCoverage:
        """Compare the nodes of a surface with its summits."""
        grid = surface.grid
        rows, columns = _peaks(surface)
        x, y = np.mod(np.rint(asperities.position / surface.spacing).astype(int), grid).T
        occupied = np.zeros((grid, grid), dtype=bool)
        for down in _NEAR:
            for across in _NEAR:
                occupied[(y + down) % grid, (x + across) % grid] = True
        return cls(
            surface.heights[rows, columns],
            occupied[rows, columns],
            asperities.height,
            asperities.unsupported_height,
        )

    def uncovered_share(self, separation: float) -> float:
        """Share of the load, at a mean separation (m), on places without a summit.

        The load of a place is estimated as its height above the plane of separation to the power 3/2 (Hertz). Where
        no place is that high, it is the highest place that counts.
        """
        load = np.maximum(self.peak_height - separation, 0.0) ** 1.5
        if not load.any():
            return float(not self.covered[np.argmax(self.peak_height)])
        return float(np.sum(load[~self.covered]) / np.sum(load))

    def unsupported_share(self, separation: float) -> float:
        """Share of the summits above the plane of separation (m) that their nodes do not support."""
        unsupported = np.count_nonzero(self.unsupported_height > separation)
        return unsupported / max(unsupported + np.count_nonzero(self.summit_height > separation), 1)

    def reasons_against(self, separations: Iterable[float]) -> list[str]:
        """Reasons why asperities do not stand for the surface at these mean separations (m); none if they do."""
        separations, found = np.unique(list(separations)), []
        uncovered = max(map(self.uncovered_share, separations), default=0.0)
        if uncovered > MAX_SHARE:
            found.append(
                f"no summit stands for {100 * uncovered:.0f} % of the highest places, by their share of the load"
            )
        unsupported = max(map(self.unsupported_share, separations), default=0.0)
        if unsupported > MAX_SHARE:
            found.append(
                f"{100 * unsupported:.0f} % of the summits within reach are not supported by the nodes around them"
            )
        return found


def _peaks(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (k,) of the nodes not lower than their neighbours; those on edges of a free square are not."""
    heights, grid = surface.heights, surface.grid

    def examine(rows):
        block = heights[np.arange(rows.start - 1, rows.stop + 1) % grid]
        # Maxima along y of three nodes, then along x.
        highest = np.maximum(np.maximum(block[:-2], block[1:-1]), block[2:])
        highest = np.maximum(np.maximum(np.roll(highest, 1, axis=1), highest), np.roll(highest, -1, axis=1))
        row, column = np.nonzero(block[1:-1] >= highest)
        return np.array([row + rows.start, column])

    row, column = np.concatenate(on_cores(examine, blocks(grid, _LINES)), axis=1)
    if surface.free:
        inside = (np.minimum(row, column) > 0) & (np.maximum(row, column) < grid - 1)
        row, column = row[inside], column[inside]
    return row, column
