"""Equilibrium of all contact spots at a given mean separation, load or contact area.

The unknowns are the local approaches delta_i of the spots in contact:

    delta_i + w_i(a(delta)) = h_i - u,        a_i = a_JKR(delta_i),

with w_i the displacement by all other spots and all images (eq. 4) and u the mean separation. Below the jump-off
approach a spot keeps its jump-off radius while the equations are solved (zero for Hertz's law), so that they are
defined everywhere and, without adhesion, smooth: a spot of radius zero exerts nothing, and no decision about who is
in contact has to be taken inside the iteration.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres
from scipy.spatial import cKDTree

from icha.asperities import Asperities
from icha.coalescence import disjoint_pairs, equivalent_spots, overlapping_pairs
from icha.elasticity import Interaction, periodic_difference
from icha.jkr import JKR

# Largest equilibrium error in units of h_rms at which an equilibrium counts as found.
RESIDUAL_TOLERANCE = 1e-10
# Relative error of a load or an area that was asked for.
TARGET_TOLERANCE = 1e-11
# One weighs as much as the other in a solve.
_MISS_WEIGHT = RESIDUAL_TOLERANCE / TARGET_TOLERANCE
_MAX_NEWTON_STEPS = 60
_LINEAR_TOLERANCE = 1e-3
_LINEAR_TOLERANCE_TANGENT = 1e-10
_FREE = -1


class NotConverged(Exception):
    """An equilibrium was not found; the message says what happened."""


@dataclass(frozen=True, eq=False)
class Spots:
    """Contact spots: asperities in contact, single or coalesced. Arrays of length m.

    position (m, 2), height, radius_of_curvature, contact_radius, approach: m. members: asperities merged into it.
    """

    position: np.ndarray
    height: np.ndarray
    radius_of_curvature: np.ndarray
    contact_radius: np.ndarray
    approach: np.ndarray
    members: np.ndarray

    def __len__(self) -> int:
        """Number of spots."""
        return len(self.height)

    def take(self, index) -> Spots:
        """The spots at `index`."""
        return Spots(*(getattr(self, name)[index] for name in self.__dataclass_fields__))

    def append(self, other: Spots) -> Spots:
        """These spots, then the others."""
        return Spots(
            *(np.concatenate([getattr(self, name), getattr(other, name)]) for name in self.__dataclass_fields__)
        )


def no_spots() -> Spots:
    """An empty set of spots."""
    empty = np.empty(0)
    return Spots(np.empty((0, 2)), empty, empty, empty, empty, np.empty(0, dtype=int))


@dataclass(frozen=True, eq=False)
class Contact:
    """The contact problem: a law, the summits of one surface, and the length that makes residuals dimensionless."""

    law: JKR
    asperities: Asperities
    rms_height: float
    jump_in: np.ndarray = field(init=False)

    def __post_init__(self):
        """Evaluate the asperities' jump-in approaches once."""
        object.__setattr__(self, "jump_in", self.law.jump_in_approach(self.asperities.radius))

    @property
    def area(self) -> float:
        """Nominal contact area A0, m^2."""
        return self.asperities.period**2

    def interaction(self, spots: Spots, targets=None) -> Interaction:
        """The elastic interaction of spots, its windows wide enough for a moderate growth."""
        return Interaction(
            self.law,
            self.asperities.period,
            spots.position,
            1.25 * spots.contact_radius,
            spots.radius_of_curvature,
            targets,
        )


@dataclass(frozen=True, eq=False)
class ContactState:
    """An equilibrium of the contact.

    owner (n,): for every asperity the index of the spot that it is, or is part of, or lies under; -1 where free.
    separation_response (m,): d(delta)/du of every spot, good enough to predict the next step. Event counts
    accumulate along the path.
    pending: free asperities beyond their jump-in approach that were left free because they had broken contact at
    the same separation before.
    """

    separation: float
    spots: Spots
    owner: np.ndarray
    separation_response: np.ndarray
    residual: float = 0.0
    jump_ins: int = 0
    jump_offs: int = 0
    coalescences: int = 0
    pending: int = 0

    def same_contacts(self, other: ContactState) -> bool:
        """Whether both states have the same spots made of the same asperities."""
        return np.array_equal(self.owner, other.owner) and len(self.spots) == len(other.spots)


def mean_pressure(contact: Contact, spots: Spots) -> float:
    """Total force over nominal area, Pa."""
    return float(np.sum(contact.law.force(spots.contact_radius, spots.radius_of_curvature))) / contact.area


