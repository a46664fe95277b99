"""The law of one spot: what the equilibrium of many spots needs to know of the contact of one asperity."""

from typing import Protocol

import numpy as np

from icha.asperity.material import Material


class SpotLaw(Protocol):
    """Contact of one asperity, axisymmetric; `icha.asperity.jkr.JKR` on a paraboloid is one.

    Functions of the contact radius a and the radius of curvature R, arrays that broadcast, in m; r is the distance from
    the centre of the spot, m. A spot is stable from its jump-off approach up.
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
        """The part of the force that repels, N."""

    def approach(self, a, R) -> np.ndarray:
        """Approach delta, m."""

    def contact_radius(self, approach, R) -> np.ndarray:
        """Contact radius, m, on the stable branch; at jump-off below it."""

    def radius_derivative(self, a, R) -> np.ndarray:
        """da/d(delta) of a spot with a > 0, bounded close to jump-off, where it is infinite."""

    def energy(self, a, R) -> np.ndarray:
        """Stored energy, J, elastic less adhesive: the work that makes the spot."""

    # --- instabilities --------------------------------------------------------------------------------------

    def jump_in_approach(self, R) -> np.ndarray:
        """Approach at which contact forms, m; negative: still a gap."""

    def is_jump_in_verified(self, R) -> np.ndarray:
        """Whether the jump-in approach is known to hold there."""

    def jump_off_approach(self, R) -> np.ndarray:
        """Smallest approach of a stable spot, m."""

    def jump_off_radius(self, R) -> np.ndarray:
        """Contact radius there, m."""

    # --- the half-space around the spot ---------------------------------------------------------------------

    def displacement(self, r, a, R) -> np.ndarray:
        """Normal displacement of the half-space, m; zero for a = 0."""

    def displacement_derivative(self, r, a, R) -> np.ndarray:
        """Its derivative with respect to a, for a > 0."""

    def second_moment(self, a, R) -> np.ndarray:
        """A quarter of the integral of p r^2 over the spot, N m^2: the next term of its far field after the force."""

    def second_moment_derivative(self, a, R) -> np.ndarray:
        """Its derivative with respect to a, N m."""

    def fourth_moment(self, a, R) -> np.ndarray:
        """9/64 of the integral of p r^4 over the spot, N m^4: the term of its far field after that."""

    def fourth_moment_derivative(self, a, R) -> np.ndarray:
        """Its derivative with respect to a, N m^3."""

    def moments(self, a, R, count: int) -> np.ndarray:
        """Integrals of p (r/a)^(2k), k = 0 ... count-1, over spots a, R (m,): (m, count), N."""

    # --- the pressure inside the spot -----------------------------------------------------------------------

    def pressure(self, r, a, R) -> np.ndarray:
        """Contact pressure at r < a, Pa."""

    def largest_pressure(self, a, R) -> np.ndarray:
        """Pressure in the middle of the spot, Pa."""

    def pressure_distribution(self, p, a, R) -> tuple[np.ndarray, np.ndarray]:
        """Area of the spot with pressure up to p (m^2) and the force that this area carries (N)."""

    # --- two that overlap -----------------------------------------------------------------------------------

    def union(self, a_i, R_i, a_j, R_j) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What two overlapping spots become: contact radius, radius of curvature (m), and where its centre lies.

        That as part of the way from the first to the second.
        """
