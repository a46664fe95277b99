"""The model without unions: Hertzian spots that may overlap, interacting or each as if it were alone."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.sparse.linalg import LinearOperator, gmres

from icha.asperity.coalescence import covering_spot
from icha.asperity.jkr import JKR
from icha.contact.model import NotConverged
from icha.equilibrium.distributions import contact_cover
from icha.half_space.ewald import PointHalfSpace
from icha.half_space.interaction import Interaction, displacement_at
from icha.surfaces.summits import Asperities
from icha.surfaces.surface import Surface

# Equilibrium error in h_rms and relative error of the load; relative change of radii of curvature.
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


@dataclass(frozen=True, eq=False)
class Discs:
    """Hertzian contacts that may overlap.

    position (m, 2), contact_radius (m,), radius_of_curvature (m,) and separation from the mean plane: m.
    """

    position: np.ndarray
    contact_radius: np.ndarray
    radius_of_curvature: np.ndarray
    separation: float


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
    field_shape: bool = False,
) -> Discs:
    """The model without unions, at a nominal pressure in Pa, without adhesion.

    A summit that lies in the contact of a larger one is under it and takes no part.

    Parameters
    ----------
    rms_height : m, the unit of the equilibrium error.
    field_shape : the slope of the others' displacement across a spot raises its summit, the curvature sharpens it.

    Raises
    ------
    NotConverged
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
            half_space = PointHalfSpace.at(position, summits.period, law.material.contact_modulus)
        height = (summits.height + lift)[part]
        problem = _Apart.around(law, half_space, height, R[part], pressure, rms_height, separation)
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
            raise NotConverged(f"without unions: error {error:.2g} with {len(touching)} spots at {pressure:.4g} Pa")
        discs = Discs(there, radius, R[part][touching], separation)
        if not field_shape:
            return discs
        new_lift, new_R = _reshaped(summits, law, part[touching], discs)
        change = max(np.max(np.abs(new_R / R - 1)), np.max(np.abs(new_lift - lift)) / rms_height)
        if change < _SAME_CURVATURE:
            return discs
        # Averaged with the last one when the iteration has not ended at once, since spots may come and go.
        share = 1.0 if turn < 5 else 0.5
        lift, R = lift + share * (new_lift - lift), R + share * (new_R - R)
    raise NotConverged(f"without unions: no end of the iteration at {pressure:.4g} Pa")


def _reshaped(summits, law, touching, discs):
    """How much higher all summits stand (n,), m, and their radii of curvature (n,), m, for the field of the others."""
    raised, sharpness = _shape_of_field(law, summits.period, discs)
    lift, R = np.zeros(len(summits)), summits.radius_of_curvature.copy()
    lift[touching] = 0.5 * R[touching] * raised
    R[touching] = 1 / (1 / R[touching] + 0.5 * sharpness)
    return lift, R


@dataclass(frozen=True, eq=False)
class _Apart:
    """delta_i + w_i(a(delta)) = h_i - u with a given load: Newton's method in approaches and separation."""

    law: JKR
    half_space: PointHalfSpace
    height: np.ndarray
    R: np.ndarray
    pressure: float
    rms_height: float
    interaction: Interaction

    @classmethod
    def around(cls, law, half_space, height, R, pressure, rms_height, separation):
        """The equations for separations not much below the given one."""
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
        w = self.interaction.displacement(a)
        nominal = self.half_space.ewald.period**2 * self.pressure
        return (approach + w + separation - self.height) / self.rms_height, np.sum(force) / nominal - 1

    def _newton_step(self, approach, separation, point):
        a, n = self.law.contact_radius(approach, self.R), len(approach)
        growth = np.divide(self.R, 2 * a, out=np.zeros(n), where=a > 0)
        stiffness = self.law.force_derivative(a, self.R) * growth
        nominal = self.half_space.ewald.period**2 * self.pressure
        tangent = self.interaction.tangent(a)

        def apply(y):  # lengths in h_rms
            return np.append(
                y[:n] + tangent(growth * y[:n]) + y[n], np.sum(stiffness * y[:n]) * self.rms_height / nominal
            )

        operator = LinearOperator((n + 1, n + 1), matvec=apply, dtype=float)
        size = min(n + 1, _KRYLOV)
        x, _ = gmres(operator, -np.append(*point), rtol=_LINEAR_TOLERANCE, atol=0.0, restart=size, maxiter=4)
        return x * self.rms_height


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


def union_area_fraction(discs: Discs, surface: Surface) -> float:
    """Area of the union of discs over the nominal one, exact where they are apart.

    Where they overlap it is cut off cell by cell, on a finer grid than the surface's.
    """
    cover = contact_cover(surface.refined(_DISC_REFINEMENT), discs)
    return float(np.mean(np.minimum(cover, 1.0)))