def area_fraction(contact: Contact, spots: Spots) -> float:
    """Total contact area over nominal area."""
    return float(np.sum(np.pi * spots.contact_radius**2)) / contact.area


def contact_stiffness(contact: Contact, state: ContactState) -> float:
    """-dp/du of the present spots, Pa/m, from the tangent of the equilibrium."""
    spots, law = state.spots, contact.law
    R, a = spots.radius_of_curvature, spots.contact_radius
    response = _separation_response(contact, spots, _LINEAR_TOLERANCE_TANGENT)
    growth = _radius_response(law, a, R, spots.approach) * response
    return 0.0 - float(np.sum(law.force_derivative(a, R) * growth)) / contact.area


def untouched(contact: Contact) -> ContactState:
    """The state at which the first asperity is about to make contact."""
    return ContactState(
        separation=float(np.max(contact.asperities.height - contact.jump_in)),
        spots=no_spots(),
        owner=np.full(len(contact.asperities), _FREE),
        separation_response=np.empty(0),
    )


def _radius_response(law: JKR, a, R, approach):
    """da/d(delta), zero for spots past jump-off; bounded close to it, where it is infinite."""
    slope = np.zeros(len(a))
    touching = (a > 0) & (approach > law.jump_off_approach(R))
    slope[touching] = 1 / np.maximum(law.approach_derivative(a[touching], R[touching]), 1e-3 * (a / R)[touching])
    return slope


@dataclass(frozen=True)
class Control:
    """A quantity to hold during a solve: "pressure" (Pa) or "area_fraction", and its value."""

    quantity: str
    target: float

    def value_and_gradient(self, contact: Contact, a, R):
        """Value of the quantity and its derivative with respect to the contact radii (m,)."""
        if self.quantity == "pressure":
            gradient = contact.law.force_derivative(a, R) / contact.area
            return float(np.sum(contact.law.force(a, R))) / contact.area, gradient
        return float(np.sum(np.pi * a**2)) / contact.area, 2 * np.pi * a / contact.area


def balance(contact: Contact, spots: Spots, separation: float, control: Control | None = None):
    """Solve the equations of a fixed set of spots by Newton-Krylov with a line search.

    Parameters
    ----------
    spots : the set; their approaches are the first guess.
    separation : mean separation u in m; the first guess for it when `control` is given.
    control : a load or an area to hold instead of the separation.

    Returns
    -------
    spots, separation, residual (largest error over h_rms).

    Raises
    ------
    NotConverged
        If the error stays above RESIDUAL_TOLERANCE.
    """
    law, R = contact.law, spots.radius_of_curvature
    if not len(spots):
        return spots, separation, 0.0
    interaction = contact.interaction(spots)

    def evaluate(delta, u):
        a = law.contact_radius(delta, R)
        error = delta + interaction.displacement(a) + u - spots.height
        if control is None:
            return a, error, 0.0, None
        value, gradient = control.value_and_gradient(contact, a, R)
        return a, error, value - control.target, gradient

    def worst(error, miss):
        size = float(np.max(np.abs(error))) / contact.rms_height
        return size if control is None else max(size, abs(miss) / abs(control.target) * _MISS_WEIGHT)

    delta, u = spots.approach.copy(), separation
    a, error, miss, gradient = evaluate(delta, u)
    size = worst(error, miss)
    for _ in range(_MAX_NEWTON_STEPS):
        if size <= RESIDUAL_TOLERANCE:
            break
        solve, response_of = _linearised(law, interaction, a, R, delta)
        step, du = solve(-error, _LINEAR_TOLERANCE), 0.0
        if control is not None:
            along = solve(-np.ones(len(a)), _LINEAR_TOLERANCE)
            slope = float(np.sum(gradient * response_of * along))
            if slope == 0:
                raise NotConverged(f"{control.quantity} does not depend on the separation")
            du = -(miss + float(np.sum(gradient * response_of * step))) / slope
            du = float(np.clip(du, -0.2 * contact.rms_height, 0.2 * contact.rms_height))
            step = step + du * along
        for halving in range(12):
            fraction = 0.5**halving
            trial = delta + fraction * step
            new = evaluate(trial, u + fraction * du)
            new_size = worst(new[1], new[2])
            if new_size < (1 - 0.1 * fraction) * size:
                break
        else:
            raise NotConverged(f"no descent from an equilibrium error of {size:.2e} h_rms with {len(a)} spots")
        delta, u = trial, u + fraction * du
        (a, error, miss, gradient), size = new, new_size
    else:
        raise NotConverged(f"equilibrium error {size:.2e} h_rms after {_MAX_NEWTON_STEPS} Newton steps")
    residual = float(np.max(np.abs(error))) / contact.rms_height
    return replace(spots, contact_radius=a, approach=delta), u, residual


