"""Fronts that are far from rest in a few places come to rest there, in windows around them; nothing else moves.

After two or three of Newton's steps nearly all of a front is at rest, and steps of the whole contact go on for the sake
of some cells: where contact has just been made, where two patches meet. What happens there
does not concern the rest before it is done.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy.fft
from scipy.ndimage import find_objects, label, maximum_filter

from icha.boundary_elements.elasticity import Contact, Held, Topography
from icha.boundary_elements.front import COMPLIANCE, Front, neighbours
from icha.boundary_elements.kernel import HalfSpace, in_both_precisions
from icha.boundary_elements.newton import front_at_rest
from icha.boundary_elements.regions import among, merged, region
from icha.contact.failures import FullContact, NotConverged

# Cells a side of a window; half of it may move. So far around a cell that is not at rest others move with it.
_SIDE, _AROUND = 64, 5
# All windows together, over the whole grid: more are no short way.
_PART = 0.2
# Deviation of sqrt(G/dgamma) in windows; all of the front comes to rest afterwards.
_TOLERANCE = 1e-3
# Of Newton's steps at most, after which windows are as near to rest as they are.
_STEPS = 12


def relaxed_in_windows(
    space: HalfSpace,
    front: Front,
    separation: float,
    state: Held,
    restless: np.ndarray,
) -> Contact | None:
    """The contact after its front has come nearer to rest around restless cells (m,), where these lie in windows.

    None if there are no such windows, or no way to rest in them.
    """
    windows, free = _windows(region(restless, space.shape))
    if not len(windows):
        return None
    cells = windows[free]
    touching, at = among(cells, state.cells)
    inside = np.flatnonzero(free)[touching]
    contact = Contact(inside, state.fraction[at], state.pressure[at])
    small = HalfSpace(windows.shape, *_kernel(space.grid))

    # What pressures outside displace is there for good, as if the surface had it; what may not move is far away.
    own = small.displacement(inside, contact.pressure)
    far = separation - 10 * COMPLIANCE * front.strength - 2 * np.abs(own).max()
    level = np.where(free, own + separation - state.gap.ravel()[windows], far)
    around = neighbours(space, state.cells, state.fraction.astype(np.float32)).ravel()[windows]
    around = around - neighbours(small, inside, contact.fraction)
    try:
        rest = front_at_rest(
            small, front, Topography.of(level), separation, contact, _TOLERANCE, most_steps=_STEPS, beyond=around
        )
    except (NotConverged, FullContact):
        return None
    moved = region(cells, (space.size,))
    staying = ~moved[state.cells]
    return Contact(
        *merged(
            state.cells[staying],
            windows.ravel()[rest.cells],
            (state.fraction[staying], rest.fraction),
            (state.pressure[staying], rest.pressure),
        )
    )


def _windows(restless):
    """Cells of the whole grid in each window, (t, w, w), and which of them may move there: in one window each."""
    grid = len(restless)
    labels, _ = label(maximum_filter(restless.view(np.uint8), 2 * _AROUND + 1, mode="wrap"))
    way = np.arange(_SIDE)
    cells, owner = [], []
    for number, box in enumerate(find_objects(labels), 1):
        if max(side.stop - side.start for side in box) <= _SIDE // 2:
            rows, columns = ((side.start + side.stop - _SIDE) // 2 + way for side in box)
            cells.append(np.add.outer(rows % grid * grid, columns % grid))
            owner.append(number)
    if not 0 < len(cells) * _SIDE**2 <= _PART * grid**2:
        return np.zeros((0, _SIDE, _SIDE), int), np.zeros((0, _SIDE, _SIDE), bool)
    windows = np.stack(cells)
    return windows, labels.ravel()[windows] == np.array(owner)[:, None, None]


@cache
def _kernel(grid: int):
    """Compliance, by precision, and stiffness of a window of a grid: exact between cells half of it apart."""
    side = HalfSpace.of(_SIDE)
    qx, qy = 2 * np.pi * scipy.fft.rfftfreq(grid), 2 * np.pi * scipy.fft.fftfreq(grid)
    q = np.hypot(qy[:, None], qx)
    q[0, 0] = np.inf
    way = np.rint(scipy.fft.fftfreq(_SIDE) * _SIDE).astype(int)
    rows = np.cos(np.outer(way, qy)) @ (2 / q) / grid
    table = scipy.fft.irfft(rows, n=grid, axis=1)[:, way % grid]
    return in_both_precisions(scipy.fft.rfft2(table).real), side.stiffness
