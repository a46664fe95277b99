"""Contact with adhesion at a given separation: fronts relax, and contact forms within reach of the attraction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from icha.boundary_elements.cells import mask_of
from icha.boundary_elements.elastic_contact import AdhesiveContact, Contact
from icha.boundary_elements.front_solver import TOLERANCES, FrontProblem, relax_front
from icha.boundary_elements.local_relaxation import relax_in_windows
from icha.contact.model import NotConverged

# Safety limit of the rounds of new contact; in theory there can be one round per cell.
_MAX_ROUNDS = 1000


@dataclass(frozen=True, eq=False)
class Summits:
    """Summits at which contact may form. Lengths in cells.

    Parameters
    ----------
    cell : (k,) int, of the grid.
    above : (k,), height of the summit above the node of its cell.
    reach : (k,), range of the attraction at the summit.
    radius : (k,), of the contact that a lone summit makes there; from a smaller one it could not grow.
    """

    cell: np.ndarray
    above: np.ndarray
    reach: np.ndarray
    radius: np.ndarray

    def contacts(self, chosen: np.ndarray, grid: int) -> np.ndarray:
        """Cells, ascending, that chosen summits (k,) touch with when they jump into contact."""
        touched = np.zeros((grid, grid), bool)
        # A larger disc would cover the surface with its periodic images.
        for cell, radius in zip(self.cell[chosen], np.minimum(self.radius[chosen], 0.75 * grid), strict=True):
            offset = np.arange(-int(radius), int(radius) + 1)
            rows, columns = np.nonzero(np.hypot(offset[:, None], offset) <= radius)
            row, column = divmod(int(cell), grid)
            touched[(row + offset[rows]) % grid, (column + offset[columns]) % grid] = True
        return np.flatnonzero(touched)

    def find_within_reach(self, state: AdhesiveContact, margin: float) -> tuple[np.ndarray, np.ndarray]:
        """Find summits out of contact that are in reach by more than a margin, (k,) bool; and cells that overlap so."""
        gap, touched = state.gap.ravel(), mask_of(state.cells, state.gap.shape).ravel()
        within = (gap[self.cell] - self.above - self.reach < -margin) & ~touched[self.cell]
        # Surfaces also touch where they overlap without a summit.
        # Neighbours of the contact are left to the front solver.
        touched[state.rim] = True
        return within, np.flatnonzero((gap < -margin) & ~touched)

    def new_contact(
        self, state: AdhesiveContact, margin: float, tried: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, int]:
        """Find new contact at places not tried before: its cells, the places, and a number.

        The number is that of all places within reach (summits and overlapping cells), tried ones included.
        """
        within, overlapping = self.find_within_reach(state, margin)
        places = np.union1d(self.cell[within], overlapping)
        new = places[~tried[places]]
        jumping = within & ~tried[self.cell]
        return np.union1d(self.contacts(jumping, state.gap.shape[-1]), new), new, len(places)


def solve_adhesive_contact(
    problem: FrontProblem, summits: Summits, contact: Contact, tolerance: float, *, close: bool = False
) -> tuple[AdhesiveContact, int]:
    """Solve the contact at a separation: relax the fronts, and form contact at all places within reach.

    A place that loses its new contact again stays open.

    Parameters
    ----------
    problem : the surface at a separation.
    summits : where contact may form.
    contact : to start from.
    tolerance : residual of the fronts.
    close : whether the contact is so close to equilibrium that it is clear where contact forms.

    Returns
    -------
    The contact, and the number of places within reach (summits and overlapping cells) that stayed open.

    Raises
    ------
    NotConverged
        If the equilibrium is not found.
    """
    margin = TOLERANCES.coarse * problem.front.critical_opening

    def relax_locally(state, far):
        return relax_in_windows(problem.space, problem.front, problem.separation, state, state.gap, far)

    stages = [(TOLERANCES.coarse, margin), (TOLERANCES.fine, 0.0), (tolerance, 0.0)]
    if tolerance > TOLERANCES.fine:
        stages[1:] = [(tolerance, margin)]
    first = len(stages) - 1 if close else 0
    tried, rounds, stage = np.zeros(problem.space.size, dtype=bool), 0, first
    while True:
        residual, distance = stages[stage]
        solved = relax_front(problem, contact, residual, close=close, relax_locally=relax_locally)
        formed, new, within = summits.new_contact(solved, distance, tried)
        if not len(new):
            stage += 1
            if stage == len(stages):
                return solved, within
            contact = solved
            continue
        stage = first
        # Contact that is clearly within reach of new contact forms before the whole front is relaxed.
        while len(new):
            rounds += 1
            if rounds > _MAX_ROUNDS:
                raise NotConverged(f"no equilibrium after {_MAX_ROUNDS} rounds of new contacts")
            tried[new] = True
            contact = _form_contact(problem, solved, formed)
            if not isinstance(contact, AdhesiveContact):
                break
            solved = contact
            formed, new, _ = summits.new_contact(solved, margin, tried)


def _form_contact(problem, contact, formed):
    """Close cells (m,); relax the fronts around them in windows and solve the elastic contact if windows pay."""
    closed = contact.close_cells(formed)
    relaxed = relax_in_windows(problem.space, problem.front, problem.separation, closed, contact.gap, formed)
    if relaxed is None:
        return closed
    return problem.solve_elastic(relaxed, TOLERANCES.displacement)