def _separation_response(contact: Contact, spots: Spots, tolerance: float):
    """d(delta)/du of every spot (m,) at an equilibrium."""
    if not len(spots):
        return np.empty(0)
    a, R = spots.contact_radius, spots.radius_of_curvature
    solve, _ = _linearised(contact.law, contact.interaction(spots), a, R, spots.approach)
    return solve(-np.ones(len(a)), tolerance)


def _linearised(law, interaction, a, R, delta):
    """A solver of the linearised equilibrium, (1 + W' da/d(delta)) x = b, and da/d(delta)."""
    radius_response = _radius_response(law, a, R, delta)
    # A spot of radius zero has no tangent; one too small to matter stands for it, and its radius_response is zero.
    tangent = interaction.tangent(np.where(a > 0, a, np.finfo(float).tiny ** 0.25))
    size = len(a)
    operator = LinearOperator((size, size), matvec=lambda x: x + tangent(radius_response * x), dtype=float)

    def solve(b, tolerance):
        x, failed = gmres(operator, b, rtol=tolerance, atol=0.0, restart=min(size, 80), maxiter=20)
        if failed or not np.all(np.isfinite(x)):
            raise NotConverged(f"the linear solve for {size} spots did not converge")
        return x

    return solve, radius_response


def equilibrium(contact: Contact, state: ContactState, separation: float) -> ContactState:
    """Bring the contact from one state to another mean separation.

    Spots past jump-off are dropped, free asperities beyond jump-in join, asperities under a spot are taken into it
    and overlapping spots coalesce, all that apply at once, until nothing changes. That ends: without adhesion spots
    are only added or united (one of radius zero is harmless and is removed at the end); with adhesion an asperity
    that has broken contact here may not make it again at this separation (`pending` counts those that would, and
    without adhesion those left by a united spot that let go).

    Raises
    ------
    NotConverged
        If one of the equilibria is not found.
    """
    law, asperities, period = contact.law, contact.asperities, contact.asperities.period
    adhesive = law.material.surface_energy > 0
    owner = state.owner.copy()
    spots = replace(
        state.spots,
        approach=state.spots.approach + state.separation_response * (separation - state.separation),
    )
    spots = replace(spots, contact_radius=law.contact_radius(spots.approach, spots.radius_of_curvature))
    locked = np.zeros(len(asperities), dtype=bool)
    jump_ins, jump_offs, coalescences = state.jump_ins, state.jump_offs, state.coalescences

    while True:
        spots, _, residual = balance(contact, spots, separation)
        changed = False

        if adhesive:
            off = _broken(law, spots)
            if off.any():
                changed = True
                jump_offs += int(np.count_nonzero(off))
                locked |= (owner != _FREE) & off[owner]
                spots, owner = _remove(spots, owner, off)

        free = np.flatnonzero(owner == _FREE)
        w = contact.interaction(spots, asperities.position[free]).displacement(spots.contact_radius)
        approach = asperities.height[free] - separation - w
        under = _covering_spot(spots, asperities.position[free], period)
        owner[free[under >= 0]] = under[under >= 0]
        ready = (approach >= contact.jump_in[free]) & (under < 0)
        if not adhesive:
            ready &= approach > 0
        pending = int(np.count_nonzero(ready & locked[free]))
        ready &= ~locked[free]
        if ready.any():
            changed = True
            joining = free[ready]
            jump_ins += len(joining)
            owner[joining] = len(spots) + np.arange(len(joining))
            R = asperities.radius[joining]
            spots = spots.append(
                Spots(
                    position=asperities.position[joining],
                    height=asperities.height[joining],
                    radius_of_curvature=R,
                    contact_radius=law.contact_radius(approach[ready], R),
                    approach=approach[ready],
                    members=np.ones(len(joining), dtype=int),
                )
            )
        else:
            pairs = disjoint_pairs(overlapping_pairs(spots.position, spots.contact_radius, period))
            if len(pairs):
                changed = True
                coalescences += len(pairs)
                spots, owner = coalesce(contact, spots, owner, pairs, separation)
        if not changed:
            break

    if not adhesive:
        idle = _broken(law, spots)
        if idle.any():
            jump_offs += int(np.count_nonzero(idle))
            freed = np.flatnonzero((owner != _FREE) & idle[owner])
            spots, owner = _remove(spots, owner, idle)
            # Asperities of a united spot that let go may lie in the half-space; the next equilibrium takes them up.
            w = contact.interaction(spots, asperities.position[freed]).displacement(spots.contact_radius)
            pending = int(np.count_nonzero(asperities.height[freed] - separation - w > 0))
    response = _separation_response(contact, spots, _LINEAR_TOLERANCE)
    return ContactState(separation, spots, owner, response, residual, jump_ins, jump_offs, coalescences, pending)


