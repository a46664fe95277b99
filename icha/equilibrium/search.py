"""Where a search for equilibrium stands: the sites, what is known of the asperities, and what has happened so far."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from icha.contact.model import JUMP_IN, SPLIT, Events
from icha.equilibrium.sites import CONTACT, ContactState, Problem, Sites


@dataclass(frozen=True, eq=False)
class Search:
    """A search between two equilibria, immutable: events and Newton's steps lead from one to the next.

    start: the state it begins from. parting: whether the surfaces part.
    Arrays of the asperities' length: holder, seen, seen_at as in `ContactState`; fallen, the united spot that an
    asperity has just fallen out of, -1 for others; has_fallen, whether it has before; locked, whether it has broken
    contact here and may not make it again at this separation.
    fresh: united spots whose heights follow from the next evaluation. pending: as in `ContactState`. log: events so
    far, rows of kind, position, members, energy and asperity.
    """

    problem: Problem
    start: ContactState
    parting: bool
    sites: Sites
    holder: np.ndarray
    seen: np.ndarray
    seen_at: np.ndarray
    fallen: np.ndarray
    has_fallen: np.ndarray
    locked: np.ndarray
    fresh: np.ndarray
    pending: int = 0
    log: tuple = ()

    @classmethod
    def towards(cls, problem: Problem, state: ContactState, separation: float) -> Search:
        """From a state to another separation, m, the approaches extrapolated by their responses."""
        count, before = len(problem.asperities), state.sites
        sites = replace(
            before,
            approach=before.approach + before.response * (separation - state.separation),
            known=before.status == CONTACT,
        )
        sites, index = sites.compacted()
        return cls(
            problem=problem,
            start=state,
            parting=separation > state.separation,
            sites=sites,
            holder=state.holder if index is None else index[state.holder],  # -1 looks up the last
            seen=state.seen,
            seen_at=state.seen_at,
            fallen=np.full(count, -1),
            has_fallen=np.zeros(count, dtype=bool),
            locked=np.zeros(count, dtype=bool),
            fresh=np.empty(0, dtype=int),
        )

    @property
    def free(self) -> np.ndarray:
        """Whether an asperity is neither a site nor part of one (asperities,)."""
        free = self.holder < 0
        single = (self.sites.asperity >= 0) & self.sites.present
        free[self.sites.asperity[single]] = False
        return free

    @property
    def splits(self) -> int:
        """Unions undone so far along the path."""
        return self.start.splits + sum(row[0] == SPLIT for row in self.log)

    def at(self, approach) -> Search:
        """With approaches (n,) of the sites, m."""
        return replace(self, sites=replace(self.sites, approach=approach))

    def noting(self, kind, position, members, energy=0.0, asperity=-1) -> Search:
        """With events of one kind: positions (k, 2), and what else there is of them, each (k,) or one for all."""
        others = (np.broadcast_to(each, len(position)) for each in (members, energy, asperity))
        rows = ((kind, *row) for row in zip(position, *others, strict=True))
        return replace(self, log=(*self.log, *rows))

    @property
    def jumped_in(self) -> list[int]:
        """Asperities that have jumped into contact so far."""
        return [row[4] for row in self.log if row[0] == JUMP_IN]

    def forgetting_jumps_in(self, asperity) -> Search:
        """Without the jumps into contact of asperities."""
        taken_back = set(asperity.tolist())
        return replace(self, log=tuple(row for row in self.log if row[0] != JUMP_IN or row[4] not in taken_back))

    def events(self) -> Events:
        """The events so far."""
        if not self.log:
            return Events.joined(())
        kind, position, members, energy, _ = zip(*self.log, strict=True)
        return Events(np.array(kind, np.int8), np.array(position), np.array(members, int), np.array(energy, float))
