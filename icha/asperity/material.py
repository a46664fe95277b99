"""Material of a contact: composite modulus, work of adhesion, range of attraction, and size of flaws."""

import math
from dataclasses import dataclass, replace

import numpy as np

from icha.asperity.adhesion_map import AdhesionMap, map_of
from icha.support.formatting import format_quantity, html_table
from icha.support.rules import ADHESION_LENGTH, CONTACT_MODULUS, LENGTH, POISSON_RATIO, SURFACE_ENERGY

# Smallest Tabor parameter for which Wu's distance of the jump into contact is within 0.5 % of the exact distance
# (docs/model.md).
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
        With adhesion, surface_energy/contact_modulus must be in [1e-40, 1e9] m. A pair gives the work of advancing and
        that of receding fronts; the attribute is then the first, and `receding_energy` the second. A `Stripes` or
        `Patches`, or an array (n, n) on the nodes of the surface, gives the work at every place; the attribute is then
        the mean, and `adhesion_map` the map. In a pair, the first may be a map; the second is then a mean.
    interaction_range : range of the attractive forces (epsilon in eq. 3 of Violano & Afferrante), m, in [1e-24, 1e9].
        Default: 0.5 nm, about the distance between molecules, as for van der Waals forces.
    flaw_radius : radius of the largest flaw of the interface, m, in [1e-24, 1e9]; 0 for an interface without flaws.
    thickness : thickness of an elastic layer on a rigid base, m, in [1e-24, 1e9]; infinite for a half-space.
    poisson_ratio : Poisson ratio of the layer, in [0, 0.5]; a half-space does not depend on it at a given E*.
    receding_energy : work of adhesion of receding fronts, J/m^2, larger than `surface_energy`; None for one value.
        Two equal values are one value.
    adhesion_map : works of adhesion from place to place, relative to their mean; None for one work at every place.

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
    receding_energy: float | None = None
    adhesion_map: AdhesionMap | None = None

    def __post_init__(self):
        """Check the values."""
        if isinstance(self.surface_energy, (tuple, list)):
            self._set_pair()
        if (places := map_of(self.surface_energy)) is not None:
            object.__setattr__(self, "surface_energy", places.mean)
            object.__setattr__(self, "adhesion_map", places)
        object.__setattr__(self, "adhesion_map", map_of(self.adhesion_map))
        if self.receding_energy == self.surface_energy:
            object.__setattr__(self, "receding_energy", None)
        rules = {"contact_modulus": CONTACT_MODULUS, "surface_energy": SURFACE_ENERGY, "interaction_range": LENGTH}
        rules |= {"flaw_radius": LENGTH} if self.flaw_radius != 0 else {}
        rules |= {"thickness": LENGTH} if self.layered else {}
        rules |= {"poisson_ratio": POISSON_RATIO}
        for name, rule in rules.items():
            object.__setattr__(self, name, rule.validate(name, getattr(self, name)))
        if self.surface_energy:
            ADHESION_LENGTH.validate("surface_energy over contact_modulus", self.adhesion_length)
        if self.receding_energy is not None:
            self._check_receding()

    def _set_pair(self):
        """Set the works of adhesion from a pair of advancing and receding values."""
        if len(self.surface_energy) != 2 or self.receding_energy is not None:
            raise ValueError(
                f"surface_energy: {self.surface_energy!r} must be a number, or a pair (advancing, receding)"
            )
        advancing, receding = self.surface_energy
        object.__setattr__(self, "surface_energy", advancing)
        object.__setattr__(self, "receding_energy", receding)

    def _check_receding(self):
        """Check that fronts recede at a larger work of adhesion than they advance."""
        receding = SURFACE_ENERGY.validate("receding surface_energy", self.receding_energy)
        object.__setattr__(self, "receding_energy", receding)
        if not 0 < self.surface_energy < receding:
            raise ValueError(
                f"surface_energy: advancing {self.surface_energy:g} J/m^2, receding {receding:g} J/m^2; expected "
                "0 < advancing <= receding"
            )

    def _repr_html_(self) -> str:
        """Return a table for notebooks."""
        rows = {
            "contact modulus": format_quantity(self.contact_modulus, "Pa"),
            "mean work of adhesion" if self.adhesion_map else "work of adhesion": format_quantity(
                self.surface_energy, "J/m²"
            ),
            **({"receding": format_quantity(self.receding_energy, "J/m²")} if self.receding_energy else {}),
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
    def directed(self) -> bool:
        """True if receding fronts have a larger work of adhesion than advancing ones."""
        return self.receding_energy is not None

    @property
    def receding(self) -> "Material":
        """The material with the work of adhesion of receding fronts for both directions."""
        receding = self.receding_energy
        return self if receding is None else replace(self, surface_energy=receding, receding_energy=None)

    def relative_energy(self, grid: int, side: float, *, periodic: bool) -> np.ndarray | float:
        """Return the work of adhesion over its mean at the nodes of a square, (n, n); 1 without a map.

        Raises `ValueError` if the map does not fit the square.
        """
        if self.adhesion_map is None:
            return 1.0
        return self.adhesion_map.on_nodes(grid, side, periodic=periodic) / self.adhesion_map.mean

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
