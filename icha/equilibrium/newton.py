"""Newton's method for the equations of equilibrium of the present spots; GMRES solves the linear equations.

The unknowns are the approaches of the sites: the spots and, without adhesion, the candidates for contact. A candidate
with a negative approach exerts no force, so the solution shows which candidates are in contact.

The approximate matrix of the linear equations neglects the higher moments of the pressure of distant spots. Changes of
the displacements then have a relative error of about 1e-3. This matrix is several times faster than the exact matrix.
"""

from dataclasses import replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from icha.contact.model import NotConverged
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.equilibrium.equations import Equations, Evaluation, derivative_by_radius, radius_slope
from icha.equilibrium.sites import CONTACT

# Largest number of trials of a Newton step; each trial after the first one halves the step.
_STEP_TRIALS = 8
# Largest error of the equations for the responses: derivatives of the approaches with respect to the separation.
_RESPONSE_ERROR = MODELS[DEFAULT_MODEL].stiffness_error
# Relative errors of linear solves: with the approximate matrix, and with the exact matrix.
_LINEAR_TOLERANCE = 3e-3
_EXACT_TOLERANCE = 1e-6
# Largest number of solves for the response: first with the approximate matrix, then with the exact one.
_APPROXIMATE_SOLVES, _EXACT_SOLVES = 8, 4
# Largest dimension of a Krylov space.
_KRYLOV = 50
# Largest change of the separation in a Newton step, in h_rms.
_LARGEST_CHANGE = 0.2
# A step towards jump-off changes the radius instead of the approach if the radius is below this many jump-off radii.
_NEAR_JUMP_OFF = 1.5
# A spot past jump-off returns to contact only if its distance from jump-off is below this fraction of its error.
_PAST_JUMP_OFF = 0.2


def newton_step(equations: Equations, evaluation: Evaluation, size: float) -> tuple[Evaluation, bool, bool]:
    """Take one Newton step; halve the step until the `error_size` is enough below `size`, the value before the step.

    The error must fall by at least 10 % after the full step, 5 % after half the step, and so on. If eight trials with
    the approximate matrix fail, eight with the exact matrix follow. Return the evaluation after the step (the old one
    if all fail), whether a trial succeeded, and whether the exact matrix was needed. Exceptions: see `_solve_step`.
    """
    for exact in (False, True):
        step, separation_step = _solve_step(equations, evaluation, exact)
        for halvings in range(_STEP_TRIALS):
            fraction = 0.5**halvings
            approach = _take_step(equations, evaluation, fraction * step)
            separation = evaluation.separation + fraction * separation_step
            new = equations.evaluate(approach, separation, evaluation.interaction)
            if equations.error_size(new) < (1 - 0.1 * fraction) * size:
                return new, True, exact
            # If the trial has set up a new interaction, for larger radii, later trials use it too.
            evaluation = replace(evaluation, interaction=new.interaction)
    return evaluation, False, True


def solve_response(equations: Equations, evaluation: Evaluation) -> np.ndarray:
    """Return the response x = d(delta)/du of the approach of every site to the mean separation, (n,).

    The response solves (1 + W' da/d(delta)) x = -1, with the derivative W' = dw/da of the displacements; removed sites
    get -1. Repeated solves correct x, first with the approximate matrix. Raise `NotConverged` if all solves fail.
    """
    sites = equations.sites
    response = np.full(len(sites), -1.0)
    present, _, exact, approximate = _linearise(equations, evaluation)
    x = sites.response[present]
    solves = [(approximate, _LINEAR_TOLERANCE)] * _APPROXIMATE_SOLVES + [(exact, _EXACT_TOLERANCE)] * _EXACT_SOLVES
    while True:
        defect = -1.0 - x - exact(x)
        if np.max(np.abs(defect), initial=0.0) <= _RESPONSE_ERROR:
            response[present] = x
            return response
        if not solves:
            raise NotConverged(f"no solution for the response of {len(present)} spots to a change of the separation")
        product, tolerance = solves.pop(0)
        x = x + _solve_linear(lambda y, product=product: y + product(y), defect, tolerance)


def _linearise(equations, evaluation):
    """Linearise the displacements at the m present sites as functions of their approaches.

    A spot past jump-off that returns to contact is treated as if it were at jump-off, on the stable branch. Return the
    indices of the present sites and their da/d(delta), both (m,), and two functions. Both functions return the changes
    of the displacements (m,) for given changes of the approaches (m,): the first exactly, the second approximately.
    """
    sites = equations.sites
    present = np.flatnonzero(sites.present)
    a, R = evaluation.a[present], sites.radius_of_curvature[present]
    jump_off_approach = sites.jump_off_approach[present]
    returns = _returns_to_contact(sites, evaluation)[present] & equations.contact.adhesive
    approach = np.where(returns, jump_off_approach, evaluation.approach[present])
    slope = radius_slope(evaluation.law.select(present), a, R, approach, jump_off_approach)
    tangents = evaluation.interaction.tangent(evaluation.law, evaluation.a)

    def radius_change(x):
        """Return the changes of all contact radii (n,) for changes x of the approaches (m,)."""
        change = np.zeros(len(sites))
        change[present] = slope * x
        return change

    exact, approximate = (lambda x, tangent=tangent: tangent(radius_change(x))[present] for tangent in tangents)
    return present, slope, exact, approximate


