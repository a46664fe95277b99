"""Equations of equilibrium of all spots, eq. (4) of the paper, with a prescribed separation, load or area.

The unknowns are the local approaches delta_i of the spots in contact:

    delta_i + w_i(a(delta)) = h_i - u,        a_i = a_law(delta_i).

Here h_i is the height of the asperity, u the mean separation, and w_i the displacement of the half-space at spot i,
caused by all other spots and all periodic images. A positive w_i points away from the rough surface. On a free
half-space there are no images, and u is the distance between the mean plane of the surface and the half-space far away.
The distance may be negative because the loaded part of the half-space sinks in. The mean gap is u plus the mean of w
over the square. Below its jump-off approach, a spot keeps its jump-off radius (zero without adhesion).
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
# Factor for the relative error of a load or area, so that RESIDUAL_TOLERANCE limits this error too.
_TARGET_WEIGHT = RESIDUAL_TOLERANCE / TARGET_TOLERANCE
# The interaction is set up for larger contact radii than the present radii, so that several evaluations can use it. The
# larger radii are _RADIUS_AHEAD times the radii at approaches that are larger by _APPROACH_AHEAD h_rms.
_APPROACH_AHEAD = 0.02
_RADIUS_AHEAD = 1.2


def nominal_value(contact: AsperityContact, quantity: str, a, R) -> float:
    """Return the nominal pressure (Pa) or the contact area fraction of n spots; `quantity` selects one of the two.

    a, R : (n,) float, contact radii and radii of curvature of the spots, m.
    """
    if quantity == PRESSURE:
        return float(np.sum(contact.law.force(a, R))) / contact.area
    return float(np.sum(np.pi * a**2)) / contact.area


def nominal_derivative(contact: AsperityContact, quantity: str, a, R):
    """Return the derivatives of nominal pressure or contact area fraction with respect to n contact radii, (n,)."""
    if quantity == PRESSURE:
        return contact.law.force_derivative(a, R) / contact.area
    return 2 * np.pi * a / contact.area


def radius_slope(law: JKR, a, R, approach, jump_off_approach):
    """Return da/d(delta) of n spots, the derivative of radius by approach; zero past jump-off.

    Near jump-off, where this derivative is infinite, `JKR.radius_derivative` limits its value.
    """
    slope = np.zeros(len(a))
    touching = (a > 0) & (approach >= jump_off_approach)
    slope[touching] = law.radius_derivative(a[touching], R[touching])
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
    control_error : nominal pressure (Pa) or area fraction minus the prescribed value; 0 if none is prescribed.
    repulsion : sum of the repulsive parts of all forces over the nominal area, Pa; 0 if no load is prescribed.
    interaction : elastic interaction of the spots.
    """

    approach: np.ndarray
    separation: float
    a: np.ndarray
    equilibrium_height: np.ndarray
    error: np.ndarray
    control_error: float
    repulsion: float
    interaction: Interaction


@dataclass(frozen=True, eq=False)
class Equations:
    """Equations of equilibrium of the sites of a contact.

    Attributes
    ----------
    contact : contact of the asperities.
    sites : table of n sites.
    control : prescribed load or area, for which the separation is one more unknown; None for a given separation.
    """

    contact: AsperityContact
    sites: Sites
    control: Control | None = None

    def evaluate(self, approach, separation: float, interaction: Interaction | None = None) -> Evaluation:
        """Compute contact radii, displacements and errors at given approaches (n,) and mean separation, m.

        interaction : interaction of an earlier evaluation. It is used again if it belongs to the same half-space and
            was set up for contact radii at least as large.
        """
        contact, sites, law = self.contact, self.sites, self.contact.law
        present, R = sites.present, sites.radius_of_curvature
        a = np.zeros(len(sites))
        a[present] = law.contact_radius(approach[present], R[present])
        if (
            interaction is None
            or interaction.half_space is not sites.half_space
            or np.any(a > interaction.largest_radius)
        ):
            ahead = np.where(present, approach + _APPROACH_AHEAD * contact.rms_height, 0.0)
            largest = np.where(present, _RADIUS_AHEAD * law.contact_radius(ahead, R), 0.0)
            interaction = Interaction.between(law, sites.half_space, R, largest)
        equilibrium_height = approach + interaction.displacement(a) + separation
        error = np.where(present, equilibrium_height - sites.height, 0.0)
        control_error = repulsion = 0.0
        if self.control is not None:
            control_error = nominal_value(contact, self.control.quantity, a[present], R[present]) - self.control.target
            if self.control.quantity == PRESSURE:
                repulsion = float(np.sum(law.repulsive_force(a[present], R[present]))) / contact.area
        return Evaluation(approach, separation, a, equilibrium_height, error, control_error, repulsion, interaction)

    def error_size(self, evaluation: Evaluation, target_weight: float = _TARGET_WEIGHT) -> float:
        """Return the larger error: the error of the sites in h_rms, or the weighted relative error of load or area."""
        size = float(np.max(np.abs(evaluation.error), initial=0.0)) / self.contact.rms_height
        if self.control is None:
            return size
        # If the load is a small difference of repulsion and attraction, its error is relative to the repulsion.
        unit = max(abs(self.control.target), SMALLEST_LOAD * evaluation.repulsion)
        return max(size, abs(evaluation.control_error) / unit * target_weight)
