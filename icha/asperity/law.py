"""Interface of the law of one spot: what the equilibrium of many spots needs from the contact of one asperity."""

from typing import Protocol

import numpy as np

from icha.asperity.material import Material


class SpotLaw(Protocol):
    """Axisymmetric contact of one asperity; `icha.asperity.jkr.JKR` is the law of a paraboloid.

    The methods take the contact radius a and the radius of curvature R, arrays that broadcast, m; r is the distance
    from the centre of the spot, m. A spot is stable above its jump-off approach.
    """

    @property
    def material(self) -> Material:
        """Half-space and interface."""

    # --- load and approach ----------------------------------------------------------------------------------

    def force(self, a, R) -> np.ndarray:
        """Contact force, N, negative in tension."""

    def force_derivative(self, a, R) -> np.ndarray:
        """dF/da, N/m."""

    def repulsive_force(self, a, R) -> np.ndarray:
        """Repulsive part of the force, N."""

    def approach(self, a, R) -> np.ndarray:
        """Approach delta, m."""

    def contact_radius(self, approach, R) -> np.ndarray:
        """Contact radius on the stable branch, m; below jump-off that of jump-off."""

    def radius_derivative(self, a, R) -> np.ndarray:
        """da/d(delta) of a spot with a > 0, bounded close to jump-off, where it is infinite."""

    def energy(self, a, R) -> np.ndarray:
        """Stored energy, elastic less adhesive, J: the work that makes the spot."""

    # --- instabilities --------------------------------------------------------------------------------------

    def jump_in_approach(self, R) -> np.ndarray:
        """Approach at which contact forms, m; negative for a gap."""

    def is_jump_in_verified(self, R) -> np.ndarray:
        """Whether the jump-in approach is verified for these radii of curvature."""

    def jump_off_approach(self, R) -> np.ndarray:
        """Smallest approach of a stable spot, m."""

    def jump_off_radius(self, R) -> np.ndarray:
        """Contact radius at the jump-off approach, m."""

    # --- the half-space around the spot ---------------------------------------------------------------------

    def displacement(self, r, a, R) -> np.ndarray:
        """Normal displacement of the half-space, m; zero for a = 0."""

    def displacement_derivative(self, r, a, R) -> np.ndarray:
        """Derivative of the displacement with respect to a, for a > 0."""

    def second_moment(self, a, R) -> np.ndarray:
        """A quarter of the integral of p r^2 over the spot, N m^2, the second term of its far field."""

    def second_moment_derivative(self, a, R) -> np.ndarray:
        """Derivative of the second moment with respect to a, N m."""

    def fourth_moment(self, a, R) -> np.ndarray:
        """9/64 of the integral of p r^4 over the spot, N m^4, the third term of its far field."""

    def fourth_moment_derivative(self, a, R) -> np.ndarray:
        """Derivative of the fourth moment with respect to a, N m^3."""

    def moments(self, a, R, count: int) -> np.ndarray:
        """Integrals of p (r/a)^(2k), k = 0 ... count-1, over spots a, R (m,): (m, count), N."""

    # --- the pressure inside the spot -----------------------------------------------------------------------

    def pressure(self, r, a, R) -> np.ndarray:
        """Contact pressure at r < a, Pa."""

    def largest_pressure(self, a, R) -> np.ndarray:
        """Pressure in the centre of the spot, Pa."""

    def pressure_distribution(self, p, a, R) -> tuple[np.ndarray, np.ndarray]:
        """Area of the spot with pressure up to p (m^2), and the force on this area (N)."""

    # --- unions of two spots -----------------------------------------------------------------------------------

    def union(self, a_i, R_i, a_j, R_j) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Contact radius and radius of curvature of the union of two spots, m, and the position of its centre.

        The position is a fraction of the distance from the first spot to the second.
        """
