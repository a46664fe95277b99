"""The front's equilibrium at a given separation: Newton's steps of pressures and fractions together, down in energy.

The energy U(f) - dgamma A(f) falls with every step, so that what is found is a local minimum that can be reached from
where the search began; where the front is unstable it runs until it rests. A step solves the linearised equations of
contact (displacement given), of the front (tension = f strength) and of its strength; where these lead up, the bonds
are made softer in them, which shortens the step (Levenberg and Marquardt).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from icha.boundary_elements.elasticity import Held, front_tension, held
from icha.boundary_elements.front import COMPLIANCE, Front, areas, neighbour_modes
from icha.boundary_elements.kernel import HalfSpace, filtered
from icha.contact.failures import NotConverged

# Largest deviation of sqrt(G/dgamma) along a front in equilibrium.
FRONT_TOLERANCE = 1e-9
# So near to equilibrium Newton's steps need no watching.
_NEARLY = 1e-7
# Of the displacement in contact, over the gap at which a cell is free.
GAP_TOLERANCE = 1e-11
# The same on the way, over the error of the front that is to be mended.
_GAP_TO_FRONT = 1e-5
_MAX_STEPS = 400
_MAX_KRYLOV = 60
# Of the linear equations: never better than needed, and never worse.
_LOOSE, _TIGHT = 1e-2, 1e-4
# The rows of the front, in the preconditioner: what is left of a bond beside the half-space.
_NET = 0.6
_FIRST_DAMPING, _LARGEST_DAMPING = 0.1, 1e8
_SMALLEST_STEP = 2.0**-12


def beside(cells: np.ndarray) -> np.ndarray:
    """The cells and those that share an edge with one of them, (n, n) of bool, periodic."""
    wide = cells.copy()
    for axis in (0, 1):
        for way in (-1, 1):
            wide |= np.roll(cells, way, axis)
    return wide


def moving(front: Front, state: Held) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cells whose front would close or open, (n, n) of bool each, and sqrt(G/dgamma)."""
    tension = front_tension(front, state)
    touching = state.fraction > 0
    closing = (state.fraction < 1) & (tension < 1) & beside(touching)
    opening = touching & (tension > 1) & beside(state.fraction < 1)
    return closing, opening, tension


def front_residual(front: Front, state: Held) -> float:
    """Largest deviation of sqrt(G/dgamma) from 1 where the front is free to move."""
    closing, opening, tension = moving(front, state)
    off = np.abs(tension - 1)[closing | opening]
    return float(np.max(off, initial=0.0))


def front_at_rest(
    space: HalfSpace,
    front: Front,
    heights: np.ndarray,
    separation: float,
    state: Held,
    tolerance: float,
) -> Held:
    """The contact in equilibrium at a separation (cells), down in energy from that of a state.

    tolerance: of sqrt(G/dgamma) along the front.

    Raises
    ------
    NotConverged
        If it is not found.
    """
    reach = COMPLIANCE * front.strength

    def at(fraction, pressure, error):
        off = max(GAP_TOLERANCE, _GAP_TO_FRONT * min(error, 1.0)) * reach
        return held(space, heights, separation, fraction, pressure, off)

    def energy(state):
        return state.energy - front.adhesion_length * float(np.sum(areas(state.fraction, state.around)))

    state = at(state.fraction, state.pressure, 1.0)
    level, damping, solved = energy(state), 0.0, 1.0
    for _ in range(_MAX_STEPS):
        closing, opening, tension = moving(front, state)
        free = closing | opening
        error = float(np.max(np.abs(tension - 1)[free], initial=0.0))
        if error <= tolerance and solved <= tolerance:
            return state
        if error <= _NEARLY < solved or error <= tolerance:
            # The pressures may still be those of a coarse beginning, and the error theirs.
            state, solved = at(state.fraction, state.pressure, 0.0), 0.0
            level = energy(state)
            continue
        at_front = free | ((state.fraction > 0) & (state.fraction < 1))
        accuracy = min(_LOOSE, max(_TIGHT, 0.1 * error))
        while True:
            change, pressed = _step(space, front, state, at_front, damping, accuracy)
            # Down in energy, as far as tensions tell: G - dgamma against the change of contact.
            if np.vdot(tension**2 - 1, change) <= GAP_TOLERANCE * np.abs(change).sum():
                break
            damping = _more(damping)
        step = 1.0
        while step >= _SMALLEST_STEP:
            fraction = np.clip(state.fraction + step * change, 0.0, 1.0)
            new = at(fraction, state.pressure + step * pressed, error)
            new_level = energy(new)
            if new_level <= level + 1e-12 * abs(level):
                break
            step /= 2
        else:
            damping = _more(4 * damping)
            continue
        if step == 1.0:
            damping = damping / 4 if damping > 0.01 else 0.0
        state, level, solved = new, new_level, error
    raise NotConverged(f"the front did not come to rest (sqrt(G/dgamma) is off by {error:.1e})")


