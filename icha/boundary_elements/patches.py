"""Cells in contact: regions around them, the patches that they make up, and states of the contact with their events."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from scipy.ndimage import label, maximum_filter
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from icha.contact.model import COALESCENCE, JUMP_IN, JUMP_OFF, SPLIT, Events

# Cells a side of the blocks of which what lies around others is made.
BLOCK = 4
# So many to a cell of contact, and a list of these is quicker than a field.
_MANY = 200


def region(cells: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """The cells, counted through, as a field of bool."""
    inside = np.zeros(shape, dtype=bool)
    inside.ravel()[cells] = True
    return inside


def widened(inside: np.ndarray) -> np.ndarray:
    """The cells of a region and those that share an edge with one of them."""
    wide = inside.copy()
    for one, other in ((slice(1, None), slice(-1)), (slice(1), slice(-1, None))):
        wide[..., one, :] |= inside[..., other, :]
        wide[..., other, :] |= inside[..., one, :]
        wide[..., one] |= inside[..., other]
        wide[..., other] |= inside[..., one]
    return wide


def beside(cells: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """The cells that share an edge with one of those given, and are none of them: rising, (m,)."""
    if _MANY * len(cells) < math.prod(shape):
        near = np.unique(adjacent(cells, shape[-1]))
        return near[~among(near, cells)[0]]
    wide = widened(region(cells, shape))
    wide.ravel()[cells] = False
    return np.flatnonzero(wide)


def blocks_around(grid: int, reach: int, *given: np.ndarray) -> np.ndarray:
    """Which blocks of a grid have cells that are no farther from one of those given, (m,), or some more: 0 or 1."""
    rough = np.zeros(2 * [-(-grid // BLOCK)], np.uint8)
    for cells in given:
        row, column = np.divmod(cells, grid)
        rough[row // BLOCK, column // BLOCK] = 1
    return maximum_filter(rough, 2 * -(-reach // BLOCK) + 1, mode="wrap")


def surroundings(grid: int, *given: np.ndarray) -> np.ndarray:
    """Cells of a grid, in some lists (k,), and those up to five cells away or some more: rising, (m,)."""
    row, column = np.nonzero(blocks_around(grid, 5, *given))
    way = np.arange(BLOCK)
    rows, columns = BLOCK * row[:, None, None] + way[:, None], BLOCK * column[:, None, None] + way
    return np.sort((rows * grid + columns)[(rows < grid) & (columns < grid)])


def adjacent(cells: np.ndarray, grid: int) -> np.ndarray:
    """The four cells that share an edge with each, (4, k)."""
    within = cells % grid**2
    first, (row, column) = cells - within, np.divmod(within, grid)
    above, below, left, right = (row - 1) % grid, (row + 1) % grid, (column - 1) % grid, (column + 1) % grid
    around = [above * grid + column, below * grid + column, row * grid + left, row * grid + right]
    return first + np.stack(around)


def merged(
    one: np.ndarray, other: np.ndarray, *values: tuple[np.ndarray, np.ndarray | float]
) -> tuple[np.ndarray, ...]:
    """Two lists of cells without a common one as one that rises, and values on them in its order.

    values: pairs, on the cells of one, (k,), and on those of the other, (m,) or the same on all.
    """
    cells = np.concatenate([one, other])
    order = np.argsort(cells, kind="stable")
    return cells[order], *(
        np.concatenate([first, np.broadcast_to(second, len(other))])[order] for first, second in values
    )


def among(places: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which places, cells of any kind (m,), are among rising cells (k,), and where in their list these stand."""
    at = np.searchsorted(cells, places)
    # Beyond the last there is no cell.
    there = np.append(cells, -1)[at] == places
    return there, at[there]


@dataclass(frozen=True, eq=False)
class CellState:
    """An equilibrium: k cells in contact, and none elsewhere.

    separation: mean separation u, m. Arrays of length k: cells, counted through, rising; fraction: of each that is in
    contact; pressure: mean of a cell, Pa, negative in tension; around: mean fraction around it. pressure_slope,
    area_slope: derivatives of nominal pressure (Pa/m) and area fraction (1/m) with the separation, fronts moving along;
    rates: those of fraction and pressure, (k,) each, per cell and in E* per cell. Residuals: front_residual, the
    largest deviation of sqrt(G/dgamma) from 1 where a front is free to move; gap_residual, the largest gap in contact
    or overlap outside, m. history: the events of the path up to here, for each
    equilibrium that has any. pending: places within reach of the attraction that were left open, for contact there does
    not hold.
    """

    separation: float
    cells: np.ndarray
    fraction: np.ndarray
    pressure: np.ndarray
    around: np.ndarray
    pressure_slope: float = 0.0
    area_slope: float = 0.0
    rates: tuple[np.ndarray, np.ndarray] | None = None
    front_residual: float = 0.0
    gap_residual: float = 0.0
    pending: int = 0
    history: tuple[Events, ...] = ()


