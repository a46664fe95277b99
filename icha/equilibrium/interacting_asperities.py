"""Interacting asperities: the contact model of Violano & Afferrante, as a `ContactModel` for `icha.path`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from icha.asperity.directed_jkr import DirectedJKR
from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.contact.model import AREA_FRACTION, PRESSURE, Control
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.equilibrium.distributions import edge_share, gap_distribution, pressure_distribution
from icha.equilibrium.equations import derivative_by_radius, pressure_or_area_fraction, radius_slope
from icha.equilibrium.sites import AsperityContact, ContactState, Sites
from icha.equilibrium.solver import find_equilibrium
from icha.half_space.free_square import mean_displacement
from icha.surfaces.summits import LARGEST_DEPARTURE, SummitCoverage, find_summits, paraboloid_departure
from icha.surfaces.surface import Surface

# A spot is unstable if the derivative of its approach with respect to the separation exceeds this value. A stable spot
# can have a smaller positive derivative: when its neighbours lose load, the half-space below the spot rises.
_UNSTABLE_RESPONSE = 10.0


@dataclass(frozen=True, eq=False)
class InteractingAsperities(AsperityContact):
    """Asperities that interact through the half-space and unite where they overlap: a `ContactModel`.

    Attributes
    ----------
    shape : None, because the model is not for shapes.
    """

    shape: None = None
    # Largest contact area fraction of a state. A target is at most 0.25, but the search for a target may exceed 0.25.
    largest_area_fraction = 1.5 * 0.25
    area_step = 0.0
    is_unique = False
    spots_jump = True
    path_accuracy = MODELS[DEFAULT_MODEL].accuracy

    def untouched(self) -> ContactState:
        """Return the state without contact, where the first asperity (not always the highest) is about to jump in."""
        asperities = self.asperities
        separation = float(np.max(asperities.height - self.jump_in_approach))
        return ContactState(
            separation=separation,
            sites=Sites.empty(self.law, asperities),
            law=self.law,
            site_of_asperity=np.full(len(asperities), -1),
            last_approach=asperities.height - separation,
            last_separation=np.full(len(asperities), separation),
        )

    def equilibrium(
        self, state: ContactState, separation: float, control: Control | None = None, *, let_go: int = 0
    ) -> ContactState:
        """Find the equilibrium at another mean separation (m), load or area; see `ContactModel.equilibrium`."""
        return find_equilibrium(self, state, separation, control, let_go=let_go)

    def continue_from(self, state: ContactState, before: ContactState) -> None:
        """Return None: spots depend on the path, so the state must be computed again from the state `before`."""

    def pressure(self, state: ContactState) -> float:
        """Return the force divided by the nominal area, Pa."""
        spots = state.spots
        return pressure_or_area_fraction(self, spots.law, PRESSURE, spots.contact_radius, spots.radius_of_curvature)

    def area_fraction(self, state: ContactState) -> float:
        """Return the contact area divided by the nominal area."""
        spots = state.spots
        radii = spots.contact_radius, spots.radius_of_curvature
        return pressure_or_area_fraction(self, spots.law, AREA_FRACTION, *radii)

    def mean_gap(self, state: ContactState) -> float:
        """Return the mean gap, m; on a periodic surface it is the mean separation.

        On a free square the mean displacement is added, computed with a point force at the centre of each spot.
        """
        if not self.asperities.free:
            return state.separation
        spots = state.spots
        force = spots.law.force(spots.contact_radius, spots.radius_of_curvature)
        displacement = mean_displacement(self.asperities.period, self.contact_modulus, spots.position, force)
        return state.separation + displacement

    def spot_count(self, state: ContactState) -> int:
        """Return the number of contact spots."""
        return len(state.spots)

    def stiffness(self, state: ContactState) -> float:
        """Return the contact stiffness -dp/du with the set of spots unchanged, Pa/m."""
        return 0.0 - self.slope(PRESSURE, state)  # not -0.0 without contact

    def slope(self, quantity: str, state: ContactState) -> float:
        """Return d(quantity)/d(mean separation) while no event occurs; `quantity` is PRESSURE or AREA_FRACTION."""
        sites, c, law = state.sites, state.contact_index, state.spots.law
        a, R = sites.contact_radius[c], sites.radius_of_curvature[c]
        growth = radius_slope(law, a, R, sites.approach[c], sites.jump_off_approach[c]) * sites.response[c]
        return float(np.sum(derivative_by_radius(self, law, quantity, a, R) * growth))

    def stored_energy(self, state: ContactState) -> float:
        """Return the elastic energy minus the energy of adhesion, per nominal area, J/m^2; zero without contact.

        The energy of a spot is that of a single JKR contact, plus F w/2. Here F is the force of the spot, and w the
        displacement at its centre by the other spots, as in eq. (4). Because w is taken at the centre, two spots of
        different size do not act equally on each other. So along a path without events, the change of the energy is not
        exactly the work done. At a distance r of two spots, the difference is about (a/r)^2 of the interaction energy.
        """
        spots, law = state.spots, state.spots.law
        a, R = spots.contact_radius, spots.radius_of_curvature
        displacement = spots.height - state.separation - spots.approach
        return float(np.sum(law.energy(a, R) + 0.5 * law.force(a, R) * displacement)) / self.area

    def front_dissipation(self, state: ContactState) -> float:
        """Return what receding fronts have dissipated so far, J/m^2 of nominal area; 0 with one work of adhesion."""
        material = self.law.material
        return (material.receding.surface_energy - material.surface_energy) * state.receded_area / self.area

    def reason_beyond(self, state: ContactState) -> str:
        """Return an empty text: the areas and gaps of the path limit this model."""
        return ""

    def is_unstable(self, state: ContactState) -> bool:
        """Return whether any spot is unstable: its approach grows fast with the separation, d(delta)/du > 10."""
        return bool(np.max(state.sites.response[state.contact_index], initial=0.0) > _UNSTABLE_RESPONSE)

    def observables(self, surface: Surface) -> AsperityObservables:
        """Return the object that computes the values that a run records of its states."""
        return AsperityObservables(self, surface)


@dataclass(frozen=True, eq=False)
class AsperityObservables:
    """Values that a run with interacting asperities records of its states; see `icha.contact.model.Observables`."""

    contact: InteractingAsperities
    surface: Surface

    def of_contact(self) -> dict:
        """Return an empty dictionary, because no value of this model is the same in all states."""
        return {}

    def of_step(self, state: ContactState) -> dict:
        """Return residual, number of barred asperities (`pending_count`), and share of spots outside Wu's range.

        Wu's formula, eq. (3), is verified for Tabor parameters >= 1. The share omits unions; 0 without adhesion.
        """
        law, spots = self.contact.law, state.spots
        verified = law.is_jump_in_verified(spots.radius_of_curvature[spots.members == 1])
        outside = np.count_nonzero(~verified) / max(len(verified), 1) if self.contact.adhesive else 0.0
        values = {"residual": state.residual, "pending_count": state.barred_count, "outside_wu_fraction": outside}
        if self.surface.free:
            square = self.surface.period, self.surface.grid
            values["edge_contact"] = edge_share(*square, spots.position, spots.contact_radius)
        return values

    def of_snapshot(self, state: ContactState) -> dict:
        """Return the distributions of gap and pressure, and for each spot the properties named `spot_…`, SI units."""
        law, spots = state.spots.law, state.spots
        return {
            **gap_distribution(law, self.surface, state),
            **pressure_distribution(law, self.surface, spots),
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
        """Return reasons why summits do not represent the surface, as sentences for the user; an empty list if they do.

        Reasons at the mean separations of the first loading (m): peaks without summits, and unsupported summits (see
        `SummitCoverage`). Reason in `pressed`: tops are not parabolic under the spots of single asperities.
        pressed : state with the largest contact area; None if there is no state.
        """
        reasons = SummitCoverage.of(self.surface, self.contact.asperities).reasons_against(separations)
        if pressed is None:
            return reasons
        spots = pressed.spots
        single = spots.members == 1
        departure = paraboloid_departure(
            self.surface, spots.position[single], spots.contact_radius[single], spots.radius_of_curvature[single]
        )
        if departure > LARGEST_DEPARTURE:
            reasons.append(
                "the tops are not parabolic over the contact spots: at the edge of contact, the depths of the surface "
                f"and of the paraboloid differ on average by a factor of {np.exp(departure):.2g}; expected at most "
                f"{np.exp(LARGEST_DEPARTURE):.2g}"
            )
        return reasons


def contact_of(surface: Surface, material: Material) -> InteractingAsperities:
    """Return the contact of a surface and a material.

    Raises `ValueError` for a layer, for a map of the work of adhesion, for a surface with a shape and for a surface
    without summits. On a shape the model is wrong: the pull-off force of a rough sphere was 0.4 times that of
    boundary elements.
    """
    if material.layered:
        raise ValueError(
            f"thickness: {material.thickness:g} m; the asperity model is only for a half-space. Use boundary elements"
        )
    if material.adhesion_map:
        raise ValueError(
            "surface_energy: the asperity model has the same work of adhesion at every place. Use boundary elements"
        )
    if surface.shape:
        raise ValueError("shape: the asperity model is only for nominally flat surfaces. Use boundary elements")
    law = DirectedJKR(material) if material.directed else JKR(material)
    return InteractingAsperities(law, find_summits(surface), surface.unit_height, surface.unit_slope)
