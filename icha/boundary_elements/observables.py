"""Observables of the boundary elements: residuals, contact patches, maps, distributions of gap and pressure."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull

from icha.boundary_elements.patches import CellState, edge_lengths, label_patches, labels_at, patch_centres
from icha.contact.model import PRESSURE_BINS, gap_bins
from icha.surfaces.resolution import NYQUIST_CELLS, resolution_of
from icha.surfaces.surface import Surface

if TYPE_CHECKING:
    from icha.boundary_elements.contact import BoundaryElements


@dataclass(frozen=True, eq=False)
class PatchObservables:
    """Values that the results record for a state of the boundary elements (an `icha.contact.model.Observables`)."""

    contact: BoundaryElements
    surface: Surface

    def of_contact(self) -> dict:
        """Return the tension at which a cell at a straight edge opens, Pa."""
        return {"resolved_tension": self.contact.resolved_tension}

    def of_step(self, state: CellState) -> dict:
        """Return residuals, number of pending cells, and share of summits in contact outside Wu's verified range."""
        contact = self.contact
        touched = np.isin(contact.summit_cells, state.cells)
        verified = contact.law.is_jump_in_verified(contact.asperities.radius_of_curvature[touched])
        outside = np.count_nonzero(~verified) / max(len(verified), 1) if contact.divides_cells else 0.0
        # Every model has the first residual, "residual". In this model it is the residual of the gap.
        return {
            "residual": state.gap_residual / contact.rms_height,
            "front_residual": state.residual,
            "gap_residual": state.gap_residual / contact.rms_height,
            "pending_count": state.pending,
            "layer_compression": self._layer_compression(state),
            "outside_wu_fraction": outside,
            "energetic_area_fraction": contact.energetic_area_fraction(state),
            **(self._extent(state) if self.surface.free else {}),
        }

    def _extent(self, state):
        """Return the radius of the convex hull of the cells in contact, m, and the share of contact at the edge."""
        state = self.contact.in_contact(state)
        areas, at_edge = self.contact.area_of_cells(state), self.contact.at_edge(state)
        # A front is several cells wide, so only cells count that are mostly in contact.
        inside = state.cells[areas >= min(0.5, areas.max(initial=0.0))]
        return {
            "hull_radius": math.sqrt(hull_area(inside, self.contact.space.grid) / np.pi) * self.contact.spacing,
            "edge_contact": float(np.sum(areas[at_edge]) / (np.sum(areas) or 1.0)),
        }

    def _layer_compression(self, state):
        """Return the mean displacement of a periodic layer by the nominal pressure, m; 0 otherwise."""
        contact = self.contact
        if not contact.space.layer or self.surface.free:
            return 0.0
        reduced = contact.pressure(state) / contact.contact_modulus
        return reduced * contact.space.layer.uniform_compliance * contact.spacing

    def of_snapshot(self, state: CellState) -> dict:
        """Return the distributions of gap and pressure, properties of each patch, and maps of the cells."""
        areas, gap = self.contact.area_of_cells(state), self.contact.gap(state)
        pressure, mean = self._pressure_density(state, areas)

        def field(values):
            return self.contact.crop(self.contact.field(state.cells, values.astype(np.float32)))

        return {
            "overlap_fraction": 0.0,
            "area_beyond_edges": 0.0,
            "gap_density": self._gap_density(gap, state, areas),
            "pressure_density": pressure,
            "pressure_bin_mean": mean,
            "contact_map": field(np.where(areas > 0, state.fraction, 0.0)),
            "contact_pressure": field(state.pressure),
            "gap_map": np.maximum(gap, 0.0).astype(np.float32),
            "displacement_map": self.contact.displacement(state).astype(np.float32),
            **self._patches(state, areas),
        }

    def reasons_against(self, separations: Iterable[float], pressed: CellState | None) -> list[str]:
        """Return reasons against the results: too few grid cells for the shortest waves. The arguments are not used."""
        resolution = resolution_of(self.surface)
        if resolution.representable:
            return []
        return [f"{resolution} (at least {NYQUIST_CELLS} expected)"]

    def _gap_density(self, gap, state, areas):
        """Return the probability density of the gap outside contact; its integral plus the area fraction is one."""
        edges_of_bins = gap_bins(self.surface)
        gap = np.clip(gap, 0.0, edges_of_bins[-1])
        outside = 1 - self.contact.crop(self.contact.field(state.cells, areas))
        content, _ = np.histogram(gap, edges_of_bins, weights=outside)
        return content / gap.size / np.diff(edges_of_bins)

    def _pressure_density(self, state, areas):
        """Return the density of the pressure, and the mean pressure of each bin.

        At a finite range, it contains the tension on cells that attract across a gap.
        """
        edges_of_bins = PRESSURE_BINS * self.contact.pressure_unit
        # The force on a cell acts on its fraction in contact. One factor scales all fractions to the contact area.
        # Tension across a gap acts on the whole cell.
        touching = areas > 0
        scale = np.sum(areas) / (np.sum(state.fraction[touching]) or 1.0)
        weight = np.where(touching, scale * state.fraction, 1.0)
        pressure = state.pressure / weight
        counted = np.clip(pressure, edges_of_bins[0], edges_of_bins[-1])
        content, _ = np.histogram(counted, edges_of_bins, weights=weight)
        force, _ = np.histogram(counted, edges_of_bins, weights=weight * pressure)
        mean = np.divide(force, content, out=np.zeros(len(content)), where=content > 0)
        return content / self.contact.count / np.diff(edges_of_bins), mean

    def _patches(self, state, areas):
        """Return position, area, perimeter, force, number of summits and radius of the highest summit of each patch."""
        contact, h = self.contact, self.contact.spacing
        grid, state, areas = contact.space.grid, contact.in_contact(state), areas[areas > 0]
        labels, count = label_patches(state.cells, grid)

        def sums(weight):
            return np.bincount(labels, weight, count + 1)[1:]

        area, share = sums(areas) * h**2, sums(areas) / grid**2
        # On a periodic square, no edge of an area is shorter than that of a circle, a circular hole, or a stripe.
        shortest = grid * np.minimum(2 * np.sqrt(np.pi * np.minimum(share, 1 - share)), 2)
        of_summit = labels_at(contact.summit_cells, state.cells, labels)
        order = np.argsort(contact.asperities.height, kind="stable")
        # A patch without a summit gets the radius of the rms curvature of the surface.
        radius = np.full(count + 1, self.surface.summit_radius)
        radius[of_summit[order]] = contact.asperities.radius_of_curvature[order]
        centre = patch_centres(state.cells, grid, labels, count, state.fraction) * h
        return {
            "spot_x": centre[:, 0],
            "spot_y": centre[:, 1],
            "spot_radius": np.sqrt(area / np.pi),
            "spot_area": area,
            "spot_perimeter": np.maximum(edge_lengths(state.cells, areas, grid, labels, count), shortest) * h,
            "spot_force": sums(state.pressure) * h**2,
            "spot_curvature_radius": radius[1:],
            "spot_members": np.bincount(of_summit, minlength=count + 1)[1:],
        }


def hull_area(cells: np.ndarray, grid: int) -> float:
    """Return the area of the convex hull of some cells of a grid that is not periodic, in cells; 0 without cells."""
    if not len(cells):
        return 0.0
    row, column = np.divmod(cells, grid)
    rows, first = np.unique(row, return_index=True)
    # Only the first and the last cell of each row can be at the hull; cells are in ascending order.
    left, right = column[first], column[np.append(first[1:], len(cells)) - 1] + 1
    corners = [np.column_stack([at, rows + side]) for at in (left, right) for side in (0, 1)]
    return float(ConvexHull(np.concatenate(corners)).volume)
