"""Interacting asperities: the model of contact of Violano & Afferrante, which a path is followed with."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.contact.model import AREA_FRACTION, PRESSURE, Control, Events, largest_tension, summit_counts
from icha.contact.models import DEFAULT_MODEL, MODELS, PathAccuracy
from icha.equilibrium.distributions import gap_distribution, pressure_distribution
from icha.equilibrium.equations import derivative, held_value, stored_energy
from icha.equilibrium.equilibrium import equilibrium
from icha.equilibrium.sites import ContactState, Problem, untouched
from icha.half_space.free_square import mean_displacement
from icha.surfaces.summits import LARGEST_DEPARTURE, SummitCoverage, find_summits, paraboloid_departure
from icha.surfaces.surface import Surface

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

    @property
    def path_accuracy(self) -> PathAccuracy:
        """Accuracy to which a path resolves its events."""
        return MODELS[DEFAULT_MODEL].accuracy

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
        """Elastic energy less that of adhesion over nominal area, J/m^2 (`icha.equilibrium.equations`)."""
        return stored_energy(self, state)

    def is_unstable(self, state: ContactState) -> bool:
        """Whether a spot would come closer as the surfaces part."""
        return bool(np.max(state.responses, initial=0.0) > _RUNAWAY)

    def events_between(self, before: ContactState, after: ContactState) -> Events:
        """The events on the path from one state to a later one."""
        return Events.joined(after.history[len(before.history) :])

    def observables(self, surface: Surface) -> AsperityObservables:
        """What a run keeps of the states on the surface that is pressed."""
        return AsperityObservables(self, surface)


@dataclass(frozen=True, eq=False)
class AsperityObservables:
    """Observables of a contact of asperities and of the surface that they are on, beyond those of every model."""

    contact: InteractingAsperities
    surface: Surface

    def of_contact(self) -> dict:
        """What holds for all states."""
        return summit_counts(self.contact.asperities)

    def of_step(self, state: ContactState) -> dict:
        """Error of the equilibrium, events so far, and how far Wu's formula is known to hold."""
        law, spots = self.contact.law, state.spots
        single = spots.members == 1
        verified = law.is_jump_in_verified(spots.radius_of_curvature[single])
        outside = np.count_nonzero(~verified) / max(len(verified), 1)
        return {
            "residual": state.residual,
            "jump_in_count": state.jump_ins,
            "jump_off_count": state.jump_offs,
            "coalescence_count": state.coalescences,
            "split_count": state.splits,
            "pending_count": state.pending,
            "outside_wu_fraction": outside if self.contact.adhesive else 0.0,
        }

    def of_snapshot(self, state: ContactState) -> dict:
        """Distributions of gap and pressure, and the spots."""
        law, spots = self.contact.law, state.spots
        gaps = gap_distribution(law, self.surface, state)
        pressures = pressure_distribution(law, self.surface, spots)
        return {
            "overlap_fraction": gaps.overlap_fraction,
            "area_beyond_edges": gaps.beyond_edges,
            "gap_density": gaps.density,
            "pressure_density": pressures.density,
            "pressure_bin_mean": pressures.mean,
            "spot_x": spots.position[:, 0],
            "spot_y": spots.position[:, 1],
            "spot_radius": spots.contact_radius,
            "spot_area": np.pi * spots.contact_radius**2,
            "spot_perimeter": 2 * np.pi * spots.contact_radius,
            "spot_force": law.force(spots.contact_radius, spots.radius_of_curvature),
            "spot_curvature_radius": spots.radius_of_curvature,
            "spot_members": spots.members,
        }

    def reasons_against(self, separations: Iterable[float], pressed: ContactState | None) -> list[str]:
        """Reasons why asperities do not stand for the surface in its first loading."""
        reasons = SummitCoverage.of(self.surface, self.contact.asperities).reasons_against(separations)
        if pressed is not None and (departure := self._departure(pressed)) > LARGEST_DEPARTURE:
            reasons.append(
                "the tops are not parabolic over the contact spots: their depth at the edges differs by a factor of "
                f"{np.exp(departure):.2g} on average, expected at most {np.exp(LARGEST_DEPARTURE):.2g}"
            )
        return reasons

    def _departure(self, state: ContactState) -> float:
        """Departure of the surface from the paraboloids of the spots of one summit."""
        spots = state.spots
        single = spots.members == 1
        return paraboloid_departure(
            self.surface, spots.position[single], spots.contact_radius[single], spots.radius_of_curvature[single]
        )

    @property
    def largest_tension(self) -> float:
        """Tension of all summits pulling their most at once, Pa."""
        contact = self.contact
        return largest_tension(contact.asperities, contact.law.material.surface_energy, contact.area)


def contact_of(surface: Surface, material: Material) -> InteractingAsperities:
    """The contact of a surface and a material; raises `ValueError` if the surface has no summits."""
    return InteractingAsperities(JKR(material), find_summits(surface), surface.rms_height, surface.rms_slope)
