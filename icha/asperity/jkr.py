"""The law of one asperity: Johnson, Kendall & Roberts contact with Wu's jump into contact.

Every method is a function of contact radius `a` and radius of curvature `R` (arrays that broadcast, metres). With
zero surface energy the law is Hertz's, by the same formulas. Equation numbers are those of Violano & Afferrante,
"Modeling the adhesive contact of rough soft media with an advanced asperity model".
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import beta

from icha.asperity.coalescence import united_paraboloids
from icha.asperity.material import WU_HOLDS_FROM, Material

_MAX_NEWTON_STEPS = 200


@dataclass(frozen=True)
class JKR:
    """Contact of one paraboloid with an elastic half-space: an `icha.asperity.law.SpotLaw`."""

    material: Material

    # --- one asperity ---------------------------------------------------------------------------------------

    def force(self, a, R):
        """Contact force F in N, eq. (1): 4 E* a^3/(3R) - sqrt(8 pi E* gamma a^3)."""
        return self.repulsive_force(a, R) - self.adhesive_force(a)

    def repulsive_force(self, a, R):
        """Hertz's part of the force, 4 E* a^3/(3R), in N."""
        return 4 / 3 * self.material.contact_modulus * a**3 / R

    def adhesive_force(self, a):
        """The flat punch's part of the force, sqrt(8 pi E* gamma a^3), in N, positive in tension."""
        return np.sqrt(8 * np.pi * self.material.contact_modulus * self.material.surface_energy * a**3)

    def approach(self, a, R):
        """Approach delta in m, eq. (2): a^2/R - sqrt(2 pi a gamma/E*)."""
        return a**2 / R - np.sqrt(2 * np.pi * a * self.material.adhesion_length)

    def force_derivative(self, a, R):
        """dF/da in N/m."""
        return 4 * self.material.contact_modulus * a**2 / R - 1.5 * np.sqrt(
            8 * np.pi * self.material.contact_modulus * self.material.surface_energy * a
        )

    def approach_derivative(self, a, R):
        """d(delta)/da = 2a/R - sqrt(pi gamma/(2 E* a)); eq. (7) of the paper lacks the 2 under the root.

        Zero at a = 0 without adhesion; `a` must be positive with it.
        """
        slope = 2 * a / R
        if self.material.surface_energy > 0:
            slope = slope - np.sqrt(np.pi * self.material.adhesion_length / (2 * a))
        return slope

    def radius_derivative(self, a, R):
        """da/d(delta), bounded close to jump-off, where it is infinite; a > 0."""
        return 1 / np.maximum(self.approach_derivative(a, R), 1e-3 * (a / R))

    def contact_radius(self, approach, R):
        """The larger (stable) root a of eq. (2), in m; the jump-off radius where the approach lies below jump-off.

        With a = A x^2, A = (gamma R^2/E*)^(1/3), eq. (2) is the convex quartic x^4 - sqrt(2 pi) x - d = 0, which
        Newton's method descends from above.
        """
        approach, R = np.broadcast_arrays(np.asarray(approach, float), np.asarray(R, float))
        if self.material.surface_energy == 0:
            return np.sqrt(R * np.maximum(approach, 0.0))
        a_unit = np.cbrt(self.material.adhesion_length * R**2)
        d = approach * R / a_unit**2
        c = np.sqrt(2 * np.pi)
        # x0 is not below the root: (u + v)^4 >= u^4 + v^3 (u + v) with u^4 = d, v^3 = c.
        x = np.maximum(d, 0.0) ** 0.25 + np.cbrt(c)
        lowest = np.cbrt(c / 4)  # x at jump-off, where the slope vanishes
        for _ in range(_MAX_NEWTON_STEPS):
            slope = np.maximum(4 * x**3 - c, 1e-100)
            new = np.maximum(x - (x**4 - c * x - d) / slope, lowest)
            done = np.all(x - new <= 4e-16 * x)
            x = np.minimum(new, x)  # monotone: rounding cannot make it climb again
            if done:
                break
        return a_unit * x**2

    def energy(self, a, R):
        """Stored energy in J, elastic less adhesive: the work, the integral of F d(delta), that makes the spot.

        8 E* a^5/(15 R^2) - (8/3) sqrt(pi E* gamma/2) a^(7/2)/R + pi gamma a^2, from eqs. (1) and (2).
        """
        E, gamma = self.material.contact_modulus, self.material.surface_energy
        hertz = 8 / 15 * E * a**5 / R**2
        return hertz - 8 / 3 * np.sqrt(np.pi * E * gamma / 2) * a**3.5 / R + np.pi * gamma * a**2

    # --- instabilities --------------------------------------------------------------------------------------

    def jump_off_radius(self, R):
        """Contact radius at the loss of contact under displacement control, (pi gamma R^2/(8 E*))^(1/3), m."""
        return np.cbrt(np.pi / 8 * self.material.adhesion_length * np.asarray(R, float) ** 2)

    def jump_off_approach(self, R):
        """Smallest approach of the JKR law, -(3/4) (pi^2 gamma^2 R/E*^2)^(1/3), m."""
        return -0.75 * np.cbrt(np.pi**2 * self.material.adhesion_length**2 * np.asarray(R, float))

    def jump_in_approach(self, R):
        """Approach at which contact forms, (1 - 2.641 mu^(3/7)) epsilon, eq. (3), in m; negative: still a gap.

        Below mu of about 1.06 it would lie below jump-off, where no JKR state exists, and for very small mu above
        zero: it is kept between the jump-off approach and zero. Zero without adhesion.
        """
        if self.material.surface_energy == 0:
            return np.zeros(np.shape(R))
        wu = (1 - wu_gap(self.material.tabor_parameter(R))) * self.material.interaction_range
        return np.clip(wu, self.jump_off_approach(R), 0.0)

    def is_jump_in_verified(self, R):
        """Whether Wu's formula holds at the Tabor parameter of these paraboloids."""
        return self.material.tabor_parameter(R) >= WU_HOLDS_FROM

    # --- the half-space around the spot ---------------------------------------------------------------------

    def displacement(self, r, a, R):
        """Normal displacement of the half-space at distance r from the centre of the spot, m.

        Outside (r >= a) eq. (5), inside a^2/(2R) (2 - r^2/a^2) - sqrt(2 pi a gamma/E*). Zero for a = 0.
        """
        r, a = np.asarray(r, float), np.asarray(a, float)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = r / a
            outside = s > 1
            arc = np.arcsin(np.where(outside, a / r, 1.0))
            bracket = np.sqrt(np.maximum(s**2 - 1, 0.0)) + (2 - s**2) * arc
            # Far from the spot the bracket is a difference of large terms; its series takes over.
            far = s > 20
            t = np.where(far, 1 / s, 0.0)
            bracket = np.where(far, t * (4 / 3 + t**2 * (2 / 15 + t**2 * (3 / 70 + t**2 * 5 / 252))), bracket)
            hertz = np.where(outside, a**2 / (np.pi * R) * bracket, a**2 / R - r**2 / (2 * R))
        punch = np.sqrt(8 * a * self.material.adhesion_length / np.pi) * arc
        return np.where(a > 0, hertz - punch, 0.0)

    def displacement_derivative(self, r, a, R):
        """Derivative of `displacement` with respect to a, for a > 0 (dimensionless).

        The neck's part, sqrt(a)/sqrt(r^2 - a^2), is singular at the edge; within 2.5 % of the radius from it the value
        there is used: in equilibrium no spot's centre is so near to another, and a Newton step needs no steeper slope.
        """
        outside = r > a
        arc = np.arcsin(np.where(outside, a / np.maximum(r, a), 1.0))
        value = 2 / np.pi * arc * self.approach_derivative(a, R)
        if self.material.surface_energy > 0:
            edge = np.sqrt(np.maximum(r**2 - a**2, 0.05 * a**2))
            neck = np.sqrt(8 * self.material.adhesion_length * a / np.pi) / edge
            value = value - np.where(outside, neck, 0.0)
        return value

    def second_moment(self, a, R):
        """A quarter of the integral of p r^2 over the spot, N m^2: the next term of its far field after the force.

        Hertz's pressure has the mean square radius 2a^2/5, the flat punch's 2a^2/3.
        """
        return a**2 * (self.repulsive_force(a, R) / 10 - self.adhesive_force(a) / 6)

    def second_moment_derivative(self, a, R):
        """Derivative of `second_moment` with respect to a, N m."""
        return a * (self.repulsive_force(a, R) / 2 - self.adhesive_force(a) * (3.5 / 6))

    def fourth_moment(self, a, R):
        """9/64 of the integral of p r^4 over the spot, N m^4: the term of its far field after that.

        Hertz's pressure has the mean fourth power 8a^4/35, the flat punch's 8a^4/15.
        """
        return a**4 * (self.repulsive_force(a, R) * (9 / 280) - self.adhesive_force(a) * (3 / 40))

    def fourth_moment_derivative(self, a, R):
        """Derivative of `fourth_moment` with respect to a, N m^3."""
        return a**3 * (self.repulsive_force(a, R) * (9 / 40) - self.adhesive_force(a) * (5.5 * 3 / 40))

    def moments(self, a, R, count):
        """Integrals of p (r/a)^(2k), k = 0 ... count-1, over spots a, R (m,): (m, count), N."""
        order = np.arange(count)
        # Means over Hertz's and over the flat punch's pressure.
        hertz, punch = 1.5 * beta(order + 1, 1.5), 0.5 * beta(order + 1, 0.5)
        return self.repulsive_force(a, R)[:, None] * hertz - self.adhesive_force(a)[:, None] * punch

    # --- the pressure inside the spot -----------------------------------------------------------------------

    def pressure_amplitudes(self, a, R):
        """P and B of eq. (8), p(r) = P sqrt(1-r^2/a^2) - B/sqrt(1-r^2/a^2), in Pa."""
        peak = 2 * self.material.contact_modulus * a / (np.pi * R)
        neck = np.sqrt(2 * self.material.contact_modulus * self.material.surface_energy / (np.pi * a))
        return peak, neck

    def largest_pressure(self, a, R):
        """Pressure in the middle of the spot, P - B, Pa."""
        peak, neck = self.pressure_amplitudes(a, R)
        return peak - neck

    def pressure(self, r, a, R):
        """Contact pressure at r < a in Pa, eq. (8)."""
        peak, neck = self.pressure_amplitudes(a, R)
        s = np.sqrt(1 - (r / a) ** 2)
        return peak * s - neck / s

    def pressure_distribution(self, p, a, R):
        """Area of the spot with pressure up to p (m^2) and the force that this area carries (N).

        With s = sqrt(1 - r^2/a^2), the pressure rises with s; the area up to s is pi a^2 s^2 and its force
        2 pi a^2 (P s^3/3 - B s).
        """
        peak, neck = self.pressure_amplitudes(a, R)
        root = np.sqrt(p**2 + 4 * peak * neck)
        # The two forms of the positive root of P s^2 - p s - B = 0; each avoids a difference of like numbers.
        with np.errstate(divide="ignore", invalid="ignore"):
            s = np.where(p >= 0, (p + root) / (2 * peak), np.where(root > p, 2 * neck / (root - p), 0.0))
        s = np.minimum(s, 1.0)
        return np.pi * a**2 * s**2, 2 * np.pi * a**2 * (peak * s**3 / 3 - neck * s)

    # --- two that overlap -----------------------------------------------------------------------------------

    def union(self, a_i, R_i, a_j, R_j):
        """Contact radius and radius of curvature of the one that two become, and where between them its centre lies."""
        return united_paraboloids(a_i, R_i, a_j, R_j)


def wu_gap(tabor_parameter: np.ndarray | float) -> np.ndarray | float:
    """Wu's distance of the jump into contact over the range of attraction, 2.641 mu^(3/7): the gap of eq. (3)."""
    return 2.641 * tabor_parameter ** (3 / 7)
