"""The problem: a law of one spot and the summits of one surface."""

from dataclasses import dataclass, field

import numpy as np

from icha.asperity.law import SpotLaw
from icha.surfaces.summits import Asperities


@dataclass(frozen=True, eq=False)
class Problem:
    """Asperities in contact with a half-space.

    law: of one spot. rms_height: the length that makes errors of an equilibrium dimensionless, m. jump_in:
    the asperities' jump-in approaches (n,), m.
    """

    law: SpotLaw
    asperities: Asperities
    rms_height: float
    jump_in: np.ndarray = field(init=False)

    def __post_init__(self):
        """Evaluate the asperities' jump-in approaches once."""
        object.__setattr__(self, "jump_in", self.law.jump_in_approach(self.asperities.radius_of_curvature))

    @property
    def area(self) -> float:
        """Nominal contact area A0, m^2."""
        return self.asperities.period**2

    @property
    def adhesive(self) -> bool:
        """Whether contact forms and breaks in jumps."""
        return self.law.material.surface_energy > 0

    @property
    def contact_modulus(self) -> float:
        """E*, Pa."""
        return self.law.material.contact_modulus
