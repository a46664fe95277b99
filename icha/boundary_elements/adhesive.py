"""Contact with adhesion at a given separation: fronts come to rest, contact forms within reach of the attraction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from icha.boundary_elements.elasticity import Held
from icha.boundary_elements.front import Front
from icha.boundary_elements.kernel import HalfSpace
from icha.boundary_elements.newton import beside, front_at_rest
from icha.contact.failures import FullContact

# Deviation of sqrt(G/dgamma) at which a front rests well enough to see where new contact forms.
_NEARLY_AT_REST = 1e-3
# More of the surface than this in contact, and the rest follows.
_NEARLY_ALL = 0.98


@dataclass(frozen=True, eq=False)
class Summits:
    """Where contact may form out of nothing. Arrays of length k; lengths in cells.

    cell: of the grid, counted through. above: how far above its node each summit rises. reach: how far its attraction
    does. radius: of the contact that it makes there, were it alone; from a smaller one it could not grow.
    """

    cell: np.ndarray
    above: np.ndarray
    reach: np.ndarray
    radius: np.ndarray

    def contacts(self, which: np.ndarray, grid: int) -> np.ndarray:
        """Cells, (n, n) of bool, that these summits (k,) touch with when they jump into contact."""
        found = np.zeros((grid, grid), dtype=bool)
        for cell, radius in zip(self.cell[which], self.radius[which], strict=True):
            way = np.arange(-int(radius), int(radius) + 1)
            disc = np.hypot(way[:, None], way) <= radius
            rows, columns = (np.add.outer(at, way) % grid for at in divmod(int(cell), grid))
            found[np.ix_(rows, columns)] |= disc
        return found


def settled(
    space: HalfSpace,
    front: Front,
    heights: np.ndarray,
    summits: Summits,
    separation: float,
    state: Held,
    tolerance: float,
) -> tuple[Held, int]:
    """The contact in equilibrium at a separation (cells), and how many summits within reach it left open.

    tolerance: of sqrt(G/dgamma) along the fronts.

    Fronts come nearly to rest first; then all summits within reach make contact, until there is none, and fronts come
    to rest. A summit that loses the contact again stays open.

    Raises
    ------
    FullContact
        If the contact runs over the whole surface.
    NotConverged
        If an equilibrium is not found.
    """
    tried = np.zeros(heights.size, dtype=bool)
    rest = False
    while True:
        state = front_at_rest(space, front, heights, separation, state, tolerance if rest else _NEARLY_AT_REST)
        if np.mean(state.fraction) > _NEARLY_ALL:
            raise FullContact("the contact runs over the whole surface")
        touching = state.fraction > 0
        inside = state.gap.ravel()[summits.cell] - summits.above - summits.reach < 0
        within = inside & ~touching.ravel()[summits.cell]
        seeds = np.zeros(heights.size, dtype=bool)
        seeds[summits.cell[within]] = True
        # Without a summit, surfaces that overlap touch.
        seeds |= ((state.gap < 0) & ~beside(touching)).ravel()
        new = seeds & ~tried
        if not new.any():
            if rest:
                return state, int(np.count_nonzero(seeds))
            rest = True
            continue
        rest = False
        made = summits.contacts(within & ~tried[summits.cell], len(heights)) | new.reshape(heights.shape)
        tried |= new
        state = Held(np.where(made, 1.0, state.fraction), state.pressure, state.gap, 0.0, state.around)
