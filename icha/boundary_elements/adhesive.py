"""Adhesive contact at a given separation: fronts move to equilibrium, and new contact forms by attraction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from icha.boundary_elements.cells import mask_of
from icha.boundary_elements.elastic_contact import AdhesiveContact, Contact
from icha.boundary_elements.front_solver import TOLERANCES, FrontProblem, relax_front
from icha.boundary_elements.local_relaxation import relax_in_windows
from icha.contact.model import NotConverged

# Largest number of rounds of new contact, for safety; in theory there can be one round per cell.
_MAX_ROUNDS = 1000


@dataclass(frozen=True, eq=False)
class Summits:
    """Summits at which new contact may form; lengths in cell sizes.

    Parameters
    ----------
    cell : (k,) int, grid cell of each summit.
    above : (k,), height of the summit above the grid node of its cell.
    reach : (k,), largest gap at which the summit jumps into contact.
    radius : (k,), contact radius of a lone summit after its jump. A disc of this radius closes, but at most a quarter
        of the side. A smaller disc could open.
    """

    cell: np.ndarray
    above: np.ndarray
    reach: np.ndarray
    radius: np.ndarray

    def contacts(self, chosen: np.ndarray, grid: int) -> np.ndarray:
        """Return the cells, ascending, that close when the chosen summits, (k,) bool, jump in: discs around them."""
        touched = np.zeros((grid, grid), bool)
        # A larger disc and its periodic images would leave no room for the gap, whose volume the separation fixes.
        for cell, radius in zip(self.cell[chosen], np.minimum(self.radius[chosen], 0.25 * grid), strict=True):
            offset = np.arange(-int(radius), int(radius) + 1)
            rows, columns = np.nonzero(np.hypot(offset[:, None], offset) <= radius)
            row, column = divmod(int(cell), grid)
            touched[(row + offset[rows]) % grid, (column + offset[columns]) % grid] = True
        return np.flatnonzero(touched)

    def find_within_reach(self, state: AdhesiveContact, margin: float) -> tuple[np.ndarray, np.ndarray]:
        """Find open summits with gap < reach - margin, (k,) bool, and cells away from contact with gap < -margin."""
        gap, touched = state.gap.ravel(), mask_of(state.cells, state.gap.shape).ravel()
        within = (gap[self.cell] - self.above - self.reach < -margin) & ~touched[self.cell]
        # The surfaces also touch where they overlap without a summit. The front solver closes neighbours of contact.
        # Overlaps larger than the displacement error are already in contact, so only margin 0 finds overlapping cells.
        touched[state.rim] = True
        return within, np.flatnonzero((gap < -margin) & ~touched)

    def new_contact(
        self, state: AdhesiveContact, margin: float, tried: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, int]:
        """Find new contact at summits and overlapping cells within reach by more than a margin, if not `tried` before.

        Return the cells to close, the cells that count as tried from now on, and the number of all cells within reach,
        tried before or not. Of a summit, only its own cell counts as tried, not the disc around it.
        """
        within, overlapping = self.find_within_reach(state, margin)
        candidates = np.union1d(self.cell[within], overlapping)
        new = candidates[~tried[candidates]]
        jumping = within & ~tried[self.cell]
        return np.union1d(self.contacts(jumping, state.gap.shape[-1]), new), new, len(candidates)


def solve_adhesive_contact(
    problem: FrontProblem, summits: Summits, contact: Contact, tolerance: float, *, nearby: bool = False
) -> tuple[AdhesiveContact, int]:
    """Solve the adhesive contact at a separation: relax the fronts and close cells within reach of the attraction.

    Each summit or cell is closed at most once in a call: if it loses contact again, it stays open. The fronts are
    relaxed in stages, to TOLERANCES.coarse, TOLERANCES.fine and `tolerance`. New contact starts the stages again.

    Parameters
    ----------
    problem : the surface, the law of its front, and the separation.
    summits : summits at which contact may form.
    contact : initial contact.
    tolerance : largest allowed residual of the fronts. If it exceeds TOLERANCES.fine, the stage to TOLERANCES.fine
        is left out, and contact forms only where the gap is below the reach by TOLERANCES.coarse critical openings.
    nearby : whether the initial contact is near equilibrium; then the coarser stages are skipped.

    Returns
    -------
    The contact, and the number of cells within reach (of summits, or overlapping) that stay open in the last stage.

    Raises
    ------
    NotConverged
        If no equilibrium is found.
    """
    margin = TOLERANCES.coarse * problem.front.critical_opening

    def relax_around(state, far):
        return relax_in_windows(problem.space, problem.front, problem.separation, state, state.gap, far)

    stages = [(TOLERANCES.coarse, margin), (TOLERANCES.fine, 0.0), (tolerance, 0.0)]
    if tolerance > TOLERANCES.fine:
        stages[1:] = [(tolerance, margin)]
    first = len(stages) - 1 if nearby else 0
    tried, rounds, stage = np.zeros(problem.space.size, dtype=bool), 0, first
    while True:
        residual, distance = stages[stage]
        solved = relax_front(problem, contact, residual, nearby=nearby, relax_around=relax_around)
        formed, new, within = summits.new_contact(solved, distance, tried)
        if not len(new):
            stage += 1
            if stage == len(stages):
                return solved, within
            contact = solved
            continue
        stage = first
        # New contact can bring further summits clearly within reach. Close these before relaxing the whole front.
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
    """Close cells `formed`, (m,), relax the front near them in windows and solve; without windows, only close them."""
    closed = contact.close_cells(formed)
    relaxed = relax_in_windows(problem.space, problem.front, problem.separation, closed, contact.gap, formed)
    if relaxed is None:
        return closed
    return problem.solve_elastic(relaxed, TOLERANCES.displacement)
