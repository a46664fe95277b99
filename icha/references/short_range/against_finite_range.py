"""Boundary elements in the limit of short range against those of Tamaas: without adhesion, and as its range falls."""

from collections.abc import Sequence

import numpy as np

from icha.asperity.material import Material
from icha.boundary_elements.contact import BoundaryElements
from icha.contact.model import PRESSURE, Control
from icha.references.finite_range import contact_state, perimeter_correction, states_at_mean_separations
from icha.references.short_range.rough_contacts import HARD, SOFT, followed
from icha.surfaces.surface import Surface


def without_adhesion(surface: Surface, reduced_pressures: Sequence[float]) -> list[dict]:
    """The same loads by Tamaas (minimisation over pressures) and by these boundary elements with no surface energy.

    gap_error: rms of the difference of the gaps over h_rms; the others are relative, areas those of nodes counted.
    """
    contact = BoundaryElements.of(surface, HARD)
    rows = []
    for p in reduced_pressures:
        theirs = contact_state(surface, HARD, p, tolerance=1e-10)
        load = p * surface.rms_slope * HARD.contact_modulus
        state = contact.equilibrium(contact.untouched(), theirs.mean_separation)
        state = contact.equilibrium(state, state.separation, Control(PRESSURE, load))
        gap = contact.gap(state)
        rows.append(
            {
                "grid": surface.grid,
                "reduced_pressure": p,
                "separation": state.separation / surface.rms_height,
                "separation_error": state.separation / theirs.mean_separation - 1,
                "gap_error": float(np.sqrt(np.mean((gap - theirs.gap) ** 2))) / surface.rms_height,
                "area": len(state.cells) / surface.grid**2,
                "area_error": len(state.cells) / np.count_nonzero(theirs.contact) - 1,
                "corrected_area_error": contact.area_fraction(state) / perimeter_correction(theirs.contact)[0] - 1,
            }
        )
    return rows


def towards_short_range(
    surface: Surface, separations: Sequence[float], lengths: Sequence[tuple[float, int]], surface_energy: float
) -> list[dict]:
    """Tamaas at given ranges (m), each on its refinement of the grid, and the limit, at falling separations (h_rms).

    The range of the limit's material, which counts for jumps into contact, is the shortest.
    """
    rows = []
    for length, refinement in lengths:
        material = Material(SOFT.contact_modulus, surface_energy, length)
        found = states_at_mean_separations(
            surface, material, [u * surface.rms_height for u in separations], refinement=refinement, tolerance=1e-6
        )
        for u, state in zip(separations, found, strict=True):
            rows.append(
                {
                    "range": length,
                    "grid": surface.grid * refinement,
                    "separation": u,
                    "pressure": state.nominal_pressure / (material.contact_modulus * surface.rms_slope),
                    "zero_gap_area": float(perimeter_correction(state.contact)[0]),
                    "energetic_area": float(state.energetic_area_fraction(material)),
                }
            )
    material = Material(SOFT.contact_modulus, surface_energy, min(length for length, _ in lengths))
    contact = BoundaryElements.of(surface, material)
    for u, state in zip(separations, followed(contact, separations), strict=True):
        rows.append(
            {
                "range": 0.0,
                "grid": surface.grid,
                "separation": u,
                "pressure": contact.pressure(state) / (material.contact_modulus * surface.rms_slope),
                "zero_gap_area": contact.area_fraction(state),
                "energetic_area": contact.area_fraction(state),
            }
        )
    return rows
