"""The equations of equilibrium, eq. (4), their error at given approaches, and what a solve can hold.

The unknowns are the local approaches delta_i of the spots in contact:

    delta_i + w_i(a(delta)) = h_i - u,        a_i = a_law(delta_i),

with w_i the displacement by all other spots and all images and u the mean separation. On a free half-space there are
no images, and u is the separation of the surface's mean plane and the half-space far away from it, which falls below
zero as the loaded part sinks in; the mean gap is u plus the mean of w over the square. Below the jump-off approach a
spot keeps its jump-off radius while the equations are solved (zero for Hertz's law), so that they are defined
everywhere and, without adhesion, smooth.
"""

from dataclasses import dataclass

import numpy as np

from icha.asperity.law import SpotLaw
from icha.contact.model import PRESSURE, Control
from icha.contact.models import RESIDUAL_TOLERANCE, SMALLEST_LOAD
from icha.equilibrium.sites import ContactState, Problem, Sites
from icha.half_space.interaction import Interaction


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


# Relative error of a load or an area that was asked for.
TARGET_TOLERANCE = 1e-11
# One weighs as much as the other in a solve.
_MISS_WEIGHT = RESIDUAL_TOLERANCE / TARGET_TOLERANCE
# The near pairs are good for radii of an approach that is larger by so much of h_rms, and by this factor then.
_APPROACH_AHEAD = 0.02
_RADIUS_AHEAD = 1.2


@dataclass(frozen=True, eq=False)
class Point:
    """One evaluation of the equations.

    approach, a (contact radii) and error (n,), m; level (n,): the heights with which the sites would be in equilibrium,
    m. separation, m. miss: of the held quantity, in its unit. repulsion: pressure by the repulsive parts of the forces
    alone, Pa. interaction: by which the displacement was computed.
    """

    approach: np.ndarray
    separation: float
    a: np.ndarray
    level: np.ndarray
    error: np.ndarray
    miss: float
    repulsion: float
    interaction: Interaction


@dataclass(frozen=True, eq=False)
class Equations:
    """The equations of a table of sites; control: a load or an area to hold, with the separation one more unknown."""

    problem: Problem
    sites: Sites
    control: Control | None = None

    def at(self, approach, separation: float, interaction: Interaction | None = None) -> Point:
        """Evaluate at approaches (n,) and a separation, m; interaction: the last one, which may still serve."""
        problem, sites, law = self.problem, self.sites, self.problem.law
        part, R = sites.present, sites.radius_of_curvature
        a = np.zeros(len(sites))
        a[part] = law.contact_radius(approach[part], R[part])
        reusable = interaction is not None and interaction.half_space is sites.half_space
        if interaction is None or not reusable or np.any(a > interaction.pairs.largest_radius):
            ahead = np.where(part, approach + _APPROACH_AHEAD * problem.rms_height, 0.0)
            largest = np.where(part, _RADIUS_AHEAD * law.contact_radius(ahead, R), 0.0)
            interaction = Interaction.between(law, sites.half_space, R, largest)
        level = approach + interaction.displacement(a) + separation
        error = np.where(part, level - sites.height, 0.0)
        miss = repulsion = 0.0
        if self.control is not None:
            miss = held_value(problem, self.control.quantity, a[part], R[part]) - self.control.target
            if self.control.quantity == PRESSURE:
                repulsion = float(np.sum(law.repulsive_force(a[part], R[part]))) / problem.area
        return Point(approach, separation, a, level, error, miss, repulsion, interaction)

    def size(self, point: Point, miss_weight: float = _MISS_WEIGHT) -> float:
        """Largest error in units of h_rms, the control's relative miss with its weight."""
        size = float(np.max(np.abs(point.error), initial=0.0)) / self.problem.rms_height
        if self.control is None:
            return size
        # A load that is next to nothing beside the attraction and repulsion that make it up is met as well as they are.
        unit = max(abs(self.control.target), SMALLEST_LOAD * point.repulsion)
        return max(size, abs(point.miss) / unit * miss_weight)


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
