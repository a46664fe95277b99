"""The front's equilibrium at a given separation: Newton's steps of pressures and fractions together, down in energy.

The energy U(f) - dgamma A(f) falls with every step, so that what is found is a local minimum that can be reached from
where the search began; where the front is unstable it runs until it rests. A step solves the linearised equations of
contact (displacement given), of the front (tension = f strength) and of its strength; where these lead up, the bonds
are made softer in them, which shortens the step (Levenberg and Marquardt).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from icha.boundary_elements.elastic_equilibrium import Held, held, intensity
from icha.boundary_elements.elasticity import NOTHING, Contact, Topography
from icha.boundary_elements.front import COMPLIANCE, Front, adhesive_areas, neighbour_weights
from icha.boundary_elements.kernel import HalfSpace, Whole
from icha.boundary_elements.patches import adjacent, merged, region
from icha.contact.model import FullContact, NotConverged
from icha.contact.models import MODELS, REFERENCE_MODEL

# Largest deviation of sqrt(G/dgamma) along a front in equilibrium.
FRONT_TOLERANCE = 1e-6
# Of the displacement in contact, over the gap at which a cell is free: on the way to rest, over the error of the front,
# at most; and at rest, over the tolerance of the front.
_GAP_TO_FRONT, _GAP_TO_TOLERANCE = 1e-1, 1e-3
# Of the displacement, near to rest and where energies are in doubt. Relative change of an energy that is rounding.
_NEAR, _SAME_ENERGY = 1e-5, 1e-12
# Of a step, so much of its size times sqrt(G/dgamma) leads neither up nor down.
_LEVEL = 1e-11
# Pressures that are found again are so much better.
_FINER = 0.03
_MAX_STEPS = 400
_MAX_KRYLOV = 60
# How far the error of the half-space lies below an accuracy for which it does not count; what a round without it gains
# at least, or there are no more.
_FAR_BELOW, _LEAST_GAIN = 10, 0.5
# Accuracy of the linear equations: in the last step so many times that of the displacement at rest, over the error of
# the front; at worst, and at best.
_LAST = 5
COARSE, FINE = 1e-1, MODELS[REFERENCE_MODEL].stiffness_error
# The rows of the front, in the preconditioner: what is left of a bond beside the half-space.
_NET = 0.6
# A deviation of sqrt(G/dgamma) that is mended where it is. Least damping of bonds there: fronts run, and a whole step
# would lead up.
_RESTLESS, _RUNNING = 0.03, 0.2
# The same where there are no more such cells than this part of the front. So often, at most, are few mended before the
# whole front moves again.
_UNEASY, _FEW, _MOST_MENDINGS = 1e-3, 0.01, 5
_FIRST_DAMPING, _LARGEST_DAMPING = 0.1, 1e8
# Damping of the first step of a front of which more than this part is restless: without, it would lead far up.
_FAR_DAMPING, _MANY = 0.2, 0.5
# Smallest part of a step that is tried; what still leads up is damped more, which is cheaper than many short steps.
_SMALLEST_STEP = 0.5


@dataclass(frozen=True, eq=False)
class Moving:
    """The cells that take part in a step: those in contact, and those beside it that close. Arrays of length k.

    cells: rising. fraction, pressure, gap, around: of each. intensity: of stress at the front over the critical one,
    K/K_c = sqrt(G/dgamma). free: whether the front there would close or open.
    """

    cells: np.ndarray
    fraction: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    around: np.ndarray
    intensity: np.ndarray
    free: np.ndarray

    def moved(self, change: np.ndarray, pressed: np.ndarray) -> Contact:
        """The contact after changes of fraction and pressure."""
        return Contact(self.cells, self.fraction, self.pressure).changed(change, pressed)

    @property
    def front(self) -> np.ndarray:
        """Whether a cell is free or partly in contact."""
        return self.free | ((self.fraction > 0) & (self.fraction < 1))

    @property
    def error(self) -> float:
        """Largest deviation of sqrt(G/dgamma) from 1 where the front is free to move."""
        return float(np.max(np.abs(self.intensity - 1)[self.free], initial=0.0))


def moving(front: Front, state: Held) -> Moving:
    """The cells of a state that take part in a step."""
    inside, outside = intensity(front, state)
    closed = region(state.cells[state.fraction >= 1], state.gap.shape).ravel()
    opening = inside > 1
    around = adjacent(state.cells[opening], state.gap.shape[-1])
    opening[opening] = ~np.all(closed[around], axis=0) | (state.fraction[opening] < 1)
    free = opening | ((inside < 1) & (state.fraction < 1))
    closing = outside < 1
    cells, fraction, pressure, around, off, free = merged(
        state.cells,
        state.rim[closing],
        (state.fraction, 0.0),
        (state.pressure, 0.0),
        (state.around, state.around_rim[closing]),
        (inside, outside[closing]),
        (free, True),
    )
    return Moving(cells, fraction, pressure, state.gap.ravel()[cells], around, off, free)


def front_residual(front: Front, state: Held) -> float:
    """Largest deviation of sqrt(G/dgamma) from 1 where the front is free to move."""
    return moving(front, state).error


def front_at_rest(
    space: HalfSpace,
    front: Front,
    topography: Topography,
    separation: float,
    contact: Contact,
    tolerance: float,
    *,
    near: bool = False,
    most_steps: int | None = None,
    beyond: np.ndarray | None = None,
    mended: Callable[[Held, np.ndarray], Contact | None] = lambda state, restless: None,
) -> Held:
    """The contact in equilibrium at a separation (cells), down in energy from that of a given one.

    contact: if it is `Held`, at this separation. tolerance: of sqrt(G/dgamma) along the front. near: whether it is not
    far from rest. most_steps: after which it is returned as it is. beyond: of a window, what the contact outside
    adds to the mean fraction around every cell, a field. mended: where cells, (m,), of a contact are far from rest, the
    contact with these nearer to it, if a short way leads there.

    Raises
    ------
    NotConverged
        If it is not found.
    """
    given = _Given(space, front, topography, separation, beyond)
    enough = _GAP_TO_TOLERANCE * tolerance
    coarse = _NEAR if near else _GAP_TO_FRONT
    state = contact if isinstance(contact, Held) else given.at(contact, max(enough, coarse))
    search = _Search(state, most_off=coarse)
    for number in range(most_steps or _MAX_STEPS):
        state = search.state
        now = moving(front, state)
        if now.error <= tolerance:
            if state.off <= enough * given.critical_opening:
                return state
            # The pressures are still those of a coarse beginning, and the error theirs.
            search = replace(search, state=given.at(state, enough, state))
            continue
        restless = _restless(now)
        if number == 0 and np.count_nonzero(restless) > _MANY * np.count_nonzero(now.front):
            search = replace(search, damping=_FAR_DAMPING)
        if restless.any() and search.mendings < (_MOST_MENDINGS if _are_few(restless, now) else 1):
            off = max(enough, min(coarse, 0.1 * _GAP_TO_FRONT, _off(now)))
            search = _after_mending(given, search, mended(state, now.cells[restless]), off)
            if search.state is not state:
                continue
        search = _after_one_step(given, search, now, enough, coarse)
    if most_steps:
        return search.state
    raise NotConverged(f"the front did not come to rest (sqrt(G/dgamma) is off by {now.error:.1e})")


def _restless(now):
    """Which cells of the front are far from rest: farther than nearly all others, or than it is good for any."""
    off = np.where(now.free, np.abs(now.intensity - 1), 0.0)
    uneasy = off > _UNEASY
    return uneasy if _are_few(uneasy, now) else off > _RESTLESS


def _are_few(cells, now):
    """Whether cells are no more than a small part of the front."""
    return np.count_nonzero(cells) <= _FEW * np.count_nonzero(now.front)


def _off(now):
    """How accurate displacements should be after a step, over the gap at which a cell is free."""
    return now.error * min(_GAP_TO_FRONT, max(now.error, FINE))


@dataclass(frozen=True, eq=False)
class _Search:
    """How far a front on its way to rest has come.

    damping: of bonds in the next step. most_off: of the displacement, over the gap at which a cell is free, at most.
    mendings: of places far from rest, since the whole front has moved.
    """

    state: Held
    most_off: float
    damping: float = 0.0
    mendings: int = 0


def _after_mending(given, search, contact, off):
    """The search after restless cells were mended, which gave a contact or None; at its state if that is not lower.

    off: accuracy of the displacement, over the gap at which a cell is free.
    """
    without = replace(search, mendings=_MOST_MENDINGS)
    if contact is None:
        return without
    try:
        new = given.at(contact, off, search.state)
    except FullContact:
        # Where pressures around it stay as they are, the last gap may close that else does not.
        return without
    if not given.is_lower(new, search.state):
        return without
    return replace(search, state=new, damping=0.0, mendings=search.mendings + 1)


def _after_one_step(given, search, now, enough, coarse):
    """The search after a step of Newton's, or with more damping if that leads up in energy.

    enough, coarse: accuracy of the displacement at rest and far from it, over the gap at which a cell is free.
    """
    state, damping = search.state, search.damping
    accuracy = min(COARSE, max(FINE, now.error, _LAST * enough / now.error))
    step = _down(given.space, given.front, now, damping, accuracy)
    if step is None:
        if state.off > enough * given.critical_opening:
            # Perhaps only since the pressures, and with them the intensities, are not good enough.
            state = given.at(state, max(enough, _FINER * state.off / given.critical_opening), state)
        return replace(search, state=state, damping=_more(damping))
    off = max(enough, min(search.most_off, _off(now)))
    smallest = _SMALLEST_STEP if search.most_off <= _NEAR else 1.0
    lower = _lower_along(given, state, now, step, off, smallest)
    if lower is not None:
        state, part = lower
        if part == 1.0:
            damping = damping / 4 if damping > 0.01 else 0.0
        return _Search(state, coarse, damping)
    if search.most_off > _NEAR:
        # Energies of coarse pressures are not to be trusted that far.
        search = replace(search, state=given.at(state, max(enough, _NEAR), state), most_off=_NEAR)
    return replace(search, damping=_more(4 * damping))


@dataclass(frozen=True, eq=False)
class _Given:
    """What a front on its way to rest is given, as `front_at_rest` is."""

    space: HalfSpace
    front: Front
    topography: Topography
    separation: float
    beyond: np.ndarray | None

    @property
    def critical_opening(self):
        """Of a bond: the gap at which a cell is free, in cells."""
        return COMPLIANCE * self.front.strength

    def at(self, contact, off, since=None):
        """A contact in elastic equilibrium; its displacement is accurate to this part of the critical opening.

        since: another one that is not far away.
        """
        tolerance = off * self.critical_opening
        return held(self.space, self.topography, self.separation, contact, tolerance, beyond=self.beyond, since=since)

    def energy(self, state):
        """Elastic energy less that of adhesion, in E* cells^3."""
        # What lies beyond loses perimeter where it meets what lies here, as this does.
        around = state.around if self.beyond is None else state.around + self.beyond.ravel()[state.cells]
        return state.energy - self.front.adhesion_length * float(np.sum(adhesive_areas(state.fraction, around)))

    def is_lower(self, new, old):
        """Whether a state is not above another in energy, as far as this is known."""
        energy = self.energy(old)
        same = _SAME_ENERGY * abs(energy) + NOTHING * self.front.adhesion_length
        return self.energy(new) <= energy + new.unsure + old.unsure + same


def _lower_along(given, state, now, step, off, smallest):
    """A state lower in energy after all of a step, half of it, a quarter ..., and after which part; None if none is."""
    change, pressed = step
    part = 1.0
    while part >= smallest:
        new = given.at(now.moved(part * change, part * pressed), off, state)
        if given.is_lower(new, state):
            return new, part
        part /= 2
    return None


def _more(damping):
    damping = max(2 * damping, _FIRST_DAMPING)
    if damping > _LARGEST_DAMPING:
        raise NotConverged("no step of the front leads down in energy")
    return damping


def _down(space, front, now, damping, accuracy):
    """Newton's step if it leads down in energy, as far as G - dgamma tells, against the change of contact."""
    change, pressed = _step(space, front, now, damping, accuracy)
    if np.sum((now.intensity**2 - 1) * change) > _LEVEL * np.abs(change).sum():
        return None
    return change, pressed


