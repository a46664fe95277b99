"""States of a contact of boundary elements: which cells touch, by how much and under which pressure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from icha.contact.events import Events


@dataclass(frozen=True, eq=False)
class CellState:
    """An equilibrium: k cells in contact, and none elsewhere.

    separation: mean separation u, m. Arrays of length k: cells, counted through, rising; fraction: of each that is in
    contact; pressure: mean of a cell, Pa, negative in tension; around: mean fraction around it. pressure_slope,
    area_slope: derivatives of nominal pressure (Pa/m) and area fraction (1/m) with the separation, fronts moving along;
    rates: those of fraction and pressure, (k,) each, per cell and in E* per cell. Residuals: front_residual, the
    largest deviation of sqrt(G/dgamma) from 1 where a front is free to move; gap_residual, the largest gap in contact
    or overlap outside, m. history: the events of every equilibrium of the path up to here. pending: places within reach
    of the attraction that were left open, for contact there does not hold.
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
