"""Local relaxation: move parts of the front that are far from equilibrium to equilibrium, in small windows.

Parts of a front are far from equilibrium after new contact, where two patches meet, or after a long step. These parts
hardly affect each other before they are relaxed. A Fourier transform of a window takes much less time than a transform
of the whole grid, so nearly all of the front is relaxed in windows. Steps of the whole contact then account for the
interaction between the parts.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.ndimage import find_objects

from icha.boundary_elements.cells import BLOCK, blocks_around, find_among, merge_cells
from icha.boundary_elements.elastic_contact import Contact, Topography
from icha.boundary_elements.front import Front, average_fractions
from icha.boundary_elements.front_solver import FrontProblem, relax_front
from icha.boundary_elements.half_space import HalfSpace
from icha.boundary_elements.patches import label_patches
from icha.contact.model import FullContact, NotConverged
from icha.support.parallel import blocks, on_cores

# Sides of windows, in cells; fronts move only in the middle half of a side. Side of pieces of wider regions, in cells.
_SIDES, _PIECE = (64, 128, 256), 64
# Number of cells of the windows that are solved together; they fit in the cache.
_BATCH = 65_536
# Residual of the front at which a window stops early; the whole front is relaxed afterwards.
_TOLERANCE = 1e-4
# Settings of three numbers: distance from the given cells within which the front may move, in cells; largest total area
# of the windows, in grid areas; largest number of iterations. The first setting whose windows fit in this area is used.
_EXTENTS = ((20, 0.05, 60), (4, 0.5, 20))


def relax_in_windows(
    space: HalfSpace, front: Front, separation: float, contact: Contact, gap: np.ndarray, far: np.ndarray
) -> Contact | None:
    """Relax the front of a contact around cells far from equilibrium, in windows around these cells.

    Parameters
    ----------
    gap : (n, n), gap of the contact, in cell sizes.
    far : (m,) int, cells far from equilibrium, ascending.

    Returns
    -------
    The contact with new fractions and pressures in the windows. None if the windows would cover too much of the grid,
    or if the solver fails in all of them.
    """
    for extent in _EXTENTS:
        distance, cover, max_iterations = extent
        regions = Regions.around(far, space.grid, distance)
        if np.sum(regions.sides**2) <= cover * space.size:
            break
    else:
        return None
    windows = list(regions.windows(space.grid))
    mean_fraction = average_fractions(space.field(contact.cells, contact.fraction, np.float32)).ravel()
    kernels = {side: space.window_kernel(side) for side in {cells.shape[-1] for cells, _ in windows}}

    def relax(batch):
        cells, free = batch
        small = HalfSpace(cells.shape, *kernels[cells.shape[-1]])
        return _relax_batch(small, front, separation, contact, gap, mean_fraction, cells, free, max_iterations)

    found = on_cores(relax, windows)
    moved = np.zeros(space.size, dtype=bool)
    for (cells, free), relaxed in zip(windows, found, strict=True):
        if relaxed is not None:
            moved[cells[free]] = True
    if not moved.any():
        return None
    cells, fraction, pressure = map(np.concatenate, zip(*filter(None, found), strict=True))
    order, fixed = np.argsort(cells), ~moved[contact.cells]
    fractions, pressures = (contact.fraction[fixed], fraction[order]), (contact.pressure[fixed], pressure[order])
    return Contact(*merge_cells(contact.cells[fixed], cells[order], fractions, pressures))


def _relax_batch(small, front, separation, contact, gap, mean_fraction, windows, free, max_iterations):
    """Relax fronts in a batch of windows; return cells, fractions and pressures, or None if the solver fails."""
    cells = windows[free]
    touching, index = find_among(cells, contact.cells)
    inside = np.flatnonzero(free)[touching]
    start = Contact(inside, contact.fraction[index], contact.pressure[index])
    # The heights include the displacement caused by fixed pressures outside the window. Cells that may not move are
    # lowered so that they cannot touch.
    displacement = small.displacement(inside, start.pressure)
    lowest = separation - 10 * front.critical_opening - 2 * np.abs(displacement).max()
    heights = Topography.of(np.where(free, displacement + separation - gap.ravel()[windows], lowest))
    background = mean_fraction[windows] - average_fractions(small.field(inside, start.fraction))
    problem = FrontProblem(small, front, heights, separation, background)
    try:
        relaxed = relax_front(problem, start, _TOLERANCE, max_iterations=max_iterations)
    except (NotConverged, FullContact):
        return None
    return windows.ravel()[relaxed.cells], relaxed.fraction, relaxed.pressure


class Regions(NamedTuple):
    """Connected regions of the grid in which the front may move, each with a window.

    Parameters
    ----------
    labels : number of the region, from 1, of every block of the grid; 0 for blocks in which the front is fixed.
    middles : (t, 2), row and column of the middle of each region, in cells.
    sides : (t,), side of the window of each region, in cells; 0 for a region that was cut into pieces.
    """

    labels: np.ndarray
    middles: np.ndarray
    sides: np.ndarray

    @classmethod
    def around(cls, far: np.ndarray, grid: int, distance: int) -> Regions:
        """Find the regions of all blocks within `distance` cells of the cells `far`, (m,)."""
        moving = blocks_around(grid, distance, far)
        labels, numbers = np.zeros(moving.shape, int), np.flatnonzero(moving)
        labels.ravel()[numbers], _ = label_patches(numbers, len(moving))
        boxes = _cut(labels, _boxes(labels))
        ends = np.array([[(side.start, side.stop) for side in box] for box in boxes], int).reshape(-1, 2, 2)
        widths = BLOCK * np.max(ends[:, :, 1] - ends[:, :, 0], axis=1, initial=0)
        # Regions that were cut into pieces get no window (side 0).
        sides = np.array([*_SIDES, 0])[np.searchsorted(np.array(_SIDES) // 2, widths)]
        return cls(labels, np.sum(ends, axis=2) * BLOCK // 2, sides)

    def windows(self, grid: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield batches of windows: grid cells of each window, (t, w, w), and whether the front may move at a cell."""
        for side in _SIDES:
            numbers, offset = np.flatnonzero(self.sides == side), np.arange(side) - side // 2
            for batch in blocks(len(numbers), _BATCH // side**2):
                chosen = numbers[batch]
                rows, columns = ((self.middles[chosen, axis, None] + offset) % grid for axis in (0, 1))
                label = self.labels[rows[:, :, None] // BLOCK, columns[:, None, :] // BLOCK]
                yield rows[:, :, None] * grid + columns[:, None, :], label == chosen[:, None, None] + 1


def _boxes(labels):
    """Return the box (rows, columns) around each label, in blocks; across the period, it starts at a negative index."""
    half = len(labels) // 2
    boxes = []
    rolled = np.roll(labels, (half, half), (0, 1))
    for box, turned in zip(find_objects(labels), find_objects(rolled), strict=True):
        sides = [(side, slice(other.start - half, other.stop - half)) for side, other in zip(box, turned, strict=True)]
        boxes.append(tuple(min(pair, key=lambda side: side.stop - side.start) for pair in sides))
    return boxes


def _cut(labels, boxes):
    """Cut boxes wider than half the largest window; number pieces in `labels`; return old boxes and then pieces."""
    widest, step = _SIDES[-1] // 2 // BLOCK, _PIECE // BLOCK
    pieces = []
    for number, box in enumerate(boxes, 1):
        if max(side.stop - side.start for side in box) <= widest:
            continue
        for row in range(box[0].start, box[0].stop, step):
            for column in range(box[1].start, box[1].stop, step):
                rows, columns = (np.arange(start, start + step) % len(labels) for start in (row, column))
                inside = np.argwhere(labels[np.ix_(rows, columns)] == number)
                if len(inside):
                    pieces.append((slice(row, row + step), slice(column, column + step)))
                    labels[rows[inside[:, 0]], columns[inside[:, 1]]] = len(boxes) + len(pieces)
    return boxes + pieces
