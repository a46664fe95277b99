"""Equilibrium states of the boundary elements, their contact patches, and the events between two states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from scipy.ndimage import label

from icha.boundary_elements.cells import adjacent, field_of, find_among
from icha.contact.model import COALESCENCE, JUMP_IN, JUMP_OFF, SPLIT, Events


@dataclass(frozen=True, eq=False)
class CellState:
    """Contact in equilibrium at one mean separation, as a list of grid cells.

    Parameters
    ----------
    separation : mean separation u, m.
    cells : (k,) int, flat indices of the grid cells in contact, ascending.
    fraction : (k,), fraction of contact f of each cell, 0 < f <= 1: tension over strength at the front.
    pressure : (k,), force on each cell divided by the area of the whole cell, Pa; negative in tension.
    mean_fraction : (k,), Gaussian average of the fractions of each cell and its neighbours; used at a short range.
    pressure_slope, area_slope : slopes dp/du of nominal pressure (Pa/m) and of area fraction (1/m), with moving fronts.
    rates : changes of the pressures in E*, (k,), when the separation increases by one cell size; None if unknown.
    residual : largest residual pressure, relative to the peak tension of the bonds or, without attraction, to the
        largest pressure.
    gap_residual : largest displacement by the residual pressures, m.
    pending : number of cells within reach (of summits, or overlapping) that stay open, because contact is not stable.
    front_dissipation : energy that receding fronts have dissipated so far, J/m^2 of nominal area.
    history : events of the path up to this state, one `Events` for each equilibrium with events.
    """

    separation: float
    cells: np.ndarray
    fraction: np.ndarray
    pressure: np.ndarray
    mean_fraction: np.ndarray
    pressure_slope: float = 0.0
    area_slope: float = 0.0
    rates: np.ndarray | None = None
    residual: float = 0.0
    gap_residual: float = 0.0
    pending: int = 0
    front_dissipation: float = 0.0
    history: tuple[Events, ...] = ()


def pack(state: CellState, before: CellState) -> dict[str, np.ndarray]:
    """Convert a state to named arrays for a checkpoint, with only those events that follow the state `before`."""
    arrays = {each.name: getattr(state, each.name) for each in fields(state) if each.name not in ("rates", "history")}
    if state.rates is not None:
        arrays["rates"] = state.rates
    events = Events.concatenate(state.history[len(before.history) :])
    return arrays | {f"event_{name}": getattr(events, name) for name in Events.__match_args__}


def unpack(arrays: dict[str, np.ndarray], before: CellState) -> CellState:
    """Restore a state from the arrays of `pack`; `before` is the state before it on the path."""
    found = {each.name: arrays[each.name] for each in fields(CellState) if each.name in arrays}
    values: dict[str, Any] = {name: value if value.ndim else value.item() for name, value in found.items()}
    events = Events(*(arrays[f"event_{name}"] for name in Events.__match_args__))
    return CellState(**values, history=(*before.history, events) if len(events) else before.history)


# Overestimate of a counted area per free edge, divided by the area of a cell (Yastrebov, Anciaux & Molinari, Tribol.
# Int. 114 (2017) 161, eq. 9).
BEYOND_EDGES = (np.pi - 1 + np.log(2)) / 24


def label_patches(cells: np.ndarray, grid: int) -> tuple[np.ndarray, int]:
    """Find the contact patches; return the patch number of each cell, (k,), from 1, and the number of patches.

    Cells that share an edge belong to the same patch, also across the periodic boundary.
    """
    labels, count = label(field_of(cells, True, (grid, grid)))
    pairs = [
        np.stack([one, other], axis=1)[(one > 0) & (other > 0)]
        for one, other in ((labels[0], labels[-1]), (labels[:, 0], labels[:, -1]))
    ]
    root = list(range(count + 1))

    def find_root(number):
        while root[number] != number:
            number = root[number]
        return number

    for one, other in np.unique(np.concatenate(pairs), axis=0).tolist():
        one, other = sorted((find_root(one), find_root(other)))
        root[other] = one
    # Numbered in the order of their first cells; 0 is outside.
    roots, numbers = np.unique([find_root(number) for number in root], return_inverse=True)
    return numbers[labels.ravel()[cells]], len(roots) - 1


def labels_at(sought: np.ndarray, cells: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Return the patch number at each of the cells `sought`, (m,); 0 where there is no contact."""
    result = np.zeros(len(sought), dtype=int)
    present, index = find_among(sought, cells)
    result[present] = labels[index]
    return result


def free_edges(cells: np.ndarray, grid: int) -> np.ndarray:
    """Count for each cell in contact, (k,), its edges (0 to 4) without a neighbour in contact."""
    touching = field_of(cells, True, (grid, grid)).ravel()
    return 4.0 - np.count_nonzero(touching[adjacent(cells, grid)], axis=0)


# Steps (down, right) to other cells in half of the 16 directions; the other half has the opposite signs.
_STEPS = ((0, 1), (1, 2), (1, 1), (2, 1), (1, 0), (2, -1), (1, -1), (1, -2))