def hold(contact: Contact, state: ContactState, control: Control) -> ContactState:
    """The equilibrium of the same spots at a given load or area: the separation is an unknown.

    Spots that end past jump-off are dropped.

    Raises
    ------
    NotConverged
        If it is not found.
    """
    spots, owner, separation, jump_offs = state.spots, state.owner, state.separation, state.jump_offs
    while True:
        spots, separation, residual = balance(contact, spots, separation, control)
        off = _broken(contact.law, spots)
        if not off.any():
            break
        spots, owner = _remove(spots, owner, off)
        jump_offs += int(np.count_nonzero(off))
        if not len(spots):
            raise NotConverged(f"all contacts break before {control.quantity} = {control.target:.6g}")
    return replace(
        state,
        spots=spots,
        owner=owner,
        separation=separation,
        separation_response=_separation_response(contact, spots, _LINEAR_TOLERANCE),
        residual=residual,
        jump_offs=jump_offs,
    )


def coalesce(contact: Contact, spots: Spots, owner, pairs, separation: float):
    """Replace disjoint pairs (k, 2) of spots by their equivalents, whose heights keep the radius a_eq at hand.

    Returns the new spots (the others first, in their order) and the asperities' new owners.
    """
    first, second = spots.take(pairs[:, 0]), spots.take(pairs[:, 1])
    centre, a, R = equivalent_spots(
        first.position,
        first.contact_radius,
        first.radius_of_curvature,
        second.position,
        second.contact_radius,
        second.radius_of_curvature,
        contact.asperities.period,
    )
    approach = contact.law.approach(a, R)
    merged = Spots(centre, np.zeros(len(a)), R, a, approach, first.members + second.members)
    gone = np.zeros(len(spots), dtype=bool)
    gone[pairs] = True
    index = np.cumsum(~gone) - 1
    index[pairs] = np.count_nonzero(~gone) + np.arange(len(pairs))[:, None]
    owner = np.append(index, _FREE)[owner]  # owner -1 looks up the last
    spots = spots.take(~gone).append(merged)
    w = contact.interaction(spots).displacement(spots.contact_radius)
    height = spots.height.copy()
    height[-len(a) :] = separation + approach + w[-len(a) :]
    return replace(spots, height=height), owner


def _broken(law, spots):
    """Whether each spot lies past jump-off, where it has no contact: (m,) of bool."""
    off = law.jump_off_approach(spots.radius_of_curvature)
    return spots.approach < off if law.material.surface_energy > 0 else spots.approach <= 0


def _remove(spots, owner, gone):
    """The spots without those marked, whose asperities become free."""
    index = np.append(np.where(gone, _FREE, np.cumsum(~gone) - 1), _FREE)  # owner -1 looks up the last
    return spots.take(~gone), index[owner]


def _covering_spot(spots, points, period):
    """For every point the spot whose contact it lies in (the one with the deepest cover), -1 where none."""
    covering = np.full(len(points), _FREE)
    if not len(points) or not len(spots):
        return covering
    tree = cKDTree(np.mod(points, period), boxsize=period)
    found = tree.query_ball_point(
        np.mod(spots.position, period), np.minimum(spots.contact_radius, 0.5 * period), return_sorted=True
    )
    best = np.zeros(len(points))
    for spot in np.flatnonzero([len(f) > 0 for f in found]):
        index = np.asarray(found[spot], dtype=int)
        r = np.hypot(*periodic_difference(points[index], spots.position[spot], period).T)
        depth = spots.contact_radius[spot] - r
        deeper = depth > best[index]
        covering[index[deeper]] = spot
        best[index[deeper]] = depth[deeper]
    return covering
