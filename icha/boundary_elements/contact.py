"""Boundary elements in the short-range limit: a model of contact, which a path is followed with."""

from __future__ import annotations

import hashlib
import pathlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from importlib.metadata import version

import numpy as np

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.boundary_elements.adhesionless import pressed
from icha.boundary_elements.adhesive import Summits, settled
from icha.boundary_elements.elasticity import Contact, Topography
from icha.boundary_elements.front import COMPLIANCE, Front, adhesive_areas, reported_area_gradient, reported_areas
from icha.boundary_elements.held_load import under_control
from icha.boundary_elements.kernel import HalfSpace
from icha.boundary_elements.newton import COARSE, FINE, FRONT_TOLERANCE, front_residual, tangent
from icha.boundary_elements.patches import (
    BEYOND_EDGES,
    CellState,
    centres,
    edges,
    labelled,
    labels_at,
    packed,
    patch_events,
    unpacked,
)
from icha.contact.kept import Kept
from icha.contact.model import (
    COALESCENCE,
    JUMP_IN,
    JUMP_OFF,
    PRESSURE,
    PRESSURE_BINS,
    SPLIT,
    Control,
    Events,
    NotConverged,
    gap_bins,
    largest_tension,
    summit_counts,
)
from icha.contact.models import MODELS, REFERENCE_MODEL, PathAccuracy
from icha.surfaces.moments import LEAST_CELLS_PER_WAVE, cells_per_short_wave
from icha.surfaces.summits import Asperities, locate_summits
from icha.surfaces.surface import Surface

# The gap at which a cell lets go, over the largest height, below which it is lost in the rounding of heights.
_LEAST_REACH = 1e-4
# Change of fractions that is small.
_NEAR = 0.25


