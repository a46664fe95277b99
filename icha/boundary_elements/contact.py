"""Contact model by boundary elements with short-ranged adhesion, for loading and unloading paths."""

from __future__ import annotations

import hashlib
import pathlib
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version

import numpy as np

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.boundary_elements.adhesive import Summits, solve_adhesive_contact
from icha.boundary_elements.elastic_contact import Contact, Topography, solve_nonadhesive_contact
from icha.boundary_elements.front import Front, adhesive_areas, reported_area_gradient, reported_areas
from icha.boundary_elements.front_solver import TOLERANCES, FrontProblem, find_active_cells, rates_with_separation
from icha.boundary_elements.full_contact import ROUNDING, FullContactProblem
from icha.boundary_elements.half_space import MARGIN, HalfSpace, Layer
from icha.boundary_elements.load_control import ControlProblem, solve_at_control
from icha.boundary_elements.observables import PatchObservables
from icha.boundary_elements.patches import (
    BEYOND_EDGES,
    CellState,
    free_edges,
    label_patches,
    pack,
    patch_events,
    unpack,
)
from icha.contact.checkpoints import CheckpointedContact
from icha.contact.model import AREA_FRACTION, PRESSURE, Control, NotConverged
from icha.contact.models import MODELS, REFERENCE_MODEL, PathAccuracy
from icha.surfaces.summits import locate_summits
from icha.surfaces.surface import Surface

# Smallest critical opening divided by the largest height. Rounding of the heights would hide a smaller opening.
_SMALLEST_OPENING = 1e-4
# The rates of a state predict the next state if no fraction of contact changes by more than this.
_LARGEST_PREDICTION = 1.0
# Least energy to which errors of the work in a loop are relative, in units of `surface_energy` times A0.
_SMALLEST_WORK = 1e-3


