"""Material: composite modulus, energy of adhesion and range of attraction."""

from dataclasses import dataclass

import numpy as np

from icha.asperity.full_contact import flaw_strength, theoretical_strength
from icha.support.rules import ADHESION_LENGTH, CONTACT_MODULUS, LENGTH, SURFACE_ENERGY

# From this Tabor parameter on Wu's distance of the jump into contact is within 0.5 % of the exact one, which
# validation.jump_in computes.
WU_HOLDS_FROM = 1.0


@dataclass(frozen=True)
class Material:
    """Composite elastic modulus, adhesion energy and range of attraction of an interface.

    Parameters
    ----------
    contact_modulus : E*, composite elastic modulus, Pa, in [1e-9, 1e15].
    surface_energy : energy of adhesion per unit area, J/m^2; zero, which is adhesionless contact, or in (0, 1e24] and,
        over the modulus, in [1e-40, 1e9] m.
    interaction_range : range of the attractive forces (epsilon in eq. 3 of Violano & Afferrante), m, in [1e-24, 1e9].
    flaw_radius : radius of the largest flaw of the interface, m, in [1e-24, 1e9]; 0 for an interface without flaws.

    Raises
    ------
    ValueError
        Naming the parameter whose value is not allowed.
    """

    contact_modulus: float
    surface_energy: float
    interaction_range: float
    flaw_radius: float = 0.0

    def __post_init__(self):
        """Check the values."""
        object.__setattr__(self, "contact_modulus", CONTACT_MODULUS.validate("contact_modulus", self.contact_modulus))
        object.__setattr__(self, "surface_energy", SURFACE_ENERGY.validate("surface_energy", self.surface_energy))
        object.__setattr__(self, "interaction_range", LENGTH.validate("interaction_range", self.interaction_range))
        if self.flaw_radius != 0:
            object.__setattr__(self, "flaw_radius", LENGTH.validate("flaw_radius", self.flaw_radius))
        if self.surface_energy:
            ADHESION_LENGTH.validate("surface_energy over contact_modulus", self.adhesion_length)

    @property
    def adhesion_length(self) -> float:
        """Surface energy over contact modulus, m: the elasto-adhesive length."""
        return self.surface_energy / self.contact_modulus

    @property
    def theoretical_strength(self) -> float:
        """Largest tension of the attraction, Pa."""
        return theoretical_strength(self.surface_energy, self.interaction_range)

    @property
    def interface_strength(self) -> float:
        """Tension at which closed contact opens, Pa: the theoretical strength, or that of the flaw if it is lower."""
        if not self.flaw_radius:
            return self.theoretical_strength
        of_flaw = flaw_strength(self.contact_modulus, self.surface_energy, self.flaw_radius)
        return min(self.theoretical_strength, of_flaw)

    def tabor_parameter(self, R: np.ndarray | float) -> np.ndarray:
        """Return the Tabor parameter (gamma^2 R/E*^2)^(1/3)/epsilon for radii of curvature R, m; see eq. (3)."""
        return np.cbrt(self.adhesion_length**2 * R) / self.interaction_range
