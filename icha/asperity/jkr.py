"""The law of one asperity: Johnson, Kendall & Roberts contact with Wu's jump into contact.

Every method is a function of contact radius `a` and radius of curvature `R` (arrays that broadcast, metres). With zero
surface energy, the same formulas give Hertz's law. Equation numbers are those of Violano & Afferrante, "Modeling the
adhesive contact of rough soft media with an advanced asperity model".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import beta

from icha.asperity.material import WU_HOLDS_FROM, Material

# Largest number of Newton steps in the search for a contact radius.
_MAX_NEWTON_STEPS = 200


@dataclass(frozen=True)
class JKR:
    """Contact of one paraboloid with an elastic half-space.

    The solver of many spots uses only the methods of this class. `icha.asperity.directed_jkr` overrides some of them.
    """

    material: Material

    @property
    def moves(self) -> np.ndarray | bool:
        """Mask of the spots whose edges move when their approaches change; True for all spots of this law."""
        return True

    @property
    def work(self) -> np.ndarray | float:
        """Energy release rate at the edges of the spots, J/m^2: the work of adhesion."""
        return self.material.surface_energy

    @property
    def adhesion_length(self) -> np.ndarray | float:
        """Energy release rate at the edges divided by the contact modulus, m."""
        return self.work / self.material.contact_modulus

    @property
    def receding(self) -> JKR:
        """Law of spots whose edges recede."""
        return self

    def select(self, which) -> JKR:
        """Return the law of selected spots: indices or a mask."""
        return self

    def find_states(self, approach, R, before, present) -> tuple[JKR, np.ndarray]:
        """Return the law of n sites in equilibrium at given approaches, and their contact radii, (n,), m.

        before : (n,) float, contact radii in the last equilibrium, m; this law does not depend on them.
        present : (n,) bool, False for sites whose contact radius is zero.
        """
        a = np.zeros(len(R))
        a[present] = self.contact_radius(approach[present], R[present])
        return self, a

    def force(self, a, R):
        """Return the contact force F, N, eq. (1): 4 E* a^3/(3R) - sqrt(8 pi E* gamma a^3)."""
        return self.repulsive_force(a, R) - self.adhesive_force(a)

    def repulsive_force(self, a, R):
        """Return the Hertzian part of the force, 4 E* a^3/(3R), N."""
        return 4 / 3 * self.material.contact_modulus * a**3 / R

    def adhesive_force(self, a):
        """Return the flat-punch part of the force, sqrt(8 pi E* gamma a^3), N; positive in tension."""
        return np.sqrt(8 * np.pi * self.material.contact_modulus * self.work * a**3)

    def approach(self, a, R):
        """Return the approach delta, m, eq. (2): a^2/R - sqrt(2 pi a gamma/E*)."""
        return a**2 / R - np.sqrt(2 * np.pi * a * self.adhesion_length)

    def force_derivative(self, a, R):
        """Return dF/da, N/m."""
        return 4 * self.material.contact_modulus * a**2 / R - 1.5 * np.sqrt(
            8 * np.pi * self.material.contact_modulus * self.work * a
        )

    def area_derivative(self, a):
        """Return the derivative of the contact area with respect to a, m."""
        return 2 * np.pi * a

    def approach_derivative(self, a, R):
        """Return d(delta)/da = 2a/R - sqrt(pi gamma/(2 E* a)) for a > 0; eq. (7) of the paper lacks the 2."""
        slope = 2 * a / R
        if self.material.surface_energy > 0:
            slope = slope - np.sqrt(np.pi * self.adhesion_length / (2 * a))
        return slope

    def radius_derivative(self, a, R):
        """Return da/d(delta) for a > 0; the value is limited near jump-off, where the derivative is infinite."""
        return 1 / np.maximum(self.approach_derivative(a, R), 1e-3 * (a / R))

    def contact_radius(self, approach, R):
        """Solve eq. (2) for its larger (stable) root a, m; below the jump-off approach return the jump-off radius.

        With a = A x^2, A = (gamma R^2/E*)^(1/3) and d = delta R/A^2, eq. (2) is x^4 - sqrt(2 pi) x - d = 0, a convex
        quartic. Newton's method descends to the larger root from above.
        """
        approach, R = np.broadcast_arrays(np.asarray(approach, float), np.asarray(R, float))
        if self.material.surface_energy == 0:
            return np.sqrt(R * np.maximum(approach, 0.0))
        a_unit = np.cbrt(self.adhesion_length * R**2)
        d = approach * R / a_unit**2
        c = np.sqrt(2 * np.pi)
        # This start is not below the root: (u + v)^4 >= u^4 + v^3 (u + v) with u^4 = d, v^3 = c.
        x = np.maximum(d, 0.0) ** 0.25 + np.cbrt(c)
        lowest = np.cbrt(c / 4)  # x at jump-off, where the slope vanishes
        for _ in range(_MAX_NEWTON_STEPS):
            slope = np.maximum(4 * x**3 - c, 1e-100)
            new = np.maximum(x - (x**4 - c * x - d) / slope, lowest)
            done = np.all(x - new <= 4e-16 * x)
            x = np.minimum(new, x)  # rounding must not increase x
            if done:
                break
        return a_unit * x**2

    def energy(self, a, R):
        """Return the elastic energy minus the energy of adhesion, J: the integral of F d(delta) from a = 0.

        8 E* a^5/(15 R^2) - (8/3) sqrt(pi E* gamma/2) a^(7/2)/R + pi gamma a^2, from eqs. (1) and (2).
        """
        E, gamma = self.material.contact_modulus, self.work
        hertz = 8 / 15 * E * a**5 / R**2
        return hertz - 8 / 3 * np.sqrt(np.pi * E * gamma / 2) * a**3.5 / R + np.pi * gamma * a**2

    def jump_off_radius(self, R):
        """Return the contact radius at the smallest approach, where contact breaks, (pi gamma R^2/(8 E*))^(1/3), m."""
        return np.cbrt(np.pi / 8 * self.adhesion_length * np.asarray(R, float) ** 2)

    def jump_off_approach(self, R):
        """Return the smallest approach of the JKR law, -(3/4) (pi^2 gamma^2 R/E*^2)^(1/3), m."""
        return -0.75 * np.cbrt(np.pi**2 * self.adhesion_length**2 * np.asarray(R, float))

    def lowest_approach(self, R, before):
        """Return the approach at which contact breaks, m; `before` is the contact radius in the last equilibrium, m."""
        return self.jump_off_approach(R)

    def jump_off_energy(self, R, before):
        """Return the energy that a spot loses when its contact breaks, J; `before` as in `lowest_approach`."""
        return self.energy(self.jump_off_radius(R), R)

    def jump_in_approach(self, R):
        """Return the approach at which contact forms, (1 - 2.641 mu^(3/7)) epsilon, eq. (3), m; negative for a gap.

        For Tabor parameters mu below about 1.06, the formula gives less than the jump-off approach, where no JKR state
        exists. For very small mu, the formula gives a positive approach. The result is limited to the interval from the
        jump-off approach to zero. Without adhesion the result is zero.
        """
        if self.material.surface_energy == 0:
            return np.zeros(np.shape(R))
        wu = (1 - wu_gap(self.material.tabor_parameter(R))) * self.material.interaction_range
        return np.clip(wu, self.jump_off_approach(R), 0.0)

    def is_jump_in_verified(self, R):
        """Return whether Wu's formula is accurate for radii of curvature R: the Tabor parameter must be 1 or more."""
        return self.material.tabor_parameter(R) >= WU_HOLDS_FROM

    def displacement(self, r, a, R):
        """Return the normal displacement of the half-space at distance r from the centre of the spot, m.

        Outside the spot (r >= a), eq. (5) gives the displacement. Inside, the displacement is a^2/(2R) (2 - r^2/a^2) -
        sqrt(2 pi a gamma/E*). For a = 0, the displacement is zero.
        """
        r, a = np.asarray(r, float), np.asarray(a, float)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = r / a
            outside = s > 1
            arc = np.arcsin(np.where(outside, a / r, 1.0))
            bracket = np.sqrt(np.maximum(s**2 - 1, 0.0)) + (2 - s**2) * arc
            # Far from the spot the bracket is a small difference of large terms: use its series.
            far = s > 20
            t = np.where(far, 1 / s, 0.0)
            bracket = np.where(far, t * (4 / 3 + t**2 * (2 / 15 + t**2 * (3 / 70 + t**2 * 5 / 252))), bracket)
            hertz = np.where(outside, a**2 / (np.pi * R) * bracket, a**2 / R - r**2 / (2 * R))
        punch = np.sqrt(8 * a * self.adhesion_length / np.pi) * arc
        return np.where(a > 0, hertz - punch, 0.0)

    def displacement_derivative(self, r, a, R):
        """Return the derivative of `displacement` with respect to a, for a > 0.

        The adhesive part, sqrt(a)/sqrt(r^2 - a^2), is singular at the edge. If r exceeds a by less than 2.5 %, the
        square root is kept constant. In equilibrium, the centre of another spot is never so close to the edge.
        """
        outside = r > a
        arc = np.arcsin(np.where(outside, a / np.maximum(r, a), 1.0))
        value = 2 / np.pi * arc * self.approach_derivative(a, R)
        if self.material.surface_energy > 0:
            edge = np.sqrt(np.maximum(r**2 - a**2, 0.05 * a**2))
            neck = np.sqrt(8 * self.adhesion_length * a / np.pi) / edge
            value = value - np.where(outside & self.moves, neck, 0.0)
        return value

    def second_moment(self, a, R):
        """Return 1/4 of the integral of p r^2 over the spot, N m^2: the strength of the second far-field term.

        The mean of r^2 is 2a^2/5 for Hertz's pressure and 2a^2/3 for the pressure of a flat punch.
        """
        return a**2 * (self.repulsive_force(a, R) / 10 - self.adhesive_force(a) / 6)

    def second_moment_derivative(self, a, R):
        """Return the derivative of `second_moment` with respect to a, N m."""
        return a * (self.repulsive_force(a, R) / 2 - self.adhesive_force(a) * (3.5 / 6))

    def fourth_moment(self, a, R):
        """Return 9/64 of the integral of p r^4 over the spot, N m^4: the strength of the third far-field term.

        The mean of r^4 is 8a^4/35 for Hertz's pressure and 8a^4/15 for the pressure of a flat punch.
        """
        return a**4 * (self.repulsive_force(a, R) * (9 / 280) - self.adhesive_force(a) * (3 / 40))

    def fourth_moment_derivative(self, a, R):
        """Return the derivative of `fourth_moment` with respect to a, N m^3."""
        return a**3 * (self.repulsive_force(a, R) * (9 / 40) - self.adhesive_force(a) * (5.5 * 3 / 40))

    def moments(self, a, R, count):
        """Return the integrals of p (r/a)^(2k) over m spots for k = 0 ... count-1: array of shape (m, count), N."""
        order = np.arange(count)
        # Means of (r/a)^(2k), weighted with Hertz's pressure and with the pressure of the flat punch.
        hertz, punch = 1.5 * beta(order + 1, 1.5), 0.5 * beta(order + 1, 0.5)
        return self.repulsive_force(a, R)[:, None] * hertz - self.adhesive_force(a)[:, None] * punch

    def pressure_amplitudes(self, a, R):
        """Return P and B (Pa) of the pressure in eq. (8), p(r) = P sqrt(1-r^2/a^2) - B/sqrt(1-r^2/a^2)."""
        peak = 2 * self.material.contact_modulus * a / (np.pi * R)
        neck = np.sqrt(2 * self.material.contact_modulus * self.work / (np.pi * a))
        return peak, neck

    def pressure(self, r, a, R):
        """Return the contact pressure at the distance r < a from the centre of the spot, eq. (8), Pa."""
        peak, neck = self.pressure_amplitudes(a, R)
        s = np.sqrt(1 - (r / a) ** 2)
        return peak * s - neck / s

    def pressure_distribution(self, p, a, R):
        """Return the area (m^2) of the spot where the pressure is at most p (Pa), and the force (N) on this area.

        The pressure rises with s = sqrt(1 - r^2/a^2); the area up to s is pi a^2 s^2, and the force on this
        area is 2 pi a^2 (P s^3/3 - B s).
        """
        peak, neck = self.pressure_amplitudes(a, R)
        root = np.sqrt(p**2 + 4 * peak * neck)
        # Both formulas give the positive root of P s^2 - p s - B = 0 without a difference of nearly equal numbers.
        with np.errstate(divide="ignore", invalid="ignore"):
            s = np.where(p >= 0, (p + root) / (2 * peak), np.where(root > p, 2 * neck / (root - p), 0.0))
        s = np.minimum(s, 1.0)
        return np.pi * a**2 * s**2, 2 * np.pi * a**2 * (peak * s**3 / 3 - neck * s)

    def union(self, a_i, R_i, a_j, R_j):
        """Return the union of two spots: contact radius (m), radius of curvature (m), and position of the centre.

        a^2 = a_i^2 + a_j^2 and R^2 = R_i^2 + R_j^2. The centre is the centroid of the cap volumes pi a^4/(4R),
        given as a fraction of the distance from the first spot to the second.
        """
        volume_i, volume_j = a_i**4 / R_i, a_j**4 / R_j
        return np.hypot(a_i, a_j), np.hypot(R_i, R_j), volume_j / (volume_i + volume_j)

    def unite(self, i, j, a, radius) -> JKR:
        """Return the law of the unions of spots i and j (indices), whose contact radii are `radius`, m.

        a : (n,) float, contact radii of all spots, m; this law does not depend on them.
        """
        return self


def wu_gap(tabor_parameter: np.ndarray | float) -> np.ndarray | float:
    """Return Wu's gap at the jump into contact, divided by the range of attraction: 2.641 mu^(3/7), eq. (3)."""
    return 2.641 * tabor_parameter ** (3 / 7)


class MaterialUnits:
    """Base class of contacts: properties that depend only on the law of a spot and the rms slope of the surface."""

    law: JKR
    rms_slope: float

    @property
    def adhesive(self) -> bool:
        """True with adhesion: contact forms and breaks in jumps."""
        return self.law.material.surface_energy > 0

    @property
    def contact_modulus(self) -> float:
        """Contact modulus E*, Pa."""
        return self.law.material.contact_modulus

    @property
    def pressure_unit(self) -> float:
        """Unit of reduced pressures, E* h'_rms, Pa."""
        return self.contact_modulus * self.rms_slope
