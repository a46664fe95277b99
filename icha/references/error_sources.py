r"""Where the model's error comes from: between ICHA and boundary elements, one thing is switched at a time.

Boundary elements can be given, instead of the topography, the surface that the model assumes. A chain of variants then
leads from the model to the truth, every link changing one thing:

    icha                      the model;
    without_unions            overlapping spots stay as they are; their area is that of the union of the discs;
    field_shape               moreover the displacement w by the other spots has a slope and a curvature across a spot:
                              there the summit stands higher by R |grad w|^2/2 and is sharper, 1/R + laplacian(w)/2;
    circular_paraboloids      boundary elements on the upper envelope of the paraboloids z - r^2/(2R) of all summits;
    elliptic_paraboloids      the same with both principal curvatures, of which 1/R is the geometric mean;
    boundary_elements         boundary elements on the topography itself.

What the last link changes is the shape of the summits beyond their paraboloids. Beside the chain stand

    independent               Hertz's summits that do not interact;
    point_forces              without unions, spots acting on each other by their forces alone, F/(pi E* r);
    icha_fine_grid            the model on a grid twice as fine;
    boundary_elements_coarse  boundary elements on a grid half as fine.

How a summit goes on beyond its paraboloid shows in single patches: on the profile r^2/(2R) - b r^4 a contact of radius
a carries F = 4 E* a^3/(3R) (1 - 16/5 b R a^2) (I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47-57,
doi:10.1016/0020-7225(65)90019-4), with b the bi-Laplacian of the heights at the summit over 64.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.fft
import scipy.ndimage
import xarray as xr
from scipy.optimize import brentq
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import LinearOperator, gmres
from threadpoolctl import threadpool_limits

from icha.asperity.coalescence import covering_spot
from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.datasets.attributes import BOUNDARY_ELEMENTS, COMPUTED, discovery
from icha.datasets.build import build, of
from icha.datasets.variables.error_sources import ERROR_SOURCES
from icha.datasets.variables.terms import MATERIAL, ROUGHNESS
from icha.equilibrium.distributions import contact_cover
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.equilibrium.states import ContactState
from icha.half_space.ewald import HalfSpace
from icha.half_space.interaction import Interaction, displacement_at
from icha.path.follow import follow
from icha.path.targets import Path
from icha.references.boundary_elements import (
    DEFAULT_TOLERANCE,
    REFERENCES,
    NodalState,
    NotSolved,
    contact_state,
    perimeter_correction,
)
from icha.support.rules import REFINEMENT, Integer
from icha.surfaces.square import periodic_difference
from icha.surfaces.summits import Asperities, find_summits
from icha.surfaces.surface import Surface

# From the model to the truth, and what changes from one to the next. With adhesion the model is not solved without its
# unions.
CHAIN = {
    "icha": "",
    "without_unions": "unions",
    "field_shape": "slope and curvature of the others' field",
    "circular_paraboloids": "rest of the contact mechanics",
    "elliptic_paraboloids": "ellipticity of the summits",
    "boundary_elements": "shape beyond the paraboloid",
}
ADHESIVE_CHAIN = {
    "icha": "",
    "circular_paraboloids": "contact mechanics and unions",
    "elliptic_paraboloids": "ellipticity of the summits",
    "boundary_elements": "shape beyond the paraboloid",
}
BESIDE = ("independent", "point_forces", "icha_fine_grid", "boundary_elements_coarse")

# What a group of spots and patches is that lie on each other.
CATEGORIES = {
    "single": "one spot of one summit, one patch",
    "several": "spots of one summit each, with a patch in common or several patches under one spot",
    "united": "with a united spot",
    "extra": "a spot without a patch",
    "missed": "a patch without a spot",
}

# Without unions: equilibrium error in h_rms and relative error of the load; relative change of radii of curvature.
_TOLERANCE = 1e-9
_SAME_CURVATURE = 1e-6
_MAX_NEWTON_STEPS = 60
_MAX_HALVINGS = 10
_MAX_ROUNDS = 100
_LINEAR_TOLERANCE = 1e-6
# How far below a first guess the separation may end up, in h_rms.
_FALL = 0.3
_KRYLOV = 60
# Where the field of the others is looked at: on a ring of so many of the spot's own contact radii.
_RING = 0.5
# Cells per cell of the surface's grid, along a side, for the area of overlapping discs.
_DISC_REFINEMENT = 4


class State(NamedTuple):
    """Contact area fraction, and mean separation in m."""

    area: float
    separation: float


@dataclass(frozen=True, eq=False)
class Discs:
    """Hertzian contacts that may overlap.

    position (m, 2), contact_radius (m,), radius_of_curvature (m,) and separation from the mean plane: m.
    """

    position: np.ndarray
    contact_radius: np.ndarray
    radius_of_curvature: np.ndarray
    separation: float


class Patches(NamedTuple):
    """Connected contact patches. label (n, n): of every node, 0 outside; area (m^2), force (N) and nodes (k,)."""

    label: np.ndarray
    area: np.ndarray
    force: np.ndarray
    nodes: np.ndarray


class Match(NamedTuple):
    """Groups of spots and patches that lie on each other.

    spot_group (s,) and patch_group (k,): to which group each belongs; category (g,): of every group, a key of
    `CATEGORIES`.
    """

    spot_group: np.ndarray
    patch_group: np.ndarray
    category: np.ndarray


def error_sources(
    surface: Surface,
    material: Material,
    reduced_pressures,
    *,
    refinement: int = 2,
    tolerance: float = DEFAULT_TOLERANCE,
    seed: int = -1,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """Solve all variants for one surface, and split the model's error spot by spot.

    Parameters
    ----------
    surface, material : as for `icha.simulate`; a range of attraction must be resolved on the coarser grid, too.
    reduced_pressures : p/(E* h'_rms) with the rms slope of the surface itself, increasing, (n,).
    refinement : boundary elements per cell of the surface's grid along a side, even, so that half of it can be tried.
    tolerance : of the boundary elements.
    seed : recorded in the dataset.
    progress : called with a line of text for every variant.

    Returns
    -------
    xarray.Dataset (`icha.datasets.variables.error_sources`): areas and separations along (variant, reduced_pressure).
    Without adhesion also the split along (category, reduced_pressure), whose sums are the total areas and loads of
    `icha` and `boundary_elements`, and along `pair` every single spot and its patch.

    Raises
    ------
    ValueError
        If an argument is out of range.
    icha.references.boundary_elements.NotSolved, icha.contact.failures.NotConverged
        If a variant was not solved.
    """
    surface.require_periodic("the comparison with boundary elements")
    path = Path(reduced_pressures=reduced_pressures)
    pressures = [target.value for target in path.targets]
    if Integer(2, REFINEMENT.most).checked("refinement", refinement) % 2:
        raise ValueError(f"refinement: {refinement!r} must be even")
    say = progress or (lambda line: None)
    law = JKR(material)
    states, parts = {}, None

    def keep(name, solved):
        states[name] = list(solved)
        say(f"{name}: A/A0 = {', '.join(f'{state.area:.4e}' for state in states[name])}")

    # One thread for linear algebra: the order of sums, and with it every bit, is then the same everywhere.
    with threadpool_limits(1):
        contact, model = _model(surface, law, path)
        keep("icha", (_state_of_model(contact, state) for state in model))
        fine_contact, fine_model = _model(surface.refined(2), law, path)
        keep("icha_fine_grid", (_state_of_model(fine_contact, state) for state in fine_model))
        summits = contact.asperities
        if not contact.adhesive:
            loads = [p * material.contact_modulus * surface.rms_slope for p in pressures]
            keep("independent", (_state_of_discs(independent_discs(summits, law, p), surface) for p in loads))
            for name, switch in (
                ("point_forces", {"point_forces": True}),
                ("without_unions", {}),
                ("field_shape", {"field_shape": True}),
            ):
                apart = (discs_apart(summits, law, p, surface.rms_height, **switch) for p in loads)
                keep(name, (_state_of_discs(discs, surface) for discs in apart))
        curvatures = summit_curvatures(surface, summits)
        for name, shape in (("circular_paraboloids", _circular(summits)), ("elliptic_paraboloids", curvatures)):
            heights = paraboloids(summits, shape, refinement * surface.grid)
            keep(name, (_solve_paraboloids(heights, surface, material, p, tolerance) for p in pressures))
        half = {"refinement": refinement // 2, "tolerance": tolerance}
        keep(
            "boundary_elements_coarse",
            (_state_at_nodes(contact_state(surface, material, p, **half)) for p in pressures),
        )
        full = {"refinement": refinement, "tolerance": tolerance}
        solved = [contact_state(surface, material, p, **full) for p in pressures]
        keep("boundary_elements", (_state_at_nodes(state) for state in solved))
        if not contact.adhesive:
            fourth = fourth_order_terms(surface, summits)
            parts = [_split(contact, state, truth, fourth) for state, truth in zip(model, solved, strict=True)]
    return _dataset(surface, material, pressures, states, parts, seed, full)


# --- the model, with and without unions -------------------------------------------------------------------------


def _model(surface, law, path):
    """The contact problem, and the model's states at the stops of the path."""
    contact = InteractingAsperities(law, find_summits(surface), surface.rms_height)
    modulus = law.material.contact_modulus
    met = {waypoint.target: waypoint.state for waypoint in follow(contact, path, modulus * surface.rms_slope)}
    return contact, [met[target] for target in path.targets]


def _state_of_model(contact: InteractingAsperities, state: ContactState) -> State:
    return State(contact.area_fraction(state), state.separation)


def independent_discs(summits: Asperities, law: JKR, pressure: float) -> Discs:
    """Hertz's contacts of the summits with a plane, each as if it were alone, at a nominal pressure in Pa."""
    modulus, R = law.material.contact_modulus, summits.radius_of_curvature

    def excess(separation):
        approach = np.maximum(summits.height - separation, 0.0)
        return 4 / 3 * modulus * np.sum(np.sqrt(R) * approach**1.5) / summits.period**2 / pressure - 1

    top = bottom = float(np.max(summits.height))
    step = max(float(np.ptp(summits.height)), float(np.max(R)))
    while excess(bottom) < 0:
        bottom -= step
    separation = brentq(excess, bottom, top, xtol=1e-15 * step, rtol=1e-14)
    part = summits.height > separation
    R, approach = R[part], summits.height[part] - separation
    return Discs(summits.position[part], law.contact_radius(approach, R), R, separation)


def discs_apart(
    summits: Asperities,
    law: JKR,
    pressure: float,
    rms_height: float,
    *,
    point_forces: bool = False,
    field_shape: bool = False,
) -> Discs:
    """The model without unions, at a nominal pressure in Pa, without adhesion.

    A summit that lies in the contact of a larger one is under it and takes no part.

    Parameters
    ----------
    rms_height : m, the unit of the equilibrium error.
    point_forces : spots act on each other by their forces alone.
    field_shape : the slope of the others' displacement across a spot raises its summit, the curvature sharpens it.

    Raises
    ------
    NotSolved
        If no equilibrium was found.
    """
    start = independent_discs(summits, law, pressure)
    separation, part = start.separation, np.arange(len(summits))
    approach = summits.height - separation
    lift, R = np.zeros(len(summits)), summits.radius_of_curvature.copy()
    half_space = None
    for turn in range(_MAX_ROUNDS):
        position = summits.position[part]
        if half_space is None:
            half_space = HalfSpace.at(position, summits.period, law.material.contact_modulus)
        height = (summits.height + lift)[part]
        problem = _Apart.around(law, half_space, height, R[part], pressure, rms_height, separation, point_forces)
        approach, separation, error = problem.solve(approach, separation)
        a = law.contact_radius(approach, R[part])
        touching = np.flatnonzero(a > 0)
        there, radius = position[touching], a[touching]
        under = covering_spot(there, there, radius, summits.period, larger_than=radius) >= 0
        if under.any():
            free = np.delete(np.arange(len(part)), touching[under])
            part, approach, half_space = part[free], approach[free], None
            continue
        if error > _TOLERANCE:
            raise NotSolved(f"without unions: error {error:.2g} with {len(touching)} spots at {pressure:.4g} Pa")
        discs = Discs(there, radius, R[part][touching], separation)
        if not field_shape:
            return discs
        raised, sharpness = _shape_of_field(law, summits.period, discs)
        own = part[touching]
        new_lift, new_R = np.zeros(len(lift)), summits.radius_of_curvature.copy()
        new_lift[own], new_R[own] = (
            0.5 * summits.radius_of_curvature[own] * raised,
            1 / (1 / summits.radius_of_curvature[own] + 0.5 * sharpness),
        )
        change = max(np.max(np.abs(new_R / R - 1)), np.max(np.abs(new_lift - lift)) / rms_height)
        if change < _SAME_CURVATURE:
            return discs
        # Averaged with the last one when the iteration has not ended at once, since spots may come and go.
        share = 1.0 if turn < 5 else 0.5
        lift, R = lift + share * (new_lift - lift), R + share * (new_R - R)
    raise NotSolved(f"without unions: no end of the iteration at {pressure:.4g} Pa")


@dataclass(frozen=True, eq=False)
class _Apart:
    """delta_i + w_i(a(delta)) = h_i - u with a given load: Newton's method in approaches and separation."""

    law: JKR
    half_space: HalfSpace
    height: np.ndarray
    R: np.ndarray
    pressure: float
    rms_height: float
    interaction: Interaction | None

    @classmethod
    def around(cls, law, half_space, height, R, pressure, rms_height, separation, point_forces):
        """The equations for separations not much below the given one."""
        interaction = None
        if not point_forces:
            # Windows that stay, or the equations would jump: as wide as the radii can be.
            largest = law.contact_radius(height - separation + _FALL * rms_height, R)
            interaction = Interaction.between(law, half_space, R, largest)
        return cls(law, half_space, height, R, pressure, rms_height, interaction)

    def solve(self, approach, separation):
        """Approaches (m), separation (m) and what is left of the error, from first guesses of the former."""
        point = self._evaluate(approach, separation)
        for _ in range(_MAX_NEWTON_STEPS):
            size = self._size(point)
            if size <= _TOLERANCE:
                break
            step = self._newton_step(approach, separation, point)
            for halving in range(_MAX_HALVINGS):
                tried = approach + 0.5**halving * step[:-1], separation + 0.5**halving * step[-1]
                there = self._evaluate(*tried)
                if self._size(there) < size:
                    break
            else:
                break
            (approach, separation), point = tried, there
        return approach, separation, self._size(point)

    def _size(self, point):
        error, miss = point
        return max(float(np.max(np.abs(error))), abs(miss))

    def _evaluate(self, approach, separation):
        """Errors of the approaches in h_rms, and the load's relative error."""
        a = self.law.contact_radius(approach, self.R)
        force = self.law.force(a, self.R)
        if self.interaction is None:
            w = _by_forces(self.half_space, force)
        else:
            w = self.interaction.displacement(a)
        nominal = self.half_space.ewald.period**2 * self.pressure
        return (approach + w + separation - self.height) / self.rms_height, np.sum(force) / nominal - 1

    def _newton_step(self, approach, separation, point):
        a, n = self.law.contact_radius(approach, self.R), len(approach)
        growth = np.divide(self.R, 2 * a, out=np.zeros(n), where=a > 0)
        stiffness = self.law.force_derivative(a, self.R) * growth
        nominal = self.half_space.ewald.period**2 * self.pressure
        if self.interaction is None:

            def spread(x):
                return _by_forces(self.half_space, stiffness * x)

        else:
            tangent = self.interaction.tangent(a)

            def spread(x):
                return tangent(growth * x)

        def apply(y):  # lengths in h_rms
            return np.append(y[:n] + spread(y[:n]) + y[n], np.sum(stiffness * y[:n]) * self.rms_height / nominal)

        operator = LinearOperator((n + 1, n + 1), matvec=apply, dtype=float)
        size = min(n + 1, _KRYLOV)
        x, _ = gmres(operator, -np.append(*point), rtol=_LINEAR_TOLERANCE, atol=0.0, restart=size, maxiter=4)
        return x * self.rms_height


def _by_forces(half_space, force):
    """Displacement (n,) in m at the half-space's points by point forces (n,) in N at the same points."""
    ewald, points = half_space.ewald, half_space.points
    w = ewald.smooth(points, points, force) + half_space.near[0] @ force + half_space.near_transposed[0] @ force
    return w - ewald.own_smooth[0] * force - ewald.mean * np.sum(force)


def _shape_of_field(law, period, discs):
    """Squared slope and Laplacian (1/m) of the displacement by the other spots at every spot, each (m,).

    Where spots overlap the field of the other is flat enough; it does not blunt.
    """
    a, R = discs.contact_radius, discs.radius_of_curvature
    ring = _RING * a
    ways = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    points = discs.position[:, None] + ring[:, None, None] * ways
    w = displacement_at(law, period, points.reshape(-1, 2), discs.position, a, R).reshape(-1, len(ways))
    w -= law.displacement(ring[:, None] * np.hypot(*ways.T), a[:, None], R[:, None])
    slope = ((w[:, 1] - w[:, 2]) ** 2 + (w[:, 3] - w[:, 4]) ** 2) / (2 * ring) ** 2
    return slope, np.maximum((w[:, 1:].sum(axis=1) - 4 * w[:, 0]) / ring**2, 0.0)


def _state_of_discs(discs: Discs, surface: Surface) -> State:
    return State(union_area_fraction(discs, surface), discs.separation)


def union_area_fraction(discs: Discs, surface: Surface) -> float:
    """Area of the union of discs over the nominal one, exact where they are apart.

    Where they overlap it is cut off cell by cell, on a finer grid than the surface's.
    """
    cover = contact_cover(surface.refined(_DISC_REFINEMENT), discs)
    return float(np.mean(np.minimum(cover, 1.0)))


# --- surfaces between the model's and the true one --------------------------------------------------------------


def summit_curvatures(surface: Surface, summits: Asperities) -> np.ndarray:
    """Second derivatives xx, xy, yy of the heights at the summits, (n, 3), 1/m, by the spectrum."""
    return np.stack(
        [_at(summits, derivative) for derivative in _derivatives(surface, ((2, 0), (1, 1), (0, 2)))], axis=1
    )


def fourth_order_terms(surface: Surface, summits: Asperities) -> np.ndarray:
    """b of the mean profile h0 - r^2/(2R) + b r^4 around the summits: their bi-Laplacian over 64, (n,), m^-3."""
    xxxx, xxyy, yyyy = (_at(summits, one) for one in _derivatives(surface, ((4, 0), (2, 2), (0, 4))))
    return (xxxx + 2 * xxyy + yyyy) / 64


def _derivatives(surface, orders):
    """Derivatives of the heights, of orders (along x, along y) whose sum is even, at the nodes."""
    modes = scipy.fft.rfft2(surface.heights)
    n, unit = surface.grid, 2 * np.pi / surface.period
    ky, kx = scipy.fft.fftfreq(n, 1 / n)[:, None] * unit, np.arange(n // 2 + 1) * unit
    for along_x, along_y in orders:
        sign = (-1.0) ** ((along_x + along_y) // 2)
        yield scipy.fft.irfft2(sign * kx**along_x * ky**along_y * modes, s=(n, n))


def _at(summits, field):
    """A periodic field (n, n) at the summits, by a quintic spline."""
    spacing = summits.period / len(field)
    return scipy.ndimage.map_coordinates(field, summits.position.T[::-1] / spacing, order=5, mode="grid-wrap")


def _circular(summits):
    none = np.zeros(len(summits))
    return np.stack([-1 / summits.radius_of_curvature, none, -1 / summits.radius_of_curvature], axis=1)


def paraboloids(summits: Asperities, curvatures: np.ndarray, grid: int) -> np.ndarray:
    """Upper envelope (grid, grid) of the summits' paraboloids, m; curvatures (n, 3) as of `summit_curvatures`.

    Of every paraboloid only the nearest image counts.
    """
    x = np.arange(grid) * (summits.period / grid)
    xx, xy, yy = curvatures.T
    dx = periodic_difference(x[:, None], summits.position[:, 0], summits.period)
    along_x = summits.height + 0.5 * xx * dx**2
    oblique = xy * dx
    heights = np.empty((grid, grid))
    for row, y in enumerate(x):
        dy = periodic_difference(y, summits.position[:, 1], summits.period)
        heights[row] = np.max(along_x + (oblique + 0.5 * yy * dy) * dy, axis=1)
    return heights


# --- boundary elements ------------------------------------------------------------------------------------------


def _state_at_nodes(state: NodalState) -> State:
    return State(perimeter_correction(state.contact)[0], state.mean_separation)


def _solve_paraboloids(heights, surface, material, reduced_pressure, tolerance):
    """The same load on another surface; its separation is measured from the mean plane of the true one."""
    other = Surface(heights, surface.period)
    reduced_pressure = reduced_pressure * surface.rms_slope / other.rms_slope
    state = _state_at_nodes(contact_state(other, material, reduced_pressure, tolerance=tolerance))
    return state._replace(separation=state.separation + float(np.mean(heights)))


# --- spot by spot -----------------------------------------------------------------------------------------------


def contact_patches(state: NodalState) -> Patches:
    """The connected patches of a state without adhesion; areas are corrected by their perimeters."""
    contact, period = state.contact, state.surface.period
    label, count = scipy.ndimage.label(contact)
    # Patches go on across the edges of the cell.
    seam = np.concatenate([np.stack([label[0], label[-1]]), np.stack([label[:, 0], label[:, -1]])], axis=1)
    seam = seam[:, np.all(seam > 0, axis=0)]
    _, whole = connected_components(coo_array((np.ones(seam.shape[1]), seam), shape=(count + 1, count + 1)))
    label, count = whole[label], int(whole.max())  # the background, the first of all, stays 0
    nodes = np.bincount(label.ravel(), minlength=count + 1)
    edges = np.zeros(count + 1)
    for axis in (0, 1):
        other = np.roll(label, 1, axis)
        edges += np.bincount(np.maximum(label, other)[(label > 0) != (other > 0)], minlength=count + 1)
    corrected, perimeter = perimeter_correction(contact)
    excess = np.count_nonzero(contact) - corrected * contact.size
    force = np.bincount(label.ravel(), state.traction.ravel(), count + 1)
    cell = (period / len(label)) ** 2
    area = nodes - excess * edges / max(perimeter, 1.0)
    return Patches(label, area[1:] * cell, force[1:] * cell, nodes[1:])


def match(position, contact_radius, united, patches: Patches, period: float) -> Match:
    """Spots and patches that lie on each other, in groups.

    position (s, 2) and contact_radius (s,), m: the spots; a spot lies on the patches of all nodes inside it, or of the
    nearest one. united (s,): whether the spot stands for several summits.
    """
    spots, count = len(position), len(patches.area)
    spot, patch = [], []
    for k in range(spots):
        under = np.unique(patches.label[_nodes_in_disc(position[k], contact_radius[k], len(patches.label), period)])
        under = under[under > 0]
        spot += [k] * len(under)
        patch += list(under - 1 + spots)
    total = spots + count
    groups, group = connected_components(coo_array((np.ones(len(spot)), (spot, patch)), shape=(total, total)))
    spot_group, patch_group = group[:spots], group[spots:]
    own, other = np.bincount(spot_group, minlength=groups), np.bincount(patch_group, minlength=groups)
    with_united = np.bincount(spot_group, united, minlength=groups) > 0
    category = np.select(
        [own == 0, other == 0, with_united, (own == 1) & (other == 1)],
        ["missed", "extra", "united", "single"],
        "several",
    )
    return Match(spot_group, patch_group, category)


def _nodes_in_disc(centre, radius, grid, period):
    """Rows and columns of the nodes inside a disc, and of the one nearest to its centre."""
    spacing = period / grid
    column, row = np.rint(centre / spacing).astype(int)
    reach = int(radius / spacing) + 1
    offset = np.arange(-reach, reach + 1)
    dx, dy = (column + offset) * spacing - centre[0], (row + offset) * spacing - centre[1]
    inside = np.hypot(dx, dy[:, None]) <= radius
    inside[reach, reach] = True
    i, j = np.nonzero(inside)
    return np.mod(row + offset[i], grid), np.mod(column + offset[j], grid)


def _split(contact, state, truth, fourth):
    """One state's variables along category and pair, as a dict of arrays."""
    spots, law, period = state.spots, contact.law, contact.asperities.period
    patches = contact_patches(truth)
    found = match(spots.position, spots.contact_radius, spots.members > 1, patches, period)
    area = np.pi * spots.contact_radius**2
    force = law.force(spots.contact_radius, spots.radius_of_curvature)
    load = np.sum(patches.force)
    split = {name: [] for name, own in ERROR_SOURCES.items() if own.dims == ("category", "reduced_pressure")}
    for category in CATEGORIES:
        own = found.category[found.spot_group] == category
        other = found.category[found.patch_group] == category
        split["spot_count"].append(np.count_nonzero(own))
        split["patch_count"].append(np.count_nonzero(other))
        split["spot_area_fraction"].append(np.sum(area[own]) / contact.area)
        split["patch_area_fraction"].append(np.sum(patches.area[other]) / contact.area)
        split["spot_load_share"].append(np.sum(force[own]) / np.sum(force))
        split["patch_load_share"].append(np.sum(patches.force[other]) / load)
    single = np.flatnonzero(found.category[found.spot_group] == "single")
    of_group = np.full(len(found.category), -1)
    of_group[found.patch_group] = np.arange(len(patches.area))
    patch = of_group[found.spot_group[single]]
    # A spot of one summit is at its summit; summits under it are in its hand as well.
    held = np.flatnonzero(state.owner >= 0)
    at_summit = np.all(spots.position[state.owner[held]] == np.mod(contact.asperities.position[held], period), axis=1)
    summit = np.full(len(spots), -1)
    summit[state.owner[held[at_summit]]] = held[at_summit]
    return split | {
        "pair_spot_area": area[single],
        "pair_patch_area": patches.area[patch],
        "pair_spot_force": force[single],
        "pair_patch_force": patches.force[patch],
        "pair_patch_nodes": patches.nodes[patch],
        "pair_curvature_radius": spots.radius_of_curvature[single],
        "pair_fourth_order": fourth[summit[single]],
    }


def shape_ratio(sources: xr.Dataset) -> xr.DataArray:
    """Area of every pair's patch over Hertz's area at the patch's own force: 1 for a lone paraboloid."""
    radius = np.cbrt(0.75 * sources["pair_patch_force"] * sources["pair_curvature_radius"] / sources["contact_modulus"])
    return sources["pair_patch_area"] / (np.pi * radius**2)


def shape_ratio_of_fourth_order(sources: xr.Dataset) -> xr.DataArray:
    """The same as the summit's fourth-order term gives it, (1 - 16/5 b R a^2)^(-2/3); NaN beyond where that can be."""
    reduction = (
        3.2 / np.pi * sources["pair_fourth_order"] * sources["pair_curvature_radius"] * sources["pair_patch_area"]
    )
    return (1 - reduction.where(reduction < 1)) ** (-2 / 3)


def relative_radius(sources: xr.Dataset) -> xr.DataArray:
    """Radius of every pair's patch times the wave number sqrt(<q^4>/<q^2>) of the surface's curvature over slope."""
    wave_number = sources["rms_curvature"] * np.sqrt(8 / 3) / sources["rms_slope"]
    return np.sqrt(sources["pair_patch_area"] / np.pi) * wave_number


# --- the dataset ------------------------------------------------------------------------------------------------


def chain(sources: xr.Dataset) -> dict[str, str]:
    """The variants from the model to the truth, and what changes from the one before."""
    return ADHESIVE_CHAIN if float(sources["surface_energy"]) > 0 else CHAIN


def effects(sources: xr.Dataset) -> xr.DataArray:
    """What every link of the chain adds to ln(A/A_truth) of the model, along (source, reduced_pressure).

    The sum over the sources is the logarithm of the model's area over the boundary elements'.
    """
    links = chain(sources)
    names = list(links)
    area = np.log(sources["contact_area_fraction"])
    steps = [
        area.sel(variant=before, drop=True) - area.sel(variant=after, drop=True)
        for before, after in itertools.pairwise(names)
    ]
    return xr.concat(steps, "source").assign_coords(source=[links[name] for name in names[1:]])


def _dataset(surface, material, pressures, states, parts, seed, solver):
    order = [name for name in (*CHAIN, *BESIDE) if name in states]
    area = np.array([[state.area for state in states[name]] for name in order])
    separation = np.array([[state.separation for state in states[name]] for name in order])
    values = {
        "variant": order,
        "reduced_pressure": pressures,
        "contact_area_fraction": area,
        "mean_separation": separation,
        "reduced_separation": separation / surface.rms_height,
        **of(material, *MATERIAL),
        **of(surface, *ROUGHNESS, "period"),
        "grid": surface.grid,
        "seed": seed,
        **solver,
    }
    if parts is not None:
        values["category"] = list(CATEGORIES)
        values["pair_reduced_pressure"] = np.repeat(pressures, [len(part["pair_spot_area"]) for part in parts])
        for name in parts[0]:
            of_states = [part[name] for part in parts]
            along_pairs = ERROR_SOURCES[name].dims == ("pair",)
            values[name] = np.concatenate(of_states) if along_pairs else np.array(of_states).T
    adhesion = "with" if material.surface_energy > 0 else "without"
    attrs = discovery(
        f"Sources of the error of the ICHA model {adhesion} adhesion",
        "One surface solved by the model, by boundary elements and by variants between the two.",
        COMPUTED,
        programs=("icha", "tamaas"),
        references=REFERENCES,
        keywords=[BOUNDARY_ELEMENTS],
    )
    return build(ERROR_SOURCES, values, attrs)
