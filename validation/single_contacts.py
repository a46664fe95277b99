"""Boundary elements in the limit of short range against closed forms: spheres, punches, waves, cracks, pairs.

Units: E* = 1 Pa and dgamma = 1 J/m^2; spheres have radius 1 m, so that lengths are in (dgamma^2 R/E*^2)^(1/3). The
functions give rows, dictionaries of numbers for JSON. Errors are ratios minus one unless their description differs.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.boundary_elements.contact import BoundaryElements, contact_of
from icha.contact.model import PRESSURE, Control, FullContact
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.references.indentation import punch_pull_off
from icha.surfaces.summits import find_summits
from validation.closed_forms import CrackInTrough, Sinusoid, SphereInCell, punch_displacement
from validation.surfaces import bump, punch, two_bumps, wave

# Tabor parameter 5: the range affects only the jump into contact.
MATERIAL = Material(1.0, 1.0, 0.2)
_PERIOD = 12.0
_PULL_OFF = 1.5 * math.pi
# Approaches of a sphere (m) from a strong contact to just before jump-off.
APPROACHES = (3.0, 2.0, 1.0, 0.0, -0.6, -1.0, -1.2)


def disc(grid: int, period: float, radius: float, offset=(0.0, 0.0)) -> np.ndarray:
    """Return the nodes (n, n) within a radius (m) of the centre, which is shifted by (x, y) cells from the middle."""
    x, y = ((np.arange(grid) - grid // 2 - shift) * period / grid for shift in offset)
    return np.hypot(y[:, None], x) <= radius


def force_and_area(contact: BoundaryElements, state) -> tuple[float, float]:
    """Return force (N) and area (m^2) of a state."""
    return contact.pressure(state) * contact.area, contact.area_fraction(state) * contact.area


def _sphere(grid, offset, approach):
    """Return contact, closed form, height of the summit (m) and state of a sphere at an approach, m."""
    surface, top = bump(grid, _PERIOD, offset)
    contact, exact = contact_of(surface, MATERIAL), SphereInCell(MATERIAL, 1.0, _PERIOD)
    region = disc(grid, _PERIOD, exact.contact_radius(approach), offset)
    return contact, exact, top, contact.relax_region(region, top - approach)


def sphere_loop(grid: int, offset=(0.0, 0.0)) -> Iterator[dict]:
    """Unload a sphere from a strong contact and load it again, at the same approaches.

    `cells` is the contact radius of the closed form in cells.
    """
    contact, exact, top, state = _sphere(grid, offset, APPROACHES[0])
    unloading, loading = (("unloading", one) for one in APPROACHES), (("loading", one) for one in APPROACHES[-2::-1])
    for branch, approach in (*unloading, *loading):
        state = contact.equilibrium(state, top - approach)
        force, area = force_and_area(contact, state)
        radius = exact.contact_radius(approach)
        wanted = float(exact.force(radius))
        yield {
            "grid": grid,
            "offset": list(offset),
            "branch": branch,
            "approach": approach,
            "cells": radius / contact.spacing,
            "area_error": area / (math.pi * radius**2) - 1,
            "force_error": (force - wanted) / max(abs(wanted), _PULL_OFF),
        }


def sphere_under_load(grid: int, offset=(0.0, 0.0), forces: Sequence[float] = (8.0, 4.0, 0.0, -4.0)) -> Iterator[dict]:
    """Unload a sphere under given forces (N, falling); the error of the approach is over the unit of length."""
    exact = SphereInCell(MATERIAL, 1.0, _PERIOD)
    contact, _, top, state = _sphere(grid, offset, float(exact.approach(exact.loaded_radius(forces[0]))))
    for force in forces:
        state = contact.equilibrium(state, state.separation, Control(PRESSURE, force / contact.area))
        radius = exact.loaded_radius(force)
        yield {
            "grid": grid,
            "offset": list(offset),
            "force": force,
            "cells": radius / contact.spacing,
            "area_error": force_and_area(contact, state)[1] / (math.pi * radius**2) - 1,
            "approach_error": top - state.separation - float(exact.approach(radius)),
        }


def largest_tension(contact: BoundaryElements, state, step: float) -> tuple[float, object]:
    """Return the largest tension (N) of an unloading by steps (m), and its last state in contact.

    The maximum is that of the parabola through the largest tension and its neighbours. At the end of contact the step
    is halved down to a hundredth.
    """
    states, shortest = [state], step / 100
    while step >= shortest:
        new = contact.equilibrium(states[-1], states[-1].separation + step)
        if contact.spot_count(new):
            states.append(new)
        else:
            step /= 2
    tension = -np.array([force_and_area(contact, one)[0] for one in states])
    u = np.array([one.separation for one in states])
    k = int(np.argmax(tension))
    if not 0 < k < len(states) - 1:
        return float(tension[k]), states[-1]
    bend, slope, _ = np.polyfit(u[k - 1 : k + 2] - u[k], tension[k - 1 : k + 2], 2)
    return float(tension[k] - slope**2 / (4 * bend)), states[-1]


def sphere_pull_off(grid: int, offset=(0.0, 0.0), step: float = 0.05) -> dict:
    """Pull-off of a sphere, and the approach at jump-off, by steps of the approach (m)."""
    contact, exact, top, state = _sphere(grid, offset, -0.5)
    force, last = largest_tension(contact, state, step)
    return {
        "grid": grid,
        "offset": list(offset),
        "cells": exact.loaded_radius(-0.999999 * exact.pull_off_force) / contact.spacing,
        "pull_off_error": force / exact.pull_off_force - 1,
        "jump_off_approach": top - last.separation,
        "jump_off_approach_exact": float(exact.approach(exact.jump_off_radius)),
        "jump_off_cells": exact.jump_off_radius / contact.spacing,
    }


def sphere_jump_in(grid: int, range_: float = MATERIAL.interaction_range) -> dict:
    """Approach of a sphere at jump-in against Wu's distance, and force and area of the contact after it."""
    material = Material(1.0, 1.0, range_)
    surface, top = bump(grid, _PERIOD)
    contact, exact = contact_of(surface, material), SphereInCell(material, 1.0, _PERIOD)
    wu = float(JKR(material).jump_in_approach(1.0))
    start = contact.untouched()
    before = contact.equilibrium(start, top - wu + 1e-6)
    after = contact.equilibrium(start, top - wu - 1e-6)
    force, area = force_and_area(contact, after)
    radius = exact.contact_radius(wu)
    return {
        "grid": grid,
        "range": range_,
        "approach": top - start.separation,
        "approach_exact": wu,
        "spots_before": contact.spot_count(before),
        "spots_after": contact.spot_count(after),
        "area_error": area / (math.pi * radius**2) - 1,
        "force_error": (force - float(exact.force(radius))) / _PULL_OFF,
    }


