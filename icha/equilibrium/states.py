"""States of the contact: tables of sites where contact is or may be, the spots among them, and what led there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from icha.contact.events import Events
from icha.equilibrium.problem import Problem
from icha.half_space.ewald import HalfSpace

# Status of a site: in contact; without adhesion, one that may come into contact; one that is no more.
CONTACT, TRIAL, GONE = 1, 2, 3


@dataclass(frozen=True, eq=False)
class Spots:
    """Contact spots: asperities in contact, single or coalesced. Arrays of length m.

    position (m, 2), height, radius_of_curvature, contact_radius, approach: m. members: asperities merged into it.
    """

    position: np.ndarray
    height: np.ndarray
    radius_of_curvature: np.ndarray
    contact_radius: np.ndarray
    approach: np.ndarray
    members: np.ndarray

    def __len__(self) -> int:
        """Number of spots."""
        return len(self.height)


@dataclass(frozen=True, eq=False)
class Union:
    """Two spots that have become one: what they were, and the radius (m) of the united one at which they just touch.

    position (2, 2), height, radius of curvature and contact radius, asperity, members (2,); parts: those of spots that
    are unions themselves.
    """

    touching: float
    position: np.ndarray
    height: np.ndarray
    radius_of_curvature: np.ndarray
    contact_radius: np.ndarray
    asperity: np.ndarray
    members: np.ndarray
    parts: np.ndarray

    def asperities(self) -> list[list[int]]:
        """The asperities of either of the two."""
        return [
            [own] if part is None else [each for one in part.asperities() for each in one]
            for own, part in zip(self.asperity.tolist(), self.parts, strict=True)
        ]


@dataclass(frozen=True, eq=False)
class Sites:
    """Places where contact is or may come out of the iteration. Arrays of length n.

    position (n, 2), height, radius_of_curvature, jump_off: m. asperity: its index, -1 for united spots.
    members: asperities united in it. parts: the Union that it is, None for others and where that is not kept.
    parted: number of the union out of which a spot has come, -1 for others. arranged: number of sites when the
    half-space was made.
    """

    position: np.ndarray
    height: np.ndarray
    radius_of_curvature: np.ndarray
    jump_off: np.ndarray
    asperity: np.ndarray
    members: np.ndarray
    parts: np.ndarray
    parted: np.ndarray
    half_space: HalfSpace
    arranged: int

    _ARRAYS = ("position", "height", "radius_of_curvature", "jump_off", "asperity", "members", "parts", "parted")

    def __len__(self) -> int:
        """Number of sites."""
        return len(self.height)

    def extended(self, **more) -> Sites:
        """With more sites after the present ones."""
        arrays = {name: np.concatenate([getattr(self, name), more[name]]) for name in self._ARRAYS}
        if not len(self):
            return self._arranged(arrays)
        return Sites(**arrays, half_space=self.half_space.extended(more["position"]), arranged=self.arranged)

    def taken(self, index) -> Sites:
        """The sites at `index`, arranged anew."""
        return self._arranged({name: getattr(self, name)[index] for name in self._ARRAYS})

    def _arranged(self, arrays):
        ewald = self.half_space.ewald
        half_space = HalfSpace.at(arrays["position"], ewald.side, ewald.contact_modulus, ewald.free)
        return Sites(**arrays, half_space=half_space, arranged=len(arrays["height"]))


@dataclass(frozen=True, eq=False)
class ContactState:
    """An equilibrium.

    separation: mean separation u in m. sites, with arrays of their length n: approach (m), contact_radius (m, zero
    where there is no contact), status and response d(delta)/du. Arrays of the asperities' length: holder, the
    site that an asperity is, or is part of, or was found under, -1 where free; seen, its approach (m) when it was last
    looked at, at the separation seen_at (m).
    Event counts accumulate along the path; history: the events of every equilibrium of the path up to here.
    pending: free asperities beyond their jump-in approach that were left free because they had broken contact at
    the same separation before.
    """

    separation: float
    sites: Sites
    approach: np.ndarray
    contact_radius: np.ndarray
    status: np.ndarray
    response: np.ndarray
    holder: np.ndarray
    seen: np.ndarray
    seen_at: np.ndarray
    residual: float = 0.0
    jump_ins: int = 0
    jump_offs: int = 0
    coalescences: int = 0
    splits: int = 0
    pending: int = 0
    history: tuple[Events, ...] = ()

    @cached_property
    def in_contact(self) -> np.ndarray:
        """The sites in contact, indices."""
        return np.flatnonzero(self.status == CONTACT)

    @cached_property
    def spots(self) -> Spots:
        """The sites in contact."""
        sites, c = self.sites, self.in_contact
        return Spots(
            sites.position[c],
            sites.height[c],
            sites.radius_of_curvature[c],
            self.contact_radius[c],
            self.approach[c],
            sites.members[c],
        )

    @property
    def responses(self) -> np.ndarray:
        """d(delta)/du of the spots."""
        return self.response[self.in_contact]

    @cached_property
    def owner(self) -> np.ndarray:
        """For every asperity the index of the spot that it is, or is part of, or lies under; -1 where free."""
        spot = np.full(len(self.sites) + 1, -1)
        spot[self.in_contact] = np.arange(len(self.in_contact))
        return spot[self.holder]  # a holder -1 looks up the last


def untouched(problem: Problem) -> ContactState:
    """The state at which the first asperity is about to make problem."""
    asperities, none = problem.asperities, np.empty(0)
    separation = float(np.max(asperities.height - problem.jump_in))
    nowhere, nobody = np.empty((0, 2)), np.empty(0, dtype=int)
    half_space = HalfSpace.at(nowhere, asperities.period, problem.contact_modulus, asperities.free)
    return ContactState(
        separation=separation,
        sites=Sites(nowhere, none, none, none, nobody, nobody, np.empty(0, dtype=object), nobody, half_space, 0),
        approach=none,
        contact_radius=none,
        status=np.empty(0, dtype=np.int8),
        response=none,
        holder=np.full(len(asperities), -1),
        seen=asperities.height - separation,
        seen_at=np.full(len(asperities), separation),
    )
