"""Observables of interacting asperities: what a run's dataset has of their states, by the names of its variables."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from icha.contact.observables import summit_counts
from icha.equilibrium.distributions import gap_distribution, pressure_distribution
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.equilibrium.states import ContactState
from icha.surfaces.summits import SummitCoverage
from icha.surfaces.surface import Surface


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

    def reasons_against(self, separations: Iterable[float]) -> list[str]:
        """Reasons why asperities do not stand for the surface at these mean separations, m."""
        return SummitCoverage.of(self.surface, self.contact.asperities).reasons_against(separations)

    @property
    def largest_tension(self) -> float:
        """Tension of all asperities pulling their most at once, 3/2 pi dgamma sum(R)/A0, Pa."""
        sum_of_radii = float(np.sum(self.contact.asperities.radius_of_curvature))
        return 1.5 * np.pi * self.contact.law.material.surface_energy * sum_of_radii / self.contact.area