@dataclass(frozen=True, eq=False)
class BoundaryElements(FullContactProblem):
    """Contact model of a rough surface against a half-space or layer, by boundary elements on grid cells."""

    @property
    def count(self) -> int:
        """Number of cells of the surface, without the margin of a free square."""
        return self.grid**2

    @property
    def area(self) -> float:
        """Nominal area A0, m^2: that of the periodic cell or of the free square."""
        return self.count * self.spacing**2

    @property
    def largest_area_fraction(self) -> float:
        """Return 1: the model covers full contact."""
        return 1.0

    @property
    def area_step(self) -> float:
        """Area of a cell without adhesion, because whole cells touch; 0 with adhesion, because fronts divide cells."""
        return 0.0 if self.adhesive else 1 / self.count

    @cached_property
    def path_accuracy(self) -> PathAccuracy:
        """Accuracy of a path, with `least_work` of the material; without adhesion the work does not control steps."""
        least_work = _SMALLEST_WORK * self.law.material.surface_energy
        return replace(MODELS[REFERENCE_MODEL].accuracy, least_work=least_work, error_controlled_steps=self.adhesive)

    def untouched(self) -> CellState:
        """Return the state without contact where the first summit jumps into contact, or the highest point touches."""
        separation = float(self.heights.max())
        if self.adhesive:
            first = self.asperities.height + self.summits.reach * self.spacing
            separation = float(np.max(first, initial=separation))
        nothing = np.zeros(0)
        return CellState(separation, nothing.astype(int), nothing, nothing, nothing)

    def equilibrium(
        self, state: CellState, separation: float, control: Control | None = None, *, let_go: int = 0
    ) -> CellState:
        """Find the next equilibrium from a state: at a mean separation (m), or at the load or area of `control`.

        With `control`, `separation` is the first guess. The result may be full contact, at separation 0: under a large
        load, or at a separation below `smallest_gap`. Without `control`, the first call from full contact only lowers
        the pressure to the opening pressure, at separation 0; the next call opens the contact. Unstable patches detach
        without force: raise `NotConverged` if `let_go` is not 0, or if there is no equilibrium.
        """
        if let_go:
            raise NotConverged("boundary elements cannot detach single patches by force")
        find = self._from_full_contact if self.is_full(state) else self._next_equilibrium
        return self.continue_from(find(state, separation, control), state)

    def continue_from(self, state: CellState, before: CellState) -> CellState:
        """Return a state with the history of the state `before` and the events between both states."""
        events = self._events(before, state)
        return replace(state, history=(*before.history, events) if len(events) else before.history)

    def _next_equilibrium(self, state, separation, control):
        """Find the equilibrium from a state with gaps. Areas, loads with adhesion and a first contact need a search."""
        if control is None:
            closed = separation < self.smallest_gap
            return self.full_contact(self.undetermined_pressure) if closed else self._solve(state, separation)
        if not self.adhesive and control.quantity == PRESSURE and control.target > 0 and len(state.cells):
            if control.target >= self.opening_pressure:
                return self.full_contact(control.target)
            return self._solve_nonadhesive(
                state, load=control.target / self.contact_modulus * self.count / self.space.size
            )
        return solve_at_control(ControlProblem(self, control, self._solve, self._events), state, separation)

    def _from_full_contact(self, state, separation, control):
        """Find the next equilibrium from full contact. It opens below its opening pressure; see `equilibrium`."""
        if control is None and separation <= 0:
            return self.full_contact(self.undetermined_pressure)
        if control is None and self.pressure(state) > self.opening_pressure + ROUNDING * self.contact_modulus:
            return self.full_contact(self.opening_pressure)
        if control and control.quantity == PRESSURE and control.target >= self.opening_pressure:
            return self.full_contact(control.target)
        if control and control.quantity == AREA_FRACTION and control.target >= 1:
            return state
        separation = max(separation, self.smallest_gap)
        return self._next_equilibrium(self.open_most_tensile(separation), separation, control)

    def at_edge(self, state: CellState) -> np.ndarray:
        """Return whether each cell in contact, (k,), is in an outermost row or column of a free square."""
        row, column = np.divmod(state.cells, len(self.heights))
        outermost = (np.minimum(row, column) == 0) | (np.maximum(row, column) == self.grid - 1)
        return outermost & bool(self.space.transformed)

    def reason_beyond(self, state: CellState) -> str:
        """Return a reason if the contact of a shape has reached the edge of its square; otherwise an empty text."""
        if self.shape is None or not self.at_edge(state).any():
            return ""
        return (
            f"the contact reaches the edge of the square of side {self.grid * self.spacing:g} m, although the shape "
            "continues; use a larger square, or smaller loads"
        )

    def observables(self, surface: Surface) -> PatchObservables:
        """Return the object that computes recorded values of states from this contact and its surface."""
        return PatchObservables(self, surface)

    def relax_region(self, region: np.ndarray, separation: float) -> CellState:
        """Find the equilibrium at a separation (m), starting from contact in a given region, (n, n) bool."""
        cells = np.flatnonzero(np.pad(region, (0, self.space.grid - self.grid)))
        nothing = np.zeros(len(cells))
        return self.equilibrium(CellState(separation, cells, nothing + 1, nothing, nothing), separation)

    def pressure(self, state: CellState) -> float:
        """Return the nominal pressure of a state: force divided by nominal area, Pa; negative in tension."""
        return float(np.sum(state.pressure)) / self.count

    def area_fraction(self, state: CellState) -> float:
        """Return the contact area of a state divided by the nominal area."""
        return float(np.sum(self.area_of_cells(state))) / self.count

    def area_of_cells(self, state: CellState) -> np.ndarray:
        """Return the contact area of each cell, (k,), divided by the cell area.

        With adhesion these are `reported_areas`; without, 1 minus BEYOND_EDGES for each free edge of the cell.
        """
        if self.adhesive:
            return reported_areas(state.fraction, state.mean_fraction)
        return 1 - BEYOND_EDGES * free_edges(state.cells, self.space.grid)

    def gap(self, state: CellState) -> np.ndarray:
        """Return the gap at the grid nodes, (n, n), m; in partial cells it is the extension of the bond."""
        return self.displacement(state) + state.separation - self.crop(self.heights)

    def displacement(self, state: CellState) -> np.ndarray:
        """Return the displacement of the elastic surface at the grid nodes, (n, n), m, away from the rough surface."""
        return self.crop(self.space.displacement(state.cells, state.pressure / self.contact_modulus) * self.spacing)

    def crop(self, field: np.ndarray) -> np.ndarray:
        """Return a field of the grid without the margin of a free square."""
        return field[: self.grid, : self.grid]

    def fractions(self, state: CellState) -> np.ndarray:
        """Return the fraction of contact of all cells of the surface, (n, n)."""
        return self.crop(self.space.field(state.cells, state.fraction))

    def mean_gap(self, state: CellState) -> float:
        """Return the mean gap where the surface has a height, m; it is the mean separation if that is fixed."""
        if self.space.mean_is_fixed:
            return state.separation
        gap = self.gap(state)
        return float(np.mean(gap[np.isfinite(gap)]))

    def spot_count(self, state: CellState) -> int:
        """Return the number of contact patches of a state."""
        return label_patches(state.cells, self.space.grid)[1]

    def stiffness(self, state: CellState) -> float:
        """Return the contact stiffness -dp/du with moving fronts, Pa/m; p nominal pressure, u mean separation."""
        return 0.0 - self.slope(PRESSURE, state)  # not -0.0 without contact

    def slope(self, quantity: str, state: CellState) -> float:
        """Return the slope that is stored in a state: of the nominal pressure (Pa/m), or of the area fraction (1/m)."""
        return state.pressure_slope if quantity == PRESSURE else state.area_slope

    def stored_energy(self, state: CellState) -> float:
        """Return the elastic energy minus the work of adhesion, divided by the nominal area, J/m^2."""
        return float(np.sum(self._energy_of_cells(state))) / self.count

    def is_unstable(self, state: CellState) -> bool:
        """Return False: every equilibrium is a minimum of energy."""
        return False

    def _predict(self, state, separation):
        """Predict the contact at a separation (m) by the rates of a state; without valid rates, do not change it."""
        contact = Contact(state.cells, state.fraction, state.pressure / self.contact_modulus)
        if state.rates is None:
            return contact
        distance = (separation - state.separation) / self.spacing
        change = state.rates[0] * distance
        if not np.abs(change).max() <= _LARGEST_PREDICTION:  # or not finite
            return contact
        return contact.apply_step(change, state.rates[1] * distance)

    def _solve(self, state, separation, residual=TOLERANCES.front, *, nearby=False, reuse_slopes=False):
        """Solve the equilibrium at a separation (m), starting from the prediction of `_predict`.

        The options have an effect only with adhesion. residual : largest residual of the front. nearby : whether the
        start is near equilibrium. reuse_slopes : keep the slopes of `state` if the same cells are in contact.
        """
        if not self.adhesive:
            return self._solve_nonadhesive(state, separation=separation / self.spacing)
        height = self.rms_height / self.spacing
        problem = FrontProblem(self.space, self.front, self.topography, separation / self.spacing, rms_height=height)
        start = self._predict(state, separation)
        solved, pending = solve_adhesive_contact(problem, self.summits, start, residual, nearby=nearby)
        front_residual = find_active_cells(self.front, solved).residual
        new = self._state_of(solved, separation, solved.mean_fraction, front_residual=front_residual, pending=pending)
        if reuse_slopes and np.array_equal(new.cells, state.cells):
            return replace(new, pressure_slope=state.pressure_slope, area_slope=state.area_slope, rates=state.rates)
        return self._with_slopes(new, float(np.clip(residual, *TOLERANCES.linear)))

    def _solve_nonadhesive(self, state, **given):
        """Solve the equilibrium without adhesion at a given separation (cell sizes) or load (nominal pressure, E*)."""
        contact = Contact(state.cells, state.fraction, state.pressure / self.contact_modulus)
        solved = solve_nonadhesive_contact(self.space, self.topography, contact, **given)
        new = self._state_of(solved, solved.separation * self.spacing, np.zeros(len(solved.cells)))
        return self._with_slopes(new, TOLERANCES.linear[0])

    def _state_of(self, found, separation, mean_fraction, **values):
        """Return the state of a solved contact at a separation (m), with its gap residual and further `values`."""
        pressure, closed = found.pressure * self.contact_modulus, found.cells[found.fraction >= 1]
        # Largest gap of a closed cell, or largest overlap of the surfaces if that is larger.
        error = float(max(np.abs(found.gap.ravel()[closed]).max(initial=0.0), -found.gap.min())) * self.spacing
        return CellState(separation, found.cells, found.fraction, pressure, mean_fraction, gap_residual=error, **values)

    def _events(self, before, after):
        """Find jumps, coalescences and splits between two states; without adhesion they release no energy."""
        energy = (
            self._energy_of_lone_cells if self.adhesive else lambda state, chosen: np.zeros(np.count_nonzero(chosen))
        )
        return patch_events(before, after, energy, self.summits.cell, self.space.grid, self.spacing)

    def _with_slopes(self, state, accuracy):
        """Return the state with rates and slopes to a relative accuracy; without adhesion, estimate the area slope."""
        if not len(state.cells):
            return state
        contact = Contact(state.cells, state.fraction, state.pressure / self.contact_modulus)
        fraction, pressure = rates_with_separation(self.space, self.front, contact, state.mean_fraction, accuracy)
        scale = self.count * self.spacing
        pressure_slope = float(np.sum(pressure)) * self.contact_modulus / scale
        if self.adhesive:
            gradient = reported_area_gradient(state.fraction, state.mean_fraction)
            area_slope = float(np.sum(gradient * fraction)) / scale
        else:
            # The area changes by whole cells, but on average it is nearly proportional to the load.
            area_slope = self.area_fraction(state) * pressure_slope / self.pressure(state)
        return replace(state, pressure_slope=pressure_slope, area_slope=area_slope, rates=(fraction, pressure))

    def _energy_of_lone_cells(self, state, chosen):
        """Return the energy of chosen cells as in `_energy_of_cells`, J/m^2, without pressure on other cells."""
        others, cells, pressure = ~chosen, state.cells[chosen], state.pressure[chosen]
        by_others = state.pressure[others] / self.contact_modulus
        displaced = self.space.displacement(state.cells[others], by_others, cells) * self.spacing
        return self._energy_of_cells(state)[chosen] - 0.5 * pressure * displaced

    def _energy_of_cells(self, state):
        """Return the elastic energy minus the work of adhesion of each cell in contact, (k,), J/m^2."""
        elastic = 0.5 * state.pressure * (self.heights.ravel()[state.cells] - state.separation)
        return elastic - self.law.material.surface_energy * adhesive_areas(state.fraction, state.mean_fraction)


