"""Immutable records of the asperity model: the contact, the sites where contact exists or may form, and equilibria."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from icha.asperity.jkr import JKR, MaterialUnits
from icha.contact.model import Events
from icha.half_space.ewald import PointHalfSpace
from icha.surfaces.summits import Asperities


@dataclass(frozen=True, eq=False)
class AsperityContact(MaterialUnits):
    """Asperities in contact with an elastic half-space.

    Attributes
    ----------
    law : law of one spot.
    asperities : summits of the surface.
    rms_height : rms height of the surface, the unit in which the errors of an equilibrium are given, m.
    rms_slope : rms slope of the surface.
    """

    law: JKR
    asperities: Asperities
    rms_height: float
    rms_slope: float = 1.0

    @cached_property
    def jump_in_approach(self) -> np.ndarray:
        """Approaches at which the asperities jump into contact, (asperities,), m."""
        return self.law.jump_in_approach(self.asperities.radius_of_curvature)

    @property
    def area(self) -> float:
        """Nominal area A0, m^2."""
        return self.asperities.period**2


# Status of a site: in contact, candidate for contact (only without adhesion), or removed.
CONTACT, CANDIDATE, REMOVED = 1, 2, 3
# Limits for a new half-space: number of sites, divided by `sites_at_setup`, and fraction of removed sites.
_GROWTH = 1.5
_REMOVED_FRACTION = 0.25


@dataclass(frozen=True, eq=False)
class MergeRecord:
    """The two spots of a union, with their properties just before they united.

    Attributes
    ----------
    union_radius : contact radius of the union in the first equilibrium after the spots united, m; the union splits
        below this radius. It is NaN until this equilibrium is found.
    contact_radius : (2,) float, contact radii of the two spots, m.
    columns : other properties of the two spots: for each name in `Sites.UNITED` an array of two rows.
    """

    union_radius: float
    contact_radius: np.ndarray
    columns: dict[str, np.ndarray]

    def asperities(self) -> list[list[int]]:
        """Return two lists: indices of the asperities in the first spot, and of the asperities in the second spot."""
        return [
            [index] if union is None else [each for spot in union.asperities() for each in spot]
            for index, union in zip(self.columns["asperity"].tolist(), self.columns["union"], strict=True)
        ]


@dataclass(frozen=True, eq=False)
class Sites:
    """Table of n sites (spots in contact, candidates for contact, removed sites), with a half-space for all sites.

    Attributes
    ----------
    position : (n, 2) float, positions of the asperities, or the centres of unions, m.
    height, radius_of_curvature : (n,) float, heights and radii of curvature of asperities and unions, m.
    contact_radius : (n,) float, contact radii in the last equilibrium, m, zero out of contact; for new spots, radii
        from which the edges advance or recede.
    jump_off_approach : (n,) float, lowest approaches with a stable state of contact, m; below them spots break contact.
    asperity : (n,) int, index of the asperity; -1 for a union.
    members : (n,) int, number of asperities united in the spot; asperities that the spot only covers do not count.
    union : (n,) object, `MergeRecord` of a union; None for other sites.
    split_from : (n,) object, `MergeRecord` of the union from whose split the spot is; None for other sites.
    status : (n,) int, CONTACT, CANDIDATE or REMOVED.
    approach : (n,) float, last known approach of each site, m.
    response : (n,) float, derivative of the approach with respect to the mean separation.
    counts_as_old : (n,) bool, True for spots that were in contact when the present search began, for unions, and for
        spots from a split. These spots absorb every new site under them. False for candidates, and for single
        asperities added to the table in this search.
    half_space : elastic half-space with a point at every site.
    sites_at_setup : number of sites when the half-space was set up for the last time.
    """

    position: np.ndarray
    height: np.ndarray
    radius_of_curvature: np.ndarray
    contact_radius: np.ndarray
    jump_off_approach: np.ndarray
    asperity: np.ndarray
    members: np.ndarray
    union: np.ndarray
    split_from: np.ndarray
    status: np.ndarray
    approach: np.ndarray
    response: np.ndarray
    counts_as_old: np.ndarray
    half_space: PointHalfSpace
    sites_at_setup: int

    # Columns of this table that a `MergeRecord` contains for the two spots of a union.
    UNITED = ("position", "height", "radius_of_curvature", "asperity", "members", "union")

    def __len__(self) -> int:
        """Return the number of sites."""
        return len(self.height)

    @classmethod
    def empty(cls, law: JKR, asperities: Asperities) -> Sites:
        """Return a table without sites for a surface of these asperities."""
        types = {"asperity": int, "members": int, "union": object, "split_from": object, "status": np.int8}
        types |= {"counts_as_old": bool}
        arrays: dict = {name: np.empty(0, types.get(name, float)) for name in _ARRAYS} | {"position": np.empty((0, 2))}
        modulus = law.material.contact_modulus
        half_space = PointHalfSpace.at(arrays["position"], asperities.period, modulus, asperities.free)
        return cls(**arrays, half_space=half_space, sites_at_setup=0)

    @property
    def present(self) -> np.ndarray:
        """Mask of the sites that are in contact or candidates for contact, (n,) bool."""
        return self.status != REMOVED

    def append(self, law: JKR, *, status, counts_as_old, split_from=None, **more) -> Sites:
        """Return a table with k more sites; the response of each is -1 at first.

        status, counts_as_old, split_from : one value for all new sites.
        more : position, height, radius_of_curvature, contact_radius, asperity, members, union and approach, arrays of
            k rows; contact_radius is at least that of an advancing edge at jump-off.
        """
        count = len(more["height"])
        more |= {
            "jump_off_approach": law.lowest_approach(more["radius_of_curvature"], more["contact_radius"]),
            "split_from": np.full(count, split_from),
            "status": np.full(count, status, dtype=np.int8),
            "response": np.full(count, -1.0),
            "counts_as_old": np.full(count, counts_as_old),
        }
        arrays = {name: np.concatenate([getattr(self, name), more[name]]) for name in _ARRAYS}
        if not len(self):
            return self._set_up(arrays)
        half_space = self.half_space.extended(more["position"])
        return Sites(**arrays, half_space=half_space, sites_at_setup=self.sites_at_setup)

    def remove(self, which) -> Sites:
        """Return a table of the same length in which the sites `which`, a mask (n,) or indices, are REMOVED."""
        status = self.status.copy()
        status[which] = REMOVED
        return replace(self, status=status)

    def compact(self) -> tuple[Sites, np.ndarray | None]:
        """Delete removed sites and set up the half-space again, if over a quarter are removed or over a third are new.

        Sites are new if they were added after the last set-up. Return the table, and the new index of every site,
        (n + 1,) int: -1 for removed sites, and -1 as last value. If neither is true, return this table and None.
        """
        removed = self.status == REMOVED
        if len(self) <= _GROWTH * self.sites_at_setup and np.count_nonzero(removed) <= _REMOVED_FRACTION * len(self):
            return self, None
        present = np.flatnonzero(~removed)
        index = np.full(len(self) + 1, -1)
        index[present] = np.arange(len(present))
        return self._set_up({name: getattr(self, name)[present] for name in _ARRAYS}), index

    def _set_up(self, arrays):
        """Return a table of these columns with a new half-space, whose near field suits the number of sites."""
        ewald = self.half_space.ewald
        half_space = PointHalfSpace.at(arrays["position"], ewald.side, ewald.contact_modulus, ewald.free)
        return Sites(**arrays, half_space=half_space, sites_at_setup=len(arrays["height"]))


_ARRAYS = tuple(name for name in Sites.__match_args__ if name not in ("half_space", "sites_at_setup"))


@dataclass(frozen=True, eq=False)
class Spots:
    """Columns of the table of sites for the m spots in contact, each a single asperity or a union.

    Attributes
    ----------
    position : (m, 2) float, centres of the spots, m.
    height, radius_of_curvature, contact_radius, approach : (m,) float, one value for each spot, m.
    members : (m,) int, number of asperities in each spot.
    law : law of the spots in their states.
    """

    position: np.ndarray
    height: np.ndarray
    radius_of_curvature: np.ndarray
    contact_radius: np.ndarray
    approach: np.ndarray
    members: np.ndarray
    law: JKR

    def __len__(self) -> int:
        """Return the number of spots."""
        return len(self.height)


@dataclass(frozen=True, eq=False)
class ContactState:
    """Equilibrium of all contact spots.

    Attributes
    ----------
    separation : mean separation u, m.
    sites : table of n sites.
    law : law of the sites in their states.
    site_of_asperity : (asperities,) int, site in contact to which an asperity belongs: its own spot, a union that
        contains it, or a spot that covered it when it made contact; -1 for asperities out of contact and candidates.
    last_approach : (asperities,) float, last computed approach of each asperity out of contact, m.
    last_separation : (asperities,) float, mean separation for `last_approach`, m; inf if the approach is not known.
    residual : largest error of the equations of equilibrium, in h_rms.
    barred_count : number of asperities above jump-in that are barred because they broke contact in the last search.
    receded_area : area over which the edges of all spots have receded on the path up to this state, m^2.
    history : events of the path up to this state, one `Events` for each equilibrium with events.
    """

    separation: float
    sites: Sites
    law: JKR
    site_of_asperity: np.ndarray
    last_approach: np.ndarray
    last_separation: np.ndarray
    residual: float = 0.0
    barred_count: int = 0
    receded_area: float = 0.0
    history: tuple[Events, ...] = ()

    @cached_property
    def contact_index(self) -> np.ndarray:
        """Indices of the sites in contact."""
        return np.flatnonzero(self.sites.status == CONTACT)

    @cached_property
    def spots(self) -> Spots:
        """Properties of the sites in contact."""
        names = ("position", "height", "radius_of_curvature", "contact_radius", "approach", "members")
        columns = {name: getattr(self.sites, name)[self.contact_index] for name in names}
        return Spots(law=self.law.select(self.contact_index), **columns)