@dataclass(frozen=True, eq=False)
class BoundaryElements:
    """A periodic rough surface against a half-space, cell by cell: a `ContactModel`.

    heights: (n, n), m. spacing: m. law: of one summit, for how far its attraction reaches. The solver works in cells
    and E*: `space`, `topography`, `front` and `summits` are in these units.
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
    def pressure_unit(self) -> float:
        """E* h'_rms, Pa."""
        return self.contact_modulus * self.rms_slope

    @property
    def area(self) -> float:
        """Nominal contact area A0, m^2."""
        return self.heights.size * self.spacing**2

    @property
    def largest_area_fraction(self) -> float:
        """All of it: full contact ends a path by itself."""
        return 1.0

    @property
    def path_accuracy(self) -> PathAccuracy:
        """Accuracy to which a path resolves its events."""
        return MODELS[REFERENCE_MODEL].accuracy

    def untouched(self) -> CellState:
        """The state at which the first summit, or a plateau without any, is about to make contact."""
        separation = float(self.heights.max())
        if self.adhesive:
            first = self.asperities.height + self.summits.reach * self.spacing
            separation = float(np.max(first, initial=separation))
        nothing = np.zeros(0)
        return CellState(separation, nothing.astype(int), nothing, nothing, nothing)

    def equilibrium(
        self, state: CellState, separation: float, control: Control | None = None, *, let_go: int = 0
    ) -> CellState:
        """The contact brought to another mean separation (m), or to a given load or area; as of `ContactModel`.

        Fronts lose their equilibrium by themselves, together or alone: none can be `let_go`.
        """
        if let_go:
            raise NotConverged("fronts let go by themselves")
        if control is None:
            new = self._at(state, separation)
        elif not self.adhesive and control.quantity == PRESSURE and control.target > 0 and len(state.cells):
            new = self._pressed(state, load=control.target / self.contact_modulus)
        else:
            new = under_control(self, state, separation, control, self._at, self._events)
        events = self._events(state, new)
        return replace(new, history=(*state.history, events) if len(events) else state.history)

    def observables(self, surface: Surface) -> PatchObservables:
        """What a run keeps of the states on the surface that is pressed."""
        return PatchObservables(self, surface)

    def released(self, region: np.ndarray, separation: float) -> CellState:
        """The equilibrium at a separation (m) that a contact of a given region, (n, n) of bool, falls into."""
        cells = np.flatnonzero(region)
        nothing = np.zeros(len(cells))
        return self.equilibrium(CellState(separation, cells, nothing + 1, nothing, nothing), separation)

    def pressure(self, state: CellState) -> float:
        """Force over nominal area, Pa; negative in tension."""
        return float(np.sum(state.pressure)) / self.heights.size

    def area_fraction(self, state: CellState) -> float:
        """Contact area over nominal area."""
        return float(np.sum(self.area_of_cells(state))) / self.heights.size

    def area_of_cells(self, state: CellState) -> np.ndarray:
        """Contact area of every cell in contact, (k,), in cells: less than its fraction along the perimeter."""
        if self.adhesive:
            return reported_areas(state.fraction, state.around)
        return 1 - BEYOND_EDGES * edges(state.cells, self.space.grid)

    def gap(self, state: CellState) -> np.ndarray:
        """Gap at the nodes, (n, n), m; zero in contact, except for the extension of bonds."""
        displaced = self.space.displacement(state.cells, state.pressure / self.contact_modulus)
        return displaced * self.spacing + state.separation - self.heights

    def fractions(self, state: CellState) -> np.ndarray:
        """Fraction of every cell that is in contact, (n, n)."""
        return self.space.on_grid(state.cells, state.fraction)

    def mean_gap(self, state: CellState) -> float:
        """Mean gap over the nominal area, m: the mean separation, since pressures do not displace the mean plane."""
        return state.separation

    def spot_count(self, state: CellState) -> int:
        """Number of patches."""
        return labelled(state.cells, self.space.grid)[1]

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
        """Whether it is on an unstable branch: never, since what is found here is a minimum of energy."""
        return False

    def events_between(self, before: CellState, after: CellState) -> Events:
        """The events on the path from one state to a later one."""
        return Events.joined(after.history[len(before.history) :])

    # --- on the way -----------------------------------------------------------------------------------------------

    def _towards(self, state, separation):
        """The contact of a state, and if it is not far to a separation (m) what its rates make of it there."""
        contact = Contact(state.cells, state.fraction, state.pressure / self.contact_modulus)
        if state.rates is None:
            return contact
        way = (separation - state.separation) / self.spacing
        change = state.rates[0] * way
        if not np.abs(change).max() <= _NEAR:  # or no number
            return contact
        return contact.changed(change, state.rates[1] * way)

    def _at(self, state, separation, tolerance=FRONT_TOLERANCE, *, near=False, same_slopes=False):
        """The equilibrium at a separation, m; near: next to the state, same_slopes: and with its slopes."""
        if not self.adhesive:
            return self._pressed(state, separation=separation / self.spacing)
        cells, pending = settled(
            self.space,
            self.front,
            self.topography,
            self.summits,
            separation / self.spacing,
            self._towards(state, separation),
            tolerance,
            near=near,
        )
        closed = cells.gap.ravel()[cells.cells[cells.fraction >= 1]]
        new = CellState(
            separation,
            cells.cells,
            cells.fraction,
            cells.pressure * self.contact_modulus,
            cells.around,
            front_residual=front_residual(self.front, cells),
            gap_residual=max(np.abs(closed).max(initial=0.0), -cells.gap.min(initial=0.0)) * self.spacing,
            pending=pending,
        )
        if same_slopes and np.array_equal(new.cells, state.cells):
            return replace(new, pressure_slope=state.pressure_slope, area_slope=state.area_slope, rates=state.rates)
        return self._with_slopes(new, min(max(tolerance, FINE), COARSE))

    def _pressed(self, state, **given):
        """The equilibrium without adhesion at a separation (cells) or under a load (E*)."""
        contact = Contact(state.cells, state.fraction, state.pressure / self.contact_modulus)
        contact, gap, separation = pressed(self.space, self.topography, contact, **given)
        new = CellState(
            separation * self.spacing,
            contact.cells,
            contact.fraction,
            contact.pressure * self.contact_modulus,
            np.zeros(len(contact.cells)),
            gap_residual=max(np.abs(gap.ravel()[contact.cells]).max(initial=0.0), -gap.min()) * self.spacing,
        )
        return self._with_slopes(new, FINE)

    def _events(self, before, after):
        """The events between two states that follow each other."""
        return patch_events(before, after, self._set_free, self.summits.cell, self.space.grid, self.spacing)

    def _with_slopes(self, state, accuracy):
        """The state with the derivatives of pressure and area."""
        if not len(state.cells):
            return state
        fraction, pressure = tangent(self.space, self.front, state.cells, state.fraction, state.around, accuracy)
        cells = self.heights.size * self.spacing
        stiffer = float(np.sum(pressure)) * self.contact_modulus / cells
        if self.adhesive:
            wider = float(np.sum(reported_area_gradient(state.fraction, state.around) * fraction)) / cells
        else:
            # Cells come and go as wholes; in the mean the area grows about in proportion to the load.
            wider = self.area_fraction(state) * stiffer / self.pressure(state)
        return replace(state, pressure_slope=stiffer, area_slope=wider, rates=(fraction, pressure))

    def _energy_of_cells(self, state):
        """Elastic energy less that of adhesion of every cell in contact, (k,), J/m^2."""
        elastic = 0.5 * state.pressure * (self.heights.ravel()[state.cells] - state.separation)
        return elastic - self.law.material.surface_energy * adhesive_areas(state.fraction, state.around)

    def _set_free(self, state):
        """What every cell would set free if its patch jumped, J/m^2: without adhesion nothing jumps."""
        return self._energy_of_cells(state) if self.adhesive else np.zeros(len(state.cells))