def _solve_step(equations, evaluation, exact):
    """Return the Newton step by the exact or approximate matrix: changes of approaches (n,) and separation, m.

    If the separation is given, it does not change. If load or area is given, the separation changes by at most
    _LARGEST_CHANGE h_rms, which also limits the predicted changes of the approaches. Raise `NotConverged` if no contact
    radius changes with the separation, or if the linear equations have no finite solution.
    """
    contact, sites, control = equations.contact, equations.sites, equations.control
    present, slope, exact_product, approximate_product = _linearise(equations, evaluation)
    product, tolerance = (exact_product, _EXACT_TOLERANCE) if exact else (approximate_product, _LINEAR_TOLERANCE)
    count = len(present)
    step = np.zeros(len(sites))
    if control is None:
        step[present] = _solve_linear(lambda x: x + product(x), -evaluation.error[present], tolerance)
        return step, 0.0
    # Now the separation is one more unknown. The last response and the change of the separation predict the change of
    # each approach. The other unknowns are the differences from these predictions, so the matrix is near the identity.
    last = sites.response[present]
    R = sites.radius_of_curvature[present]
    law = evaluation.law.select(present)
    gradient = slope * derivative_by_radius(contact, law, control.quantity, evaluation.a[present], R)
    rate = float(np.sum(gradient * last))
    if rate == 0:
        raise NotConverged("no contact radius changes with the separation, so the load or area cannot be reached")

    def bordered(x):
        """Multiply the matrix by x: m differences from the predicted changes, and the change of the separation."""
        y = x[:count] + x[count] * last
        return np.append(y + product(y) + x[count], np.sum(gradient * y) / rate)

    x = _solve_linear(bordered, np.append(-evaluation.error[present], -evaluation.control_error / rate), tolerance)
    largest = _LARGEST_CHANGE * contact.rms_height
    separation_step = float(np.clip(x[count], -largest, largest))
    step[present] = x[:count] + separation_step * last
    return step, separation_step


def _take_step(equations, evaluation, step):
    """Return the approaches (n,) after a Newton step (n,), m; three kinds of spots take modified steps.

    The modifications apply only with adhesion. The equations are smooth functions of the contact radius, but near
    jump-off the radius changes as s, the square root of delta - delta_off.

    1. A spot in contact that moves towards jump-off, with a radius below 1.5 jump-off radii: the step changes the
       radius. If the radius reaches the jump-off radius, the approach falls by the rest of the step.
    2. A spot a little past jump-off that returns to contact (`_returns_to_contact`): the return changes the
       displacement by c s. Therefore the new s solves s^2 + c s = L. L is the new delta - delta_off for an unchanged
       displacement. The Newton step neglects s^2 and gives s_N, so that c = L/s_N.
    3. Any other spot past jump-off: the approach rises at most to the jump-off approach.
    """
    approach = evaluation.approach + step
    if not equations.contact.adhesive:
        return approach
    sites, law = equations.sites, evaluation.law
    jump_off_approach = sites.jump_off_approach
    returns = _returns_to_contact(sites, evaluation)
    stays_past = (evaluation.approach < jump_off_approach) & ~returns
    approach[stays_past] = np.minimum(approach, jump_off_approach)[stays_past]
    close = sites.present & ((step < 0) & (evaluation.approach > jump_off_approach) | returns)
    close = np.flatnonzero(close & law.moves)
    lowest = law.select(close).jump_off_radius(sites.radius_of_curvature[close])
    small = evaluation.a[close] < _NEAR_JUMP_OFF * lowest
    close, lowest = close[small], lowest[small]
    law = law.select(close)
    R, a = sites.radius_of_curvature[close], evaluation.a[close]
    stable = np.maximum(evaluation.approach, jump_off_approach)[close]
    change = radius_slope(law, a, R, stable, jump_off_approach[close]) * step[close]
    # At the jump-off radius, the approach also changes by `rest_fraction` times the lower of `step` and -`error`.
    rest_fraction = 1 - np.minimum((lowest - a) / np.where(change < 0, change, -1.0), 1.0)
    reached = law.approach(np.maximum(a + change, lowest), R)
    approach[close] = reached + np.where(change < 0, rest_fraction * np.minimum(step, -evaluation.error)[close], 0.0)
    back = returns[close]
    close, newton_distance = close[back], np.maximum(reached[back] - jump_off_approach[close[back]], 1e-300)
    target_distance = evaluation.approach[close] - evaluation.error[close] - jump_off_approach[close]
    c = target_distance / np.sqrt(newton_distance)
    approach[close] = jump_off_approach[close] + (0.5 * (np.sqrt(c**2 + 4 * target_distance) - c)) ** 2
    return approach


def _returns_to_contact(sites, evaluation):
    """Return a mask (n,) of the spots a little past jump-off whose errors move them back into contact."""
    excess = sites.jump_off_approach - evaluation.approach
    return (sites.status == CONTACT) & (excess >= 0) & (excess < -_PAST_JUMP_OFF * evaluation.error)


def _solve_linear(apply, b, tolerance):
    """Return an approximate solution x of apply(x) = b, (m,); two cycles of GMRES may not reach the `tolerance`."""
    count = len(b)
    operator = LinearOperator((count, count), matvec=apply, dtype=float)
    x, _ = gmres(operator, b, rtol=tolerance, atol=0.0, restart=min(count, _KRYLOV), maxiter=2)
    if not np.all(np.isfinite(x)):
        raise NotConverged(f"the linear equations of {count} unknowns have no finite solution")
    return x
