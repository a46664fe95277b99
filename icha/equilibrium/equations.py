"""Equations of equilibrium, eq. (4), their error at given approaches, and the load or area under control.

The unknowns are the local approaches delta_i of the spots in contact:

    delta_i + w_i(a(delta)) = h_i - u,        a_i = a_law(delta_i),

with h_i the height of the asperity, u the mean separation and w_i the displacement of the half-space at spot i by all
other spots and all images. On a free half-space there are no images, and u is the distance between the mean plane of
the surface and the half-space far away. There u falls below zero as the loaded part sinks in; the mean gap is u plus
the mean of w over the square. Below the jump-off approach a spot keeps its jump-off radius while the equations are
solved (zero for Hertz's law), so that they are defined everywhere and, without adhesion, smooth.
"""

from dataclasses import dataclass

import numpy as np

from icha.asperity.jkr import JKR
from icha.contact.model import PRESSURE, Control
from icha.contact.models import RESIDUAL_TOLERANCE, SMALLEST_LOAD
from icha.equilibrium.sites import Problem, Sites
from icha.half_space.interaction import Interaction

# Largest relative error of a load or an area under control.
TARGET_TOLERANCE = 1e-11
# Weight of this error relative to the error of the equilibrium, which makes both tolerances equal.
_TARGET_WEIGHT = RESIDUAL_TOLERANCE / TARGET_TOLERANCE
# The interaction is set up for larger contact radii, so that it serves several evaluations: those of approaches that
# are larger by this part of h_rms, times this factor.
_APPROACH_AHEAD = 0.02
_RADIUS_AHEAD = 1.2


def nominal_value(problem: Problem, quantity: str, a, R) -> float:
    """Return the nominal pressure (Pa) or the area fraction of spots of contact radii a and radii of curvature R, m."""
    if quantity == PRESSURE:
        return float(np.sum(problem.law.force(a, R))) / problem.area
    return float(np.sum(np.pi * a**2)) / problem.area


def nominal_derivative(problem: Problem, quantity: str, a, R):
    """Return the derivative of `nominal_value` with respect to each contact radius."""
    if quantity == PRESSURE:
        return problem.law.force_derivative(a, R) / problem.area
    return 2 * np.pi * a / problem.area


def radius_response(law: JKR, a, R, approach, jump_off):
    """Return da/d(delta) of each spot: zero past jump-off, bounded close to it, where it is infinite."""
    slope = np.zeros(len(a))
    touching = (a > 0) & (approach >= jump_off)
    slope[touching] = law.radius_derivative(a[touching], R[touching])
    return slope


@dataclass(frozen=True, eq=False)
class Point:
    """One evaluation of the equations at n sites.

    Attributes
    ----------
    approach : (n,) float, m.
    separation : mean separation, m.
    a : (n,) float, contact radii, m.
    level : (n,) float, heights with which the sites would be in equilibrium, m.
    error : (n,) float, left side minus right side of the equations, m.
    miss : load or area minus its target, in Pa or as a fraction; 0 without a control.
    repulsion : nominal pressure by the repulsive parts of the forces alone, Pa.
    interaction : interaction of the spots.
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
    """Equations of equilibrium of the sites of a problem.

    Attributes
    ----------
    problem : contact problem.
    sites : table of n sites.
    control : load or area to hold; the separation is one more unknown then.
    """

    problem: Problem
    sites: Sites
    control: Control | None = None

    def evaluate(self, approach, separation: float, interaction: Interaction | None = None) -> Point:
        """Evaluate the equations at approaches (n,) and a separation, m.

        interaction : the one of the last evaluation, used again as long as it covers the contact radii.
        """
        problem, sites, law = self.problem, self.sites, self.problem.law
        present, R = sites.present, sites.radius_of_curvature
        a = np.zeros(len(sites))
        a[present] = law.contact_radius(approach[present], R[present])
        if (
            interaction is None
            or interaction.half_space is not sites.half_space
            or np.any(a > interaction.largest_radius)
        ):
            ahead = np.where(present, approach + _APPROACH_AHEAD * problem.rms_height, 0.0)
            largest = np.where(present, _RADIUS_AHEAD * law.contact_radius(ahead, R), 0.0)
            interaction = Interaction.between(law, sites.half_space, R, largest)
        level = approach + interaction.displacement(a) + separation
        error = np.where(present, level - sites.height, 0.0)
        miss = repulsion = 0.0
        if self.control is not None:
            miss = nominal_value(problem, self.control.quantity, a[present], R[present]) - self.control.target
            if self.control.quantity == PRESSURE:
                repulsion = float(np.sum(law.repulsive_force(a[present], R[present]))) / problem.area
        return Point(approach, separation, a, level, error, miss, repulsion, interaction)

    def error_size(self, point: Point, target_weight: float = _TARGET_WEIGHT) -> float:
        """Return the largest error, in h_rms; the relative error of the load or area counts with a weight."""
        size = float(np.max(np.abs(point.error), initial=0.0)) / self.problem.rms_height
        if self.control is None:
            return size
        # A load that is the small difference of attraction and repulsion is met as accurately as they are.
        unit = max(abs(self.control.target), SMALLEST_LOAD * point.repulsion)
        return max(size, abs(point.miss) / unit * target_weight)
