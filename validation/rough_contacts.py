"""Boundary elements on rough surfaces: against themselves, and without adhesion against Tamaas.

The surfaces are self-affine; lengths in m, pressures in Pa. The functions give rows, dictionaries of numbers for JSON.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from icha.asperity.material import Material
from icha.boundary_elements.contact import BoundaryElements, contact_of
from icha.contact.model import PRESSURE, Control
from icha.path.follow import follow
from icha.path.targets import Path
from icha.surfaces.spectrum import SelfAffineSpectrum
from icha.surfaces.surface import Surface

# The material of the paper, dgamma/E* = 2 nm, and the same without adhesion.
SOFT = Material(25e6, 0.05, 2.071e-9)
HARD = Material(25e6, 0.0, 2.071e-9)
# Longest step of the separation, in h_rms.
_STEP = 0.1


def rough(grid: int, waves: int = 16, cells_per_wave: int = 8, seed: int = 1) -> Surface:
    """Return a rough surface with a side of 100 um and a roll-off at 20 um.

    Parameters
    ----------
    grid : nodes along a side, a multiple of waves * cells_per_wave; the waves do not depend on it.
    waves : number of shortest waves along a side.
    cells_per_wave : cells per shortest wave of the grid on which the surface is realised.
    """
    spectrum = SelfAffineSpectrum(100e-6, 20e-6, 100e-6 / waves, 0.8, 1.0)
    coarse = spectrum.realise(waves * cells_per_wave, seed)
    return coarse.refined(grid // coarse.grid)


def states_at(contact: BoundaryElements, separations: Iterable[float]):
    """Yield the states at given separations (h_rms), from first contact on."""
    unit, state = contact.rms_height, contact.untouched()
    for separation in separations:
        start, distance = state.separation, separation * unit - state.separation
        count = max(1, int(np.ceil(abs(distance) / (_STEP * unit) - 1e-9)))
        for k in range(1, count + 1):
            state = contact.equilibrium(state, start + distance * k / count)
        yield state


def _rows_at(surface, material, separations, rms_slope):
    """Yield loads, areas and patches at falling separations (h_rms) as rows."""
    contact = contact_of(surface, material)
    for separation, state in zip(separations, states_at(contact, separations), strict=True):
        yield {
            "grid": surface.grid,
            "separation": separation,
            "reduced_pressure": contact.pressure(state) / (material.contact_modulus * rms_slope),
            "area": contact.area_fraction(state),
            "energetic_area": contact.energetic_area_fraction(state),
            "patches": contact.spot_count(state),
        }


def by_cells_per_wave(waves: int, cells: Sequence[int], separations: Sequence[float]) -> Iterator[dict]:
    """Solve one surface on several grids at falling separations (h_rms)."""
    coarse = rough(waves * min(cells), waves, min(cells))
    for count in cells:
        for row in _rows_at(coarse.refined(count // min(cells)), SOFT, separations, coarse.rms_slope):
            yield row | {"cells": count}


def towards_short_range(
    surface: Surface, separations: Sequence[float], lengths: Sequence[tuple[float, int]], surface_energy: float
) -> Iterator[dict]:
    """Solve falling separations (h_rms) at given ranges (m) on refined grids that resolve them, and in the limit.

    Each range has its refinement. The limit has the shortest range, on the grid of the surface.
    """
    for length, refinement in (*lengths, (0.0, 1)):
        reach = length or min(length for length, _ in lengths)
        material = Material(SOFT.contact_modulus, surface_energy, reach)
        for row in _rows_at(surface.refined(refinement), material, separations, surface.rms_slope):
            # In the limit, both areas are equal.
            yield row | {"range": length, "energetic_area": row["energetic_area" if length else "area"]}


def symmetries(surface: Surface, separation: float, material: Material = SOFT) -> Iterator[dict]:
    """Compare the surface shifted, reflected and turned by 90 degrees with itself at a separation (h_rms)."""
    turns = {
        "shifted by 7 and 3 cells": (lambda h: np.roll(h, (7, 3), (0, 1))),
        "reflected": (lambda h: h[:, ::-1]),
        "turned by 90 degrees": np.rot90,
        "turned and reflected": (lambda h: h.T),
    }

    def solved(heights):
        contact = contact_of(Surface(np.ascontiguousarray(heights), surface.period), material)
        (state,) = states_at(contact, [separation])
        return contact.pressure(state), contact.area_fraction(state), contact.fractions(state)

    pressure, area, fraction = solved(surface.heights)
    for name, turn in turns.items():
        yield {"what": name} | _differences(solved(turn(surface.heights)), (pressure, area, turn(fraction)))


def by_steps(surface: Surface, separation: float, counts: Sequence[int]) -> list[dict]:
    """Reach a separation from 3 (both h_rms) in several numbers of steps, and compare with the largest number."""
    contact, found = contact_of(surface, SOFT), {}
    for count in sorted(counts, reverse=True):
        state = contact.untouched()
        for u in np.linspace(3.0, separation, count + 1):
            state = contact.equilibrium(state, u * surface.rms_height)
        found[count] = contact.pressure(state), contact.area_fraction(state), contact.fractions(state)
    return [{"steps": count} | _differences(each, found[max(counts)]) for count, each in found.items()]


def _differences(found, best):
    """Return differences of pressure and area, relative, and the largest difference of the fractions of contact."""
    errors = {"pressure_error": found[0] / best[0] - 1, "area_error": found[1] / best[1] - 1}
    return errors | {"fraction_error": float(np.abs(found[2] - best[2]).max())}


def loop(surface: Surface, largest_pressure: float, step: float, material: Material = SOFT) -> dict:
    """Load to a reduced pressure and unload, by steps of at most `step` h_rms: work and losses.

    Energies are over dgamma, or over E* h_rms without adhesion. `not_closed` is the work minus all losses at the end,
    which should be zero.
    """
    contact = contact_of(surface, material)
    path = Path(reduced_pressures=[largest_pressure], unload=True, max_step=step, snapshots=[])
    unit = material.surface_energy or material.contact_modulus * surface.rms_height
    largest_work, steps = 0.0, 0
    for waypoint in follow(contact, path):
        balance, steps = waypoint.balance, steps + 1
        largest_work = max(largest_work, balance.work)
    names = ("jump_in", "jump_off", "coalescence", "load_jump", "unattributed")
    losses = {name: getattr(balance, name) for name in names}
    return {
        "grid": surface.grid,
        "adhesion": material.surface_energy > 0,
        "step": step,
        "steps": steps,
        "largest_work": largest_work / unit,
        "work": balance.work / unit,
        "not_closed": (balance.work - sum(losses.values()) - contact.stored_energy(waypoint.state)) / unit,
        **{name: loss / unit for name, loss in losses.items()},
    }


def without_adhesion(surface: Surface, reduced_pressures: Sequence[float]) -> Iterator[dict]:
    """Compare with Tamaas (minimisation over pressures) at the same loads, without surface energy.

    `gap_error` is the rms difference of the gaps over h_rms; areas are counts of nodes.
    """
    from validation.tamaas_oracle import contact_at_load  # needs Tamaas

    contact = contact_of(surface, HARD)
    for p in reduced_pressures:
        load = p * surface.rms_slope * HARD.contact_modulus
        theirs = contact_at_load(surface, HARD, load, 1e-10)
        separation = float(theirs.gap.mean())
        state = contact.equilibrium(contact.untouched(), separation)
        state = contact.equilibrium(state, separation, Control(PRESSURE, load))
        gap = contact.gap(state)
        yield {
            "grid": surface.grid,
            "reduced_pressure": p,
            "separation_error": state.separation / separation - 1,
            "gap_error": float(np.sqrt(np.mean((gap - theirs.gap) ** 2))) / surface.rms_height,
            "area_error": len(state.cells) / np.count_nonzero(theirs.traction > 0) - 1,
        }
