"""Full contact of a rough surface: its pressure in closed form, and the cells where it opens."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from icha.asperity.jkr import JKR, MaterialUnits
from icha.boundary_elements.elastic import HalfSpace
from icha.boundary_elements.laws import AtDistance, ShortRange
from icha.boundary_elements.patches import CellState
from icha.half_space.layer import softness_of
from icha.surfaces.shapes import Shape
from icha.surfaces.summits import Asperities
from icha.surfaces.surface import full_contact_pressure

# Contact counts as full if the mean gap is below this part of h_rms. Rounding would hide pressures of smaller gaps.
_SMALLEST_GAP = 1e-4
# Relative rounding error of pressures in full contact.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class FullContactProblem(MaterialUnits):
    """A rough surface against a half-space or layer: the contact problem, and its states of full contact.

    Full contact of a periodic surface has a closed form. That of a free square is found like any other contact.

    Parameters
    ----------
    heights : (n, n), heights of all cells of the grid, m; -inf in the margin of a free square.
    grid : number of cells along a side of the surface, without the margin of a free square.
    spacing : size of a cell, m.
    law : contact law of a single summit; it gives the gap at which a summit jumps into contact.
    rms_height, rms_slope : units of length (m) and slope; those of the roughness, or of a surface with a shape.
    asperities : summits of the surface.
    space, attraction : elastic body and law of attraction, in units of the cell size and of E*.
    summit_cells : (k,) int, cell of each summit.
    shape : shape that carries the roughness; None without a shape.
    """

    heights: np.ndarray
    grid: int
    spacing: float
    law: JKR
    rms_height: float
    rms_slope: float
    asperities: Asperities
    space: HalfSpace
    attraction: AtDistance | ShortRange
    summit_cells: np.ndarray
    shape: Shape | None = None

    @cached_property
    def full_contact_pressure(self) -> np.ndarray:
        """Pressure in full contact minus its mean value, (n, n), Pa; without closed form zero."""
        if self.space.free:
            return np.zeros_like(self.heights)
        side, softness = len(self.heights) * self.spacing, softness_of(self.law.material)
        return self.contact_modulus * full_contact_pressure(self.heights, side, softness=softness)

    @property
    def interface_strength(self) -> float:
        """Largest tension of closed cells that are not at a front, Pa; above it they open."""
        return self.attraction.strength * self.contact_modulus

    @property
    def resolved_tension(self) -> float:
        """Tension at which a cell at a straight edge opens, Pa: the largest tension that the grid resolves."""
        return self.attraction.straight_strength * self.contact_modulus

    @property
    def smallest_gap(self) -> float:
        """Mean separation below which contact counts as full contact, m; -inf if it does not determine the gap."""
        return -np.inf if self.space.free else _SMALLEST_GAP * self.rms_height

    @property
    def opening_pressure(self) -> float:
        """Nominal pressure at which full contact opens on unloading, Pa; negative if this is a tension."""
        if self.space.free:
            return np.inf
        return -float(self.full_contact_pressure.min()) - self.interface_strength

    def full_contact(self, pressure: float) -> CellState:
        """Return the state of full contact under a nominal pressure (Pa), from the closed form."""
        ones = np.ones(self.heights.size)
        cells = np.arange(self.heights.size)
        return CellState(0.0, cells, ones, self.full_contact_pressure.ravel() + pressure, ones, pressure_slope=-np.inf)

    def is_full(self, state: CellState) -> bool:
        """Return whether a state is full contact: all cells in contact at zero separation."""
        return not self.space.free and state.separation == 0 and len(state.cells) == self.heights.size

    @property
    def undetermined_pressure(self) -> float:
        """Nominal pressure for full contact at zero separation, Pa: not determined, so an arbitrary large value."""
        return 10 * max(float(np.abs(self.full_contact_pressure).max()), self.interface_strength)

    def open_most_tensile(self, mean_gap: float) -> CellState:
        """Return a start for a search: full contact without its most tensile cells, at separation 0.

        A larger `mean_gap` (m) opens more cells, at most half of them. All pressures are shifted so that the largest
        tension before opening is the strength of a front.
        """
        pressure = self.full_contact_pressure.ravel() - self.full_contact_pressure.min()
        pressure -= self.resolved_tension
        largest_gap = max(self.attraction.reach * self.spacing, mean_gap)
        count = int(min(1 + mean_gap / largest_gap * pressure.size, pressure.size / 2))
        # Cells of equal pressure open together, so that a symmetric surface opens symmetrically.
        limit = np.partition(pressure, count - 1)[count - 1] + ROUNDING * self.contact_modulus
        closed = np.flatnonzero(pressure > limit)
        ones = np.ones(len(closed))
        return CellState(0.0, closed, ones, pressure[closed], ones)
