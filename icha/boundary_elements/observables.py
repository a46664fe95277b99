"""Observables of boundary elements: what a run's dataset has of their states, by the names of its variables."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from icha.boundary_elements.contact import BoundaryElements
from icha.boundary_elements.patches import centres, edges, labelled, labels_at
from icha.boundary_elements.states import CellState
from icha.contact.bins import PRESSURE_BINS, gap_bins
from icha.contact.events import COALESCENCE, JUMP_IN, JUMP_OFF, SPLIT, Events
from icha.contact.observables import summit_counts
from icha.surfaces.surface import Surface


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

    def reasons_against(self, separations: Iterable[float]) -> list[str]:
        """No reasons: the cells are the surface itself."""
        return []

    @property
    def largest_tension(self) -> float:
        """Tension of all asperities pulling their most at once, 3/2 pi dgamma sum(R)/A0, Pa."""
        sum_of_radii = float(np.sum(self.contact.asperities.radius_of_curvature))
        return 1.5 * np.pi * self.contact.law.material.surface_energy * sum_of_radii / self.contact.area

    def _gap_density(self, state, cells):
        """Density of the gap over the nominal area, outside contact: with the area, it is whole."""
        edges_of_bins = gap_bins(self.surface)
        gap = np.clip(self.contact.gap(state), 0.0, edges_of_bins[-1])
        outside = 1 - self.contact.space.on_grid(state.cells, cells)
        content, _ = np.histogram(gap, edges_of_bins, weights=outside)
        return content / gap.size / np.diff(edges_of_bins)

    def _pressure_density(self, state, cells):
        """Density of the pressure over the nominal area, and its mean in every bin; the pressure is the patches'."""
        edges_of_bins = PRESSURE_BINS * (self.contact.contact_modulus * self.surface.rms_slope)
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