def edge_lengths(cells: np.ndarray, areas: np.ndarray, grid: int, labels: np.ndarray, count: int) -> np.ndarray:
    """Return the length of the edge of each patch, (count,), in cell sizes, by Crofton's formula.

    Along a line, the contact areas of its cells, (k,), divided by the cell area, change by one at each edge. The number
    of these changes times the distance of parallel lines has the mean 2/pi of the length over all directions. Here 16
    directions stand for all, so lengths of straight edges are right within 2 %.
    """
    angles = np.array([np.arctan2(down, right) for down, right in _STEPS])
    shares = np.diff(0.5 * (angles + np.append(angles[1:], np.pi)), prepend=0.5 * (angles[-1] - np.pi)) / np.pi
    lengths = np.zeros(count)
    for (down, right), share in zip(_STEPS, shares, strict=True):
        for sign in (1, -1):
            row, column = (cells // grid + sign * down) % grid, (cells % grid + sign * right) % grid
            present, index = find_among(row * grid + column, cells)
            change = areas.copy()
            same = labels[present] == labels[index]
            at = np.flatnonzero(present)[same]
            # The cells of a patch meet twice.
            change[at] = 0.5 * np.abs(areas[at] - areas[index[same]])
            lengths += share / np.hypot(down, right) * np.bincount(labels, change, count + 1)[1:]
    return np.pi / 2 * lengths


def patch_centres(cells: np.ndarray, grid: int, labels: np.ndarray, count: int, weight: np.ndarray) -> np.ndarray:
    """Return the centre (x, y) of each patch, (count, 2), in cell sizes: the weighted circular mean of its cells."""
    turn = np.exp(2j * np.pi * np.arange(grid) / grid)
    result = np.empty((count, 2))
    for axis, at in enumerate((cells % grid, cells // grid)):
        phase = turn[at]
        real, imag = (np.bincount(labels, weight * each, count + 1) for each in (phase.real, phase.imag))
        result[:, axis] = np.angle((real + 1j * imag)[1:]) * grid / (2 * np.pi) % grid
    return result


def patch_events(
    before: CellState,
    after: CellState,
    energy_of_cells: Callable[[CellState, np.ndarray], np.ndarray],
    summits: np.ndarray,
    grid: int,
    spacing: float,
) -> Events:
    """Find jumps, coalescences and splits between two states; a patch continues in every patch that shares a cell.

    Parameters
    ----------
    energy_of_cells : function that returns the energy, J/m^2, of chosen cells of a state, (k,) bool, as if no other
        cells were in contact. A patch that jumps off releases its energy; one that jumps in, the negative of it.
    summits : (m,) int, cells of the summits.
    grid, spacing : number of cells along a side, and size of a cell in m.
    """
    (old, old_count), (new, new_count) = label_patches(before.cells, grid), label_patches(after.cells, grid)
    _, in_old, in_new = np.intersect1d(before.cells, after.cells, assume_unique=True, return_indices=True)
    pairs = np.unique(np.stack([old[in_old], new[in_new]]), axis=1)
    parts_of_old = np.bincount(pairs[0], minlength=old_count + 1)[1:]
    parts_of_new = np.bincount(pairs[1], minlength=new_count + 1)[1:]

    of_old = before, old, old_count, energy_of_cells, summits, grid, spacing
    of_new = after, new, new_count, energy_of_cells, summits, grid, spacing
    # A coalescence of m patches, or a split into m patches, is recorded as m - 1 events.
    joined = np.repeat(np.arange(new_count), np.maximum(parts_of_new - 1, 0))
    split = np.repeat(np.arange(old_count), np.maximum(parts_of_old - 1, 0))
    jumps_in = _events_of_patches(JUMP_IN, np.flatnonzero(parts_of_new == 0), -1.0, *of_new)
    jumps_off = _events_of_patches(JUMP_OFF, np.flatnonzero(parts_of_old == 0), 1.0, *of_old)
    coalescences = _events_of_patches(COALESCENCE, joined, 0.0, *of_new)
    return Events.concatenate([jumps_in, jumps_off, coalescences, _events_of_patches(SPLIT, split, 0.0, *of_old)])


def _events_of_patches(kind, which, sign, state, labels, count, energy_of_cells, summits, grid, spacing):
    """Return an event that releases sign * energy, at least 0, for each patch in `which`, (e,), counted from 0."""
    if not len(which):
        return Events.concatenate(())
    energy = np.zeros(count)
    if sign:
        chosen = np.isin(labels, which + 1)
        energy = np.bincount(labels[chosen], energy_of_cells(state, chosen), count + 1)[1:]
    position = patch_centres(state.cells, grid, labels, count, state.fraction) * spacing
    return Events(
        np.full(len(which), kind, np.int8),
        position[which],
        np.bincount(labels_at(summits, state.cells, labels), minlength=count + 1)[1:][which],
        np.maximum(sign * energy[which], 0.0) * spacing**2,
    )
