"""Newton's method for the equations of equilibrium, without events, by an inexact Krylov solver.

It runs over sites: the spots and, without adhesion, the asperities that may come into contact. There a negative
approach means no force, and the iteration decides which sites are in contact.
"""

from dataclasses import replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from icha.contact.model import NotConverged
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.equilibrium.equations import Equations, Point, gradient_by_radius, radius_response
from icha.equilibrium.sites import CONTACT

_MAX_HALVINGS = 8
_STIFFNESS_ERROR = MODELS[DEFAULT_MODEL].stiffness_error
# Relative errors of the linear solves: of most, and of those repeated with the exact operator.
_LINEAR_TOLERANCE = 3e-3
_EXACT_TOLERANCE = 1e-6
# Largest dimension of a Krylov space.
_KRYLOV = 50
# Longest change of the separation in a step, in h_rms.
_LONGEST_CHANGE = 0.2
# Below so many jump-off radii a Newton step back is one of the radius.
_NEAR_JUMP_OFF = 1.5
# So large a part of a step that leads back over jump-off may be lost by ending there.
_NEXT_TO_JUMP_OFF = 0.2


def descend(equations: Equations, point: Point, size: float) -> tuple[Point, bool, bool]:
    """A Newton step, shortened until the error falls below its `size`; or, where it does not, the point as it was.

    Also returns whether it falls, and whether a rough solution of the linear equations was not enough.
    """
    for exact in (False, True):
        step, du = _step(equations, point, exact)
        for halving in range(_MAX_HALVINGS):
            fraction = 0.5**halving
            approach = _moved(equations, point, fraction * step)
            new = equations.at(approach, point.separation + fraction * du, point.interaction)
            if equations.size(new) < (1 - 0.1 * fraction) * size:
                return new, True, exact
            point = replace(point, interaction=new.interaction)
    return point, False, True


def response(equations: Equations, point: Point) -> np.ndarray:
    """d(delta)/du of every site (n,): the solution of (1 + W' da/d(delta)) x = -1."""
    sites = equations.sites
    full = np.full(len(sites), -1.0)
    part, _, exact, product = _linearised(equations, point)
    if not len(part):
        return full
    x = sites.response[part]
    for attempt in range(12):
        defect = -1.0 - x - exact(x)
        if np.max(np.abs(defect)) <= _STIFFNESS_ERROR:
            full[part] = x
            return full
        operator, tolerance = (product, _LINEAR_TOLERANCE) if attempt < 8 else (exact, _EXACT_TOLERANCE)
        x = x + _solve(lambda y, operator=operator: y + operator(y), defect, tolerance)
    raise NotConverged(f"the response of {len(part)} spots to the separation was not found")


def _linearised(equations, point):
    """Where the unknowns are, da/d(delta) there, and the products of W' da/d(delta), exact and approximate."""
    sites = equations.sites
    part = np.flatnonzero(sites.present)
    a, R = point.a[part], sites.radius_of_curvature[part]
    off, approach = sites.jump_off[part], point.approach[part]
    # Who is about to be drawn back over jump-off behaves as on the near side.
    approach = np.where(_drawn_back(sites, point)[part] & equations.problem.adhesive, off, approach)
    slope = radius_response(equations.problem.law, a, R, approach, off)
    tangent = point.interaction.tangent(point.a)

    def spread(x):
        full = np.zeros(len(sites))
        full[part] = slope * x
        return full

    return part, slope, lambda x: tangent(spread(x))[part], lambda x: tangent.nearly(spread(x))[part]


def _step(equations, point, exact):
    """Change of the approaches (n,) and of the separation."""
    problem, sites, control = equations.problem, equations.sites, equations.control
    part, slope, *products = _linearised(equations, point)
    product, tolerance = (products[0], _EXACT_TOLERANCE) if exact else (products[1], _LINEAR_TOLERANCE)
    size = len(part)
    step, du = np.zeros(len(sites)), 0.0
    if control is None:
        step[part] = _solve(lambda x: x + product(x), -point.error[part], tolerance)
        return step, du
    # The separation is an unknown too; in terms of what the last response leaves, the bordered matrix is near one.
    last = sites.response[part]
    gradient = slope * gradient_by_radius(problem, control.quantity, point.a[part], sites.radius_of_curvature[part])
    rate = float(np.sum(gradient * last))
    if rate == 0:
        raise NotConverged(f"{control.quantity} does not depend on the separation")

    def bordered(x):
        y = x[:size] + x[size] * last
        return np.append(y + product(y) + x[size], np.sum(gradient * y) / rate)

    x = _solve(bordered, np.append(-point.error[part], -point.miss / rate), tolerance)
    longest = _LONGEST_CHANGE * problem.rms_height
    du = float(np.clip(x[size], -longest, longest))
    step[part] = x[:size] + du * last
    return step, du


def _moved(equations, point, step):
    """Approaches (n,) after a step of theirs.

    At jump-off the radius goes with the square root of the approach that is left; in terms of the radius the equations
    are smooth there. So a step towards jump-off is taken as one of the radius, and one back over it ends there
    first, and then solves the quadratic equation that the radius obeys.
    """
    moved = point.approach + step
    if not equations.problem.adhesive:
        return moved
    sites, law = equations.sites, equations.problem.law
    off = sites.jump_off
    drawn_back = _drawn_back(sites, point)
    moved = np.where((point.approach < off) & ~drawn_back, np.minimum(moved, off), moved)
    part = np.flatnonzero(sites.present & ((step < 0) & (point.approach > off) | drawn_back))
    R, a = sites.radius_of_curvature[part], point.a[part]
    lowest = law.jump_off_radius(R)
    near = a < _NEAR_JUMP_OFF * lowest
    part, R, a, lowest = part[near], R[near], a[near], lowest[near]
    change = radius_response(law, a, R, np.maximum(point.approach, off)[part], off[part]) * step[part]
    # Where the radius ends, what is left of the error is made up by the approach alone.
    left = 1 - np.minimum((lowest - a) / np.where(change < 0, change, -1.0), 1.0)
    reached = law.approach(np.maximum(a + change, lowest), R)
    moved[part] = reached + np.where(change < 0, left * np.minimum(step, -point.error)[part], 0.0)
    back = drawn_back[part]
    part, far = part[back], np.maximum(reached[back] - off[part[back]], 1e-300)
    lacking = point.approach[part] - point.error[part] - off[part]
    slope = lacking / np.sqrt(far)
    moved[part] = off[part] + (0.5 * (np.sqrt(slope**2 + 4 * lacking) - slope)) ** 2
    return moved


def _drawn_back(sites, point):
    """Whether a spot is next to jump-off, on the far side, and drawn back over it (n,)."""
    gap = sites.jump_off - point.approach
    return (sites.status == CONTACT) & (gap >= 0) & (gap < -_NEXT_TO_JUMP_OFF * point.error)


def _solve(apply, b, tolerance):
    """Solve apply(x) = b approximately; the caller checks the answer by the error of the equations."""
    size = len(b)
    operator = LinearOperator((size, size), matvec=apply, dtype=float)
    x, _ = gmres(operator, b, rtol=tolerance, atol=0.0, restart=min(size, _KRYLOV), maxiter=2)
    if not np.all(np.isfinite(x)):
        raise NotConverged(f"the linear equations of {size} unknowns have no finite solution")
    return x
