"""Single indenters on a free half-space, by boundary elements against closed forms (`icha.references.indentation`).

Units: E* = 1 Pa and, with adhesion, dgamma = 1 J/m^2; spheres have radius 1 m, so that lengths are in (dgamma^2
R/E*^2)^(1/3). The functions return rows: dictionaries of numbers for JSON. A force error is divided by the pull-off
force, an error of an indentation by the unit of length, unless the description of the function differs.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from icha.asperity.material import Material
from icha.boundary_elements.contact import BoundaryElements, contact_of
from icha.contact.model import PRESSURE, Control
from icha.references import indentation as exact
from icha.surfaces.shapes import Cone, CylinderPunch, FlatPunch, Paraboloid, Shape
from icha.surfaces.surface import Surface
from validation.single_contacts import force_and_area, largest_tension

# Tabor parameter 5: the range affects only the jump into contact.
ADHESIVE, BARE = Material(1.0, 1.0, 0.2), Material(1.0, 0.0, 0.2)
PULL_OFF = 1.5 * math.pi
# Places of the apex relative to a node, in cells: that of `Surface`, a node, between four nodes, and elsewhere.
PLACES = ((-0.21, -0.21), (0.0, 0.0), (0.5, 0.5), (0.255, 0.07))


@dataclass(frozen=True)
class Shifted(Shape):
    """Shape whose apex is shifted by `shift` (x, y), m."""

    shape: Shape
    shift: tuple[float, float]

    def __str__(self) -> str:
        """Return name, parameters and shift of the shape in SI units."""
        return f"{self.shape}, shifted by {self.shift[0]:.6g} and {self.shift[1]:.6g} m"

    def heights(self, x, y):
        """Return the heights of the shifted shape."""
        return self.shape.heights(x - self.shift[0], y - self.shift[1])

    @property
    def sphere_radius(self):
        """Radius of the sphere of the shape, m."""
        return self.shape.sphere_radius


def indenter(
    shape: Shape, grid: int, spacing: float, material: Material = ADHESIVE, place: Sequence[float] = PLACES[0]
) -> BoundaryElements:
    """Return the contact of a smooth shape whose apex lies at a place (cells) relative to a node."""
    smooth = Surface(np.zeros((grid, grid)), grid * spacing, "free", Paraboloid((1.0, 1.0)))
    own = smooth.apex / spacing - grid // 2 - 0.5
    shift = tuple((one - own) * spacing for one in place)
    return contact_of(Surface(smooth.heights, smooth.period, "free", Shifted(shape, shift)), material)


def force_and_radius(contact: BoundaryElements, state) -> tuple[float, float]:
    """Return force (N) and contact radius (m) of a state."""
    force, area = force_and_area(contact, state)
    return force, math.sqrt(area / math.pi)


# --- spheres ------------------------------------------------------------------------------------------------------


def hertz(cells: float, place: Sequence[float] = PLACES[0], grid: int = 64) -> dict:
    """Return a sphere without adhesion whose contact radius is `cells` cells, in units of area, force and indentation.

    The error of the gap is the largest one outside the contact over the indentation.
    """
    a = 0.1
    spacing, wanted = a / cells, exact.sphere_contact(a, 1.0, 1.0)
    contact = indenter(Paraboloid((1.0, 1.0)), grid, spacing, BARE, place)
    state = contact.equilibrium(contact.untouched(), -wanted.indentation)
    force, area = force_and_area(contact, state)
    offset = np.arange(grid) - grid // 2
    r = np.hypot(offset[:, None] - place[1], offset - place[0]) * spacing
    outside = r > a + 2 * spacing
    far = r[outside]
    # Displacement outside Hertz's contact (Johnson 1985, section 4.2).
    lift = ((2 * a**2 - far**2) * np.arcsin(a / far) + a * np.sqrt(far**2 - a**2)) / math.pi
    gap = contact.gap(state)[outside] - (lift - wanted.indentation + far**2 / 2)
    return {
        "place": list(place),
        "cells": cells,
        "area_error": area / (math.pi * a**2) - 1,
        "force_error": force / float(wanted.force) - 1,
        "gap_error": float(np.abs(gap).max() / wanted.indentation),
    }


def sphere(spacing: float, grid: int, place: Sequence[float], control: str, deepest: float) -> Iterator[dict]:
    """Load a sphere from the first touch to an indentation, and unload it to just before it jumps off.

    The errors are those of force and indentation at the contact radius that is reached. `given_error` is the error of
    the force at the given indentation, or of the indentation at the given force.
    """
    contact = indenter(Paraboloid((1.0, 1.0)), grid, spacing, place=place)
    state = contact.untouched()
    most = float(exact.sphere_contact(exact.sphere_radius_at_indentation(deepest, 1.0, 1.0, 1.0), 1.0, 1.0, 1.0).force)
    if control == "separation":
        loading, unloading = np.linspace(0.0, deepest, 6), np.linspace(deepest, -1.55, 12)[1:]
    else:
        loading, unloading = np.linspace(0.1, most, 5), np.linspace(most, -0.95 * PULL_OFF, 13)[1:]
    for branch, value in (*(("loading", one) for one in loading), *(("unloading", one) for one in unloading)):
        find = exact.sphere_radius_at_indentation if control == "separation" else exact.sphere_radius_at_force
        a = find(value, 1.0, 1.0, 1.0)
        given = exact.sphere_contact(float(a), 1.0, 1.0, 1.0)
        # Like paths, search for a load near a state of nearly this load.
        state = contact.equilibrium(state, -float(given.indentation))
        if control == "load":
            state = contact.equilibrium(state, state.separation, Control(PRESSURE, value / contact.area))
        force, radius = force_and_radius(contact, state)
        wanted = exact.sphere_contact(radius, 1.0, 1.0, 1.0)
        yield {
            "place": list(place),
            "cells": radius / spacing,
            "control": control,
            "branch": branch,
            "force": force / PULL_OFF,
            "force_error": (force - wanted.force) / PULL_OFF,
            "approach_error": -state.separation - wanted.indentation,
            "given_error": (force - given.force) / PULL_OFF
            if control == "separation"
            else -state.separation - given.indentation,
        }


def sphere_pull_off(spacing: float, grid: int, place: Sequence[float]) -> dict:
    """Pull a sphere off from an indentation of 0, with the errors of pull-off force and indentation at jump-off."""
    contact = indenter(Paraboloid((1.0, 1.0)), grid, spacing, place=place)
    state = contact.equilibrium(contact.untouched(), 0.0)
    force, last = largest_tension(contact, state, 0.05)
    off, jump = exact.sphere_pull_off(1.0, 1.0, 1.0), exact.sphere_jump_off(1.0, 1.0, 1.0)
    return {
        "place": list(place),
        "cells": off.contact_radius / spacing,
        "pull_off_error": force / PULL_OFF - 1,
        "jump_off_error": -last.separation - jump.indentation,
    }


# --- other shapes -------------------------------------------------------------------------------------------------


def punch(cells: float, square: bool, grid: int = 64) -> dict:
    """Return stiffness and pull-off of a flat punch over those of a round punch, with radius or half side in cells."""
    radius = 1.0
    spacing = radius / cells
    shape = FlatPunch(2 * radius) if square else CylinderPunch(radius)
    material = Material(1.0, 1e-4, 1e-4)
    place = (0.5, 0.5) if square else PLACES[0]
    bare = indenter(shape, grid, spacing, BARE, place)
    pressed = bare.equilibrium(bare.untouched(), -0.01)
    stiffness = force_and_area(bare, pressed)[0] / (2 * radius * 0.01)
    contact = indenter(shape, grid, spacing, material, place)
    let_go = exact.punch_pull_off(radius, 1.0, 1e-4)
    state = contact.relax_region(np.isfinite(contact.crop(contact.heights)), -0.02 * let_go.indentation)
    tension, _ = largest_tension(contact, state, -0.1 * let_go.indentation)
    nodes = math.sqrt(np.count_nonzero(np.isfinite(contact.heights)) / math.pi) * spacing
    return {
        "square": int(square),
        "cells": cells,
        "stiffness": stiffness,
        "pull_off": tension / -float(let_go.force),
        "pull_off_of_nodes": tension / -float(exact.punch_pull_off(nodes, 1.0, 1e-4).force),
        "stiffness_of_nodes": stiffness * radius / nodes,
    }


def cone(spacing: float, grid: int = 96, place: Sequence[float] = PLACES[0]) -> Iterator[dict]:
    """Load and unload a cone of slope 1 with and without adhesion; force errors over the pull-off force or force."""
    shape = Cone(math.pi / 4)
    for material in (BARE, ADHESIVE):
        energy = material.surface_energy
        off = exact.cone_pull_off(math.pi / 4, 1.0, 1.0)
        radii = off.contact_radius * np.array((0.4, 0.8, 1.0, 1.4, 1.4, 1.0, 0.8, 0.4))
        contact = indenter(shape, grid, spacing, material, place)
        state = contact.untouched()
        for a in radii:
            state = contact.equilibrium(state, -float(exact.cone_contact(a, math.pi / 4, 1.0, energy).indentation))
            force, radius = force_and_radius(contact, state)
            wanted = exact.cone_contact(radius, math.pi / 4, 1.0, energy)
            unit = -off.force if energy else float(wanted.force)
            yield {
                "adhesion": "with" if energy else "without",
                "cells": radius / spacing,
                "force_error": (force - wanted.force) / unit,
                "approach_error": -state.separation / wanted.indentation - 1,
            }


def _wave_of_front(contact, state, waves, radius):
    """Return the amplitude of cos(m phi) of the front of a state near a circle, m; waves: m."""
    row, column = np.divmod(state.cells, contact.space.grid)
    offset = len(contact.crop(contact.heights)) // 2 + PLACES[0][0]
    wave = np.cos(waves * np.arctan2(row - offset, column - offset))
    return np.sum(contact.area_of_cells(state) * wave) * contact.spacing**2 / (math.pi * radius)


def pinned_front(cells: float, waves: int, width: float = 0.0, contrast: float = 0.1, indentation: float = 2.0) -> dict:
    """Return how far the front of a sphere moves with a work of adhesion that differs from place to place.

    To first order, the amplitude w_m of cos(m phi) of the work of adhesion along the circle of contact moves the front
    by w_m/(G' + m G/a). G' is the derivative of the energy release rate G with respect to the radius a, at fixed
    indentation (H. Gao and J. R. Rice, J. Appl. Mech. 54 (1987) 627; A. Sanner and L. Pastewka, J. Mech. Phys. Solids
    160 (2022) 104781, doi:10.1016/j.jmps.2022.104781). The effect of the grid cancels between opposite contrasts.

    Parameters
    ----------
    waves : m, waves of the work of adhesion around the contact; with stripes, the wave of the front that is measured.
    width : width of stripes, one of which is centred at the apex, m; 0 for waves around the apex.
    contrast : largest deviation of the work of adhesion from its mean 1.
    """
    a = float(exact.sphere_radius_at_indentation(indentation, 1.0, 1.0, 1.0))
    spacing, grid = a / cells, 2 * math.ceil(1.25 * cells)

    def pattern(x, y):
        return np.sign(np.cos(math.pi * x / width)) if width else np.cos(waves * np.arctan2(y, x))

    phi = 2 * math.pi * (np.arange(10_000) + 0.5) / 10_000
    along = contrast * 2 * np.mean(pattern(a * np.cos(phi), a * np.sin(phi)) * np.cos(waves * phi))
    # G = E* (a^2/R - delta)^2/(2 pi a), and the work of adhesion is 1.
    first_order = along / (2 / math.pi * math.sqrt(2 * math.pi * a) - 1 / a + waves / a)
    x = (np.arange(grid) - grid // 2 - PLACES[0][0]) * spacing
    shifts = []
    for sign in (1, -1):
        contact = indenter(
            Paraboloid((1.0, 1.0)), grid, spacing, Material(1.0, 1 + sign * contrast * pattern(*np.meshgrid(x, x)), 0.2)
        )
        state = contact.equilibrium(contact.untouched(), -indentation)
        shifts.append(_wave_of_front(contact, state, waves, a))
    shift = (shifts[0] - shifts[1]) / 2
    what = f"stripes of {width:g}" if width else "waves"
    row = {"work": what, "waves": waves, "cells": cells, "contrast": contrast}
    return row | {"shift": shift / spacing, "error": shift / first_order - 1}
