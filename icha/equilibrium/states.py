"""States of the contact: equilibria, the spots in contact, and the events that led there."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from icha.contact.model import Events
from icha.equilibrium.problem import Problem
from icha.equilibrium.sites import CONTACT, Sites


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
