"""Contact model by boundary elements with adhesion of a short or finite range, for loading and unloading paths."""

from __future__ import annotations

import hashlib
import pathlib
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from typing import ClassVar

import numpy as np

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.boundary_elements import minimise as solver
from icha.boundary_elements.cells import field_of
from icha.boundary_elements.elastic import HalfSpace
from icha.boundary_elements.full_contact import ROUNDING, FullContactProblem
from icha.boundary_elements.laws import (
    TOUCHING,
    AtDistance,
    Cohesive,
    NoAttraction,
    ShortRange,
    at_cells,
    average,
)
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
from icha.boundary_elements.window import Window
from icha.contact.attraction import FINITE_RANGE, SHORT_RANGE, attraction_on
from icha.contact.checkpoints import CheckpointedContact
from icha.contact.model import AREA_FRACTION, PRESSURE, Control, NotConverged
from icha.contact.models import AREA_TOLERANCE_CELLS, AREA_TOLERANCE_PART, MODELS, REFERENCE_MODEL, PathAccuracy
from icha.half_space.layer import Layer
from icha.surfaces.summits import locate_summits
from icha.surfaces.surface import Surface

# Smallest critical opening divided by the largest height. Rounding of the heights would hide a smaller opening.
_SMALLEST_OPENING = 1e-4
# Largest change of a position, in cell sizes, by which the rates of a state predict the next state.
_LARGEST_PREDICTION = 1.0
# Largest opening of a bond in a prediction, over the range of attraction.
_KEPT_BONDS = 0.5
# A load or area is met if its relative error is at most this part of the error that paths allow. Most trials for it.
_MET, _MOST_TRIALS = 0.5, 60
# Longest step of a search without a bracket, and smallest difference of two separations, in h_rms. Least load to which
# errors at zero load are relative, in units of stiffness times h_rms.
_LONGEST, _SAME_SEPARATION, _ZERO_LOAD = 0.1, 1e-13, 1e-2
# Largest displacement by residual pressures, in h_rms.
_GAP_ERROR = 5e-9
# Distance of untouched surfaces over the range of attraction: a little more, so that rounding leaves no attraction.
_BEYOND_REACH = 1 + 1e-6
# Largest relative residual of the rates of a state. Where fronts stand, their bonds are stiff springs, and the error of
# the stiffness is up to 20 000 times the residual.
_RATE_ERROR, _RATE_ERROR_OF_SPRINGS = MODELS[REFERENCE_MODEL].stiffness_error, 1e-9


