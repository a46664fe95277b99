"""States of a contact of boundary elements: which cells touch, by how much and under which pressure."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from icha.contact.model import Events


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
    events = Events.joined(state.history[len(before.history) :])
    return arrays | {f"event_{name}": getattr(events, name) for name in Events.__match_args__}


def unpacked(arrays: dict[str, np.ndarray], before: CellState) -> CellState:
    """The state that is `packed` in arrays and followed from another one."""
    found = {each.name: arrays[each.name] for each in fields(CellState) if each.name in arrays}
    own: dict[str, Any] = {name: value if value.ndim else value.item() for name, value in found.items()}
    rates = (arrays["rates_0"], arrays["rates_1"]) if "rates_0" in arrays else None
    events = Events(*(arrays[f"event_{name}"] for name in Events.__match_args__))
    return CellState(**own, rates=rates, history=(*before.history, events) if len(events) else before.history)
