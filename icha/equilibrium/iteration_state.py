"""State of the search for an equilibrium: the sites, the asperities, and the events so far."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from icha.contact.model import JUMP_IN, Events
from icha.equilibrium.sites import CONTACT, AsperityContact, ContactState, Sites


@dataclass(frozen=True, eq=False)
class IterationState:
    """State of the search for an equilibrium. The state is immutable: every event creates a new state.

    Attributes
    ----------
    contact : contact of the asperities.
    start : equilibrium from which the search starts.
    unloading : whether the given separation, or the first guess of it, exceeds the separation of `start`.
    sites : table of sites.
    site_of_asperity, last_approach, last_separation, barred_count : as in `ContactState`.
    released_from : (asperities,) int, site of the union that has released the asperity since the last call of
        `apply_jump_in`; -1 for other asperities.
    was_released : (asperities,) bool, whether a union has released an asperity during this search.
    barred : (asperities,) bool, whether an asperity may not make contact again because it broke contact in this search.
    receded_area : area over which edges have receded, as in `ContactState`, m^2.
    new_unions : indices of the sites of unions that have no heights yet.
    log : events of this search so far, each a row of kind, position, members, energy and asperity.
    """

    contact: AsperityContact
    start: ContactState
    unloading: bool
    sites: Sites
    site_of_asperity: np.ndarray
    last_approach: np.ndarray
    last_separation: np.ndarray
    released_from: np.ndarray
    was_released: np.ndarray
    barred: np.ndarray
    new_unions: np.ndarray
    receded_area: float
    barred_count: int = 0
    log: tuple = ()

    @classmethod
    def start_search(cls, contact: AsperityContact, state: ContactState, separation: float) -> IterationState:
        """Start a search from an equilibrium: extrapolate its approaches linearly to a mean separation, m.

        All spots in contact now count as old. The table may be compacted, which changes the indices of sites.
        """
        count, before = len(contact.asperities), state.sites
        sites = replace(
            before,
            approach=before.approach + before.response * (separation - state.separation),
            counts_as_old=before.status == CONTACT,
        )
        sites, index = sites.compact()
        return cls(
            contact=contact,
            start=state,
            unloading=separation > state.separation,
            sites=sites,
            # Asperities without a site have the index -1 and take the last value of `index`, which is -1.
            site_of_asperity=state.site_of_asperity if index is None else index[state.site_of_asperity],
            last_approach=state.last_approach,
            last_separation=state.last_separation,
            released_from=np.full(count, -1),
            was_released=np.zeros(count, dtype=bool),
            barred=np.zeros(count, dtype=bool),
            new_unions=np.empty(0, dtype=int),
            receded_area=state.receded_area,
        )

    @property
    def lacks_site(self) -> np.ndarray:
        """Mask (asperities,) of the asperities that neither belong to a spot in contact nor are candidates."""
        lacks_site = self.site_of_asperity < 0
        single = (self.sites.asperity >= 0) & self.sites.present
        lacks_site[self.sites.asperity[single]] = False
        return lacks_site

    def with_approach(self, approach) -> IterationState:
        """Return a copy of the state with other approaches (n,) of its sites, m."""
        return replace(self, sites=replace(self.sites, approach=approach))

    def with_radii(self, sites, a) -> IterationState:
        """Return a copy of the state to whose `receded_area` sites (indices or a mask) with contact radii a, m, add."""
        area = np.pi * np.maximum(self.sites.contact_radius[sites] ** 2 - a**2, 0.0)
        return replace(self, receded_area=self.receded_area + float(np.sum(area)))

    def with_events(self, kind, position, members, energy=0.0, asperity=-1) -> IterationState:
        """Return a copy of the state with k more events of one kind at the end of its log.

        position : (k, 2) float, m. The other arguments are arrays (k,), or one value for all events.
        """
        columns = (np.broadcast_to(each, len(position)) for each in (members, energy, asperity))
        rows = ((kind, *row) for row in zip(position, *columns, strict=True))
        return replace(self, log=(*self.log, *rows))

    def delete_jumps_in(self, asperity) -> IterationState:
        """Return a copy of the state whose log does not contain the jump-ins of given asperities (indices)."""
        deleted = set(asperity.tolist())
        return replace(self, log=tuple(row for row in self.log if row[0] != JUMP_IN or row[4] not in deleted))

    def events(self) -> Events:
        """Return all events of the search so far, in one `Events` object."""
        if not self.log:
            return Events.concatenate(())
        kind, position, members, energy, _ = zip(*self.log, strict=True)
        return Events(np.array(kind, np.int8), np.array(position), np.array(members, int), np.array(energy, float))