@dataclass(frozen=True, eq=False)
class PatchObservables:
    """Observables of a contact of cells and of the surface that they are on, beyond those of every model."""

    contact: BoundaryElements
    surface: Surface

    def of_contact(self) -> dict:
        """What holds for all states."""
        return summit_counts(self.contact.asperities)

    def of_step(self, state: CellState) -> dict:
        """Residuals of the equilibrium, events so far, and how far Wu's formula is known to hold."""
        contact = self.contact
        touched = np.isin(contact.summits.cell, state.cells)
        verified = contact.law.is_jump_in_verified(contact.asperities.radius_of_curvature[touched])
        outside = np.count_nonzero(~verified) / max(len(verified), 1)
        events = Events.joined(state.history)
        counts = {
            name: events.count(kind)
            for name, kind in (
                ("jump_in_count", JUMP_IN),
                ("jump_off_count", JUMP_OFF),
                ("coalescence_count", COALESCENCE),
                ("split_count", SPLIT),
            )
        }
        return counts | {
            "residual": state.gap_residual / contact.rms_height,
            "front_residual": state.front_residual,
            "gap_residual": state.gap_residual / contact.rms_height,
            "pending_count": state.pending,
            "outside_wu_fraction": outside if contact.adhesive else 0.0,
        }

    def of_snapshot(self, state: CellState) -> dict:
        """Distributions of gap and pressure, the patches, and the map of contact and pressure."""
        cells = self.contact.area_of_cells(state)
        gap = self._gap_density(state, cells)
        pressure, mean = self._pressure_density(state, cells)
        on_grid = self.contact.space.on_grid
        return {
            "overlap_fraction": 0.0,
            "area_beyond_edges": 0.0,
            "gap_density": gap,
            "pressure_density": pressure,
            "pressure_bin_mean": mean,
            "contact_map": on_grid(state.cells, state.fraction, np.float32),
            "contact_pressure": on_grid(state.cells, state.pressure, np.float32),
            **self._patches(state, cells),
        }

    def reasons_against(self, separations: Iterable[float], pressed: CellState | None) -> list[str]:
        """The reason why cells do not stand for the surface: too few of them for its shortest waves."""
        asperities, grid = self.contact.asperities, self.surface.grid
        cells = cells_per_short_wave(grid, len(asperities) + len(asperities.unsupported_height))
        if cells >= LEAST_CELLS_PER_WAVE:
            return []
        return [f"about {cells:.2g} grid cells for the shortest waves (at least {LEAST_CELLS_PER_WAVE:g} expected)"]

    @property
    def largest_tension(self) -> float:
        """Tension of all summits pulling their most at once, Pa."""
        contact = self.contact
        return largest_tension(contact.asperities, contact.law.material.surface_energy, contact.area)

    def _gap_density(self, state, cells):
        """Density of the gap over the nominal area, outside contact: with the area, it is whole."""
        edges_of_bins = gap_bins(self.surface)
        gap = np.clip(self.contact.gap(state), 0.0, edges_of_bins[-1])
        outside = 1 - self.contact.space.on_grid(state.cells, cells)
        content, _ = np.histogram(gap, edges_of_bins, weights=outside)
        return content / gap.size / np.diff(edges_of_bins)

    def _pressure_density(self, state, cells):
        """Density of the pressure over the nominal area, and its mean in every bin; the pressure is the patches'."""
        edges_of_bins = PRESSURE_BINS * self.contact.pressure_unit
        # The force of a cell acts on the part of it that touches; what that is beside its area is the same everywhere.
        weight = state.fraction * (np.sum(cells) / (np.sum(state.fraction) or 1.0))
        pressure = state.pressure / weight
        counted = np.clip(pressure, edges_of_bins[0], edges_of_bins[-1])
        content, _ = np.histogram(counted, edges_of_bins, weights=weight)
        force, _ = np.histogram(counted, edges_of_bins, weights=weight * pressure)
        mean = np.divide(force, content, out=np.zeros(len(content)), where=content > 0)
        return content / self.contact.heights.size / np.diff(edges_of_bins), mean

    def _patches(self, state, cells):
        """Every patch: centre of area, area, perimeter, force, summits, and the curvature of the highest of them."""
        contact, h = self.contact, self.contact.spacing
        grid = contact.space.grid
        labels, count = labelled(state.cells, grid)

        def sums(weight):
            return np.bincount(labels, weight, count + 1)[1:]

        area = sums(cells) * h**2
        of_summit = labels_at(contact.summits.cell, state.cells, labels)
        order = np.argsort(contact.asperities.height, kind="stable")
        # A patch whose summits have been left is that of a cap of the surface's mean curvature.
        radius = np.full(count + 1, 1 / self.surface.rms_curvature)
        radius[of_summit[order]] = contact.asperities.radius_of_curvature[order]
        centre = centres(state.cells, grid, labels, count, state.fraction) * h
        return {
            "spot_x": centre[:, 0],
            "spot_y": centre[:, 1],
            "spot_radius": np.sqrt(area / np.pi),
            "spot_area": area,
            "spot_perimeter": np.pi / 4 * sums(edges(state.cells, grid)) * h,
            "spot_force": sums(state.pressure) * h**2,
            "spot_curvature_radius": radius[1:],
            "spot_members": np.bincount(of_summit, minlength=count + 1)[1:],
        }


def contact_of(surface: Surface, material: Material) -> BoundaryElements:
    """The contact of a surface and a material.

    Raises
    ------
    ValueError
        If the surface is a free square, or adhesion is lost in the rounding of its heights.
    """
    surface.require_periodic("a model of boundary elements")
    law, asperities, h = JKR(material), locate_summits(surface), surface.spacing
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
    space = HalfSpace.of(surface.grid)
    topography = Topography.of(surface.heights / h)
    return BoundaryElements(
        surface.heights, h, law, surface.rms_height, surface.rms_slope, asperities, space, topography, front, summits
    )


def resumable(contact: BoundaryElements, folder: pathlib.Path) -> Kept:
    """The contact with its equilibria kept in a folder, from which a path that was stopped resumes."""
    programs = [(name, version(name)) for name in ("icha", "numpy", "scipy")]
    others = repr((contact.spacing, contact.law.material, programs)).encode()
    of = hashlib.sha256(contact.heights.tobytes() + others).hexdigest()
    return Kept(contact, of[:32], folder, packed, unpacked)
