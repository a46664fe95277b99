"""Boundary elements in the limit of short range on rough surfaces: against themselves, and against those of Tamaas.

The surfaces are self-affine; lengths in m, pressures in Pa. Every function returns rows of numbers, dictionaries that
JSON can hold.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from icha.asperity.material import Material
from icha.boundary_elements.contact import BoundaryElements, contact_of
from icha.contact.model import PRESSURE, Control
from icha.path.follow import follow
from icha.path.targets import Path
from icha.references.finite_range import contact_state, perimeter_correction
from icha.surfaces.spectrum import SelfAffineSpectrum
from icha.surfaces.surface import Surface
from validation.mean_gaps import states_at_mean_separations

# The paper's: dgamma/E* = 2 nm.
SOFT = Material(25e6, 0.05, 2.071e-9)
HARD = Material(25e6, 0.0, 2.071e-9)
# Longest step of the separation on the way to a stop, in h_rms.
_STEP = 0.1


def rough(grid: int, waves: int = 16, cells_per_wave: int = 8, seed: int = 1) -> Surface:
    """A rough surface with so many of the shortest waves along its side of 100 um, rolling off at a fifth of that.

    grid : nodes along a side, at least waves * cells_per_wave; more are a finer grid under the same waves.
    """
    spectrum = SelfAffineSpectrum(100e-6, 20e-6, 100e-6 / waves, 0.8, 1.0)
    coarse = spectrum.realise(waves * cells_per_wave, seed)
    return coarse.refined(grid // coarse.grid)


def followed(contact: BoundaryElements, separations: Iterable[float], step: float = _STEP, state=None):
    """States at given separations, from `state` or from first contact, by steps of at most `step`; both in h_rms."""
    unit = contact.rms_height
    state = contact.untouched() if state is None else state
    for separation in separations:
        way = separation * unit - state.separation
        count = max(1, int(np.ceil(abs(way) / (step * unit) - 1e-9)))
        start = state.separation
        for k in range(1, count + 1):
            state = contact.equilibrium(state, start + way * k / count)
        yield state


def by_cells_per_wave(
    waves: int, cells: Sequence[int], separations: Sequence[float], material: Material = SOFT, seed: int = 1
) -> list[dict]:
    """One surface on finer and finer grids, at falling separations (h_rms)."""
    coarse = rough(waves * min(cells), waves, min(cells), seed)
    rows = []
    for count in cells:
        surface = coarse.refined(count // min(cells))
        contact = contact_of(surface, material)
        for separation, state in zip(separations, followed(contact, separations), strict=True):
            rows.append(
                {
                    "cells": count,
                    "grid": surface.grid,
                    "separation": separation,
                    "reduced_pressure": contact.pressure(state) / (material.contact_modulus * coarse.rms_slope),
                    "area": contact.area_fraction(state),
                    "patches": contact.spot_count(state),
                }
            )
    return rows


def symmetries(surface: Surface, separation: float, material: Material = SOFT) -> list[dict]:
    """The surface shifted, reflected and turned by 90 degrees, against itself, at a separation (h_rms)."""
    turns = {
        "shifted by 7 and 3 cells": (lambda h: np.roll(h, (7, 3), (0, 1))),
        "reflected": (lambda h: h[:, ::-1]),
        "turned by 90 degrees": (lambda h: np.rot90(h)),
        "turned and reflected": (lambda h: h.T),
    }

    def solved(heights):
        contact = contact_of(Surface(heights, surface.period), material)
        (state,) = followed(contact, [separation])
        return contact.pressure(state), contact.area_fraction(state), contact.fractions(state)

    pressure, area, fraction = solved(surface.heights)
    rows = []
    for name, turn in turns.items():
        turned = solved(np.ascontiguousarray(turn(surface.heights)))
        rows.append(
            {
                "what": name,
                "pressure_error": turned[0] / pressure - 1,
                "area_error": turned[1] / area - 1,
                "fraction_error": float(np.abs(turned[2] - turn(fraction)).max()),
            }
        )
    return rows


def by_steps(
    surface: Surface, separation: float, counts: Sequence[int], material: Material = SOFT, first: float = 3.0
) -> list[dict]:
    """A stop (h_rms) reached in so many equal steps from a separation `first`, against the most of them."""
    contact = contact_of(surface, material)
    unit, found = surface.rms_height, {}
    for count in sorted(counts, reverse=True):
        state = contact.untouched()
        for u in np.linspace(first, separation, count + 1):
            state = contact.equilibrium(state, u * unit)
        found[count] = state
    best = found[max(counts)]
    return [
        {
            "steps": count,
            "pressure_error": contact.pressure(state) / contact.pressure(best) - 1,
            "area_error": contact.area_fraction(state) / contact.area_fraction(best) - 1,
            "fraction_error": float(np.abs(contact.fractions(state) - contact.fractions(best)).max()),
        }
        for count, state in found.items()
    ]


def loop(surface: Surface, largest_pressure: float, step: float, material: Material = SOFT) -> dict:
    """In to a reduced pressure and out until apart, by steps of at most `step` h_rms: work and where it went.

    Energies over dgamma, or over E* h_rms without adhesion; not_closed: work less all losses at the end, which is zero.
    """
    contact = contact_of(surface, material)
    path = Path(reduced_pressures=[largest_pressure], unload=True, max_step=step, snapshots=[])
    unit = material.surface_energy or material.contact_modulus * surface.rms_height
    most, steps = 0.0, 0
    for waypoint in follow(contact, path):
        balance, steps = waypoint.balance, steps + 1
        most = max(most, balance.work)
    parts = ("jump_in", "jump_off", "coalescence", "load_jump", "unattributed")
    return {
        "grid": surface.grid,
        "step": step,
        "steps": steps,
        "largest_work": most / unit,
        "work": balance.work / unit,
        "not_closed": (balance.work - balance.loss - contact.stored_energy(waypoint.state)) / unit,
        **{part: getattr(balance, part) / unit for part in parts},
    }


def without_adhesion(surface: Surface, reduced_pressures: Sequence[float]) -> list[dict]:
    """The same loads by Tamaas (minimisation over pressures) and by these boundary elements with no surface energy.

    gap_error: rms of the difference of the gaps over h_rms; the others are relative, areas those of nodes counted.
    """
    contact = contact_of(surface, HARD)
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
                "separation_error": state.separation / theirs.mean_separation - 1,
                "gap_error": float(np.sqrt(np.mean((gap - theirs.gap) ** 2))) / surface.rms_height,
                "area_error": len(state.cells) / np.count_nonzero(theirs.contact) - 1,
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
    contact = contact_of(surface, material)
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