@dataclass(frozen=True, eq=False)
class BoundaryElements(FullContactProblem):
    """Contact model of a rough surface against a half-space or layer, by boundary elements on grid cells."""

    path_accuracy: ClassVar[PathAccuracy] = MODELS[REFERENCE_MODEL].accuracy

    @cached_property
    def cell_heights(self) -> np.ndarray:
        """Heights in cell sizes, (n, n)."""
        return self.heights / self.spacing

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
    def is_unique(self) -> bool:
        """Whether each load has only one equilibrium: without adhesion."""
        return not self.adhesive

    @property
    def spots_jump(self) -> bool:
        """Whether a patch forms and breaks in a jump: only at a short range of attraction."""
        return self.divides_cells

    @property
    def area_step(self) -> float:
        """Area of a cell if whole cells touch; 0 at a short range of attraction, because fronts divide cells."""
        return 0.0 if self.divides_cells else 1 / self.count

    @property
    def divides_cells(self) -> bool:
        """Whether a part of a cell may be in contact: only at a short range of attraction."""
        return self.attraction.name == SHORT_RANGE

    def untouched(self) -> CellState:
        """Return the state without contact where a first summit jumps into contact, or a point touches or attracts."""
        if isinstance(self.attraction, ShortRange):
            separation = float(np.max(self.heights + self.attraction.jump_in * self.spacing))
        else:
            separation = float(self.heights.max()) + self.attraction.reach * self.spacing * _BEYOND_REACH
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
        events, dissipated = self._events(before, state), before.front_dissipation
        if self.law.material.directed:
            fields = (self.field(each.cells, each.fraction) for each in (before, state))
            dissipated += self.attraction.dissipated(*fields) * self.contact_modulus * self.spacing / self.count
        history = (*before.history, events) if len(events) else before.history
        return replace(state, history=history, front_dissipation=dissipated)

    def _next_equilibrium(self, state, separation, control):
        """Find the equilibrium from a state with gaps. Areas, tensile loads and a first contact need a search."""
        if control is None:
            closed = separation < self.smallest_gap
            return self.full_contact(self.undetermined_pressure) if closed else self._solve(state, separation)
        if control.quantity != PRESSURE or control.target <= 0 or (self.adhesive and not len(state.cells)):
            return self._search(state, separation, control)
        if control.target >= self.opening_pressure and not self.adhesive:
            return self.full_contact(control.target)
        return self._solve(state, separation, control.target)

    def _search(self, state, separation, control):
        """Find the equilibrium with a load or area by secants and halvings of the separation."""
        value = self.pressure if control.quantity == PRESSURE else self.area_fraction
        target, tolerance = control.target, self._tolerance(state, control)
        same = _SAME_SEPARATION * self.rms_height
        sign, missing = np.sign(target - value(state)) or 1.0, abs(target - value(state))
        before, beyond, trial = state, None, state
        for _ in range(_MOST_TRIALS):
            ends = [before.separation, beyond.separation] if beyond else [-np.inf, np.inf]
            if not min(ends) < separation < max(ends):
                separation = 0.5 * sum(ends) if beyond else self._closer(before.separation, sign)
            if separation < self.smallest_gap:
                raise NotConverged(f"the mean gap vanishes before a {control.quantity.replace('_', ' ')} of {target:g}")
            trial = self._solve(before, separation)
            error = value(trial) - target
            if abs(error) <= tolerance:
                return trial
            if sign < 0 and error > missing and separation > before.separation + same:
                # The surfaces separate, but the tension falls: the step has passed its largest value.
                separation = 0.5 * (before.separation + separation)
                continue
            if sign * error < 0:
                before, missing = trial, abs(error)
            else:
                beyond = trial
            slope = self.slope(control.quantity, trial)
            separation = trial.separation - error / slope if slope < 0 else np.nan
            if beyond and abs(before.separation - beyond.separation) < same:
                break
        raise NotConverged(f"found no equilibrium at a {control.quantity.replace('_', ' ')} of {target:g}")

    def _closer(self, separation, sign):
        """Return a separation nearer to the target than all states so far, m; `sign` is that of the missing load."""
        longest = _LONGEST * self.rms_height
        return separation - sign * (min(0.5 * separation, longest) if not self.space.free else longest)

    def _tolerance(self, state, control):
        """Return the largest error of a met target: relative; for areas without adhesion, some cell areas."""
        scale = abs(control.target)
        if not scale:
            unit = abs(self.stiffness(state)) * self.rms_height
            scale = max(abs(self.pressure(state)), _ZERO_LOAD * unit if np.isfinite(unit) else 0.0)
        met = _MET * self.path_accuracy.target * scale
        if control.quantity == AREA_FRACTION and self.area_step:
            return max(met, min(AREA_TOLERANCE_CELLS * self.area_step, AREA_TOLERANCE_PART * scale))
        return met

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
        return outermost & self.space.free

    def reason_beyond(self, state: CellState) -> str:
        """Return a reason if contact or attraction of a shape has reached the edge of its square; otherwise ""."""
        if self.shape is None or not self.at_edge(state).any():
            return ""
        reaching = "attraction" if self.attraction.name == FINITE_RANGE else "contact"
        return (
            f"the {reaching} reaches the edge of the square of side {self.grid * self.spacing:g} m, although the shape "
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

        At a short range of attraction these are `reported_areas`. Otherwise only cells without a gap are in contact,
        and their area is 1 minus BEYOND_EDGES for each free edge.
        """
        if self.divides_cells:
            return ShortRange.reported_areas(state.fraction, state.mean_fraction)
        closed = state.fraction == 1
        areas = np.zeros(len(state.cells))
        areas[closed] = 1 - BEYOND_EDGES * free_edges(state.cells[closed], self.space.grid)
        return areas

    def in_contact(self, state: CellState) -> CellState:
        """Return a state without the cells that attract across a gap of finite range."""
        if self.divides_cells:
            return state
        closed = state.fraction == 1
        parts = {name: getattr(state, name)[closed] for name in ("cells", "fraction", "pressure", "mean_fraction")}
        return replace(state, rates=None, **parts)

    def energetic_area_fraction(self, state: CellState) -> float:
        """Return the energy of adhesion of a state divided by that of full contact.

        At a short range, it is the adhesive area; without adhesion, the area of whole cells in contact.
        """
        areas = self.attraction.energetic_areas(state.cells, state.fraction, state.mean_fraction)
        return float(np.sum(areas)) / self.count

    def gap(self, state: CellState) -> np.ndarray:
        """Return the gap at the grid nodes, (n, n), m; in partial cells it is the extension of the bond."""
        return self.displacement(state) + state.separation - self.crop(self.heights)

    def displacement(self, state: CellState) -> np.ndarray:
        """Return the displacement of the elastic surface at the grid nodes, (n, n), m, away from the rough surface."""
        displacement = self.space.displacement(self.field(state.cells, state.pressure / self.contact_modulus))
        return self.crop(displacement) * self.spacing

    def field(self, cells: np.ndarray, values: np.ndarray | float) -> np.ndarray:
        """Return a field of the grid with given values on cells (k,), and zero elsewhere."""
        return field_of(cells, values, (self.space.grid,) * 2)

    def crop(self, field: np.ndarray) -> np.ndarray:
        """Return a field of the grid without the margin of a free square."""
        return field[: self.grid, : self.grid]

    def fractions(self, state: CellState) -> np.ndarray:
        """Return the fraction of contact of all cells of the surface, (n, n)."""
        return self.crop(self.field(state.cells, state.fraction))

    def mean_gap(self, state: CellState) -> float:
        """Return the mean gap where the surface has a height, m; it is the mean separation if that is fixed."""
        if not self.space.free:
            return state.separation
        gap = self.gap(state)
        return float(np.mean(gap[np.isfinite(gap)]))

    def spot_count(self, state: CellState) -> int:
        """Return the number of contact patches of a state."""
        return label_patches(self.in_contact(state).cells, self.space.grid)[1]

    def stiffness(self, state: CellState) -> float:
        """Return the contact stiffness -dp/du with moving fronts, Pa/m; p nominal pressure, u mean separation."""
        return 0.0 - self.slope(PRESSURE, state)  # not -0.0 without contact

    def slope(self, quantity: str, state: CellState) -> float:
        """Return the slope that is stored in a state: of the nominal pressure (Pa/m), or of the area fraction (1/m)."""
        return state.pressure_slope if quantity == PRESSURE else state.area_slope

    def stored_energy(self, state: CellState) -> float:
        """Return the elastic energy minus the work of adhesion, divided by the nominal area, J/m^2."""
        return float(np.sum(self._energy_of_cells(state))) / self.count

    def front_dissipation(self, state: CellState) -> float:
        """Return what receding fronts have dissipated so far, J/m^2 of nominal area; 0 with one work of adhesion."""
        return state.front_dissipation

    def is_unstable(self, state: CellState) -> bool:
        """Return False: every equilibrium is a minimum of energy."""
        return False

    def _start(self, window, state, separation):
        """Return positions and fractions on a window, predicted at a separation (m), and the rate of the positions.

        If a long step would open bonds, cells in contact keep their positions.
        """
        space, distance = self.space.part(window.grid), (separation - state.separation) / self.spacing

        def displacement(values):
            return space.displacement(window.of(self.field(state.cells, values)))

        position = displacement(state.pressure / self.contact_modulus) + state.separation / self.spacing
        rate = np.ones_like(position) if state.rates is None else 1 + displacement(state.rates)
        change = rate * distance
        if np.abs(change - distance).max() > _LARGEST_PREDICTION:
            change[:] = distance
        fraction = window.of(self.field(state.cells, state.fraction if self.adhesive else 0.0))
        touching = np.pad(fraction > 0, (0, len(position) - len(fraction)))
        if np.max(change, where=touching, initial=0.0) > _KEPT_BONDS * self.attraction.reach:
            change[touching] = 0.0
        return position + change, fraction, rate

    def _window(self, state, separation, window=None):
        """Return a window with all cells that touch or attract if a state moves to a separation (m).

        It contains all cells of a given window. A periodic surface has only one window.
        """
        whole = Window.whole(self.space.grid)
        if not self.space.free:
            return whole
        position, fraction, _ = self._start(whole, state, separation)
        cells = self.crop(self.attraction.acts_on(position - self.cell_heights, fraction))
        if window is None:
            return Window.around(cells)
        known = np.zeros_like(cells)
        known[window.inside] = True
        return Window.around(cells | known) if (cells & ~known).any() else window

    def _solve(self, state, separation, pressure=None):
        """Solve the equilibrium at a separation (m), or at a nominal pressure (Pa) with a guess of the separation."""
        law = self.attraction
        if self.law.material.directed:
            law = replace(law, before=self.field(state.cells, state.fraction))
        if pressure is not None and separation <= self.smallest_gap:
            separation = 0.5 * state.separation
        window, wider = None, self._window(state, separation)
        while window is None or wider.side > window.side:
            window = wider
            problem = solver.Problem(self.space, law, self.cell_heights).part(window)
            position, fraction, rate = self._start(window, state, separation)
            if pressure is not None:
                force = pressure / self.contact_modulus * self.count
                stiffness = 0.0 if state.rates is None else -float(np.sum(state.rates))
                if stiffness <= 0:
                    # About that of a rough surface under a light load.
                    stiffness = force * self.spacing / self.rms_height
                control = solver.Control(load=force / position.size, shift=solver.Shift(rate, stiffness))
            else:
                control = solver.Control(**{"rigid" if self.space.free else "mean": separation / self.spacing})
            tolerance = _GAP_ERROR * self.rms_height / self.spacing
            found = solver.minimise(problem, position, fraction, control, tolerance)
            state = self._state_of(found, window)
            separation, wider = state.separation, self._window(state, state.separation, window)
        return self._with_rates(state, found, problem)

    def _state_of(self, found, window):
        """Return the state of an equilibrium on a window, without rates."""
        if found.held.all():
            return self.full_contact(found.load * self.contact_modulus)
        cells = self._touching(found)
        mean = found.position.mean() - self.space.part(window.grid).mean_compliance * found.load
        return CellState(
            mean * self.spacing,
            window.cells(cells, self.space.grid),
            found.fraction.ravel()[cells] if self.adhesive else np.ones(len(cells)),
            found.pressure.ravel()[cells] * self.contact_modulus,
            average(found.fraction).ravel()[cells] if self.divides_cells else np.zeros(len(cells)),
            residual=found.residual,
            gap_residual=found.gap_residual * self.spacing,
            pending=found.pending,
        )

    def _touching(self, found):
        """Return the cells of an equilibrium that touch or attract, (k,) int."""
        return np.flatnonzero(found.fraction if self.adhesive else found.held)

    def _with_rates(self, state, found, problem):
        """Return a state with gaps with its rates and slopes, from the equilibrium of a problem."""
        if self.is_full(state) or not len(state.cells):
            return state
        accuracy = _RATE_ERROR_OF_SPRINGS if self.law.material.directed else _RATE_ERROR
        touching = self._touching(found)
        rates, fraction_rates = (each.ravel()[touching] for each in solver.rates(problem, found, accuracy))
        scale = self.count * self.spacing
        pressure_slope = float(np.sum(rates)) * self.contact_modulus / scale
        if self.divides_cells:
            gradient = ShortRange.reported_area_gradient(state.fraction, state.mean_fraction)
            area_slope = float(np.sum(gradient * fraction_rates)) / scale
        elif self.adhesive:
            # The area changes by whole cells. On average it changes nearly as the energetic area.
            area_slope = float(np.sum(2 * state.fraction * fraction_rates)) / scale
        else:
            # The area changes by whole cells, but on average it is nearly proportional to the load.
            area_slope = self.area_fraction(state) * pressure_slope / (self.pressure(state) or np.inf)
        return replace(state, pressure_slope=pressure_slope, area_slope=area_slope, rates=rates)

    def _events(self, before, after):
        """Find jumps, coalescences and splits between two states; without adhesion they release no energy."""
        energy = (
            self._energy_of_lone_cells if self.adhesive else lambda state, chosen: np.zeros(np.count_nonzero(chosen))
        )
        states = self.in_contact(before), self.in_contact(after)
        return patch_events(*states, energy, self.summit_cells, self.space.grid, self.spacing)

    def _energy_of_lone_cells(self, state, chosen):
        """Return the energy of chosen cells as in `_energy_of_cells`, J/m^2, without pressure on other cells."""
        others, cells, pressure = ~chosen, state.cells[chosen], state.pressure[chosen]
        by_others = self.space.displacement(
            self.field(state.cells[others], state.pressure[others] / self.contact_modulus)
        )
        return self._energy_of_cells(state)[chosen] - 0.5 * pressure * by_others.ravel()[cells] * self.spacing

    def _energy_of_cells(self, state):
        """Return the elastic energy minus the work of adhesion of each cell in contact, (k,), J/m^2."""
        elastic = 0.5 * state.pressure * (self.heights.ravel()[state.cells] - state.separation)
        if not self.adhesive:
            return elastic
        energies = self.attraction.energies(state.cells, state.fraction, state.mean_fraction)
        return elastic + energies * self.contact_modulus * self.spacing


def contact_of(surface: Surface, material: Material) -> BoundaryElements:
    """Build the boundary elements for a surface and a material.

    Raises
    ------
    ValueError
        If adhesion is so weak that rounding of the heights would hide it, or if a layer under a free
        square is thinner than a cell.
    """
    law, asperities, h = JKR(material), locate_summits(surface), surface.spacing
    layer = Layer(material.thickness / h, material.poisson_ratio) if material.layered else None
    if layer and surface.free and layer.thickness < 1:
        cell = f"{material.thickness:g} m is less than a grid cell of {h:g} m"
        raise ValueError(f"thickness: {cell}; expected a thicker layer or a finer grid")
    space = HalfSpace.under(surface.grid, layer, free=surface.free)
    heights = np.pad(surface.profile, (0, space.grid - surface.grid), constant_values=-np.inf)
    column, row = (np.rint(asperities.position / h).astype(int) % surface.grid).T
    cell = row * len(heights) + column
    largest = float(np.abs(heights, where=np.isfinite(heights), out=np.zeros_like(heights)).max())
    attraction: AtDistance | ShortRange = NoAttraction()
    if material.surface_energy:
        places = material.relative_energy(surface.grid, surface.period, periodic=not surface.free)
        if np.ndim(places):
            places = np.pad(places, (0, space.grid - surface.grid), constant_values=1.0)
        adhesion_length = material.adhesion_length / h * places
        ratio = material.receding.surface_energy / material.surface_energy
        if attraction_on(material, h) == FINITE_RANGE:
            strength = material.interface_strength / material.contact_modulus * ratio**0.5
            attraction = Cohesive(adhesion_length, strength, ratio)
        else:
            R, above = asperities.radius_of_curvature, asperities.height - heights.ravel()[cell]
            # The jump-in distance depends on the product of the square of the work and the radius.
            approach = law.jump_in_approach(R * at_cells(places, cell) ** 2)
            jump_in, radius = np.full(heights.shape, TOUCHING), np.zeros(heights.shape)
            np.maximum.at(jump_in.ravel(), cell, (above - approach) / h)
            radius.ravel()[cell] = law.contact_radius(approach, R) / h
            strength = material.receding.interface_strength / material.contact_modulus
            attraction = ShortRange(adhesion_length, strength, jump_in, radius, ratio)
        if attraction.reach * h < _SMALLEST_OPENING * largest:
            raise ValueError(
                f"surface_energy: {material.surface_energy:g} J/m^2 is too small: rounding of heights up to "
                f"{largest:g} m hides the adhesion. Use zero or a larger value"
            )
    return BoundaryElements(
        heights=heights,
        grid=surface.grid,
        spacing=h,
        law=law,
        rms_height=surface.unit_height,
        rms_slope=surface.unit_slope,
        asperities=asperities,
        space=space,
        attraction=attraction,
        summit_cells=cell,
        shape=surface.shape,
    )


def resumable(contact: BoundaryElements, folder: pathlib.Path) -> CheckpointedContact:
    """Return the contact with checkpoints to resume a path, separate for each surface, material and program version."""
    programs = [(name, version(name)) for name in ("icha", "numpy", "scipy")]
    settings = repr((contact.spacing, contact.law.material, programs, CellState.__match_args__)).encode()
    identity = hashlib.sha256(contact.heights.tobytes() + settings).hexdigest()
    return CheckpointedContact(contact, identity[:32], folder, pack, unpack)