def _more(damping):
    damping = max(2 * damping, _FIRST_DAMPING)
    if damping > _LARGEST_DAMPING:
        raise NotConverged("no step of the front leads down in energy")
    return damping


def _step(space, front, state, at_front, damping, accuracy):
    """Newton's step: changes of fraction and pressure, (n, n)."""
    linear = Linearised(space, front, state, at_front, damping)
    # To the tension that the law wants at the present fraction, and from there with the law.
    strengths = linear.strengths
    missing = strengths * linear.fraction + state.pressure.ravel()[linear.front_cells]
    moved = space.displacement(linear.on_grid(None, missing, float)).ravel()
    gap = state.gap.ravel()[linear.front_cells]
    right = np.concatenate(
        [moved[linear.closed_cells], moved[linear.front_cells] + COMPLIANCE * strengths * (1 - linear.fraction) - gap]
    )
    change, pressure = linear.solve(right, accuracy)
    pressure.ravel()[linear.front_cells] -= missing
    return change, pressure


def tangent(space: HalfSpace, front: Front, state: Held) -> tuple[np.ndarray, np.ndarray]:
    """Changes of fraction and of pressure, (n, n), with the mean separation: per cell, and in E* per cell."""
    at_front = (state.fraction > 0) & (state.fraction < 1)
    linear = Linearised(space, front, state, at_front, 0.0)
    return linear.solve(-np.ones(linear.size), _TIGHT)


class Linearised:
    """The equations of contact and front, linearised at a state; solved in single precision.

    Unknowns are the pressures of closed cells and, times the strength, the fractions of those at the front.
    """

    def __init__(self, space: HalfSpace, front: Front, state: Held, at_front: np.ndarray, damping: float):
        """Note which cells are closed and which are at the front, (n, n) of bool; damping: softer bonds."""
        self.space, self.front, self.damping = space, front, damping
        self.closed_cells = np.flatnonzero((state.fraction >= 1) & ~at_front)
        self.front_cells = np.flatnonzero(at_front)
        self.size = len(self.closed_cells) + len(self.front_cells)
        self.strengths = front.strengths(state.around).ravel()[self.front_cells]
        self.fraction = state.fraction.ravel()[self.front_cells]

    def solve(self, right: np.ndarray, accuracy: float) -> tuple[np.ndarray, np.ndarray]:
        """Changes of fraction and pressure, (n, n), for given right-hand sides, to a relative accuracy."""
        size = (self.size, self.size)
        solution, _ = gmres(
            LinearOperator(size, self._displaced, dtype=float),
            right,
            M=LinearOperator(size, self._nearly_inverse, dtype=float),
            rtol=accuracy,
            restart=_MAX_KRYLOV,
            maxiter=1,
        )
        fraction, pressure, _, _ = self._spread(solution)
        return self.on_grid(None, fraction, float), self.on_grid(*pressure, float)

    def on_grid(self, closed: np.ndarray | None, at_front: np.ndarray | None, kind: type = np.float32) -> np.ndarray:
        """A field, (n, n), of given values on closed cells and at the front."""
        field = np.zeros((self.space.grid, self.space.grid), kind)
        if closed is not None:
            field.ravel()[self.closed_cells] = closed
        if at_front is not None:
            field.ravel()[self.front_cells] = at_front
        return field

    def _spread(self, unknowns):
        """Changes of fraction at the front; of pressure on closed cells and at the front; of strength and tension."""
        closed = len(self.closed_cells)
        fraction = unknowns[closed:] / (self.front.strength or 1.0)
        stronger = np.zeros(len(fraction))
        if len(fraction):
            around = filtered(self.on_grid(None, fraction), neighbour_modes(self.space.grid))
            stronger = self.front.strength_change(self.strengths, around.ravel()[self.front_cells])
        pull = self.strengths * fraction + self.fraction * stronger
        return fraction, (unknowns[:closed], -pull), stronger, pull

    def _displaced(self, unknowns):
        _, pressure, stronger, pull = self._spread(unknowns)
        moved = self.space.displacement(self.on_grid(*pressure)).ravel()
        held = COMPLIANCE * ((1 + self.damping) * pull - stronger)
        return np.concatenate([moved[self.closed_cells], moved[self.front_cells] + held])

    def _nearly_inverse(self, right):
        closed = len(self.closed_cells)
        pressure = self.space.pressure(self.on_grid(right[:closed], None)).ravel()
        return np.concatenate([pressure[self.closed_cells], right[closed:] / (_NET * COMPLIANCE)])
