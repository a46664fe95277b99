"""States of a contact of boundary elements: which part of every cell touches, under which pressure, and the gap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from icha.contact.events import Events


@dataclass(frozen=True, eq=False)
class CellState:
    """An equilibrium. Arrays are (n, n).

    separation: mean separation u, m. fraction: of every cell that is in contact. pressure: mean of every cell, Pa,
    negative in tension. gap: at the nodes, m. pressure_slope, area_slope: derivatives of nominal pressure (Pa/m)
    and area fraction (1/m) with the separation, fronts moving along; rates: those of fraction and pressure, per
    cell and in E* per cell. Residuals: front_residual, the largest deviation of sqrt(G/dgamma) from 1 where a front
    is free to move; gap_residual, the largest gap in contact or overlap outside, m. Event counts accumulate along
    the path; history: the events of every equilibrium of the path up to here. pending: places within reach of the
    attraction that were left open, for contact there does not hold.
    """

    separation: float
    fraction: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    pressure_slope: float = 0.0
    area_slope: float = 0.0
    rates: tuple[np.ndarray, np.ndarray] | None = None
    front_residual: float = 0.0
    gap_residual: float = 0.0
    pending: int = 0
    history: tuple[Events, ...] = ()

    @property
    def touching(self) -> np.ndarray:
        """The cells that are at least partly in contact, of bool."""
        return self.fraction > 0