def ellipse(grid: int, angle: float, approaches: Sequence[float] = (2.0, 1.0, 0.0)) -> list[dict]:
    """Return an elliptic paraboloid with radii of curvature sqrt(1/2) and sqrt(2), turned by an angle (degrees)."""
    radii = (math.sqrt(2), math.sqrt(1 / 2))
    surface, top = bump(grid, _PERIOD, (0.3, 0.1), radii, math.radians(angle))
    contact = contact_of(surface, MATERIAL)
    start = SphereInCell(MATERIAL, 1.0, _PERIOD).contact_radius(approaches[0])
    state = contact.relax_region(disc(grid, _PERIOD, start), top - approaches[0])
    rows = []
    for approach in approaches:
        state = contact.equilibrium(state, top - approach)
        force, area = force_and_area(contact, state)
        rows.append({"grid": grid, "angle": angle, "approach": approach, "force": force, "area": area})
    tension, _ = largest_tension(contact, state, 0.1)
    return [row | {"pull_off": tension, "spacing": surface.spacing} for row in rows]


def flat_punch(grid: int, cells: float, square: bool = False) -> dict:
    """Pull-off of a flat punch with a radius, or half side, in cells, and the compliance of its unbroken contact.

    Both are over the closed form of a round punch; for a square punch this is that of the inscribed circle.
    """
    spacing = _PERIOD / grid
    radius = cells * spacing
    pull_off = -float(punch_pull_off(radius, 1.0, 1.0).force)
    let_go = punch_displacement(MATERIAL, radius, pull_off, _PERIOD)
    surface, face = punch(grid, _PERIOD, radius, 10 * let_go, square)
    contact = contact_of(surface, MATERIAL)
    state = contact.relax_region(face, float(surface.heights.max()) + 0.02 * let_go)
    compliance = 0.02 * let_go / -force_and_area(contact, state)[0]
    tension, _ = largest_tension(contact, state, 0.1 * let_go)
    nodes = math.sqrt(np.count_nonzero(face) / math.pi) * spacing
    return {
        "grid": grid,
        "cells": cells,
        "square": square,
        "pull_off": tension / pull_off,
        "pull_off_of_nodes": tension / -float(punch_pull_off(nodes, 1.0, 1.0).force),
        "compliance": compliance / punch_displacement(MATERIAL, radius, 1.0, _PERIOD),
    }


