"""Stored energy of a state."""

import numpy as np

from icha.equilibrium.problem import Problem
from icha.equilibrium.states import ContactState


def stored_energy(problem: Problem, state: ContactState) -> float:
    """Elastic energy less that of adhesion over nominal area, J/m^2; zero out of contact.

    Every spot has the work that would make it alone, and half that of its force against the displacement by the
    others. Force and displacement are those of the spots' centres, as in eq. (4), which makes the interaction of
    spots of unlike size only nearly reciprocal: along a path without events the energy changes by the work done but
    for a part of the order of (a/r)^2 of that interaction.
    """
    spots, law = state.spots, problem.law
    a, R = spots.contact_radius, spots.radius_of_curvature
    displaced = spots.height - state.separation - spots.approach
    return float(np.sum(law.energy(a, R) + 0.5 * law.force(a, R) * displaced)) / problem.area
