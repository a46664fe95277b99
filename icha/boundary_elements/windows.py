"""Fronts that are far from rest in some places come to rest there, in windows around them; nothing else moves.

Where contact has just been made, where two patches meet, or everywhere after a long way: what happens at a place hardly
concerns others before it is done. Transforms of a window are so much shorter than those of the whole that nearly all of
a front comes nearly to rest in them, and steps of the whole contact are left with what places do to one another.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import scipy.fft
from scipy.ndimage import find_objects

from icha.boundary_elements.elasticity import Contact, Topography
from icha.boundary_elements.front import COMPLIANCE, Front, neighbours
from icha.boundary_elements.kernel import HalfSpace, in_both_precisions
from icha.boundary_elements.newton import front_at_rest
from icha.boundary_elements.patches import BLOCK, among, blocks_around, labelled, merged, surroundings
from icha.contact.model import FullContact, NotConverged
from icha.support.parallel import blocks, on_cores

# Cells a side of windows, half of which may move. What is too wide for them is cut into pieces.
_SIDES, _PIECE = (64, 128, 256), 64
# Cells of windows that are solved together: few enough to stay in the cache, and to be done when they are at rest.
_TOGETHER = 65_536
# Deviation of sqrt(G/dgamma) in windows; all of the front comes to rest afterwards.
_TOLERANCE = 1e-4


class _Way(NamedTuple):
    """So far, at least, around a cell that is not at rest others move, too, if windows are no more than a part of all.

    steps: of Newton's, at most, after which windows are as near to rest as they are.
    """

    around: int
    part: float
    steps: int


# Few places get more of both.
_WAYS = (_Way(20, 0.05, 60), _Way(4, 0.5, 20))


def relaxed_in_windows(
    space: HalfSpace,
    front: Front,
    separation: float,
    contact: Contact,
    gap: np.ndarray,
    restless: np.ndarray,
) -> Contact | None:
    """The contact after its front has come nearer to rest around restless cells (m,), where these lie in windows.

    gap: of the contact as its pressures are, (n, n). None if there are no such windows, or no way to rest in them.
    """
    for way in _WAYS:
        moving = _Places.around(restless, space.grid, way.around)
        if np.sum(moving.sides**2) <= way.part * space.size:
            break
    else:
        return None
    windows = moving.windows(space.grid)
    near, places = np.zeros(space.size, np.float32), surroundings(space.grid, contact.cells)
    near[places] = neighbours(space, contact.cells, contact.fraction.astype(np.float32), places)
    kernels = {side: _kernel(space.grid, side) for side in {cells.shape[-1] for cells, _ in windows}}

    def at_rest(some):
        cells, free = some
        small = HalfSpace(cells.shape, *kernels[cells.shape[-1]])
        return _at_rest(small, front, separation, contact, gap, near, cells, free, way.steps)

    found = on_cores(at_rest, windows)
    moved = np.zeros(space.size, dtype=bool)
    for (cells, free), rest in zip(windows, found, strict=True):
        if rest is not None:
            moved[cells[free]] = True
    if not moved.any():
        return None
    cells, fraction, pressure = map(np.concatenate, zip(*filter(None, found), strict=True))
    order, staying = np.argsort(cells), ~moved[contact.cells]
    return Contact(
        *merged(
            contact.cells[staying],
            cells[order],
            (contact.fraction[staying], fraction[order]),
            (contact.pressure[staying], pressure[order]),
        )
    )


def _at_rest(small, front, separation, contact, gap, near, windows, free, most_steps):
    """Cells in contact of the whole grid in some windows, their fractions and pressures, near rest; None if not found.

    near: mean fraction of contact around every cell of the whole grid.
    """
    cells = windows[free]
    touching, at = among(cells, contact.cells)
    inside = np.flatnonzero(free)[touching]
    start = Contact(inside, contact.fraction[at], contact.pressure[at])

    # What pressures outside displace is there for good, as if the surface had it; what may not move is far away.
    own = small.displacement(inside, start.pressure)
    far = separation - 10 * COMPLIANCE * front.strength - 2 * np.abs(own).max()
    level = Topography.of(np.where(free, own + separation - gap.ravel()[windows], far))
    beyond = near[windows] - neighbours(small, inside, start.fraction)
    try:
        rest = front_at_rest(small, front, level, separation, start, _TOLERANCE, most_steps=most_steps, beyond=beyond)
    except (NotConverged, FullContact):
        return None
    return windows.ravel()[rest.cells], rest.fraction, rest.pressure


class _Places(NamedTuple):
    """Places that are not at rest, each in a box, and how wide their windows are.

    labels: number of its place, from 1 on, of every block of the grid; 0 where nothing moves. In cells: middles of
    boxes, (t, 2), and sides of windows, (t,).
    """

    labels: np.ndarray
    middles: np.ndarray
    sides: np.ndarray

    @classmethod
    def around(cls, restless, grid, reach):
        """Those around restless cells (m,), with what is so far from them."""
        rough = blocks_around(grid, reach, restless)
        labels, there = np.zeros(rough.shape, int), np.flatnonzero(rough)
        labels.ravel()[there], _ = labelled(there, len(rough))
        boxes = _cut(labels, _boxes(labels))
        ends = np.array([[(side.start, side.stop) for side in box] for box in boxes], int).reshape(-1, 2, 2)
        widths = BLOCK * np.max(ends[:, :, 1] - ends[:, :, 0], axis=1, initial=0)
        # Of boxes that were cut into pieces nothing is left.
        sides = np.array([*_SIDES, 0])[np.searchsorted(np.array(_SIDES) // 2, widths)]
        return cls(labels, np.sum(ends, axis=2) * BLOCK // 2, sides)

    def windows(self, grid):
        """Windows, some together: cells of the whole grid, (t, w, w), and which may move there, in one window each."""
        windows = []
        for side in _SIDES:
            numbers, way = np.flatnonzero(self.sides == side), np.arange(side) - side // 2
            for some in blocks(len(numbers), _TOGETHER // side**2):
                mine = numbers[some]
                rows, columns = ((self.middles[mine, axis, None] + way) % grid for axis in (0, 1))
                cells = rows[:, :, None] * grid + columns[:, None, :]
                free = self.labels[rows[:, :, None] // BLOCK, columns[:, None, :] // BLOCK] == mine[:, None, None] + 1
                windows.append((cells, free))
        return windows


def _boxes(labels):
    """Rows and columns, of blocks, around each label; over the edges of the period they begin below zero."""
    half = len(labels) // 2
    boxes = []
    for here, turned in zip(find_objects(labels), find_objects(np.roll(labels, (half, half), (0, 1))), strict=True):
        sides = [(side, slice(other.start - half, other.stop - half)) for side, other in zip(here, turned, strict=True)]
        boxes.append(tuple(min(pair, key=lambda side: side.stop - side.start) for pair in sides))
    return boxes


def _cut(labels, boxes):
    """The boxes, of blocks, after those too wide for any window are cut into pieces, which get labels of their own."""
    widest, step = _SIDES[-1] // 2 // BLOCK, _PIECE // BLOCK
    pieces = []
    for number, box in enumerate(boxes, 1):
        if max(side.stop - side.start for side in box) <= widest:
            continue
        for row in range(box[0].start, box[0].stop, step):
            for column in range(box[1].start, box[1].stop, step):
                rows, columns = (np.arange(start, start + step) % len(labels) for start in (row, column))
                mine = np.argwhere(labels[np.ix_(rows, columns)] == number)
                if len(mine):
                    pieces.append((slice(row, row + step), slice(column, column + step)))
                    labels[rows[mine[:, 0]], columns[mine[:, 1]]] = len(boxes) + len(pieces)
    return boxes + pieces


@cache
def _kernel(grid: int, side: int):
    """Compliance, by precision, and stiffness of a window of a grid: exact between cells half of it apart."""
    qx, qy = 2 * np.pi * scipy.fft.rfftfreq(grid), 2 * np.pi * scipy.fft.fftfreq(grid)
    q = np.hypot(qy[:, None], qx)
    q[0, 0] = np.inf
    way = np.rint(scipy.fft.fftfreq(side) * side).astype(int)
    rows = np.cos(np.outer(way, qy)) @ (2 / q) / grid
    table = scipy.fft.irfft(rows, n=grid, axis=1)[:, way % grid]
    return in_both_precisions(scipy.fft.rfft2(table).real), HalfSpace.of(side).stiffness
