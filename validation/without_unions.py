"""The model without unions: Hertzian spots that may overlap, with and without interaction."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.sparse.linalg import LinearOperator, gmres

from icha.asperity.coalescence import covering_spot
from icha.asperity.jkr import JKR
from icha.contact.model import NotConverged
from icha.equilibrium.distributions import cover_grid
from icha.half_space.ewald import PointHalfSpace
from icha.half_space.interaction import Interaction, displacement_at
from icha.surfaces.summits import Asperities
from icha.surfaces.surface import Surface

# Tolerances: equilibrium error in h_rms and relative error of the load; relative change of radii of curvature.
_TOLERANCE = 1e-9
_SAME_CURVATURE = 1e-6
_MAX_NEWTON_STEPS = 60
_MAX_HALVINGS = 10
_MAX_ROUNDS = 100
_LINEAR_TOLERANCE = 1e-6
# Largest decrease of the separation from its first guess, in h_rms.
_FALL = 0.3
_KRYLOV = 60
# Radius of the ring on which the field of other spots is evaluated, in contact radii.
_RING = 0.5
# Cells per cell of the grid of the surface, along a side, for the area of overlapping discs.
_DISC_REFINEMENT = 4


@dataclass(frozen=True, eq=False)
class Discs:
    """Hertzian contacts that may overlap.

    Attributes
    ----------
    position : (m, 2), m.
    contact_radius, radius_of_curvature : (m,), m.
    separation : from the mean plane, m.
    """

    position: np.ndarray
    contact_radius: np.ndarray
    radius_of_curvature: np.ndarray
    separation: float


def independent_discs(summits: Asperities, law: JKR, pressure: float) -> Discs:
    """Return Hertz's contacts of the summits with a plane, without interaction, at a nominal pressure (Pa)."""
    modulus, R = law.material.contact_modulus, summits.radius_of_curvature

    def excess(separation):
        approach = np.maximum(summits.height - separation, 0.0)
        return 4 / 3 * modulus * np.sum(np.sqrt(R) * approach**1.5) / summits.period**2 / pressure - 1

    top = bottom = float(np.max(summits.height))
    step = max(float(np.ptp(summits.height)), float(np.max(R)))
    while excess(bottom) < 0:
        bottom -= step
    separation = brentq(excess, bottom, top, xtol=1e-15 * step, rtol=1e-14)
    touching = summits.height > separation
    R, approach = R[touching], summits.height[touching] - separation
    return Discs(summits.position[touching], law.contact_radius(approach, R), R, separation)


def discs_apart(summits: Asperities, law: JKR, pressure: float, rms_height: float, *, field_shape: bool) -> Discs:
    """Solve the model without unions and adhesion at a nominal pressure (Pa).

    A summit within the contact of a larger one is removed.

    Parameters
    ----------
    rms_height : m, the unit of the equilibrium error.
    field_shape : whether the displacement by other spots raises a summit by its slope and sharpens it by its curvature.

    Raises
    ------
    NotConverged
        If no equilibrium is found.
    """
    start = independent_discs(summits, law, pressure)
    separation, sites = start.separation, np.arange(len(summits))
    approach = summits.height - separation
    lift, R = np.zeros(len(summits)), summits.radius_of_curvature.copy()
    half_space = None
    for iteration in range(_MAX_ROUNDS):
        position = summits.position[sites]
        if half_space is None:
            half_space = PointHalfSpace.at(position, summits.period, law.material.contact_modulus)
        height = (summits.height + lift)[sites]
        # Constant windows for the largest possible radii, because the equations must be continuous.
        largest = law.contact_radius(height - separation + _FALL * rms_height, R[sites])
        interaction = Interaction.between(law, half_space, R[sites], largest)
        problem = _Apart(law, height, R[sites], pressure * summits.period**2, rms_height, interaction)
        approach, separation, error = problem.solve(approach, separation)
        a = law.contact_radius(approach, R[sites])
        touching = np.flatnonzero(a > 0)
        centres, radius = position[touching], a[touching]
        covered = covering_spot(centres, centres, radius, summits.period, larger_than=radius) >= 0
        if covered.any():
            free = np.delete(np.arange(len(sites)), touching[covered])
            sites, approach, half_space = sites[free], approach[free], None
            continue
        if error > _TOLERANCE:
            raise NotConverged(f"without unions: error {error:.2g} with {len(touching)} spots at {pressure:.4g} Pa")
        discs = Discs(centres, radius, R[sites][touching], separation)
        if not field_shape:
            return discs
        new_lift, new_R = _reshaped(summits, law, sites[touching], discs)
        change = max(np.max(np.abs(new_R / R - 1)), np.max(np.abs(new_lift - lift)) / rms_height)
        if change < _SAME_CURVATURE:
            return discs
        # Later iterations are damped, because spots may appear and disappear in turn.
        share = 1.0 if iteration < 5 else 0.5
        lift, R = lift + share * (new_lift - lift), R + share * (new_R - R)
    raise NotConverged(f"without unions: no convergence at {pressure:.4g} Pa after {_MAX_ROUNDS} iterations")


