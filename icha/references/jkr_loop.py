"""Loop of a sphere whose work of adhesion depends on the direction, and its fit to measured points.

Loading follows the equilibria of Johnson, Kendall and Roberts with the advancing work of adhesion. From the turning
point, the contact is stuck: its radius is constant, and the force decreases with the stiffness 2 E* a of a flat punch,
until the energy release rate is the receding work of adhesion. Then unloading follows the equilibria with this work (D.
Maugis and M. Barquins, J. Phys. D: Appl. Phys. 11 (1978) 1989, doi:10.1088/0022-3727/11/14/011). Where the sphere
would not touch the undeformed plane it may also be free, without a force: before and after contact.

All measured quantities have errors, so a fit minimises the squared distances between points and curves, each quantity
divided by its error (P. T. Boggs, R. H. Byrd and R. B. Schnabel, SIAM J. Sci. Stat. Comput. 8 (1987) 1052,
doi:10.1137/0908085). Intervals are those of the linear approximation at the fit, with Student's t, for the larger
of two variances: with equal errors of all points, and with errors that may differ between points.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial import KDTree
from scipy.stats import t as student

from icha.references.indentation import ContactState, sphere_contact, sphere_radius_at_force
from icha.references.jkr_tables import far_from_the_rest

# Branch of points without contact.
FREE = "without contact"
# States of a branch, and the smallest contact radius among them, divided by that of the turning point.
_STATES, _SMALLEST = 400, 1e-3
# First guesses: modulus and receding work in units of the points, and the ratio of advancing to receding work.
_GUESSES = (0.5, 1.0, 2.0), (1.0, 3.0), (0.03, 0.3, 1.0)
# Number of guesses that are refined; relative decrease and step at which a fit ends, far below the noise of tests.
_REFINED, _CONVERGENCE = 3, {"ftol": 1e-6, "xtol": 1e-6}
# Unknowns of a fit that are roots of works of adhesion.
_ROOTS = np.array([False, True, True, False, False])
# Root of a receding work that no contact reaches, in units of the points. Noise alone lets a fit find receding points:
# they count only if they lower the squared distances by this number of variances, the limit for a change at an unknown
# point with a probability of one per cent (D. W. K. Andrews, Econometrica 61 (1993) 821, doi:10.2307/2951764).
_NEVER, _BY_NOISE = 100.0, 13.0
# Step of numerical derivatives, not much narrower than the distance between states.
_STEP = 1e-3
# A sphere with more than this part of the largest force or tension is in contact.
_CLEAR_FORCE = 0.1
# Largest ratio of the ends of the interval of a modulus; wider ones are far beyond the linear approximation. Largest
# leverage of a point in its interval: the residual of a point that alone determines a value shows no error.
_WIDEST, _MOST_LEVERAGE = 10.0, 0.5
# Points lie far from the others if their distance from a robust fit exceeds the first number of standard deviations,
# which follow from the median of the distances, and the second number as a share of the range of a column. This fit is
# needed if the distance from the first fit exceeds the last number of standard deviations.
_OUTLYING, _OUTLYING_SHARE, _DOUBTFUL = 20.0, 0.1, 5.0


class Loop(NamedTuple):
    """Parameters of a loop.

    Attributes
    ----------
    contact_modulus : E*, Pa.
    advancing_work, receding_work : works of adhesion, J/m^2.
    stuck_radius : contact radius at the turning point, m.
    offset : indentation of the instrument where the sphere touches the undeformed plane, m.
    """

    contact_modulus: float
    advancing_work: float
    receding_work: float
    stuck_radius: float
    offset: float

    def curves(self, radius: float) -> dict[str, ContactState]:
        """Return the states of a sphere by branch: from the touch to the turning point, stuck, and to jump-off.

        The stuck branch exists only if the receding work exceeds the advancing one.
        """

        def equilibria(work, factor):
            least = max(np.cbrt(factor * np.pi * work * radius**2 / self.contact_modulus), _SMALLEST * largest)
            return sphere_contact(
                np.linspace(min(least, largest), largest, _STATES), radius, self.contact_modulus, work
            )

        largest = self.stuck_radius
        loading, receding = equilibria(self.advancing_work, 2.0), equilibria(self.receding_work, 1 / 8)
        stuck = np.linspace(np.transpose(loading)[-1], np.transpose(receding)[-1], _STATES, endpoint=False)
        branches = {"loading": np.array(loading), "stuck": stuck.T, "receding": np.array(receding)[:, ::-1]}
        if self.receding_work <= self.advancing_work:
            del branches["stuck"]
        return {name: ContactState(a, depth + self.offset, force) for name, (a, depth, force) in branches.items()}


def fit_loop(
    points: dict[str, np.ndarray],
    unloading: np.ndarray,
    errors: dict[str, float],
    radius: float,
    offset: float | None,
    probability: float,
    places: Sequence[str],
) -> tuple[list[Loop], np.ndarray, np.ndarray]:
    """Fit a loop to measured points.

    Parameters
    ----------
    points : (n,) float by quantity: first `force`, then `contact_radius`, `indentation` or both, SI units.
    unloading : (n,) bool, True for points of unloading.
    errors : standard deviation of each quantity; only their ratios have an effect.
    radius : radius of the sphere, m.
    offset : offset of the indentation, m; None to fit it.
    probability : that an interval contains the true value.
    places : name of each point for messages.

    Returns
    -------
    Fitted loop, and loops with the lower and the upper ends of the intervals; the nearest state of the fitted loop to
    each point, (quantity, n); the branch of this state, (n,) text: a key of `Loop.curves`, or `FREE`.

    Raises
    ------
    ValueError
        If points lie far from the curves of all others, or if the points do not determine the contact modulus.
    """
    force, scales = points["force"], np.array([errors[name] for name in points])
    data, top, unloads = np.stack(list(points.values()), axis=-1) / scales, int(np.argmax(force)), bool(unloading.any())
    depth = range_in_contact(points) if "indentation" in points else points["contact_radius"].max() ** 2 / radius
    modulus, work = 0.75 * force[top] * radius / (depth * radius) ** 1.5, force[top] / (1.5 * np.pi * radius)

    def loop_of(unknown):
        # The law is smooth in the roots of the works of adhesion.
        fitted, advancing, receding = modulus * math.exp(unknown[0]), work * unknown[1] ** 2, work * unknown[2] ** 2
        turn = float(sphere_radius_at_force(force[top], radius, fitted, advancing)) * math.exp(unknown[3] * unloads)
        return Loop(fitted, advancing, receding, turn, depth * unknown[4] if offset is None else offset)

    # Contacts do not reach beyond the touch and the jump-off where a sphere may be free.
    reach = np.inf if "contact_radius" in points else 1.0

    def project(loop):
        curves, near, branch = loop.curves(radius), np.empty_like(data), np.empty(len(data), object)
        states = {name: np.stack([getattr(each, q) for q in points], -1) / scales for name, each in curves.items()}
        states["loading"] = states["loading"][::-1]  # Both curves begin at the turning point.
        for members, names in ((~unloading, ["loading"]), (unloading, list(states)[1:])):
            if members.any():
                near[members], side = _nearest(data[members], np.concatenate([states[name] for name in names]), reach)
                branch[members] = np.repeat(names, _STATES)[side]
        if "contact_radius" not in points:  # These would tell a free sphere from one in contact.
            free = np.minimum(data, [np.inf, loop.offset / errors["indentation"]]) * [0, 1]
            closer = np.linalg.norm(data - free, axis=1) < np.linalg.norm(data - near, axis=1)
            near[closer], branch[closer] = free[closer], FREE
        if unloads:  # The largest force is at the turning point, which no other point bounds if hardly any is stuck.
            near[top] = states["loading"][0]
        return near, branch

    def residuals(unknown):
        return (data - project(loop_of(unknown))[0]).ravel()

    def derivatives(unknown):
        # Residuals depend on the magnitudes of the roots, so a difference across zero would be no derivative.
        unknown = np.where(_ROOTS & (np.abs(unknown) < _STEP), np.copysign(_STEP, unknown), unknown)
        return np.stack([residuals(unknown + s) - residuals(unknown - s) for s in _STEP * np.eye(5)], -1) / (2 * _STEP)

    guesses, pull_off = [], max(-force.min() / force[top], 0.02)
    for factor, receding, ratio in itertools.product(*_GUESSES):
        roots = math.sqrt(ratio * receding * pull_off), math.sqrt(receding * pull_off)
        guess = np.array([math.log(factor), *roots, 0.0, 0.0])
        if "indentation" in points:
            guess[4] = (points["indentation"][top] - loop_of(guess).curves(radius)["loading"].indentation[-1]) / depth
        guesses.append(guess)
    guesses.sort(key=lambda guess: np.sum(residuals(guess) ** 2))
    fits = [least_squares(residuals, guess, derivatives, **_CONVERGENCE) for guess in guesses[:_REFINED]]
    fit = min(fits, key=lambda each: each.cost)
    if unloads:
        stuck = least_squares(residuals, np.where(np.arange(5) == 2, _NEVER, fit.x), derivatives, **_CONVERGENCE)
        fits = [stuck, *fits]
        if stuck.cost - fit.cost <= _BY_NOISE * fit.cost / (data.size - len(data)):
            fit = stuck
    usual = 1.5 * float(np.median(np.linalg.norm(fit.fun.reshape(data.shape), axis=1)))
    if np.abs(fit.fun).max() > _DOUBTFUL * usual > 0:
        # Points far from the others have little effect on this fit.
        robust = {"loss": "cauchy", "f_scale": usual} | _CONVERGENCE
        others = min((least_squares(residuals, each.x, derivatives, **robust) for each in fits), key=lambda e: e.cost)
        distance = data - project(loop_of(others.x))[0]
        size, share = np.linalg.norm(distance, axis=1), (np.abs(distance) / np.ptp(data, axis=0)).max(axis=1)
        if (far := np.flatnonzero((size > _OUTLYING * 1.5 * np.median(size)) & (share > _OUTLYING_SHARE))).size:
            texts = [", ".join(f"{name.replace('_', ' ')} {each[k]:.4g}" for name, each in points.items()) for k in far]
            raise ValueError(far_from_the_rest([(places[k], text) for k, text in zip(far, texts, strict=True)]))
    freedom = data.size - len(data) + unloads - np.count_nonzero(fit.jac.any(axis=0))
    inverse = np.linalg.pinv(fit.jac)
    variance = 2 * fit.cost / freedom * (inverse**2).sum(axis=1)
    # Points may scatter more where they matter, as forces do near pull-off: squared changes without each of the points
    # (J. G. MacKinnon and H. White, J. Econometrics 29 (1985) 305, doi:10.1016/0304-4076(85)90158-7).
    change = (inverse * fit.fun).reshape(len(inverse), *data.shape).sum(axis=2)
    leverage = (inverse * fit.jac.T).reshape(len(inverse), *data.shape).sum(axis=(0, 2))
    variance = np.maximum(variance, ((change / (1 - np.minimum(leverage, _MOST_LEVERAGE))) ** 2).sum(axis=1))
    width = student.ppf((1 + probability) / 2, freedom) * np.sqrt(variance)
    if 2 * width[0] > math.log(_WIDEST):
        raise ValueError(
            "the points do not determine the contact modulus: the ends of its interval differ by a factor of more than "
            f"{_WIDEST:.0f}; expected points that follow the law of JKR. Check signs, units and outliers, or measure "
            "contact radius and indentation"
        )
    unknown, least = np.where(_ROOTS, np.abs(fit.x), fit.x), np.where(_ROOTS, 0.0, -np.inf)
    loops = [loop_of(np.maximum(unknown + sign * width, least)) for sign in (0, -1, 1)]
    near, branch = project(loops[0])
    return loops, (near * scales).T, branch


def range_in_contact(points: dict[str, np.ndarray]) -> float:
    """Return the range of the indentation among points whose force is clearly not that of a free sphere, m."""
    force, indentation = np.abs(points["force"]), points["indentation"]
    return float(np.ptp(indentation[force > _CLEAR_FORCE * force.max()]) or np.ptp(indentation))


def _nearest(points, curve, reach):
    """Return the nearest point of a polygon and the side, by point; the last side ends at `reach` times its length."""
    node = KDTree(curve).query(points)[1]
    side = np.stack([np.maximum(node - 1, 0), np.minimum(node, len(curve) - 2)])
    along = curve[side + 1] - curve[side]
    share = ((points - curve[side]) * along).sum(-1) / np.maximum((along**2).sum(-1), np.finfo(float).tiny)
    share = np.clip(share, 0, np.where(side == len(curve) - 2, reach, 1))
    near = curve[side] + share[..., None] * along
    closer = ((points - near) ** 2).sum(-1).argmin(axis=0), np.arange(len(points))
    return near[closer], side[closer]