def contact_of(surface: Surface, material: Material) -> BoundaryElements:
    """Build the boundary elements for a surface and a material.

    Raises
    ------
    ValueError
        If adhesion is so weak that rounding of the heights would hide it, or if a layer under a free
        square is thinner than a cell.
    """
    law, asperities, h = JKR(material), locate_summits(surface), surface.spacing
    heights = np.pad(surface.profile, (0, MARGIN if surface.free else 0), constant_values=-np.inf)
    column, row = (np.rint(asperities.position / h).astype(int) % surface.grid).T
    cell = row * len(heights) + column
    R = asperities.radius_of_curvature
    jump_in = law.jump_in_approach(R)
    above, radius = asperities.height - heights.ravel()[cell], law.contact_radius(jump_in, R)
    summits = Summits(cell, above / h, -jump_in / h, radius / h)
    strength = material.interface_strength / material.contact_modulus
    front = Front(material.surface_energy / (material.contact_modulus * h), strength)
    topography = Topography.of(heights / h)
    if 0 < front.critical_opening < _SMALLEST_OPENING * topography.largest:
        raise ValueError(
            f"surface_energy: {material.surface_energy:g} J/m^2 is too small: rounding of heights up to "
            f"{topography.largest * h:g} m hides the adhesion. Use zero or a larger value"
        )
    if not topography.largest:  # a flat punch, whose indentations are rounded like heights of the unit
        topography = replace(topography, largest=surface.unit_height / h)
    layer = Layer(material.thickness / h, material.poisson_ratio) if material.layered else None
    if layer and surface.free and layer.thickness < 1:
        cell = f"{material.thickness:g} m is less than a grid cell of {h:g} m"
        raise ValueError(f"thickness: {cell}; expected a thicker layer or a finer grid")
    space = HalfSpace.of(len(heights), layer, free=surface.free)
    return BoundaryElements(
        heights=heights,
        grid=surface.grid,
        spacing=h,
        law=law,
        rms_height=surface.unit_height,
        rms_slope=surface.unit_slope,
        asperities=asperities,
        space=space,
        topography=topography,
        front=front,
        summits=summits,
        shape=surface.shape,
    )


def resumable(contact: BoundaryElements, folder: pathlib.Path) -> CheckpointedContact:
    """Return the contact with checkpoints to resume a path, separate for each surface, material and program version."""
    programs = [(name, version(name)) for name in ("icha", "numpy", "scipy")]
    settings = repr((contact.spacing, contact.law.material, programs, CellState.__match_args__)).encode()
    identity = hashlib.sha256(contact.heights.tobytes() + settings).hexdigest()
    return CheckpointedContact(contact, identity[:32], folder, pack, unpack)