def sinusoid(grid: int, alpha: float, psi: Sequence[float] = (0.3, 0.5, 0.8, 1.1, 1.3)) -> Iterator[dict]:
    """Load and unload a wave in one dimension at the separations of given psi = pi a/L.

    `alpha` is Johnson's parameter. The error of the pressure is over that of full contact, the error of the energy over
    the elastic energy of full contact.
    """
    period = 1.0
    amplitude = 0.02
    energy = (alpha * math.pi * amplitude) ** 2 / 2
    material = Material(1.0, energy, 1e-4 * amplitude)
    exact = Sinusoid(material, amplitude, period)
    contact = contact_of(wave(grid, period, amplitude), material)
    x = (np.arange(grid) - grid // 2) / grid
    start = np.broadcast_to(np.abs(x) <= psi[0] / math.pi, (grid, grid))
    state = contact.relax_region(start, float(exact.separation(psi[0])))
    unit = exact.full_contact_pressure
    for branch, one in (*(("loading", one) for one in psi), *(("unloading", one) for one in psi[-2::-1])):
        try:
            state = contact.equilibrium(state, float(exact.separation(one)))
        except FullContact:  # a coarse grid cannot hold the last narrow gap
            return
        wanted = float(exact.pressure(one))
        yield {
            "grid": grid,
            "alpha": alpha,
            "branch": branch,
            "psi": one,
            "cells": one * grid / math.pi,
            "width_error": contact.area_fraction(state) / (2 * one / math.pi) - 1,
            "pressure": contact.pressure(state) / unit,
            "pressure_exact": wanted / unit,
            "pressure_error": (contact.pressure(state) - wanted) / unit,
            "energy_error": (contact.stored_energy(state) - float(exact.stored_energy(one))) / (unit * amplitude / 4),
        }


def crack(grid: int, radii: Sequence[float] = (0.2, 0.16, 0.12), amplitude: float = 0.02) -> Iterator[dict]:
    """Return the last gap in the trough of a wave in two dimensions, at given radii over the period (falling).

    Errors of the pressure are over that of full contact at the trough.
    """
    material = Material(1.0, (0.3 * math.pi * amplitude) ** 2 / 2, 1e-4 * amplitude)
    exact = CrackInTrough(material, amplitude, 1.0)
    contact = contact_of(wave(grid, 1.0, amplitude, dimensions=2), material)
    x = np.minimum(np.arange(grid), grid - np.arange(grid)) / grid  # from the trough, at the cell's corner
    distance = np.hypot(x[:, None], x)
    state = contact.relax_region(distance > radii[0], exact.separation(radii[0]))
    for c in radii:
        state = contact.equilibrium(state, exact.separation(c))
        area = 1 - contact.area_fraction(state)
        yield {
            "grid": grid,
            "radius": c,
            "cells": c * grid,
            "radius_error": math.sqrt(area / math.pi) / c - 1 if area > 0 else -1.0,
            "pressure": contact.pressure(state) / exact.tearing,
            "pressure_error": (contact.pressure(state) - exact.pressure(c)) / exact.tearing,
        }


def pair(grid: int, distance: float = 6.0, approaches: Sequence[float] = (1.5, 0.5, -0.5)) -> Iterator[dict]:
    """Two equal spheres against the asperity model, which is exact if they are far apart.

    `asymmetry` is the largest difference between the fractions of one spot and the mirror image of the other.
    """
    period = 2 * _PERIOD
    surface, top = two_bumps(grid, period, distance)
    contact = contact_of(surface, MATERIAL)
    asperities = InteractingAsperities(JKR(MATERIAL), find_summits(surface), surface.rms_height)
    radius = float(JKR(MATERIAL).contact_radius(approaches[0], 1.0))
    half = distance / 2 / surface.spacing
    region = disc(grid, period, radius, (-half, 0.0)) | disc(grid, period, radius, (half, 0.0))
    state, spots = contact.relax_region(region, top - approaches[0]), asperities.untouched()
    for approach in approaches:
        state = contact.equilibrium(state, top - approach)
        spots = asperities.equilibrium(spots, top - approaches[0])
        spots = asperities.equilibrium(spots, top - approach)
        force, area = force_and_area(contact, state)
        other = asperities.pressure(spots) * contact.area
        fraction = contact.fractions(state)
        mirrored = np.roll(fraction[:, ::-1], 1, axis=1)
        yield {
            "grid": grid,
            "approach": approach,
            "spots": contact.spot_count(state),
            "asymmetry": float(np.abs(mirrored - fraction).max()),
            "area_error": area / (asperities.area_fraction(spots) * contact.area) - 1,
            "force_error": (force - other) / max(abs(other), 2 * _PULL_OFF),
        }


def offsets(count: int) -> Iterator[tuple[float, float]]:
    """Yield offsets of a centre in cells: a node, the middle between four nodes, and a quasi-random sequence."""
    yield from ((0.0, 0.0), (0.5, 0.5))
    # R. Roberts' sequence with the plastic number.
    for k in range(1, count - 1):
        yield ((0.5 + 0.7548776662 * k) % 1 - 0.5, (0.5 + 0.5698402910 * k) % 1 - 0.5)
