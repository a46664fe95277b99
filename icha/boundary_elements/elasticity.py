"""Pressures of a contact whose front stands still: displacement given in contact, bonds at its front, none outside."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from icha.boundary_elements.front import COMPLIANCE, Front, neighbours
from icha.boundary_elements.kernel import HalfSpace
from icha.contact.failures import FullContact, NotConverged

# Compliance of a lone cell, h/E*, for the conditioning of bonds.
_CELL = 1.12
_MAX_ITERATIONS = 300
# What a correction in single precision leaves of the error, at best and at worst; and how far below what is asked.
_GAIN, _LEAST_GAIN, _MARGIN = 1e-4, 0.5, 0.5
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

    Corrections are found in single precision, and what they leave is found in double.

    Parameters
    ----------
    touching : (n, n) of bool. bonds, wanted : (n, n), compliances and displacements. pressure : (n, n), to start from.
    tolerance : of the displacement, in cells.

    Raises
    ------
    NotConverged
        If that is not reached.
    """
    cells = np.flatnonzero(touching)
    wanted, bonds = wanted.ravel()[cells], bonds.ravel()[cells]
    p = np.where(touching, pressure, 0.0)
    before = np.inf
    while True:
        displaced = space.displacement(p) if p.any() else np.zeros_like(p)
        r = wanted - displaced.ravel()[cells] - bonds * p.ravel()[cells]
        error = np.abs(r).max(initial=0.0)
        if error <= tolerance:
            return p, displaced
        if not error <= _LEAST_GAIN * before:
            raise NotConverged(f"pressures at a given contact were not found (displacement off by {error:.1e} cells)")
        before = error
        accuracy = max(_GAIN, _MARGIN * tolerance / error)
        p.ravel()[cells] += error * _correction(space, cells, bonds.astype(np.float32), r / error, accuracy)


def _correction(space, cells, bonds, wanted, accuracy):
    """The pressure p with (K + bonds) p = wanted at given cells, (k,), to an accuracy of that.

    Conjugate gradients, with the inverse of the free half-space as preconditioner. Single precision.
    """
    field = np.zeros((space.grid, space.grid), np.float32)

    def on_cells(filtered, values):
        field.ravel()[cells] = values
        return filtered(field).ravel()[cells]

    scale = np.sqrt(_CELL / (_CELL + bonds))
    r = wanted.astype(np.float32)
    p, way, rho = np.zeros_like(r), np.zeros_like(r), np.float32(1.0)
    for count in range(_MAX_ITERATIONS):
        if np.abs(r).max() <= accuracy:
            break
        z = scale * on_cells(space.pressure, scale * r)
        new = np.vdot(r, z)
        way = z + (new / rho) * way if count else z
        rho = new
        image = on_cells(space.displacement, way) + bonds * way
        step = rho / np.vdot(way, image)
        p += step * way
        r -= step * image
    return p


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

    Raises
    ------
    FullContact
        If there is contact everywhere.
    NotConverged
        If pressures or the contact under pressure are not found.
    """
    overlap = heights - separation
    open_before = fraction <= 0
    for _ in range(_MAX_CHANGES):
        touching = fraction > 0
        if touching.all():
            raise FullContact("the contact runs over the whole surface")
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
