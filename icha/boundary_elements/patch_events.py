"""What became of the patches from one state to the next: new ones, those that are gone, joined or split."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from icha.boundary_elements.patches import centres, labelled, labels_at
from icha.boundary_elements.states import CellState
from icha.contact.model import COALESCENCE, JUMP_IN, JUMP_OFF, SPLIT, Events


def patch_events(
    before: CellState,
    after: CellState,
    energy_of_cells: Callable[[CellState], np.ndarray],
    summits: np.ndarray,
    grid: int,
    spacing: float,
) -> Events:
    """The events between two states that follow each other.

    energy_of_cells: what every cell, (k,), of a state would set free in a jump, J/m^2. summits: their cells, counted
    through. grid: cells a side. spacing: m.
    """
    (old, old_count), (new, new_count) = labelled(before.cells, grid), labelled(after.cells, grid)
    _, in_old, in_new = np.intersect1d(before.cells, after.cells, assume_unique=True, return_indices=True)
    pairs = np.unique(np.stack([old[in_old], new[in_new]]), axis=1)
    parts_of_old = np.bincount(pairs[0], minlength=old_count + 1)[1:]
    parts_of_new = np.bincount(pairs[1], minlength=new_count + 1)[1:]

    def of_old(kind, which, sign):
        return _events(kind, before, old, old_count, energy_of_cells, which, sign, summits, grid, spacing)

    def of_new(kind, which, sign):
        return _events(kind, after, new, new_count, energy_of_cells, which, sign, summits, grid, spacing)

    return Events.joined(
        [
            of_new(JUMP_IN, np.flatnonzero(parts_of_new == 0), -1.0),
            of_old(JUMP_OFF, np.flatnonzero(parts_of_old == 0), 1.0),
            of_new(COALESCENCE, np.repeat(np.arange(new_count), np.maximum(parts_of_new - 1, 0)), 0.0),
            of_old(SPLIT, np.repeat(np.arange(old_count), np.maximum(parts_of_old - 1, 0)), 0.0),
        ]
    )


def _events(kind, state, labels, count, energy_of_cells, which, sign, summits, grid, spacing):
    """Events of one kind to patches `which`, (k,), of a state; of a jump the energy of its patch is set free."""
    if not len(which):
        return Events.joined(())
    energy = np.bincount(labels, energy_of_cells(state), count + 1)[1:]
    position = centres(state.cells, grid, labels, count, state.fraction) * spacing
    return Events(
        np.full(len(which), kind, np.int8),
        position[which],
        np.bincount(labels_at(summits, state.cells, labels), minlength=count + 1)[1:][which],
        np.maximum(sign * energy[which], 0.0) * spacing**2,
    )
