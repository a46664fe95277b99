"""Pressures of a contact whose front stands still: displacement given in contact, bonds at its front, none outside."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from icha.boundary_elements.front import COMPLIANCE, Front, neighbours
from icha.boundary_elements.kernel import HalfSpace
from icha.boundary_elements.regions import beside, merged
from icha.contact.failures import FullContact, NotConverged

# Compliance of a lone cell, h/E*, for the conditioning of bonds; and that of the shortest waves, 2/q, the least.
_CELL = 1.12
_LEAST_COMPLIANCE = np.sqrt(2) / np.pi
_MAX_ITERATIONS = 300
# Displacements in single precision are off by so much of the largest.
_ROUNDING = 5e-7
# What a correction in single precision leaves of the error, at best and at worst; and how far below what is asked.
_GAIN, _LEAST_GAIN, _MARGIN = 1e-4, 0.5, 0.5
_MAX_CHANGES = 200
# A fraction of a cell that is no contact: what its bond carries is lost in the rounding of all others.
NOTHING = 1e-9
# What is left of the error while cells still come and go.
_WHILE_CHANGING = 0.1


@dataclass(frozen=True, eq=False)
class Contact:
    """The k cells in contact. Lengths in cells, pressures in E*.

    cells: counted through, rising. fraction: of contact, (k,), positive. pressure: mean of a cell, (k,), negative in
    tension.
    """

    cells: np.ndarray
    fraction: np.ndarray
    pressure: np.ndarray

    def with_closed(self, cells: np.ndarray) -> Contact:
        """The same with these cells, (m,), wholly in contact."""
        together = np.union1d(self.cells, cells)
        fraction, pressure = np.zeros(len(together)), np.zeros(len(together))
        old = np.searchsorted(together, self.cells)
        fraction[old], pressure[old] = self.fraction, self.pressure
        fraction[np.searchsorted(together, cells)] = 1.0
        return Contact(together, fraction, pressure)

    def changed(self, fraction: np.ndarray, pressure: np.ndarray) -> Contact:
        """The same after changes of fraction and pressure, (k,), without cells that are next to out of contact."""
        fraction = np.clip(self.fraction + fraction, 0.0, 1.0)
        touching = fraction > NOTHING
        return Contact(self.cells[touching], fraction[touching], (self.pressure + pressure)[touching])


@dataclass(frozen=True, eq=False)
class Held(Contact):
    """A contact in elastic equilibrium.

    gap: at the nodes, (n, n). off: by how much the displacement may be, in contact. energy: elastic, of the half-space
    and the bonds, in E* cells^3; unsure: by how much it may be larger. around: mean fraction around each of its cells,
    (k,). rim: the cells beside, rising, (m,), and around_rim: the same there.
    """

    gap: np.ndarray = field(repr=False)
    off: float
    energy: float
    unsure: float
    around: np.ndarray = field(repr=False)
    rim: np.ndarray = field(repr=False)
    around_rim: np.ndarray = field(repr=False)


@dataclass(frozen=True, eq=False)
class Topography:
    """Heights of a surface, (n, n) or (t, n, n), in cells, in both precisions that gaps are computed in.

    largest: height, up or down.
    """

    double: np.ndarray
    single: np.ndarray
    largest: float

    @classmethod
    def of(cls, heights: np.ndarray) -> Topography:
        """The topography of heights in double precision."""
        return cls(heights, heights.astype(np.float32), float(max(heights.max(), -heights.min())))

    @property
    def rounding(self) -> float:
        """By how much displacements in single precision are off, in cells."""
        return _ROUNDING * self.largest

    def gap(self, displaced: np.ndarray, separation: float, cells: np.ndarray, known: np.ndarray) -> np.ndarray:
        """The gap at a separation, in the place and precision of the displacements, a field.

        known: gap on cells in contact, (k,), where it is known better than from a difference of displacements.
        """
        displaced -= self.single if displaced.dtype == np.float32 else self.double
        displaced += displaced.dtype.type(separation)
        displaced.ravel()[cells] = known
        return displaced


def solve_bonds(
    space: HalfSpace,
    cells: np.ndarray,
    bonds: np.ndarray,
    wanted: np.ndarray,
    pressure: np.ndarray,
    tolerance: float,
    kind: type = float,
    *,
    gain: float = 0.0,
    balanced: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Pressures p with (K + bonds) p = wanted on cells, zero elsewhere; and what is left of `wanted`.

    Corrections are computed in single precision, the remaining error in double precision.

    Parameters
    ----------
    cells : (k,), counted through. bonds, wanted : (k,), compliances and displacements. pressure : (k,), to start from.
    tolerance : of the displacement, in cells. kind : np.float32 for displacements, (n, n), in single precision. gain :
    in single precision, what may be left of the error at the start. balanced : the sum of the pressures does not
    change, and `wanted` is met up to a constant.

    Raises
    ------
    NotConverged
        If that is not reached.
    """
    p, before, inverse = pressure, np.inf, space.nearly_inverse(cells)
    while True:
        r = wanted - space.displacement(cells, p.astype(kind), cells) - bonds * p
        if balanced:
            r -= np.mean(r)
        error = np.abs(r).max(initial=0.0)
        if error <= tolerance:
            return p, r
        if not error <= _LEAST_GAIN * before:
            raise NotConverged(f"pressures at a given contact were not found (displacement off by {error:.1e} cells)")
        before = error
        accuracy = max(gain if kind == np.float32 else _GAIN, _MARGIN * tolerance / error)
        change, left = _correction(space, inverse, cells, bonds, r / error, accuracy, balanced)
        p = p + error * change
        if kind == np.float32:
            if np.abs(left).max() > accuracy:
                raise NotConverged(f"pressures at a given contact were not found (to {accuracy:.1e})")
            return p, error * left


