"""Control: the quantities that a solve can hold, of contact spots, and their derivatives."""

import numpy as np

from icha.asperity.law import SpotLaw
from icha.contact.model import PRESSURE
from icha.equilibrium.problem import Problem
from icha.equilibrium.states import ContactState


def held_value(problem: Problem, quantity: str, a, R) -> float:
    """Nominal pressure (Pa) or area fraction of spots of contact radii a and radii of curvature R (n,), m."""
    if quantity == PRESSURE:
        return float(np.sum(problem.law.force(a, R))) / problem.area
    return float(np.sum(np.pi * a**2)) / problem.area


def gradient_by_radius(problem: Problem, quantity: str, a, R):
    """Its derivative with respect to the contact radii (n,)."""
    if quantity == PRESSURE:
        return problem.law.force_derivative(a, R) / problem.area
    return 2 * np.pi * a / problem.area


def derivative(problem: Problem, quantity: str, state: ContactState) -> float:
    """Its derivative with respect to the mean separation, at unchanged contacts."""
    sites, c = state.sites, state.in_contact
    a, R = state.contact_radius[c], sites.radius_of_curvature[c]
    growth = radius_response(problem.law, a, R, sites.approach[c], sites.jump_off[c]) * sites.response[c]
    return float(np.sum(gradient_by_radius(problem, quantity, a, R) * growth))


def radius_response(law: SpotLaw, a, R, approach, jump_off):
    """da/d(delta), zero for spots past jump-off; bounded close to it, where it is infinite."""
    slope = np.zeros(len(a))
    touching = (a > 0) & (approach >= jump_off)
    slope[touching] = law.radius_derivative(a[touching], R[touching])
    return slope
