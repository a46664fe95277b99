"""The problem, the sites where contact is or may form in the iteration, and states of the contact; all immutable."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from icha.asperity.law import SpotLaw
from icha.contact.model import Events
from icha.half_space.ewald import HalfSpace
from icha.surfaces.summits import Asperities


@dataclass(frozen=True, eq=False)
class Problem:
    """Asperities in contact with a half-space.

    law: of one spot. rms_height: the length that makes errors of an equilibrium dimensionless, m. rms_slope: of the
    surface. jump_in:
    the asperities' jump-in approaches (n,), m.
    """

    law: SpotLaw
    asperities: Asperities
    rms_height: float
    rms_slope: float = 1.0
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

    @property
    def pressure_unit(self) -> float:
        """E* h'_rms, Pa."""
        return self.contact_modulus * self.rms_slope


# Status of a site: in contact; without adhesion, one that may come into contact; one that is no more.
CONTACT, TRIAL, GONE = 1, 2, 3
# Sites are arranged anew when they have grown by this factor, or so large a part of them is gone.
_GROWTH = 1.5
_GONE_PART = 0.25


@dataclass(frozen=True, eq=False)
class Union:
    """Two spots that have become one: what they were, the contact radius of the united one, and that at which they
    just touch, m.

    position (2, 2), height, radius of curvature and contact radius, asperity, members (2,); parts: those of spots that
    are unions themselves.
    """

    united_radius: float
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
    """Table of sites, arrays of length n, and the half-space with a point at every one.

    position (n, 2), height, radius_of_curvature, jump_off (approach): m. asperity: its index, -1 for united spots.
    members: asperities united in it. parts: the Union that it is, None for others.
    parted: number of the union out of which a spot has come, -1 for others. status: CONTACT, TRIAL or GONE. approach:
    the last one known, m. response: d(delta)/du. known: whether it was in contact before the search. arranged: number
    of sites when the half-space was made.
    """

    position: np.ndarray
    height: np.ndarray
    radius_of_curvature: np.ndarray
    jump_off: np.ndarray
    asperity: np.ndarray
    members: np.ndarray
    parts: np.ndarray
    parted: np.ndarray
    status: np.ndarray
    approach: np.ndarray
    response: np.ndarray
    known: np.ndarray
    half_space: HalfSpace
    arranged: int

    _ARRAYS = (
        *("position", "height", "radius_of_curvature", "jump_off", "asperity", "members", "parts", "parted"),
        *("status", "approach", "response", "known"),
    )

    def __len__(self) -> int:
        """Number of sites."""
        return len(self.height)

    @classmethod
    def none(cls, law: SpotLaw, asperities: Asperities) -> Sites:
        """No sites yet."""
        empty, index = np.empty(0), np.empty(0, dtype=int)
        return cls(
            position=np.empty((0, 2)),
            height=empty,
            radius_of_curvature=empty,
            jump_off=empty,
            asperity=index,
            members=index,
            parts=np.empty(0, dtype=object),
            parted=index,
            status=np.empty(0, dtype=np.int8),
            approach=empty,
            response=empty,
            known=np.empty(0, dtype=bool),
            half_space=HalfSpace.at(np.empty((0, 2)), asperities.period, law.material.contact_modulus, asperities.free),
            arranged=0,
        )

    @property
    def present(self) -> np.ndarray:
        """Whether each site is in contact or may be (n,)."""
        return self.status != GONE

    def extended(self, law: SpotLaw, *, status, known, parted=-1, **more) -> Sites:
        """With k more sites after the present ones: status, known and parted one for all, the other arrays (k, ...)."""
        count = len(more["height"])
        more |= {
            "jump_off": law.jump_off_approach(more["radius_of_curvature"]),
            "parted": np.full(count, parted),
            "status": np.full(count, status, dtype=np.int8),
            "response": np.full(count, -1.0),
            "known": np.full(count, known),
        }
        arrays = {name: np.concatenate([getattr(self, name), more[name]]) for name in self._ARRAYS}
        if not len(self):
            return self._arranged(arrays)
        return Sites(**arrays, half_space=self.half_space.extended(more["position"]), arranged=self.arranged)

    def removed(self, which) -> Sites:
        """With sites, given by a mask or indices, gone."""
        status = self.status.copy()
        status[which] = GONE
        return replace(self, status=status)

    def compacted(self) -> tuple[Sites, np.ndarray | None]:
        """Without those that are gone, where they are many, the near field chosen for the number of the others.

        And the new index of every site (n + 1,), -1 for those that are gone and in the last place; None where nothing
        has changed.
        """
        gone = self.status == GONE
        if len(gone) <= _GROWTH * self.arranged and np.count_nonzero(gone) <= _GONE_PART * len(gone):
            return self, None
        stay = np.flatnonzero(~gone)
        index = np.full(len(gone) + 1, -1)
        index[stay] = np.arange(len(stay))
        return self._arranged({name: getattr(self, name)[stay] for name in self._ARRAYS}), index

    def _arranged(self, arrays):
        ewald = self.half_space.ewald
        half_space = HalfSpace.at(arrays["position"], ewald.side, ewald.contact_modulus, ewald.free)
        return Sites(**arrays, half_space=half_space, arranged=len(arrays["height"]))


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
class ContactState:
    """An equilibrium.

    separation: mean separation u, m. sites: n of them, and their contact_radius (n,), m, zero where there is no
    contact. Arrays of the asperities' length: holder, the site that an asperity is, or is part of, or was found under,
    -1 where free; seen, its approach (m) when it was last looked at, at the separation seen_at (m).
    Event counts accumulate along the path; history: the events of every equilibrium of the path up to here.
    pending: free asperities beyond their jump-in approach that were left free because they had broken contact at
    the same separation before.
    """

    separation: float
    sites: Sites
    contact_radius: np.ndarray
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
        return np.flatnonzero(self.sites.status == CONTACT)

    @cached_property
    def spots(self) -> Spots:
        """The sites in contact."""
        sites, c = self.sites, self.in_contact
        return Spots(
            position=sites.position[c],
            height=sites.height[c],
            radius_of_curvature=sites.radius_of_curvature[c],
            contact_radius=self.contact_radius[c],
            approach=sites.approach[c],
            members=sites.members[c],
        )

    @property
    def responses(self) -> np.ndarray:
        """d(delta)/du of the spots."""
        return self.sites.response[self.in_contact]

    @cached_property
    def owner(self) -> np.ndarray:
        """For every asperity the index of the spot that it is, or is part of, or lies under; -1 where free."""
        spot = np.full(len(self.sites) + 1, -1)
        spot[self.in_contact] = np.arange(len(self.in_contact))
        return spot[self.holder]  # a holder -1 looks up the last


def untouched(problem: Problem) -> ContactState:
    """The state at which the first asperity is about to make contact."""
    asperities = problem.asperities
    separation = float(np.max(asperities.height - problem.jump_in))
    return ContactState(
        separation=separation,
        sites=Sites.none(problem.law, asperities),
        contact_radius=np.empty(0),
        holder=np.full(len(asperities), -1),
        seen=asperities.height - separation,
        seen_at=np.full(len(asperities), separation),
    )
