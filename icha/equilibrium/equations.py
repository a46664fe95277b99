"""Equations of equilibrium of all spots, eq. (4) of the paper, with a prescribed separation, load or area.

The unknowns are the local approaches delta_i of the spots in contact:

    delta_i + w_i(a(delta)) = h_i - u,        a_i = a_law(delta_i).

Here h_i is the height of the asperity, u the mean separation, and w_i the displacement of the half-space at spot i,
caused by all other spots and all periodic images. A positive w_i points away from the rough surface, so it reduces the
approach. A spot is past jump-off if its approach is below the jump-off approach. Such a spot keeps its jump-off radius,
which is zero without adhesion. On a free half-space there are no images, and u is the distance between the mean plane
of the surface and the half-space far away. This distance may be negative because the loaded part of the half-space
sinks in. The mean gap is u plus the mean of w over the square.
"""

from dataclasses import dataclass

import numpy as np

from icha.asperity.jkr import JKR
from icha.contact.model import PRESSURE, Control
from icha.contact.models import RESIDUAL_TOLERANCE, SMALLEST_LOAD
from icha.equilibrium.sites import AsperityContact, Sites
from icha.half_space.interaction import Interaction

# Largest relative error of a prescribed load or area.
TARGET_TOLERANCE = 1e-11
# With this weight, an error TARGET_TOLERANCE of load or area counts as much as an error RESIDUAL_TOLERANCE of a site.
_TARGET_WEIGHT = RESIDUAL_TOLERANCE / TARGET_TOLERANCE
# The interaction is set up for larger contact radii, so that several evaluations can use it. The larger radii are
# _RADIUS_AHEAD times the radii that the spots would have if all approaches were larger by _APPROACH_AHEAD h_rms.
_APPROACH_AHEAD = 0.02
_RADIUS_AHEAD = 1.2


def pressure_or_area_fraction(contact: AsperityContact, law: JKR, quantity: str, a, R) -> float:
    """Return for n spots the nominal pressure (Pa) if `quantity` is PRESSURE, otherwise the contact area fraction.

    law : law of the spots in their states; a, R : (n,) float, contact radii and radii of curvature of the spots, m.
    """
    if quantity == PRESSURE:
        return float(np.sum(law.force(a, R))) / contact.area
    return float(np.sum(np.pi * a**2)) / contact.area


def derivative_by_radius(contact: AsperityContact, law: JKR, quantity: str, a, R):
    """Return the derivatives of `pressure_or_area_fraction` with respect to the n contact radii, (n,)."""
    if quantity == PRESSURE:
        return law.force_derivative(a, R) / contact.area
    return law.area_derivative(a) / contact.area


def radius_slope(law: JKR, a, R, approach, jump_off_approach):
    """Return da/d(delta), (n,), the derivative of radius with respect to approach; zero past jump-off and for a = 0.

    The derivative is infinite at jump-off; `JKR.radius_derivative` limits its value there.
    """
    slope = np.zeros(len(a))
    touching = (a > 0) & (approach >= jump_off_approach)
    slope[touching] = law.select(touching).radius_derivative(a[touching], R[touching])
    return slope


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Values of the equations of equilibrium at given approaches of n sites.

    Attributes
    ----------
    approach : (n,) float, approaches of the sites, m.
    separation : mean separation, m.
    a : (n,) float, contact radii of the sites, m.
    equilibrium_height : (n,) float, asperity heights at which these approaches would be an equilibrium, m.
    error : (n,) float, left side minus right side of each equation, m.
    control_error : nominal pressure (Pa) or area fraction minus the prescribed value; 0 for a given separation.
    repulsion : sum of the repulsive parts of all forces, divided by the nominal area, Pa; 0 if no load is prescribed.
        `Equations.error_size` compares the error of a small load with a fraction of this value.
    interaction : elastic interaction of the spots.
    law : law of the sites in their states.
    """

    approach: np.ndarray
    separation: float
    a: np.ndarray
    equilibrium_height: np.ndarray
    error: np.ndarray
    control_error: float
    repulsion: float
    interaction: Interaction
    law: JKR


@dataclass(frozen=True, eq=False)
class Equations:
    """Equations of equilibrium of the sites of a contact.

    Attributes
    ----------
    contact : contact of the asperities.
    sites : table of n sites.
    control : prescribed load or area (the separation is then one more unknown); None for a given separation.
    """

    contact: AsperityContact
    sites: Sites
    control: Control | None = None

    def evaluate(self, approach, separation: float, interaction: Interaction | None = None) -> Evaluation:
        """Compute contact radii, displacements and errors at given approaches (n,) and mean separation, m.

        interaction : interaction of an earlier evaluation. It is used again if it belongs to the same half-space, and
            if no contact radius exceeds the radii for which it was set up. Otherwise a new interaction is set up.
        """
        contact, sites = self.contact, self.sites
        present, R = sites.present, sites.radius_of_curvature
        law, a = contact.law.find_states(approach, R, sites.contact_radius, present)
        half_space = sites.half_space
        if interaction is None or interaction.half_space is not half_space or np.any(a > interaction.largest_radius):
            ahead = np.where(present, approach + _APPROACH_AHEAD * contact.rms_height, 0.0)
            largest = np.where(present, _RADIUS_AHEAD * contact.law.contact_radius(ahead, R), 0.0)
            interaction = Interaction.between(half_space, R, np.maximum(largest, a))
        equilibrium_height = approach + interaction.displacement(law, a) + separation
        error = np.where(present, equilibrium_height - sites.height, 0.0)
        control_error = repulsion = 0.0
        if self.control is not None:
            quantity, target = self.control.quantity, self.control.target
            spots = law.select(present), quantity, a[present], R[present]
            control_error = pressure_or_area_fraction(contact, *spots) - target
            if quantity == PRESSURE:
                repulsion = float(np.sum(law.repulsive_force(a[present], R[present]))) / contact.area
        return Evaluation(
            approach, separation, a, equilibrium_height, error, control_error, repulsion, interaction, law
        )

    def error_size(self, evaluation: Evaluation, target_weight: float = _TARGET_WEIGHT) -> float:
        """Return the larger of two errors: the largest error of the sites, in h_rms, and the error of load or area.

        The error of load or area is divided by the larger of |target| and SMALLEST_LOAD times the repulsion, because a
        load close to zero is a small difference of repulsion and attraction. `target_weight` multiplies the quotient.
        """
        size = float(np.max(np.abs(evaluation.error), initial=0.0)) / self.contact.rms_height
        if self.control is None:
            return size
        unit = max(abs(self.control.target), SMALLEST_LOAD * evaluation.repulsion)
        return max(size, abs(evaluation.control_error) / unit * target_weight)
