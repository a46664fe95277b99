"""Contact without adhesion: pressure where it touches, a gap where it does not, and never both."""

from __future__ import annotations

import numpy as np

from icha.boundary_elements.elasticity import Contact, Topography, pressures_for
from icha.boundary_elements.kernel import HalfSpace
from icha.boundary_elements.patches import merged
from icha.contact.model import FullContact, NotConverged

# Error of the displacement in contact over the surface's largest height, at last. While cells still come and go, what
# is left of the error.
_EXACT, _COARSE = 1e-12, 0.03
_MAX_CHANGES = 200


def pressed(
    space: HalfSpace,
    topography: Topography,
    contact: Contact,
    *,
    separation: float = 0.0,
    load: float | None = None,
) -> tuple[Contact, np.ndarray, float]:
    """The contact at a separation (cells), or under a mean pressure (E*); the gap, (n, n), and the separation in cells.

    contact: one not far away; under a given pressure it has cells.

    Cells in tension leave the contact and cells that overlap join it until there are neither: a Newton's method for the
    complementarity of pressure and gap (Hintermueller, Ito & Kunisch, SIAM J. Optim. 13 (2003) 865).

    Raises
    ------
    FullContact
        If every cell touches.
    NotConverged
        If the contact does not settle.
    """
    heights, exact = topography.double, _EXACT * topography.largest
    cells, pressure, rough = contact.cells, contact.pressure, True
    if not len(cells):
        cells = np.flatnonzero(heights > separation)
        pressure = np.zeros(len(cells))
    for _ in range(_MAX_CHANGES):
        if not len(cells):
            return Contact(cells, pressure, pressure), separation - heights, separation
        if len(cells) == space.size:
            raise FullContact("every cell touches")
        height = heights.ravel()[cells]
        if load is not None:
            pressure = pressure * (load * space.size / np.sum(pressure))
        pressure, left = pressures_for(
            space,
            cells,
            height - separation,
            pressure,
            topography.rounding if rough else exact,
            np.float32 if rough else float,
            gain=_COARSE,
            balanced=load is not None,
        )
        displaced = space.displacement(cells, pressure.astype(np.float32 if rough else float))
        if load is not None:
            separation = float(np.mean(height - displaced.ravel()[cells]))
        gap = topography.gap(displaced, separation, cells, -left)
        off = max(float(np.abs(left).max()), exact)
        # Less pressure than makes up for the error of a gap is none.
        staying = pressure >= (0.0 if rough else off)
        joining = np.flatnonzero(gap < -off)
        if staying.all() and not len(joining):
            if not rough:
                return Contact(cells, np.ones(len(cells)), pressure), gap, separation
            rough = off > topography.rounding
            continue
        cells, pressure = merged(cells[staying], joining, (pressure[staying], 0.0))
    raise NotConverged("the contact did not settle")
