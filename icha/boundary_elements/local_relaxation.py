"""Local relaxation: fronts far from equilibrium in few places are relaxed in windows around them.

After new contact, where two patches meet, or everywhere after a long step, a place hardly affects others before it is
relaxed. Transforms of a window are so much shorter than those of the whole grid that nearly all of a front is relaxed
in windows; steps of the whole contact then account for the interaction between places.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np
import scipy.fft
from scipy.ndimage import find_objects

from icha.boundary_elements.cells import BLOCK, blocks_around, find_among, merge_cells
from icha.boundary_elements.elastic_contact import Contact, Topography
from icha.boundary_elements.front import Front, average_fractions
from icha.boundary_elements.front_solver import FrontProblem, relax_front
from icha.boundary_elements.half_space import HalfSpace, by_precision
from icha.boundary_elements.patches import label_patches
from icha.contact.model import FullContact, NotConverged
from icha.support.parallel import blocks, on_cores

# Sides of windows, in cells, half of which may move. Wider places are cut into pieces of this side.
_SIDES, _PIECE = (64, 128, 256), 64
# Cells of windows that are solved together, in the cache.
_BATCH = 65_536
# Residual of the front in windows; the whole front is relaxed afterwards.
_TOLERANCE = 1e-4


class _Extent(NamedTuple):
    """Extent of windows.

    Parameters
    ----------
    reach : how far around a cell the front may move, in cells.
    cover : largest area of all windows, divided by the grid's.
    max_steps : number of steps.
    """

    reach: int
    cover: float
    max_steps: int


# Few places get wider windows and more steps.
_EXTENTS = (_Extent(20, 0.05, 60), _Extent(4, 0.5, 20))


def relax_in_windows(
    space: HalfSpace, front: Front, separation: float, contact: Contact, gap: np.ndarray, far: np.ndarray
) -> Contact | None:
    """Relax the front of a contact around cells far from equilibrium, in windows.

    Parameters
    ----------
    gap : (n, n), of the contact with its pressures.
    far : (m,) int, cells far from equilibrium, ascending.

    Returns
    -------
    The contact, or None if windows would not pay or no front in them converges.
    """
    for extent in _EXTENTS:
        places = Places.around(far, space.grid, extent.reach)
        if np.sum(places.sides**2) <= extent.cover * space.size:
            break
    else:
        return None
    windows = list(places.windows(space.grid))
    mean_fraction = average_fractions(space.field(contact.cells, contact.fraction, np.float32)).ravel()
    kernels = {side: window_kernel(space.grid, side) for side in {cells.shape[-1] for cells, _ in windows}}

    def relax(window):
        cells, free = window
        small = HalfSpace(cells.shape, *kernels[cells.shape[-1]])
        return _relax_window(small, front, separation, contact, gap, mean_fraction, cells, free, extent.max_steps)

    found = on_cores(relax, windows)
    moved = np.zeros(space.size, dtype=bool)
    for (cells, free), relaxed in zip(windows, found, strict=True):
        if relaxed is not None:
            moved[cells[free]] = True
    if not moved.any():
        return None
    cells, fraction, pressure = map(np.concatenate, zip(*filter(None, found), strict=True))
    order, fixed = np.argsort(cells), ~moved[contact.cells]
    return Contact(
        *merge_cells(
            contact.cells[fixed],
            cells[order],
            (contact.fraction[fixed], fraction[order]),
            (contact.pressure[fixed], pressure[order]),
        )
    )


def _relax_window(small, front, separation, contact, gap, mean_fraction, windows, free, max_steps):
    """Cells of the grid in contact in some windows, with fractions and pressures, relaxed; None if not converged."""
    cells = windows[free]
    touching, index = find_among(cells, contact.cells)
    inside = np.flatnonzero(free)[touching]
    start = Contact(inside, contact.fraction[index], contact.pressure[index])
    # The displacement by fixed pressures outside counts as part of the heights. Frozen cells are lowered so that they
    # cannot touch.
    displacement = small.displacement(inside, start.pressure)
    lowest = separation - 10 * front.critical_opening - 2 * np.abs(displacement).max()
    heights = Topography.of(np.where(free, displacement + separation - gap.ravel()[windows], lowest))
    background = mean_fraction[windows] - average_fractions(small.field(inside, start.fraction))
    problem = FrontProblem(small, front, heights, separation, background)
    try:
        relaxed = relax_front(problem, start, _TOLERANCE, max_steps=max_steps)
    except (NotConverged, FullContact):
        return None
    return windows.ravel()[relaxed.cells], relaxed.fraction, relaxed.pressure


class Places(NamedTuple):
    """Places far from equilibrium.

    Parameters
    ----------
    labels : number of its place, from 1, of every block of the grid; 0 where nothing moves.
    middles : (t, 2), of the boxes around the places, in cells.
    sides : (t,), of the windows, in cells.
    """

    labels: np.ndarray
    middles: np.ndarray
    sides: np.ndarray

    @classmethod
    def around(cls, far: np.ndarray, grid: int, reach: int) -> Places:
        """Places around cells (m,), including what is within reach of them."""
        moving = blocks_around(grid, reach, far)
        labels, numbers = np.zeros(moving.shape, int), np.flatnonzero(moving)
        labels.ravel()[numbers], _ = label_patches(numbers, len(moving))
        boxes = _cut(labels, _boxes(labels))
        ends = np.array([[(side.start, side.stop) for side in box] for box in boxes], int).reshape(-1, 2, 2)
        widths = BLOCK * np.max(ends[:, :, 1] - ends[:, :, 0], axis=1, initial=0)
        # Boxes cut into pieces get no window of their own (side 0).
        sides = np.array([*_SIDES, 0])[np.searchsorted(np.array(_SIDES) // 2, widths)]
        return cls(labels, np.sum(ends, axis=2) * BLOCK // 2, sides)

    def windows(self, grid: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Batches of windows: cells of the grid, (t, w, w), and which of them may move, each in one window only."""
        for side in _SIDES:
            numbers, offset = np.flatnonzero(self.sides == side), np.arange(side) - side // 2
            for batch in blocks(len(numbers), _BATCH // side**2):
                chosen = numbers[batch]
                rows, columns = ((self.middles[chosen, axis, None] + offset) % grid for axis in (0, 1))
                label = self.labels[rows[:, :, None] // BLOCK, columns[:, None, :] // BLOCK]
                yield rows[:, :, None] * grid + columns[:, None, :], label == chosen[:, None, None] + 1


def _boxes(labels):
    """Rows and columns, in blocks, around each label; across the edges of the period they begin below zero."""
    half = len(labels) // 2
    boxes = []
    rolled = np.roll(labels, (half, half), (0, 1))
    for box, turned in zip(find_objects(labels), find_objects(rolled), strict=True):
        sides = [(side, slice(other.start - half, other.stop - half)) for side, other in zip(box, turned, strict=True)]
        boxes.append(tuple(min(pair, key=lambda side: side.stop - side.start) for pair in sides))
    return boxes


def _cut(labels, boxes):
    """Boxes, in blocks, after those wider than any window are cut into pieces with labels of their own."""
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


@cache
def window_kernel(grid: int, side: int) -> tuple[dict[np.dtype, np.ndarray], np.ndarray]:
    """Compliance, by precision, and stiffness of a window: exact between cells less than half of it apart."""
    qx, qy = 2 * np.pi * scipy.fft.rfftfreq(grid), 2 * np.pi * scipy.fft.fftfreq(grid)
    q = np.hypot(qy[:, None], qx)
    q[0, 0] = np.inf
    offset = np.rint(scipy.fft.fftfreq(side) * side).astype(int)
    rows = np.cos(np.outer(offset, qy)) @ (2 / q) / grid
    table = scipy.fft.irfft(rows, n=grid, axis=1)[:, offset % grid]
    return by_precision(scipy.fft.rfft2(table).real), HalfSpace.of(side).stiffness