def packed(state: CellState, before: CellState) -> dict[str, np.ndarray]:
    """The arrays that a state is made of, with the events since the one before."""
    arrays = {each.name: getattr(state, each.name) for each in fields(state) if each.name not in ("rates", "history")}
    arrays |= {f"rates_{k}": rate for k, rate in enumerate(state.rates or ())}
    events = Events.concatenate(state.history[len(before.history) :])
    return arrays | {f"event_{name}": getattr(events, name) for name in Events.__match_args__}


def unpacked(arrays: dict[str, np.ndarray], before: CellState) -> CellState:
    """The state that is `packed` in arrays and followed from another one."""
    found = {each.name: arrays[each.name] for each in fields(CellState) if each.name in arrays}
    own: dict[str, Any] = {name: value if value.ndim else value.item() for name, value in found.items()}
    rates = (arrays["rates_0"], arrays["rates_1"]) if "rates_0" in arrays else None
    events = Events(*(arrays[f"event_{name}"] for name in Events.__match_args__))
    return CellState(**own, rates=rates, history=(*before.history, events) if len(events) else before.history)


# Nodes along an edge overestimate an area by so much of the edges of cells (Yastrebov, Anciaux & Molinari, Tribol. Int.
# 114 (2017) 161, eq. 9).
BEYOND_EDGES = (np.pi - 1 + np.log(2)) / 24


def labelled(cells: np.ndarray, grid: int) -> tuple[np.ndarray, int]:
    """Number of the patch of every cell in contact, (k,), from 1 on, and how many there are.

    cells: counted through, rising. Cells that share an edge belong together, over the edges of the period too.
    """
    labels, count = label(region(cells, (grid, grid)))
    pairs = [
        np.stack([one, other], axis=1)[(one > 0) & (other > 0)]
        for one, other in ((labels[0], labels[-1]), (labels[:, 0], labels[:, -1]))
    ]
    rows, columns = np.concatenate(pairs).T
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(count + 1, count + 1))
    _, component = connected_components(graph, directed=False)
    # Numbered in the order of their first cells; 0 is outside.
    return component[labels.ravel()[cells]], int(component.max())


def labels_at(places: np.ndarray, cells: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Number of the patch at some places, cells (m,) of any kind; 0 where there is none."""
    result = np.zeros(len(places), dtype=int)
    there, at = among(places, cells)
    result[there] = labels[at]
    return result


def edges(cells: np.ndarray, grid: int) -> np.ndarray:
    """Edges of every cell in contact, (k,), beyond which there is none."""
    touching = region(cells, (grid, grid)).ravel()
    return 4.0 - np.count_nonzero(touching[adjacent(cells, grid)], axis=0)


def centres(cells: np.ndarray, grid: int, labels: np.ndarray, count: int, weight: np.ndarray) -> np.ndarray:
    """Centres (count, 2) of the patches, (x, y) in cells, of a weight (k,); across the edges of the period too."""
    turn = np.exp(2j * np.pi * np.arange(grid) / grid)
    result = np.empty((count, 2))
    for axis, at in enumerate((cells % grid, cells // grid)):
        phase = turn[at]
        mean = np.bincount(labels, weight * phase.real, count + 1) + 1j * np.bincount(
            labels, weight * phase.imag, count + 1
        )
        result[:, axis] = np.angle(mean[1:]) * grid / (2 * np.pi) % grid
    return result


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

    return Events.concatenate(
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
        return Events.concatenate(())
    energy = np.bincount(labels, energy_of_cells(state), count + 1)[1:]
    position = centres(state.cells, grid, labels, count, state.fraction) * spacing
    return Events(
        np.full(len(which), kind, np.int8),
        position[which],
        np.bincount(labels_at(summits, state.cells, labels), minlength=count + 1)[1:][which],
        np.maximum(sign * energy[which], 0.0) * spacing**2,
    )
