"""Loop of a sphere whose work of adhesion depends on the direction, and its fit to measured points.

Loading follows the equilibria of Johnson, Kendall and Roberts with the advancing work of adhesion. From the turning
point, the contact is stuck: its radius is constant, and the force decreases with the stiffness 2 E* a of a flat punch,
until the energy release rate is the receding work of adhesion. Then unloading follows the equilibria with this work (D.
Maugis and M. Barquins, J. Phys. D: Appl. Phys. 11 (1978) 1989, doi:10.1088/0022-3727/11/14/011).

All measured quantities have errors, so a fit minimises the squared distances between points and curves, each quantity
divided by its error (P. T. Boggs, R. H. Byrd and R. B. Schnabel, SIAM J. Sci. Stat. Comput. 8 (1987) 1052,
doi:10.1137/0908085). Intervals come from fits to points with residuals of random sign, the wild bootstrap (C. F. J. Wu,
Ann. Stat. 14 (1986) 1261, doi:10.1214/aos/1176350142), because the errors of points may differ.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from icha.references.indentation import (
    ContactState,
    punch_force,
    sphere_contact,
    sphere_jump_off,
    sphere_radius_at_force,
)

# Branches of the loop.
LOADING, STUCK, RECEDING = 0, 1, 2
# Smallest number of points that determine a work of adhesion.
LEAST_POINTS = 3
# States of each branch among which the nearest one is searched first, and the largest radius among them, divided by
# that of the turning point. The smallest radius is not below this share of the radius at the turning point.
_STATES, _BEYOND, _SMALLEST = 300, 1.3, 1e-3
# Factors of the first guesses of contact modulus and receding work, and the ratio of advancing to receding work.
_GUESSES = (0.5, 1.0, 2.0), (1.0, 3.0), (0.03, 0.3, 1.0)
# Number of guesses that are refined, and of assignments of points to branches.
_REFINED, _ASSIGNMENTS = 3, 20
# Number of steps of a fit: of a guess, of the best guess, and of a resample.
_FIRST_STEPS, _STEPS, _RESAMPLE_STEPS = 6, 60, 10
# Step of numerical derivatives; smallest relative decrease of the sum of squares; largest damping.
_DIFFERENCE, _GAIN, _DAMPING = 1e-6, 1e-12, 1e8
# Largest number of points of all resamples that are fitted together, which limits the memory.
_TOGETHER = 200_000


class Loop(NamedTuple):
    """Parameters of a loop; single numbers or arrays.

    Attributes
    ----------
    contact_modulus : E*, Pa.
    advancing_work, receding_work : works of adhesion, J/m^2.
    stuck_radius : contact radius at the turning point, m.
    offset : indentation of the instrument where the sphere touches the undeformed plane, m.
    """

    contact_modulus: np.ndarray | float
    advancing_work: np.ndarray | float
    receding_work: np.ndarray | float
    stuck_radius: np.ndarray | float
    offset: np.ndarray | float

    def state(self, radius, branch, contact_radius, withdrawal) -> ContactState:
        """Return the states of a sphere with this radius, m.

        Parameters
        ----------
        branch : LOADING, STUCK or RECEDING.
        contact_radius : m; for stuck contacts `stuck_radius`.
        withdrawal : distance from the turning point, m; 0 for other than stuck contacts.
        """
        work = np.where(branch == RECEDING, self.receding_work, self.advancing_work)
        found = sphere_contact(contact_radius, radius, self.contact_modulus, work)
        force = found.force - punch_force(withdrawal, contact_radius, self.contact_modulus)
        return ContactState(found.contact_radius, found.indentation - withdrawal + self.offset, force)

    def trace(self, radius, branch, beyond=1.0) -> tuple[np.ndarray, np.ndarray]:
        """Return contact radii and withdrawals along a branch; loading ends at `beyond` times the stuck radius."""
        top = self.stuck_radius
        if branch == STUCK:
            advancing, receding = (
                sphere_contact(top, radius, self.contact_modulus, work).indentation
                for work in (self.advancing_work, self.receding_work)
            )
            withdrawal = np.linspace(0.0, max(float(advancing - receding), 0.0), _STATES)
            return np.full(_STATES, float(top)), withdrawal
        work = self.receding_work if branch == RECEDING else self.advancing_work
        least = max(float(sphere_jump_off(radius, self.contact_modulus, work).contact_radius), _SMALLEST * top)
        largest = top * (beyond if branch == LOADING else 1.0)
        return np.geomspace(min(least, largest), largest, _STATES), np.zeros(_STATES)


class LoopFit(NamedTuple):
    """Fit of a loop to points.

    Attributes
    ----------
    loop : fitted loop.
    branch : (n,) int, branch of each point.
    states : (n,) nearest state of the loop to each point.
    resampled : loops of the resamples, arrays.
    """

    loop: Loop
    branch: np.ndarray
    states: ContactState
    resampled: Loop


@dataclass(frozen=True)
class _Problem:
    """Points and units of a fit. Arrays have the axes resample, point, quantity.

    Unknowns are the logarithms of modulus and stuck radius, the roots of the works of adhesion, and the offset, in
    units that the points give. Each point has one more unknown, its place on the curve: the logarithm of the contact
    radius or, for stuck contacts, the withdrawal.
    """

    radius: float
    names: tuple[str, ...]
    errors: np.ndarray
    modulus: float
    size: float

    @property
    def work(self) -> float:
        """Unit of works of adhesion, J/m^2: Hertz's force at the contact radius `size` is the pull-off force."""
        return 4 / 3 * self.modulus * self.size**3 / self.radius / (1.5 * math.pi * self.radius)

    @property
    def depth(self) -> float:
        """Unit of indentations, m: Hertz's indentation at the contact radius `size`."""
        return self.size**2 / self.radius

    def loop(self, unknown) -> Loop:
        """Return the loops of unknowns with the shape (resample, 5), as columns."""
        modulus, advancing, receding, size, offset = np.moveaxis(np.asarray(unknown), -1, 0)[..., None]
        works = self.work * advancing**2, self.work * receding**2
        return Loop(self.modulus * np.exp(modulus), *works, self.size * np.exp(size), self.depth * offset)

    def unknown(self, loop: Loop) -> np.ndarray:
        """Return the unknowns of a loop."""
        logarithms = math.log(loop.contact_modulus / self.modulus), math.log(loop.stuck_radius / self.size)
        roots = math.sqrt(loop.advancing_work / self.work), math.sqrt(loop.receding_work / self.work)
        return np.array([logarithms[0], *roots, logarithms[1], loop.offset / self.depth])

    def states(self, unknown, place, branch) -> ContactState:
        """Return the states at places on the curves."""
        loop = self.loop(unknown)
        stuck = branch == STUCK
        contact_radius = np.where(stuck, loop.stuck_radius, self.size * np.exp(np.where(stuck, 0.0, place)))
        withdrawal = np.where(stuck, place * self.depth, 0.0)
        return loop.state(self.radius, branch, contact_radius, withdrawal)

    def scaled(self, state: ContactState) -> np.ndarray:
        """Return the measured quantities of states, divided by their errors."""
        return np.stack([getattr(state, name) for name in self.names], axis=-1) / self.errors

    def nearest(self, loop: Loop, data, unloading) -> tuple[np.ndarray, np.ndarray, float]:
        """Return the branch of each point, its place on the curve, and the sum of squared distances."""
        branch, place = np.zeros(len(data), int), np.zeros(len(data))
        least = np.full(len(data), np.inf)
        for each in (LOADING, STUCK, RECEDING):
            radii, withdrawals = loop.trace(self.radius, each, _BEYOND)
            curve = self.scaled(loop.state(self.radius, np.array(each), radii, withdrawals))
            candidates = np.flatnonzero(unloading == (each != LOADING))
            squares = ((data[candidates, None] - curve) ** 2).sum(axis=-1)
            best = squares.argmin(axis=1)
            squares = squares.min(axis=1)
            closer = squares < least[candidates]
            members, best = candidates[closer], best[closer]
            least[members], branch[members] = squares[closer], each
            place[members] = withdrawals[best] / self.depth if each == STUCK else np.log(radii[best] / self.size)
        return branch, place, float(least.sum())

    def derivatives(self, unknown, place, branch, free):
        """Return the scaled states, and their derivatives by the places and by the free unknowns."""
        value = self.scaled(self.states(unknown, place, branch))
        by_place = (self.scaled(self.states(unknown, place + _DIFFERENCE, branch)) - value) / _DIFFERENCE
        by_unknown = []
        for k in free:
            step = np.zeros(5)
            step[k] = _DIFFERENCE
            by_unknown.append((self.scaled(self.states(unknown + step, place, branch)) - value) / _DIFFERENCE)
        return value, by_place, np.stack(by_unknown, axis=-1)

    def across(self, by_place, by_unknown):
        """Return the derivatives of the distances: the part of `by_unknown` that is normal to the curves."""
        square = (by_place**2).sum(axis=-1)
        along = np.einsum("bnm,bnmk->bnk", by_place, by_unknown) / square[..., None]
        return square, along, by_unknown - by_place[..., None] * along[:, :, None]

    def minimise(self, data, unknown, place, branch, free, steps=_STEPS):
        """Return unknowns and places of the smallest squared distances, and the sums of squares, for all resamples.

        A step of Levenberg and Marquardt eliminates the places of the points exactly.
        """
        damping = np.full(len(data), 1e-3)
        cost = ((data - self.scaled(self.states(unknown, place, branch))) ** 2).sum(axis=(1, 2))
        done = np.zeros(len(data), bool)
        for _ in range(steps):
            value, by_place, by_unknown = self.derivatives(unknown, place, branch, free)
            residual = data - value
            square, along, normal = self.across(by_place, by_unknown)
            matrix = np.einsum("bnmk,bnml->bkl", normal, normal)
            diagonal = np.einsum("bkk->bk", matrix)
            diagonal += damping[:, None] * diagonal + 1e-14 * diagonal.max(axis=1, keepdims=True)
            step = np.linalg.solve(matrix, np.einsum("bnmk,bnm->bk", normal, residual)[..., None])[..., 0]
            shift = np.einsum("bnm,bnm->bn", by_place, residual) / square - np.einsum("bnk,bk->bn", along, step)
            trial, moved = unknown.copy(), place + np.clip(shift, -1, 1)
            trial[:, free] += np.clip(step, -1, 1)
            with np.errstate(over="ignore", invalid="ignore"):
                new = ((data - self.scaled(self.states(trial, moved, branch))) ** 2).sum(axis=(1, 2))
            better = (new < cost) & ~done
            done |= (damping > _DAMPING) | (better & (cost - new <= _GAIN * cost))
            unknown, place = np.where(better[:, None], trial, unknown), np.where(better[:, None], moved, place)
            cost = np.where(better, new, cost)
            damping = np.where(better, damping / 10, damping * 10)
            if done.all():
                break
        return unknown, place, cost


