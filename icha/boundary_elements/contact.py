"""Boundary elements in the short-range limit: a model of contact, which a path is followed with."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.boundary_elements.adhesionless import pressed
from icha.boundary_elements.adhesive import Summits, settled
from icha.boundary_elements.elasticity import Held
from icha.boundary_elements.front import COMPLIANCE, Front, areas, contact_area_gradient, contact_areas, neighbours
from icha.boundary_elements.held_load import held
from icha.boundary_elements.kernel import HalfSpace
from icha.boundary_elements.newton import FRONT_TOLERANCE, front_residual, tangent
from icha.boundary_elements.patch_events import patch_events
from icha.boundary_elements.patches import BEYOND_EDGES, edges, labelled
from icha.boundary_elements.states import CellState
from icha.contact.events import Events
from icha.contact.model import PRESSURE, Control
from icha.surfaces.summits import Asperities, find_summits
from icha.surfaces.surface import Surface

# The gap at which a cell lets go, over the largest height, below which it is lost in the rounding of heights.
_LEAST_REACH = 1e-4
# Change of fractions that is small.
_NEAR = 0.25


@dataclass(frozen=True, eq=False)
class BoundaryElements:
    """A periodic rough surface against a half-space, cell by cell: a `ContactModel`.

    heights: (n, n), m. spacing: m. law: of one summit, for how far its attraction reaches. The solver works in cells
    and E*: `space`, `front` and `summits` are in these units.
    """

    heights: np.ndarray
    spacing: float
    law: JKR
    rms_height: float
    asperities: Asperities
    space: HalfSpace
    front: Front
    summits: Summits

    @classmethod
    def of(cls, surface: Surface, material: Material) -> BoundaryElements:
        """The contact of a surface and a material.

        Raises
        ------
        ValueError
            If the surface is a free square or has no summits, or adhesion is lost in the rounding of its heights.
        """
        surface.require_periodic("a model of boundary elements")
        law, asperities, h = JKR(material), find_summits(surface), surface.spacing
        column, row = (np.rint(asperities.position / h).astype(int) % surface.grid).T
        cell = row * surface.grid + column
        jump_in = law.jump_in_approach(asperities.radius_of_curvature)
        summits = Summits(
            cell,
            (asperities.height - surface.heights.ravel()[cell]) / h,
            -jump_in / h,
            law.contact_radius(jump_in, asperities.radius_of_curvature) / h,
        )
        front = Front(material.surface_energy / (material.contact_modulus * h))
        if 0 < COMPLIANCE * front.strength < _LEAST_REACH * np.abs(surface.heights).max() / h:
            raise ValueError(
                f"surface_energy: {material.surface_energy:g} J/m^2 cannot be told from none at heights like these; "
                "needed: none at all, or more"
            )
        return cls(surface.heights, h, law, surface.rms_height, asperities, HalfSpace.of(surface.grid), front, summits)

    # --- what a path asks of every model --------------------------------------------------------------------------

    @property
    def adhesive(self) -> bool:
        """Whether contact forms and breaks in jumps."""
        return self.law.material.surface_energy > 0

    @property
    def contact_modulus(self) -> float:
        """E*, Pa."""
        return self.law.material.contact_modulus

    @property
    def area(self) -> float:
        """Nominal contact area A0, m^2."""
        return self.heights.size * self.spacing**2

    @property
    def largest_area_fraction(self) -> float:
        """All of it: full contact ends a path by itself."""
        return 1.0

    def untouched(self) -> CellState:
        """The state at which the first summit is about to make contact."""
        reach = self.summits.reach * self.spacing if self.adhesive else 0.0
        separation = float(np.max(self.asperities.height + reach)) if self.adhesive else float(self.heights.max())
        nothing = np.zeros(self.heights.shape)
        return CellState(separation, nothing, nothing, separation - self.heights)

    def equilibrium(
        self, state: CellState, separation: float, control: Control | None = None, *, let_go: int = 0
    ) -> CellState:
        """The contact brought to another mean separation (m), or to a given load or area; as of `ContactModel`.

        Fronts lose their equilibrium together or alone without anybody's help: `let_go` changes nothing.
        """
        if control is None:
            return self._at(state, separation)
        return held(self, state, separation, control, self._at)

    def released(self, region: np.ndarray, separation: float) -> CellState:
        """The equilibrium at a separation (m) that a contact of a given region, (n, n) of bool, falls into."""
        fraction = region.astype(float)
        nothing = np.zeros(fraction.shape)
        return self._at(CellState(separation, fraction, nothing, nothing), separation)

    def pressure(self, state: CellState) -> float:
        """Force over nominal area, Pa; negative in tension."""
        return float(np.mean(state.pressure))

    def area_fraction(self, state: CellState) -> float:
        """Contact area over nominal area."""
        return float(np.sum(self.area_of_cells(state))) / self.heights.size

    def area_of_cells(self, state: CellState) -> np.ndarray:
        """Contact area of every cell, (n, n), in cells: less than its fraction along the perimeter."""
        if self.adhesive:
            return contact_areas(state.fraction, neighbours(state.fraction))
        touching = state.touching
        return touching - BEYOND_EDGES * edges(touching)

    def mean_gap(self, state: CellState) -> float:
        """Mean gap over the nominal area, m: the mean separation, for pressures displace no mean plane."""
        return state.separation

    def spot_count(self, state: CellState) -> int:
        """Number of patches."""
        return labelled(state.touching)[1]

    def stiffness(self, state: CellState) -> float:
        """Contact stiffness -dp/du, fronts moving along, Pa/m."""
        return 0.0 - self.slope(PRESSURE, state)

    def slope(self, quantity: str, state: CellState) -> float:
        """Derivative of a quantity that can be held with respect to the mean separation, fronts moving along."""
        return state.pressure_slope if quantity == PRESSURE else state.area_slope

    def stored_energy(self, state: CellState) -> float:
        """Elastic energy less that of adhesion over nominal area, J/m^2; zero out of contact."""
        return float(np.sum(self._energy_of_cells(state))) / self.heights.size

    def is_unstable(self, state: CellState) -> bool:
        """Whether it is on an unstable branch: what is found here lies at a minimum of energy."""
        return False

    def events_between(self, before: CellState, after: CellState) -> Events:
        """The events on the path from one state to a later one."""
        return Events.joined(after.history[len(before.history) :])

    # --- on the way -----------------------------------------------------------------------------------------------

    def _cells(self, state):
        """The state in the units of the solver; the energy is not needed."""
        pressure, gap = state.pressure / self.contact_modulus, state.gap / self.spacing
        return Held(state.fraction, pressure, gap, 0.0, neighbours(state.fraction))

    def _on_the_way(self, state, separation):
        """The state, and if it is not far to a separation (m) what its rates make of it there."""
        cells = self._cells(state)
        if state.rates is None:
            return cells
        way = (separation - state.separation) / self.spacing
        change = state.rates[0] * way
        if np.abs(change).max() > _NEAR:
            return cells
        fraction = np.clip(state.fraction + change, 0.0, 1.0)
        return Held(fraction, cells.pressure + state.rates[1] * way, cells.gap, 0.0, neighbours(fraction))

    def _at(self, state, separation, tolerance=FRONT_TOLERANCE):
        """The equilibrium at a separation, m."""
        h = self.spacing
        heights, u = self.heights / h, separation / h
        if self.adhesive:
            cells, pending = settled(
                self.space, self.front, heights, self.summits, u, self._on_the_way(state, separation), tolerance
            )
            fraction, pressure, gap = cells.fraction, cells.pressure, cells.gap
            residual = front_residual(self.front, cells)
        else:
            touching, pressure, gap = pressed(
                self.space, heights, u, state.touching, state.pressure / self.contact_modulus
            )
            fraction, pending, residual = touching.astype(float), 0, 0.0
        closed = np.abs(gap[fraction >= 1]).max(initial=0.0)
        new = CellState(
            separation,
            fraction,
            pressure * self.contact_modulus,
            gap * h,
            front_residual=residual,
            gap_residual=max(closed, -gap[fraction <= 0].min(initial=0.0)) * h,
            pending=pending,
        )
        events = patch_events(state, new, self._set_free, self.summits.cell, h)
        return replace(self._with_slopes(new), history=(*state.history, events))

    def _with_slopes(self, state):
        """The state with the derivatives of pressure and area."""
        if not state.touching.any():
            return state
        cells = self._cells(state)
        fraction, pressure = tangent(self.space, self.front, cells)
        stiffer = float(np.mean(pressure)) * self.contact_modulus / self.spacing
        if self.adhesive:
            wider = float(np.mean(contact_area_gradient(state.fraction, cells.around) * fraction)) / self.spacing
        else:
            # Cells come and go as wholes; in the mean the area grows about in proportion to the load.
            wider = self.area_fraction(state) * stiffer / self.pressure(state)
        return replace(state, pressure_slope=stiffer, area_slope=wider, rates=(fraction, pressure))

    def _energy_of_cells(self, state):
        """Elastic energy less that of adhesion of every cell, J/m^2."""
        elastic = 0.5 * state.pressure * (self.heights - state.separation)
        return elastic - self.law.material.surface_energy * areas(state.fraction, neighbours(state.fraction))

    def _set_free(self, state):
        """What every cell would set free if its patch jumped, J/m^2: without adhesion nothing jumps."""
        return self._energy_of_cells(state) if self.adhesive else np.zeros(state.fraction.shape)
