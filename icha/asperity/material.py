"""Material of a contact: composite modulus, work of adhesion, range of attraction, and size of flaws."""

import math
from dataclasses import dataclass

import numpy as np

from icha.support.formatting import format_quantity, html_table
from icha.support.rules import ADHESION_LENGTH, CONTACT_MODULUS, LENGTH, POISSON_RATIO, SURFACE_ENERGY

# Smallest Tabor parameter for which Wu's distance of the jump into contact is within 0.5 % of the exact distance
# (`validation/jump_in.py`).
WU_HOLDS_FROM = 1.0

# Default range of attraction, m: about the distance between molecules, where van der Waals forces are strongest (J. N.
# Israelachvili, Intermolecular and Surface Forces, 3rd ed., 2011, section 13).
VAN_DER_WAALS_RANGE = 0.5e-9


@dataclass(frozen=True)
class Material:
    """Composite elastic modulus, work of adhesion, range of attraction and largest flaw of an interface.

    Parameters
    ----------
    contact_modulus : E*, composite elastic modulus, Pa, in [1e-9, 1e15].
    surface_energy : work of adhesion dgamma (gamma in the paper), J/m^2, at most 1e24; zero without adhesion.
        With adhesion, surface_energy/contact_modulus must be in [1e-40, 1e9] m.
    interaction_range : range of the attractive forces (epsilon in eq. 3 of Violano & Afferrante), m, in [1e-24, 1e9].
        Default: 0.5 nm, about the distance between molecules, as for van der Waals forces.
    flaw_radius : radius of the largest flaw of the interface, m, in [1e-24, 1e9]; 0 for an interface without flaws.
    thickness : thickness of an elastic layer on a rigid base, m, in [1e-24, 1e9]; infinite for a half-space.
    poisson_ratio : Poisson ratio of the layer, in [0, 0.5]; a half-space does not depend on it at a given E*.

    Raises
    ------
    ValueError
        If a value is out of range; the message names the parameter.
    """

    contact_modulus: float
    surface_energy: float
    interaction_range: float = VAN_DER_WAALS_RANGE
    flaw_radius: float = 0.0
    thickness: float = math.inf
    poisson_ratio: float = 0.5

    def __post_init__(self):
        """Check the values."""
        rules = {"contact_modulus": CONTACT_MODULUS, "surface_energy": SURFACE_ENERGY, "interaction_range": LENGTH}
        rules |= {"flaw_radius": LENGTH} if self.flaw_radius != 0 else {}
        rules |= {"thickness": LENGTH} if self.layered else {}
        rules |= {"poisson_ratio": POISSON_RATIO}
        for name, rule in rules.items():
            object.__setattr__(self, name, rule.validate(name, getattr(self, name)))
        if self.surface_energy:
            ADHESION_LENGTH.validate("surface_energy over contact_modulus", self.adhesion_length)

    def _repr_html_(self) -> str:
        """Return a table for notebooks."""
        rows = {
            "contact modulus": format_quantity(self.contact_modulus, "Pa"),
            "work of adhesion": format_quantity(self.surface_energy, "J/m²"),
            "range of attraction": format_quantity(self.interaction_range, "m"),
        }
        if self.layered:
            rows |= {"thickness": format_quantity(self.thickness, "m"), "Poisson ratio": f"{self.poisson_ratio:g}"}
        return html_table("Material", rows)

    @property
    def layered(self) -> bool:
        """True for a layer of finite thickness."""
        return self.thickness != math.inf

    @property
    def adhesion_length(self) -> float:
        """Surface energy divided by contact modulus, the elasto-adhesive length, m."""
        return self.surface_energy / self.contact_modulus

    @property
    def theoretical_strength(self) -> float:
        """Largest tension of a Lennard-Jones attraction, 16/(9 sqrt(3)) dgamma/epsilon, Pa."""
        return 16 / (9 * math.sqrt(3)) * self.surface_energy / self.interaction_range

    @property
    def interface_strength(self) -> float:
        """Tension at which closed contact opens, Pa: the smaller of theoretical strength and strength with the flaw.

        The flaw, a penny-shaped crack of radius a, grows at the tension sigma = sqrt(pi E* dgamma/(2 a)). At this
        tension, the stress intensity is K = 2 sigma sqrt(a/pi), and the energy release rate is K^2/(2 E*) = dgamma. The
        rate has the factor 1/2 because one body is rigid (I. N. Sneddon, Proc. R. Soc. A 187 (1946) 229-260).
        """
        if not self.flaw_radius:
            return self.theoretical_strength
        flaw_strength = math.sqrt(math.pi * self.contact_modulus * self.surface_energy / (2 * self.flaw_radius))
        return min(self.theoretical_strength, flaw_strength)

    def tabor_parameter(self, R: np.ndarray | float) -> np.ndarray:
        """Return the Tabor parameter (gamma^2 R/E*^2)^(1/3)/epsilon for radii of curvature R, m; see eq. (3)."""
        return np.cbrt(self.adhesion_length**2 * R) / self.interaction_range
