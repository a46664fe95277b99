"""Contact without adhesion: pressure where it touches, a gap where it does not, and never both."""

from __future__ import annotations

import numpy as np

from icha.boundary_elements.elasticity import solve_bonds
from icha.boundary_elements.kernel import HalfSpace
from icha.contact.failures import FullContact, NotConverged

# Error of the displacement in contact, over the surface's largest height: while cells still come and go, and at last.
_COARSE, _EXACT = 1e-7, 1e-12
_MAX_CHANGES = 200


def pressed(
    space: HalfSpace, heights: np.ndarray, separation: float, touching: np.ndarray, pressure: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cells in contact, pressures (E*) and gaps (cells), all (n, n), at a separation (cells).

    Cells in tension leave the contact and cells that overlap join it until there are neither: a Newton's method for the
    complementarity of pressure and gap (Hintermueller, Ito & Kunisch, SIAM J. Optim. 13 (2003) 865).

    Raises
    ------
    FullContact
        If every cell touches.
    NotConverged
        If the contact does not settle.
    """
    overlap = heights - separation
    coarse, exact = (part * np.abs(heights).max() for part in (_COARSE, _EXACT))
    tolerance = coarse
    bonds = np.zeros_like(overlap)
    touching = touching | (overlap > 0) if not touching.any() else touching
    for _ in range(_MAX_CHANGES):
        if not touching.any():
            return touching, np.zeros_like(overlap), -overlap
        if touching.all():
            raise FullContact("every cell touches")
        pressure, displaced = solve_bonds(space, touching, bonds, overlap, pressure, tolerance)
        gap = displaced - overlap
        # Less pressure than makes up for the error of a gap is none.
        leaving, joining = touching & (pressure < tolerance), ~touching & (gap < -tolerance)
        touching = (touching & ~leaving) | joining
        if leaving.any() or joining.any():
            continue
        if tolerance == exact:
            return touching, pressure, gap
        tolerance = exact
    raise NotConverged("the contact did not settle")