def _correction(space, inverse, cells, bonds, wanted, accuracy, balanced):
    """The pressure p with (K + bonds) p = wanted on cells, (k,), to an accuracy of that; and what is left.

    Conjugate gradients, with the approximate inverse of the half-space as preconditioner. Single precision.
    """
    scale, bonds = np.sqrt(_CELL / (_CELL + bonds)).astype(np.float32), bonds.astype(np.float32)
    r = wanted.astype(np.float32)
    p, way, rho = np.zeros_like(r), np.zeros_like(r), np.float32(1.0)
    for count in range(_MAX_ITERATIONS):
        if np.abs(r).max() <= accuracy:
            break
        z = scale * inverse(scale * r)
        if balanced:
            z -= np.mean(z)
        new = np.vdot(r, z)
        way = z + (new / rho) * way if count else z
        rho = new
        image = space.displacement(cells, way, cells) + bonds * way
        step = rho / np.vdot(way, image)
        p += step * way
        r -= step * image
        if balanced:
            r -= np.mean(r)
    return p, r


def held(
    space: HalfSpace,
    topography: Topography,
    separation: float,
    contact: Contact,
    tolerance: float,
    beyond: np.ndarray | None = None,
) -> Held:
    """The elastic equilibrium of given fractions of contact.

    Bonds only pull: cells that are partly in contact and come under pressure close. Where the surfaces would overlap,
    they touch under pressure; the front decides whether they also stick.

    Parameters
    ----------
    contact : with pressures to start from. tolerance : as of `solve_bonds`.
    beyond : what contact outside of these cells adds to the mean fraction around every one, (n, n).

    Raises
    ------
    FullContact
        If there is contact everywhere.
    NotConverged
        If pressures or the contact under pressure are not found.
    """
    kind = np.float32 if tolerance > topography.rounding else float
    cells, fraction, pressure = contact.cells, contact.fraction, contact.pressure
    given = np.ones(len(cells), dtype=bool)
    for _ in range(_MAX_CHANGES):
        if len(cells) == space.size:
            raise FullContact("the contact runs over the whole surface")
        overlap = topography.double.ravel()[cells] - separation
        bonds = COMPLIANCE * (1 / fraction - 1)
        pressure, left = solve_bonds(space, cells, bonds, overlap, pressure, tolerance, kind, gain=_WHILE_CHANGING)
        displaced = space.displacement(cells, pressure.astype(kind))
        gap = topography.gap(displaced, separation, cells, -left - bonds * pressure)
        closing = (pressure > 0) & (fraction < 1)
        leaving = ~given & (pressure < 0)
        overlapping = gap < -max(tolerance, float(np.abs(left).max(initial=0.0)))
        overlapping.ravel()[cells] = False
        joining = np.flatnonzero(overlapping)
        if not closing.any() and not leaving.any() and not len(joining):
            if np.abs(left).max(initial=0.0) <= tolerance:
                break
            continue
        fraction, staying = np.where(closing, 1.0, fraction), ~leaving
        cells, fraction, pressure, given = merged(
            cells[staying], joining, (fraction[staying], 1.0), (pressure[staying], 0.0), (given[staying], False)
        )
    else:
        raise NotConverged("the contact under pressure did not settle")
    # The functional whose largest value is the energy: an error of the pressure counts only squared.
    energy = 0.5 * float(np.sum(pressure * (overlap + left)))
    unsure = 0.5 * float(np.sum(left**2 / (_LEAST_COMPLIANCE + bonds)))
    if kind == np.float32:
        unsure += 0.2 * _ROUNDING * float(np.sum(np.abs(pressure * overlap)))
    rim = beside(cells, space.shape)
    near, order = merged(cells, rim, (np.arange(len(cells)), len(cells) + np.arange(len(rim))))
    around = np.empty(len(near))
    around[order] = neighbours(space, cells, fraction.astype(kind), near)
    if beyond is not None:
        around += beyond.ravel()[np.concatenate([cells, rim])]
    around, around_rim = around[: len(cells)], around[len(cells) :]
    return Held(cells, fraction, pressure, gap, tolerance, energy, unsure, around, rim, around_rim)


def intensity(front: Front, state: Held) -> tuple[np.ndarray, np.ndarray]:
    """sqrt(G/dgamma): of cells in contact, (k,), which open above 1, and of those beside, (m,), which close below."""
    inside = -state.pressure / (state.fraction * front.strengths(state.around))
    return inside, state.gap.ravel()[state.rim] / (COMPLIANCE * front.strengths(state.around_rim))
