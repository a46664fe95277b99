"""The law of one asperity whose edge advances at one work of adhesion and recedes at a larger one.

The edge of a spot advances where the energy release rate falls to the advancing work, and recedes where it reaches the
receding work. In between it stands: the contact radius a stays, and the spot is a flat punch of the stiffness 2 E* a.
The state of a spot is its contact radius and its energy release rate G. With G as the work of adhesion, all formulas
of `icha.asperity.jkr.JKR` remain valid.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from icha.asperity.jkr import JKR


@dataclass(frozen=True, eq=False)
class DirectedJKR(JKR):
    """Contact of paraboloids whose edges advance at `material.surface_energy` and recede at `receding_energy`.

    `find_states` returns the law of sites in their states. Without states, the law is that of advancing edges.
    A derivative with respect to the contact radius is that with respect to the approach if the edge of the spot stands.

    Attributes
    ----------
    rate : (n,) float, energy release rates at the edges of n spots, J/m^2; None without states.
    stands : (n,) bool, True for edges that neither advance nor recede.
    """

    rate: np.ndarray | None = None
    stands: np.ndarray | bool = False

    @property
    def moves(self) -> np.ndarray | bool:
        """Mask of the spots whose edges advance or recede when their approaches change."""
        return np.logical_not(self.stands)

    @property
    def work(self) -> np.ndarray | float:
        """Energy release rate at the edges of the spots, J/m^2; without states the advancing work of adhesion."""
        return self.material.surface_energy if self.rate is None else self.rate

    @cached_property
    def receding(self) -> JKR:
        """Law of spots whose edges recede."""
        return JKR(self.material.receding)

    def select(self, which) -> JKR:
        """Return the law of selected spots: indices or a mask."""
        if self.rate is None:
            return self
        return replace(self, rate=self.rate[which], stands=np.asarray(self.stands)[which])

    def find_states(self, approach, R, before, present) -> tuple[JKR, np.ndarray]:
        """Return the law of n sites in equilibrium at given approaches, and their contact radii, (n,), m.

        A spot below its `lowest_approach` keeps the state there.

        before : (n,) float, contact radii in the last equilibrium, m; at least the jump-off radii of advancing edges.
        present : (n,) bool, False for sites whose contact radius is zero.
        """
        approach = np.maximum(approach, self.lowest_approach(R, before))
        smallest, largest = self.contact_radius(approach, R), self.receding.contact_radius(approach, R)
        a = np.maximum(smallest, np.minimum(largest, before))
        stands = (smallest < before) & (before < largest)
        standing = self.material.contact_modulus * (a**2 / R - approach) ** 2 / (2 * np.pi * a)
        moving = np.where(before <= smallest, self.material.surface_energy, self.receding.work)
        return replace(self, rate=np.where(stands, standing, moving), stands=stands), np.where(present, a, 0.0)

    def unite(self, i, j, a, radius) -> JKR:
        """Return the law of the unions of spots i and j (indices), whose contact radii are `radius`, m.

        The edges of the unions stand. The adhesive force of a union is the sum of those of its spots, as far as the
        energy release rate stays between both works of adhesion.

        a : (n,) float, contact radii of all spots, m.
        """
        force = self.select(i).adhesive_force(a[i]) + self.select(j).adhesive_force(a[j])
        rate = force**2 / (8 * np.pi * self.material.contact_modulus * radius**3)
        rate = np.clip(rate, self.material.surface_energy, self.receding.work)
        return replace(self, rate=rate, stands=np.ones(len(rate), dtype=bool))

    def force_derivative(self, a, R):
        """Return dF/da, N/m; 2 E* a for edges that stand."""
        return np.where(self.stands, 2 * self.material.contact_modulus * a, super().force_derivative(a, R))

    def area_derivative(self, a):
        """Return the derivative of the contact area with respect to a, m; zero for edges that stand."""
        return np.where(self.stands, 0.0, super().area_derivative(a))

    def approach_derivative(self, a, R):
        """Return d(delta)/da for a > 0; 1 for edges that stand."""
        return np.where(self.stands, 1.0, super().approach_derivative(a, R))

    def second_moment_derivative(self, a, R):
        """Return the derivative of `second_moment`; that of a flat punch for edges that stand."""
        punch = a**2 / 6 * (2 * self.material.contact_modulus * a)
        return np.where(self.stands, punch, super().second_moment_derivative(a, R))

    def fourth_moment_derivative(self, a, R):
        """Return the derivative of `fourth_moment`; that of a flat punch for edges that stand."""
        punch = a**4 * (3 / 40) * (2 * self.material.contact_modulus * a)
        return np.where(self.stands, punch, super().fourth_moment_derivative(a, R))

    def energy(self, a, R):
        """Return the elastic energy minus the energy of adhesion, J, with the advancing work of adhesion."""
        return super().energy(a, R) + np.pi * (self.work - self.material.surface_energy) * a**2

    def lowest_approach(self, R, before):
        """Return the approach at which contact breaks, m.

        An edge that recedes becomes unstable at the jump-off radius of the receding work. A smaller contact of radius
        `before`, m, breaks as a flat punch when the energy release rate reaches the receding work (Kendall 1971).
        """
        as_punch = before < self.receding.jump_off_radius(R)
        return np.where(as_punch, self.receding.approach(before, R), self.receding.jump_off_approach(R))

    def jump_off_energy(self, R, before):
        """Return the energy that a spot loses when its contact breaks, J, without the dissipation of its edge."""
        return self.receding.energy(np.minimum(before, self.receding.jump_off_radius(R)), R)
