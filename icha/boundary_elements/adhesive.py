"""Contact with adhesion at a given separation: fronts come to rest, contact forms within reach of the attraction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from icha.boundary_elements.elastic_equilibrium import Held, held
from icha.boundary_elements.elasticity import Contact, Topography
from icha.boundary_elements.front import COMPLIANCE, Front
from icha.boundary_elements.kernel import HalfSpace
from icha.boundary_elements.newton import front_at_rest
from icha.boundary_elements.patches import region
from icha.boundary_elements.windows import relaxed_in_windows
from icha.contact.model import FullContact, NotConverged

# Deviation of sqrt(G/dgamma) at which a front rests well enough to see where new contact forms.
_NEARLY_AT_REST = 1e-3
# The same where it is clear, and what is clear: by so much of the gap at which a cell lets go.
_IN_SIGHT, _CLEARLY = 3e-2, 0.02
# Accuracy of displacements, over that gap, at which this can be seen.
_ROUGHLY = 1e-2
# Rounds of new contacts: they end, but may be as many as there are cells.
_MAX_ROUNDS = 1000
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
        """Cells, counted through, that these summits (k,) touch with when they jump into contact."""
        touched = np.zeros((grid, grid), bool)
        # Whatever would be larger than the surface covers it with its periodic images.
        for cell, radius in zip(self.cell[which], np.minimum(self.radius[which], 0.75 * grid), strict=True):
            way = np.arange(-int(radius), int(radius) + 1)
            rows, columns = np.nonzero(np.hypot(way[:, None], way) <= radius)
            row, column = divmod(int(cell), grid)
            touched[(row + way[rows]) % grid, (column + way[columns]) % grid] = True
        return np.flatnonzero(touched)


def settled(
    space: HalfSpace,
    front: Front,
    topography: Topography,
    summits: Summits,
    separation: float,
    contact: Contact,
    tolerance: float,
    *,
    near: bool = False,
) -> tuple[Held, int]:
    """The contact in equilibrium at a separation (cells), and how many summits within reach it left open.

    tolerance: of sqrt(G/dgamma) along the fronts. near: whether they are already so near to rest that it is clear where
    new contact forms.

    Fronts come nearly to rest first; then all summits within reach make contact, until there is none, and fronts come
    to rest. A summit that loses the contact again stays open.

    Raises
    ------
    FullContact
        If the contact runs over the whole surface.
    NotConverged
        If an equilibrium is not found.
    """
    opening = COMPLIANCE * front.strength
    margin = _CLEARLY * opening
    stages = _stages(tolerance, margin, near)

    def in_windows(contact, gap, restless):
        return relaxed_in_windows(space, front, separation, contact, gap, restless)

    def mended(state, restless):
        return in_windows(state, state.gap, restless)

    tried = np.zeros(space.size, dtype=bool)
    stage = rounds = 0
    while True:
        accuracy, beyond = stages[stage]
        contact = front_at_rest(space, front, topography, separation, contact, accuracy, near=near, mended=mended)
        if np.sum(contact.fraction) > _NEARLY_ALL * space.size:
            raise FullContact("the contact runs over the whole surface")
        made, new, within = _new_contact(summits, contact, beyond, tried)
        if not len(new):
            stage += 1
            if stage == len(stages):
                return contact, within
            continue
        stage = 0
        # What comes within reach of new contact, clearly, makes contact before the whole comes to rest.
        while len(new):
            rounds += 1
            if rounds > _MAX_ROUNDS:
                raise NotConverged(f"no equilibrium after {rounds - 1} rounds of new contacts")
            tried[new] = True
            closed = contact.with_closed(made)
            relaxed = in_windows(closed, contact.gap, made)
            if relaxed is None:
                contact = closed
                break
            contact = held(space, topography, separation, relaxed, _ROUGHLY * opening, since=contact)
            made, new, _ = _new_contact(summits, contact, margin, tried)


def _stages(tolerance, margin, near):
    """Accuracies to which fronts come to rest, in order, and how clearly new contact is within reach then."""
    stages = [(_IN_SIGHT, margin), (_NEARLY_AT_REST, 0.0), (tolerance, 0.0)]
    if tolerance > _NEARLY_AT_REST:
        stages[1:] = [(tolerance, margin)]
    return stages[2:] if near else stages


def _new_contact(summits, state, margin, tried):
    """Contact within reach by more than a margin (cells) that was not tried: its cells, and those that count as tried.

    And how many are within reach, tried or not.
    """
    within, overlapping = _within_reach(summits, state, margin)
    seeds = np.union1d(summits.cell[within], overlapping)
    new = seeds[~tried[seeds]]
    jumping = within & ~tried[summits.cell]
    return np.union1d(summits.contacts(jumping, state.gap.shape[-1]), new), new, len(seeds)


def _within_reach(summits, state, margin):
    """Which summits out of contact are within reach, by more than a margin (cells), (k,); and cells that overlap."""
    gap = state.gap.ravel()
    touched = region(state.cells, gap.shape)
    within = (gap[summits.cell] - summits.above - summits.reach < -margin) & ~touched[summits.cell]
    # Without a summit, surfaces that overlap touch; beside a front this is its own business.
    touched[state.rim] = True
    return within, np.flatnonzero((gap < -margin) & ~touched)
