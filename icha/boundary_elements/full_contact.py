"""Full contact of a surface on a grid: closed form of its pressure, and where it opens."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from icha.asperity.jkr import JKR, MaterialUnits
from icha.boundary_elements.adhesive import Summits
from icha.boundary_elements.elastic_contact import Topography
from icha.boundary_elements.front import Front
from icha.boundary_elements.half_space import HalfSpace
from icha.boundary_elements.patches import CellState
from icha.surfaces.summits import Asperities
from icha.surfaces.surface import full_contact_pressure

# Mean gap, in h_rms, below which contact is full: the pressures of smaller gaps are lost in rounding.
_SMALLEST_GAP = 1e-4
# Relative difference of pressures of full contact that is rounding.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class FullContactProblem(MaterialUnits):
    """A periodic rough surface against a half-space, in full contact or about to leave it.

    Parameters
    ----------
    heights : (n, n), m.
    spacing : size of a cell, m.
    law : of one summit, for the reach of its attraction.
    rms_height, rms_slope : of the surface, m and 1.
    asperities : its summits.
    space, topography, front, summits : the same for the solver, in units of cells and E*.
    """

    heights: np.ndarray
    spacing: float
    law: JKR
    rms_height: float
    rms_slope: float
    asperities: Asperities
    space: HalfSpace
    topography: Topography
    front: Front
    summits: Summits

    @cached_property
    def full_contact_pressure(self) -> np.ndarray:
        """Pressure of full contact less its mean, (n, n), Pa."""
        return self.contact_modulus * full_contact_pressure(self.heights, len(self.heights) * self.spacing)

    @property
    def interface_strength(self) -> float:
        """Tension at which contact opens without a front: the theoretical strength of the interface, Pa."""
        return self.front.interface_strength * self.contact_modulus

    @property
    def smallest_gap(self) -> float:
        """Mean gap below which contact is full, m."""
        return _SMALLEST_GAP * self.rms_height

    @property
    def opening_pressure(self) -> float:
        """Nominal pressure of full contact at which it opens on unloading, Pa."""
        return -float(self.full_contact_pressure.min()) - self.interface_strength

    def full_contact(self, pressure: float) -> CellState:
        """Full contact under a nominal pressure, Pa: closed form."""
        ones = np.ones(self.heights.size)
        cells = np.arange(self.heights.size)
        return CellState(0.0, cells, ones, self.full_contact_pressure.ravel() + pressure, ones, pressure_slope=-np.inf)

    def is_full(self, state: CellState) -> bool:
        """Whether a state is full contact."""
        return state.separation == 0 and len(state.cells) == self.heights.size

    @property
    def closing_pressure(self):
        """Nominal pressure of full contact under control of the separation, Pa: above all targets, otherwise free."""
        return 10 * max(float(np.abs(self.full_contact_pressure).max()), self.interface_strength)

    def open_weakest(self, separation):
        """Full contact after the cells of least pressure opened, so many that they hold the mean gap (m)."""
        pressure = self.full_contact_pressure.ravel() - self.full_contact_pressure.min()
        # Around the first gap the pressure is that of a front, not that which opened it.
        pressure -= self.front.strength * self.contact_modulus
        opening = max(self.front.critical_opening * self.spacing, separation)
        count = int(min(1 + separation / opening * pressure.size, pressure.size / 2))
        # Cells of equal pressure open together, as symmetry wants.
        limit = np.partition(pressure, count - 1)[count - 1] + ROUNDING * self.contact_modulus
        closed = np.flatnonzero(pressure > limit)
        ones = np.ones(len(closed))
        return CellState(0.0, closed, ones, pressure[closed], ones)