def fit_loop(
    points: dict[str, np.ndarray],
    unloading: np.ndarray,
    errors: dict[str, float],
    radius: float,
    *,
    fit_offset: bool,
    resamples: int,
    seed: int,
) -> LoopFit:
    """Fit a loop to measured points.

    Parameters
    ----------
    points : (n,) float by quantity, with `force` and at least one of `contact_radius` and `indentation`, SI units.
    unloading : (n,) bool, True for points of unloading.
    errors : standard deviation of each quantity; only their ratios have an effect.
    radius : radius of the sphere, m.
    fit_offset : whether the offset of the indentation is an unknown; otherwise it is 0.
    resamples, seed : number of fits for the intervals, and seed of the random signs.
    """
    force = points["force"]
    top = int(np.argmax(force))
    if "contact_radius" in points:
        size = float(points["contact_radius"].max())
    else:
        size = math.sqrt(radius * float(np.ptp(points["indentation"])))
    modulus = 0.75 * float(force[top]) * radius / size**3
    problem = _Problem(radius, tuple(points), np.array([errors[name] for name in points]), modulus, size)
    data = np.stack(list(points.values()), axis=-1) / problem.errors
    guesses = []
    pull_off = max(-float(force.min()), 0.02 * float(force[top])) / (1.5 * math.pi * radius)
    for factor, receding, ratio in itertools.product(*_GUESSES):
        works = ratio * receding * pull_off, receding * pull_off
        turn = float(sphere_radius_at_force(force[top], radius, factor * modulus, works[0]))
        depth = float(sphere_contact(turn, radius, factor * modulus, works[0]).indentation)
        loop = Loop(factor * modulus, *works, turn, float(points["indentation"][top]) - depth if fit_offset else 0.0)
        guesses.append((problem.nearest(loop, data, unloading)[2], loop))
    guesses.sort(key=lambda guess: guess[0])
    fits = [_refine(problem, loop, data, unloading, fit_offset, _FIRST_STEPS) for _, loop in guesses[:_REFINED]]
    _, best, *_ = min(fits, key=lambda fit: fit[0])
    _, best, unknown, place, branch, free = _refine(problem, best, data, unloading, fit_offset, _STEPS)
    value, by_place, by_unknown = problem.derivatives(unknown, place, branch, free)
    _, _, normal = problem.across(by_place, by_unknown)
    hat = np.linalg.pinv(np.einsum("bnmk,bnml->kl", normal, normal))
    leverage = np.einsum("bnmk,kl,bnml->n", normal, hat, normal) / (len(points) - 1)
    # Residuals of points that determine the fit are smaller than the errors.
    residual = (data - value[0]) / (1 - np.minimum(leverage, 0.9))[:, None]
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(resamples, len(data), 1))
    found = []
    for some in np.array_split(signs, max(1, -(-signs.size // _TOGETHER))):
        starts = np.repeat(unknown, len(some), axis=0), np.repeat(place, len(some), axis=0)
        found.append(problem.minimise(value + some * residual, *starts, branch, free, _RESAMPLE_STEPS)[0])
    resampled = problem.loop(np.concatenate(found))
    states = problem.states(unknown, place, branch)
    return LoopFit(
        best,
        branch,
        ContactState(*(np.asarray(each)[0] for each in states)),
        Loop(*(each[:, 0] for each in resampled)),
    )


def _refine(problem, loop, data, unloading, fit_offset, steps):
    """Return the sum of squares, the loop, its unknowns, places and branches, and the free unknowns of a fit."""
    branch, place, _ = problem.nearest(loop, data, unloading)
    unknown, seen = problem.unknown(loop)[None], {branch.tobytes()}
    for _ in range(_ASSIGNMENTS):
        free = [0, 1]
        free += [2] if np.sum(branch == RECEDING) else []
        free += [3] if unloading.any() else []
        free += [4] if fit_offset else []
        unknown, place, [cost] = problem.minimise(data[None], unknown, place[None], branch, free, steps)
        before = branch
        fitted = Loop(*(float(each[0, 0]) for each in problem.loop(unknown)))
        branch, nearest, _ = problem.nearest(fitted, data, unloading)
        if branch.tobytes() in seen:
            break
        seen.add(branch.tobytes())
        place = np.where(branch == before, place[0], nearest)
    return cost, fitted, unknown, place.reshape(1, -1), before, free
