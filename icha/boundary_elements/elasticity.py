"""Pressures of a contact whose front stands still: displacement given in contact, bonds at its front, none outside."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from icha.boundary_elements.front import COMPLIANCE, Front, neighbours
from icha.boundary_elements.kernel import HalfSpace
from icha.contact.failures import NotConverged

# Compliance of a lone cell, h/E*, for the conditioning of bonds.
_CELL = 1.12
_MAX_ITERATIONS = 300
_MAX_CHANGES = 200


@dataclass(frozen=True, eq=False)
class Held:
    """A contact of given fractions, in elastic equilibrium. All (n, n); lengths in cells, pressures in E*.

    fraction: of contact. pressure: mean of a cell, negative in tension. gap: at the nodes. around: of the front.
    energy: elastic, of the half-space and the bonds, in E* cells^3.
    """

    fraction: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    energy: float
    around: np.ndarray = field(repr=False)


def solve_bonds(
    space: HalfSpace,
    touching: np.ndarray,
    bonds: np.ndarray,
    wanted: np.ndarray,
    pressure: np.ndarray,
    tolerance: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Pressures p with (K + bonds) p = wanted where `touching`, zero elsewhere; and K p everywhere.

    Conjugate gradients, with the inverse of the free half-space as preconditioner.

    Parameters
    ----------
    touching : (n, n) of bool. bonds, wanted : (n, n), compliances and displacements. pressure : (n, n), to start from.
    tolerance : of the displacement, in cells.

    Raises
    ------
    NotConverged
        If that is not reached.
    """
    p = np.where(touching, pressure, 0.0)
    scale = np.where(touching, np.sqrt(_CELL / (_CELL + bonds)), 0.0)
    displaced = space.displacement(p) if p.any() else np.zeros_like(p)
    r = np.where(touching, wanted - displaced - bonds * p, 0.0)
    way, rho = np.zeros_like(p), 1.0
    for count in range(_MAX_ITERATIONS):
        if np.abs(r).max() <= tolerance:
            return p, displaced
        z = scale * space.pressure(scale * r)
        new = float(np.vdot(r, z))
        way = z + (new / rho) * way if count else z
        rho = new
        moved = space.displacement(way)
        image = np.where(touching, moved + bonds * way, 0.0)
        step = rho / float(np.vdot(way, image))
        p = p + step * way
        displaced = displaced + step * moved
        r = r - step * image
    raise NotConverged(f"pressures at a given contact were not found (displacement off by {np.abs(r).max():.1e} cells)")


def held(
    space: HalfSpace,
    heights: np.ndarray,
    separation: float,
    fraction: np.ndarray,
    pressure: np.ndarray,
    tolerance: float,
) -> Held:
    """The elastic equilibrium of given fractions of contact.

    Bonds pull only: cells that are partly in contact and come under pressure close. Where the surfaces would overlap
    they touch, under pressure: whether they also stick is for the front to say.

    Parameters
    ----------
    heights : (n, n), cells. fraction, pressure : (n, n), the latter to start from. tolerance : as of `solve_bonds`.
    """
    overlap = heights - separation
    open_before = fraction <= 0
    for _ in range(_MAX_CHANGES):
        touching = fraction > 0
        bonds = COMPLIANCE * (1 / np.where(touching, fraction, 1.0) - 1)
        pressure, displaced = solve_bonds(space, touching, bonds, overlap, pressure, tolerance)
        closing = np.where(touching, (pressure > 0) & (fraction < 1), displaced - overlap < -tolerance)
        leaving = touching & open_before & (pressure < 0)
        if not closing.any() and not leaving.any():
            break
        fraction = np.where(closing, 1.0, np.where(leaving, 0.0, fraction))
    else:
        raise NotConverged("the contact under pressure did not settle")
    # The functional whose largest value is the energy: an error of the pressure counts only squared.
    residual = np.where(touching, overlap - displaced - bonds * pressure, 0.0)
    energy = 0.5 * float(np.vdot(pressure, overlap + residual))
    return Held(fraction, pressure, displaced - overlap, energy, neighbours(fraction))


def front_tension(front: Front, held: Held) -> np.ndarray:
    """sqrt(G/dgamma) of every cell, (n, n): above 1 a cell in contact opens, below 1 an open one closes."""
    strengths = front.strengths(held.around)
    touching = held.fraction > 0
    return (
        np.where(touching, -held.pressure / np.where(touching, held.fraction, 1.0), held.gap / COMPLIANCE) / strengths
    )
