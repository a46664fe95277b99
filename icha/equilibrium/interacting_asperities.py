"""Interacting asperities: the model of contact of Violano & Afferrante, which a path is followed with."""

from dataclasses import dataclass

import numpy as np

from icha.contact.events import Events
from icha.contact.model import AREA_FRACTION, PRESSURE, Control
from icha.equilibrium.control import derivative, held_value
from icha.equilibrium.energy import stored_energy
from icha.equilibrium.equilibrium import equilibrium
from icha.equilibrium.problem import Problem
from icha.equilibrium.states import ContactState, untouched
from icha.half_space.free_square import mean_displacement

# How much of the surface contact may cover: targets are met up to a quarter of it, looked for somewhat beyond.
_LARGEST_AREA = 1.5 * 0.25
# At such a rate to the separation the approach of a spot rises, as the surfaces part, on an unstable branch only.
_RUNAWAY = 10.0


@dataclass(frozen=True, eq=False)
class InteractingAsperities(Problem):
    """Asperities that interact through the half-space and unite where they overlap: a `ContactModel`.

    Quantities of a state are those of its spots (`ContactState.spots`).
    """

    @property
    def largest_area_fraction(self) -> float:
        """Contact area over nominal area beyond which spots have lost their identity."""
        return _LARGEST_AREA

    def untouched(self) -> ContactState:
        """The state at which the first asperity is about to make contact."""
        return untouched(self)

    def equilibrium(
        self, state: ContactState, separation: float, control: Control | None = None, *, let_go: int = 0
    ) -> ContactState:
        """The contact brought to another mean separation (m), or to a given load or area; as of `ContactModel`."""
        return equilibrium(self, state, separation, control, spots_let_go=let_go)

    def pressure(self, state: ContactState) -> float:
        """Total force over nominal area, Pa."""
        return held_value(self, PRESSURE, state.spots.contact_radius, state.spots.radius_of_curvature)

    def area_fraction(self, state: ContactState) -> float:
        """Total contact area over nominal area."""
        return held_value(self, AREA_FRACTION, state.spots.contact_radius, state.spots.radius_of_curvature)

    def mean_gap(self, state: ContactState) -> float:
        """Mean over the square of separation and displacement, m; of a periodic surface the mean separation.

        Of a free square the spots act as forces at their centres.
        """
        if not self.asperities.free:
            return state.separation
        spots = state.spots
        force = self.law.force(spots.contact_radius, spots.radius_of_curvature)
        return state.separation + mean_displacement(self.asperities.period, self.contact_modulus, spots.position, force)

    def spot_count(self, state: ContactState) -> int:
        """Number of contact spots."""
        return len(state.spots)

    def stiffness(self, state: ContactState) -> float:
        """-dp/du of the present spots, Pa/m, from the tangent of the equilibrium."""
        return 0.0 - self.slope(PRESSURE, state)

    def slope(self, quantity: str, state: ContactState) -> float:
        """Derivative of a quantity that can be held with respect to the mean separation, at unchanged contacts."""
        return derivative(self, quantity, state)

    def stored_energy(self, state: ContactState) -> float:
        """Elastic energy less that of adhesion over nominal area, J/m^2 (`icha.equilibrium.energy`)."""
        return stored_energy(self, state)

    def is_unstable(self, state: ContactState) -> bool:
        """Whether a spot would come closer as the surfaces part."""
        return bool(np.max(state.responses, initial=0.0) > _RUNAWAY)

    def events_between(self, before: ContactState, after: ContactState) -> Events:
        """The events on the path from one state to a later one."""
        return Events.joined(after.history[len(before.history) :])
