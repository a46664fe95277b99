"""Single indenters on a free half-space, by boundary elements against closed forms (`icha.references.indentation`).

Units: E* = 1 Pa and, with adhesion, dgamma = 1 J/m^2; spheres have radius 1 m, so that lengths are in (dgamma^2
R/E*^2)^(1/3). The functions return rows: dictionaries of numbers for JSON. A force error is divided by the pull-off
force, an error of an indentation by the unit of length, unless the description of the function differs.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import gamma

from icha.asperity.adhesion_map import Patches
from icha.asperity.material import Material
from icha.boundary_elements.contact import BoundaryElements, contact_of
from icha.contact.model import PRESSURE, Control
from icha.references import indentation as exact
from icha.surfaces.shapes import Cone, CylinderPunch, FlatPunch, Paraboloid, Shape, Wave
from icha.surfaces.surface import Surface
from validation import elliptic_contacts as elliptic
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
    stiffness = force_and_area(bare, pressed)[0] / float(exact.punch_force(0.01, radius, 1.0))
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


def ellipse(spacing: float, ratio: float, grid: int = 96) -> Iterator[dict]:
    """Press a paraboloid whose radii of curvature have a given ratio, with and without adhesion.

    Without adhesion, force and area are compared with Hertz; with adhesion, with both criteria of an elliptic front at
    the same indentation, and at pull-off (row without indentation).
    """
    radii = (math.sqrt(ratio), math.sqrt(1 / ratio))
    hertz = indenter(Paraboloid(radii), grid, spacing, BARE)
    for force in (4.0, 16.0):
        wanted = elliptic.elliptic_hertz_contact(force, radii, 1.0)
        state = hertz.equilibrium(hertz.untouched(), -float(wanted.indentation))
        yield _ellipse_row("Hertz", ratio, spacing, hertz, state, wanted, float(wanted.force))
    contact = indenter(Paraboloid(radii), grid, spacing)
    state = contact.untouched()
    for indentation in (3.0, 2.0, 1.0, 0.0, -0.5):
        state = contact.equilibrium(state, -indentation)
        for criterion in ("energy", "axes"):
            wanted = _ellipse_at(indentation, radii, criterion)
            yield _ellipse_row(criterion, ratio, spacing, contact, state, wanted, PULL_OFF)
    tension, _ = largest_tension(contact, state, 0.05)
    for criterion in ("energy", "axes"):
        off = elliptic.elliptic_pull_off(radii, 1.0, 1.0, criterion)
        yield {"model": criterion, "ratio": ratio, "pull_off_error": tension / -float(off.force) - 1}


def _ellipse_at(indentation, radii, criterion):
    """Return the stable state of an elliptic front at an indentation."""

    def state(axis_ratio):
        return elliptic.elliptic_jkr_contact(axis_ratio, radii, 1.0, 1.0, criterion)

    ends = elliptic.elliptic_hertz_contact(1.0, radii, 1.0), elliptic.elliptic_pull_off(radii, 1.0, 1.0, criterion)
    lowest, highest = (float(min(end.semi_axes) / max(end.semi_axes)) for end in ends)
    return state(brentq(lambda g: float(state(g).indentation) - indentation, lowest * (1 + 1e-5), highest))


def _ellipse_row(model, ratio, spacing, contact, state, wanted, unit):
    force, area = force_and_area(contact, state)
    a, b = (float(axis) for axis in wanted.semi_axes)
    return {
        "model": model,
        "ratio": ratio,
        "cells": min(a, b) / spacing,
        "indentation": float(wanted.indentation),
        "force_error": (force - float(wanted.force)) / unit,
        "area_error": area / (math.pi * a * b) - 1,
    }


def guduru(spacing: float, amplitude: float, wavelength: float, most: float = 3.4) -> Iterator[dict]:
    """Load and unload a paraboloid with concentric waves by steps of the indentation, and compare it at its jumps.

    Rows with the control "load" compare forces at the indentations of the extrema of the force, where contact jumps
    under a given load. Rows with the control "indentation" compare the states just before the jumps of the contact.
    Jump-in and rows beyond the largest radius `most` (m) are left out. The error of the force is divided by the force
    at the jump or the pull-off force of the sphere without waves, whichever is larger; the error of the radius is in
    wavelengths.
    """
    wave = Wave(1.0, amplitude, wavelength)
    contact = indenter(wave, 2 * math.ceil(1.15 * most / spacing), spacing)
    radii = np.linspace(0.3, most, 40000)
    states = exact.wave_contact(radii, wave, 1.0, 1.0)
    first = contact.untouched()
    for branch, place in (("loading", 0), ("unloading", 1)):
        extrema, edges = (
            np.flatnonzero(
                np.diff(exact.stable_branches(states, control)[place].astype(int)) == (1, -1)[branch == "loading"]
            )
            + place
            for control in ("force", "indentation")
        )
        if branch == "loading":
            path = np.arange(0.0, float(states.indentation[-1]), 0.1)
            state = contact.equilibrium(first, 0.0)
        else:
            path, extrema, edges = np.append(path[::-1], np.arange(-0.1, -4.0, -0.1)), extrema[::-1], edges[::-1]
        wanted = {float(states.indentation[k]): k for k in extrema if 0.3 < radii[k] < 0.99 * most}
        edges = iter(edges)
        for indentation in sorted({*path, *wanted}, reverse=branch == "unloading"):
            new = _before_jump(contact, state, indentation, wavelength)
            if new is not None:
                yield _wave_row(contact, new, states, next(edges, None), branch, "indentation", wave)
            state = contact.equilibrium(new or state, -indentation)
            if not contact.spot_count(state):
                break
            if indentation in wanted:
                yield _wave_row(contact, state, states, wanted[indentation], branch, "load", wave)


def _before_jump(contact, state, indentation, wavelength, resolution=1e-3):
    """Return the last state before a jump on the way to an indentation; None if the contact does not jump."""
    start, end = -state.separation, indentation
    new = contact.equilibrium(state, -end)
    while abs(force_and_radius(contact, new)[1] - force_and_radius(contact, state)[1]) > 0.06 * wavelength:
        if abs(end - start) < resolution:
            return state
        middle = 0.5 * (start + end)
        halfway = contact.equilibrium(state, -middle)
        advance = abs(force_and_radius(contact, halfway)[1] - force_and_radius(contact, state)[1])
        rest = abs(force_and_radius(contact, new)[1] - force_and_radius(contact, halfway)[1])
        if advance > rest:
            end, new = middle, halfway
        else:
            start, state = middle, halfway
    return None


def _wave_row(contact, state, states, k, branch, control, wave):
    """Return the errors of a state against the state number k of the closed form; k is None for a jump it lacks."""
    force, radius = force_and_radius(contact, state)
    row = {
        "wavelength": wave.wavelength,
        "amplitude": wave.amplitude,
        "wave_cells": wave.wavelength / contact.spacing,
        "branch": branch,
        "control": control,
        "cells": radius / contact.spacing,
        "force": force / PULL_OFF,
    }
    if k is None:
        return row
    wanted = float(states.force[k])
    return row | {
        "force_exact": wanted / PULL_OFF,
        "force_error": (force - wanted) / max(abs(wanted), PULL_OFF),
        "indentation_error": -state.separation - float(states.indentation[k]),
        "radius_error": (radius - float(states.contact_radius[k])) / wave.wavelength,
    }


class _Ripples(Shape):
    """Paraboloid of radius 1 m with `amplitude` cos(m phi) away from the apex, m."""

    def __init__(self, amplitude, waves, inside):
        self.amplitude, self.waves, self.inside = amplitude, waves, inside

    def heights(self, x, y):
        r2 = x**2 + y**2
        # A wave from the apex on would have no limit there. Its inner part has no effect on the front: (r/a)^m.
        ripples = np.minimum(r2 / self.inside**2, 1.0) ** 2 * np.cos(self.waves * np.arctan2(y, x))
        return -r2 / 2 + self.amplitude * ripples


def ripples_along(cells: float, waves: int, indentation: float = 2.0) -> dict:
    """Return the stress intensity by ripples along the front of a sphere, from the shift of the front.

    With m crests around the contact (`waves`), the front shifts by -K/(K_0' + m K_0/(2 a)). K_0' is the derivative of
    the stress intensity with respect to the radius, at fixed indentation. The second term results from a wavy front (H.
    Gao and J. R. Rice, J. Appl. Mech. 54 (1987) 627). The effect of the grid cancels between opposite amplitudes.
    """
    a = float(exact.sphere_radius_at_indentation(indentation, 1.0, 1.0, 1.0))
    spacing = a / cells
    grid = 2 * math.ceil(1.25 * cells)
    critical = math.sqrt(2)
    stiffness = 2 * a / math.sqrt(math.pi * a) - critical / (2 * a) + waves * critical / (2 * a)
    wavelength = 2 * math.pi * a / waves
    # For a shift by about 0.4 cells.
    amplitude = 0.4 * spacing * stiffness * math.sqrt(wavelength / math.pi)
    shifts = []
    for sign in (1, -1):
        contact = indenter(_Ripples(sign * amplitude, waves, a / 2), grid, spacing)
        state = contact.equilibrium(contact.untouched(), -indentation)
        shifts.append(_wave_of_front(contact, state, waves, a))
    found = -stiffness * (shifts[0] - shifts[1]) / 2
    # The same ripples under a circular contact: p with K = (m + 1) c E* h/sqrt(pi a), c = int t^(m+1)/sqrt(1 - t^2).
    c = math.sqrt(math.pi) / 2 * gamma(waves / 2 + 1) / gamma(waves / 2 + 1.5)
    circle = -(waves + 1) * c * amplitude / math.sqrt(math.pi * a)
    straight = float(elliptic.front_response(amplitude, wavelength, 1.0).real)
    return {
        "cells": cells,
        "waves": waves,
        "wave_cells": wavelength / spacing,
        "error": found / circle - 1,
        "straight_error": found / straight - 1,
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


def pinning(contrast: float, seeds: Sequence[int] = (1, 2, 3), cells: int = 24) -> dict:
    """Return the hysteresis by pinning alone: of a sphere on random patches, between its jumps into and out of contact.

    The indentation grows from 1 to 3 and falls to 1 again. The hysteresis is the mean difference of the force between
    both, over the pull-off force. The correlation length of the patches is four cells.

    Parameters
    ----------
    contrast : standard deviation of the work of adhesion, whose mean is 1.
    cells : cells in the radius of the contact at the largest indentation.
    """
    depths, found = np.linspace(1.0, 3.0, 21), {}
    spacing = float(exact.sphere_radius_at_indentation(depths[-1], 1.0, 1.0, 1.0)) / cells
    for seed in seeds:
        material = Material(1.0, Patches(1.0, contrast, 4 * spacing, seed), 0.2)
        contact = indenter(Paraboloid((1.0, 1.0)), 2 * math.ceil(1.3 * cells), spacing, material)
        state, forces = contact.untouched(), []
        for depth in (*depths, *depths[-2::-1]):
            state = contact.equilibrium(state, -float(depth))
            forces.append(force_and_area(contact, state)[0])
        loading, unloading = forces[: len(depths)], forces[: -len(depths) - 1 : -1]
        found[f"seed_{seed}"] = float(np.mean(np.subtract(loading, unloading))) / PULL_OFF
    return {"contrast": contrast} | found


def ripples_across(spacing: float, amplitude: float, wavelength: float) -> dict:
    """Return amplitude and phase of the stress intensity by concentric ripples that a front crosses.

    They follow from the indentation at the contact radius that is reached, E* (a^2/R - delta)/sqrt(pi a) - K_c, by a
    fit with a cosine and a sine of q a.
    """
    wave = Wave(1.0, amplitude, wavelength)
    radii = np.linspace(1.6, 1.6 + 2 * wavelength, 49)
    contact = indenter(wave, 2 * math.ceil(1.1 * radii[-1] / spacing), spacing)
    state, rows = contact.untouched(), []
    for a in radii:
        state = contact.equilibrium(state, -float(exact.wave_contact(a, wave, 1.0, 1.0).indentation))
        radius = force_and_radius(contact, state)[1]
        rows.append((radius, math.sqrt(2) - (radius**2 + state.separation) / math.sqrt(math.pi * radius)))
    a, found = np.array(rows).T
    phase = 2 * math.pi * a / wavelength
    columns = np.column_stack([np.cos(phase), np.sin(phase), np.ones_like(a), a - a.mean()])
    cosine, sine = np.linalg.lstsq(columns, found)[0][:2]
    # Re(K exp(i q a)) = K' cos(q a) - K'' sin(q a).
    response = complex(cosine, -sine) / elliptic.front_response(amplitude, wavelength, 1.0, math.pi / 2)
    return {
        "cells": 1.6 / spacing,
        "wave_cells": wavelength / spacing,
        "amplitude_error": abs(response) - 1,
        "phase_error": math.degrees(math.atan2(response.imag, response.real)),
    }