def _step(space, front, now, damping, accuracy):
    """Newton's step: changes of fraction and pressure, (k,)."""
    local = np.where(np.abs(now.intensity - 1) > _RESTLESS, max(damping, _RUNNING), damping)
    linear = Linearised(space, front, now.cells, now.front, now.fraction, now.around, local)
    # To the tension that the law wants at the present fraction, and from there with the law.
    strengths = front.strengths(now.around)
    missing = np.where(now.front, strengths * now.fraction + now.pressure, 0.0)
    moved = linear.near.displacement(missing.astype(np.float32))
    bond = np.where(now.front, COMPLIANCE * strengths * (1 - now.fraction), 0.0)
    change, pressure = linear.solve(moved + bond - now.gap, accuracy)
    return change, pressure - missing


def tangent(
    space: HalfSpace, front: Front, cells: np.ndarray, fraction: np.ndarray, around: np.ndarray, accuracy: float
) -> tuple[np.ndarray, np.ndarray]:
    """Changes of fraction and of pressure, (k,), with the mean separation: per cell, and in E* per cell."""
    linear = Linearised(space, front, cells, fraction < 1, fraction, around, np.zeros(len(cells)))
    return linear.solve(np.full(len(cells), -1.0), accuracy)


class Linearised:
    """The equations of contact and front, linearised at a state; solved in single precision.

    Unknowns are the pressures of closed cells and, times the strength, the fractions of those at the front.
    """

    def __init__(self, space, front, cells, at_front, fraction, around, damping):
        """Cells; whether they are at the front, fractions of contact there and around, damping: softer bonds. (k,)."""
        self.space, self.front, self.cells = space, front, cells
        self.closed, self.at_front = ~at_front, np.flatnonzero(at_front)
        self.own = front.strengths(around[self.at_front]).astype(np.float32)
        self.fraction = fraction[self.at_front].astype(np.float32)
        self.soft = (1 + damping[self.at_front]).astype(np.float32)
        self.near = space.nearly(cells)
        self.weights = neighbour_weights(cells[self.at_front], space.shape)

    def solve(self, right: np.ndarray, accuracy: float) -> tuple[np.ndarray, np.ndarray]:
        """Changes of fraction and pressure, (k,), for given right-hand sides, to a relative accuracy.

        Raises
        ------
        NotConverged
            If they are not finite.
        """
        # Of order one, or squares of what is left at last would be nothing in single precision on flat surfaces.
        scale = 2.0 ** np.frexp(np.abs(right).max(initial=0.0))[1]
        right = (right / scale).astype(np.float32)
        wanted = np.linalg.norm(right)
        solution, left, off = np.zeros_like(right), right, wanted
        while not off <= accuracy * wanted:
            before = off
            solution = solution + self._nearly_solved(left, max(accuracy * wanted / off, self.near.error))
            if accuracy >= _FAR_BELOW * self.near.error:
                break
            left = right - self._displaced(Whole(self.space, self.cells), solution)
            off = np.linalg.norm(left)
            if not off <= _LEAST_GAIN * before:
                break
        if not np.isfinite(solution).all():
            raise NotConverged(f"the linear equations of {len(self.cells)} cells have no finite solution")
        pressure, _, _ = self._spread(solution)
        fraction = np.zeros(len(solution))
        fraction[self.at_front] = scale * (solution[self.at_front] / (self.front.strength or 1.0))
        return fraction, scale * pressure.astype(float)

    def _spread(self, unknowns):
        """Changes of pressure; of strength and of tension at the front."""
        fraction = unknowns[self.at_front] / np.float32(self.front.strength or 1.0)
        if not len(fraction):
            return unknowns, fraction, fraction
        stronger = self.front.strength_change(self.own, self.weights @ fraction)
        pull = self.own * fraction + self.fraction * stronger
        pressure = unknowns.copy()
        pressure[self.at_front] = -pull
        return pressure, stronger, pull

    def _nearly_solved(self, right, accuracy):
        size = (len(self.cells), len(self.cells))
        solution, _ = gmres(
            LinearOperator(size, partial(self._displaced, self.near), dtype=np.float32),
            right,
            M=LinearOperator(size, self._nearly_inverse, dtype=np.float32),
            rtol=accuracy,
            restart=_MAX_KRYLOV,
            maxiter=1,
        )
        return solution

    def _displaced(self, half_space, unknowns):
        pressure, stronger, pull = self._spread(unknowns)
        moved = half_space.displacement(pressure)
        moved[self.at_front] += np.float32(COMPLIANCE) * (self.soft * pull - stronger)
        return moved

    def _nearly_inverse(self, right):
        result = self.near.inverse(np.where(self.closed, right, np.float32(0)))
        result[self.at_front] = right[self.at_front] / np.float32(_NET * COMPLIANCE)
        return result