def _reshaped(summits, law, touching, discs):
    """Return the rise (n,) of all summits, m, and their radii of curvature (n,), m, due to the field of other spots."""
    raised, sharpness = _shape_of_field(law, summits.period, discs)
    lift, R = np.zeros(len(summits)), summits.radius_of_curvature.copy()
    lift[touching] = 0.5 * R[touching] * raised
    R[touching] = 1 / (1 / R[touching] + 0.5 * sharpness)
    return lift, R


@dataclass(frozen=True, eq=False)
class _Apart:
    """delta_i + w_i(a(delta)) = h_i - u with a given load: Newton's method in approaches and separation."""

    law: JKR
    height: np.ndarray
    R: np.ndarray
    load: float
    rms_height: float
    interaction: Interaction

    def solve(self, approach, separation):
        """Return approaches (m), separation (m) and the remaining error, from first guesses."""
        point = self._evaluate(approach, separation)
        for _ in range(_MAX_NEWTON_STEPS):
            size = self._size(point)
            if size <= _TOLERANCE:
                break
            step = self._newton_step(approach, separation, point)
            for halving in range(_MAX_HALVINGS):
                candidate = approach + 0.5**halving * step[:-1], separation + 0.5**halving * step[-1]
                new = self._evaluate(*candidate)
                if self._size(new) < size:
                    break
            else:
                break
            (approach, separation), point = candidate, new
        return approach, separation, self._size(point)

    def _size(self, point):
        error, miss = point
        return max(float(np.max(np.abs(error))), abs(miss))

    def _evaluate(self, approach, separation):
        """Return the errors of the approaches in h_rms, and the relative error of the load."""
        a = self.law.contact_radius(approach, self.R)
        force = self.law.force(a, self.R)
        w = self.interaction.displacement(a)
        return (approach + w + separation - self.height) / self.rms_height, np.sum(force) / self.load - 1

    def _newton_step(self, approach, separation, point):
        a, n = self.law.contact_radius(approach, self.R), len(approach)
        growth = np.divide(self.R, 2 * a, out=np.zeros(n), where=a > 0)
        stiffness = self.law.force_derivative(a, self.R) * growth
        tangent, _ = self.interaction.tangent(a)

        def apply(y):  # lengths in h_rms
            return np.append(
                y[:n] + tangent(growth * y[:n]) + y[n], np.sum(stiffness * y[:n]) * self.rms_height / self.load
            )

        operator = LinearOperator((n + 1, n + 1), matvec=apply, dtype=float)
        size = min(n + 1, _KRYLOV)
        x, _ = gmres(operator, -np.append(*point), rtol=_LINEAR_TOLERANCE, atol=0.0, restart=size, maxiter=4)
        return x * self.rms_height


def _shape_of_field(law, period, discs):
    """Return squared slope and Laplacian (1/m) of the displacement by other spots at every spot, each (m,).

    A negative Laplacian, which overlapping spots may cause, counts as zero.
    """
    a, R = discs.contact_radius, discs.radius_of_curvature
    ring = _RING * a
    directions = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    points = discs.position[:, None] + ring[:, None, None] * directions
    w = displacement_at(law, period, points.reshape(-1, 2), discs.position, a, R).reshape(-1, len(directions))
    w -= law.displacement(ring[:, None] * np.hypot(*directions.T), a[:, None], R[:, None])
    slope = ((w[:, 1] - w[:, 2]) ** 2 + (w[:, 3] - w[:, 4]) ** 2) / (2 * ring) ** 2
    return slope, np.maximum((w[:, 1:].sum(axis=1) - 4 * w[:, 0]) / ring**2, 0.0)


def union_area_fraction(discs: Discs, surface: Surface) -> float:
    """Return the area of the union of discs over the nominal area, exact for separate discs.

    Overlaps are subtracted cell by cell on a finer grid than that of the surface.
    """
    grid = surface.grid * _DISC_REFINEMENT
    cover, _ = cover_grid(surface.period, grid, discs.position, discs.contact_radius, surface.free)
    return float(np.mean(np.minimum(cover, 1.0)))
