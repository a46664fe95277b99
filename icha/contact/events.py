"""Events on the way from one equilibrium to the next: jumps into and out of contact, unions and their undoing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Kinds of events, and their names.
JUMP_IN, JUMP_OFF, COALESCENCE, SPLIT = range(4)
EVENT_KINDS = ("jump_in", "jump_off", "coalescence", "split")


@dataclass(frozen=True, eq=False)
class Events:
    """Events between two equilibria. Arrays of length k.

    kind: JUMP_IN, JUMP_OFF (a spot, single or united, lets go), COALESCENCE (two spots unite) or SPLIT (a union is
    undone, and what it was made of stays in contact). position (k, 2), m. members: how many first contacts are united
    in the spot concerned. energy: J that a jump would set free if the spot were alone; zero for unions and splits.
    """

    kind: np.ndarray
    position: np.ndarray
    members: np.ndarray
    energy: np.ndarray

    def __len__(self) -> int:
        """Number of events."""
        return len(self.kind)

    def count(self, kind: int) -> int:
        """Number of events of a kind."""
        return int(np.count_nonzero(self.kind == kind))

    @classmethod
    def joined(cls, parts) -> Events:
        """Several, one after the other."""
        parts = [cls(np.empty(0, np.int8), np.empty((0, 2)), np.empty(0, int), np.empty(0)), *parts]
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in cls.__match_args__))
